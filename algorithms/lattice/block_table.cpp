#include "algorithms/lattice/block_table.h"

#include <algorithm>

namespace hermesh {
std::uint32_t TileNumbers::insert(const BlockAt& tile) {
  const auto [entry, is_new] = numbers_.try_emplace(tile, std::uint32_t(tiles_.size()));
  if (is_new) tiles_.push_back(tile);
  return entry->second;
}

std::uint32_t TileNumbers::find(const BlockAt& tile) const {
  const auto entry = numbers_.find(tile);
  return entry == numbers_.end() ? kNone : entry->second;
}

void BlockSet::select(const BlockAt& tile) {
  last_tile_ = tile;
  last_ = numbers_.insert(tile);
  // A new tile has the next number.
  if (last_ == masks_.size()) masks_.push_back({});
}

BlockTable::BlockTable(const std::vector<BlockSet>& parts) {
  for (const BlockSet& part : parts)
    for (std::size_t i = 0; i < part.masks_.size(); ++i)
      tiles_.push_back({part.numbers_.tiles()[i], part.masks_[i], {}});
  // By coordinates: equal tiles of different sets are adjacent, in an order that does not depend on the
  // threads.
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
  // Inserted in order, a tile gets its index in `tiles_` as number.
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
