#include "algorithms/lattice/block_table.h"

#include <algorithm>

namespace hermesh {
namespace {

std::size_t hash(const BlockAt& at) {
  std::uint64_t h = 0;
  for (const std::int32_t c : at) {
    h = (h ^ std::uint32_t(c)) * 0x9E3779B97F4A7C15ull;
    h ^= h >> 29;
  }
  return std::size_t(h);
}

}  // namespace

std::uint32_t TileNumbers::insert(const BlockAt& tile) {
  if (2 * (tiles_.size() + 1) > slots_.size()) grow();
  std::size_t slot = hash(tile) & (slots_.size() - 1);
  while (slots_[slot] != kNone) {
    if (tiles_[slots_[slot]] == tile) return slots_[slot];
    slot = (slot + 1) & (slots_.size() - 1);
  }
  slots_[slot] = std::uint32_t(tiles_.size());
  tiles_.push_back(tile);
  return slots_[slot];
}

std::uint32_t TileNumbers::find(const BlockAt& tile) const {
  if (slots_.empty()) return kNone;
  std::size_t slot = hash(tile) & (slots_.size() - 1);
  while (slots_[slot] != kNone && tiles_[slots_[slot]] != tile) slot = (slot + 1) & (slots_.size() - 1);
  return slots_[slot];
}

void TileNumbers::grow() {
  slots_.assign(std::max<std::size_t>(16, 4 * (tiles_.size() + 1)), kNone);
  std::size_t size = 1;
  while (size < slots_.size()) size *= 2;
  slots_.assign(size, kNone);
  for (std::uint32_t i = 0; i < tiles_.size(); ++i) {
    std::size_t slot = hash(tiles_[i]) & (size - 1);
    while (slots_[slot] != kNone) slot = (slot + 1) & (size - 1);
    slots_[slot] = i;
  }
}

void BlockSet::select(const BlockAt& tile) {
  last_tile_ = tile;
  last_ = numbers_.insert(tile);
  if (last_ == masks_.size()) masks_.push_back({});
}

BlockTable::BlockTable(const std::vector<BlockSet>& parts) {
  for (const BlockSet& part : parts)
    for (std::size_t i = 0; i < part.masks_.size(); ++i)
      tiles_.push_back({part.numbers_.tiles()[i], part.masks_[i], {}});
  std::sort(tiles_.begin(), tiles_.end(), [](const Tile& a, const Tile& b) { return a.at < b.at; });
  std::size_t kept = 0;
  for (const Tile& tile : tiles_) {
    if (kept > 0 && tiles_[kept - 1].at == tile.at)
      for (int x = 0; x < 8; ++x) tiles_[kept - 1].mask[x] |= tile.mask[x];
    else
      tiles_[kept++] = tile;
  }
  tiles_.resize(kept);
  tiles_.shrink_to_fit();
  for (Tile& tile : tiles_) {
    numbers_.insert(tile.at);
    for (int x = 0; x < 8; ++x) {
      tile.first[x] = std::uint32_t(size_);
      size_ += std::size_t(__builtin_popcountll(tile.mask[x]));
    }
  }
}

std::vector<BlockAt> BlockTable::blocks() const {
  std::vector<BlockAt> result;
  result.reserve(size_);
  for (const Tile& tile : tiles_)
    for (int x = 0; x < 8; ++x)
      for (std::uint64_t bits = tile.mask[x]; bits; bits &= bits - 1) {
        const int place = __builtin_ctzll(bits);
        result.push_back({tile.at[0] * 8 + x, tile.at[1] * 8 + place / 8, tile.at[2] * 8 + place % 8});
      }
  return result;
}

std::vector<std::uint32_t> BlockTable::translation(const BlockSet& part) const {
  std::vector<std::uint32_t> result;
  for (const BlockAt& tile : part.numbers_.tiles()) result.push_back(numbers_.find(tile));
  return result;
}

}  // namespace hermesh
