#include "validation/report_json.h"

#include <cmath>

namespace hermesh::validation {
namespace {

using Json = nlohmann::json;

Json finite_or_null(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json vector(const Eigen::Vector3d& v) {
  return Json::array({finite_or_null(v.x()), finite_or_null(v.y()), finite_or_null(v.z())});
}

Json distances(const Distances& d) {
  return {{"max", finite_or_null(d.max)},
          {"mean", finite_or_null(d.mean)},
          {"rms", finite_or_null(d.rms)},
          {"worst", vector(d.worst)},
          {"samples", d.samples}};
}

Json places(const Places& p) {
  Json list = Json::array();
  for (std::size_t i = 0; i < p.points.size(); ++i) {
    Json polygons = Json::array({p.polygons[i][0]});
    if (p.polygons[i][1] >= 0) polygons.push_back(p.polygons[i][1]);
    list.push_back({{"point", vector(p.points[i])}, {"polygons", polygons}});
  }
  return list;
}

Json all_places(const MeshReport& r) {
  Json all = Json::object();
  const auto add = [&all](const char* key, const Places& p) {
    if (!p.points.empty()) all[key] = places(p);
  };
  add("boundary_edges", r.boundary_places);
  add("non_manifold_edges", r.non_manifold_edge_places);
  add("non_manifold_vertices", r.non_manifold_vertex_places);
  add("inconsistent_edges", r.inconsistent_places);
  add("inside_out_components", r.inside_out_places);
  add("degenerate_polygons", r.degenerate_places);
  add("duplicate_polygons", r.duplicate_places);
  if (r.self_intersections) add("self_intersecting_pairs", r.self_intersections->places);
  return all;
}

Json library(const LibraryCounts& l) {
  Json json = {{"loaded", l.loaded}, {"disagreements", l.disagreements}};
  if (!l.loaded) {
    json["refusal"] = l.refusal;
    return json;
  }
  json["boundary_edges"] = l.boundary_edges;
  json["components"] = l.components;
  json["euler_characteristic"] = l.euler_characteristic;
  json["volume"] = finite_or_null(l.volume);
  json["area"] = finite_or_null(l.area);
  return json;
}

Json features(const FeatureDistances& f) {
  return {{"edges", f.edges},
          {"corners", f.corners},
          {"edges_excluded", f.edges_excluded},
          {"edge_length", finite_or_null(f.edge_length)},
          {"edge_to_mesh", distances(f.edge_to_mesh)},
          {"corner_to_mesh", distances(f.corner_to_mesh)}};
}

Json bound(const HausdorffBound& b) {
  return {{"lower", finite_or_null(b.lower)}, {"upper", finite_or_null(b.upper)}};
}

Json estimate(const Estimate& e) {
  return {{"value", finite_or_null(e.value)},
          {"lower", finite_or_null(e.lower)},
          {"upper", finite_or_null(e.upper)}};
}

Json visible_loss(const VisibleLoss& v) {
  return {{"lost_share", estimate(v.lost)},
          {"vanished_share", estimate(v.vanished)},
          {"filled_share", estimate(v.filled)},
          {"invented_share", estimate(v.invented)},
          {"visible_area", finite_or_null(v.visible_area)},
          {"invented_area", finite_or_null(v.invented_area)},
          {"samples", v.samples}};
}

Json counts(const MeshReport& r) {
  Json json = {{"points", r.points},
               {"triangles", r.triangles},
               {"quads", r.quads},
               {"boundary_edges", r.boundary_edges},
               {"non_manifold_edges", r.non_manifold_edges},
               {"non_manifold_vertices", r.non_manifold_vertices},
               {"inconsistent_edges", r.inconsistent_edges},
               {"degenerate_polygons", r.degenerate_polygons},
               {"duplicate_polygons", r.duplicate_polygons},
               {"isolated_points", r.isolated_points},
               {"components", r.components},
               {"euler_characteristic", r.euler_characteristic}};
  json["genus"] = nullptr;
  if (r.genus && *r.genus == std::floor(*r.genus))
    json["genus"] = std::int64_t(*r.genus);
  else if (r.genus)
    json["genus"] = *r.genus;
  json["inside_out_components"] = r.inside_out_components ? Json(*r.inside_out_components) : Json(nullptr);
  json["self_intersecting_pairs"] = r.self_intersections ? Json(r.self_intersections->pairs) : Json(nullptr);
  json["volume"] = finite_or_null(r.volume);
  json["area"] = finite_or_null(r.area);
  json["smallest_angle"] = finite_or_null(r.smallest_angle);
  json["worst_aspect"] = finite_or_null(r.worst_aspect);
  return json;
}

}  // namespace

nlohmann::json to_json(const SolidComparison& s) {
  Json places = Json::object();
  if (s.false_place) places["false_area"] = vector(*s.false_place);
  if (s.lost_place) places["lost_area"] = vector(*s.lost_place);
  if (s.unexplained_place) places["unexplained"] = vector(*s.unexplained_place);
  return {{"verdict", verdict_word(s)},
          {"symmetric_difference", estimate(s.difference)},
          {"difference_percent", s.reference_volume.value > 0.0
                                     ? finite_or_null(100.0 * s.difference.value / s.reference_volume.value)
                                     : Json(nullptr)},
          {"unexplained", estimate(s.unexplained)},
          {"unknown_volume", estimate(s.unknown_volume)},
          {"mesh_volume", estimate(s.mesh_volume)},
          {"reference_volume", estimate(s.reference_volume)},
          {"mesh_area", finite_or_null(s.mesh_area)},
          {"reference_area", finite_or_null(s.reference_area)},
          {"possible_area", finite_or_null(s.possible_area)},
          {"mesh_components", s.mesh_components},
          {"reference_components", s.reference_components},
          {"false_area", estimate(s.false_area)},
          {"lost_area", estimate(s.lost_area)},
          {"explained", finite_or_null(s.explained)},
          {"samples", s.samples},
          {"places", places}};
}

nlohmann::json to_json(const MeshReport& r) {
  Json json = counts(r);
  json["closed"] = r.closed();
  json["manifold"] = r.manifold();
  json["oriented"] = r.oriented();
  json["watertight"] = r.self_intersections ? Json(r.watertight()) : Json(nullptr);
  if (r.to_reference) json["to_reference"] = distances(*r.to_reference);
  if (r.from_reference) json["from_reference"] = distances(*r.from_reference);
  if (r.normals_to_reference)
    json["normals_to_reference"] = {{"mean", finite_or_null(r.normals_to_reference->mean)},
                                    {"rms", finite_or_null(r.normals_to_reference->rms)},
                                    {"max", finite_or_null(r.normals_to_reference->max)},
                                    {"samples", r.normals_to_reference->samples}};
  if (r.certified_to_reference) json["certified_to_reference"] = bound(*r.certified_to_reference);
  if (r.certified_from_reference) json["certified_from_reference"] = bound(*r.certified_from_reference);
  if (r.features) json["features"] = features(*r.features);
  if (r.solid) json["solid"] = to_json(*r.solid);
  if (r.visible) json["visible_loss"] = visible_loss(*r.visible);
  if (r.self_intersections)
    json["self_intersections"] = {{"disjoint", r.self_intersections->disjoint},
                                  {"vertex_sharing", r.self_intersections->vertex_sharing},
                                  {"edge_sharing", r.self_intersections->edge_sharing}};
  if (!r.libraries.empty()) {
    json["libraries"] = Json::object();
    for (const LibraryCounts& l : r.libraries) json["libraries"][l.library] = library(l);
  }
  json["places"] = all_places(r);
  json["sentences"] = r.sentences();
  return json;
}

}  // namespace hermesh::validation
