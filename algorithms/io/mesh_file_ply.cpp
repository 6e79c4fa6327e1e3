// PLY (Turk 1994): a header that declares elements and their properties, then the elements in that order.
#include "algorithms/io/mesh_file_ply.h"

#include <array>
#include <bit>
#include <map>

namespace hermesh::mesh_formats {

using namespace ply;

namespace {

/// Source of the elements' values when they are text: an element a line, whatever else the line may hold. A
/// float is rounded as the header declares it.
class AsciiValues {
 public:
  AsciiValues(std::string_view bytes, std::size_t start, const MeshBuilder& builder)
      : cursor_(bytes, builder.file(), start) {}
  void begin_element() {
    wrapped_at_ = 0;
    const char first = cursor_.peek();
    if (first < '+' || first > '9') skip_comments();  // it is no number
  }
  /// Ends an element. Words behind its last value are passed over, unless it began on an earlier line: then
  /// nobody can tell whether they belong to it or to the next one.
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
  /// The next value as one of an attribute; nothing where it is not of its type.
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
  /// Passes over white space, and over lines that begin as comments do in the header or in other formats.
  void skip_comments() {
    for (cursor_.skip_space(); cursor_.peek() == '#' || cursor_.peek() == 'c'; cursor_.skip_space()) {
      if (cursor_.peek() == 'c' && TextCursor(cursor_).word() != "comment") return;
      cursor_.rest_of_line();
    }
  }
  /// Moves to the next value, which may be on the next line: long lists go on there.
  [[gnu::always_inline]] void to_value() {
    if (!cursor_.skip_blanks_to_word()) to_next_line();
  }
  [[gnu::noinline]] void to_next_line() {
    if (wrapped_at_ == 0) wrapped_at_ = cursor_.offset();
    cursor_.skip_space();
  }

  TextCursor cursor_;
  std::size_t wrapped_at_ = 0;  ///< where the first line ends of an element that has several; 0: it has one
  std::size_t long_lines_ = 0, first_long_line_ = 0;
};

/// Source of the elements' values when they are binary. `swapped` is known to the compiler, so that the loops
/// ask nothing.
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
    // Some programs write indices as floating-point numbers.
    const double value = real(type);
    // Also false for what is not a number; 2^53 is far beyond any index.
    if (!(std::abs(value) < 9007199254740992.0) || value != std::trunc(value))
      builder_.fail("an index is not a whole number");
    return static_cast<std::int64_t>(value);
  }
  std::optional<double> attribute(Type type) {
    // All whole numbers of up to 32 bits are doubles without loss.
    return type >= Type::float32 ? real(type) : static_cast<double>(integer(type));
  }
  void skip(Type type) {
    if (remaining() < size_of[static_cast<std::size_t>(type)]) fail_truncated();
    at_ += size_of[static_cast<std::size_t>(type)];
  }
  /// Whether this many elements of so many bytes can still be there. A quotient, because the product may
  /// overflow.
  bool has(std::uint64_t count, std::size_t bytes) const {
    return bytes == 0 || count <= remaining() / bytes;
  }
  std::size_t offset() const { return at_; }
  void finish(std::string_view, MeshBuilder& builder) const {
    // Padding is told from data by its bytes, so a file that ends in zeros of its own cannot be mistaken:
    // these belong to values that were read.
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

/// Reads all elements. `with_attributes` keeps all thought of attributes out of the loops for those who want
/// none.
template <class Values, bool with_attributes>
class ElementReader {
 public:
  ElementReader(std::string_view bytes, const Header& header, MeshBuilder& builder)
      : header_(header), values_(bytes, header.length, builder), builder_(builder), bytes_(bytes) {}

  void read() {
    for (const Element& element : header_.elements) {
      reserve(element);
      // An element without properties takes no bytes, however often it is said to be there.
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
  /// Makes room for an element, once the file is known to be long enough for it: a header may claim any
  /// count.
  void reserve(const Element& element) {
    std::size_t least = 0;
    for (const Property& property : element.properties) {
      // A list may be empty, so only its length counts.
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
        // The roles x, y and z follow one another.
        point[static_cast<int>(property.role) - static_cast<int>(Role::x)] = values_.real(property.type);
      }
    }
    // An element that declares no coordinate stands at 0; check_roles() has seen that x, y and z are declared
    // somewhere.
    if (element.name == "vertex") builder_.mesh.points.push_back(point);
    if (with_attributes && element.has_polygons) end_corners();
  }

  void begin_attributes(const Element& element) {
    if (element.name == "vertex") builder_.attributes()->begin(AttributeDomain::point);
    if (element.has_polygons) builder_.attributes()->begin(AttributeDomain::polygon);
    // What an earlier polygon left must not pass for a list of this one.
    corners_.clear();
    for (auto& [property, values] : corner_values_) values.clear();
  }

  /// Gives the corners of a polygon their values. Lists of values may stand before that of the corners, so
  /// they are looked at when the whole element has been read.
  void end_corners() {
    if (!header_.has_corner_values) return;
    for (auto& [property, values] : corner_values_) {
      // No list at all is a polygon without values; a list of a wrong length cannot be divided among the
      // corners.
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

  /// Adds the triangles of a strip. Each has the two corners before and the next one, and every other one is
  /// turned over. −1 ends a strip, and a triangle with the same corner twice only leads to the next one.
  void add_strips() {
    std::size_t first = 0;
    for (std::size_t i = 0; i < corners_.size(); ++i) {
      if (corners_[i] == -1 || corners_[i] == kUnsignedEndOfStrip) first = i + 1;
      if (i < first + 2) continue;
      std::array<std::int64_t, 3> corners = {corners_[i - 2], corners_[i - 1], corners_[i]};
      // By its place in the strip and not by how many triangles were added: one that is left out turns the
      // next one, too.
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
    // Lengths may have a type with a sign.
    if (count < 0) builder_.fail("a list has a negative length");
    const std::size_t item =
        header_.encoding == Encoding::ascii ? 1 : size_of[static_cast<std::size_t>(property.type)];
    // A count is believed only as far as the file reaches.
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
      // A place is kept for a bad value, so that the length of the list stays what it was.
      values.push_back(value.value_or(0.0));
    }
  }

  static constexpr std::int64_t kUnsignedEndOfStrip = 0xffffffff;

  const Header& header_;
  Values values_;
  MeshBuilder& builder_;
  std::string_view bytes_;
  std::vector<std::int64_t> corners_;  ///< corners of the latest polygon
  std::map<const Property*, std::vector<double>> corner_values_;
};

void check_roles(const Header& header, const MeshBuilder& builder) {
  // Only what no mesh can do without is asked for; all else is an attribute, or ignored.
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
  // Byte order and whether attributes are wanted become template parameters here, once for the whole file.
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
