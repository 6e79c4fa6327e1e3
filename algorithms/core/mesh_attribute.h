// Named values on the points, corners or polygons of a mesh: normals, colours, texture coordinates,
// materials.
#pragma once

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

namespace hermesh {

/// What an attribute has a value for.
enum class AttributeDomain {
  point,  ///< each of PolygonMesh::points
  corner,  ///< each polygon's corner, where polygons that share a point differ there (Aldén §2.2's vertices):
           ///< three a triangle in the order of PolygonMesh::triangles, then four a quad
  polygon  ///< each triangle, then each quad
};

/// One named attribute: a value for each element of its domain, in the order of the mesh.
struct MeshAttribute {
  std::string name;
  AttributeDomain domain = AttributeDomain::point;
  int components = 1;  ///< numbers for each element, 1 to 4, which lie side by side in `values`
  /// Floats of any number of components, or whole numbers of one component, which stay exact and are never
  /// interpolated; −1 among whole numbers stands for "none".
  std::variant<std::vector<float>, std::vector<std::int32_t>> values;
  std::vector<std::string>
      labels;  ///< names of the whole numbers from 0 on, such as those of materials; may be empty

  bool operator==(const MeshAttribute&) const = default;
};

}  // namespace hermesh
