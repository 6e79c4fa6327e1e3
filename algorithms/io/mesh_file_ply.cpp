// PLY (Turk 1994): a header that declares elements and their properties, then the elements in that order.
#include <algorithm>
#include <cmath>

#include "algorithms/io/mesh_file_formats.h"
#include "algorithms/io/stored_number.h"

namespace hermesh::mesh_formats {

namespace {

/// Use of a property. `corners` is a list of the corners of a polygon, `strips` of triangle strips; `value`
/// is one number of an attribute, `corner_values` a list of numbers for the corners of a polygon.
enum class Role { ignored, x, y, z, corners, strips, value, corner_values };

struct Property {
  std::string_view name;
  NumberType type;
  std::optional<NumberType> list_count;  ///< type of the number of items, if the property is a list
  Role role = Role::ignored;
  // Of the attribute, if the role is one of the last two.
  std::size_t column = 0;
  int component = 0;  ///< component of the attribute; for a list, the number of components per corner
  double unit = 1.0;  ///< divisor that scales the number to the attribute's unit
};

struct Element {
  std::string_view name;
  std::uint64_t count;
  std::vector<Property> properties = {};
  bool has_polygons = false;  ///< true if a property has the role `corners`
};

enum class Encoding { ascii, little_endian, big_endian };

struct PlyHeader {
  Encoding encoding = Encoding::ascii;
  std::vector<Element> elements;
  std::size_t length = 0;  ///< bytes before the first element
  bool has_corner_values = false;
};

/// Properties that form one attribute.
struct Group {
  const char* attribute;
  std::vector<std::string_view> properties;
  bool to_unit = false;  ///< integers are scaled from 0 to the largest of their type
};

/// Finds the properties of a group, or none if one is missing or taken by another group.
std::vector<Property*> members(Element& element, const Group& group) {
  std::vector<Property*> found;
  for (const std::string_view name : group.properties) {
    const auto property = std::ranges::find_if(element.properties, [&](const Property& each) {
      return each.name == name && !each.list_count && each.role == Role::ignored;
    });
    if (property == element.properties.end()) return {};
    found.push_back(&*property);
  }
  return found;
}

/// Gives the known groups their columns, then each remaining number a column of its own.
void add_value_columns(Element& element, AttributeDomain domain, AttributeTable& attributes) {
  // Groups that contain others come first.
  static const std::vector<Group> groups = {{"normal", {"nx", "ny", "nz"}},
                                            {"colour", {"red", "green", "blue", "alpha"}, true},
                                            {"colour", {"red", "green", "blue"}, true},
                                            {"uv", {"u", "v"}},
                                            {"uv", {"s", "t"}},
                                            {"uv", {"texture_u", "texture_v"}}};
  const auto assign = [](Property& property, std::size_t column, int component, double unit) {
    property.role = Role::value;
    property.column = column, property.component = component, property.unit = unit;
  };
  for (const Group& group : groups) {
    const std::vector<Property*> found = members(element, group);
    if (found.empty()) continue;
    const std::size_t column = attributes.add(group.attribute, domain, static_cast<int>(found.size()), false);
    for (std::size_t i = 0; i < found.size(); ++i)
      assign(*found[i], column, static_cast<int>(i),
             group.to_unit && is_whole(found[i]->type) ? largest_of(found[i]->type) : 1.0);
  }
  for (Property& property : element.properties)
    if (property.role == Role::ignored && !property.list_count)
      assign(property, attributes.add(std::string(property.name), domain, 1, is_whole(property.type)), 0,
             1.0);
}

/// Gives all attributes of the header their columns. Points come before polygons, then corners, so that a
/// name is free for them in this order.
void add_columns(PlyHeader& header, AttributeTable& attributes) {
  for (Element& element : header.elements)
    if (element.name == "vertex") add_value_columns(element, AttributeDomain::point, attributes);
  for (Element& element : header.elements) {
    if (!element.has_polygons) continue;
    add_value_columns(element, AttributeDomain::polygon, attributes);
    const auto list = std::ranges::find_if(element.properties, [](const Property& each) {
      return each.list_count && (each.name == "texcoord" || each.name == "texture_uv");
    });
    if (list == element.properties.end()) continue;
    list->role = Role::corner_values;
    list->component = 2;
    list->column = attributes.add("uv", AttributeDomain::corner, list->component, false);
    header.has_corner_values = true;
  }
}

/// Parses the header. The builder gets its comments, and a column for each attribute. Errors name the line.
class PlyHeaderParser {
 public:
  PlyHeaderParser(std::string_view bytes, MeshBuilder& builder) : bytes_(bytes), builder_(builder) {
    position_ = bytes.size() - without_byte_order_mark(bytes).size();
    // Lines end in "\n", "\r\n" or, on old Macs, "\r", as the first line shows. Binary data may follow, so a
    // "\r" that ends a line must not take a first data byte "\n" along.
    const std::size_t end = bytes.find_first_of("\r\n", position_);
    line_end_ =
        end != std::string_view::npos && bytes[end] == '\r' && bytes.substr(end + 1, 1) != "\n" ? '\r' : '\n';
  }

  PlyHeader parse() {
    next_line();  // "ply"
    bool format_known = false;
    while (true) {
      next_line();
      const std::string_view keyword = next_word();
      if (keyword == "end_header") break;
      if (keyword == "format") {
        header_.encoding = encoding();
        format_known = true;
      } else if (keyword == "comment") {
        builder_.add_comment(line_);
      } else if (keyword == "element") {
        add_element();
      } else if (keyword == "property") {
        add_property();
      } else if (keyword != "obj_info" && !keyword.empty()) {
        skip_unknown(keyword);
      }
    }
    if (unknown_ > 0)
      builder_.note(unknown_, " lines of its header that are no declaration were ignored, the first is line ",
                    first_unknown_);
    if (!format_known) fail("the header has no line 'format'");
    header_.length = position_;
    if (builder_.attributes()) add_columns(header_, *builder_.attributes());
    return std::move(header_);
  }

 private:
  void next_line() {
    const std::size_t end = bytes_.find(line_end_, position_);
    if (end == std::string_view::npos) builder_.fail("the file is truncated: its PLY header has no end");
    line_ = bytes_.substr(position_, end - position_);
    position_ = end + 1;
    ++line_number_;
  }
  std::string_view next_word() {
    // A "\r" before the end of the line counts as a blank.
    line_.remove_prefix(std::min(line_.find_first_not_of(" \t\r"), line_.size()));
    const std::string_view word = line_.substr(0, line_.find_first_of(" \t\r"));
    line_.remove_prefix(word.size());
    return word;
  }
  Encoding encoding() {
    const std::string_view word = next_word();
    if (word == "ascii") return Encoding::ascii;
    if (word == "binary_little_endian") return Encoding::little_endian;
    if (word == "binary_big_endian") return Encoding::big_endian;
    fail(quoted_word(word), " is no PLY format");
  }
  /// Returns the type of a name of 1994, or of one with the size.
  static std::optional<NumberType> known_type(std::string_view word) {
    constexpr std::pair<std::array<std::string_view, 2>, NumberType> types[] = {
        {{"char", "int8"}, NumberType::int8},        {{"uchar", "uint8"}, NumberType::uint8},
        {{"short", "int16"}, NumberType::int16},     {{"ushort", "uint16"}, NumberType::uint16},
        {{"int", "int32"}, NumberType::int32},       {{"uint", "uint32"}, NumberType::uint32},
        {{"float", "float32"}, NumberType::float32}, {{"double", "float64"}, NumberType::float64}};
    for (const auto& [names, type] : types)
      if (word == names[0] || word == names[1]) return type;
    return std::nullopt;
  }
  NumberType type(std::string_view word) {
    if (const std::optional<NumberType> known = known_type(word)) return *known;
    fail(quoted_word(word), " is no type of a PLY property");
  }
  /// Skips an unknown line, since some programs omit the word "comment". A line that is built like a
  /// declaration may be one with a damaged keyword, without which all values would shift, so it is an Error.
  void skip_unknown(std::string_view keyword) {
    const std::string_view second = next_word(), third = next_word();
    const bool like_element = next_word().empty() && !third.empty() &&
                              third.find_first_not_of("0123456789") == std::string_view::npos;
    if (like_element || second == "list" || known_type(second))
      fail(quoted_word(keyword), " is no keyword of a PLY header");
    if (unknown_++ == 0) first_unknown_ = line_number_;
  }
  void add_element() {
    const std::string_view name = next_word(), count = next_word();
    Element element{name, 0};
    const auto [stop, status] = std::from_chars(count.begin(), count.end(), element.count);
    if (status != std::errc() || stop != count.end()) fail("the count of an element is not a number");
    header_.elements.push_back(std::move(element));
  }
  void add_property() {
    if (header_.elements.empty()) fail("a property comes before the first element");
    Element& element = header_.elements.back();
    Property property{};
    std::string_view word = next_word();
    if (word == "list") {
      property.list_count = type(next_word());
      if (!is_whole(*property.list_count)) fail("the length of a list cannot be a floating-point number");
      word = next_word();
    }
    property.type = type(word);
    property.name = next_word();
    // An element has each role once; a second property for it is ignored.
    const Role role = role_by_name(element.name, property);
    if (std::ranges::find(element.properties, role, &Property::role) == element.properties.end())
      property.role = role;
    element.has_polygons |= property.role == Role::corners;
    element.properties.push_back(property);
  }
  static Role role_by_name(std::string_view element, const Property& property) {
    const bool list = property.list_count.has_value();
    const bool indices = list && (property.name == "vertex_indices" || property.name == "vertex_index");
    if (element == "vertex" && !list && property.name == "x") return Role::x;
    if (element == "vertex" && !list && property.name == "y") return Role::y;
    if (element == "vertex" && !list && property.name == "z") return Role::z;
    if (element == "face" && indices) return Role::corners;
    if (element == "tristrips" && indices) return Role::strips;
    return Role::ignored;
  }
  template <class... Parts>
  [[noreturn]] void fail(const Parts&... what) {
    throw Error(joined(in_quotes(builder_.file()), ", line ", line_number_, ": ", what...));
  }

  std::string_view bytes_, line_;
  char line_end_;
  MeshBuilder& builder_;
  PlyHeader header_;
  std::size_t position_ = 0, line_number_ = 0, unknown_ = 0, first_unknown_ = 0;
};

/// Values of elements in text, one element a line. A float is rounded as the header declares it.
class AsciiValues {
 public:
  AsciiValues(std::string_view bytes, std::size_t start, const MeshBuilder& builder)
      : cursor_(bytes, builder.file(), start) {}
  void begin_element() {
    wrapped_at_ = 0;
    const char first = cursor_.peek();
    if (first < '+' || first > '9') skip_comments();  // it is not a number
  }
  /// Ends an element. Further words on its last line are ignored, unless the element began on an earlier
  /// line: then they might belong to the next element.
  void end_element() {
    if (!cursor_.skip_blanks_to_word()) return cursor_.skip_line_end();
    if (wrapped_at_ > 0) cursor_.fail_at(wrapped_at_, "the line has fewer values than the header declares");
    if (long_lines_++ == 0) first_long_line_ = cursor_.offset();
    cursor_.rest_of_line();
  }
  double real(NumberType type) {
    to_value();
    return type == NumberType::float32 ? cursor_.number<float>("a number")
                                       : cursor_.number<double>("a number");
  }
  std::int64_t integer(NumberType) {
    to_value();
    return cursor_.number<std::int64_t>("a whole number");
  }
  /// Reads the value of an attribute; returns nothing if it is not of its type.
  std::optional<double> attribute(NumberType type) {
    to_value();
    if (cursor_.at_end()) fail_truncated();
    if (type == NumberType::float32) return cursor_.number_if_any<float>();
    if (type == NumberType::float64) return cursor_.number_if_any<double>();
    const std::optional<std::int64_t> whole = cursor_.number_if_any<std::int64_t>();
    return whole ? std::optional(static_cast<double>(*whole)) : std::nullopt;
  }
  void skip(NumberType) {
    to_value();
    if (cursor_.at_end()) fail_truncated();
    cursor_.skip_word();
  }
  static std::size_t size_of_value(NumberType) { return 1; }
  /// True if `count` elements of `values` values can follow: a digit and a space each, except for the last
  /// one.
  bool has(std::uint64_t count, std::size_t values) const {
    return count == 0 || values == 0 || count <= (cursor_.remaining() + 1) / (2 * values);
  }
  std::size_t offset() const { return cursor_.offset(); }
  /// @throws Error if more than padding follows.
  void finish(std::string_view bytes, MeshBuilder& builder) {
    skip_comments();
    if (!cursor_.at_end())
      cursor_.fail("the file holds more than its header declares; correct the counts or remove the rest");
    if (long_lines_ > 0)
      builder.note(long_lines_, " lines hold more words than the header declares, the first is line ",
                   cursor_.line_at(first_long_line_), "; these words were ignored");
    builder.note_padding(bytes);
  }
  [[noreturn]] void fail_truncated() const { cursor_.fail("the file is truncated: values are missing"); }

 private:
  /// Skips white space, and lines that begin like comments of the header or of other formats.
  void skip_comments() {
    for (cursor_.skip_space(); cursor_.peek() == '#' || cursor_.peek() == 'c'; cursor_.skip_space()) {
      if (cursor_.peek() == 'c' && TextCursor(cursor_).word() != "comment") return;
      cursor_.rest_of_line();
    }
  }
  /// Moves to the next value, which may be on the next line, as in long lists.
  [[gnu::always_inline]] void to_value() {
    if (!cursor_.skip_blanks_to_word()) to_next_line();
  }
  [[gnu::noinline]] void to_next_line() {
    if (wrapped_at_ == 0) wrapped_at_ = cursor_.offset();
    cursor_.skip_space();
  }

  TextCursor cursor_;
  std::size_t wrapped_at_ = 0;  ///< end of the first line of an element of several lines; 0: one line
  std::size_t long_lines_ = 0, first_long_line_ = 0;
};

/// Values of elements in binary. `swapped` is known to the compiler, for the inner loops.
template <bool swapped>
class BinaryValues {
 public:
  BinaryValues(std::string_view bytes, std::size_t start, const MeshBuilder& builder)
      : bytes_(bytes), at_(start), builder_(builder) {}
  void begin_element() {}
  void end_element() {}
  double real(NumberType type) {
    return with_type(type, [&](auto number) {
      if (bytes_.size() - at_ < sizeof number) fail_truncated();
      number = stored_number<decltype(number)>(bytes_.data() + at_, swapped);
      at_ += sizeof number;
      return static_cast<double>(number);
    });
  }
  std::int64_t integer(NumberType type) {
    const double value = real(type);  // exact for the types of PLY
    // Some programs write indices as floating-point numbers. The first comparison is false for NaN.
    if (!is_whole(type) && (!(std::abs(value) < 9007199254740992.0) || value != std::trunc(value)))
      builder_.fail("an index is not a whole number");
    return static_cast<std::int64_t>(value);
  }
  std::optional<double> attribute(NumberType type) { return real(type); }
  void skip(NumberType type) {
    if (bytes_.size() - at_ < size_of(type)) fail_truncated();
    at_ += size_of(type);
  }
  static std::size_t size_of_value(NumberType type) { return size_of(type); }
  /// True if `count` elements of `bytes` bytes can follow; by a quotient, since the product may overflow.
  bool has(std::uint64_t count, std::size_t bytes) const {
    return bytes == 0 || count <= (bytes_.size() - at_) / bytes;
  }
  std::size_t offset() const { return at_; }
  void finish(std::string_view, MeshBuilder& builder) const {
    const std::string_view rest = bytes_.substr(at_);
    if (!without_padding(rest).empty())
      builder.fail("it has ", rest.size(),
                   " bytes more than its header declares; the header or the data are damaged");
    builder.note_padding(rest);
  }
  [[noreturn]] void fail_truncated() const {
    builder_.fail("the file is truncated: it ends at byte ", bytes_.size(), ", but its header declares more");
  }

 private:
  std::string_view bytes_;
  std::size_t at_;
  const MeshBuilder& builder_;
};

template <class Values>
class ElementReader {
 public:
  ElementReader(std::string_view bytes, const PlyHeader& header, MeshBuilder& builder)
      : header_(header),
        values_(bytes, header.length, builder),
        builder_(builder),
        attributes_(builder.attributes()),
        bytes_(bytes) {}

  void read() {
    for (const Element& element : header_.elements) {
      reserve(element);
      // An element without properties takes no bytes, whatever its count.
      if (element.properties.empty()) continue;
      for (std::uint64_t i = 0; i < element.count; ++i) {
        builder_.tick(values_.offset(), bytes_.size());
        values_.begin_element();
        read_one(element);
        values_.end_element();
      }
    }
    values_.finish(bytes_, builder_);
  }

 private:
  /// Reserves memory for an element after checking that the file is long enough: a header may claim any
  /// count.
  void reserve(const Element& element) {
    std::size_t least = 0;
    // A list may be empty, so only its length counts.
    for (const Property& property : element.properties)
      least += Values::size_of_value(property.list_count.value_or(property.type));
    if (!values_.has(element.count, least))
      builder_.fail("the file is truncated: its header declares ", element.count, " of element ",
                    quoted_word(element.name), ", for which it is too short");
    if (least == 0) return;
    if (attributes_ && element.name == "vertex") attributes_->reserve(AttributeDomain::point, element.count);
    if (attributes_ && element.has_polygons) attributes_->reserve(AttributeDomain::polygon, element.count);
    if (element.name == "vertex") builder_.mesh.points.reserve(builder_.mesh.points.size() + element.count);
    if (element.has_polygons) builder_.mesh.triangles.reserve(builder_.mesh.triangles.size() + element.count);
  }

  void read_one(const Element& element) {
    const bool is_point = element.name == "vertex";
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
    if (attributes_) {
      if (is_point) attributes_->begin(AttributeDomain::point);
      if (element.has_polygons) attributes_->begin(AttributeDomain::polygon);
      corners_.clear(), corner_values_.clear();
    }
    for (const Property& property : element.properties) {
      if (property.list_count) {
        read_list(property);
      } else if (property.role == Role::ignored) {
        values_.skip(property.type);
      } else if (property.role == Role::value) {
        if (const std::optional<double> value = values_.attribute(property.type))
          attributes_->set(property.column, property.component, *value / property.unit);
        else
          attributes_->spoil_value(property.column, "is not of the type that the header declares");
      } else {
        point[static_cast<int>(property.role) - static_cast<int>(Role::x)] = values_.real(property.type);
      }
    }
    // Coordinates that the element does not declare are 0.
    if (is_point) builder_.mesh.points.push_back(point);
    if (attributes_ && element.has_polygons && header_.has_corner_values) set_corner_values(element);
  }

  /// Assigns the values of a polygon's corners, whose list may precede that of the corners.
  void set_corner_values(const Element& element) {
    const auto list = std::ranges::find(element.properties, Role::corner_values, &Property::role);
    const auto components = list == element.properties.end() ? 0 : static_cast<std::size_t>(list->component);
    // An empty list is a polygon without values.
    if (!corner_values_.empty() && corner_values_.size() != corners_.size() * components) {
      attributes_->spoil(list->column, "the list of a polygon has " + std::to_string(corner_values_.size()) +
                                           " numbers, but the polygon has " +
                                           std::to_string(corners_.size()) + " corners and each takes " +
                                           std::to_string(components));
      corner_values_.clear();
    }
    for (std::size_t corner = 0; corner < corners_.size(); ++corner) {
      attributes_->begin(AttributeDomain::corner);
      for (std::size_t i = 0; i < components && !corner_values_.empty(); ++i)
        attributes_->set(list->column, static_cast<int>(i), corner_values_[corner * components + i]);
    }
  }

  /// Adds the triangles of a strip: each corner forms one with the two before it, and every other triangle is
  /// reversed. −1 ends a strip, and a triangle with a corner twice only leads to the next one.
  void add_strips() {
    constexpr std::int64_t kUnsignedEndOfStrip = 0xffffffff;
    std::size_t first = 0;
    for (std::size_t i = 0; i < corners_.size(); ++i) {
      if (corners_[i] == -1 || corners_[i] == kUnsignedEndOfStrip) first = i + 1;
      if (i < first + 2) continue;
      std::array<std::int64_t, 3> corners = {corners_[i - 2], corners_[i - 1], corners_[i]};
      // By the position in the strip, since triangles that are left out count, too.
      if ((i - first) % 2 == 1) std::swap(corners[0], corners[1]);
      if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) continue;
      builder_.add_polygon(corners);
      if (!attributes_) continue;
      attributes_->begin(AttributeDomain::polygon);
      for (int corner = 0; header_.has_corner_values && corner < 3; ++corner)
        attributes_->begin(AttributeDomain::corner);
    }
  }

  void read_list(const Property& property) {
    const std::int64_t count = values_.integer(*property.list_count);
    if (count < 0) builder_.fail("a list has a negative length");
    if (!values_.has(static_cast<std::uint64_t>(count), Values::size_of_value(property.type)))
      values_.fail_truncated();
    switch (property.role) {
      case Role::corners:
      case Role::strips:
        corners_.resize(static_cast<std::size_t>(count));
        for (std::int64_t& corner : corners_) corner = values_.integer(property.type);
        property.role == Role::strips ? add_strips() : builder_.add_polygon(corners_);
        break;
      case Role::corner_values:
        for (std::int64_t i = 0; i < count; ++i) {
          const std::optional<double> value = values_.attribute(property.type);
          if (!value) attributes_->spoil(property.column, "a value in the list of a polygon is no number");
          // A bad value counts, too, for the length of the list.
          corner_values_.push_back(value.value_or(0.0));
        }
        break;
      default:
        for (std::int64_t i = 0; i < count; ++i) values_.skip(property.type);
    }
  }

  const PlyHeader& header_;
  Values values_;
  MeshBuilder& builder_;
  AttributeTable* const attributes_;
  std::string_view bytes_;
  std::vector<std::int64_t> corners_;  ///< corners of the latest polygon
  std::vector<double> corner_values_;  ///< and their values
};

void check_roles(const PlyHeader& header, const MeshBuilder& builder) {
  const auto has = [&](Role role) {
    return std::ranges::any_of(header.elements, [&](const Element& element) {
      return std::ranges::find(element.properties, role, &Property::role) != element.properties.end();
    });
  };
  if (!has(Role::x) || !has(Role::y) || !has(Role::z)) builder.fail("its points lack a property x, y or z");
  if (!has(Role::corners) && !has(Role::strips))
    builder.fail("it holds no polygon: there is no element 'face' with a list 'vertex_indices'");
}

}  // namespace

bool begins_like_ply(std::string_view bytes) {
  bytes = without_byte_order_mark(bytes);
  if (!bytes.starts_with("ply")) return false;
  const std::size_t end = bytes.find_first_not_of(" \t", 3);
  return end != std::string_view::npos && is_line_end(bytes[end]);
}

void read_ply(std::string_view bytes, MeshBuilder& builder) {
  const PlyHeader header = PlyHeaderParser(bytes, builder).parse();
  check_roles(header, builder);
  if (header.encoding == Encoding::ascii)
    ElementReader<AsciiValues>(bytes, header, builder).read();
  else if (is_swapped(header.encoding == Encoding::big_endian))
    ElementReader<BinaryValues<true>>(bytes, header, builder).read();
  else
    ElementReader<BinaryValues<false>>(bytes, header, builder).read();
}

}  // namespace hermesh::mesh_formats
