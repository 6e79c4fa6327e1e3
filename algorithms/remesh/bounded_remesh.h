// From polygons to a mesh within a stated distance of them: the voxel size and the tolerance are chosen here,
// and the bound is held against the polygons themselves, not against the uniform mesh.
//
// **The surface** that the bound is about is the boundary of the solid that the polygons describe: inside is
// where their generalised winding number is above ½ (or what the sign rule says), and of the polygons those
// count, or the parts of those, that do not have the solid on both sides for certain
// (voxelization/inside/interior_faces.h). Double walls and dangling patches, which orient_faces() leaves out,
// bound nothing; nor do pieces, no larger than a 16th of the error, with the same side of ½ on either side of
// their middle. That is the one part of the bound that is looked at in places and not proved: the area of
// what counts as free so is told.
//
// **The way.** Of shapes that are plane or smooth large voxels have a uniform mesh that uses up next to
// nothing of the error; these are tried first, for a try costs little beside the next. Else voxels are made
// smaller until the uniform mesh is within most of the error both ways, as far as points of both tell, and
// within the error between these, triangle by triangle (search/surface_distance.h). What is left of the error
// at each place, and a little less, is the tolerance of the collapses there (certified_collapse/). The
// outcome is held against the surface in the same way: that, and nothing before it, is the proof. Around
// places where it fails the tolerance is lowered, or else the voxels are made smaller. What was reached is
// collapsed and held again, as long as that is worth it.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"
#include "algorithms/remesh/thin_parts.h"
#include "algorithms/voxelization/sign_rule.h"

namespace hermesh {

struct BoundedRemeshOptions {
  double error = 0.0;  ///< world units, greater than 0: bound of the two-sided distance
  SignRule signs = SignRule::winding_number;
  /// Whether the mesh may close holes, where no polygon is to be near: over them it is bound to the surface
  /// on which the winding number is ½, as found at the voxel size.
  bool over_holes = false;
  /// Points of the uniform mesh at most, so that voxels do not become smaller without end; each takes some
  /// 300 bytes, and there are no more than the available memory holds.
  double most_points = 3e7;
  /// Work, as BoundedMesh::work, after which no further mesh is made; the bound is then not reached.
  double most_work = std::numeric_limits<double>::infinity();
  double smallest_voxel = 0.0;     ///< world units: none is smaller; 0: an eighth of the error
  bool written_in_single = false;  ///< as in ExtractionInput
  /// With ThinRule::keep all polygons count that do not have the solid on both sides: thin parts and sheets
  /// are thickened within the error. Holes that may not be closed then make the polygons around them sheets.
  ThinRule thin = ThinRule::drop;
};

/// Why a place keeps the bound from being reached.
enum class Unmet {
  hole,  ///< the mesh closes a hole of the polygons, and none of them is near
  thin   ///< a wall, gap or detail that voxels as small as allowed do not show
};
struct UnmetPlace {
  Unmet why;
  Eigen::Vector3d place;  ///< world space
  double distance;        ///< between the surface and the mesh there, at least, world units
};

/// What came of it.
struct BoundedMesh {
  PolygonMesh mesh;    ///< closed, manifold, oriented, free of self-intersection; without polygons if `unmet`
                       ///< is not empty
  double error = 0.0;  ///< that was asked for, world units
  double to_surface = 0.0,
         from_surface = 0.0;  ///< bounds of the distance, each way, that are proved; world units
  double voxel_size = 0.0;    ///< world units
  int rounds = 0;  ///< how often voxels or tolerances were made smaller than those that suit any shape
  double free_area = 0.0;      ///< area of polygons far from the mesh that bound nothing, world units²
  double left_out_area = 0.0;  ///< area of polygons within the solid, and of double walls; world units²
  bool over_holes = false;     ///< as it was asked for
  double hole_area = 0.0;      ///< area of the caps that close holes, world units²
  double work = 0.0;  ///< vertices of all meshes that were made and polygons of thin parts, a measure of time
  double thickness = 0.0;         ///< of what is too thin at the first unmet place, world units; 0: unknown
  std::optional<ThinParts> thin;  ///< what was thickened; none: nothing
  std::vector<UnmetPlace> unmet;  ///< the first of each kind, the most distant first
};

/// A closed, manifold mesh free of self-intersection whose two-sided distance from the polygons' surface is
/// at most `options.error`, with few triangles; or the places that keep it from being one. The same bytes for
/// every number of threads.
/// @param mesh any polygons, quads cut as they are to be
/// @param options what is asked for
/// @param context told of progress, and asked whether to stop
/// @throws Error where the polygons give no inside, or as voxelize() does, or after `options.most_work`;
/// Cancelled
BoundedMesh bounded_remesh(const PolygonMesh& mesh, const BoundedRemeshOptions& options, RunContext& context);

/// The work of all tries of remesh_to_budget() at most, some half a minute on two cores.
inline constexpr double kBudgetWork = 2e6;

/// Returns the mesh of bounded_remesh() with the smallest error that was found for which there are at most
/// `triangles` triangles; `options.error` is ignored. Errors are tried until nine tenths of the triangles are
/// used, twelve at most, and until their work exceeds kBudgetWork.
/// @param mesh as in bounded_remesh()
/// @param triangles at least 4
/// @param options as in bounded_remesh(), but for the error
/// @param context told of progress, and asked whether to stop
/// @throws Error where no error as large as half of the polygons' extent gives so few; as bounded_remesh()
BoundedMesh remesh_to_budget(const PolygonMesh& mesh, std::size_t triangles,
                             const BoundedRemeshOptions& options, RunContext& context);

/// Sentences on what of a bound that was reached is not as one would think: polygons that count for nothing,
/// and holes.
std::vector<std::string> notes(const BoundedMesh& made);

/// A sentence that says where and why the bound is not reached, and what to do. There is an unmet place.
std::string explanation(const BoundedMesh& refused);

}  // namespace hermesh
