// OBJ (Wavefront): lines of points (v) and polygons (f), and where attributes are asked for, colours behind
// the points, normals (vn), texture coordinates (vt) and materials (usemtl); everything else is passed over.
#include <algorithm>
#include <map>

#include "algorithms/io/mesh_file_formats.h"

namespace hermesh::mesh_formats {

namespace {

constexpr std::int64_t kNone = -1;

/// A list that corners refer to by number, vt or vn, and which of its values each corner of the file has.
struct CornerList {
  const char* attribute;
  const char* what;  ///< for complaints
  int components;
  std::vector<float> values = {};
  std::vector<std::int64_t> corners = {};  ///< from 0, or kNone
  bool used = false;
  std::string spoiled = {};  ///< why it cannot be read

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
    // What is no polygon is left out with a note: a mesh that lacks half of the model should not pass for
    // whole.
    if (left_out_ > 0)
      builder_.note("it holds curves, surfaces or calls of other files on " + std::to_string(left_out_) +
                    " lines, which are not read; the mesh lacks them");
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
    // From the commonest line to the rarest. Attributes that nobody asked for are skipped like any other
    // line.
    if (keyword == "v") {
      read_point();
    } else if (keyword == "f" || keyword == "fo") {  // fo is what f was called at first
      read_polygon();
    } else if (builder_.attributes() && keyword == "vt") {
      read_value(uvs_, 1);
    } else if (builder_.attributes() && keyword == "vn") {
      read_value(normals_, 3);
    } else if (builder_.attributes() && keyword == "usemtl") {
      read_material();
    } else if ((first >= 'a' && first <= 'z') || (first >= 'A' && first <= 'Z')) {
      // A word of letters may be a keyword of some program; anything else shows that the file is damaged, or
      // no OBJ file.
      left_out_ += is_other_geometry(keyword);
      skip_continued_line();
    } else {
      cursor_.fail_at(start, quoted_word(keyword) + " is no keyword of an OBJ file");
    }
  }

  static bool is_other_geometry(std::string_view keyword) {
    constexpr std::string_view keywords[] = {"curv", "surf", "call", "bzp", "bsp", "cdc", "cdp", "res"};
    return std::ranges::find(keywords, keyword) != std::end(keywords);
  }

  void skip_blanks() { cursor_.skip_blanks_and_continuations(); }

  void skip_continued_line() {
    while (cursor_.rest_of_line().ends_with('\\')) {
    }
  }

  /// A point. What follows its three coordinates is a weight or a colour.
  void read_point() {
    Eigen::Vector3d point;
    for (double& x : point) {
      skip_blanks();
      x = cursor_.number<double>("a number");
    }
    builder_.mesh.points.push_back(point);
    if (builder_.attributes()) read_colour();
    skip_continued_line();
  }

  /// The colour of the newest point: three numbers, or the last three of four, of which the first is then a
  /// weight.
  void read_colour() {
    AttributeBuilder& attributes = *builder_.attributes();
    attributes.begin(AttributeDomain::point);
    std::array<double, 4> numbers{};
    std::size_t count = 0;
    bool good = true;
    for (skip_blanks(); count < 4 && !cursor_.at_line_end() && cursor_.peek() != '#'; skip_blanks()) {
      const std::optional<double> number = cursor_.number_if_any<double>();
      good = good && number;
      numbers[count++] = number.value_or(0.0);
    }
    // A lone number is the weight of a rational curve, two are nothing known: no colour, and no complaint.
    if (count < 3 && good) return;
    // The attribute begins with the first point that has a colour; points before it get 0.
    if (!colour_) colour_ = attributes.add("colour", AttributeDomain::point, 3, false);
    if (!good) return attributes.spoil_value(*colour_, "is no number");
    for (int i = 0; i < 3; ++i) attributes.set(*colour_, i, numbers[count - 3 + static_cast<std::size_t>(i)]);
  }

  /// Reads a line of vt or vn, of which `least` numbers must be there.
  void read_value(CornerList& list, int least) {
    skip_blanks();
    for (int i = 0; i < list.components; ++i, skip_blanks()) {
      const bool missing = cursor_.at_line_end() || cursor_.peek() == '#';
      const std::size_t start = cursor_.offset();
      const std::optional<float> number = missing ? 0.0f : cursor_.number_if_any<float>();
      if (!number || (missing && i < least))
        spoil(list, start, "a " + std::string(list.what) + (missing ? " is incomplete" : " is no number"));
      // A place is kept for a bad value, too, for the numbers of those behind it count it.
      list.values.push_back(number.value_or(0.0f));
    }
    skip_continued_line();
  }

  /// Marks a list as one that cannot be read. The polygons are read all the same.
  void spoil(CornerList& list, std::size_t offset, const std::string& reason) {
    if (list.spoiled.empty())
      list.spoiled = "line " + std::to_string(cursor_.line_at(offset)) + ": " + reason;
  }

  void read_material() {
    AttributeBuilder& attributes = *builder_.attributes();
    skip_blanks();
    const std::string name(cursor_.rest_of_line());
    if (name.ends_with('\\')) skip_continued_line();
    if (!material_attribute_)
      material_attribute_ = attributes.add("material", AttributeDomain::polygon, 1, true);
    // Materials are numbered in the order in which they are first used; one that comes again keeps its
    // number.
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
        cursor_.fail("a polygon refers to point " + std::to_string(index) + ", but there are only " +
                     std::to_string(points) + " points before it");
      // What counts back must be resolved here; a number from the front may name a point that is still to
      // come, and is checked at the end.
      corners_.push_back(index > 0 ? index - 1 : points + index);
      if (builder_.attributes()) {
        read_corner_value(uvs_);
        read_corner_value(normals_);
      }
      // What is left of the corner, such as its normal where nobody asked for attributes.
      if (cursor_.peek() == '/')
        while (!cursor_.ends_word()) cursor_.advance();
      if (!cursor_.ends_word()) cursor_.fail("a corner of a polygon is not a number");
    }
    // What is left is a comment.
    cursor_.rest_of_line();
    builder_.add_polygon(corners_);
    if (AttributeBuilder* attributes = builder_.attributes()) {
      attributes->begin(AttributeDomain::polygon);
      // Polygons before the first usemtl have no material, which is −1.
      if (material_ >= 0) attributes->set(*material_attribute_, 0, material_);
    }
  }

  /// Reads the number behind the next slash, if there is one, counted as the number of a point is.
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
    AttributeBuilder& attributes = *builder_.attributes();
    if (material_attribute_) attributes.set_labels(*material_attribute_, materials_);
    std::vector<std::pair<std::size_t, const CornerList*>> lists;
    // Corners are given their values when all lists are complete, because a vt or vn may stand behind the
    // polygon that names it.
    for (const CornerList* list : {&uvs_, &normals_}) {
      if (!list->used) continue;
      lists.emplace_back(attributes.add(list->attribute, AttributeDomain::corner, list->components, false),
                         list);
      if (!list->spoiled.empty()) attributes.spoil(lists.back().first, list->spoiled);
    }
    if (lists.empty()) return;
    for (std::size_t corner = 0; corner < uvs_.corners.size(); ++corner) {
      attributes.begin(AttributeDomain::corner);
      for (const auto& [attribute, list] : lists)
        set_corner(attributes, attribute, *list, list->corners[corner]);
    }
  }

  void set_corner(AttributeBuilder& attributes, std::size_t attribute, const CornerList& list,
                  std::int64_t index) {
    if (index == kNone) return;
    // Only now the length of the list is known.
    if (index >= list.size()) return attributes.spoil(attribute, wrong_index(list, index + 1));
    for (int i = 0; i < list.components; ++i)
      attributes.set(attribute, i, list.values[static_cast<std::size_t>(index * list.components + i)]);
  }

  TextCursor cursor_;
  MeshBuilder& builder_;
  std::string_view bytes_;
  std::size_t left_out_ = 0;  ///< lines with other geometry than points and polygons
  std::vector<std::int64_t> corners_;
  // Attributes, where they are asked for.
  CornerList uvs_{"uv", "texture coordinate", 2}, normals_{"normal", "normal", 3};
  std::optional<std::size_t> colour_, material_attribute_;
  std::vector<std::string> materials_;
  std::map<std::string, int> material_numbers_;
  int material_ = static_cast<int>(kNone);
};

}  // namespace

void read_obj(std::string_view bytes, MeshBuilder& builder) { ObjReader(bytes, builder).read(); }

}  // namespace hermesh::mesh_formats
