// OBJ (Wavefront): lines of points (v) and polygons (f); everything else is passed over.
#include "algorithms/core/mesh_file_formats.h"

namespace hermesh::mesh_formats {

namespace {

class ObjReader {
 public:
  ObjReader(std::string_view bytes, MeshBuilder& builder)
      : cursor_(bytes, builder.file()), builder_(builder), total_(bytes.size()) {}

  void read() {
    while (true) {
      cursor_.skip_space();
      if (cursor_.at_end()) return;
      builder_.tick(cursor_.offset(), total_);
      read_line();
    }
  }

 private:
  void read_line() {
    if (cursor_.peek() == '#') {
      cursor_.advance();
      builder_.add_comment(cursor_.rest_of_line());
      return;
    }
    const std::string_view keyword = cursor_.word();
    const char first = keyword[0];
    if (keyword == "v") {
      read_point();
    } else if (keyword == "f") {
      read_polygon();
    } else if ((first >= 'a' && first <= 'z') || (first >= 'A' && first <= 'Z')) {
      skip_continued_line();
    } else {
      cursor_.fail(in_quotes(printable(keyword)) + " is no keyword of an OBJ file");
    }
  }

  static std::string printable(std::string_view word) {
    std::string text(word.substr(0, 40));
    for (char& c : text)
      if (c < ' ' || c > '~') c = '?';
    return text;
  }

  /// Blanks, and a backslash that continues the line on the next one.
  void skip_blanks() {
    cursor_.skip_blanks();
    while (cursor_.peek() == '\\') {
      cursor_.advance();
      cursor_.skip_blanks();
      if (cursor_.peek() != '\n') cursor_.fail("a backslash stands within a line");
      cursor_.advance();
      cursor_.skip_blanks();
    }
  }

  void skip_continued_line() {
    while (cursor_.rest_of_line().ends_with('\\')) {
    }
  }

  /// What follows the three coordinates is a weight or a colour.
  void read_point() {
    Eigen::Vector3d point;
    for (double& x : point) {
      skip_blanks();
      x = cursor_.leading_number<double>("a number");
      if (!is_space(cursor_.peek()) && cursor_.peek() != '\\' && !cursor_.at_end())
        cursor_.fail("a coordinate is not a number");
    }
    builder_.mesh.points.push_back(point);
    skip_continued_line();
  }

  /// Corners are v, v/vt, v//vn or v/vt/vn; a negative v counts back from the latest point.
  void read_polygon() {
    corners_.clear();
    for (skip_blanks(); !cursor_.at_line_end() && cursor_.peek() != '#'; skip_blanks()) {
      const auto index = cursor_.leading_number<std::int64_t>("the number of a point");
      if (index == 0) cursor_.fail("the points of an OBJ file count from 1, but a polygon refers to point 0");
      const auto points = static_cast<std::int64_t>(builder_.mesh.points.size());
      if (index < -points)
        cursor_.fail("a polygon refers to point " + std::to_string(index) + ", but there are only " +
                     std::to_string(points) + " points before it");
      corners_.push_back(index > 0 ? index - 1 : points + index);
      if (cursor_.peek() == '/') {
        while (!is_space(cursor_.peek()) && cursor_.peek() != '\\' && !cursor_.at_end()) cursor_.advance();
      } else if (!is_space(cursor_.peek()) && cursor_.peek() != '\\' && !cursor_.at_end()) {
        cursor_.fail("a corner of a polygon is not a number");
      }
    }
    cursor_.rest_of_line();
    builder_.add_polygon(corners_);
  }

  TextCursor cursor_;
  MeshBuilder& builder_;
  std::size_t total_;
  std::vector<std::int64_t> corners_;
};

}  // namespace

void read_obj(std::string_view bytes, MeshBuilder& builder) { ObjReader(bytes, builder).read(); }

}  // namespace hermesh::mesh_formats
