#include <algorithm>

#include "algorithms/core/mesh_file_ply.h"

namespace hermesh::mesh_formats::ply {

namespace {

/// Both generations of names.
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
  return std::ldexp(1.0, is_signed ? bits - 1 : bits) - 1.0;
}

Property* free_property(Element& element, std::string_view name) {
  for (Property& property : element.properties)
    if (property.name == name && !property.list_count && property.role == Role::ignored) return &property;
  return nullptr;
}

/// Null where one of them is missing, or taken by another group.
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

void find_corner_values(Element& element, AttributeBuilder& attributes) {
  for (Property& property : element.properties)
    if (property.list_count && (property.name == "texcoord" || property.name == "texture_uv")) {
      property.role = Role::corner_values;
      property.component = 2;
      property.attribute = attributes.add("uv", AttributeDomain::corner, property.component, false);
    }
}

/// Names first go to points, then to polygons, then to corners.
void find_attributes(Header& header, AttributeBuilder& attributes) {
  for (Element& element : header.elements)
    if (element.name == "vertex") find_values(element, AttributeDomain::point, attributes);
  for (Element& element : header.elements)
    if (element.name == "face") {
      find_values(element, AttributeDomain::polygon, attributes);
      find_corner_values(element, attributes);
    }
}

class HeaderParser {
 public:
  HeaderParser(std::string_view bytes, MeshBuilder& builder) : bytes_(bytes), builder_(builder) {
    // Lines end in "\n", "\r\n" or, on old Macs, "\r"; the first line tells which. Binary data may follow, so
    // a lone
    // "\r" must not swallow a first data byte that happens to be "\n".
    line_end_ = bytes.starts_with("ply\r\n") ? "\r\n" : bytes.starts_with("ply\r") ? "\r" : "\n";
  }

  Header parse() {
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
        fail(in_quotes(std::string(keyword.substr(0, 40))) + " is no keyword of a PLY header");
      }
    }
    if (!format_known) fail("the header has no line 'format'");
    header_.length = position_;
    if (builder_.attributes()) find_attributes(header_, *builder_.attributes());
    return std::move(header_);
  }

 private:
  void next_line() {
    const std::size_t end = bytes_.find(line_end_, position_);
    if (end == std::string_view::npos) builder_.fail("the file is truncated: its PLY header has no end");
    line_ = bytes_.substr(position_, end - position_);
    position_ = end + line_end_.size();
    ++line_number_;
  }
  std::string_view next_word() {
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
    fail(in_quotes(std::string(word)) + " is no PLY format");
  }
  Type type(std::string_view word) {
    for (std::size_t i = 0; i < type_names.size(); ++i)
      if (word == type_names[i][0] || word == type_names[i][1]) return static_cast<Type>(i);
    fail(in_quotes(std::string(word.substr(0, 40))) + " is no type of a PLY property");
  }
  void add_element() {
    const std::string_view name = next_word(), count = next_word();
    Element element{name, 0, {}};
    const auto [stop, status] = std::from_chars(count.begin(), count.end(), element.count);
    if (status != std::errc() || stop != count.end()) fail("the count of an element is not a number");
    header_.elements.push_back(std::move(element));
  }
  void add_property() {
    if (header_.elements.empty()) fail("a property comes before the first element");
    Property property{};
    std::string_view word = next_word();
    if (word == "list") {
      property.list_count = type(next_word());
      if (*property.list_count >= Type::float32)
        fail("the length of a list cannot be a floating-point number");
      word = next_word();
    }
    property.type = type(word);
    property.name = next_word();
    property.role = role(header_.elements.back().name, property);
    header_.elements.back().properties.push_back(property);
  }
  static Role role(std::string_view element, const Property& property) {
    const bool list = property.list_count.has_value();
    if (element == "vertex" && !list && property.name == "x") return Role::x;
    if (element == "vertex" && !list && property.name == "y") return Role::y;
    if (element == "vertex" && !list && property.name == "z") return Role::z;
    if (element == "face" && list && (property.name == "vertex_indices" || property.name == "vertex_index"))
      return Role::corners;
    return Role::ignored;
  }
  [[noreturn]] void fail(const std::string& what) {
    throw Error(in_quotes(builder_.file()) + ", line " + std::to_string(line_number_) + ": " + what);
  }

  std::string_view bytes_, line_, line_end_;
  MeshBuilder& builder_;
  Header header_;
  std::size_t position_ = 0, line_number_ = 0;
};

}  // namespace

Header parse_header(std::string_view bytes, MeshBuilder& builder) {
  return HeaderParser(bytes, builder).parse();
}

}  // namespace hermesh::mesh_formats::ply
