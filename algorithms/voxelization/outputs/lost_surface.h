// What of the polygons a level set cannot show: walls, fins and gaps that pass between its samples.
#pragma once

#include <Eigen/Core>
#include <string>

#include "algorithms/core/level_set.h"
#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/variant.h"

namespace hermesh {

/// How much of the surface a level set does not show.
struct LostSurface {
  double area = 0.0;       ///< area of the polygons that bound the solid, world units²
  double lost_area = 0.0;  ///< the part of it without a change of sign within a voxel
  /// The thinnest lost place that was found, in world space, and the distance there to the opposite wall,
  /// world units; 0 where no lost place has an opposite wall within two voxels.
  Eigen::Vector3d thinnest_at = Eigen::Vector3d::Zero();
  double thickness = 0.0;

  /// The lost part of the area, 0 to 1.
  double share() const { return area > 0.0 ? lost_area / area : 0.0; }
};

/// Looks at places spread evenly over the polygons, one a voxel² of area or a triangle, or some two hundred
/// thousand where that is fewer, and asks for each whether any of the samples within a voxel differ in sign.
/// A place where all of them are outside is lost. One where all are inside is lost only if
/// `distances_are_to_the_boundary` and their distances are those to the polygon: else the polygon lies within
/// the solid and bounds nothing, and does not count, but for what of it is within a voxel of the solid's
/// surface. A level set without signs loses nothing. The result is the same at any thread count.
/// @param mesh the polygons that the level set was made from
/// @param level_set any placement, distances in world units
/// @param distances_are_to_the_boundary whether the level set's distances leave out the polygons inside, as
/// those of voxelize() do
/// @param context asked for cancellation
/// @throws Cancelled
LostSurface find_lost_surface(const PolygonMesh& mesh, const LevelSet& level_set,
                              bool distances_are_to_the_boundary, const RunContext& context);

/// Whether a voxelizer's distances leave the polygons inside the solid out.
bool leaves_out_inner_polygons(const Voxelizer& voxelizer);

/// A sentence for the user: the share, the thinnest place and the voxel size that would keep it, all in world
/// units. Empty where nothing is lost.
std::string lost_surface_note(const LostSurface& lost, double voxel_size);

}  // namespace hermesh
