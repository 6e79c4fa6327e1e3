// The header of a PLY file. Private to algorithms/core/mesh_file_ply*.cpp.
#pragma once

#include <array>

#include "algorithms/io/mesh_file_formats.h"

namespace hermesh::mesh_formats::ply {

enum class Type { int8, uint8, int16, uint16, int32, uint32, float32, float64 };
constexpr std::array<std::size_t, 8> size_of = {1, 1, 2, 2, 4, 4, 4, 8};

/// What a property is read as. `corners` are a list of the corners of a polygon, `strips` of triangle strips.
/// `value` is one number of an attribute, `corner_values` a list of numbers for the corners of a polygon.
enum class Role { ignored, x, y, z, corners, strips, value, corner_values };
constexpr std::size_t role_count = 8;

struct Property {
  std::string_view name;
  Type type;
  std::optional<Type> list_count;  ///< type of the number of items, where the property is a list
  Role role = Role::ignored;
  // Of the attribute, where the role is one of the last two.
  std::size_t attribute = 0;
  int component = 0;  ///< which component of the attribute; for a list, how many there are for each corner
  double unit = 1.0;  ///< divisor that brings the number to the attribute's unit
};

struct Element {
  std::string_view name;
  std::uint64_t count;
  std::vector<Property> properties = {};
  bool has_polygons = false;  ///< whether a property has the role `corners`
};

enum class Encoding { ascii, little_endian, big_endian };

struct Header {
  Encoding encoding = Encoding::ascii;
  std::vector<Element> elements;
  std::size_t length = 0;  ///< bytes before the first element
  bool has_corner_values = false;
};

/// Parses the header. The builder gets its comments and, where it has attributes, one for each that the
/// header declares. @throws Error with the number of the line.
Header parse_header(std::string_view bytes, MeshBuilder& builder);

}  // namespace hermesh::mesh_formats::ply
