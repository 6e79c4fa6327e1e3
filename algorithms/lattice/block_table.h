// A sparse set of 8³ blocks of voxels, numbered, that costs memory for what is there and not for the space
// around it.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

namespace hermesh {

/// Coordinates of a block, which are those of its first voxel divided by 8; or of a tile of 8³ blocks, which
/// are those of its first block divided by 8.
using BlockAt = std::array<std::int32_t, 3>;

/// Coordinates of the tile that holds the block.
inline BlockAt tile_of(const BlockAt& block) { return {block[0] >> 3, block[1] >> 3, block[2] >> 3}; }
/// Word (x) and bit (y, z) of a block within its tile, or of a voxel within its block, as one number.
inline unsigned place_in_tile(const BlockAt& block) {
  return unsigned(block[0] & 7) << 6 | unsigned(block[1] & 7) << 3 | unsigned(block[2] & 7);
}

/// A hash table with open addressing that numbers tiles from 0 on, in the order in which they are inserted.
class TileNumbers {
 public:
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  /// Number of the tile, which gets the next one if it has none.
  std::uint32_t insert(const BlockAt& tile);
  /// Number of the tile, or kNone.
  std::uint32_t find(const BlockAt& tile) const;
  /// Coordinates of all tiles, by number.
  const std::vector<BlockAt>& tiles() const { return tiles_; }

 private:
  void grow();
  std::vector<BlockAt> tiles_;
  std::vector<std::uint32_t> slots_;
};

/// Collects blocks in any order. A set is not safe to share between threads: each thread or piece of work has
/// its own, and BlockTable joins them.
class BlockSet {
 public:
  /// Adds a block. The result, tile · 512 + place in it, stands for the block within this set.
  std::uint32_t insert(const BlockAt& block) {
    const BlockAt tile = tile_of(block);
    if (last_ == TileNumbers::kNone || tile != last_tile_) select(tile);
    const unsigned place = place_in_tile(block);
    masks_[last_][place >> 6] |= std::uint64_t(1) << (place & 63);
    return last_ << 9 | place;
  }

  /// Coordinates of the block for which insert() returned `code`.
  BlockAt block(std::uint32_t code) const {
    const BlockAt& tile = numbers_.tiles()[code >> 9];
    return {tile[0] * 8 + std::int32_t(code >> 6 & 7), tile[1] * 8 + std::int32_t(code >> 3 & 7),
            tile[2] * 8 + std::int32_t(code & 7)};
  }

 private:
  friend class BlockTable;
  void select(const BlockAt& tile);
  TileNumbers numbers_;
  std::vector<std::array<std::uint64_t, 8>> masks_;
  BlockAt last_tile_{};
  std::uint32_t last_ = TileNumbers::kNone;
};

/// The union of sets, its blocks numbered tile by tile, the tiles in lexicographic order: the same numbers
/// however the blocks were spread over the sets.
class BlockTable {
 public:
  static constexpr std::uint32_t kNone = TileNumbers::kNone;

  struct Tile {
    BlockAt at;
    std::array<std::uint64_t, 8> mask;
    std::array<std::uint32_t, 8> first;  ///< number of the first block of each word
  };

  BlockTable() = default;
  explicit BlockTable(const std::vector<BlockSet>& parts);

  std::size_t size() const { return size_; }
  const std::vector<Tile>& tiles() const { return tiles_; }
  std::uint32_t find_tile(const BlockAt& tile) const { return numbers_.find(tile); }
  /// Number of a block, or kNone.
  std::uint32_t find(const BlockAt& block) const {
    const std::uint32_t tile = numbers_.find(tile_of(block));
    return tile == kNone ? kNone : number(tiles_[tile], place_in_tile(block));
  }
  /// Number of the block at a place in the tile (place_in_tile()), or kNone.
  static std::uint32_t number(const Tile& tile, unsigned place) {
    const std::uint64_t word = tile.mask[place >> 6], bit = std::uint64_t(1) << (place & 63);
    if (!(word & bit)) return kNone;
    return tile.first[place >> 6] + std::uint32_t(__builtin_popcountll(word & (bit - 1)));
  }
  /// Coordinates of all blocks, by number.
  std::vector<BlockAt> blocks() const;
  /// The number in this table of each tile of `part`, by the tile's number in `part`, which is one of the
  /// sets that the table was made from.
  std::vector<std::uint32_t> translation(const BlockSet& part) const;
  /// Number of the block for which insert() returned `code`; `translation` is that of its set.
  std::uint32_t number(const std::vector<std::uint32_t>& translation, std::uint32_t code) const {
    return number(tiles_[translation[code >> 9]], code & 511);
  }

 private:
  std::vector<Tile> tiles_;
  TileNumbers numbers_;
  std::size_t size_ = 0;
};

/// Finds blocks of a table as BlockTable::find() does, faster where one block lies in the tile of
/// the one before. One to a thread.
class BlockFinder {
 public:
  explicit BlockFinder(const BlockTable& table) : table_(table) {}
  std::uint32_t find(const BlockAt& block) {
    const BlockAt tile = tile_of(block);
    if (!known_ || tile != at_) {
      at_ = tile;
      known_ = true;
      tile_ = table_.find_tile(tile);
    }
    return tile_ == BlockTable::kNone ? BlockTable::kNone
                                      : BlockTable::number(table_.tiles()[tile_], place_in_tile(block));
  }

 private:
  const BlockTable& table_;
  BlockAt at_{};
  bool known_ = false;
  std::uint32_t tile_ = BlockTable::kNone;
};

}  // namespace hermesh
