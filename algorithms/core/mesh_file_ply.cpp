// PLY (Turk 1994): a header that declares elements and their properties, then the elements in that order.
#include <array>
#include <bit>

#include "algorithms/core/mesh_file_formats.h"

namespace hermesh::mesh_formats {

namespace {

enum class Type { int8, uint8, int16, uint16, int32, uint32, float32, float64 };
constexpr std::array<std::size_t, 8> size_of = {1, 1, 2, 2, 4, 4, 4, 8};
/// Both generations of names.
constexpr std::array<std::array<std::string_view, 2>, 8> type_names = {{{"char", "int8"},
                                                                        {"uchar", "uint8"},
                                                                        {"short", "int16"},
                                                                        {"ushort", "uint16"},
                                                                        {"int", "int32"},
                                                                        {"uint", "uint32"},
                                                                        {"float", "float32"},
                                                                        {"double", "float64"}}};

enum class Role { ignored, x, y, z, corners };

struct Property {
  std::string_view name;
  Type type;
  std::optional<Type> list_count;  ///< type of the number of items, where the property is a list
  Role role = Role::ignored;
};

struct Element {
  std::string_view name;
  std::uint64_t count;
  std::vector<Property> properties;
};

enum class Encoding { ascii, little_endian, big_endian };

struct Header {
  Encoding encoding = Encoding::ascii;
  std::vector<Element> elements;
  std::size_t length = 0;  ///< bytes, up to the first element
};

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

/// Where the elements' values come from, when they are text. A float is rounded as the header declares it.
class AsciiValues {
 public:
  AsciiValues(std::string_view bytes, std::size_t start, const MeshBuilder& builder)
      : cursor_(bytes, builder.file(), start) {}
  double real(Type type) {
    cursor_.skip_space();
    return type == Type::float32 ? cursor_.number<float>("a number") : cursor_.number<double>("a number");
  }
  std::int64_t integer(Type) {
    cursor_.skip_space();
    return cursor_.number<std::int64_t>("a whole number");
  }
  void skip(Type) {
    cursor_.skip_space();
    if (cursor_.at_end()) fail_truncated();
    cursor_.skip_word();
  }
  /// Whether this many values can still be there: a digit and a space each, but for the last one.
  bool has(std::uint64_t count, std::size_t values) const {
    return count == 0 || values == 0 || count <= (cursor_.remaining() + 1) / (2 * values);
  }
  bool at_end() {
    cursor_.skip_space();
    return cursor_.at_end();
  }
  std::size_t offset() const { return cursor_.offset(); }
  [[noreturn]] void fail_truncated() const { cursor_.fail("the file is truncated: values are missing"); }

 private:
  TextCursor cursor_;
};

/// Where the elements' values come from, when they are binary.
template <bool swapped>
class BinaryValues {
 public:
  BinaryValues(std::string_view bytes, std::size_t start, const MeshBuilder& builder)
      : bytes_(bytes), at_(start), builder_(builder) {}
  double real(Type type) {
    if (type == Type::float32) return take<float, std::uint32_t>();
    if (type == Type::float64) return take<double, std::uint64_t>();
    return static_cast<double>(integer(type));
  }
  std::int64_t integer(Type type) {
    switch (type) {
      case Type::int8:
        return take<std::int8_t, std::uint8_t>();
      case Type::uint8:
        return take<std::uint8_t, std::uint8_t>();
      case Type::int16:
        return take<std::int16_t, std::uint16_t>();
      case Type::uint16:
        return take<std::uint16_t, std::uint16_t>();
      case Type::int32:
        return take<std::int32_t, std::uint32_t>();
      case Type::uint32:
        return take<std::uint32_t, std::uint32_t>();
      default:
        break;
    }
    const double value = real(type);
    // Also false for what is not a number; 2^53 is far beyond any index.
    if (!(std::abs(value) < 9007199254740992.0)) builder_.fail("an index is not a whole number");
    return static_cast<std::int64_t>(value);
  }
  void skip(Type type) {
    if (remaining() < size_of[static_cast<std::size_t>(type)]) fail_truncated();
    at_ += size_of[static_cast<std::size_t>(type)];
  }
  bool has(std::uint64_t count, std::size_t bytes) const {
    return bytes == 0 || count <= remaining() / bytes;
  }
  bool at_end() const { return remaining() == 0; }
  std::size_t offset() const { return at_; }
  [[noreturn]] void fail_truncated() const {
    builder_.fail("the file is truncated: it ends at byte " + std::to_string(bytes_.size()) +
                  ", but its header declares more");
  }

 private:
  template <class T, class Bits>
  T take() {
    if (remaining() < sizeof(T)) fail_truncated();
    Bits bits;
    std::memcpy(&bits, bytes_.data() + at_, sizeof bits);
    at_ += sizeof bits;
    if constexpr (swapped && sizeof bits == 2) bits = __builtin_bswap16(bits);
    if constexpr (swapped && sizeof bits == 4) bits = __builtin_bswap32(bits);
    if constexpr (swapped && sizeof bits == 8) bits = __builtin_bswap64(bits);
    return std::bit_cast<T>(bits);
  }
  std::size_t remaining() const { return bytes_.size() - at_; }

  std::string_view bytes_;
  std::size_t at_;
  const MeshBuilder& builder_;
};

template <class Values>
class ElementReader {
 public:
  ElementReader(std::string_view bytes, const Header& header, MeshBuilder& builder)
      : header_(header), values_(bytes, header.length, builder), builder_(builder), total_(bytes.size()) {}

  void read() {
    for (const Element& element : header_.elements) {
      reserve(element);
      if (element.properties.empty()) continue;
      for (std::uint64_t i = 0; i < element.count; ++i) {
        builder_.tick(values_.offset(), total_);
        read_one(element);
      }
    }
    if (!values_.at_end())
      builder_.context().note(in_quotes(builder_.file()) +
                              " holds more than its header declares; the rest was ignored");
  }

 private:
  /// Before anything is allocated: a header may claim any count, but the file must be long enough for it.
  void reserve(const Element& element) {
    std::size_t least = 0;
    for (const Property& property : element.properties) {
      const Type type = property.list_count.value_or(property.type);
      least += header_.encoding == Encoding::ascii ? 1 : size_of[static_cast<std::size_t>(type)];
    }
    if (!values_.has(element.count, least))
      builder_.fail("the file is truncated: its header declares " + std::to_string(element.count) +
                    " of element '" + std::string(element.name) + "', for which it is too short");
    if (least == 0) return;
    if (element.name == "vertex") builder_.mesh.points.reserve(builder_.mesh.points.size() + element.count);
    if (element.name == "face")
      builder_.mesh.triangles.reserve(builder_.mesh.triangles.size() + element.count);
  }

  void read_one(const Element& element) {
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
    for (const Property& property : element.properties) {
      if (property.list_count) {
        read_list(property);
      } else if (property.role == Role::ignored) {
        values_.skip(property.type);
      } else {
        point[static_cast<int>(property.role) - static_cast<int>(Role::x)] = values_.real(property.type);
      }
    }
    if (element.name == "vertex") builder_.mesh.points.push_back(point);
  }

  void read_list(const Property& property) {
    const std::int64_t count = values_.integer(*property.list_count);
    if (count < 0) builder_.fail("a list has a negative length");
    const std::size_t item =
        header_.encoding == Encoding::ascii ? 1 : size_of[static_cast<std::size_t>(property.type)];
    if (!values_.has(static_cast<std::uint64_t>(count), item)) values_.fail_truncated();
    if (property.role == Role::ignored) {
      for (std::int64_t i = 0; i < count; ++i) values_.skip(property.type);
      return;
    }
    corners_.resize(static_cast<std::size_t>(count));
    for (std::int64_t& corner : corners_) corner = values_.integer(property.type);
    builder_.add_polygon(corners_);
  }

  const Header& header_;
  Values values_;
  MeshBuilder& builder_;
  std::size_t total_;
  std::vector<std::int64_t> corners_;
};

void check_roles(const Header& header, const MeshBuilder& builder) {
  std::array<bool, 5> found{};
  for (const Element& element : header.elements)
    for (const Property& property : element.properties) found[static_cast<std::size_t>(property.role)] = true;
  for (const Role role : {Role::x, Role::y, Role::z})
    if (!found[static_cast<std::size_t>(role)]) builder.fail("its points lack a property x, y or z");
  if (!found[static_cast<std::size_t>(Role::corners)])
    builder.fail("it holds no polygon: there is no element 'face' with a list 'vertex_indices'");
}

}  // namespace

void read_ply(std::string_view bytes, MeshBuilder& builder) {
  const Header header = HeaderParser(bytes, builder).parse();
  check_roles(header, builder);
  constexpr bool big_machine = std::endian::native == std::endian::big;
  if (header.encoding == Encoding::ascii)
    ElementReader<AsciiValues>(bytes, header, builder).read();
  else if ((header.encoding == Encoding::big_endian) == big_machine)
    ElementReader<BinaryValues<false>>(bytes, header, builder).read();
  else
    ElementReader<BinaryValues<true>>(bytes, header, builder).read();
}

}  // namespace hermesh::mesh_formats
