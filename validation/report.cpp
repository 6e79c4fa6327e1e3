#include <tbb/parallel_invoke.h>

#include <cmath>
#include <limits>
#include <sstream>

#include "validation/features.h"
#include "validation/geometry/distance.h"
#include "validation/hausdorff.h"
#include "validation/library_counts.h"
#include "validation/mesh_report.h"
#include "validation/self_intersection.h"
#include "validation/solid.h"
#include "validation/solid_comparison.h"
#include "validation/topology.h"
#include "validation/visible_loss.h"

namespace hermesh::validation {
namespace {

// Applies the checks of the file readers to a mesh that was made in memory.
void check_input(const MeshFile& mesh, const std::string& name) {
  for (std::size_t p = 0; p < mesh.points.size(); ++p)
    if (!mesh.points[p].allFinite())
      throw Error("point " + std::to_string(p) + " of " + name +
                  " has a coordinate that is not a finite number; repair the mesh before it is validated");
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

void count_with_libraries(const MeshFile& mesh, double unit, MeshReport& report, RunContext& context) {
  const Stage stage(context, "library counts");
  LibraryCounts openmesh, cgal;
  tbb::parallel_invoke([&] { openmesh = count_with_openmesh(mesh, report, context, unit); },
                       [&] { cgal = count_with_cgal(mesh, report, context, unit); });
  report.libraries = {std::move(openmesh), std::move(cgal)};
}

void measure_distances(const TriangleSoup& soup, const TriangleTree& tree, const CheckOptions& options,
                       MeshReport& report, RunContext& context) {
  const TriangleSoup reference(*options.reference, options.reference_quads);
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
  // The search ends within the gap, below which a sample may be farther away than what it found.
  const auto certified = [&](const TriangleSoup& from, const TriangleTree& to, const Distances& sampled) {
    HausdorffBound bound = certified_distance(from, to, gap, context);
    bound.lower = std::max(bound.lower, std::min(sampled.max, bound.upper));
    return bound;
  };
  report.certified_to_reference = certified(soup, reference_tree, *report.to_reference);
  report.certified_from_reference = certified(reference, tree, *report.from_reference);
}

// Fills the results that require a surface with triangles.
void check_surface(const MeshFile& mesh, const TriangleSoup& soup, const CheckOptions& options,
                   MeshReport& report, RunContext& context) {
  const TriangleTree tree(soup);
  count_inside_out(soup, tree, report, context);
  if (options.self_intersections) {
    const Stage stage(context, "self-intersections");
    report.self_intersections = find_self_intersections(soup, tree, context);
  }
  if (options.reference) measure_distances(soup, tree, options, report, context);
  if (options.reference && options.solid_samples > 0)
    report.solid =
        compare_solids(mesh, *options.reference, {options.solid_samples, options.voxel_size}, context);
  if (options.reference && options.voxel_size > 0.0 && options.visible_samples > 0)
    report.visible = measure_visible_loss(TriangleSoup(*options.reference, options.reference_quads), soup,
                                          options.voxel_size, options.visible_samples, context);
  if (options.features) {
    const Stage stage(context, "features");
    report.features = feature_distances(TriangleSoup(*options.features, QuadRule::better), tree,
                                        options.dihedral_degrees, context);
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

// Returns a text such as "; the first at (x, y, z), polygons 3 and 7".
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
    if (r_.solid) solid(*r_.solid);
    if (r_.visible) visible(*r_.visible);
    if (r_.features) features(*r_.features);
    return std::move(out_);
  }

 private:
  void say(const std::string& sentence) { out_.push_back(sentence + "."); }

  void overall() {
    if (r_.triangles + r_.quads == 0) return say("The mesh has no polygons");
    std::string has, lacks;
    const auto add = [&](bool holds, const char* property) {
      std::string& list = holds ? has : lacks;
      list += (list.empty() ? "" : ", ") + std::string(property);
    };
    add(r_.closed(), "closed");
    add(r_.manifold(), "manifold");
    add(r_.oriented(), "oriented");
    if (r_.self_intersections) add(r_.self_intersections->pairs == 0, "free of self-intersections");
    std::string text = "The mesh is " + has;
    if (!lacks.empty()) text += (has.empty() ? "not " : "; it is not ") + lacks;
    if (!r_.self_intersections) text += "; it was not searched for self-intersections";
    if (r_.watertight()) text += ": it is watertight";
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
    defect(r_.inside_out_components.value_or(0), "component is inside out", "components are inside out",
           r_.inside_out_places);
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
    if (!std::isfinite(r_.area) || !std::isfinite(r_.volume))
      say("The area or the volume is beyond the range of double precision and is not stated");
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

  void visible(const VisibleLoss& v) {
    if (v.lost.value == 0.0 && v.invented.value == 0.0)
      return say("All of the visible surface of the reference is shown, and none was added (" +
                 std::to_string(v.samples) + " samples on each)");
    std::string text =
        percent(v.lost) + " of the visible surface of the reference is not shown within half a voxel";
    if (v.filled.value > 0.0) text += ", of it " + percent(v.filled) + " where gaps are filled";
    if (v.place) text += "; the first at " + describe_point(*v.place);
    if (v.invented.value > 0.0)
      text += ". " + percent(v.invented) + " of the mesh, an area of " + number(v.invented_area) +
              ", is farther than a voxel from the reference";
    say(text);
  }
  static std::string percent(const Estimate& share) {
    return number(100.0 * share.value) + " % (" + number(100.0 * share.lower) + " to " +
           number(100.0 * share.upper) + ")";
  }

  void solid(const SolidComparison& s) {
    using Kind = SolidComparison::Verdict;
    if (s.verdict == Kind::same)
      say("The mesh bounds the reference's solid: beyond a distance of " + number(s.explained) +
          ", which discretisation explains, nothing differs; the symmetric difference is " +
          interval(s.difference));
    if (s.verdict == Kind::unknown) cannot_tell(s);
    if (s.verdict != Kind::differs) return;
    say("The mesh does not bound the reference's solid: their symmetric difference is " +
        interval(s.difference) + ", the mesh has area " + number(s.mesh_area) + " in " +
        counted(s.mesh_components, "component", "components") + ", what bounds the reference " +
        number(s.reference_area) + " in " + counted(s.reference_components, "component", "components"));
    differing(s.false_area, s.false_place,
              "area " + number(s.false_area.value) + " of the mesh lies more than " + number(s.explained) +
                  " from all polygons that have inside on one side and outside on the other, so "
                  "that it follows inner walls or nothing");
    differing(s.lost_area, s.lost_place,
              "of the polygons that bound the reference, area " + number(s.lost_area.value) +
                  " lies more than " + number(s.explained) + " from the mesh");
    differing(s.unexplained, s.unexplained_place,
              "of the symmetric difference, " + number(s.unexplained.value) + " lies more than " +
                  number(s.explained) + " from one of the two surfaces");
  }

  void differing(const Estimate& what, const std::optional<Eigen::Vector3d>& place, std::string text) {
    if (!place || what.lower <= 0.0) return;
    text[0] = char(std::toupper(text[0]));
    say(text + "; the first sample at " + describe_point(*place));
  }

  void cannot_tell(const SolidComparison& s) {
    std::string text = "Nobody can tell whether the mesh bounds the reference's solid: ";
    if (s.reference_volume.value <= 0.0 && s.unknown_volume.value <= 0.0)
      return say(text + "the reference encloses nothing");
    if (!s.reference_closed)
      text += "the reference is open";
    else if (!s.reference_oriented)
      text += "the reference's polygons do not agree on a side";
    else
      text += "the reference has voids or parts that are turned inside out";
    say(text + ", and of its volume " + number(s.unknown_volume.value) + " may be inside or outside beside " +
        number(s.reference_volume.value) + " inside");
  }

  static std::string interval(const Estimate& e) {
    return number(e.value) + " (from " + number(e.lower) + " to " + number(e.upper) + ")";
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

namespace {

// Meshes whose measures double precision could not hold are multiplied by a power of two, and the report is
// converted back to their own units.

constexpr int kMostExponent = 150;

// Returns the power of two by which coordinates have to be multiplied so that products of several lengths
// stay in the range of double precision: 1 if the largest coordinate is between 2^-150 and 2^150. Skips null
// pointers.
double comfortable_scale(std::initializer_list<const MeshFile*> meshes) {
  double largest = 0.0;
  for (const MeshFile* mesh : meshes)
    if (mesh)
      for (const Eigen::Vector3d& p : mesh->points) largest = std::max(largest, p.cwiseAbs().maxCoeff());
  if (largest == 0.0 || std::abs(std::ilogb(largest)) <= kMostExponent) return 1.0;
  return std::ldexp(1.0, -std::ilogb(largest));
}

// Returns the mesh times a power of two, without its attributes. @throws Error if a coordinate would lose
// digits.
MeshFile scaled(const MeshFile& mesh, double scale, const std::string& name) {
  MeshFile result;
  result.triangles = mesh.triangles;
  result.quads = mesh.quads;
  result.points.reserve(mesh.points.size());
  for (const Eigen::Vector3d& p : mesh.points) {
    result.points.push_back(scale * p);
    if (result.points.back() / scale != p)
      throw Error("the coordinates of " + name +
                  " span too many orders of magnitude; scale the mesh, or remove its distant parts");
  }
  return result;
}

// Converts the report of meshes that were multiplied by a power of two.
class Unscaler {
 public:
  explicit Unscaler(double unit) : unit_(unit) {}

  void report(MeshReport& r) const {
    measure(r.area, 2), measure(r.volume, 3);
    for (Places* p :
         {&r.boundary_places, &r.non_manifold_edge_places, &r.non_manifold_vertex_places,
          &r.inconsistent_places, &r.degenerate_places, &r.duplicate_places, &r.inside_out_places})
      places(*p);
    for (LibraryCounts& l : r.libraries) power(l.area, 2), power(l.volume, 3);
    if (r.self_intersections) places(r.self_intersections->places);
    for (std::optional<Distances>* d : {&r.to_reference, &r.from_reference})
      if (*d) distances(**d);
    for (std::optional<HausdorffBound>* b : {&r.certified_to_reference, &r.certified_from_reference})
      if (*b) power((*b)->lower, 1), power((*b)->upper, 1);
    if (r.features) {
      power(r.features->edge_length, 1);
      distances(r.features->edge_to_mesh), distances(r.features->corner_to_mesh);
    }
    if (r.solid) solid(*r.solid);
  }

 private:
  // Multiplies step by step, because a power of the unit may exceed the range of its product with the value.
  void power(double& value, int exponent) const {
    for (int i = 0; i < exponent; ++i) value *= unit_;
  }
  // Replaces a value that is too small for double precision by NaN, because 0 would be wrong.
  void measure(double& value, int exponent) const {
    const bool nonzero = value != 0.0;
    power(value, exponent);
    if (nonzero && value == 0.0) value = std::numeric_limits<double>::quiet_NaN();
  }
  void estimate(Estimate& e, int exponent) const {
    for (double* value : {&e.value, &e.lower, &e.upper}) power(*value, exponent);
  }
  void places(Places& value) const {
    for (Eigen::Vector3d& p : value.points) p *= unit_;
  }
  void distances(Distances& d) const {
    for (double* value : {&d.max, &d.mean, &d.rms}) power(*value, 1);
    d.worst *= unit_;
  }
  void solid(SolidComparison& s) const {
    for (Estimate* e :
         {&s.mesh_volume, &s.reference_volume, &s.difference, &s.unknown_volume, &s.unexplained})
      estimate(*e, 3);
    for (Estimate* e : {&s.false_area, &s.lost_area}) estimate(*e, 2);
    for (double* area : {&s.mesh_area, &s.reference_area, &s.possible_area}) power(*area, 2);
    power(s.explained, 1);
    for (std::optional<Eigen::Vector3d>* p : {&s.false_place, &s.lost_place, &s.unexplained_place})
      if (*p) **p *= unit_;
  }

  double unit_;
};

MeshReport check_scaled(const MeshFile& mesh, const CheckOptions& options, double unit, RunContext& context) {
  MeshReport report;
  const TriangleSoup soup(mesh);
  {
    const Stage stage(context, "topology");
    count_topology(mesh, report, context);
    measure_triangles(mesh, soup, report, context);
  }
  if (options.libraries) count_with_libraries(mesh, unit, report, context);
  if (!soup.triangles.empty())
    check_surface(mesh, soup, options, report, context);
  else if (options.self_intersections)
    report.self_intersections.emplace();
  return report;
}

}  // namespace

MeshReport check_mesh(const MeshFile& mesh, const CheckOptions& options, RunContext& context) {
  check_input(mesh, "the mesh");
  check_reference(options.reference, "the reference mesh");
  check_reference(options.features, "the reference mesh for the features");
  const double scale = comfortable_scale({&mesh, options.reference, options.features});
  if (scale == 1.0) return check_scaled(mesh, options, 1.0, context);
  CheckOptions at_scale = options;
  MeshFile reference, features;
  const auto replace = [&](const MeshFile*& given, MeshFile& copy) {
    if (!given) return;
    copy = scaled(*given, scale, "the reference mesh");
    given = &copy;
  };
  replace(at_scale.reference, reference);
  replace(at_scale.features, features);
  at_scale.certify_gap *= scale;
  at_scale.voxel_size *= scale;
  MeshReport report = check_scaled(scaled(mesh, scale, "the mesh"), at_scale, 1.0 / scale, context);
  Unscaler(1.0 / scale).report(report);
  return report;
}

}  // namespace hermesh::validation
