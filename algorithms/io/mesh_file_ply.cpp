// PLY (Turk 1994): a header that declares elements and their properties, then the elements in that order.
#include "algorithms/io/mesh_file_ply.h"

#include <array>
#include <bit>
#include <map>

namespace hermesh::mesh_formats {

using namespace ply;

namespace {

/// Where the elements' values come from, when they are text: an element a line, whatever else the line may
/// hold. A float is rounded as the header declares it.
class AsciiValues {
 public:
  AsciiValues(std::string_view bytes, std::size_t start, const MeshBuilder& builder)
      : cursor_(bytes, builder.file(), start) {}
  void begin_element() {
    wrapped_at_ = 0;
    const char first = cursor_.peek();
    if (first < '+' || first > '9') skip_comments();  // it is no number
  }
  /// Words behind the last value are passed over, unless the element began on an earlier line: then it cannot
  /// be told whether they belong to it or to the next.
  void end_element() {
    if (!cursor_.skip_blanks_to_word()) return cursor_.skip_line_end();
    if (wrapped_at_ > 0) cursor_.fail_at(wrapped_at_, "the line has fewer values than the header declares");
    if (long_lines_++ == 0) first_long_line_ = cursor_.offset();
    cursor_.rest_of_line();
  }
  double real(Type type) {
    to_value();
    return type == Type::float32 ? cursor_.number<float>("a number") : cursor_.number<double>("a number");
  }
  std::int64_t integer(Type) {
    to_value();
    return cursor_.number<std::int64_t>("a whole number");
  }
  /// Nothing where the value is not of its type.
  std::optional<double> attribute(Type type) {
    to_value();
    if (cursor_.at_end()) fail_truncated();
    if (type == Type::float32) return cursor_.number_if_any<float>();
    if (type == Type::float64) return cursor_.number_if_any<double>();
    const std::optional<std::int64_t> whole = cursor_.number_if_any<std::int64_t>();
    return whole ? std::optional(static_cast<double>(*whole)) : std::nullopt;
  }
  void skip(Type) {
    to_value();
    if (cursor_.at_end()) fail_truncated();
    cursor_.skip_word();
  }
  /// Whether this many values can still be there: a digit and a space each, but for the last one.
  bool has(std::uint64_t count, std::size_t values) const {
    return count == 0 || values == 0 || count <= (cursor_.remaining() + 1) / (2 * values);
  }
  std::size_t offset() const { return cursor_.offset(); }
  /// @throws Error if more follows than padding.
  void finish(std::string_view bytes, MeshBuilder& builder) {
    skip_comments();
    if (!cursor_.at_end())
      cursor_.fail("the file holds more than its header declares; correct the counts or remove the rest");
    if (long_lines_ > 0)
      builder.note(std::to_string(long_lines_) +
                   " lines hold more words than the header declares, the first is line " +
                   std::to_string(cursor_.line_at(first_long_line_)) + "; the words behind were passed over");
    builder.note_padding(bytes);
  }
  [[noreturn]] void fail_truncated() const { cursor_.fail("the file is truncated: values are missing"); }

 private:
  /// White space, and lines that begin as comments do in the header or in other formats.
  void skip_comments() {
    for (cursor_.skip_space(); cursor_.peek() == '#' || cursor_.peek() == 'c'; cursor_.skip_space()) {
      if (cursor_.peek() == 'c' && TextCursor(cursor_).word() != "comment") return;
      cursor_.rest_of_line();
    }
  }
  /// Long lists may go on on the next line.
  [[gnu::always_inline]] void to_value() {
    if (!cursor_.skip_blanks_to_word()) to_next_line();
  }
  [[gnu::noinline]] void to_next_line() {
    if (wrapped_at_ == 0) wrapped_at_ = cursor_.offset();
    cursor_.skip_space();
  }

  TextCursor cursor_;
  std::size_t wrapped_at_ = 0;  ///< where the first line of an element of several ends; 0 is in the header
  std::size_t long_lines_ = 0, first_long_line_ = 0;
};

/// Where the elements' values come from, when they are binary.
template <bool swapped>
class BinaryValues {
 public:
  BinaryValues(std::string_view bytes, std::size_t start, const MeshBuilder& builder)
      : bytes_(bytes), at_(start), builder_(builder) {}
  void begin_element() {}
  void end_element() {}
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
    if (!(std::abs(value) < 9007199254740992.0) || value != std::trunc(value))
      builder_.fail("an index is not a whole number");
    return static_cast<std::int64_t>(value);
  }
  std::optional<double> attribute(Type type) {
    return type >= Type::float32 ? real(type) : static_cast<double>(integer(type));
  }
  void skip(Type type) {
    if (remaining() < size_of[static_cast<std::size_t>(type)]) fail_truncated();
    at_ += size_of[static_cast<std::size_t>(type)];
  }
  bool has(std::uint64_t count, std::size_t bytes) const {
    return bytes == 0 || count <= remaining() / bytes;
  }
  std::size_t offset() const { return at_; }
  void finish(std::string_view, MeshBuilder& builder) const {
    const std::string_view rest = bytes_.substr(at_);
    if (!without_padding(rest).empty())
      builder.fail("it has " + std::to_string(rest.size()) +
                   " bytes more than its header declares; the header or the data are damaged");
    builder.note_padding(rest);
  }
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

/// The parameter keeps all thought of attributes out of the loops of those who want none.
template <class Values, bool with_attributes>
class ElementReader {
 public:
  ElementReader(std::string_view bytes, const Header& header, MeshBuilder& builder)
      : header_(header), values_(bytes, header.length, builder), builder_(builder), bytes_(bytes) {}

  void read() {
    for (const Element& element : header_.elements) {
      reserve(element);
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
  /// Before anything is allocated: a header may claim any count, but the file must be long enough for it.
  void reserve(const Element& element) {
    std::size_t least = 0;
    for (const Property& property : element.properties) {
      const Type type = property.list_count.value_or(property.type);
      least += header_.encoding == Encoding::ascii ? 1 : size_of[static_cast<std::size_t>(type)];
    }
    if (!values_.has(element.count, least))
      builder_.fail("the file is truncated: its header declares " + std::to_string(element.count) +
                    " of element " + quoted_word(element.name) + ", for which it is too short");
    if (least == 0) return;
    if (AttributeBuilder* attributes = builder_.attributes()) {
      if (element.name == "vertex") attributes->reserve(AttributeDomain::point, element.count);
      if (element.has_polygons) attributes->reserve(AttributeDomain::polygon, element.count);
    }
    if (element.name == "vertex") builder_.mesh.points.reserve(builder_.mesh.points.size() + element.count);
    if (element.has_polygons) builder_.mesh.triangles.reserve(builder_.mesh.triangles.size() + element.count);
  }

  void read_one(const Element& element) {
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
    if constexpr (with_attributes) begin_attributes(element);
    for (const Property& property : element.properties) {
      if (property.list_count) {
        read_list(property);
      } else if (property.role == Role::ignored) {
        values_.skip(property.type);
      } else if (with_attributes && property.role == Role::value) {
        if (const std::optional<double> value = values_.attribute(property.type))
          builder_.attributes()->set(property.attribute, property.component, *value / property.unit);
        else
          builder_.attributes()->spoil_value(property.attribute,
                                             "is not of the type that the header declares");
      } else {
        point[static_cast<int>(property.role) - static_cast<int>(Role::x)] = values_.real(property.type);
      }
    }
    if (element.name == "vertex") builder_.mesh.points.push_back(point);
    if (with_attributes && element.has_polygons) end_corners();
  }

  void begin_attributes(const Element& element) {
    if (element.name == "vertex") builder_.attributes()->begin(AttributeDomain::point);
    if (element.has_polygons) builder_.attributes()->begin(AttributeDomain::polygon);
    corners_.clear();
    for (auto& [property, values] : corner_values_) values.clear();
  }

  /// The lists of a polygon may stand before its corners, so they are looked at when all have been read.
  void end_corners() {
    if (!header_.has_corner_values) return;
    for (auto& [property, values] : corner_values_) {
      if (values.empty() || values.size() == corners_.size() * static_cast<std::size_t>(property->component))
        continue;
      builder_.attributes()->spoil(property->attribute,
                                   "the list of a polygon has " + std::to_string(values.size()) +
                                       " numbers, but the polygon has " + std::to_string(corners_.size()) +
                                       " corners and each takes " + std::to_string(property->component));
      values.clear();
    }
    for (std::size_t corner = 0; corner < corners_.size(); ++corner) {
      builder_.attributes()->begin(AttributeDomain::corner);
      for (const auto& [property, values] : corner_values_)
        for (int i = 0; i < property->component && !values.empty(); ++i)
          builder_.attributes()->set(
              property->attribute, i,
              values[corner * static_cast<std::size_t>(property->component) + static_cast<std::size_t>(i)]);
    }
  }

  /// The corners of each triangle are those two before and the next one; every other one is turned over. −1
  /// ends a strip, and a triangle with the same corner twice only leads to the next one.
  void add_strips() {
    std::size_t first = 0;
    for (std::size_t i = 0; i < corners_.size(); ++i) {
      if (corners_[i] == -1 || corners_[i] == kUnsignedEndOfStrip) first = i + 1;
      if (i < first + 2) continue;
      std::array<std::int64_t, 3> corners = {corners_[i - 2], corners_[i - 1], corners_[i]};
      if ((i - first) % 2 == 1) std::swap(corners[0], corners[1]);
      if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) continue;
      builder_.add_polygon(corners);
      if (!with_attributes) continue;
      builder_.attributes()->begin(AttributeDomain::polygon);
      for (int corner = 0; header_.has_corner_values && corner < 3; ++corner)
        builder_.attributes()->begin(AttributeDomain::corner);
    }
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
    if (with_attributes && property.role == Role::corner_values) {
      read_corner_values(property, count);
      return;
    }
    corners_.resize(static_cast<std::size_t>(count));
    for (std::int64_t& corner : corners_) corner = values_.integer(property.type);
    if (property.role == Role::strips)
      add_strips();
    else
      builder_.add_polygon(corners_);
  }

  void read_corner_values(const Property& property, std::int64_t count) {
    std::vector<double>& values = corner_values_[&property];
    for (std::int64_t i = 0; i < count; ++i) {
      const std::optional<double> value = values_.attribute(property.type);
      if (!value)
        builder_.attributes()->spoil(property.attribute, "a value in the list of a polygon is no number");
      values.push_back(value.value_or(0.0));
    }
  }

  static constexpr std::int64_t kUnsignedEndOfStrip = 0xffffffff;

  const Header& header_;
  Values values_;
  MeshBuilder& builder_;
  std::string_view bytes_;
  std::vector<std::int64_t> corners_;  ///< of the latest polygon
  std::map<const Property*, std::vector<double>> corner_values_;
};

void check_roles(const Header& header, const MeshBuilder& builder) {
  std::array<bool, role_count> found{};
  for (const Element& element : header.elements)
    for (const Property& property : element.properties) found[static_cast<std::size_t>(property.role)] = true;
  for (const Role role : {Role::x, Role::y, Role::z})
    if (!found[static_cast<std::size_t>(role)]) builder.fail("its points lack a property x, y or z");
  if (!found[static_cast<std::size_t>(Role::corners)] && !found[static_cast<std::size_t>(Role::strips)])
    builder.fail("it holds no polygon: there is no element 'face' with a list 'vertex_indices'");
}

template <class Values>
void read_elements(std::string_view bytes, const Header& header, MeshBuilder& builder) {
  if (builder.attributes())
    ElementReader<Values, true>(bytes, header, builder).read();
  else
    ElementReader<Values, false>(bytes, header, builder).read();
}

}  // namespace

void read_ply(std::string_view bytes, MeshBuilder& builder) {
  const Header header = parse_header(bytes, builder);
  check_roles(header, builder);
  constexpr bool big_machine = std::endian::native == std::endian::big;
  if (header.encoding == Encoding::ascii)
    read_elements<AsciiValues>(bytes, header, builder);
  else if ((header.encoding == Encoding::big_endian) == big_machine)
    read_elements<BinaryValues<false>>(bytes, header, builder);
  else
    read_elements<BinaryValues<true>>(bytes, header, builder);
}

}  // namespace hermesh::mesh_formats
