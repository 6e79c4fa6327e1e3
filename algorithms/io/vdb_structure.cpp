#include "algorithms/io/vdb_structure.h"

#include <openvdb/io/Compression.h>
#include <openvdb/io/GridDescriptor.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <map>
#include <set>
#include <sstream>

#include "algorithms/core/error.h"
#include "algorithms/core/shown.h"

namespace hermesh {
namespace {

namespace fs = std::filesystem;
using openvdb::Coord;
using openvdb::io::GridDescriptor;

constexpr std::string_view kHalfSuffix = "_HalfFloat";
/// Separates a grid's name from its number, see io/GridDescriptor.cc.
constexpr char kSeparator = '\x1e';

/// Layout of the values of a tree in a file and in memory.
struct ValueLayout {
  std::uint32_t bytes = 0;       ///< size of a value
  std::uint32_t half_bytes = 0;  ///< size if reals are saved with half precision; 0: no reals
  enum class Leaf { values, truths, mask } leaf = Leaf::values;
};

/// Returns the layout of a type of tree, null if it is unknown. Leaves of bools hold two masks and leaves of
/// masks one; the types of Hermite data are as large as their voxels (thesis/voxels/voxels.h).
const ValueLayout* layout_of(const std::string& type) {
  using Leaf = ValueLayout::Leaf;
  static const std::map<std::string, ValueLayout> known = {{"bool", {1, 0, Leaf::truths}},
                                                           {"mask", {1, 0, Leaf::mask}},
                                                           {"float", {4, 2, Leaf::values}},
                                                           {"double", {8, 2, Leaf::values}},
                                                           {"int32", {4, 0, Leaf::values}},
                                                           {"int64", {8, 0, Leaf::values}},
                                                           {"vec3i", {12, 0, Leaf::values}},
                                                           {"vec3s", {12, 6, Leaf::values}},
                                                           {"vec3d", {24, 6, Leaf::values}},
                                                           {"hermite_float", {52, 0, Leaf::values}},
                                                           {"hermite_directed", {12, 0, Leaf::values}},
                                                           {"hermite_thesis", {10, 0, Leaf::values}},
                                                           {"hermite_fixed", {10, 0, Leaf::values}}};
  const std::string prefix = "Tree_", suffix = "_5_4_3";
  if (!type.starts_with(prefix) || !type.ends_with(suffix) || type.size() < prefix.size() + suffix.size())
    return nullptr;
  const auto found = known.find(type.substr(prefix.size(), type.size() - prefix.size() - suffix.size()));
  return found == known.end() ? nullptr : &found->second;
}

/// Checks the header of a chunk packed by Blosc: version, format, flags, size of an item; then 32 bits each
/// for the bytes unpacked, of a block, and packed.
void check_blosc(BoundedFile& file, std::uint64_t packed, std::uint64_t unpacked) {
  file.need(packed);
  const std::string header = file.ahead(16);
  if (packed < 16 || header.size() < 16) file.damaged("a block of packed values is too short");
  std::array<std::uint32_t, 3> sizes;
  std::memcpy(sizes.data(), header.data() + 4, sizeof sizes);
  // OpenVDB pads shorter blocks to this length before it packs them.
  constexpr std::uint64_t kLeast = 128;
  if (sizes[0] > std::max(unpacked, kLeast) || sizes[2] > packed)
    file.damaged("a block of packed values has another length than it declares");
}

/// Checks the data for delayed loading of leaves: their number, masks and packed sizes
/// (io/DelayedLoadMetadata.cc).
void check_delayed_load(BoundedFile& file) {
  const std::uint64_t leaves = file.number<std::uint32_t>();
  const auto list = [&](std::uint64_t bytes, std::uint64_t item_bytes) {
    if (bytes > 0) check_blosc(file, bytes, leaves * item_bytes);
    file.skip(bytes > 0 ? bytes : leaves * item_bytes);
  };
  list(file.number<std::uint32_t>(), 1);
  const std::uint32_t sizes = file.number<std::uint32_t>();
  if (sizes != ~std::uint32_t{0}) list(sizes, 8);
}

/// Skips metadata: their number, then name, type, length and value of each. Returns all their bytes.
std::string checked_metadata(BoundedFile& file) {
  const std::uint64_t start = file.position();
  for (std::uint32_t left = file.number<std::uint32_t>(); left > 0; --left) {
    file.text();
    const std::string type = file.text();
    const std::uint32_t bytes = file.number<std::uint32_t>();
    file.need(bytes);
    const std::uint64_t end = file.position() + bytes;
    // OpenVDB reads strings and unknown types by the length in the file, which need() has checked, and the
    // others by their own.
    if (type == "__delayedload") {
      if (bytes > 0) check_delayed_load(file);
      if (file.position() > end) file.damaged("its metadata are longer than they declare");
    } else if (type != "string" && openvdb::Metadata::isRegisteredType(type)) {
      if (openvdb::Metadata::createMetadata(type)->size() != bytes)
        file.damaged("its metadata have another length than they declare");
    }
    file.seek(end);
  }
  const std::uint64_t end = file.position();
  file.seek(start);
  std::string bytes = file.ahead(end - start);
  file.seek(end);
  return bytes;
}

/// Skips a transform (math/Maps.h): the name of its kind, then as many bytes as that kind stores.
void check_transform(BoundedFile& file) {
  static const std::map<std::string, std::uint64_t> affine = {{"AffineMap", 128},
                                                              {"UnitaryMap", 128},
                                                              {"ScaleMap", 120},
                                                              {"UniformScaleMap", 120},
                                                              {"TranslationMap", 24},
                                                              {"ScaleTranslateMap", 144},
                                                              {"UniformScaleTranslateMap", 144}};
  std::string type = file.text();
  if (type == "NonlinearFrustumMap") {
    file.skip(8 * sizeof(double));  // its box, taper and depth
    type = file.text();
  }
  const auto found = affine.find(type);
  if (found == affine.end()) file.damaged("it has a transform of an unknown kind, '" + shown(type, 30) + "'");
  file.skip(found->second);
}

int count_bits(const std::uint64_t* words, int count) {
  int bits = 0;
  for (int i = 0; i < count; ++i) bits += std::popcount(words[i]);
  return bits;
}

/// Skips a tree of the usual configuration: nodes of 32³ and 16³ children, and leaves of 8³ values.
class TreeWalk {
 public:
  TreeWalk(BoundedFile& file, const ValueLayout& layout, std::uint32_t compression, bool halved)
      : file_(file),
        layout_(layout),
        compression_(compression),
        value_bytes_(halved && layout.half_bytes > 0 ? layout.half_bytes : layout.bytes),
        halved_(halved && layout.half_bytes > 0) {}

  /// Skips the whole tree and returns its bytes in memory.
  double walk() {
    // Root: number of buffers, background, numbers of tiles and children; then the tiles, then each child
    // with all nodes below it. Values of leaves come last.
    if (file_.number<std::int32_t>() != 1) file_.damaged("its tree has several buffers");
    file_.skip(layout_.bytes);  // the background
    const std::uint32_t tiles = file_.number<std::uint32_t>(), children = file_.number<std::uint32_t>();
    std::set<Coord> origins;
    openvdb::CoordBBox box;
    const auto read_origin = [&] {
      const auto at = file_.number<std::array<std::int32_t, 3>>();
      // The root's map has at most one node or tile per origin, a multiple of 4096 within the range of index
      // coordinates of 32 bits.
      const Coord lower(at[0], at[1], at[2]);
      for (const std::int32_t index : at)
        if (index % kUpperDim != 0 || index < -kLargestIndex - kUpperDim || index > kLargestIndex)
          file_.damaged("a node has an impossible origin");
      box.expand(lower);
      // The number of samples across must also be a 32-bit integer.
      for (int axis = 0; axis < 3; ++axis)
        if (std::int64_t{box.max()[axis]} - box.min()[axis] > 2LL * kLargestIndex - 2 * kUpperDim)
          file_.damaged("its nodes lie too far apart");
      if (!origins.insert(lower).second) file_.damaged("two nodes have the same origin");
      return lower;
    };
    for (std::uint32_t i = 0; i < tiles; ++i) {
      read_origin();
      file_.skip(layout_.bytes);
      if (file_.number<std::uint8_t>() > 1) file_.damaged("a tile is neither active nor inactive");
    }
    for (std::uint32_t i = 0; i < children; ++i) {
      const Coord lower = read_origin();
      leaves_ = &leaves_of_[lower];
      node<5>(lower);
    }
    // The values of leaves follow in the order of the tree, which is not that of the file.
    for (const auto& [lower, leaves] : leaves_of_)
      for (const Leaf& leaf : leaves) values_of(leaf);
    return memory_;
  }

 private:
  struct Leaf {
    Coord lower;
    int active;
  };
  static constexpr std::int32_t kUpperDim = 4096, kLargestIndex = 1 << 30;
  static constexpr std::uint64_t kLeafMask = 64, kPerLeaf = 512;

  template <int kLog2>
  void node(const Coord& lower) {
    constexpr int kSlots = 1 << (3 * kLog2), kWords = kSlots / 64, kChildDim = kLog2 == 5 ? 128 : 8;
    // A node: mask of children, mask of active tiles, values of all slots, then its children.
    std::vector<std::uint64_t> children(kWords), active(kWords);
    file_.read(children.data(), kSlots / 8);
    file_.read(active.data(), kSlots / 8);
    for (int i = 0; i < kWords; ++i)
      if (children[i] & active[i]) file_.damaged("a slot of its tree is both a node and an active tile");
    values(kSlots, count_bits(active.data(), kWords), kSlots / 8);
    // A slot holds a pointer or a value; two masks take a quarter byte per slot.
    memory_ += double(kSlots) * std::max<double>(8, layout_.bytes) + kSlots / 4;
    for (int word = 0; word < kWords; ++word)
      for (std::uint64_t left = children[word]; left != 0; left &= left - 1) {
        const int slot = 64 * word + std::countr_zero(left), mask = (1 << kLog2) - 1;
        const Coord there = lower.offsetBy(kChildDim * (slot >> (2 * kLog2)),
                                           kChildDim * (slot >> kLog2 & mask), kChildDim * (slot & mask));
        if constexpr (kLog2 == 5)
          node<4>(there);
        else
          leaf(there);
      }
  }

  void leaf(const Coord& lower) {
    // The mask comes here; the number of its bits is that of the packed values that follow later.
    const auto mask = file_.number<std::array<std::uint64_t, 8>>();
    leaves_->push_back({lower, count_bits(mask.data(), 8)});
    // About 100 bytes for origin, mask and pointer, besides the values.
    memory_ += 100 + double(layout_.leaf == ValueLayout::Leaf::values ? kPerLeaf * layout_.bytes : kLeafMask);
  }

  void values_of(const Leaf& leaf) {
    file_.skip(kLeafMask);
    if (layout_.leaf == ValueLayout::Leaf::values) return values(kPerLeaf, leaf.active, kLeafMask);
    // OpenVDB takes the origin of such a leaf from the file.
    const auto at = file_.number<std::array<std::int32_t, 3>>();
    if (Coord(at[0], at[1], at[2]) != leaf.lower)
      file_.damaged("a leaf has another origin than its node requires");
    if (layout_.leaf == ValueLayout::Leaf::truths) file_.skip(kLeafMask);
  }

  /// Skips the values of a node or leaf, as readCompressedValues() of io/Compression.h reads them: a byte for
  /// the storage of inactive values, up to two of these and a mask that distinguishes them, then the values.
  void values(std::uint64_t count, int active, std::uint64_t mask_bytes) {
    using namespace openvdb::io;
    const int kept = file_.number<std::int8_t>();
    if (kept < NO_MASK_OR_INACTIVE_VALS || kept > NO_MASK_AND_ALL_VALS)
      file_.damaged("a node packs its values in an unknown way");
    // Inactive values have full precision even if the others are halved.
    if (kept == NO_MASK_AND_ONE_INACTIVE_VAL || kept == MASK_AND_ONE_INACTIVE_VAL) file_.skip(layout_.bytes);
    if (kept == MASK_AND_TWO_INACTIVE_VALS) file_.skip(2 * layout_.bytes);
    if (kept == MASK_AND_NO_INACTIVE_VALS || kept == MASK_AND_ONE_INACTIVE_VAL ||
        kept == MASK_AND_TWO_INACTIVE_VALS)
      file_.skip(mask_bytes);
    // With this flag only active values are stored, unless the byte declares all.
    if ((compression_ & COMPRESS_ACTIVE_MASK) && kept != NO_MASK_AND_ALL_VALS) count = std::uint64_t(active);
    if (halved_ && count == 0) return;
    chunk(count * value_bytes_);
  }

  /// Skips one block of values behind its signed length, which is negative if the block is not packed.
  void chunk(std::uint64_t unpacked) {
    using namespace openvdb::io;
    if (!(compression_ & (COMPRESS_BLOSC | COMPRESS_ZIP))) return file_.skip(unpacked);
    const auto packed = file_.number<std::int64_t>();
    if (packed <= 0) {  // it is not packed
      if (std::uint64_t{0} - std::uint64_t(packed) != unpacked)
        file_.damaged("a block of values has a wrong length");
      return file_.skip(unpacked);
    }
    if (compression_ & COMPRESS_BLOSC) check_blosc(file_, std::uint64_t(packed), unpacked);
    file_.skip(std::uint64_t(packed));
  }

  BoundedFile& file_;
  const ValueLayout& layout_;
  std::uint32_t compression_;
  std::uint64_t value_bytes_;
  bool halved_;
  std::map<Coord, std::vector<Leaf>> leaves_of_;  ///< leaves below each child of the root
  std::vector<Leaf>* leaves_ = nullptr;
  double memory_ = 0.0;
};

}  // namespace

BoundedFile::BoundedFile(fs::path path)
    : path_(std::move(path)), file_(std::fopen(path_.c_str(), "rb"), &std::fclose) {
  if (!file_) throw Error(path_.string() + " cannot be opened for reading");
  std::setvbuf(file_.get(), nullptr, _IOFBF, std::size_t{1} << 18);
  size_ = fs::file_size(path_);
}

void BoundedFile::damaged(std::string_view why) const {
  throw Error(path_.string() + " is damaged or truncated: " + std::string(why));
}

void BoundedFile::need(std::uint64_t bytes) const {
  // A difference, which cannot wrap like a sum.
  if (bytes > size_ - position_) damaged("it refers to data beyond its end");
}

void BoundedFile::seek(std::uint64_t position) {
  if (position > size_) damaged("it refers to data beyond its end");
  position_ = position;
}

void BoundedFile::skip(std::uint64_t bytes) {
  need(bytes);
  position_ += bytes;
}

void BoundedFile::read(void* to, std::size_t bytes) {
  need(bytes);
  // A move within the buffer costs no call of the system.
  if (fseeko(file_.get(), static_cast<off_t>(position_), SEEK_SET) != 0 ||
      std::fread(to, 1, bytes, file_.get()) != bytes)
    damaged("it cannot be read to its end");
  position_ += bytes;
}

std::string BoundedFile::text() {
  const auto length = number<std::uint32_t>();
  need(length);
  std::string text(length, ' ');
  read(text.data(), length);
  return text;
}

std::string BoundedFile::ahead(std::uint64_t at_most) {
  const std::uint64_t start = position_;
  std::string bytes(std::min(at_most, size_ - position_), ' ');
  read(bytes.data(), bytes.size());
  position_ = start;
  return bytes;
}

/// Properties of a grid in front of its tree that decide the layout of its values.
struct VdbStructure::GridHead {
  std::uint32_t compression = 0;
  bool halved = false;
};

VdbStructure::VdbStructure(const fs::path& path) : file_(path) {
  file_.skip(sizeof(std::int64_t));  // the magic number
  version_ = file_.number<std::uint32_t>();
  if (version_ < openvdb::OPENVDB_FILE_VERSION_NODE_MASK_COMPRESSION)
    throw Error(path.string() + " is of a version of .vdb files older than OpenVDB 2, or damaged");
  if (version_ > openvdb::OPENVDB_FILE_VERSION)
    throw Error(path.string() + " is of a newer version of .vdb files than " +
                std::to_string(openvdb::OPENVDB_FILE_VERSION) + ", or damaged");
  file_.skip(2 * sizeof(std::uint32_t));  // the library's version
  has_offsets_ = file_.number<char>() != 0;
  file_.skip(36);  // the identifier
  checked_metadata(file_);
  for (auto left = file_.number<std::int32_t>(); left > 0; --left) {
    grids_.push_back(read_descriptor());
    const VdbDescriptor& grid = grids_.back();
    if (!has_offsets_) {
      walk(grid);
      continue;
    }
    // Each grid lies behind its descriptor and before the next one: offsets that lead back could form cycles.
    const std::uint64_t here = file_.position();
    if (grid.start < here || grid.end < grid.start) file_.damaged("its grids do not follow one another");
    file_.seek(grid.end);
  }
}

VdbDescriptor VdbStructure::read_descriptor() {
  VdbDescriptor grid;
  grid.unique_name = file_.text();
  grid.type = file_.text();
  if (grid.type.ends_with(kHalfSuffix)) grid.type.resize(grid.type.size() - kHalfSuffix.size());
  grid.parent = file_.text();
  if (!openvdb::GridBase::isRegistered(grid.type))
    throw openvdb::LookupError("the type '" + shown(grid.type, 30) + "'");
  const auto offsets = file_.number<std::array<std::uint64_t, 3>>();
  if (has_offsets_) grid.start = offsets[0], grid.end = offsets[2];
  if (!has_offsets_) grid.start = file_.position();
  return grid;
}

std::vector<const VdbDescriptor*> VdbStructure::find(const std::string& name) const {
  // With or without its number, as in OpenVDB.
  const std::string plain = GridDescriptor::stripSuffix(GridDescriptor::stringAsUniqueName(name));
  std::vector<const VdbDescriptor*> found;
  for (const VdbDescriptor& grid : grids_) {
    const std::string own = GridDescriptor::stripSuffix(grid.unique_name);
    if (own == name || own == plain) found.push_back(&grid);
  }
  return found;
}

bool VdbStructure::is_known(const std::string& type) { return layout_of(type) != nullptr; }

VdbStructure::GridHead VdbStructure::read_head() {
  GridHead head;
  head.compression = file_.number<std::uint32_t>();
  // The metadata have been checked, so OpenVDB can read them from a copy of their bytes.
  std::istringstream bytes(checked_metadata(file_));
  openvdb::MetaMap metadata;
  metadata.readMeta(bytes);
  if (const auto saved = metadata[openvdb::GridBase::META_SAVE_HALF_FLOAT]) head.halved = saved->asBool();
  check_transform(file_);
  return head;
}

void VdbStructure::check_metadata(const VdbDescriptor& grid) {
  file_.seek(grid.start);
  read_head();
}

double VdbStructure::walk(const VdbDescriptor& grid) {
  file_.seek(grid.start);
  const GridHead head = read_head();
  // A grid that shares a tree has none of its own in the file.
  if (!grid.parent.empty()) return 0.0;
  const ValueLayout* layout = layout_of(grid.type);
  if (!layout) throw openvdb::LookupError("the type '" + shown(grid.type, 30) + "'");
  return TreeWalk(file_, *layout, head.compression, head.halved).walk();
}

double VdbStructure::check_tree(const VdbDescriptor& grid) {
  if (grid.parent.empty()) return walk(grid);
  walk(grid);
  const auto parent = std::ranges::find(grids_, grid.parent, &VdbDescriptor::unique_name);
  if (parent == grids_.end()) file_.damaged("a grid shares the tree of a missing one");
  // Among several grids of one name OpenVDB might take another one.
  const auto same = [&](const VdbDescriptor& other) { return other.unique_name == grid.parent; };
  const bool one = std::ranges::count_if(grids_, same) == 1 &&
                   (grid.parent.find(kSeparator) != std::string::npos || find(grid.parent).size() == 1);
  if (!one || parent->type != grid.type || !parent->parent.empty())
    file_.damaged("a grid shares a tree that it cannot share");
  return walk(*parent);
}

}  // namespace hermesh
