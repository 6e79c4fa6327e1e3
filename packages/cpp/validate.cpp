// Validation of meshes.
#include "hermesh/validate.h"

#include <cmath>

#include "algorithms/io/mesh_file.h"
#include "packages/cpp/inside.h"
#include "validation/fracture_report.h"
#include "validation/mesh_report.h"
#include "validation/report_json.h"

namespace hermesh::v1 {
namespace {

std::array<double, 3> place(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

std::optional<SurfaceDistances> distances(const std::optional<validation::Distances>& d) {
  if (!d) return std::nullopt;
  return SurfaceDistances{d->max, d->mean, d->rms, place(d->worst)};
}

std::optional<HausdorffBracket> bracket(const std::optional<validation::HausdorffBound>& b) {
  if (!b) return std::nullopt;
  return HausdorffBracket{b->lower, b->upper};
}

void add_defect(Report& report, const char* name, std::int64_t count, const validation::Places& places) {
  if (count == 0) return;
  Defect defect{name, count, {}};
  for (std::size_t i = 0; i < places.points.size(); ++i)
    defect.places.push_back({place(places.points[i]), places.polygons[i]});
  report.defects.push_back(std::move(defect));
}

Report report_of(const validation::MeshReport& r) {
  Report report;
  report.points = r.points, report.triangles = r.triangles, report.quads = r.quads;
  report.boundary_edges = r.boundary_edges;
  report.non_manifold_edges = r.non_manifold_edges;
  report.non_manifold_vertices = r.non_manifold_vertices;
  report.inconsistent_edges = r.inconsistent_edges;
  report.degenerate_polygons = r.degenerate_polygons;
  report.duplicate_polygons = r.duplicate_polygons;
  report.isolated_points = r.isolated_points;
  report.components = r.components;
  report.euler_characteristic = r.euler_characteristic;
  report.genus = r.genus;
  report.volume = r.volume, report.area = r.area;
  report.smallest_angle = r.smallest_angle;
  report.worst_aspect = r.worst_aspect;
  report.to_reference = distances(r.to_reference);
  report.from_reference = distances(r.from_reference);
  report.certified_to_reference = bracket(r.certified_to_reference);
  report.certified_from_reference = bracket(r.certified_from_reference);
  if (r.solid) report.solid = verdict_word(*r.solid);
  add_defect(report, "boundary_edges", r.boundary_edges, r.boundary_places);
  add_defect(report, "non_manifold_edges", r.non_manifold_edges, r.non_manifold_edge_places);
  add_defect(report, "non_manifold_vertices", r.non_manifold_vertices, r.non_manifold_vertex_places);
  add_defect(report, "inconsistent_edges", r.inconsistent_edges, r.inconsistent_places);
  add_defect(report, "inside_out_components", r.inside_out_components.value_or(0), r.inside_out_places);
  add_defect(report, "degenerate_polygons", r.degenerate_polygons, r.degenerate_places);
  add_defect(report, "duplicate_polygons", r.duplicate_polygons, r.duplicate_places);
  if (r.self_intersections) {
    report.self_intersecting_pairs = r.self_intersections->pairs;
    add_defect(report, "self_intersecting_pairs", r.self_intersections->pairs, r.self_intersections->places);
  }
  report.sentences = r.sentences();
  report.json = validation::to_json(r).dump(2);
  return report;
}

std::optional<MeshFile> file_of(const Mesh* mesh) {
  if (!mesh) return std::nullopt;
  return to_mesh_file(Inside::polygons(*mesh));
}

}  // namespace

Report validate(const Mesh& mesh, const ValidateOptions& options, Context& context) {
  return run(context, [&](RunContext& inner) {
    require(!options.certify || options.reference, "certify bounds the distance to a reference: give one");
    require(options.voxel_size >= 0.0 && std::isfinite(options.voxel_size),
            "the voxel size must be a number of at least 0");
    require(options.voxel_size == 0.0 || options.reference,
            "the voxel size explains distances to a reference: give one");
    require(options.samples >= 1 && options.samples <= 1'000'000'000,
            "the number of samples must be from 1 to 1000000000");
    require(options.dihedral >= 0.0 && options.dihedral <= 180.0,
            "the dihedral angle must be from 0 to 180 degrees");
    const MeshFile judged = to_mesh_file(Inside::polygons(mesh));
    const std::optional<MeshFile> reference = file_of(options.reference),
                                  features = file_of(options.features);
    validation::CheckOptions chosen;
    chosen.self_intersections = options.self_intersections;
    chosen.libraries = options.libraries;
    chosen.reference = reference ? &*reference : nullptr;
    chosen.features = features ? &*features : nullptr;
    chosen.samples = options.samples;
    chosen.certify = options.certify;
    chosen.dihedral_degrees = options.dihedral;
    chosen.voxel_size = options.voxel_size;
    return report_of(validation::check_mesh(judged, chosen, inner));
  });
}

FractureReport validate_fracture(const std::vector<Mesh>& pieces, Context& context) {
  return run(context, [&](RunContext& inner) {
    std::vector<MeshFile> files;
    for (const Mesh& piece : pieces) files.push_back(to_mesh_file(Inside::polygons(piece)));
    const validation::FractureReport ledger = validation::check_fracture(files, inner);
    return FractureReport{.consistent = ledger.is_consistent(),
                          .pieces = ledger.pieces,
                          .triangles = ledger.triangles,
                          .seam_triangles = ledger.seam_triangles,
                          .unmatched_cut = ledger.unmatched_cut,
                          .intersecting_pairs = ledger.intersecting_pairs,
                          .broken_pieces = ledger.broken_pieces,
                          .pieces_volume = ledger.pieces_volume,
                          .sentences = ledger.sentences()};
  });
}

}  // namespace hermesh::v1
