// OFF (Geomview): a keyword, three counts, a line for each point and each polygon; or the same in binary.
#include <algorithm>
#include <array>
#include <bit>

#include "algorithms/io/mesh_file_formats.h"

namespace hermesh::mesh_formats {

namespace {

class OffReader {
 public:
  OffReader(std::string_view bytes, TextCursor cursor, MeshBuilder& builder)
      : cursor_(std::move(cursor)), builder_(builder), total_(bytes.size()) {}

  void read() {
    // Declarators are initialized from left to right: the first count in the file is that of the points.
    const auto points = count(), polygons = count();
    read_edge_count();
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
      cursor_.fail("the file holds more than the " + std::to_string(points) + " points and " +
                   std::to_string(polygons) +
                   " polygons that it declares; correct the counts or remove the rest");
  }

 private:
  std::uint64_t count() {
    skip_space();
    return cursor_.number<std::uint64_t>("a count");
  }

  /// Passes over the number of edges. Nobody fills it in, and some leave it out; where each count has a line
  /// of its own, so has this one.
  void read_edge_count() {
    if (cursor_.rest_of_line().find_first_not_of(" \t\r,") != std::string_view::npos) return;
    // A copy of the cursor looks ahead: a line of one whole number alone is the count of edges, for the line
    // of a point has three numbers.
    TextCursor ahead = cursor_;
    ahead.skip_to_word([](std::string_view) {});
    std::string_view line = ahead.rest_of_line();
    while (!line.empty() && (line.back() == ' ' || line.back() == '\t' || line.back() == '\r'))
      line.remove_suffix(1);
    const bool is_count = !line.empty() && line.find_first_not_of("0123456789") == std::string_view::npos;
    if (is_count) cursor_ = ahead;
  }

  void skip_space() {
    cursor_.skip_to_word([this](std::string_view comment) { builder_.add_comment(comment); });
  }

  /// Reads a point. What follows the three coordinates on the line is a normal, a colour or a texture
  /// coordinate.
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

  /// Reads a polygon. What follows the corners on the line is a colour.
  void read_polygon() {
    builder_.tick(cursor_.offset(), total_);
    skip_space();
    const auto size = cursor_.number<std::uint64_t>("the number of corners");
    // Before anything is allocated: each corner takes a character at least.
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

/// How a program lays out what all of them call OFF BINARY.
struct BinaryLayout {
  bool little_endian;
  /// Behind the corners of a polygon stands the number of the numbers of its colour, then these.
  bool counted_colours;
  std::size_t point_floats;
};

/// Reads OFF BINARY: words of 32 bits, one behind the other.
class BinaryOffReader {
 public:
  BinaryOffReader(std::string_view bytes, BinaryLayout layout) : bytes_(bytes), layout_(layout) {}

  /// Whether the file ends where its last polygon does, or in padding. The walk keeps nothing, so that a
  /// wrong layout, whose counts are nonsense, takes no memory.
  bool fits() {
    const auto no_point = [](const Eigen::Vector3d&) {};
    const auto no_polygon = [](std::span<const std::int64_t>) {};
    return walk(no_point, no_polygon, false) && without_padding(bytes_.substr(at_)).empty();
  }

  void read(MeshBuilder& builder) {
    const auto add_point = [&](const Eigen::Vector3d& point) {
      builder.tick(at_, bytes_.size());
      builder.mesh.points.push_back(point);
    };
    const auto add_polygon = [&](std::span<const std::int64_t> corners) {
      builder.tick(at_, bytes_.size());
      builder.add_polygon(corners);
    };
    at_ = 0;
    walk(add_point, add_polygon, true);
  }

 private:
  bool has(std::uint64_t words) const { return words <= (bytes_.size() - at_) / 4; }
  std::uint32_t word() {
    std::uint32_t bits;
    std::memcpy(&bits, bytes_.data() + at_, sizeof bits);
    at_ += sizeof bits;
    const bool swapped = layout_.little_endian == (std::endian::native == std::endian::big);
    return swapped ? __builtin_bswap32(bits) : bits;
  }
  void skip(std::uint64_t words) { at_ += 4 * words; }

  /// Walks over the file, with the values of points and corners or without. @returns false where the bytes
  /// end too early.
  template <class Point, class Polygon>
  bool walk(Point&& point, Polygon&& polygon, bool with_values) {
    if (!has(3)) return false;
    const std::uint64_t points = word(), polygons = word();
    skip(1);  // the number of edges, which nobody fills in
    // Less than 2³² points of a dozen numbers: the product cannot overflow.
    if (!has(points * layout_.point_floats)) return false;
    // Numbers behind the coordinates, such as a normal, are stepped over.
    for (std::uint64_t i = 0; with_values && i < points; ++i) {
      const std::size_t start = at_;
      Eigen::Vector3d position;
      for (double& x : position) x = std::bit_cast<float>(word());
      point(position);
      at_ = start + 4 * layout_.point_floats;
    }
    if (!with_values) skip(points * layout_.point_floats);
    std::vector<std::int64_t> corners;
    for (std::uint64_t i = 0; i < polygons; ++i) {
      if (!has(1)) return false;
      const std::uint64_t size = word();
      if (!has(size)) return false;
      if (with_values) {
        corners.resize(size);
        // With a sign, so that a corner of −1 is refused rather than taken for the last of four billion.
        for (std::int64_t& corner : corners) corner = static_cast<std::int32_t>(word());
        polygon(corners);
      } else {
        skip(size);
      }
      if (!layout_.counted_colours) continue;
      if (!has(1)) return false;
      const std::uint64_t colour = word();
      if (!has(colour)) return false;
      skip(colour);
    }
    return true;
  }

  std::string_view bytes_;
  BinaryLayout layout_;
  std::size_t at_ = 0;
};

/// Tries the layouts that programs write. Geomview and CGAL write big-endian words and count the numbers of
/// colours; OpenMesh and PMP write neither, and OpenMesh's colours may lack the alpha. Only the length of the
/// file tells.
void read_binary_off(std::string_view bytes, const OffKeyword& keyword, MeshBuilder& builder) {
  // What the format says comes first; where several layouts fit, it wins.
  for (const bool little_endian : {false, true})
    for (const bool counted_colours : {true, false})
      for (const std::size_t colour : {4, 3}) {
        const std::size_t floats =
            3 + (keyword.normal ? 3 : 0) + (keyword.colour ? colour : 0) + (keyword.texture ? 2 : 0);
        BinaryOffReader reader(bytes, {little_endian, counted_colours, floats});
        if (reader.fits()) return reader.read(builder);
      }
  builder.fail(
      "its binary data are of another length than the counts of its points and polygons call for; the file "
      "is "
      "truncated or damaged");
}

}  // namespace

std::optional<OffKeyword> parse_off_keyword(std::string_view word) {
  OffKeyword keyword{};
  std::string_view rest = word;
  const auto take = [&](std::string_view prefix) {
    const bool is_there = rest.starts_with(prefix);
    if (is_there) rest.remove_prefix(prefix.size());
    return is_there;
  };
  // Geomview has them in this order, MeshLab in another.
  for (bool found = true; found;) {
    found = false;
    for (const auto& [prefix, flag] :
         {std::pair("ST", &keyword.texture), std::pair("C", &keyword.colour), std::pair("N", &keyword.normal),
          std::pair("4", &keyword.four), std::pair("n", &keyword.any_dimension)})
      if (!*flag && take(prefix)) *flag = found = true;
  }
  // In small letters the keyword stands alone, without prefixes.
  if (!take("OFF") && !(rest.size() == word.size() && (take("off") || take("Off")))) return std::nullopt;
  keyword.length = word.size() - rest.size();
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  // Digits that follow at once are the count of points, glued to the keyword.
  if (!std::ranges::all_of(rest, is_digit)) return std::nullopt;
  return keyword;
}

void read_off(std::string_view bytes, MeshBuilder& builder) {
  TextCursor cursor(bytes, builder.file(), 0, '#');
  const auto skip_space = [&] {
    cursor.skip_to_word([&](std::string_view comment) { builder.add_comment(comment); });
  };
  skip_space();
  const std::size_t start = cursor.offset();
  const std::string_view word = cursor.word();
  const std::optional<OffKeyword> keyword = parse_off_keyword(word);
  if (keyword && (keyword->four || keyword->any_dimension))
    cursor.fail_at(start, std::string(word.substr(0, keyword->length)) +
                              " files are not read; only points with three coordinates are");
  if (keyword) {
    if (keyword->length < word.size())
      builder.note("its keyword and the count of its points are one word; they were read as two");
    cursor.skip_blanks();
    if (cursor.peek() == 'B' && TextCursor(cursor).word() == "BINARY") {
      cursor.rest_of_line();
      read_binary_off(bytes.substr(cursor.offset()), *keyword, builder);
      return;
    }
  } else {
    builder.note("it lacks the keyword OFF; it was read as OFF all the same");
  }
  // A new cursor, since the count may begin within the word that this one has passed.
  OffReader(bytes, TextCursor(bytes, builder.file(), start + (keyword ? keyword->length : 0), '#'), builder)
      .read();
  builder.note_padding(bytes);
}

}  // namespace hermesh::mesh_formats
