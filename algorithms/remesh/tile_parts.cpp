// Files of tiles: a word that identifies them, numbers and arrays as in memory (little-endian), and a sum
// over all bytes before it.
#include <bit>
#include <cstring>
#include <fstream>
#include <type_traits>

#include "algorithms/core/error.h"
#include "algorithms/io/atomic_file.h"
#include "algorithms/remesh/tiled_remesh.h"

namespace hermesh {
namespace {

constexpr char kTilesWord[16] = "hermesh tiles 2";
static_assert(std::endian::native == std::endian::little);

/// Applies f to all members of a part that its file stores, in their order.
template <class Part, class F>
void for_each_stored(Part& part, F&& f) {
  f(part.task), f(part.job.number), f(part.job.count), f(part.written_in_single), f(part.metres);
  for (int a = 0; a < 3; ++a) f(part.origin[a]);
}
template <class Tile, class F>
void for_each_stored_of_tile(Tile& tile, F&& f) {
  f(tile.tile), f(tile.own), f(tile.points), f(tile.triangles), f(tile.fixed), f(tile.touched), f(tile.keys);
}

std::uint64_t summed(std::uint64_t sum, const void* data, std::size_t size) {
  const auto* bytes = static_cast<const unsigned char*>(data);
  for (; size >= 8; size -= 8, bytes += 8) {
    std::uint64_t word;
    std::memcpy(&word, bytes, 8);
    sum = (sum ^ word) * 0x9e3779b97f4a7c15u;
    sum ^= sum >> 29;
  }
  for (std::size_t i = 0; i < size; ++i) sum = (sum ^ bytes[i]) * 0x100000001b3u;
  return sum;
}

class Writer {
 public:
  explicit Writer(const std::filesystem::path& path) : out_(path, std::ios::binary) {}
  void bytes(const void* data, std::size_t size) {
    out_.write(static_cast<const char*>(data), std::streamsize(size));
    sum_ = summed(sum_, data, size);
  }
  template <class T>
  void operator()(const T& value) {
    bytes(&value, sizeof value);
  }
  template <class T>
  void operator()(const std::vector<T>& values) {
    (*this)(std::uint64_t(values.size()));
    bytes(values.data(), values.size() * sizeof(T));
  }
  /// Writes the sum; returns false if something could not be written.
  bool finish() {
    const std::uint64_t sum = sum_;
    out_.write(reinterpret_cast<const char*>(&sum), sizeof sum);
    out_.close();
    return bool(out_);
  }

 private:
  std::ofstream out_;
  std::uint64_t sum_ = 0;
};

class Reader {
 public:
  explicit Reader(const std::filesystem::path& path) : path_(path.string()), in_(path, std::ios::binary) {
    if (!in_) throw Error("cannot read '" + path_ + "'");
    std::error_code error;
    left_ = std::filesystem::file_size(path, error);
  }
  [[noreturn]] void fail(const std::string& what) const {
    throw Error("'" + path_ + "' " + what + "; make it again with 'hermesh remesh --tile'");
  }
  void bytes(void* data, std::size_t size) {
    if (size > left_ || !in_.read(static_cast<char*>(data), std::streamsize(size))) fail("is truncated");
    left_ -= size;
    sum_ = summed(sum_, data, size);
  }
  template <class T>
  void operator()(T& value) {
    bytes(&value, sizeof value);
  }
  template <class T>
  void operator()(std::vector<T>& values) {
    std::uint64_t size = 0;
    (*this)(size);
    if (size > left_ / sizeof(T)) fail("is truncated");
    values.resize(size);
    bytes(values.data(), size * sizeof(T));
  }
  void finish() {
    const std::uint64_t sum = sum_;
    std::uint64_t stored = 0;
    (*this)(stored);
    if (stored != sum || left_ != 0) fail("is damaged");
  }

 private:
  const std::string path_;
  std::ifstream in_;
  std::uint64_t sum_ = 0;
  std::uintmax_t left_ = 0;
};

}  // namespace

void write_tile_part(const std::filesystem::path& path, const TilePart& part) {
  AtomicFile file(path);
  Writer write(file.path());
  write.bytes(kTilesWord, sizeof kTilesWord);
  for_each_stored(part, write);
  write(std::uint64_t(part.tiles.size()));
  for (const TileMesh& tile : part.tiles) for_each_stored_of_tile(tile, write);
  if (!write.finish()) throw Error("cannot write '" + path.string() + "'; is the disk full?");
  file.commit();
}

TilePart read_tile_part(const std::filesystem::path& path) {
  Reader read(path);
  char word[sizeof kTilesWord] = {};
  read.bytes(word, sizeof word);
  if (std::memcmp(word, kTilesWord, sizeof word) != 0) read.fail("is not a file of tiles of this version");
  TilePart part;
  for_each_stored(part, read);
  std::uint64_t tiles = 0;
  read(tiles);
  for (std::uint64_t i = 0; i < tiles; ++i) for_each_stored_of_tile(part.tiles.emplace_back(), read);
  read.finish();
  return part;
}

}  // namespace hermesh
