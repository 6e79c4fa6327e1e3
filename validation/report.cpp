#include <tbb/parallel_invoke.h>

#include <sstream>

#include "validation/distance.h"
#include "validation/features.h"
#include "validation/hausdorff.h"
#include "validation/library_counts.h"
#include "validation/measures.h"
#include "validation/mesh_report.h"
#include "validation/normal_error.h"
#include "validation/self_intersection.h"
#include "validation/topology.h"

namespace hermesh::validation {
namespace {

// Readers of files check this, too; a mesh that was made in memory comes here unchecked.
void check_input(const MeshFile& mesh, const std::string& name) {
  for (std::size_t p = 0; p < mesh.points.size(); ++p)
    if (!mesh.points[p].allFinite())
      throw Error("point " + std::to_string(p) + " of " + name +
                  " has a coordinate that is not a finite number; repair the mesh before it is judged");
  const std::size_t points = mesh.points.size();
  for (std::int64_t p = 0; p < polygon_count(mesh); ++p)
    for (std::uint32_t corner : polygon_corners(mesh, p).points)
      if (corner >= points)
        throw Error("polygon " + std::to_string(p) + " of " + name + " refers to point " +
                    std::to_string(corner) + ", but there are only " + std::to_string(points) + " points");
}

void check_reference(const MeshFile* mesh, const std::string& name) {
  if (!mesh) return;
  check_input(*mesh, name);
  if (polygon_count(*mesh) == 0) throw Error(name + " holds no polygon; give a reference with a surface");
}

void count_with_libraries(const MeshFile& mesh, MeshReport& report, RunContext& context) {
  const Stage stage(context, "library counts");
  LibraryCounts openmesh, cgal;
  tbb::parallel_invoke([&] { openmesh = count_with_openmesh(mesh, report, context); },
                       [&] { cgal = count_with_cgal(mesh, report, context); });
  report.libraries = {std::move(openmesh), std::move(cgal)};
}

void measure_distances(const TriangleSoup& soup, const TriangleTree& tree, const JudgeOptions& options,
                       MeshReport& report, RunContext& context) {
  const TriangleSoup reference(*options.reference);
  const TriangleTree reference_tree(reference);
  {
    const Stage stage(context, "distances");
    report.to_reference = sampled_distances(soup, reference_tree, options.samples, context);
    report.from_reference = sampled_distances(reference, tree, options.samples, context);
    report.normals_to_reference = sampled_normal_angles(soup, reference_tree, options.samples, context);
  }
  if (!options.certify) return;
  const Stage stage(context, "certified distances");
  const double gap =
      options.certify_gap > 0.0 ? options.certify_gap : 1e-4 * reference_tree.bounds().diagonal();
  report.certified_to_reference = certified_distance(soup, reference_tree, gap, context);
  report.certified_from_reference = certified_distance(reference, tree, gap, context);
}

// What needs a surface to be there.
void judge_surface(const TriangleSoup& soup, const JudgeOptions& options, MeshReport& report,
                   RunContext& context) {
  const TriangleTree tree(soup);
  if (options.self_intersections) {
    const Stage stage(context, "self-intersections");
    report.self_intersections = find_self_intersections(soup, tree, context);
  }
  if (options.reference) measure_distances(soup, tree, options, report, context);
  if (options.features) {
    const Stage stage(context, "features");
    report.features =
        feature_distances(TriangleSoup(*options.features), tree, options.dihedral_degrees, context);
  }
}

std::string number(double value) {
  std::ostringstream text;
  text.precision(6);
  text << value;
  return text.str();
}

std::string counted(std::int64_t n, const std::string& one, const std::string& many) {
  return std::to_string(n) + " " + (n == 1 ? one : many);
}

// "; the first at (x, y, z), polygons 3 and 7"
std::string first_place(const Places& places) {
  if (places.points.empty()) return "";
  std::string text = "; the first at " + describe_point(places.points[0]) + ", polygon";
  const auto [one, other] = places.polygons[0];
  if (other < 0) return text + " " + std::to_string(one);
  return text + "s " + std::to_string(one) + " and " + std::to_string(other);
}

class Verdict {
 public:
  explicit Verdict(const MeshReport& report) : r_(report) {}

  std::vector<std::string> sentences() {
    overall();
    defects();
    for (const LibraryCounts& l : r_.libraries) library(l);
    notes();
    if (r_.to_reference) distance("the mesh to the reference", *r_.to_reference, r_.certified_to_reference);
    if (r_.from_reference)
      distance("the reference to the mesh", *r_.from_reference, r_.certified_from_reference);
    if (r_.features) features(*r_.features);
    return std::move(out_);
  }

 private:
  void say(const std::string& sentence) { out_.push_back(sentence + "."); }

  void overall() {
    if (r_.triangles + r_.quads == 0) return say("The mesh has no polygons");
    std::string text = "The mesh is ";
    text += r_.closed() ? "closed, " : "not closed, ";
    text += r_.manifold() ? "manifold, " : "not manifold, ";
    text += r_.oriented() ? "oriented" : "not oriented";
    if (!r_.self_intersections)
      text += "; it was not searched for self-intersections";
    else if (r_.watertight())
      text += " and free of self-intersections: it is watertight";
    else
      text +=
          r_.self_intersections->pairs == 0 ? " and free of self-intersections" : ", and intersects itself";
    say(text);
  }

  void defect(std::int64_t n, const std::string& one, const std::string& many, const Places& places) {
    if (n > 0) say(counted(n, one, many) + first_place(places));
  }

  void defects() {
    defect(r_.boundary_edges, "boundary edge", "boundary edges", r_.boundary_places);
    defect(r_.non_manifold_edges, "edge with more than two polygons", "edges with more than two polygons",
           r_.non_manifold_edge_places);
    defect(r_.non_manifold_vertices, "vertex with more than one fan of polygons",
           "vertices with more than one fan of polygons", r_.non_manifold_vertex_places);
    defect(r_.inconsistent_edges, "edge between polygons of opposite orientation",
           "edges between polygons of opposite orientation", r_.inconsistent_places);
    if (r_.self_intersections) intersections(*r_.self_intersections);
    defect(r_.degenerate_polygons, "degenerate polygon", "degenerate polygons", r_.degenerate_places);
    defect(r_.duplicate_polygons, "duplicate polygon", "duplicate polygons", r_.duplicate_places);
  }

  void intersections(const SelfIntersections& s) {
    if (s.pairs == 0) return;
    say(counted(s.pairs, "self-intersecting pair", "self-intersecting pairs") + " of triangles (" +
        std::to_string(s.disjoint) + " with no common point, " + std::to_string(s.vertex_sharing) +
        " that share a vertex, " + std::to_string(s.edge_sharing) + " that share an edge)" +
        first_place(s.places));
  }

  void library(const LibraryCounts& l) {
    if (l.disagreements.empty() && l.loaded) return say("The counts of " + l.library + " are the same");
    if (l.disagreements.empty())
      return say(l.library + " cannot load such a mesh, as expected: " + trimmed(l.refusal));
    for (const std::string& d : l.disagreements) say("Disagreement: " + trimmed(d));
  }

  static std::string trimmed(std::string sentence) {
    if (!sentence.empty() && sentence.back() == '.') sentence.pop_back();
    return sentence;
  }

  void notes() {
    if (r_.isolated_points > 0)
      say(counted(r_.isolated_points, "point is", "points are") + " used by no polygon");
    if (r_.genus && r_.volume < 0.0) say("The volume is negative: the surface is inside out");
  }

  void distance(const std::string& way, const Distances& d, const std::optional<HausdorffBound>& bound) {
    std::string text = "From " + way + ": at most " + number(d.max) + " (at " + describe_point(d.worst) +
                       "), " + number(d.mean) + " on average, rms " + number(d.rms) + " over " +
                       std::to_string(d.samples) + " samples";
    if (bound)
      text += "; the true maximum is between " + number(bound->lower) + " and " + number(bound->upper);
    say(text);
  }

  void features(const FeatureDistances& f) {
    if (f.edges == 0) return say("The reference has no sharp edge");
    std::string text = "From " + counted(f.edges, "sharp edge", "sharp edges") +
                       " of the reference to the mesh: " + number(f.edge_to_mesh.mean) +
                       " on average, at most " + number(f.edge_to_mesh.max);
    if (f.corners > 0)
      text += "; from " + counted(f.corners, "corner", "corners") + ": " + number(f.corner_to_mesh.mean) +
              " on average, at most " + number(f.corner_to_mesh.max);
    if (f.edges_excluded > 0)
      text +=
          "; " + counted(f.edges_excluded, "edge is", "edges are") + " left out as part of a smooth blend";
    say(text);
  }

  const MeshReport& r_;
  std::vector<std::string> out_;
};

}  // namespace

std::vector<std::string> MeshReport::sentences() const { return Verdict(*this).sentences(); }

MeshReport judge(const MeshFile& mesh, const JudgeOptions& options, RunContext& context) {
  check_input(mesh, "the mesh");
  check_reference(options.reference, "the reference mesh");
  check_reference(options.features, "the reference mesh for the features");
  MeshReport report;
  const TriangleSoup soup(mesh);
  {
    const Stage stage(context, "topology");
    count_topology(mesh, report, context);
    measure_triangles(mesh, soup, report, context);
  }
  if (options.libraries) count_with_libraries(mesh, report, context);
  if (!soup.triangles.empty())
    judge_surface(soup, options, report, context);
  else if (options.self_intersections)
    report.self_intersections.emplace();
  return report;
}

}  // namespace hermesh::validation
