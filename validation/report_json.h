// The report as JSON, for scripts and result rows.
#pragma once

#include <nlohmann/json.hpp>

#include "validation/mesh_report.h"

namespace hermesh::validation {

/// Returns one flat object with a key for each count and measure: `points triangles quads
/// boundary_edges non_manifold_edges non_manifold_vertices inconsistent_edges degenerate_polygons
/// duplicate_polygons isolated_points components euler_characteristic genus inside_out_components
/// self_intersecting_pairs volume area smallest_angle worst_aspect`. Null represents values that were
/// not requested (self_intersecting_pairs), are undefined (genus, inside_out_components) or infinite
/// (worst_aspect). If requested, also:
///  - to_reference, from_reference: {max, mean, rms, worst, samples};
///  - certified_to_reference, certified_from_reference: {lower, upper};
///  - features: {edges, corners, edges_excluded, edge_length, edge_to_mesh, corner_to_mesh}, the last two as
///    to_reference;
///  - solid: {verdict ("same", "differs", "unknown"), symmetric_difference, difference_percent (of the
///    reference's volume), unexplained, unknown_volume, mesh_volume, reference_volume, mesh_area,
///    reference_area, possible_area, mesh_components, reference_components, false_area, lost_area, explained,
///    samples, places}, with {value, lower, upper} for sampled values;
///  - self_intersections: {disjoint, vertex_sharing, edge_sharing};
///  - libraries: by name {loaded, refusal, boundary_edges, …, disagreements};
/// and always closed, manifold, oriented, watertight (null unless self-intersections were searched for),
/// sentences, and places: by the name of the count, a list of {point, polygons}. All lengths are in world
/// units.
nlohmann::json to_json(const MeshReport& report);
/// Returns the member `solid` of a report.
nlohmann::json to_json(const SolidComparison& solid);

}  // namespace hermesh::validation
