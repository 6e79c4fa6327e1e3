// hermesh::mesher: volumes to polygons (chapter 6), and what is made of that.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "hermesh/context.h"
#include "hermesh/export.h"
#include "hermesh/hermite.h"
#include "hermesh/mesh.h"
#include "hermesh/options.h"
#include "hermesh/volume.h"
#include "hermesh/voxelize.h"

namespace hermesh::HERMESH_V1 {

/// What a camera sees: lengths in world units, the angle in degrees.
struct Frustum {
  std::array<double, 3> position = {0, 0, 0}, look_at = {0, 0, -1}, up = {0, 1, 0};
  double angle = 45.0;  ///< vertical, from the lower to the upper plane
  double aspect = 1.0;  ///< width over height
  double near = 0.1, far = 100.0;
};

/// How a volume becomes a mesh; what `hermesh extract` and `hermesh remesh` take.
struct ExtractOptions {
  /// One of extractors(). Empty: manifold-dual-contouring where polygons are at hand (remesh, combine), which
  /// is adaptive within a tolerance, closed, manifold and free of self-intersection; dual-contouring of a
  /// volume alone.
  std::string extractor = {};
  Options options = {};   ///< of the extractor, such as {"tolerance", "0.05"} (voxels)
  double isovalue = 0.0;  ///< value of the surface, in the units of the volume
  std::string ends =
      "closed";  ///< where the surface runs into the end of the data: "closed" with a flat cap, or "open"

  /// Where an adaptive extractor keeps its bound: in a level set where it is negative, in any other volume
  /// where it differs from the background. Nothing: everywhere. A frustum is given in its place, not beside
  /// it.
  Volume mask = {};
  std::optional<Frustum> frustum = {};
  int frustum_resolution = 84;  ///< voxels along the longest side of the frustum's mask, 8 to 4096
  std::string outside =
      "simplify";  ///< outside the mask: "simplify", "nothing" (no polygons) or "everywhere" (the bound)
  Volume tolerance_grid = {};  ///< whose values, none negative, scale the bound

  /// Whether the mesh goes into a file of single precision (STL): what is proved of it is then proved of it
  /// as written.
  bool written_in_single = false;
};

/// The extractors that there are.
HERMESH_API std::vector<MethodInfo> extractors();

/// The surface of a volume. Where it runs into the end of the data, a note says so. The same bytes at any
/// number of threads.
/// `source`, if not null, is the polygons that the volume was made from, for extractors that take exact
/// crossings.
/// @snippet main.cpp extract
/// @throws Error where there is no surface (the sentence says why), for options that there are not or that
/// have no effect; Cancelled.
HERMESH_API Mesh extract(const Volume& volume, const ExtractOptions& options, Context& context,
                         const Mesh* source = nullptr);
/// The surface of a solid, by an extractor that takes Hermite data. @throws Error as above; Cancelled.
HERMESH_API Mesh extract(const Solid& solid, const ExtractOptions& options, Context& context);

/// Polygons to a level set and back to a mesh.
/// @snippet main.cpp remesh
/// @throws Error as voxelize() and extract(); Cancelled.
HERMESH_API Mesh remesh(const Mesh& mesh, const VoxelizeOptions& voxelizing, const ExtractOptions& extracting,
                        Context& context);

/// What a mesh is to keep to; what `hermesh remesh --error` and `--triangles` take. Exactly one of the first
/// two is given.
struct BoundOptions {
  std::optional<double> error = {};  ///< two-sided distance from the polygons' solid at most, world units
  std::optional<std::size_t> triangles =
      {};  ///< at most, at the smallest error that was found for them; at least 4
  std::string signs = "winding-number";  ///< or "flood-fill" or "auto": what is inside
  bool over_holes = false;               ///< whether holes may be closed, where no polygon is near
  double smallest_voxel = 0.0;           ///< world units; 0: an eighth of the error
  double most_points = 3e7;              ///< of the finest mesh
  bool written_in_single = false;        ///< as in ExtractOptions
};

/// A mesh with the distances that are proved of it, world units.
struct BoundedRemesh {
  Mesh mesh;
  double error = 0.0;          ///< that was asked for or, for a budget, found
  double to_polygons = 0.0;    ///< no place of the mesh is farther from the boundary of the polygons' solid
  double from_polygons = 0.0;  ///< no place of that is farther from the mesh
  double voxel_size = 0.0;
};

/// A mesh that is closed, manifold and free of self-intersection, with few triangles and a proved distance
/// from the polygons.
/// @throws Error where the bound is not reached: the sentence says where and why; Cancelled.
HERMESH_API BoundedRemesh remesh_within(const Mesh& mesh, const BoundOptions& options, Context& context);

/// The union, intersection or difference of two meshes' solids: both on one lattice, with their exact
/// crossings, which keep the curves where their surfaces meet. A resolution counts along the larger one. What
/// is lost between samples is a note.
/// @snippet main.cpp combine
/// @throws Error as voxelize() and extract(), for a result that is empty or everywhere thinner than a voxel;
/// Cancelled.
HERMESH_API Mesh combine(Boolean operation, const Mesh& a, const Mesh& b, const VoxelizeOptions& voxelizing,
                         const ExtractOptions& extracting, Context& context);

}  // namespace hermesh::HERMESH_V1
