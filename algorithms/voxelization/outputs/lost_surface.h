// Parts of the polygons that a level set cannot show: walls, fins and gaps that pass between its samples.
#pragma once

#include <Eigen/Core>
#include <string>

#include "algorithms/core/level_set.h"
#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/variant.h"

namespace hermesh {

/// The part of the surface that a level set does not show.
struct LostSurface {
  double area = 0.0;       ///< area of the polygons that bound the solid, world units²
  double lost_area = 0.0;  ///< the part of it without a change of sign within a voxel
  /// The thinnest lost point that was found, in world space, and its distance to the opposite wall, world
  /// units; 0 if no lost point has an opposite wall within two voxels.
  Eigen::Vector3d thinnest_at = Eigen::Vector3d::Zero();
  double thickness = 0.0;

  /// Returns the lost part of the area, 0 to 1.
  double share() const { return area > 0.0 ? lost_area / area : 0.0; }
};

/// Tests points spread evenly over the polygons, one per voxel² of area or per triangle, or some two hundred
/// thousand if that is fewer: a point is shown if any of the samples within a voxel differ in sign. A point
/// with all of them outside is lost. A point with all inside is lost only if `distances_are_to_the_boundary`
/// and their distances are those to the polygon; otherwise the polygon lies within the solid and does not
/// count, except within a voxel of the solid's surface. A level set without signs loses nothing. The result
/// is the same at any thread count.
/// @param mesh the polygons that the level set was made from
/// @param level_set any placement, distances in world units
/// @param distances_are_to_the_boundary true if the level set's distances leave out the polygons inside, as
/// those of voxelize() do
/// @throws Cancelled
LostSurface find_lost_surface(const PolygonMesh& mesh, const LevelSet& level_set,
                              bool distances_are_to_the_boundary, const RunContext& context);

/// Returns true if a voxelizer's distances leave out the polygons inside the solid.
bool leaves_out_inner_polygons(const Voxelizer& voxelizer);

/// Returns a message: the share, the thinnest point and the voxel size that would preserve it, all in world
/// units. Empty if nothing is lost.
std::string lost_surface_note(const LostSurface& lost, double voxel_size);

/// Adds the statistics `lost_surface_share` and `lost_surface_thickness` of a voxelizer's level set to the
/// context, and the note if something is lost. @throws Cancelled
void note_lost_surface(const PolygonMesh& mesh, const LevelSet& level_set, const Voxelizer& voxelizer,
                       RunContext& context);

}  // namespace hermesh
