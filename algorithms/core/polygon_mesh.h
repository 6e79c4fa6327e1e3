// The polygon mesh of all stages, with named attributes: contiguous arrays and no connectivity.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "algorithms/core/bounds.h"
#include "algorithms/core/large_array.h"

namespace hermesh {

using Triangle = std::array<std::uint32_t, 3>;
using Quad = std::array<std::uint32_t, 4>;

/// Elements that an attribute has a value for.
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
  int components = 1;  ///< numbers of each element, 1 to 4, consecutive in `values`
  /// Floats of any number of components, or integers of one component, which stay exact and are never
  /// interpolated; the integer −1 means "none".
  std::variant<std::vector<float>, std::vector<std::int32_t>> values;
  std::vector<std::string>
      labels;  ///< names of the integers from 0 on, such as those of materials; may be empty

  bool operator==(const MeshAttribute&) const = default;
};

/// Polygons over shared points, counter-clockwise seen from outside. A quad (a,b,c,d) always means the
/// triangles abc and acd: order the vertices of a quad so that diagonal 0–2 is the desired split.
struct PolygonMesh {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< world units
  std::vector<Eigen::Vector3f> points;               ///< world units, relative to origin
  std::vector<Triangle> triangles;
  LargeArray<Quad> quads;
  std::vector<MeshAttribute>
      attributes;  ///< each with a name of its own; read_mesh() reads them where asked to

  /// Returns a point's position in world units: writers store this double without loss.
  Eigen::Vector3d world(std::size_t point) const { return origin + points[point].cast<double>(); }
  std::size_t triangle_count() const { return triangles.size() + 2 * quads.size(); }
  bool empty() const { return triangles.empty() && quads.empty(); }

  bool operator==(const PolygonMesh&) const = default;
};

/// Returns all polygons as triangles: the triangles first, then each quad (a,b,c,d) as abc and acd.
std::vector<Triangle> triangulated(const PolygonMesh& mesh);

/// Returns the box of the points that polygons use: a scan file may hold stray points.
Bounds bounds(const PolygonMesh& mesh);

/// Returns the origin of single precision for a mesh within these bounds, in world units. An axis has 0 if
/// the box is at most four times its longest side away from it; otherwise the box's centre, rounded to a
/// power of two no smaller than the box, so that points in single precision remain exact.
Eigen::Vector3d choose_origin(const Bounds& box);

}  // namespace hermesh
