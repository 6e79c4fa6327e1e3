#include "experiments/cli/report_text.h"

#include <sstream>

#include "experiments/cli/format.h"
#include "validation/report_json.h"

namespace hermesh::cli {
namespace {

using validation::Distances;
using validation::HausdorffBound;
using validation::LibraryCounts;
using validation::MeshReport;
using validation::Places;

class Lines {
 public:
  void line(const std::string& name, const std::string& value) {
    constexpr std::size_t kNameWidth = 24;
    out_ << name << std::string(name.size() < kNameWidth ? kNameWidth - name.size() : 1, ' ') << value
         << '\n';
  }
  void count(const std::string& name, std::int64_t value) { line(name, std::to_string(value)); }
  void offenders(const std::string& name, std::int64_t value, const Places& places) {
    count(name, value);
    for (std::size_t i = 0; i < places.points.size(); ++i) {
      std::string where = "at " + hermesh::cli::text(places.points[i]);
      if (i < places.polygons.size()) where += polygons_text(places.polygons[i]);
      line("", where);
    }
  }
  void plain(const std::string& sentence) { out_ << sentence << '\n'; }
  std::string str() const { return out_.str(); }

 private:
  static std::string polygons_text(const std::array<std::int64_t, 2>& polygons) {
    if (polygons[0] < 0) return "";
    if (polygons[1] < 0) return ", polygon " + std::to_string(polygons[0]);
    return ", polygons " + std::to_string(polygons[0]) + " and " + std::to_string(polygons[1]);
  }
  std::ostringstream out_;
};

std::string distances_text(const Distances& distances) {
  return "max " + text(distances.max) + " at " + text(distances.worst) + ", mean " + text(distances.mean) +
         ", rms " + text(distances.rms) + ", " + std::to_string(distances.samples) + " samples";
}

std::string bound_text(const HausdorffBound& bound) {
  return "from " + text(bound.lower) + " to " + text(bound.upper) + ", certified";
}

void add_counts(Lines& lines, const MeshReport& report) {
  lines.count("points", report.points);
  lines.count("triangles", report.triangles);
  lines.count("quads", report.quads);
  lines.offenders("boundary edges", report.boundary_edges, report.boundary_places);
  lines.offenders("non-manifold edges", report.non_manifold_edges, report.non_manifold_edge_places);
  lines.offenders("non-manifold vertices", report.non_manifold_vertices, report.non_manifold_vertex_places);
  lines.offenders("inconsistent edges", report.inconsistent_edges, report.inconsistent_places);
  if (report.inside_out_components)
    lines.offenders("components inside out", *report.inside_out_components, report.inside_out_places);
  lines.offenders("degenerate polygons", report.degenerate_polygons, report.degenerate_places);
  lines.offenders("duplicate polygons", report.duplicate_polygons, report.duplicate_places);
  lines.count("isolated points", report.isolated_points);
  lines.count("components", report.components);
  lines.count("Euler characteristic", report.euler_characteristic);
  lines.line("genus", report.genus ? text(*report.genus) : "none: not closed, manifold and oriented");
  if (const auto& pairs = report.self_intersections) {
    lines.offenders("intersecting pairs", pairs->pairs, pairs->places);
    if (pairs->pairs > 0)
      lines.line("", std::to_string(pairs->disjoint) + " apart, " + std::to_string(pairs->vertex_sharing) +
                         " sharing a vertex, " + std::to_string(pairs->edge_sharing) + " sharing an edge");
  }
}

std::string estimate_text(const validation::Estimate& e) {
  return text(e.value) + ", between " + text(e.lower) + " and " + text(e.upper);
}

void add_solid(Lines& lines, const validation::SolidComparison& solid) {
  lines.line("symmetric difference", estimate_text(solid.difference));
  lines.line("", "of it unexplained by a distance of " + text(solid.explained) + ": " +
                     estimate_text(solid.unexplained));
  lines.line("reference's solid", "volume " + estimate_text(solid.reference_volume));
  lines.line("", "unknown volume " + estimate_text(solid.unknown_volume));
  lines.line("", "outer boundary of area " + text(solid.reference_area) +
                     (solid.possible_area > 0.0 ? " and perhaps " + text(solid.possible_area) : "") + " in " +
                     std::to_string(solid.reference_components) + " components; the mesh: " +
                     text(solid.mesh_area) + " in " + std::to_string(solid.mesh_components));
  lines.line("wrong area of the mesh", estimate_text(solid.false_area));
  lines.line("lost area", estimate_text(solid.lost_area));
}

void add_measures(Lines& lines, const MeshReport& report) {
  lines.line("volume", text(report.volume));
  lines.line("area", text(report.area));
  lines.line("smallest angle", text(report.smallest_angle) + " degrees");
  lines.line("worst aspect ratio", text(report.worst_aspect));
  if (report.to_reference) lines.line("to the reference", distances_text(*report.to_reference));
  if (report.certified_to_reference) lines.line("", bound_text(*report.certified_to_reference));
  if (report.from_reference) lines.line("from the reference", distances_text(*report.from_reference));
  if (report.certified_from_reference) lines.line("", bound_text(*report.certified_from_reference));
  if (report.solid) add_solid(lines, *report.solid);
  if (const auto& features = report.features) {
    lines.line("sharp edges", std::to_string(features->edges) + " of length " + text(features->edge_length) +
                                  "; " + std::to_string(features->edges_excluded) +
                                  " left out, part of a smooth blend");
    lines.line("", distances_text(features->edge_to_mesh));
    lines.count("sharp corners", features->corners);
    lines.line("", distances_text(features->corner_to_mesh));
  }
}

void add_libraries(Lines& lines, const MeshReport& report) {
  for (const LibraryCounts& library : report.libraries) {
    if (!library.loaded)
      lines.line(library.library, "cannot load the mesh: " + library.refusal);
    else
      lines.line(library.library, library.disagreements.empty() ? "agrees" : "disagrees");
    for (const std::string& sentence : library.disagreements) lines.line("", sentence);
  }
}

}  // namespace

std::string report_text(const MeshReport& report, const std::string& file,
                        const std::vector<std::string>& unmet) {
  Lines lines;
  lines.line("mesh", file);
  add_counts(lines, report);
  add_measures(lines, report);
  add_libraries(lines, report);
  lines.plain("");
  for (const std::string& sentence : report.sentences()) lines.plain(sentence);
  for (const std::string& name : unmet) lines.plain("Required but not met: " + name + ".");
  return lines.str();
}

nlohmann::json report_json(const MeshReport& report, const std::string& file,
                           const std::vector<std::string>& unmet) {
  nlohmann::json json = validation::to_json(report);
  json["mesh"] = file;
  json["unmet_requirements"] = unmet;
  return json;
}

}  // namespace hermesh::cli
