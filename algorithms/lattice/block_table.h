// A sparse, numbered set of 8³ blocks of voxels. Its memory is proportional to the number of blocks, not to
// the volume of their bounding box.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <unordered_map>
#include <vector>

namespace hermesh {

/// Coordinates of a block, which are those of its first voxel divided by 8; or of a tile of 8³ blocks, which
/// are those of its first block divided by 8.
using BlockAt = std::array<std::int32_t, 3>;

/// Returns the coordinates of the tile that holds the block.
inline BlockAt tile_of(const BlockAt& block) { return {block[0] >> 3, block[1] >> 3, block[2] >> 3}; }
/// Returns the word (x) and bit (y, z) of a block within its tile, or of a voxel within its block, as one
/// number.
inline unsigned place_in_tile(const BlockAt& block) {
  return unsigned(block[0] & 7) << 6 | unsigned(block[1] & 7) << 3 | unsigned(block[2] & 7);
}

/// Hash of integer coordinates for std::unordered_map. No result depends on the order of these maps.
struct BlockHash {
  std::size_t operator()(const BlockAt& at) const {
    const auto mix = [](std::uint64_t h) { return (h ^ (h >> 31)) * 0x9e3779b97f4a7c15u; };
    return mix(mix(mix(std::uint32_t(at[0])) + std::uint32_t(at[1])) + std::uint32_t(at[2]));
  }
};

/// Numbers tiles from 0 on, in the order in which they are inserted.
class TileNumbers {
 public:
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  /// Returns the number of the tile, the next one if it is new.
  std::uint32_t insert(const BlockAt& tile);
  /// Returns the number of the tile, or kNone.
  std::uint32_t find(const BlockAt& tile) const;
  /// Returns the coordinates of all tiles, by number.
  const std::vector<BlockAt>& tiles() const { return tiles_; }

 private:
  std::vector<BlockAt> tiles_;
  std::unordered_map<BlockAt, std::uint32_t, BlockHash> numbers_;
};

/// Collects blocks in any order. Not safe to share between threads: each task has its own, and BlockTable
/// joins them.
class BlockSet {
 public:
  /// Adds a block. Returns its code within this set, tile · 512 + place_in_tile().
  std::uint32_t insert(const BlockAt& block) {
    const BlockAt tile = tile_of(block);
    if (last_ == TileNumbers::kNone || tile != last_tile_) select(tile);
    const unsigned place = place_in_tile(block);
    masks_[last_][place >> 6] |= std::uint64_t(1) << (place & 63);
    return last_ << 9 | place;
  }

  /// Returns the coordinates of the block for which insert() returned `code`.
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

/// The union of sets, its blocks numbered tile by tile, the tiles in lexicographic order: the numbers do not
/// depend on the distribution of the blocks over the sets.
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
  /// Returns the number of a block, or kNone.
  std::uint32_t find(const BlockAt& block) const {
    const std::uint32_t tile = numbers_.find(tile_of(block));
    return tile == kNone ? kNone : number(tiles_[tile], place_in_tile(block));
  }
  /// Returns the number of the block at a position in the tile (place_in_tile()), or kNone.
  static std::uint32_t number(const Tile& tile, unsigned place) {
    const std::uint64_t word = tile.mask[place >> 6], bit = std::uint64_t(1) << (place & 63);
    if (!(word & bit)) return kNone;
    return tile.first[place >> 6] + std::uint32_t(__builtin_popcountll(word & (bit - 1)));
  }
  /// Returns the coordinates of all blocks, by number.
  std::vector<BlockAt> blocks() const;
  /// Returns the number in this table of each tile of `part`, by its number in `part`. The table must have
  /// been built from `part`.
  std::vector<std::uint32_t> translation(const BlockSet& part) const;
  /// Returns the number of the block for which insert() returned `code`; `translation` is that of its set.
  std::uint32_t number(const std::vector<std::uint32_t>& translation, std::uint32_t code) const {
    return number(tiles_[translation[code >> 9]], code & 511);
  }

 private:
  std::vector<Tile> tiles_;
  TileNumbers numbers_;
  std::size_t size_ = 0;
};

/// Finds blocks of a table as BlockTable::find() does, faster if a block lies in the tile of the previous
/// one. One per thread.
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
