// hermesh::mesher: volumes to polygons (chapter 6), remeshing and Booleans.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "hermesh/hermite.h"
#include "hermesh/options.h"
#include "hermesh/voxelize.h"

namespace hermesh::HERMESH_V1 {

/// The view of a camera: lengths in world units, the angle in degrees.
struct Frustum {
  std::array<double, 3> position = {0, 0, 0}, look_at = {0, 0, -1}, up = {0, 1, 0};
  double angle = 45.0;  ///< vertical, from the lower to the upper plane
  double aspect = 1.0;  ///< width over height
  double near = 0.1, far = 100.0;
};

/// Options of extract() and remesh(), as of `hermesh extract` and `hermesh remesh`.
struct ExtractOptions {
  /// One of extractors(). Empty: dual-contouring for a volume; for polygons (remesh, combine)
  /// manifold-dual-contouring, which is adaptive within a tolerance, closed, manifold and free of
  /// self-intersection.
  std::string extractor = {};
  Options options = {};   ///< of the extractor, such as {"tolerance", "0.05"} (voxels)
  double isovalue = 0.0;  ///< value of the surface, in the units of the volume
  /// Where the surface reaches the end of the data: "closed" with a flat cap, or "open".
  std::string ends = "closed";

  /// Where an adaptive extractor keeps its bound: where a level set is negative, where any other volume
  /// differs from its background. Empty: everywhere. Excludes a frustum.
  Volume mask = {};
  std::optional<Frustum> frustum = {};
  int frustum_resolution = 84;  ///< voxels along the longest side of the frustum's mask, 8 to 4096
  /// Outside the mask: "simplify", "nothing" (no polygons) or "everywhere" (the bound).
  std::string outside = "simplify";
  Volume tolerance_grid = {};  ///< its values, none negative, scale the bound

  /// True if the mesh goes into a file of single precision (STL): guarantees then hold for the written mesh.
  bool written_in_single = false;
};

/// Returns the available extractors.
HERMESH_API std::vector<MethodInfo> extractors();

/// Returns the surface of a volume, with a note if it reaches the end of the data. The same bytes at any
/// number of threads.
/// @param source the polygons that the volume was made from, for extractors that use exact crossings; may be
/// null
/// @snippet main.cpp extract
/// @throws Error if there is no surface (with the reason), for unknown options and for options without
/// effect; Cancelled.
HERMESH_API Mesh extract(const Volume& volume, const ExtractOptions& options, Context& context,
                         const Mesh* source = nullptr);
/// Returns the surface of a solid, by an extractor that takes Hermite data. @throws Error as above;
/// Cancelled.
HERMESH_API Mesh extract(const Solid& solid, const ExtractOptions& options, Context& context);

/// Converts polygons to a level set and back to a mesh.
/// @snippet main.cpp remesh
/// @throws Error as voxelize() and extract(); Cancelled.
HERMESH_API Mesh remesh(const Mesh& mesh, const VoxelizeOptions& voxelizing, const ExtractOptions& extracting,
                        Context& context);

/// Options of remesh_within(), as of `hermesh remesh --error` and `--triangles`. Exactly one of the first two
/// is given.
struct BoundOptions {
  std::optional<double> error = {};  ///< maximum two-sided distance from the polygons' solid, world units
  /// Maximum number of triangles, at least 4; the mesh has the smallest certified error found.
  std::optional<std::size_t> triangles = {};
  std::string signs = "winding-number";  ///< how the inside is found; or "flood-fill" or "auto"
  bool over_holes = false;               ///< true if holes may be closed where no polygon is near
  double smallest_voxel = 0.0;           ///< world units; 0: an eighth of the error
  double most_points = 0.0;  ///< maximum number of vertices of the finest mesh; 0: 3e7 for an error, else 4e5
  bool written_in_single = false;  ///< as in ExtractOptions
  Thin thin = Thin::keep;          ///< otherwise a part that the smallest voxels do not show is an error
  /// True if a volume is made even if the polygons are a closed, manifold mesh free of self-intersection,
  /// which is otherwise simplified itself.
  bool through_volume = false;
  /// True if the bound need not hold around holes, walls and gaps that no voxel size shows; otherwise these
  /// are an error.
  bool except_thin = false;
};

/// A ball within which a bound may not hold, world units.
struct ExceptedBall {
  std::array<double, 3> position = {0, 0, 0};
  double radius = 0.0;
  double distance = 0.0;  ///< lower bound of the distance between mesh and polygons at the position
  double area = 0.0;      ///< of the parts of polygons and mesh in the ball that are not shown to be near
  bool is_hole = false;   ///< true if the mesh closes a hole there; otherwise a wall or gap is too thin
};

/// A mesh with its certified distances, world units.
struct BoundedRemesh {
  Mesh mesh;
  double error = 0.0;          ///< the requested one or, for a budget, the one found
  double to_polygons = 0.0;    ///< bound of the distance from the mesh to the boundary of the polygons' solid
  double from_polygons = 0.0;  ///< bound of the distance from that boundary to the mesh
  double voxel_size = 0.0;     ///< 0: no volume was made
  /// With `except_thin`, balls outside of which the bounds hold, those with the largest distance first.
  std::vector<ExceptedBall> exceptions = {};
};

/// Returns a closed, manifold mesh free of self-intersection with few triangles and a certified distance from
/// the polygons.
/// @throws Error if the bound cannot be reached, with location and reason; Cancelled.
HERMESH_API BoundedRemesh remesh_within(const Mesh& mesh, const BoundOptions& options, Context& context);

/// Returns the union, intersection or difference of the solids of two meshes, both sampled on one lattice
/// with exact crossings, which preserve the curves where their surfaces intersect. A resolution counts along
/// the larger one. Adds a note if parts are lost between samples.
/// @snippet main.cpp combine
/// @throws Error as voxelize() and extract(), and for a result that is empty or everywhere thinner than a
/// voxel; Cancelled.
HERMESH_API Mesh combine(Boolean operation, const Mesh& a, const Mesh& b, const VoxelizeOptions& voxelizing,
                         const ExtractOptions& extracting, Context& context);

}  // namespace hermesh::HERMESH_V1
