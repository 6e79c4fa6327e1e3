// STL (3D Systems 1988): triangles without shared points, as text or binary.
#include "algorithms/io/mesh_file_formats.h"
#include "algorithms/io/stored_number.h"

namespace hermesh::mesh_formats {

namespace {

// Bytes: 80 of text and a count of 32 bits; then a normal and three corners of single precision, and two
// bytes of attributes, for each triangle.
constexpr std::size_t header_size = 84, triangle_size = 50;

std::uint64_t declared_triangles(std::string_view bytes) {
  return stored_number<std::uint32_t>(bytes.data() + 80);
}

class StlReader {
 public:
  StlReader(std::string_view bytes, MeshBuilder& builder)
      : bytes_(bytes), builder_(builder), merger_(builder.mesh.points) {}

  void read_binary() {
    const std::uint64_t end = header_size + triangle_size * count_triangles();
    builder_.mesh.triangles.reserve((end - header_size) / triangle_size);
    for (std::size_t at = header_size; at < end; at += triangle_size) {
      builder_.tick(at, bytes_.size());
      for (std::size_t i = 0; i < 3; ++i) {
        Eigen::Vector3d point;  // behind the normal, which is not used
        for (std::size_t k = 0; k < 3; ++k)
          point[static_cast<int>(k)] = stored_number<float>(bytes_.data() + at + 12 + 12 * i + 4 * k);
        add_corner(point);
      }
      end_polygon();
    }
  }

  void read_text() {
    TextCursor cursor(bytes_, builder_.file(), 0, '#');
    const auto skip_space = [&] {
      cursor.skip_to_word([this](std::string_view comment) { builder_.add_comment(comment); });
    };
    for (skip_space(); !cursor.at_end(); skip_space()) {
      builder_.tick(cursor.offset(), bytes_.size());
      const std::size_t start = cursor.offset();
      // Only "vertex" and "endloop" make polygons, with nothing but corners between them. The other keywords
      // show if the file breaks off.
      const Keyword keyword = read_keyword(cursor);
      if (keyword == Keyword::vertex) {
        read_vertex(cursor);
      } else if (keyword == Keyword::end_loop) {
        end_polygon();
      } else if (!corners_.empty()) {
        cursor.fail_at(start, "a facet that does not end in 'endloop'");
      } else if (keyword == Keyword::none) {
        // Some programs put colours between the facets. Elsewhere it may be a damaged corner, or another
        // file.
        if (solids_ == 0 || last_ == Keyword::outer || last_ == Keyword::end_solid)
          cursor.fail_at(start, "a word that is no keyword of an STL file");
        if (unknown_++ == 0) first_unknown_ = cursor.line_at(start);
        cursor.rest_of_line();
      } else if (keyword != Keyword::end_facet) {
        cursor.rest_of_line();  // a name, or a normal
      }
      solids_ += keyword == Keyword::solid || keyword == Keyword::facet;
      last_ = keyword;
    }
    check_end();
    builder_.note_padding(bytes_);
  }

 private:
  enum class Keyword { none, solid, facet, outer, vertex, end_loop, end_facet, end_solid };

  /// Returns the number of triangles of a binary file. If the size of the file fits a whole number of
  /// triangles, it decides: some programs leave a count of 0 or −1, or count wrong.
  std::uint64_t count_triangles() {
    if (bytes_.size() < header_size)
      builder_.fail("the file is truncated: an STL file has at least 84 bytes");
    const std::uint64_t declared = declared_triangles(bytes_),
                        whole = (bytes_.size() - header_size) / triangle_size;
    if (declared == whole && bytes_.size() == header_size + triangle_size * whole) return declared;
    if (whole > 0 && bytes_.size() == header_size + triangle_size * whole) {
      builder_.note("it declares ", declared, " triangles but has the length of ", whole,
                    ", which were read; if there were more, it was cut off");
      return whole;
    }
    if (whole < declared)
      builder_.fail("the file is truncated: it has ", bytes_.size(),
                    " bytes, but a binary STL file of its declared number of triangles has ",
                    header_size + triangle_size * declared);
    // The rest, not a multiple of a triangle's size, may only be padding.
    const std::string_view rest = bytes_.substr(header_size + triangle_size * declared);
    if (!without_padding(rest).empty())
      builder_.fail("it declares ", declared, " triangles, but ", rest.size(),
                    " bytes follow, which are not a whole number of triangles; the file is damaged");
    builder_.note_padding(rest);
    return declared;
  }

  /// Refuses a text that ends within a facet. One that ends behind a facet may be cut off, with a note.
  void check_end() {
    if (last_ != Keyword::end_solid && last_ != Keyword::end_facet)
      builder_.fail("the file is truncated: it does not end in 'endsolid'");
    if (last_ == Keyword::end_facet)
      builder_.note("it does not end in 'endsolid'; if there was more than ", polygons_,
                    " facets, it was cut off");
    if (unknown_ > 0)
      builder_.note(unknown_, " lines that do not belong into an STL file were ignored, the first is line ",
                    first_unknown_);
  }

  /// Reads a keyword, in letters of either case; "end loop" counts as "endloop".
  static Keyword read_keyword(TextCursor& cursor) {
    constexpr std::pair<std::string_view, Keyword> keywords[] = {
        {"vertex", Keyword::vertex},     {"facet", Keyword::facet},        {"outer", Keyword::outer},
        {"endloop", Keyword::end_loop},  {"endfacet", Keyword::end_facet}, {"solid", Keyword::solid},
        {"endsolid", Keyword::end_solid}};
    const auto is = [](std::string_view word, std::string_view name) {
      return std::ranges::equal(word, name, [](char a, char b) { return a == b || a == b - 'a' + 'A'; });
    };
    const std::string_view word = cursor.word();
    const std::string_view end = is(word, "end") ? word : std::string_view();
    if (!end.empty()) cursor.skip_blanks();
    const std::string_view rest = end.empty() ? word : cursor.word();
    for (const auto& [name, keyword] : keywords)
      if (end.empty() ? is(word, name) : name.starts_with("end") && is(rest, name.substr(3))) return keyword;
    return Keyword::none;
  }

  void read_vertex(TextCursor& cursor) {
    Eigen::Vector3d point;
    for (double& x : point) {
      cursor.skip_space();
      x = cursor.number<double>("a number");
    }
    add_corner(point);
  }

  void add_corner(const Eigen::Vector3d& point) {
    if (!point.allFinite())
      builder_.fail("point ", corners_.size(), " of triangle ", polygons_,
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
  std::size_t polygons_ = 0, solids_ = 0, unknown_ = 0, first_unknown_ = 0;
  Keyword last_ = Keyword::none;
};

}  // namespace

bool is_binary_stl(std::string_view bytes) {
  return bytes.size() >= header_size &&
         bytes.size() == header_size + triangle_size * declared_triangles(bytes);
}

/// Reads an STL file of either kind. Some binary files begin with "solid", too, but the count of a binary
/// file has a zero byte, which text has only as padding.
void read_stl(std::string_view bytes, MeshBuilder& builder) {
  const auto has_zero = [](std::string_view part) { return part.find('\0') != std::string_view::npos; };
  const bool text = !is_binary_stl(bytes) && !has_zero(without_padding(bytes).substr(0, 1000)) &&
                    (bytes.size() < header_size || !has_zero(bytes.substr(0, header_size)));
  StlReader reader(bytes, builder);
  if (text)
    reader.read_text();
  else
    reader.read_binary();
}

}  // namespace hermesh::mesh_formats
