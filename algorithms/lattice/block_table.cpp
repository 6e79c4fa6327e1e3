#include "algorithms/lattice/block_table.h"

#include <algorithm>

namespace hermesh {
namespace {

/// Fibonacci hashing (Knuth, vol. 3, §6.4): 2⁶⁴ divided by the golden ratio spreads neighbouring coordinates,
/// and the shift brings the well mixed upper bits down, because the slot is taken from the lower ones.
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
  // At most half of the slots are taken, so that every search below meets an empty one and ends.
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
  // The walk is that of insert(): a tile that is there lies before the first empty slot. An
  // empty slot holds kNone itself.
  if (slots_.empty()) return kNone;
  std::size_t slot = hash(tile) & (slots_.size() - 1);
  while (slots_[slot] != kNone && tiles_[slots_[slot]] != tile) slot = (slot + 1) & (slots_.size() - 1);
  return slots_[slot];
}

void TileNumbers::grow() {
  slots_.assign(std::max<std::size_t>(16, 4 * (tiles_.size() + 1)), kNone);
  // The number of slots is a power of two, so that a mask takes the place of a division.
  std::size_t size = 1;
  while (size < slots_.size()) size *= 2;
  slots_.assign(size, kNone);
  // Tiles keep their numbers: only the way to them is laid anew.
  for (std::uint32_t i = 0; i < tiles_.size(); ++i) {
    std::size_t slot = hash(tiles_[i]) & (size - 1);
    while (slots_[slot] != kNone) slot = (slot + 1) & (size - 1);
    slots_[slot] = i;
  }
}

void BlockSet::select(const BlockAt& tile) {
  last_tile_ = tile;
  last_ = numbers_.insert(tile);
  // A tile that is new has the next number, which is the size of `masks_` until its mask is there.
  if (last_ == masks_.size()) masks_.push_back({});
}

BlockTable::BlockTable(const std::vector<BlockSet>& parts) {
  for (const BlockSet& part : parts)
    for (std::size_t i = 0; i < part.masks_.size(); ++i)
      tiles_.push_back({part.numbers_.tiles()[i], part.masks_[i], {}});
  // Sorted by their coordinates, tiles of different sets stand beside each other, in an order that does not
  // depend on how the work was spread over threads.
  std::sort(tiles_.begin(), tiles_.end(), [](const Tile& a, const Tile& b) { return a.at < b.at; });
  // One tile is kept of each place, with the blocks of all sets that have it.
  std::size_t kept = 0;
  for (const Tile& tile : tiles_) {
    if (kept > 0 && tiles_[kept - 1].at == tile.at)
      for (int x = 0; x < 8; ++x) tiles_[kept - 1].mask[x] |= tile.mask[x];
    else
      tiles_[kept++] = tile;
  }
  tiles_.resize(kept);
  tiles_.shrink_to_fit();
  // Inserted in order, a tile gets as its number its place in `tiles_`, which find() and translation() rely
  // on.
  for (Tile& tile : tiles_) {
    numbers_.insert(tile.at);
    for (int x = 0; x < 8; ++x) {
      tile.first[x] = std::uint32_t(size_);
      size_ += std::size_t(__builtin_popcountll(tile.mask[x]));
    }
  }
}

// The order of the bits is that in which number() counts them, so that entry i is block i.
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
