#include "algorithms/core/vdb_archive.h"

#include <openvdb/io/Archive.h>
#include <openvdb/io/GridDescriptor.h>
#include <zlib.h>

#include <array>
#include <cstring>
#include <fstream>
#include <map>

#include "algorithms/core/atomic_file.h"
#include "algorithms/core/level_set_grid.h"

namespace hermesh {
namespace {

namespace fs = std::filesystem;

/// OpenVDB reports a missing file and one of another kind in the same words; these are ours.
void check_is_vdb(const fs::path& path) {
  std::error_code ignored;
  if (!fs::exists(path, ignored)) throw Error(path.string() + " does not exist");
  if (fs::is_directory(path, ignored)) throw Error(path.string() + " is a folder, not a .vdb file");
  std::ifstream in(path, std::ios::binary);
  if (!in) throw Error(path.string() + " cannot be opened for reading");
  constexpr std::int64_t kMagic = 0x56444220;
  std::int64_t magic = 0;
  if (!in.read(reinterpret_cast<char*>(&magic), sizeof magic))
    throw Error(path.string() +
                (fs::file_size(path, ignored) == 0 ? " is empty" : " is truncated: it is too short for a .vdb file"));
  if (magic != kMagic) throw Error(path.string() + " is not a .vdb file");
}

// A file that write_grids() made ends with eight bytes that say so and the CRC-32 of all before them, for OpenVDB reads
// damaged data beyond the ends of its buffers (bloscFromStream() of version 10 compares lengths after it has read).
// Other programs ignore what stands behind the last grid; a file that one of them has written anew has neither this nor
// the metadata that announce it.
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

/// A file's identifier: 36 characters behind magic number, versions and a flag.
constexpr std::streamoff kIdentifier = 21, kIdentifierLength = 36;

/// In the form of a UUID, from the size and two checksums of all that follows the identifier.
std::string identifier_of(std::istream& in, std::uintmax_t size) {
  constexpr std::uintmax_t kHead = kIdentifier + kIdentifierLength;
  in.seekg(kHead);
  const std::uint32_t first = crc_of(in, size - kHead);
  in.clear();
  in.seekg(kHead + static_cast<std::streamoff>((size - kHead) / 2));
  const std::uint32_t second = crc_of(in, size - kHead - (size - kHead) / 2);
  std::array<char, kIdentifierLength + 1> text{};
  std::snprintf(text.data(), text.size(), "%08x-%04x-4%03x-8%03x-%012llx", first, second >> 16, (second >> 4) & 0xfff,
                second & 0xf, static_cast<unsigned long long>(size & 0xffffffffffffu));
  return text.data();
}

/// @throws Error if the file cannot be read or written to its end.
void seal(const fs::path& path, const fs::path& named) {
  std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
  const std::uintmax_t size = fs::file_size(path);
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

/// Whether the file ends with a seal. @throws Error if it does not fit the file.
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
  if (crc_of(in, size - kSealBytes) != crc) throw Error(path.string() + " is damaged: its checksum does not fit");
  return true;
}

/// Steps through a file and refuses lengths that it cannot hold. OpenVDB believes them: it makes strings of up to 4 GiB
/// and reads as many nodes as a damaged number says, long after the file has ended.
class LengthCheck {
 public:
  LengthCheck(std::istream& in, const fs::path& path) : in_(in), path_(path.string()), size_(fs::file_size(path)) {}

  std::uint32_t number() {
    std::uint32_t value = 0;
    if (!in_.read(reinterpret_cast<char*>(&value), sizeof value)) damaged();
    return value;
  }
  void skip(std::uint64_t bytes) {
    need(bytes);
    in_.seekg(static_cast<std::streamoff>(bytes), std::ios::cur);
  }
  std::string text() {
    const std::uint32_t length = number();
    need(length);
    std::string result(length, ' ');
    in_.read(result.data(), length);
    return result;
  }
  void metadata() {
    for (std::uint32_t left = number(); left > 0; --left) {
      text();
      const bool delayed = text() == "__delayedload";
      const std::uint32_t bytes = number();
      need(bytes);
      const std::streampos start = in_.tellg();
      if (delayed && bytes > 0) delayed_load();
      in_.seekg(start);
      skip(bytes);
    }
  }
  /// From the root's background, of `value_bytes`, on. A child has two masks of 32³ bits at least.
  void root(std::uint64_t value_bytes) {
    skip(sizeof(std::int32_t) + value_bytes);
    const std::uint64_t tiles = number(), children = number();
    need(tiles * (13 + value_bytes) + children * (12 + 2 * 4096));
  }

 private:
  /// Lengths within what OpenVDB keeps for reading leaves later: their number, masks and compressed sizes.
  void delayed_load() {
    const std::uint64_t leaves = number(), mask_bytes = number();
    need(leaves * 64);
    skip(mask_bytes > 0 ? mask_bytes : leaves);
    const std::uint32_t size_bytes = number();
    if (size_bytes != ~std::uint32_t{0}) need(size_bytes > 0 ? size_bytes : leaves * 8);
  }
  void need(std::uint64_t bytes) {
    const std::streamoff at = in_.tellg();
    if (!in_ || at < 0 || bytes > size_ || static_cast<std::uint64_t>(at) > size_ - bytes) damaged();
  }
  [[noreturn]] void damaged() const {
    throw Error(path_ + " is damaged or truncated: it speaks of more than it holds");
  }

  std::istream& in_;
  std::string path_;
  std::uint64_t size_;
};

/// Size of a value in a file, or 0 where it is not known here.
std::uint64_t value_bytes(const std::string& grid_type) {
  static const std::map<std::string, std::uint64_t> known = {{"bool", 1},
                                                             {"float", 4},
                                                             {"int32", 4},
                                                             {"double", 8},
                                                             {"int64", 8},
                                                             {"vec3s", 12},
                                                             {"vec3i", 12},
                                                             {"vec3d", 24},
                                                             {"hermite_float", 52},
                                                             {"hermite_directed", 12},
                                                             {"hermite_thesis", 10},
                                                             {"hermite_fixed", 10}};
  const std::string prefix = "Tree_", suffix = "_5_4_3";
  if (!grid_type.starts_with(prefix) || !grid_type.ends_with(suffix)) return 0;
  const auto it = known.find(grid_type.substr(5, grid_type.size() - prefix.size() - suffix.size()));
  return it == known.end() ? 0 : it->second;
}

/// Reads what stands before the grids, which names where each of them ends, and looks into the beginning of each.
class GridEnds : public openvdb::io::Archive {
 public:
  void check(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    LengthCheck lengths(in, path);
    readHeader(in);
    openvdb::io::setVersion(in, libraryVersion(), fileVersion());  // the descriptors are read by it
    if (fileVersion() < openvdb::OPENVDB_FILE_VERSION_NODE_MASK_COMPRESSION)
      throw Error(path.string() + " is of a version of .vdb files older than OpenVDB 2, or damaged");
    lengths.metadata();
    if (!inputHasGridOffsets()) return;
    for (std::int32_t left = readGridCount(in); left > 0; --left) check_grid(in, lengths, path);
  }

 private:
  static void check_grid(std::istream& in, LengthCheck& lengths, const fs::path& path) {
    const std::streampos start = in.tellg();
    for (int names = 0; names < 3; ++names) lengths.text();  // of the grid, its type, and whose tree it shares
    in.seekg(start);
    openvdb::io::GridDescriptor descriptor;
    descriptor.read(in);
    if (!in || descriptor.getEndPos() > static_cast<std::int64_t>(fs::file_size(path)))
      throw Error(path.string() + " is truncated: a grid ends beyond the end of the file");
    descriptor.seekToGrid(in);
    lengths.number();  // compression
    lengths.metadata();
    const std::streampos transform = in.tellg();
    lengths.text();
    in.seekg(transform);
    openvdb::math::Transform().read(in);
    const std::uint64_t bytes = value_bytes(descriptor.gridType());
    if (bytes > 0 && !descriptor.isInstance()) lengths.root(bytes);
    descriptor.seekToEnd(in);
  }
};

}  // namespace

void open_vdb(openvdb::io::File& file, const fs::path& path) {
  initialize_openvdb();
  check_is_vdb(path);
  const bool sealed = check_seal(path);
  GridEnds().check(path);
  file.open(/*delayLoad=*/false);
  if (!sealed && (*file.getMetadata())[kSealKey])
    throw Error(path.string() + " is damaged or truncated: its checksum is missing");
}

std::string grid_names(const openvdb::io::File& file) {
  std::string names;
  for (auto it = file.beginName(); it != file.endName(); ++it) names += (names.empty() ? "" : ", ") + *it;
  return names;
}

void write_sealed(const fs::path& file, const openvdb::GridCPtrVec& grids, const fs::path& named) {
  try {
    openvdb::io::File out(file.string());
    openvdb::MetaMap metadata;
    metadata.insertMeta(kSealKey, openvdb::StringMetadata("CRC-32 of all but the last 12 bytes, in the last 4"));
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
