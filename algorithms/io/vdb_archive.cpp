#include "algorithms/io/vdb_archive.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <fstream>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/io/atomic_file.h"
#include "algorithms/lattice/memory_estimate.h"

namespace hermesh {
namespace {

namespace fs = std::filesystem;

/// @throws Error if the file is missing or no .vdb file, which OpenVDB does not distinguish.
void check_is_vdb(const fs::path& path) {
  std::error_code ignored;
  if (!fs::exists(path, ignored)) throw Error(path.string() + " does not exist");
  if (fs::is_directory(path, ignored)) throw Error(path.string() + " is a folder, not a .vdb file");
  std::ifstream in(path, std::ios::binary);
  if (!in) throw Error(path.string() + " cannot be opened for reading");
  constexpr std::int64_t kMagic = 0x56444220;
  std::int64_t magic = 0;
  if (!in.read(reinterpret_cast<char*>(&magic), sizeof magic))
    throw Error(path.string() + (fs::file_size(path, ignored) == 0
                                     ? " is empty"
                                     : " is truncated: it is too short for a .vdb file"));
  if (magic != kMagic) throw Error(path.string() + " is not a .vdb file");
}

// A file of write_grids() ends with eight bytes as a mark and the CRC-32 of all before them, since OpenVDB
// does not detect all damage. Other programs ignore data behind the last grid; a file that one of them has
// rewritten has neither this seal nor the metadata that announce it.
constexpr std::array<char, 8> kSeal = {'h', 'e', 'r', 'm', 'e', 's', 'h', '\n'};
constexpr std::uintmax_t kSealBytes = kSeal.size() + sizeof(std::uint32_t);
constexpr const char* kSealKey = "hermesh_checksum";

std::uint32_t crc_of(std::istream& in, std::uintmax_t bytes) {
  std::vector<char> buffer(1 << 20);
  uLong crc = crc32(0, nullptr, 0);
  while (bytes > 0 && in) {
    const auto part = static_cast<std::streamsize>(std::min<std::uintmax_t>(bytes, buffer.size()));
    in.read(buffer.data(), part);
    crc = crc32(crc, reinterpret_cast<const Bytef*>(buffer.data()), static_cast<uInt>(part));
    bytes -= static_cast<std::uintmax_t>(part);
  }
  return static_cast<std::uint32_t>(crc);
}

/// Position of a file's identifier: 36 characters behind the magic number (8 bytes), three versions (4 each)
/// and a flag (1).
constexpr std::streamoff kIdentifier = 21, kIdentifierLength = 36;

/// Returns an identifier in the form of a UUID, from the size and two checksums of all that follows it.
std::string identifier_of(std::istream& in, std::uintmax_t size) {
  constexpr std::uintmax_t kHead = kIdentifier + kIdentifierLength;
  in.seekg(kHead);
  const std::uint32_t first = crc_of(in, size - kHead);
  in.clear();
  in.seekg(kHead + static_cast<std::streamoff>((size - kHead) / 2));
  const std::uint32_t second = crc_of(in, size - kHead - (size - kHead) / 2);
  std::array<char, kIdentifierLength + 1> text{};
  std::snprintf(text.data(), text.size(), "%08x-%04x-4%03x-8%03x-%012llx", first, second >> 16,
                (second >> 4) & 0xfff, second & 0xf, static_cast<unsigned long long>(size & 0xffffffffffffu));
  return text.data();
}

/// @throws Error if the file cannot be read or written to its end.
void seal(const fs::path& path, const fs::path& named) {
  std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
  const std::uintmax_t size = fs::file_size(path);
  // The seal covers the identifier.
  const std::string identifier = identifier_of(file, size);
  file.seekp(kIdentifier);
  file.write(identifier.data(), kIdentifierLength);
  file.seekg(0);
  const std::uint32_t crc = crc_of(file, size);
  file.seekp(0, std::ios::end);
  file.write(kSeal.data(), kSeal.size());
  file.write(reinterpret_cast<const char*>(&crc), sizeof crc);
  file.close();
  if (!file) throw Error(named.string() + " cannot be written to its end");
}

/// Returns true if the file ends with a seal. @throws Error if that is wrong.
bool check_seal(const fs::path& path) {
  const std::uintmax_t size = fs::file_size(path);
  if (size < kSealBytes) return false;
  std::ifstream in(path, std::ios::binary);
  in.seekg(static_cast<std::streamoff>(size - kSealBytes));
  std::array<char, kSeal.size()> end{};
  std::uint32_t crc = 0;
  in.read(end.data(), end.size());
  in.read(reinterpret_cast<char*>(&crc), sizeof crc);
  if (end != kSeal) return false;
  in.seekg(0);
  if (crc_of(in, size - kSealBytes) != crc)
    throw Error(path.string() + " is damaged: its checksum does not fit");
  return true;
}

/// @throws Error if the transform cannot be inverted, or if its stored inverse is wrong.
void check_transform(const openvdb::math::Transform& transform, const std::string& what) {
  const auto fail = [&] { throw Error(what + " has a transform that is not finite or cannot be inverted"); };
  const openvdb::Vec3d size = transform.voxelSize();
  for (int axis = 0; axis < 3; ++axis)
    if (!(std::isfinite(size[axis]) && size[axis] > 0.0)) fail();
  if (!transform.isLinear()) return;  // its inverse is computed from it
  // Forth and back by the stored inverse, from the origin, far out along each axis and off the axes.
  for (const openvdb::Vec3d index :
       {openvdb::Vec3d(0, 0, 0), openvdb::Vec3d(100, 0, 0), openvdb::Vec3d(0, 100, 0),
        openvdb::Vec3d(0, 0, 100), openvdb::Vec3d(-70, 20, 50)}) {
    const openvdb::Vec3d world = transform.indexToWorld(index);
    // Rounding far from the origin, in voxels.
    const double rounding = 1e-12 * world.length() / std::min({size.x(), size.y(), size.z()});
    if (!((transform.worldToIndex(world) - index).length() < 1e-3 + rounding)) fail();
  }
}

/// Returns true if the background and all tiles of a grid of bools are 0 or 1 in memory, and for other grids.
/// OpenVDB copies their bytes from the file; using another byte as a bool is undefined.
bool has_valid_truths(const openvdb::GridBase& grid) {
  bool valid = true;
  const auto check = [&](const bool& value) {
    unsigned char byte = 0;
    std::memcpy(&byte, &value, sizeof byte);
    valid = valid && byte <= 1;
  };
  grid.apply<openvdb::TypeList<openvdb::BoolGrid, openvdb::MaskGrid>>([&](const auto& truths) {
    check(truths.background());
    auto tile = truths.cbeginValueAll();
    tile.setMaxDepth(tile.getLeafDepth() - 1);
    for (; tile; ++tile) check(tile.getValue());
  });
  return valid;
}

}  // namespace

VdbReader::VdbReader(const fs::path& path) : path_(path), file_(path.string()) {
  initialize_openvdb();
  check_is_vdb(path);
  // The structure is checked even behind a valid seal, which can be forged. Only then OpenVDB opens the file.
  const bool sealed = check_seal(path);
  structure_ = std::make_unique<VdbStructure>(path);
  file_.open(/*delayLoad=*/false);
  if (!sealed && (*file_.getMetadata())[kSealKey])
    throw Error(path.string() + " is damaged or truncated: its checksum is missing");
}

std::vector<std::string> VdbReader::names() const {
  std::vector<std::string> names;
  for (auto it = file_.beginName(); it != file_.endName(); ++it) names.push_back(*it);
  return names;
}

std::string VdbReader::joined_names() const {
  std::string joined;
  for (const std::string& name : names()) joined += (joined.empty() ? "" : ", ") + shown(name, 30);
  return shown(joined, 120);
}

std::vector<const VdbDescriptor*> VdbReader::found(const std::string& name) const {
  const auto grids = structure_->find(name);
  if (grids.empty())
    throw Error(path_.string() + " has no grid named '" + shown(name) + "'; it has " +
                (structure_->grids().empty() ? "none" : joined_names()));
  return grids;
}

bool VdbReader::can_read(const std::string& name) const {
  return std::ranges::all_of(found(name),
                             [](const VdbDescriptor* grid) { return VdbStructure::is_known(grid->type); });
}

openvdb::GridBase::Ptr VdbReader::with_good_transform(const std::string& name,
                                                      openvdb::GridBase::Ptr grid) const {
  check_transform(grid->transform(), "the grid '" + shown(name) + "' of " + path_.string());
  return grid;
}

openvdb::GridBase::Ptr VdbReader::read(const std::string& name) {
  // If several grids share a name, OpenVDB chooses one: all must be sound, and memory suffice for the
  // largest.
  double bytes = 0.0;
  for (const VdbDescriptor* grid : found(name)) bytes = std::max(bytes, structure_->check_tree(*grid));
  check_fits_memory(bytes, path_.string() + ": the grid '" + shown(name) + "'");
  const openvdb::GridBase::Ptr grid = file_.readGrid(name);
  if (!has_valid_truths(*grid))
    throw Error(path_.string() + " is damaged: a truth value of the grid '" + shown(name) +
                "' is neither true nor false");
  return with_good_transform(name, grid);
}

openvdb::GridBase::Ptr VdbReader::read_metadata(const std::string& name) {
  for (const VdbDescriptor* grid : found(name)) structure_->check_metadata(*grid);
  return with_good_transform(name, file_.readGridMetadata(name));
}

void write_sealed(const fs::path& file, const openvdb::GridCPtrVec& grids, const fs::path& named) {
  try {
    openvdb::io::File out(file.string());
    // The metadata announce the seal, so that a file which lost its end differs from one of another program.
    openvdb::MetaMap metadata;
    metadata.insertMeta(kSealKey,
                        openvdb::StringMetadata("CRC-32 of all but the last 12 bytes, in the last 4"));
    out.write(grids, metadata);
    out.close();
  } catch (const openvdb::Exception& e) {
    throw Error(named.string() + " cannot be written (" + e.what() + ")");
  }
  seal(file, named);
}

void write_grids(const fs::path& path, const openvdb::GridCPtrVec& grids) {
  AtomicFile file(path);
  write_sealed(file.path(), grids, path);
  file.commit();
}

}  // namespace hermesh
