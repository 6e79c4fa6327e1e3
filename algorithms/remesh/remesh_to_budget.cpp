#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "algorithms/remesh/bounded_remesh.h"

namespace hermesh {

BoundedMesh remesh_to_budget(const PolygonMesh& mesh, std::size_t triangles,
                             const BoundedRemeshOptions& options, RunContext& context) {
  constexpr int kTries = 12;
  const double extent = bounds(mesh).size().norm();
  // On a smooth surface the triangles are in inverse proportion to the error; a sphere's 0.01 of the extent
  // needs some hundreds.
  BoundedRemeshOptions now = options;
  now.error = std::clamp(3.0 * extent / double(triangles), 1e-5 * extent, 0.1 * extent);
  double too_small = 0.0, enough = std::numeric_limits<double>::infinity();
  std::optional<BoundedMesh> best, refused;
  for (int i = 0; i < kTries; ++i) {
    BoundedMesh made = bounded_remesh(mesh, now, context);
    if (!made.unmet.empty()) {
      if (best) break;
      // A larger error may be kept where this one is not: what is thin then need not show.
      too_small = now.error;
      refused = std::move(made);
      if (too_small >= 0.5 * extent) break;
      now.error =
          std::min(std::isfinite(enough) ? std::sqrt(too_small * enough) : 2.0 * too_small, 0.5 * extent);
      continue;
    }
    const double count = double(made.mesh.triangle_count());
    if (count <= double(triangles)) {
      enough = now.error;
      best = std::move(made);
      if (count >= 0.9 * double(triangles)) break;
    } else {
      too_small = now.error;
    }
    if (too_small >= 0.5 * extent) break;
    // The law of inverse proportion, within what earlier tries leave open; where it leads out of that, their
    // middle.
    double next = now.error * std::clamp(count / (0.95 * double(triangles)), 0.1, 10.0);
    if (next <= too_small || next >= enough)
      next = std::isfinite(enough) ? std::sqrt(too_small * enough) : 2.0 * too_small;
    if (too_small > 0.0 && enough / too_small < 1.02) break;
    now.error = std::min(next, 0.5 * extent);
  }
  if (!best && refused) return std::move(*refused);
  if (!best)
    throw Error("no mesh with at most " + std::to_string(triangles) +
                " triangles was found that is within half of the polygons' extent of them; allow more");
  return std::move(*best);
}

}  // namespace hermesh
