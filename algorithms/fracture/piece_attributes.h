// Attributes of the polygons of a piece in addition to their tags: texture coordinates, and the attributes of
// the original.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <optional>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"

namespace hermesh {

/// A function that gives the normal of the plane between a piece and its neighbour of that number, or
/// nothing, as Cutters::plane_between() does.
using PlaneOfNeighbour = std::function<std::optional<Eigen::Vector3d>(std::int32_t neighbour)>;

/// Adds the corner attribute "uv": for cut polygons (attribute `surface`) the coordinates, in world units
/// relative to the mesh's origin, along two axes at right angles in the plane between the two pieces, so that
/// textures are not stretched; where there is no such plane, the two coordinates other than the one along
/// which the triangle's normal is greatest. The coordinates depend only on positions and on the cutters of
/// the two pieces, so both sides of a seam have the same coordinates, and those of a vertex do not change
/// with the resolution. Original polygons get (0, 0). @throws Error if the piece lacks the attributes
/// `surface` and `neighbour` of piece_mesh().
void add_cut_uv(PolygonMesh& piece, const PlaneOfNeighbour& plane);

/// Transfers the attributes of the original to the original polygons of pieces, from the nearest of its
/// polygons. An attribute of polygons is taken from the polygon nearest to the middle of the triangle, one of
/// corners from that polygon's nearest point to each corner, one of points from the polygon nearest to each
/// point. Floats are interpolated, integers are taken from the nearest corner. Cut polygons and their corners
/// get 0, or −1 for integers; points of cuts take the values of the nearest polygon, as those on the boundary
/// of a cut must. The attribute "uv", of corners or of points, is written to the corners that add_cut_uv()
/// made.
class SourceAttributes {
 public:
  /// The source has to outlive this object. `voxel_size` (world units) is the scale of distances.
  SourceAttributes(const PolygonMesh& source, double voxel_size);
  ~SourceAttributes();
  /// Adds the source's attributes to a piece as piece_mesh() makes it. The same values at any thread count.
  /// @throws Error if the piece lacks the attribute `surface`; Cancelled.
  void add_to(PolygonMesh& piece, RunContext& context) const;

 private:
  struct Tree;
  const PolygonMesh& source_;
  std::unique_ptr<Tree> tree_;
};

}  // namespace hermesh
