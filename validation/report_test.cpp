#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "validation/geometry/test_meshes.h"
#include "validation/mesh_report.h"
#include "validation/report_json.h"

namespace hermesh::validation {
namespace report_test {

using namespace test;

MeshReport checked(const MeshFile& mesh, const CheckOptions& options = {}) {
  RunContext context;
  return check_mesh(mesh, options, context);
}

bool says(const MeshReport& report, const std::string& text) {
  const auto sentences = report.sentences();
  return std::any_of(sentences.begin(), sentences.end(),
                     [&](const std::string& s) { return s.find(text) != std::string::npos; });
}

std::string error_of(const MeshFile& mesh, const CheckOptions& options = {}) {
  try {
    checked(mesh, options);
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}

TEST(Report, CleanMesh) {
  const MeshReport r = checked(cube_of_quads());
  EXPECT_TRUE(r.watertight());
  EXPECT_TRUE(r.libraries_agree());
  EXPECT_EQ(r.libraries.size(), 2u);
  EXPECT_TRUE(says(r, "watertight"));
  EXPECT_TRUE(says(r, "The counts of OpenMesh are the same."));
  EXPECT_TRUE(says(r, "The counts of CGAL are the same."));
}

TEST(Report, OutermostComponentsThatAreInsideOutAreCounted) {
  const MeshFile large = cube_of_quads({0, 0, 0}, 8.0), small = cube_of_quads({10, 0, 0}, 1.0),
                 within = cube_of_quads({3, 3, 3}, 1.0), core = cube_of_quads({3.25, 3.25, 3.25}, 0.5);
  const auto count = [](const MeshFile& mesh) {
    return checked(mesh, {.libraries = false}).inside_out_components;
  };
  EXPECT_EQ(count(large), 0);
  EXPECT_EQ(count(reversed(large)), 1);
  // The total volume is positive.
  const MeshReport report = checked(together(large, reversed(small)), {.libraries = false});
  EXPECT_EQ(report.inside_out_components, 1);
  EXPECT_GT(report.volume, 0.0);
  EXPECT_FALSE(report.watertight());
  ASSERT_EQ(report.inside_out_places.points.size(), 1u);
  EXPECT_GE(report.inside_out_places.points[0].x(), 10.0);
  EXPECT_EQ(to_json(report).at("inside_out_components"), 1);
  // A cavity, and a body in it.
  EXPECT_EQ(count(together(large, reversed(within))), 0);
  EXPECT_EQ(count(together(together(large, reversed(within)), core)), 0);
  EXPECT_EQ(count(together(together(large, reversed(within)), reversed(core))), 1);
  MeshFile open = large;
  open.quads.pop_back();
  EXPECT_FALSE(count(open).has_value());
}

TEST(Report, NothingIsWatertightUnlessItWasSearched) {
  CheckOptions options;
  options.self_intersections = false;
  const MeshReport r = checked(cube_of_quads(), options);
  EXPECT_FALSE(r.watertight());
  EXPECT_TRUE(says(r, "not searched for self-intersections"));
  EXPECT_TRUE(to_json(r).at("self_intersecting_pairs").is_null());
  EXPECT_TRUE(to_json(r).at("watertight").is_null());
}

TEST(Report, SentencesNameCountAndPlace) {
  MeshFile hole = cube_of_quads();
  hole.quads.pop_back();
  EXPECT_TRUE(
      says(checked(hole), "The mesh is manifold, oriented, free of self-intersections; it is not closed"));
  EXPECT_TRUE(says(checked(hole), "4 boundary edges; the first at (0.5, 0, 1), polygon 2."));
  const MeshFile edge = welded(together(cube_of_quads(), cube_of_quads({1.0, 1.0, 0.0})));
  EXPECT_TRUE(says(checked(edge), "1 edge with more than two polygons; the first at (1, 1, 0.5), polygons "));
  EXPECT_TRUE(says(checked(edge), "CGAL cannot load such a mesh, as expected: "));
  EXPECT_TRUE(checked(edge).libraries_agree());
  const MeshFile overlap = together(cube_of_quads(), cube_of_quads({0.5, 0.4, 0.3}));
  EXPECT_TRUE(says(checked(overlap), "it is not free of self-intersections"));
  EXPECT_FALSE(checked(overlap).watertight());
  MeshReport wrong = checked(cube_of_quads());
  wrong.libraries[0].disagreements = {"OpenMesh finds a number of components of 2 where our count is 1."};
  EXPECT_FALSE(wrong.libraries_agree());
  EXPECT_TRUE(says(wrong, "Disagreement: OpenMesh finds"));
  EXPECT_TRUE(says(checked(MeshFile{}), "The mesh has no polygons."));
}

TEST(Report, DistancesAndFeatures) {
  const MeshFile reference = cube_of_quads({-1, -1, -1}, 2.0), mesh = cube_of_quads({-0.5, -0.5, -0.5}, 1.0);
  CheckOptions options;
  options.reference = options.features = &reference;
  options.certify = true;
  options.samples = 1000;
  const MeshReport r = checked(mesh, options);
  EXPECT_DOUBLE_EQ(r.to_reference->max, 0.5);
  EXPECT_DOUBLE_EQ(r.from_reference->max, std::sqrt(0.75));
  // The default gap is 1e-4 of the reference's diagonal.
  const double gap = 1e-4 * std::sqrt(12.0) + 1e-7;
  EXPECT_LE(r.certified_to_reference->upper - r.certified_to_reference->lower, gap);
  EXPECT_LE(r.certified_from_reference->lower, std::sqrt(0.75));
  EXPECT_GE(r.certified_from_reference->upper, std::sqrt(0.75));
  EXPECT_EQ(r.features->edges, 12);
  EXPECT_EQ(r.features->corners, 8);
  EXPECT_TRUE(says(r, "the true maximum is between"));
  options.certify_gap = 0.4;  // a sample is then farther away than what the search finds
  const MeshReport rough = checked(mesh, options);
  EXPECT_GE(rough.certified_from_reference->lower, rough.from_reference->max);
  const nlohmann::json json = to_json(r);
  for (const char* way : {"to_reference", "from_reference"})
    for (const char* key : {"max", "mean", "rms"}) EXPECT_TRUE(json.at(way).at(key).is_number());
  EXPECT_DOUBLE_EQ(json.at("to_reference").at("max"), 0.5);
  EXPECT_TRUE(json.at("certified_to_reference").at("upper").is_number());
  EXPECT_EQ(json.at("features").at("edges"), 12);
}

TEST(Report, JsonHoldsTheCounts) {
  MeshFile mesh = cube_of_triangles();
  mesh.triangles.push_back({0, 0, 1});
  const nlohmann::json json = to_json(checked(mesh));
  for (const char* key :
       {"points", "triangles", "quads", "boundary_edges", "non_manifold_edges", "non_manifold_vertices",
        "inconsistent_edges", "degenerate_polygons", "duplicate_polygons", "isolated_points", "components",
        "euler_characteristic", "self_intersecting_pairs"})
    EXPECT_TRUE(json.at(key).is_number_integer()) << key;
  EXPECT_TRUE(json.at("volume").is_number());
  EXPECT_TRUE(json.at("area").is_number());
  EXPECT_TRUE(json.at("genus").is_null());
  EXPECT_TRUE(json.at("worst_aspect").is_null());  // infinite
  EXPECT_EQ(json.at("triangles"), 13);
  EXPECT_EQ(json.at("degenerate_polygons"), 1);
  EXPECT_EQ(json.at("places").at("degenerate_polygons").at(0).at("polygons").at(0), 12);
  EXPECT_EQ(json.at("libraries").at("CGAL").at("loaded"), false);
  EXPECT_FALSE(json.contains("to_reference"));
  const nlohmann::json clean = to_json(checked(cube_of_triangles()));
  EXPECT_EQ(clean.at("genus"), 0);
  EXPECT_TRUE(clean.at("genus").is_number_integer());
  EXPECT_EQ(clean.at("self_intersecting_pairs"), 0);
  EXPECT_NO_THROW(nlohmann::json::parse(json.dump()));
}

TEST(Report, BadInputIsNamed) {
  MeshFile nan = cube_of_quads();
  nan.points[5].y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(error_of(nan).find("point 5 of the mesh"), std::string::npos);
  MeshFile infinite = cube_of_quads();
  infinite.points[2].x() = std::numeric_limits<double>::infinity();
  CheckOptions options;
  options.reference = &infinite;
  EXPECT_NE(error_of(cube_of_quads(), options).find("point 2 of the reference mesh"), std::string::npos);
  MeshFile index = cube_of_triangles();
  index.triangles[3][1] = 8;
  EXPECT_NE(error_of(index).find("polygon 3 of the mesh refers to point 8"), std::string::npos);
  const MeshFile empty;
  options.reference = &empty;
  EXPECT_NE(error_of(cube_of_quads(), options).find("no polygon"), std::string::npos);
}

TEST(Report, MeshWithoutPolygonsHasNoDistances) {
  const MeshFile reference = cube_of_quads();
  CheckOptions options;
  options.reference = &reference;
  const MeshReport r = checked(MeshFile{}, options);
  EXPECT_FALSE(r.to_reference);
  EXPECT_EQ(r.self_intersections->pairs, 0);
  EXPECT_TRUE(r.libraries_agree());
}

TEST(Report, ExtremeCoordinatesDoNotCrash) {
  for (double scale : {1e-200, 1e-30, 1e30, 1e200}) {
    const MeshReport r = checked(cube_of_quads(Eigen::Vector3d::Constant(scale), scale));
    EXPECT_TRUE(r.watertight()) << scale;
    EXPECT_EQ(r.degenerate_polygons, 0) << scale;
  }
}

TEST(Report, FiguresOfExtremeCoordinatesAreRightOrNotStated) {
  const MeshReport large = checked(cube_of_quads(Eigen::Vector3d::Zero(), 1e100));
  EXPECT_DOUBLE_EQ(large.area, 6e200);
  EXPECT_DOUBLE_EQ(large.volume, 1e300);
  EXPECT_TRUE(large.libraries_agree());
  for (const LibraryCounts& l : large.libraries) {
    EXPECT_DOUBLE_EQ(l.area, 6e200);
    EXPECT_DOUBLE_EQ(l.volume, 1e300);
  }
  const MeshReport beyond = checked(cube_of_quads(Eigen::Vector3d::Zero(), 1e200));
  EXPECT_TRUE(to_json(beyond).at("area").is_null());
  EXPECT_TRUE(says(beyond, "beyond the range of double precision"));
  const MeshReport tiny = checked(cube_of_quads(Eigen::Vector3d::Zero(), 1e-200));
  EXPECT_TRUE(to_json(tiny).at("area").is_null());  // and not 0
  EXPECT_TRUE(says(tiny, "beyond the range of double precision"));
  // Distances at that scale, too.
  const MeshFile reference = cube_of_quads(Eigen::Vector3d::Constant(-1e120), 2e120);
  CheckOptions options;
  options.reference = &reference;
  options.samples = 1000;
  options.solid_samples = 1000;
  EXPECT_DOUBLE_EQ(
      checked(cube_of_quads(Eigen::Vector3d::Constant(-5e119), 1e120), options).to_reference->max, 5e119);
  // Coordinates that cannot be scaled are refused.
  MeshFile spread = cube_of_quads(Eigen::Vector3d::Zero(), 1e300);
  spread.points[7] = Eigen::Vector3d::Constant(1.2345678901234567e-300);
  EXPECT_NE(error_of(spread).find("orders of magnitude"), std::string::npos);
}

TEST(Report, CanBeCancelled) {
  const std::atomic<bool> stop = true;
  RunContext context;
  context.cancel = &stop;
  EXPECT_THROW(check_mesh(cube_of_quads(), {}, context), Cancelled);
}

}  // namespace report_test
}  // namespace hermesh::validation
