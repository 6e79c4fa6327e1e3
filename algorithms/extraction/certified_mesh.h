// What the two certified extractors share, `manifold-dual-contouring` (certified_collapse/) and
// `certified-octree` (certified_octree/): their bounds, a field that scales them, and the way from polygons
// of index space to the mesh.
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

/// Tolerance outside of a mask that asks for simplification there, in voxels; topology and freedom from
/// self-intersection hold there, too.
inline constexpr double kSimplifiedTolerance = 8.0;

/// An adaptivity field at single places of index space, relative to the placement's base.
class FieldAtPoints {
 public:
  /// `field` may be null, for none; `placement` is that of the volume whose index space the places are in.
  /// @throws Error as FieldEvaluator's constructor does
  FieldAtPoints(const AdaptivityField* field, const IndexToWorld& placement)
      : evaluator_(field, placement), base_(placement.base) {}

  bool is_constant() const {
    return !evaluator_.simplifies_outside() && !evaluator_.leaves_out_outside() && !evaluator_.has_scale();
  }
  bool simplifies() const { return evaluator_.simplifies_outside(); }
  bool leaves_out_outside() const { return evaluator_.leaves_out_outside(); }
  /// Whether the mesh is to be open at the place: the cell that holds it is outside of the mask, and the
  /// field asks for nothing there.
  bool leaves_out(const Eigen::Vector3d& p) const;
  /// The tolerance that holds at a place, where `tolerance` was asked for, in voxels.
  float tolerance(const Eigen::Vector3d& p, double tolerance) const;

 private:
  struct Cell;
  Cell cell_at(const Eigen::Vector3d& p) const;
  bool in_mask(const Cell& cell) const;

  const FieldEvaluator evaluator_;
  const std::array<std::int32_t, 3> base_;
};

/// A mesh in the making: points of index space, relative to the placement's base, and polygons between them.
struct CertifiedPolygons {
  std::vector<Eigen::Vector3d> points;
  std::vector<Triangle> triangles;
  LargeArray<Quad> quads;
  /// An entry for each triangle and two for each quad after them, or none at all: whether it stands for
  /// polygons within the mask, wherever its middle is.
  std::vector<std::uint8_t> shown;
};

/// Triangles as given, then two of each quad, cut between its corners 0 and 2.
std::vector<Triangle> all_triangles(std::vector<Triangle> triangles, const LargeArray<Quad>& quads);

/// Fills `shown`. `is_shown` is called with the number of a triangle, which of its corners (0 to 2), and the
/// corner's point; a triangle is shown if one of its corners is.
void show(CertifiedPolygons& polygons, const std::function<bool(std::size_t, int, std::uint32_t)>& is_shown);

/// Records the uniform mesh's counts as figures of the run.
void report(const UniformCounts& counts, RunContext& context);

/// The uniform mesh itself, for a tolerance of 0.
CertifiedPolygons as_they_are(UniformMesh uniform);

/// The mesh as a file will hold it, without what the field leaves out: a triangle of the uniform mesh whose
/// middle lies outside of the mask, and a merged one (`shown`) that stands for nothing within. A quad that is
/// plane but for rounding, concave, and proved along the diagonal outside becomes its two triangles, so that
/// it means the same to every reader.
PolygonMesh finished(CertifiedPolygons polygons, const FieldAtPoints& field, const FilePoints& file,
                     RunContext& context);

/// The entries `tolerance` and `tolerance_world` of both tables.
std::vector<OptionSpec> tolerance_options();

/// Calls `contour` with the input's Hermite data and the tolerance in voxels that its options ask for. `name`
/// is the extractor's, for messages.
/// @throws Error as hermite_input() does, and what `contour` throws
PolygonMesh contour_certified(
    const ExtractionInput& input, std::string_view name, bool needs_normals,
    const std::function<PolygonMesh(const HermiteView&, double tolerance)>& contour);

}  // namespace hermesh
