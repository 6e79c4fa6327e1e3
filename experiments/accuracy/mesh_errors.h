// How far a mesh is from an exact shape, in each of the quantities whose order of accuracy is measured.
#pragma once

#include <array>
#include <optional>
#include <string>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"
#include "experiments/accuracy/exact_shapes.h"

namespace hermesh {

/// World units, radians for normals, shares of the truth for area and volume, and 1 over world units for
/// curvature.
enum class Quantity {
  kRms,        ///< distance from the mesh to the surface, root mean square over the mesh's area
  kMax,        ///< the largest such distance
  kNormals,    ///< angle between triangles and the surface near them, root mean square over the area
  kArea,       ///< error of the area
  kVolume,     ///< error of the volume
  kCurvature,  ///< error of the mean curvature by cotangents at points, mean over the area
  kHausdorff,  ///< the largest distance from one to the other, over both directions
  kEdges,      ///< distance from the creases to the mesh, root mean square
  kCorners,    ///< distance from the corners to the mesh, root mean square
};
inline constexpr std::array kQuantities = {Quantity::kRms,       Quantity::kMax,    Quantity::kNormals,
                                           Quantity::kArea,      Quantity::kVolume, Quantity::kCurvature,
                                           Quantity::kHausdorff, Quantity::kEdges,  Quantity::kCorners};
/// Returns "rms", "max", "normals", "area", "volume", "curvature", "hausdorff", "edges", "corners".
const char* name(Quantity quantity);

/// Errors by quantity, those of area and volume signed (negative: too small); none where the shape has no
/// such truth.
struct MeshErrors {
  std::size_t triangles = 0;  ///< those that lie where the shape is described
  std::array<std::optional<double>, kQuantities.size()> signed_errors;

  std::optional<double> signed_error(Quantity quantity) const { return signed_errors[std::size_t(quantity)]; }
};

/// Measures a mesh. `length`: of pieces into which long triangles are cut before distances are taken at the
/// corners, the middles of the sides and inside of each piece (squares by the rule that is exact for
/// polynomials of degree 5), and how densely the surface and its creases are sampled; the voxel size is a
/// good one. The same result at any number of threads.
/// @throws Error for a mesh without a triangle where the shape is described; Cancelled.
MeshErrors mesh_errors(const PolygonMesh& mesh, const PlacedShape& shape, double length, RunContext& context);

/// Distances only from the mesh to the surface, world units, over the mesh's area.
struct DistancesToSurface {
  double rms = 0, max = 0;  ///< as Quantity::kRms and kMax
  double mean = 0;          ///< positive outside
};
DistancesToSurface distances_to_surface(const PolygonMesh& mesh, const PlacedShape& shape, double length,
                                        const RunContext& context);

}  // namespace hermesh
