// The header of a PLY file. Private to algorithms/core/mesh_file_ply*.cpp.
#pragma once

#include <array>

#include "algorithms/io/mesh_file_formats.h"

namespace hermesh::mesh_formats::ply {

enum class Type { int8, uint8, int16, uint16, int32, uint32, float32, float64 };
constexpr std::array<std::size_t, 8> size_of = {1, 1, 2, 2, 4, 4, 4, 8};

/// `corners` are a list of those of a polygon, `strips` of triangle strips. `value` is one number of an attribute,
/// `corner_values` a list with those of a polygon's corners.
enum class Role { ignored, x, y, z, corners, strips, value, corner_values };
constexpr std::size_t role_count = 8;

struct Property {
  std::string_view name;
  Type type;
  std::optional<Type> list_count;  ///< type of the number of items, where the property is a list
  Role role = Role::ignored;
  // Of the attribute, where the role is one of the last two.
  std::size_t attribute = 0;
  int component = 0;  ///< of a list: how many there are a corner
  double unit = 1.0;  ///< what the number is divided by
};

struct Element {
  std::string_view name;
  std::uint64_t count;
  std::vector<Property> properties = {};
  bool has_polygons = false;  ///< a property with the role `corners`
};

enum class Encoding { ascii, little_endian, big_endian };

struct Header {
  Encoding encoding = Encoding::ascii;
  std::vector<Element> elements;
  std::size_t length = 0;  ///< bytes, up to the first element
  bool has_corner_values = false;
};

/// Takes over comments and, where the builder has attributes, gives each its place. @throws Error
Header parse_header(std::string_view bytes, MeshBuilder& builder);

}  // namespace hermesh::mesh_formats::ply
