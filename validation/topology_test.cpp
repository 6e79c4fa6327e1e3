#include "validation/topology.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "validation/geometry/test_meshes.h"
#include "validation/library_counts.h"

namespace hermesh::validation {
namespace topology_test {

using namespace test;

MeshReport counts(const MeshFile& mesh) {
  RunContext context;
  MeshReport report;
  count_topology(mesh, report, context);
  measure_triangles(mesh, TriangleSoup(mesh), report, context);
  return report;
}

std::vector<LibraryCounts> libraries(const MeshFile& mesh, const MeshReport& ours) {
  RunContext context;
  return {count_with_openmesh(mesh, ours, context), count_with_cgal(mesh, ours, context)};
}

void expect_libraries_load(const MeshFile& mesh) {
  for (const LibraryCounts& l : libraries(mesh, counts(mesh))) {
    EXPECT_TRUE(l.loaded) << l.library << ": " << l.refusal;
    EXPECT_TRUE(l.disagreements.empty()) << l.disagreements.front();
  }
}

void expect_libraries_refuse(const MeshFile& mesh, const std::string& place) {
  for (const LibraryCounts& l : libraries(mesh, counts(mesh))) {
    EXPECT_FALSE(l.loaded) << l.library;
    EXPECT_NE(l.refusal.find(place), std::string::npos) << l.refusal;
    EXPECT_TRUE(l.disagreements.empty()) << l.disagreements.front();
  }
}

void expect_no_defect(const MeshReport& r) {
  EXPECT_TRUE(r.closed() && r.manifold() && r.oriented());
  EXPECT_EQ(r.degenerate_polygons, 0);
  EXPECT_EQ(r.duplicate_polygons, 0);
  EXPECT_EQ(r.isolated_points, 0);
}

TEST(Topology, CubeOfQuads) {
  const MeshFile mesh = cube_of_quads({1e6, -5.0, 3.0}, 2.0);
  const MeshReport r = counts(mesh);
  expect_no_defect(r);
  EXPECT_EQ(r.points, 8);
  EXPECT_EQ(r.triangles, 0);
  EXPECT_EQ(r.quads, 6);
  EXPECT_EQ(r.components, 1);
  EXPECT_EQ(r.euler_characteristic, 2);
  EXPECT_EQ(r.genus, 0.0);
  EXPECT_DOUBLE_EQ(r.volume, 8.0);
  EXPECT_DOUBLE_EQ(r.area, 24.0);
  EXPECT_NEAR(r.smallest_angle, 45.0, 1e-12);
  // Legs 1, 1: hypotenuse over 2√3 times the inradius 1 − 1/√2.
  EXPECT_NEAR(r.worst_aspect, std::sqrt(2.0) / (2.0 * std::sqrt(3.0) * (1.0 - 1.0 / std::sqrt(2.0))), 1e-12);
  expect_libraries_load(mesh);
}

TEST(Topology, CubeOfTrianglesInsideOut) {
  const MeshFile mesh = reversed(cube_of_triangles());
  const MeshReport r = counts(mesh);
  expect_no_defect(r);
  EXPECT_EQ(r.triangles, 12);
  EXPECT_EQ(r.euler_characteristic, 2);
  EXPECT_DOUBLE_EQ(r.volume, -1.0);
  expect_libraries_load(mesh);
}

TEST(Topology, TorusHasGenusOne) {
  const MeshReport r = counts(torus(20, 12));
  expect_no_defect(r);
  EXPECT_EQ(r.euler_characteristic, 0);
  EXPECT_EQ(r.genus, 1.0);
  EXPECT_GT(r.volume, 0.0);
  expect_libraries_load(torus(20, 12));
}

TEST(Topology, GenusIsSummedOverComponents) {
  const MeshFile mesh = together(torus(9, 5), together(torus(6, 6), cube_of_triangles({5.0, 0.0, 0.0})));
  const MeshReport r = counts(mesh);
  EXPECT_EQ(r.components, 3);
  EXPECT_EQ(r.euler_characteristic, 2);
  EXPECT_EQ(r.genus, 2.0);
  expect_libraries_load(mesh);
}

TEST(Topology, EquilateralTriangleIsTheBestShape) {
  MeshFile mesh;
  mesh.points = {{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}, {0.5, std::sqrt(0.75), 0.0}};
  mesh.triangles = {{0, 1, 2}};
  const MeshReport r = counts(mesh);
  EXPECT_NEAR(r.smallest_angle, 60.0, 1e-12);
  EXPECT_NEAR(r.worst_aspect, 1.0, 1e-12);
  EXPECT_EQ(r.boundary_edges, 3);
  EXPECT_EQ(r.euler_characteristic, 1);
  EXPECT_FALSE(r.genus);
  expect_libraries_load(mesh);
}

TEST(Topology, Hole) {
  MeshFile mesh = cube_of_quads();
  mesh.quads.pop_back();
  const MeshReport r = counts(mesh);
  EXPECT_EQ(r.boundary_edges, 4);
  EXPECT_EQ(r.euler_characteristic, 1);
  EXPECT_TRUE(r.manifold());
  EXPECT_FALSE(r.genus);
  ASSERT_EQ(r.boundary_places.points.size(), 4u);
  for (const Eigen::Vector3d& p : r.boundary_places.points) EXPECT_EQ(p.z(), 1.0);
  expect_libraries_load(mesh);
}

TEST(Topology, TwoCubesSharingAnEdge) {
  const MeshFile mesh = welded(together(cube_of_triangles(), cube_of_triangles({1.0, 1.0, 0.0})));
  const MeshReport r = counts(mesh);
  EXPECT_EQ(r.points, 14);
  EXPECT_EQ(r.boundary_edges, 0);
  EXPECT_EQ(r.non_manifold_edges, 1);
  // The edge joins the two fans at each of its ends.
  EXPECT_EQ(r.non_manifold_vertices, 0);
  EXPECT_EQ(r.inconsistent_edges, 0);
  EXPECT_EQ(r.components, 1);
  EXPECT_EQ(r.euler_characteristic, 14 - 35 + 24);
  EXPECT_FALSE(r.genus);
  EXPECT_DOUBLE_EQ(r.volume, 2.0);
  ASSERT_EQ(r.non_manifold_edge_places.points.size(), 1u);
  EXPECT_EQ(r.non_manifold_edge_places.points[0], Eigen::Vector3d(1.0, 1.0, 0.5));
  expect_libraries_refuse(mesh, "(");
}

TEST(Topology, TwoCubesSharingAVertex) {
  const MeshFile mesh = welded(together(cube_of_quads(), cube_of_quads({1.0, 1.0, 1.0})));
  const MeshReport r = counts(mesh);
  EXPECT_EQ(r.points, 15);
  EXPECT_EQ(r.non_manifold_edges, 0);
  EXPECT_EQ(r.non_manifold_vertices, 1);
  EXPECT_EQ(r.boundary_edges, 0);
  EXPECT_EQ(r.components, 1);
  EXPECT_EQ(r.euler_characteristic, 15 - 24 + 12);
  ASSERT_EQ(r.non_manifold_vertex_places.points.size(), 1u);
  EXPECT_EQ(r.non_manifold_vertex_places.points[0], Eigen::Vector3d(1.0, 1.0, 1.0));
  expect_libraries_refuse(mesh, "(");
}

TEST(Topology, TwoFansAtOneVertexWhateverTheOrder) {
  // Interleaved, so that a half-edge structure takes them all and only a look around the vertex finds the
  // trouble.
  MeshFile mesh = welded(together(cube_of_quads(), cube_of_quads({1.0, 1.0, 1.0})));
  std::mt19937 random(7);
  for (int i = 0; i < 20; ++i) {
    std::shuffle(mesh.quads.begin(), mesh.quads.end(), random);
    EXPECT_EQ(counts(mesh).non_manifold_vertices, 1);
    expect_libraries_refuse(mesh, "(");
  }
  MeshFile bow_tie;
  bow_tie.points = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {-1, 0, 0}, {-1, -1, 0}};
  bow_tie.triangles = {{0, 1, 2}, {0, 3, 4}};
  EXPECT_EQ(counts(bow_tie).non_manifold_vertices, 1);
  EXPECT_EQ(counts(bow_tie).boundary_edges, 6);
  expect_libraries_refuse(bow_tie, "(0, 0, 0)");
}

TEST(Topology, FlippedFace) {
  MeshFile quads = cube_of_quads();
  std::reverse(quads.quads[3].begin(), quads.quads[3].end());
  const MeshReport r = counts(quads);
  EXPECT_EQ(r.inconsistent_edges, 4);
  EXPECT_TRUE(r.closed() && r.manifold());
  EXPECT_FALSE(r.oriented());
  EXPECT_FALSE(r.genus);
  expect_libraries_refuse(quads, "polygon ");
  MeshFile triangles = cube_of_triangles();
  std::swap(triangles.triangles[5][0], triangles.triangles[5][1]);
  EXPECT_EQ(counts(triangles).inconsistent_edges, 3);
}

TEST(Topology, DuplicatesCountFromTheSecondCopyOn) {
  MeshFile mesh = cube_of_quads();
  const Quad q = mesh.quads[1];
  mesh.quads.push_back({q[2], q[3], q[0], q[1]});
  MeshReport r = counts(mesh);
  EXPECT_EQ(r.duplicate_polygons, 1);
  EXPECT_EQ(r.non_manifold_edges, 4);
  EXPECT_EQ(r.duplicate_places.polygons[0], (std::array<std::int64_t, 2>{1, 6}));
  expect_libraries_refuse(mesh, "polygon 6");
  mesh.quads.push_back({q[3], q[2], q[1], q[0]});
  mesh.triangles.push_back({q[0], q[1], q[2]});
  EXPECT_EQ(counts(mesh).duplicate_polygons, 2);
}

TEST(Topology, IsolatedPoints) {
  MeshFile mesh = cube_of_quads();
  mesh.points.insert(mesh.points.begin(), {9.0, 9.0, 9.0});
  for (Quad& q : mesh.quads)
    for (std::uint32_t& p : q) ++p;
  mesh.points.emplace_back(8.0, 8.0, 8.0);
  const MeshReport r = counts(mesh);
  EXPECT_EQ(r.points, 10);
  EXPECT_EQ(r.isolated_points, 2);
  EXPECT_EQ(r.components, 1);
  EXPECT_EQ(r.euler_characteristic, 2);
  EXPECT_DOUBLE_EQ(r.volume, 1.0);
  expect_libraries_load(mesh);
}

TEST(Topology, DegeneratePolygonsAreExact) {
  MeshFile mesh;
  mesh.points = {{0, 0, 0},      {1, 1, 1}, {3, 3, 3}, {0, 1, 0}, {3, 3, std::nextafter(3.0, 4.0)},
                 {0.1, 0.1, 0.1}};
  mesh.triangles = {{0, 1, 2}};
  EXPECT_EQ(counts(mesh).degenerate_polygons, 1);
  EXPECT_EQ(counts(mesh).smallest_angle, 0.0);
  EXPECT_TRUE(std::isinf(counts(mesh).worst_aspect));
  mesh.triangles = {{0, 1, 4}};
  EXPECT_EQ(counts(mesh).degenerate_polygons, 0);
  EXPECT_GT(counts(mesh).smallest_angle, 0.0);
  mesh.triangles = {{0, 1, 1}, {2, 2, 2}, {0, 1, 3}};
  EXPECT_EQ(counts(mesh).degenerate_polygons, 2);
  expect_libraries_refuse(mesh, "polygon 0");
  mesh.triangles.clear();
  // One half, which the other diagonal of a plane quad mends; both; none.
  mesh.quads = {{0, 1, 2, 3}, {0, 5, 1, 2}, {0, 1, 4, 3}};
  EXPECT_EQ(counts(mesh).degenerate_polygons, 1);
  EXPECT_EQ(counts(mesh).degenerate_places.polygons[0][0], 1);
}

TEST(Topology, MoebiusBandIsNotOriented) {
  MeshFile mesh;
  constexpr int kPieces = 12;
  for (int i = 0; i < kPieces; ++i) {
    const double u = 2.0 * std::numbers::pi * i / kPieces;
    for (double s : {-0.3, 0.3}) {
      const double r = 1.0 + s * std::cos(u / 2.0);
      mesh.points.emplace_back(r * std::cos(u), r * std::sin(u), s * std::sin(u / 2.0));
    }
  }
  for (std::uint32_t i = 0; i + 1 < kPieces; ++i)
    mesh.quads.push_back({2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1});
  mesh.quads.push_back({2 * kPieces - 2, 1, 0, 2 * kPieces - 1});
  const MeshReport r = counts(mesh);
  EXPECT_EQ(r.inconsistent_edges, 1);
  EXPECT_EQ(r.boundary_edges, 2 * kPieces);
  EXPECT_EQ(r.euler_characteristic, 0);
  expect_libraries_refuse(mesh, "polygon ");
}

TEST(Topology, EmptyMesh) {
  const MeshReport r = counts(MeshFile{});
  EXPECT_EQ(r.components, 0);
  EXPECT_EQ(r.euler_characteristic, 0);
  EXPECT_FALSE(r.genus);
  EXPECT_EQ(r.area, 0.0);
}

TEST(Topology, LibrariesContradictWrongCounts) {
  const MeshFile mesh = torus(8, 5);
  const auto disagreements = [&](const MeshReport& claimed) {
    std::size_t least = 100;
    for (const LibraryCounts& l : libraries(mesh, claimed)) least = std::min(least, l.disagreements.size());
    return least;
  };
  const MeshReport right = counts(mesh);
  EXPECT_EQ(disagreements(right), 0u);
  MeshReport wrong = right;
  wrong.boundary_edges = 1;
  EXPECT_EQ(disagreements(wrong), 1u);
  wrong = right;
  wrong.components = 2;
  wrong.euler_characteristic = 2;
  EXPECT_EQ(disagreements(wrong), 2u);
  wrong = right;
  wrong.area *= 1.0 + 1e-6;
  wrong.volume *= 1.0 - 1e-6;
  EXPECT_EQ(disagreements(wrong), 2u);
  wrong = right;
  wrong.non_manifold_vertices = 1;
  EXPECT_EQ(disagreements(wrong), 1u);
  // The reverse: a mesh that they refuse, said to be in order.
  MeshFile bad = cube_of_quads();
  std::reverse(bad.quads[3].begin(), bad.quads[3].end());
  for (const LibraryCounts& l : libraries(bad, counts(cube_of_quads())))
    EXPECT_EQ(l.disagreements.size(), 1u);
}

TEST(Topology, RandomPolygonsGiveTheSameReportAtAnyThreadCount) {
  MeshFile mesh;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> coordinate(-1.0, 1.0);
  for (int i = 0; i < 30000; ++i)
    mesh.points.emplace_back(coordinate(random), coordinate(random), coordinate(random));
  std::uniform_int_distribution<std::uint32_t> index(0, 29999);
  for (int i = 0; i < 20000; ++i) {
    mesh.triangles.push_back({index(random), index(random), index(random)});
    mesh.quads.push_back({index(random), index(random), index(random), index(random)});
  }
  std::vector<MeshReport> reports;
  for (std::size_t threads : {1u, 2u, 5u}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    reports.push_back(counts(mesh));
  }
  for (const MeshReport& r : reports) {
    EXPECT_GT(r.boundary_edges, 0);
    EXPECT_EQ(r.boundary_edges, reports[0].boundary_edges);
    EXPECT_EQ(r.non_manifold_vertices, reports[0].non_manifold_vertices);
    EXPECT_EQ(r.volume, reports[0].volume);
    EXPECT_EQ(r.area, reports[0].area);
    EXPECT_EQ(r.boundary_places.points, reports[0].boundary_places.points);
    EXPECT_EQ(r.boundary_places.points.size(), kMaxPlaces);
    EXPECT_EQ(r.non_manifold_vertex_places.polygons, reports[0].non_manifold_vertex_places.polygons);
  }
}

}  // namespace topology_test
}  // namespace hermesh::validation
