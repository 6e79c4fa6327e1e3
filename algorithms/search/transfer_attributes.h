// Attributes of polygons on another mesh of about the same surface: colours, normals, texture coordinates,
// materials and others.
#pragma once

#include <memory>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"

namespace hermesh {

/// Transfers the attributes of a source mesh to other meshes, from the nearest of its polygons. An attribute
/// of points is taken from the polygon nearest to each point, and one of polygons from that nearest to the
/// middle of the polygon. Floats are interpolated, integers are taken from the nearest corner.
///
/// Attributes of corners are continuous within charts, sets of polygons that are connected by edges on which
/// the values of both sides agree. A polygon takes the values of all of its corners from the chart that is
/// nearest to its middle, so that no value is interpolated over a seam.
class SourceAttributes {
 public:
  /// The source has to outlive this object. `voxel_size` (world units) is the scale of distances.
  SourceAttributes(const PolygonMesh& source, double voxel_size);
  ~SourceAttributes();
  /// Adds the source's attributes to a mesh. Those that it has already stay. If it has the attribute
  /// `surface` of piece_mesh(), only original polygons take values: cut ones and their corners get 0, or −1
  /// for integers, and points of cuts take the values of the nearest polygon, as those on the boundary of a
  /// cut must. Texture coordinates "uv" of the source's points are written to the corners if the mesh has
  /// some there. The same values at any thread count. @throws Cancelled
  void add_to(PolygonMesh& mesh, RunContext& context) const;

 private:
  struct Tree;
  const PolygonMesh& source_;
  std::unique_ptr<Tree> tree_;
};

/// Returns both meshes in one, relative to the origin of the first. Elements of an attribute that only one
/// mesh has get 0, or −1 for integers, in the other; attributes of one name and different kinds are dropped.
PolygonMesh joined(const PolygonMesh& a, const PolygonMesh& b);

}  // namespace hermesh
