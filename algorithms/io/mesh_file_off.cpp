// OFF (Geomview): a keyword, three counts, a line for each point and each polygon; or the same in binary.
#include <algorithm>
#include <bit>

#include "algorithms/io/mesh_file_formats.h"
#include "algorithms/io/stored_number.h"

namespace hermesh::mesh_formats {

namespace {

/// Reads OFF in text behind the keyword.
class OffReader {
 public:
  OffReader(std::string_view bytes, std::size_t start, MeshBuilder& builder)
      : cursor_(bytes, builder.file(), start, '#'), builder_(builder), total_(bytes.size()) {}

  void read() {
    const auto points = next<std::uint64_t>("a count"), polygons = next<std::uint64_t>("a count");
    skip_edge_count();
    // Before memory is reserved: a point takes three digits and three spaces, a polygon one of each; the last
    // space may be missing.
    const std::uint64_t space = cursor_.remaining() + 1;
    if (points > space / 6 || polygons > space / 2 || 6 * points + 2 * polygons > space)
      builder_.fail("the file is truncated: it declares ", points, " points and ", polygons,
                    " polygons, for which it is too short");
    builder_.mesh.points.reserve(points);
    builder_.mesh.triangles.reserve(polygons);
    for (std::uint64_t i = 0; i < points; ++i) read_point();
    for (std::uint64_t i = 0; i < polygons; ++i) read_polygon();
    skip_space();
    if (!cursor_.at_end())
      cursor_.fail("the file holds more than the ", points, " points and ", polygons,
                   " polygons that it declares; correct the counts or remove the rest");
  }

 private:
  void skip_space() {
    cursor_.skip_to_word([this](std::string_view comment) { builder_.add_comment(comment); });
  }
  template <class T>
  T next(const char* what) {
    skip_space();
    return cursor_.number<T>(what);
  }

  /// Skips the number of edges, which is never used and may be missing; if each count has a line of its own,
  /// so has this one.
  void skip_edge_count() {
    if (cursor_.rest_of_line().find_first_not_of(" \t\r,") != std::string_view::npos) return;
    // A line of one integer is the number of edges, since the line of a point has three numbers.
    TextCursor ahead = cursor_;
    ahead.skip_to_word([](std::string_view) {});
    const std::string_view line = without_padding(ahead.rest_of_line());
    if (!line.empty() && line.find_first_not_of("0123456789") == std::string_view::npos) cursor_ = ahead;
  }

  /// Reads a point; the rest of the line is a normal, a colour or a texture coordinate.
  void read_point() {
    builder_.tick(cursor_.offset(), total_);
    Eigen::Vector3d point;
    for (double& x : point) x = next<double>("a number");
    builder_.mesh.points.push_back(point);
    cursor_.rest_of_line();
  }

  /// Reads a polygon; the rest of the line is a colour.
  void read_polygon() {
    builder_.tick(cursor_.offset(), total_);
    const auto size = next<std::uint64_t>("the number of corners");
    // Before memory is taken: each corner takes at least one character.
    if (size > cursor_.remaining())
      cursor_.fail("the file is truncated: a polygon has more corners than are left");
    corners_.resize(size);
    for (std::int64_t& corner : corners_) corner = next<std::int64_t>("the number of a point");
    builder_.add_polygon(corners_);
    cursor_.rest_of_line();
  }

  TextCursor cursor_;
  MeshBuilder& builder_;
  std::size_t total_;
  std::vector<std::int64_t> corners_;
};

/// Layout of OFF BINARY, in which programs differ.
struct BinaryLayout {
  bool swapped;
  bool
      counted_colours;  ///< the corners of a polygon are followed by the length of its colour, and the colour
  std::size_t point_floats;
};

/// Reads OFF BINARY, a sequence of words of 32 bits.
class BinaryOffReader {
 public:
  BinaryOffReader(std::string_view bytes, BinaryLayout layout) : bytes_(bytes), layout_(layout) {}

  /// Reads the file into the builder, or only steps through it if that is null, so that a wrong layout, whose
  /// counts are nonsense, takes no memory. Returns true if the file ends with its last polygon, or in
  /// padding.
  bool read(MeshBuilder* builder) {
    at_ = 0;
    if (!has(3)) return false;
    const std::uint64_t points = word(), polygons = word();
    skip(1);  // the number of edges
    // Less than 2³² points of a dozen numbers: the product cannot overflow.
    if (!has(points * layout_.point_floats)) return false;
    if (!builder) skip(points * layout_.point_floats);
    for (std::uint64_t i = 0; builder && i < points; ++i) {
      const std::size_t start = at_;
      Eigen::Vector3d point;
      for (double& x : point) x = std::bit_cast<float>(word());
      builder->tick(at_, bytes_.size());
      builder->mesh.points.push_back(point);
      at_ = start + 4 * layout_.point_floats;
    }
    std::vector<std::int64_t> corners;
    for (std::uint64_t i = 0; i < polygons; ++i) {
      if (!has(1)) return false;
      const std::uint64_t size = word();
      if (!has(size)) return false;
      if (builder) {
        corners.resize(size);
        // Signed, so that a corner −1 is rejected rather than read as the last of four billion.
        for (std::int64_t& corner : corners) corner = static_cast<std::int32_t>(word());
        builder->tick(at_, bytes_.size());
        builder->add_polygon(corners);
      } else {
        skip(size);
      }
      if (!layout_.counted_colours) continue;
      if (!has(1)) return false;
      const std::uint64_t colour = word();
      if (!has(colour)) return false;
      skip(colour);
    }
    return without_padding(bytes_.substr(at_)).empty();
  }

 private:
  bool has(std::uint64_t words) const { return words <= (bytes_.size() - at_) / 4; }
  std::uint32_t word() {
    at_ += 4;
    return stored_number<std::uint32_t>(bytes_.data() + at_ - 4, layout_.swapped);
  }
  void skip(std::uint64_t words) { at_ += 4 * words; }

  std::string_view bytes_;
  BinaryLayout layout_;
  std::size_t at_ = 0;
};

/// Tries the layouts that programs write; only the length of the file distinguishes them. Geomview and CGAL
/// write big-endian words and the lengths of colours; OpenMesh and PMP write neither, and OpenMesh's colours
/// may lack the alpha.
void read_binary_off(std::string_view bytes, const OffKeyword& keyword, MeshBuilder& builder) {
  // The layout of the format comes first.
  for (const bool big_endian : {true, false})
    for (const bool counted_colours : {true, false})
      for (const std::size_t colour : {4, 3}) {
        const std::size_t floats =
            3 + (keyword.normal ? 3 : 0) + (keyword.colour ? colour : 0) + (keyword.texture ? 2 : 0);
        BinaryOffReader reader(bytes, {is_swapped(big_endian), counted_colours, floats});
        if (reader.read(nullptr)) return void(reader.read(&builder));
      }
  builder.fail(
      "its binary data are of another length than its counts of points and polygons require; the file is "
      "truncated or damaged");
}

}  // namespace

std::optional<OffKeyword> parse_off_keyword(std::string_view word) {
  OffKeyword keyword{};
  std::string_view rest = word;
  const auto take = [&](std::string_view prefix) {
    const bool found = rest.starts_with(prefix);
    if (found) rest.remove_prefix(prefix.size());
    return found;
  };
  // Geomview has them in this order, MeshLab in another.
  for (bool found = true; found;) {
    found = false;
    for (const auto& [prefix, flag] :
         {std::pair("ST", &keyword.texture), std::pair("C", &keyword.colour), std::pair("N", &keyword.normal),
          std::pair("4", &keyword.four), std::pair("n", &keyword.any_dimension)})
      if (!*flag && take(prefix)) *flag = found = true;
  }
  // In small letters the keyword has no prefixes.
  if (!take("OFF") && !(rest.size() == word.size() && (take("off") || take("Off")))) return std::nullopt;
  keyword.length = word.size() - rest.size();
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  // Digits that follow at once are the number of points.
  if (!std::ranges::all_of(rest, is_digit)) return std::nullopt;
  return keyword;
}

void read_off(std::string_view bytes, MeshBuilder& builder) {
  TextCursor cursor(bytes, builder.file(), 0, '#');
  cursor.skip_to_word([&](std::string_view comment) { builder.add_comment(comment); });
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
    builder.note("it lacks the keyword OFF; it was read as OFF anyway");
  }
  // From the end of the keyword, since the count may begin within its word.
  OffReader(bytes, start + (keyword ? keyword->length : 0), builder).read();
  builder.note_padding(bytes);
}

}  // namespace hermesh::mesh_formats
