// STL (3D Systems 1988): triangles without shared points, as text or binary.
#include <bit>

#include "algorithms/core/mesh_file_formats.h"

namespace hermesh::mesh_formats {

namespace {

constexpr std::size_t header_size = 84, triangle_size = 50;

std::uint32_t little_endian_word(const char* at) {
  std::uint32_t word;
  std::memcpy(&word, at, sizeof word);
  return std::endian::native == std::endian::big ? __builtin_bswap32(word) : word;
}

std::uint64_t binary_size(std::string_view bytes) {
  return header_size + triangle_size * std::uint64_t(little_endian_word(bytes.data() + 80));
}

class StlReader {
 public:
  StlReader(std::string_view bytes, MeshBuilder& builder)
      : bytes_(bytes), builder_(builder), merger_(builder.mesh.points) {}

  void read_binary() {
    if (bytes_.size() < header_size)
      builder_.fail("the file is truncated: an STL file has at least 84 bytes");
    const std::uint64_t expected = binary_size(bytes_);
    if (bytes_.size() < expected)
      builder_.fail("the file is truncated: it has " + std::to_string(bytes_.size()) +
                    " bytes, but a binary STL file " + "of its declared number of triangles has " +
                    std::to_string(expected));
    if (bytes_.size() > expected)
      builder_.context().note(in_quotes(builder_.file()) +
                              " holds more than it declares; the rest was ignored");
    builder_.mesh.triangles.reserve((expected - header_size) / triangle_size);
    for (std::size_t at = header_size; at < expected; at += triangle_size) {
      builder_.tick(at, bytes_.size());
      for (std::size_t i = 0; i < 3; ++i) {
        Eigen::Vector3d point;  // behind the normal, which is not used
        for (std::size_t k = 0; k < 3; ++k)
          point[static_cast<int>(k)] =
              std::bit_cast<float>(little_endian_word(bytes_.data() + at + 12 + 12 * i + 4 * k));
        add_corner(point);
      }
      end_polygon();
    }
  }

  void read_text() {
    TextCursor cursor(bytes_, builder_.file());
    bool ended = false;
    for (cursor.skip_space(); !cursor.at_end(); cursor.skip_space()) {
      builder_.tick(cursor.offset(), bytes_.size());
      const std::string_view keyword = cursor.word();
      ended = is(keyword, "endsolid");
      if (is(keyword, "vertex")) {
        Eigen::Vector3d point;
        for (double& x : point) {
          cursor.skip_space();
          x = cursor.number<double>("a number");
        }
        add_corner(point);
      } else if (is(keyword, "endloop")) {
        end_polygon();
      } else if (!corners_.empty() && !ended) {
        cursor.fail("a facet that does not end in 'endloop'");
      } else if (is(keyword, "solid") || is(keyword, "facet") || is(keyword, "outer") || ended) {
        cursor.rest_of_line();  // a name, or a normal, which is not used
      } else if (!is(keyword, "endfacet")) {
        cursor.fail("a word that is no keyword of an STL file");
      }
    }
    if (!ended || !corners_.empty()) builder_.fail("the file is truncated: it does not end in 'endsolid'");
  }

 private:
  static bool is(std::string_view word, std::string_view keyword) {
    return std::equal(word.begin(), word.end(), keyword.begin(), keyword.end(),
                      [](char a, char b) { return a == b || a == b - 'a' + 'A'; });
  }

  void add_corner(const Eigen::Vector3d& point) {
    if (!point.allFinite())
      builder_.fail("point " + std::to_string(corners_.size()) + " of triangle " + std::to_string(polygons_) +
                    " (both count from 0) has a coordinate that is not a finite number");
    corners_.push_back(merger_.add(point));
  }

  void end_polygon() {
    builder_.add_polygon(corners_);
    corners_.clear();
    ++polygons_;
  }

  std::string_view bytes_;
  MeshBuilder& builder_;
  PointMerger merger_;
  std::vector<std::int64_t> corners_;
  std::size_t polygons_ = 0;
};

}  // namespace

bool is_binary_stl(std::string_view bytes) {
  return bytes.size() >= header_size && bytes.size() == binary_size(bytes);
}

/// Binary files that begin with "solid" exist, so that word alone does not decide; text has no zero byte.
void read_stl(std::string_view bytes, MeshBuilder& builder) {
  const bool text = !is_binary_stl(bytes) && bytes.substr(0, 1000).find('\0') == std::string_view::npos;
  StlReader reader(bytes, builder);
  if (text)
    reader.read_text();
  else
    reader.read_binary();
}

}  // namespace hermesh::mesh_formats
