// What the polygons of a piece carry besides their tags: texture coordinates, and the attributes of the
// original.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <optional>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"

namespace hermesh {

/// Normal of the plane between the piece and its neighbour of that number, or nothing; see
/// Cutters::plane_between().
using PlaneOfNeighbour = std::function<std::optional<Eigen::Vector3d>(std::int32_t neighbour)>;

/// Adds "uv" of corners: for cut polygons (attribute `surface`) the coordinates, in world units relative to
/// the mesh's origin, along two axes at right angles in the plane between the two pieces, so that nothing is
/// stretched; where there is no such plane, the two coordinates other than the one along which the triangle's
/// normal is greatest. Both depend on places and on the two pieces' cutters alone, so both sides of a seam
/// have the same, and a point keeps its own when the resolution changes. Original polygons get (0, 0).
void add_cut_uv(PolygonMesh& piece, const PlaneOfNeighbour& plane);

/// Carries the attributes of the original over to the original polygons of pieces, from the nearest of its
/// polygons: those of polygons from the one nearest to the middle of the triangle, those of its corners from
/// that one's nearest point to each corner, those of points from the polygon nearest to each point. Floats
/// are interpolated, whole numbers taken from the nearest corner. Cut polygons and their corners get 0, whole
/// numbers −1; points of the cuts take the nearest polygon's, as the rims must. "uv", of corners or of
/// points, goes into the corners that add_cut_uv() made.
class SourceAttributes {
 public:
  /// The mesh has to outlive it. `voxel_size` in world units, as the scale of distances.
  SourceAttributes(const PolygonMesh& source, double voxel_size);
  ~SourceAttributes();
  void add_to(PolygonMesh& piece, RunContext& context) const;

 private:
  struct Tree;
  const PolygonMesh& source_;
  std::unique_ptr<Tree> tree_;
};

}  // namespace hermesh
