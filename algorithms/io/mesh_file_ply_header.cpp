#include <algorithm>
#include <cmath>

#include "algorithms/io/mesh_file_ply.h"

namespace hermesh::mesh_formats::ply {

namespace {

/// Names of the types, those of 1994 and those that tell the size, in the order of Type.
constexpr std::array<std::array<std::string_view, 2>, 8> type_names = {{{"char", "int8"},
                                                                        {"uchar", "uint8"},
                                                                        {"short", "int16"},
                                                                        {"ushort", "uint16"},
                                                                        {"int", "int32"},
                                                                        {"uint", "uint32"},
                                                                        {"float", "float32"},
                                                                        {"double", "float64"}}};

/// Properties that make one attribute together.
struct Group {
  const char* attribute;
  std::vector<std::string_view> properties;
  bool to_unit = false;  ///< whole numbers count from 0 to the largest of their type
};

const std::vector<Group>& groups() {
  // Larger groups come first: with an alpha there are four components, and only without one the three are
  // looked for.
  static const std::vector<Group> all = {{"normal", {"nx", "ny", "nz"}},
                                         {"colour", {"red", "green", "blue", "alpha"}, true},
                                         {"colour", {"red", "green", "blue"}, true},
                                         {"uv", {"u", "v"}},
                                         {"uv", {"s", "t"}},
                                         {"uv", {"texture_u", "texture_v"}}};
  return all;
}

bool is_whole(Type type) { return type < Type::float32; }

double largest(Type type) {
  const int bits = static_cast<int>(8 * size_of[static_cast<std::size_t>(type)]);
  const bool is_signed = type == Type::int8 || type == Type::int16 || type == Type::int32;
  // Largest value of a whole number: 255 for a byte, which a colour counts as 1.
  return std::ldexp(1.0, is_signed ? bits - 1 : bits) - 1.0;
}

/// The first property of a name that nothing else has taken; null if there is none.
Property* free_property(Element& element, std::string_view name) {
  for (Property& property : element.properties)
    if (property.name == name && !property.list_count && property.role == Role::ignored) return &property;
  return nullptr;
}

/// The properties of a group, or none at all where one of them is missing, or taken by another group.
std::vector<Property*> members(Element& element, const Group& group) {
  std::vector<Property*> found;
  for (const std::string_view name : group.properties) found.push_back(free_property(element, name));
  return std::ranges::find(found, nullptr) == found.end() ? found : std::vector<Property*>();
}

void assign(Property& property, std::size_t attribute, int component, double unit) {
  property.role = Role::value;
  property.attribute = attribute;
  property.component = component;
  property.unit = unit;
}

void find_values(Element& element, AttributeDomain domain, AttributeBuilder& attributes) {
  // Known groups take their properties first; each number that is left is an attribute by itself.
  for (const Group& group : groups()) {
    const std::vector<Property*> found = members(element, group);
    if (found.empty()) continue;
    const std::size_t attribute =
        attributes.add(group.attribute, domain, static_cast<int>(found.size()), false);
    for (std::size_t i = 0; i < found.size(); ++i)
      assign(*found[i], attribute, static_cast<int>(i),
             group.to_unit && is_whole(found[i]->type) ? largest(found[i]->type) : 1.0);
  }
  for (Property& property : element.properties)
    if (property.role == Role::ignored && !property.list_count)
      assign(property, attributes.add(std::string(property.name), domain, 1, is_whole(property.type)), 0,
             1.0);
}

/// Gives the list of texture coordinates its role. @returns whether the element has one
bool find_corner_values(Element& element, AttributeBuilder& attributes) {
  for (Property& property : element.properties)
    if (property.list_count && (property.name == "texcoord" || property.name == "texture_uv")) {
      property.role = Role::corner_values;
      property.component = 2;
      property.attribute = attributes.add("uv", AttributeDomain::corner, property.component, false);
      return true;
    }
  return false;
}

/// Makes an attribute of all that the header declares besides the mesh. A name that several want goes to
/// points first, then to polygons, then to corners.
void find_attributes(Header& header, AttributeBuilder& attributes) {
  for (Element& element : header.elements)
    if (element.name == "vertex") find_values(element, AttributeDomain::point, attributes);
  for (Element& element : header.elements)
    if (element.has_polygons) {
      find_values(element, AttributeDomain::polygon, attributes);
      if (find_corner_values(element, attributes)) header.has_corner_values = true;
    }
}

class HeaderParser {
 public:
  HeaderParser(std::string_view bytes, MeshBuilder& builder) : bytes_(bytes), builder_(builder) {
    position_ = bytes.size() - without_byte_order_mark(bytes).size();
    // Lines end in "\n", "\r\n" or, on old Macs, "\r"; the first line tells whether in the last. Binary data
    // may follow, so a lone "\r" must not swallow a first data byte that happens to be "\n".
    const std::size_t end = bytes.find_first_of("\r\n", position_);
    line_end_ =
        end != std::string_view::npos && bytes[end] == '\r' && bytes.substr(end + 1, 1) != "\n" ? '\r' : '\n';
  }

  Header parse() {
    // The first line is "ply", which begins_like_ply() has seen.
    next_line();
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
        pass_over(keyword);
      }
    }
    note_unknown();
    if (!format_known) fail("the header has no line 'format'");
    // Behind the line end_header the elements begin, at once and unaligned.
    header_.length = position_;
    if (builder_.attributes()) find_attributes(header_, *builder_.attributes());
    return std::move(header_);
  }

 private:
  void next_line() {
    const std::size_t end = bytes_.find(line_end_, position_);
    // Binary data behind the header may hold anything, so lines are sought one at a time and only up to
    // end_header.
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
    fail(quoted_word(word) + " is no PLY format");
  }
  static std::optional<Type> known_type(std::string_view word) {
    for (std::size_t i = 0; i < type_names.size(); ++i)
      if (word == type_names[i][0] || word == type_names[i][1]) return static_cast<Type>(i);
    return std::nullopt;
  }
  Type type(std::string_view word) {
    if (const std::optional<Type> known = known_type(word)) return *known;
    fail(quoted_word(word) + " is no type of a PLY property");
  }
  /// Passes over an unknown line, for some programs forget the word "comment". A line that is built like a
  /// declaration may be one whose keyword is damaged; without it, all values would be taken for others, so it
  /// is an Error.
  void pass_over(std::string_view keyword) {
    const std::string_view second = next_word(), third = next_word();
    const bool like_element = next_word().empty() && !third.empty() &&
                              third.find_first_not_of("0123456789") == std::string_view::npos;
    if (like_element || second == "list" || known_type(second))
      fail(quoted_word(keyword) + " is no keyword of a PLY header");
    // All such lines make one note.
    if (unknown_++ == 0) first_unknown_ = line_number_;
  }
  void note_unknown() {
    if (unknown_ > 0)
      builder_.note(std::to_string(unknown_) +
                    " lines of its header that are no declaration were passed over, the first is line " +
                    std::to_string(first_unknown_));
  }
  void add_element() {
    const std::string_view name = next_word(), count = next_word();
    Element element{name, 0};
    // A count of 64 bits, as long as a file can claim; whether the file is long enough is asked when it is
    // read.
    const auto [stop, status] = std::from_chars(count.begin(), count.end(), element.count);
    if (status != std::errc() || stop != count.end()) fail("the count of an element is not a number");
    header_.elements.push_back(std::move(element));
  }
  void add_property() {
    // A property belongs to the element that was declared last.
    if (header_.elements.empty()) fail("a property comes before the first element");
    Property property{};
    std::string_view word = next_word();
    if (word == "list") {
      // A list has a type for its length and one for its items.
      property.list_count = type(next_word());
      // A length that is no whole number could not be told from a damaged one.
      if (*property.list_count >= Type::float32)
        fail("the length of a list cannot be a floating-point number");
      word = next_word();
    }
    property.type = type(word);
    property.name = next_word();
    property.role = role(header_.elements.back(), property);
    header_.elements.back().has_polygons |= property.role == Role::corners;
    header_.elements.back().properties.push_back(property);
  }
  static Role role_by_name(std::string_view element, const Property& property) {
    const bool list = property.list_count.has_value();
    // Both names are common.
    const bool indices = list && (property.name == "vertex_indices" || property.name == "vertex_index");
    if (element == "vertex" && !list && property.name == "x") return Role::x;
    if (element == "vertex" && !list && property.name == "y") return Role::y;
    if (element == "vertex" && !list && property.name == "z") return Role::z;
    // Lists of any other name, or in other elements, are no polygons.
    if (element == "face" && indices) return Role::corners;
    if (element == "tristrips" && indices) return Role::strips;
    return Role::ignored;
  }
  /// Role of a property. An element has each role once, since a polygon cannot have two lists of corners: a
  /// second one is ignored.
  static Role role(const Element& element, const Property& property) {
    const Role found = role_by_name(element.name, property);
    return std::ranges::find(element.properties, found, &Property::role) == element.properties.end()
               ? found
               : Role::ignored;
  }
  [[noreturn]] void fail(const std::string& what) {
    throw Error(in_quotes(builder_.file()) + ", line " + std::to_string(line_number_) + ": " + what);
  }

  std::string_view bytes_, line_;
  char line_end_;
  MeshBuilder& builder_;
  Header header_;
  std::size_t position_ = 0, line_number_ = 0, unknown_ = 0, first_unknown_ = 0;
};

}  // namespace

Header parse_header(std::string_view bytes, MeshBuilder& builder) {
  return HeaderParser(bytes, builder).parse();
}

}  // namespace hermesh::mesh_formats::ply

bool hermesh::mesh_formats::begins_like_ply(std::string_view bytes) {
  bytes = without_byte_order_mark(bytes);
  if (!bytes.starts_with("ply")) return false;
  const std::size_t end = bytes.find_first_not_of(" \t", 3);
  return end != std::string_view::npos && is_line_end(bytes[end]);
}
