#include <unistd.h>
#include <zlib.h>

#include <cerrno>
#include <fstream>
#include <new>

#include "algorithms/io/mesh_file_formats.h"

namespace hermesh::mesh_formats {

namespace {

namespace fs = std::filesystem;

// The first two bytes decide, since packed files exist without .gz in their names, too.
bool is_gzip(std::string_view bytes) { return bytes.starts_with("\x1f\x8b"); }

}  // namespace

std::string read_whole(const fs::path& path) {
  const std::string name = in_quotes(path.string());
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (!fs::exists(status)) throw Error(joined(name, " cannot be read: there is no such file"));
  if (fs::is_directory(status)) throw Error(joined(name, " is a folder; name a mesh file in it"));
  if (!fs::is_regular_file(status)) throw Error(joined(name, " is not a regular file"));
  std::ifstream stream(path, std::ios::binary);
  if (!stream) throw Error(joined(name, " cannot be read: ", std::strerror(errno)));
  std::string bytes(fs::file_size(path), '\0');
  stream.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (static_cast<std::size_t>(stream.gcount()) != bytes.size())
    throw Error(joined(name, " cannot be read to its end"));
  return bytes;
}

std::size_t memory_limit() {
  return static_cast<std::size_t>(sysconf(_SC_PHYS_PAGES)) / 2 *
         static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
}

void check_unpacked(std::uint64_t packed, std::uint64_t unpacked, const std::string& what) {
  constexpr std::uint64_t kRatio = 200, kAlways = std::uint64_t(1) << 28;
  if (unpacked > memory_limit()) throw Error(joined(what, " unpacks to more than half of the memory"));
  if (unpacked > std::max(kAlways, kRatio * packed))
    throw Error(joined(what, " unpacks to more than ", kRatio, " times its length and ", kAlways >> 20,
                       " MiB, which is the limit; unpack it first if that is intended"));
}

namespace {

class Inflater {
 public:
  Inflater(std::string_view packed, const fs::path& path)
      : name_(in_quotes(path.string())), packed_(packed.size()), rest_(packed) {
    if (inflateInit2(&stream_, 15 + 16) != Z_OK) throw std::bad_alloc();  // 16: gzip header and checksum
  }
  ~Inflater() { inflateEnd(&stream_); }

  std::string unpack(const RunContext& context) {
    std::string bytes;
    do {
      int status = Z_OK;
      while (status != Z_STREAM_END) {
        context.check();
        status = step(bytes);
      }
      inflateReset(&stream_);
    } while (is_gzip(rest_));  // a gzip file may have several members, one behind the other
    // Zeros up to the end of a block may follow, as gzip allows.
    if (rest_.find_first_not_of('\0') != std::string_view::npos)
      throw Error(joined(name_, " has bytes behind its gzip data; it is damaged"));
    return bytes;
  }

 private:
  int step(std::string& bytes) {
    constexpr std::size_t most = std::size_t(1) << 30;  // zlib counts in 32 bits
    if (used_ == bytes.size()) {
      check_unpacked(packed_, bytes.size(), name_);
      bytes.resize(std::max<std::size_t>(2 * bytes.size(), 4 * rest_.size() + 4096));
    }
    stream_.next_in = reinterpret_cast<const Bytef*>(rest_.data());
    stream_.avail_in = static_cast<uInt>(std::min(rest_.size(), most));
    stream_.next_out = reinterpret_cast<Bytef*>(bytes.data() + used_);
    stream_.avail_out = static_cast<uInt>(std::min(bytes.size() - used_, most));
    const uInt in = stream_.avail_in, out = stream_.avail_out;
    const int status = inflate(&stream_, Z_NO_FLUSH);
    rest_.remove_prefix(in - stream_.avail_in);
    used_ += out - stream_.avail_out;
    if (status == Z_BUF_ERROR || (status == Z_OK && rest_.empty() && stream_.avail_out > 0))
      throw Error(joined(name_, " is truncated: its gzip data breaks off"));
    if (status != Z_OK && status != Z_STREAM_END)
      throw Error(joined(name_, " is damaged: its gzip data does not unpack"));
    if (status == Z_STREAM_END && !is_gzip(rest_)) {
      check_unpacked(packed_, used_, name_);
      bytes.resize(used_);
    }
    return status;
  }

  std::string name_;
  std::uint64_t packed_;
  std::string_view rest_;
  z_stream stream_ = {};
  std::size_t used_ = 0;
};

}  // namespace

std::string load_bytes(const fs::path& path, const RunContext& context) {
  const std::string name = in_quotes(path.string());
  const std::optional<MeshPath> named = parse_mesh_path(path);
  try {
    std::string bytes = read_whole(path);
    if (bytes.empty()) throw Error(joined(name, " is empty"));
    if (is_gzip(bytes))
      bytes = Inflater(bytes, path).unpack(context);
    else if (named && named->gzipped)
      throw Error(joined(name, " is named .gz but is not compressed by gzip"));
    if (bytes.empty()) throw Error(joined(name, " is empty once unpacked"));
    return bytes;
  } catch (const std::bad_alloc&) {
    throw Error(joined(name, " does not fit into memory"));
  }
}

}  // namespace hermesh::mesh_formats
