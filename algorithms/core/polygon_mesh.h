// The polygon mesh that every stage takes or makes: contiguous arrays and no connectivity.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "algorithms/core/bounds.h"
#include "algorithms/core/large_array.h"
#include "algorithms/core/mesh_attribute.h"

namespace hermesh {

using Triangle = std::array<std::uint32_t, 3>;
using Quad = std::array<std::uint32_t, 4>;

/// Polygons over shared points, counter-clockwise seen from outside. A quad (a,b,c,d) means the triangles abc
/// and acd, everywhere; whoever makes a quad orders its corners so that this is the split that it wants.
struct PolygonMesh {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< world units
  std::vector<Eigen::Vector3f> points;               ///< world units, relative to origin
  std::vector<Triangle> triangles;
  LargeArray<Quad> quads;
  std::vector<MeshAttribute>
      attributes;  ///< each with a name of its own; read_mesh() reads them where asked to

  /// Position of a point in world units. This double is the point's position: a writer stores it without
  /// loss.
  Eigen::Vector3d world(std::size_t point) const { return origin + points[point].cast<double>(); }
  std::size_t triangle_count() const { return triangles.size() + 2 * quads.size(); }
  bool empty() const { return triangles.empty() && quads.empty(); }

  bool operator==(const PolygonMesh&) const = default;
};

/// All polygons as triangles: the triangles first, then each quad (a,b,c,d) as abc and acd.
std::vector<Triangle> triangulated(const PolygonMesh& mesh);

/// Box of the points that a polygon uses: a scan file may hold stray points that no polygon refers to.
Bounds bounds(const PolygonMesh& mesh);

/// Where single precision should be centred for a mesh within these bounds, in world units. An axis keeps 0
/// as long as the box is no more than four times its longest side away from it; otherwise it gets the box's
/// centre, rounded to a power of two no smaller than the box, so that points which were single precision stay
/// so exactly.
Eigen::Vector3d choose_origin(const Bounds& box);

}  // namespace hermesh
