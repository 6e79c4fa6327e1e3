// hermesh::remesh_within(): what the program does for remesh --error and --triangles.
#include "algorithms/remesh/bounded_remesh.h"
#include "hermesh/extract.h"
#include "packages/cpp/inside.h"

namespace hermesh::v1 {
namespace {

SignRule sign_rule(const std::string& signs) {
  if (signs == "winding-number") return SignRule::winding_number;
  if (signs == "flood-fill") return SignRule::flood_fill;
  if (signs == "auto") return SignRule::automatic;
  throw hermesh::Error(
      "signs must be winding-number, flood-fill or auto, for a bound needs an inside, not '" + signs + "'");
}

}  // namespace

BoundedRemesh remesh_within(const Mesh& mesh, const BoundOptions& options, Context& context) {
  return run(context, [&](RunContext& inner) {
    if (options.error.has_value() == options.triangles.has_value())
      throw hermesh::Error("give either an error or a number of triangles");
    const BoundedRemeshOptions given{.error = options.error.value_or(0.0),
                                     .signs = sign_rule(options.signs),
                                     .over_holes = options.over_holes,
                                     .most_points = options.most_points,
                                     .smallest_voxel = options.smallest_voxel,
                                     .written_in_single = options.written_in_single};
    PolygonMesh copy;
    const PolygonMesh& polygons = Inside::sampled(mesh, copy);
    BoundedMesh made = options.triangles ? remesh_to_budget(polygons, *options.triangles, given, inner)
                                         : bounded_remesh(polygons, given, inner);
    if (!made.unmet.empty()) throw hermesh::Error(explanation(made));
    // The program says the same (experiments/cli/bounded.cpp).
    for (const std::string& note : notes(made)) inner.note(note);
    return BoundedRemesh{.mesh = Inside::mesh(std::move(made.mesh)),
                         .error = made.error,
                         .to_polygons = made.to_surface,
                         .from_polygons = made.from_surface,
                         .voxel_size = made.voxel_size};
  });
}

}  // namespace hermesh::v1
