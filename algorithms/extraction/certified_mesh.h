// Parts that the two certified extractors share, `manifold-dual-contouring` (certified_collapse/) and
// `certified-octree` (certified_octree/): their tolerances, a field that scales them, and the conversion of
// polygons of index space to the mesh.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <string_view>
#include <vector>

#include "algorithms/core/large_array.h"
#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/variant.h"
#include "algorithms/extraction/adaptivity_field.h"
#include "algorithms/extraction/dual_contouring/dual_contouring.h"
#include "algorithms/extraction/embedded_mesh/file_points.h"
#include "algorithms/extraction/embedded_mesh/uniform_mesh.h"
#include "algorithms/hermite/hermite_view.h"

namespace hermesh {

/// Tolerance outside of a mask with AdaptivityField::Outside::simplify, in voxels; topology and freedom from
/// self-intersection are preserved there, too.
inline constexpr double kSimplifiedTolerance = 8.0;

/// An adaptivity field at single positions of index space, relative to the placement's base: a position has
/// the values of the cell that contains it, and is in the mask if a cell is that contains or touches it.
class FieldAtPoints : public FieldEvaluator {
 public:
  /// @param field may be null
  /// @param placement of the volume whose index space the positions are in
  /// @throws Error as FieldEvaluator's constructor does
  FieldAtPoints(const AdaptivityField* field, const IndexToWorld& placement)
      : FieldEvaluator(field, placement), base_(placement.base) {}

  bool is_constant() const { return !simplifies_outside() && !leaves_out_outside() && !has_scale(); }
  bool simplifies() const { return simplifies_outside(); }
  /// Returns true if the mesh is to be open at a position: it is outside of the mask, and the field excludes
  /// everything there.
  bool leaves_out(const Eigen::Vector3d& p) const;
  /// Returns the tolerance at a position, in voxels, for a requested `tolerance`.
  float tolerance(const Eigen::Vector3d& p, double tolerance) const;

 private:
  struct Cell;
  Cell cell_at(const Eigen::Vector3d& p) const;
  bool in_mask(const Eigen::Vector3d& p) const;

  const std::array<std::int32_t, 3> base_;
};

/// A mesh of vertices in index space, relative to the placement's base.
struct CertifiedPolygons {
  std::vector<Eigen::Vector3d> points;
  std::vector<Triangle> triangles;
  LargeArray<Quad> quads;
  /// Empty, or a flag for each triangle of all_triangles(): 1 if it represents polygons within the mask, even
  /// if its middle is outside.
  std::vector<std::uint8_t> shown;
};

/// Returns the triangles, then two of each quad, cut along diagonal 0–2.
std::vector<Triangle> all_triangles(std::vector<Triangle> triangles, const LargeArray<Quad>& quads);

/// Fills `shown`. `is_shown` is called with a triangle, one of its corners (0 to 2), and the corner's vertex;
/// a triangle is shown if one of its corners is.
void show(CertifiedPolygons& polygons, const std::function<bool(std::size_t, int, std::uint32_t)>& is_shown);

/// Records the uniform mesh's counts as statistics of the run.
void report(const UniformCounts& counts, RunContext& context);

/// Returns the uniform mesh itself, for tolerance 0.
CertifiedPolygons as_they_are(UniformMesh uniform);

/// Returns the mesh in the precision of a file, without the triangles that the field excludes: those with
/// their middle outside of the mask that are not `shown`. A quad that is plane except for rounding, concave,
/// and proved along the diagonal outside becomes its two triangles, so that every reader gets the same
/// surface.
PolygonMesh finished(CertifiedPolygons polygons, const FieldAtPoints& field, const FilePoints& file,
                     RunContext& context);

/// Returns the options `tolerance` and `tolerance_world` of both extractors.
std::vector<OptionSpec> tolerance_options();
/// Returns the tolerance in voxels that these options request.
double asked_tolerance(const Options& options, const IndexToWorld& placement);

/// Calls `contour` with the input's Hermite data and the tolerance of its options in voxels. `name` is the
/// extractor's, for messages.
/// @throws Error as hermite_input() does, and any exception of `contour`
PolygonMesh contour_certified(
    const ExtractionInput& input, std::string_view name, bool needs_normals,
    const std::function<PolygonMesh(const HermiteView&, double tolerance)>& contour);

}  // namespace hermesh
