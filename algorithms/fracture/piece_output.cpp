#include "algorithms/fracture/piece_output.h"

#include <Eigen/Geometry>
#include <cmath>

#include "algorithms/core/run_context.h"
#include "algorithms/fracture/piece_attributes.h"
#include "algorithms/search/transfer_attributes.h"

namespace hermesh {
namespace {

const std::vector<std::int32_t>* whole_numbers_if_any(const PolygonMesh& mesh, const char* name) {
  for (const MeshAttribute& a : mesh.attributes)
    if (a.name == name && a.domain == AttributeDomain::polygon)
      return std::get_if<std::vector<std::int32_t>>(&a.values);
  return nullptr;
}

}  // namespace

void measure_piece(PieceOutput& piece) {
  piece.mass = mass_properties(piece.mesh);
  // Pieces of methods without tags do not specify the pieces beyond their triangles.
  const auto* neighbour = whole_numbers_if_any(piece.mesh, "neighbour");
  if (!neighbour) return;
  for (std::size_t t = 0; t < piece.mesh.triangles.size(); ++t) {
    if ((*neighbour)[t] < 0) continue;
    auto& [triangles, area] = piece.neighbours[(*neighbour)[t]];
    const auto at = [&](int c) {
      return Eigen::Vector3d(piece.mesh.points[piece.mesh.triangles[t][c]].cast<double>());
    };
    ++triangles;
    area += 0.5 * (at(1) - at(0)).cross(at(2) - at(0)).norm();
  }
}

LabelledFracture labelled_pieces(const FloatHermite& object, const Cutters& cutters,
                                 const FractureOptions& options, const PolygonMesh* source,
                                 const HandOver& hand_over, RunContext& context) {
  LabelledFracture fracture = labelled_fracture(object, cutters, options, context);
  // The edge of a cube of a voxel's volume, which a transform may have stretched.
  const double voxel = std::cbrt(std::abs(object.placement.linear.determinant()));
  std::optional<SourceAttributes> attributes;
  if (source) attributes.emplace(*source, voxel);
  const std::uint32_t count = fracture.piece_count();
  for (std::uint32_t number = 1; number <= count; ++number) {
    context.check();
    PieceOutput piece;
    Stopwatch watch;
    piece.name = fracture.names[number];
    piece.samples = fracture.samples[number];
    piece.mesh = piece_mesh(fracture.mesh, fracture.pieces->of(number));
    add_cut_uv(piece.mesh, [&](std::int32_t other) {
      return cutters.plane_between(fracture.codes[number], fracture.codes[static_cast<std::size_t>(other)]);
    });
    if (attributes) attributes->add_to(piece.mesh, context);
    piece.extraction_seconds = watch.seconds();
    context.progress("pieces", double(number) / double(count));
    hand_over(std::move(piece));
  }
  fracture.mesh = {};
  fracture.pieces.reset();
  return fracture;
}

}  // namespace hermesh
