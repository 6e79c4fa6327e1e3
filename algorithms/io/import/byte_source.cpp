#include "algorithms/io/import/byte_source.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <vector>

namespace hermesh {
namespace {

namespace fs = std::filesystem;

/// Most bytes that a byte of gzip data unpacks to: deflate codes at most 258 bytes by two bits.
constexpr std::uint64_t kLargestRatio = 1032;
constexpr std::size_t kLargestRead = std::size_t{1} << 24;

}  // namespace

ByteSource::ByteSource(fs::path path) : path_(std::move(path)) {
  // What is wrong with the path is told by what stands there; gzopen() would only say that it failed.
  std::error_code ignored;
  const fs::file_status status = fs::status(path_, ignored);
  if (!fs::exists(status)) fail("does not exist");
  if (fs::is_directory(status)) fail("is a folder; name a file in it");
  if (!fs::is_regular_file(status)) fail("is not a regular file");
  std::ifstream in(path_, std::ios::binary);
  if (!in) fail(std::string("cannot be read: ") + std::strerror(errno));
  const std::uint64_t size = fs::file_size(path_);
  if (size == 0) fail("is empty");
  std::array<char, 2> magic{};
  in.read(magic.data(), magic.size());
  // The first two bytes tell, and not the name. zlib passes bytes through where they are not those of gzip.
  gzipped_ = magic == std::array{'\x1f', '\x8b'};
  // The bound lets callers refuse what a header claims before they allocate it.
  at_most_ = gzipped_ ? size * kLargestRatio : size;
  file_ = gzopen(path_.c_str(), "rb");
  if (!file_) fail(std::string("cannot be read: ") + std::strerror(errno));
  // A quarter megabyte, since the default of 8 KiB means a call of the system for every two pages.
  gzbuffer(file_, 1 << 18);
}

ByteSource::~ByteSource() {
  if (file_) gzclose_r(file_);
}

void ByteSource::fail(const std::string& what) const { throw Error(path_.string() + " " + what); }

std::size_t ByteSource::some(unsigned char* to, std::size_t bytes) {
  // gzread() returns an int, so it is asked for less than that holds.
  const int got = gzread(file_, to, static_cast<unsigned>(std::min(bytes, kLargestRead)));
  int status = Z_OK;
  gzerror(file_, &status);
  // At the end of the file zlib speaks of a buffer error where the gzip data break off.
  if (got >= 0 && status == Z_BUF_ERROR) fail("is truncated: its gzip data break off");
  if (got < 0 || (status != Z_OK && status != Z_STREAM_END)) fail("is damaged: its gzip data do not unpack");
  position_ += static_cast<std::uint64_t>(got);
  return static_cast<std::size_t>(got);
}

void ByteSource::read(std::span<unsigned char> bytes, const RunContext& context) {
  while (!bytes.empty()) {
    // A part is at most 16 MiB, so that a cancelled run ends soon.
    context.check();
    const std::size_t got = some(bytes.data(), bytes.size());
    if (got == 0)
      fail("is truncated: it ends after " + std::to_string(position_) + " bytes, " +
           std::to_string(bytes.size()) + " too early");
    bytes = bytes.subspan(got);
  }
}

void ByteSource::skip(std::uint64_t bytes, const RunContext& context) {
  // By reading, because in gzip data no place can be found otherwise.
  std::vector<unsigned char> ignored(std::min<std::uint64_t>(bytes, kLargestRead));
  while (bytes > 0) {
    const std::uint64_t part = std::min<std::uint64_t>(bytes, ignored.size());
    read(std::span(ignored).first(part), context);
    bytes -= part;
  }
}

std::uint64_t ByteSource::count_rest(std::uint64_t limit, const RunContext& context) {
  std::vector<unsigned char> ignored(std::size_t{1} << 16);
  std::uint64_t rest = 0;
  // The end of the file is an answer here and no error.
  while (rest < limit) {
    context.check();
    const std::size_t got = some(ignored.data(), std::min<std::uint64_t>(limit - rest, ignored.size()));
    if (got == 0) break;
    rest += got;
  }
  return rest;
}

}  // namespace hermesh
