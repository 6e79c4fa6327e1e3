// OFF (Geomview): a keyword, three counts, a line for each point and each polygon.
#include "algorithms/core/mesh_file_formats.h"

namespace hermesh::mesh_formats {

namespace {

class OffReader {
 public:
  OffReader(std::string_view bytes, MeshBuilder& builder)
      : cursor_(bytes, builder.file()), builder_(builder), total_(bytes.size()) {}

  void read() {
    read_keyword();
    const auto points = count(), polygons = count();
    cursor_.rest_of_line();  // the number of edges, which nobody fills in
    // Before anything is allocated: a point takes three digits and three spaces, a polygon one of each; the
    // last space may be missing.
    const std::uint64_t space = cursor_.remaining() + 1;
    if (points > space / 6 || polygons > space / 2 || 6 * points + 2 * polygons > space)
      builder_.fail("the file is truncated: it declares " + std::to_string(points) + " points and " +
                    std::to_string(polygons) + " polygons, for which it is too short");
    builder_.mesh.points.reserve(points);
    builder_.mesh.triangles.reserve(polygons);
    for (std::uint64_t i = 0; i < points; ++i) read_point();
    for (std::uint64_t i = 0; i < polygons; ++i) read_polygon();
    skip_space();
    if (!cursor_.at_end())
      builder_.context().note(in_quotes(builder_.file()) +
                              " holds more than it declares; the rest was ignored");
  }

 private:
  void read_keyword() {
    skip_space();
    const std::string_view keyword = cursor_.word();
    // 4OFF has four coordinates and nOFF any number of them.
    if (keyword.find_first_of("4n") != std::string_view::npos)
      cursor_.fail(std::string(keyword) + " files are not read; only points with three coordinates are");
    cursor_.skip_blanks();
    if (cursor_.peek() == 'B') cursor_.fail("binary OFF files are not read; convert the file to text");
  }

  std::uint64_t count() {
    skip_space();
    return cursor_.number<std::uint64_t>("a count");
  }

  void skip_space() {
    for (cursor_.skip_space(); cursor_.peek() == '#'; cursor_.skip_space()) {
      cursor_.advance();
      builder_.add_comment(cursor_.rest_of_line());
    }
  }

  /// What follows the three coordinates on the line is a normal, a colour or a texture coordinate.
  void read_point() {
    builder_.tick(cursor_.offset(), total_);
    Eigen::Vector3d point;
    for (double& x : point) {
      skip_space();
      x = cursor_.number<double>("a number");
    }
    builder_.mesh.points.push_back(point);
    cursor_.rest_of_line();
  }

  /// What follows the corners on the line is a colour.
  void read_polygon() {
    builder_.tick(cursor_.offset(), total_);
    skip_space();
    const auto size = cursor_.number<std::uint64_t>("the number of corners");
    if (size > cursor_.remaining())
      cursor_.fail("the file is truncated: a polygon has more corners than are left");
    corners_.resize(size);
    for (std::int64_t& corner : corners_) {
      skip_space();
      corner = cursor_.number<std::int64_t>("the number of a point");
    }
    builder_.add_polygon(corners_);
    cursor_.rest_of_line();
  }

  TextCursor cursor_;
  MeshBuilder& builder_;
  std::size_t total_;
  std::vector<std::int64_t> corners_;
};

}  // namespace

bool is_off_keyword(std::string_view word) {
  if (!word.ends_with("OFF")) return false;
  word.remove_suffix(3);
  for (const std::string_view prefix : {"ST", "C", "N", "4", "n"})
    if (word.starts_with(prefix)) word.remove_prefix(prefix.size());
  return word.empty();
}

void read_off(std::string_view bytes, MeshBuilder& builder) { OffReader(bytes, builder).read(); }

}  // namespace hermesh::mesh_formats
