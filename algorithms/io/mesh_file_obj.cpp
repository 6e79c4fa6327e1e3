// OBJ (Wavefront): lines of points (v) and polygons (f), and on request colours behind the points, normals
// (vn), texture coordinates (vt) and materials (usemtl); everything else is ignored.
#include <algorithm>
#include <map>

#include "algorithms/io/mesh_file_formats.h"

namespace hermesh::mesh_formats {

namespace {

constexpr std::int64_t kNone = -1;

/// A list that corners refer to by number, vt or vn, and the number of each corner of the file.
struct CornerList {
  const char* attribute;
  const char* what;  ///< for messages
  int components;
  std::vector<float> values = {};
  std::vector<std::int64_t> corners = {};  ///< from 0, or kNone
  bool used = false;
  std::string spoiled = {};  ///< why it cannot be read; empty if it can

  std::int64_t size() const { return static_cast<std::int64_t>(values.size()) / components; }
};

class ObjReader {
 public:
  ObjReader(std::string_view bytes, MeshBuilder& builder)
      : cursor_(bytes, builder.file(), 0, '#', '\\'), builder_(builder), bytes_(bytes) {}

  void read() {
    while (true) {
      cursor_.skip_space();
      if (cursor_.at_end()) break;
      builder_.tick(cursor_.offset(), bytes_.size());
      read_line();
    }
    if (left_out_ > 0)
      builder_.note("it holds curves, surfaces or calls of other files on ", left_out_,
                    " lines, which are not read; the mesh lacks them");
    if (weighted_ > 0)
      builder_.note(weighted_, " of its points have a weight, by which their coordinates were divided");
    builder_.note_padding(bytes_);
    if (builder_.attributes()) finish_attributes();
  }

 private:
  void read_line() {
    if (cursor_.peek() == '#') {
      cursor_.advance();
      builder_.add_comment(cursor_.rest_of_line());
      return;
    }
    const std::size_t start = cursor_.offset();
    const std::string_view keyword = cursor_.word();
    const char first = keyword[0];
    if (keyword == "v") {
      read_point();
    } else if (keyword == "f" || keyword == "fo") {  // the old name of f
      read_polygon();
    } else if (builder_.attributes() && keyword == "vt") {
      read_value(uvs_, 1);
    } else if (builder_.attributes() && keyword == "vn") {
      read_value(normals_, 3);
    } else if (builder_.attributes() && keyword == "usemtl") {
      read_material();
    } else if ((first >= 'a' && first <= 'z') || (first >= 'A' && first <= 'Z')) {
      // A word of letters may be a keyword of some program; anything else is damage, or no OBJ file.
      constexpr std::string_view geometry[] = {"curv", "surf", "call", "bzp", "bsp", "cdc", "cdp", "res"};
      left_out_ += std::ranges::find(geometry, keyword) != std::end(geometry);
      skip_continued_line();
    } else {
      cursor_.fail_at(start, quoted_word(keyword) + " is no keyword of an OBJ file");
    }
  }

  void skip_blanks() { cursor_.skip_blanks_and_continuations(); }
  void skip_continued_line() {
    while (cursor_.rest_of_line().ends_with('\\')) {
    }
  }

  /// Reads a point, whose coordinates may be followed by a weight, by which they are divided, a colour, or
  /// both in this order.
  void read_point() {
    Eigen::Vector3d point;
    for (double& x : point) {
      skip_blanks();
      x = cursor_.number<double>("a number");
    }
    std::array<double, 4> numbers{};
    std::size_t count = 0;
    bool good = true;
    for (skip_blanks(); count < 4 && !cursor_.at_line_end() && cursor_.peek() != '#'; skip_blanks()) {
      const std::optional<double> number = cursor_.number_if_any<double>();
      good = good && number;
      numbers[count++] = number.value_or(0.0);
    }
    const double weight = good && (count == 1 || count == 4) ? numbers[0] : 1.0;
    if (weight != 1.0 && weight != 0.0) point /= weight, ++weighted_;
    builder_.mesh.points.push_back(point);
    if (builder_.attributes()) add_colour(numbers, count, good);
    skip_continued_line();
  }

  /// Adds the colour of the newest point: three numbers, or the last three of four.
  void add_colour(const std::array<double, 4>& numbers, std::size_t count, bool good) {
    AttributeTable& attributes = *builder_.attributes();
    attributes.begin(AttributeDomain::point);
    // A single number is a weight, two have no meaning.
    if (count < 3 && good) return;
    if (!colour_) colour_ = attributes.add("colour", AttributeDomain::point, 3, false);
    if (!good) return attributes.spoil_value(*colour_, "is no number");
    for (int i = 0; i < 3; ++i) attributes.set(*colour_, i, numbers[count - 3 + static_cast<std::size_t>(i)]);
  }

  /// Reads a line of vt or vn, which must have at least `least` numbers.
  void read_value(CornerList& list, int least) {
    skip_blanks();
    for (int i = 0; i < list.components; ++i, skip_blanks()) {
      const bool missing = cursor_.at_line_end() || cursor_.peek() == '#';
      const std::size_t start = cursor_.offset();
      const std::optional<float> number = missing ? 0.0f : cursor_.number_if_any<float>();
      if (!number || (missing && i < least))
        spoil(list, start, "a " + std::string(list.what) + (missing ? " is incomplete" : " is no number"));
      // A bad value counts, too, in the numbering of the list.
      list.values.push_back(number.value_or(0.0f));
    }
    skip_continued_line();
  }

  /// Marks a list that cannot be read; the polygons are read anyway.
  void spoil(CornerList& list, std::size_t offset, const std::string& reason) {
    if (list.spoiled.empty())
      list.spoiled = "line " + std::to_string(cursor_.line_at(offset)) + ": " + reason;
  }

  void read_material() {
    AttributeTable& attributes = *builder_.attributes();
    skip_blanks();
    const std::string name(cursor_.rest_of_line());
    if (name.ends_with('\\')) skip_continued_line();
    if (!material_attribute_)
      material_attribute_ = attributes.add("material", AttributeDomain::polygon, 1, true);
    // Numbered in the order of their first use.
    const auto [entry, added] = material_numbers_.emplace(name, static_cast<int>(materials_.size()));
    if (added) materials_.push_back(name);
    material_ = entry->second;
  }

  /// Reads a polygon, whose corners are v, v/vt, v//vn or v/vt/vn; a negative v counts back from the latest
  /// point.
  void read_polygon() {
    corners_.clear();
    for (skip_blanks(); !cursor_.at_line_end() && cursor_.peek() != '#'; skip_blanks()) {
      const auto index = cursor_.leading_number<std::int64_t>("the number of a point");
      if (index == 0) cursor_.fail("the points of an OBJ file count from 1, but a polygon refers to point 0");
      const auto points = static_cast<std::int64_t>(builder_.mesh.points.size());
      if (index < -points)
        cursor_.fail("a polygon refers to point ", index, ", but there are only ", points,
                     " points before it");
      // Numbers that count back are resolved here; others may name a later point and are checked at the end.
      corners_.push_back(index > 0 ? index - 1 : points + index);
      if (builder_.attributes()) {
        read_corner_value(uvs_);
        read_corner_value(normals_);
      }
      // Skips the rest of the corner, such as a normal without attributes.
      if (cursor_.peek() == '/')
        while (!cursor_.ends_word()) cursor_.advance();
      if (!cursor_.ends_word()) cursor_.fail("a corner of a polygon is not a number");
    }
    cursor_.rest_of_line();  // a comment
    builder_.add_polygon(corners_);
    if (AttributeTable* attributes = builder_.attributes()) {
      attributes->begin(AttributeDomain::polygon);
      if (material_ >= 0) attributes->set(*material_attribute_, 0, material_);
    }
  }

  /// Reads the number behind the next slash, if there is one, which counts like that of a point.
  void read_corner_value(CornerList& list) {
    list.corners.push_back(kNone);
    if (cursor_.peek() != '/') return;
    cursor_.advance();
    if (cursor_.peek() == '/' || cursor_.ends_word()) return;
    list.used = true;
    const std::size_t start = cursor_.offset();
    const std::optional<std::int64_t> index = cursor_.leading_number_if_any<std::int64_t>();
    if (!index || *index == 0 || *index < -list.size())
      return spoil(
          list, start,
          index ? wrong_index(list, *index) : "the number of a " + std::string(list.what) + " is no number");
    list.corners.back() = *index > 0 ? *index - 1 : list.size() + *index;
  }

  static std::string wrong_index(const CornerList& list, std::int64_t index) {
    return "a polygon refers to " + std::string(list.what) + " " + std::to_string(index) +
           ", but the file has " + std::to_string(list.size()) + " and counts them from 1";
  }

  void finish_attributes() {
    AttributeTable& attributes = *builder_.attributes();
    if (material_attribute_) attributes.set_labels(*material_attribute_, materials_);
    // Only now all lists are complete: a vt or vn may follow the polygon that refers to it.
    std::vector<std::pair<std::size_t, const CornerList*>> lists;
    for (const CornerList* list : {&uvs_, &normals_}) {
      if (!list->used) continue;
      lists.emplace_back(attributes.add(list->attribute, AttributeDomain::corner, list->components, false),
                         list);
      if (!list->spoiled.empty()) attributes.spoil(lists.back().first, list->spoiled);
    }
    if (lists.empty()) return;
    for (std::size_t corner = 0; corner < uvs_.corners.size(); ++corner) {
      attributes.begin(AttributeDomain::corner);
      for (const auto& [column, list] : lists) {
        const std::int64_t index = list->corners[corner];
        if (index >= list->size()) attributes.spoil(column, wrong_index(*list, index + 1));
        if (index == kNone || index >= list->size()) continue;
        for (int i = 0; i < list->components; ++i)
          attributes.set(column, i, list->values[static_cast<std::size_t>(index * list->components + i)]);
      }
    }
  }

  TextCursor cursor_;
  MeshBuilder& builder_;
  std::string_view bytes_;
  std::size_t weighted_ = 0;  ///< points that were divided by a weight
  std::size_t left_out_ = 0;  ///< lines with other geometry than points and polygons
  std::vector<std::int64_t> corners_;
  // For attributes.
  CornerList uvs_{"uv", "texture coordinate", 2}, normals_{"normal", "normal", 3};
  std::optional<std::size_t> colour_, material_attribute_;
  std::vector<std::string> materials_;
  std::map<std::string, int> material_numbers_;
  int material_ = static_cast<int>(kNone);
};

}  // namespace

void read_obj(std::string_view bytes, MeshBuilder& builder) { ObjReader(bytes, builder).read(); }

}  // namespace hermesh::mesh_formats
