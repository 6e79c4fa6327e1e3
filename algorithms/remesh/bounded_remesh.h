// From polygons to a mesh within a stated distance of them. The voxel size and the tolerance are chosen here,
// and the bound is proved against the polygons themselves, not against the uniform mesh.
//
// **The surface** of the bound is the boundary of the solid that the polygons describe: the inside is where
// their generalised winding number is above ½ (or as the sign rule defines it), and those polygons and parts
// of polygons count that do not certainly have the solid on both sides
// (voxelization/inside/interior_faces.h). Double walls and dangling patches, which orient_faces() omits,
// bound nothing; nor do the pieces that TwoSidedProof finds free.
//
// **The method.** If the polygons are a closed, manifold, oriented mesh free of self-intersection, each of
// whose shells has the solid behind it, they are collapsed themselves, with the whole error as tolerance
// (certified_collapse/), and their topology is preserved. All other polygons become a volume first.
//
// Large voxels, whose uniform mesh uses up almost nothing of the error on plane or smooth
// shapes, are tried first, because a try costs little compared with the next. Otherwise voxels are made
// smaller until the uniform mesh is within most of the error in both directions at the vertices of both, and
// within the error between these, triangle by triangle. The rest of the error at each position, minus a
// little, is the tolerance of the collapses there (certified_collapse/). The result is then compared with the
// surface in the same way: this, and nothing before it, is the proof (two_sided_proof.h). Where it fails, the
// tolerance is lowered, or else the voxels are made smaller (voxel_size.h). The result is collapsed and
// proved again, as long as that is worth it.
//
// **Exceptions.** If no voxel size reaches the bound and except_thin is set, voxels are made smaller as long
// as that removes a quarter of the area that is too far. The proof then collects the pieces of both surfaces
// that it cannot show to be near, and balls around them. It holds outside of these balls.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"
#include "algorithms/remesh/thin_parts.h"
#include "algorithms/remesh/topology.h"
#include "algorithms/voxelization/hermesh_voxelizer.h"

namespace hermesh {

struct BoundedRemeshOptions {
  double error = 0.0;  ///< world units, greater than 0: bound of the two-sided distance
  SignRule signs = SignRule::winding_number;
  /// True if the mesh may close holes, with no polygon near: over them the bound applies to the surface on
  /// which the winding number is ½, as found at the voxel size.
  bool over_holes = false;
  /// Largest number of vertices of the uniform mesh, some 300 bytes each; the available memory also limits
  /// it.
  double most_points = 3e7;
  /// Limit of BoundedMesh::work; the bound is not reached beyond it.
  double most_work = std::numeric_limits<double>::infinity();
  double smallest_voxel = 0.0;     ///< world units; 0: an eighth of the error
  bool written_in_single = false;  ///< as in ExtractionInput
  /// With ThinRule::keep all polygons count that do not have the solid on both sides: thin and open parts are
  /// thickened within the error. Holes that may not be closed and have more than a tenth of the polygons'
  /// area then make the polygons around them open parts.
  ThinRule thin = ThinRule::drop;
  /// True if a volume is made even where the polygons are a valid mesh already.
  bool through_volume = false;
  /// True if the bound need not hold in balls around the positions where it cannot be reached.
  bool except_thin = false;
};

/// Reasons why the bound is not reached at a position.
enum class Unmet {
  hole,  ///< the mesh closes a hole of the polygons, and none of them is near
  thin   ///< a wall, gap or detail that the smallest allowed voxels do not show
};
struct UnmetPlace {
  Unmet why;
  Eigen::Vector3d place;  ///< world space
  double distance;        ///< lower bound between the surface and the mesh, world units
  double radius = 0.0;    ///< of the ball around `place` within which the bound may not hold; world units
  double area = 0.0;      ///< of the parts of polygons and mesh in the ball that are not shown to be near
};

/// Result of a bounded remeshing; lengths and areas in world units.
struct BoundedMesh {
  PolygonMesh mesh;    ///< closed, manifold, oriented, free of self-intersection; empty if `unmet` is not
  double error = 0.0;  ///< as requested
  /// Proved bounds of the distance, one per direction: of all points of the mesh from the surface, and of all
  /// points of the surface from the mesh, except the points in the balls of `excepted`.
  double to_surface = 0.0, from_surface = 0.0;
  double voxel_size = 0.0;     ///< 0: the polygons themselves were collapsed, and no volume was made
  int rounds = 0;              ///< number of times that voxels or tolerances were lowered
  double free_area = 0.0;      ///< area of polygons far from the mesh that bound nothing
  double left_out_area = 0.0;  ///< area of polygons within the solid, and of double walls
  bool over_holes = false;     ///< as requested
  double hole_area = 0.0;      ///< area of the caps that close holes
  double work = 0.0;           ///< vertices of all meshes made and polygons of thin parts, a measure of time
  double thickness = 0.0;      ///< of the part that is too thin at the first unmet position; 0: unknown
  std::optional<ThinParts> thin;     ///< none: nothing was thickened
  std::vector<UnmetPlace> unmet;     ///< the most distant ones, farthest first
  std::vector<UnmetPlace> excepted;  ///< with BoundedRemeshOptions::except_thin; farthest first
  double area = 0.0;                 ///< of the polygons
  Topology topology;                 ///< of the polygons that bound the solid

  /// Returns the sum of the areas of `excepted`.
  double excepted_area() const;
};

/// Returns a closed, manifold mesh free of self-intersection whose two-sided distance from the polygons'
/// surface is at most `options.error`, with few triangles; or the positions that prevent it, which are
/// excepted if the options permit it. The same bytes for any number of threads.
/// @param mesh any polygons, with quads oriented so that diagonal 0–2 is their split
/// @throws Error if the polygons define no inside, as voxelize(), and beyond `options.most_work`; Cancelled
BoundedMesh bounded_remesh(const PolygonMesh& mesh, const BoundedRemeshOptions& options, RunContext& context);

/// Limit of the work of all tries of remesh_to_budget(), some half a minute on two cores.
inline constexpr double kBudgetWork = 2e6;

/// Returns the mesh of bounded_remesh() with the smallest error found that needs at most `triangles`
/// triangles (at least 4); `options.error` is ignored. At most twelve errors are tried, until nine tenths of
/// the triangles are used or their work exceeds kBudgetWork.
/// @throws Error if no error up to half of the polygons' extent gives so few; as bounded_remesh()
BoundedMesh remesh_to_budget(const PolygonMesh& mesh, std::size_t triangles,
                             const BoundedRemeshOptions& options, RunContext& context);

/// Returns notes on polygons that do not count for the bound, on closed holes, on exceptions, and on a
/// topology that differs from that of the polygons.
std::vector<std::string> notes(const BoundedMesh& made);

/// Returns the positions where the bound is not reached, the reasons and the remedies. Requires an unmet
/// position.
std::string explanation(const BoundedMesh& refused);

}  // namespace hermesh
