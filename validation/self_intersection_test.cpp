#include "validation/self_intersection.h"

#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/intersections.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <random>

#include "validation/geometry/exact_predicates.h"
#include "validation/geometry/test_meshes.h"

namespace hermesh::validation {
namespace self_intersection_test {

using namespace test;

SelfIntersections search(const MeshFile& mesh) {
  RunContext context;
  const TriangleSoup soup(mesh);
  return find_self_intersections(soup, TriangleTree(soup), context);
}

// Slow oracle without common code: constructs the intersection of every two triangles in exact arithmetic and
// tests if it exceeds the span of their shared corners.
using Exact = CGAL::Exact_predicates_exact_constructions_kernel;

Exact::Point_3 exact(const Eigen::Vector3d& p) { return {p.x(), p.y(), p.z()}; }

bool more_than_shared(const TriangleSoup& soup, std::size_t a, std::size_t b, int& shared_count) {
  std::vector<Exact::Point_3> shared;
  for (std::uint32_t p : soup.triangles[a])
    for (std::uint32_t q : soup.triangles[b])
      if (p == q) shared.push_back(exact(soup.points[p]));
  shared_count = int(shared.size());
  const auto triangle = [&](std::size_t t) {
    const Corners c = soup.corners(t);
    return Exact::Triangle_3(exact(c[0]), exact(c[1]), exact(c[2]));
  };
  const auto common = CGAL::intersection(triangle(a), triangle(b));
  if (!common) return false;
  if (const auto* point = boost::get<Exact::Point_3>(&*common)) return shared.empty() || *point != shared[0];
  if (const auto* segment = boost::get<Exact::Segment_3>(&*common)) {
    if (shared.size() != 2) return true;
    const Exact::Segment_3 edge(shared[0], shared[1]);
    return *segment != edge && *segment != edge.opposite();
  }
  return true;
}

SelfIntersections brute_force(const MeshFile& mesh) {
  const TriangleSoup soup(mesh);
  SelfIntersections result;
  for (std::size_t a = 0; a < soup.triangles.size(); ++a)
    for (std::size_t b = a + 1; b < soup.triangles.size(); ++b) {
      if (collinear(soup.corners(a)) || collinear(soup.corners(b))) continue;
      int shared = 0;
      if (!more_than_shared(soup, a, b, shared)) continue;
      ++result.pairs;
      ++(shared == 0 ? result.disjoint : shared == 1 ? result.vertex_sharing : result.edge_sharing);
    }
  return result;
}

void expect_same(const SelfIntersections& found, const SelfIntersections& certain) {
  EXPECT_EQ(found.pairs, certain.pairs);
  EXPECT_EQ(found.disjoint, certain.disjoint);
  EXPECT_EQ(found.vertex_sharing, certain.vertex_sharing);
  EXPECT_EQ(found.edge_sharing, certain.edge_sharing);
}

TEST(SelfIntersection, CleanMeshesHaveNone) {
  EXPECT_EQ(search(cube_of_triangles()).pairs, 0);
  EXPECT_EQ(search(cube_of_quads({0.1, 0.2, 0.3}, 0.7)).pairs, 0);
  EXPECT_EQ(search(torus(40, 20)).pairs, 0);
  EXPECT_EQ(search(prism(17)).pairs, 0);
}

TEST(SelfIntersection, FoldBetweenNeighbours) {
  MeshFile mesh;
  mesh.points = {{0, 0, 0}, {1, 0, 0}, {0.3, 1, 0}, {0.6, 0.5, 0}, {0.6, -0.5, 0}, {0.6, 0.5, 1e-300}};
  mesh.triangles = {{0, 1, 2}, {1, 0, 3}};  // both on one side of the shared edge
  const SelfIntersections fold = search(mesh);
  EXPECT_EQ(fold.pairs, 1);
  EXPECT_EQ(fold.edge_sharing, 1);
  EXPECT_EQ(fold.places.polygons[0], (std::array<std::int64_t, 2>{0, 1}));
  mesh.triangles[1] = {1, 0, 4};  // flat, side by side
  EXPECT_EQ(search(mesh).pairs, 0);
  mesh.triangles[1] = {1, 0, 5};  // folded, but a hair out of the plane
  EXPECT_EQ(search(mesh).pairs, 0);
}

TEST(SelfIntersection, QuadFoldsOntoItself) {
  MeshFile mesh;
  mesh.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}};
  mesh.quads = {{0, 1, 2, 3}};  // its sides cross, so either diagonal folds it
  EXPECT_EQ(search(mesh).edge_sharing, 1);
  // A dart: 1 and 3 are on one side of the diagonal 02, and there is one surface in a plane, wherever the
  // file starts.
  mesh.points = {{0, 0, 0}, {1, 0.2, 0}, {2, 0, 0}, {1, 1, 0}};
  mesh.quads = {{0, 1, 2, 3}};
  EXPECT_EQ(search(mesh).pairs, 0);
  mesh.quads = {{1, 2, 3, 0}};
  EXPECT_EQ(search(mesh).pairs, 0);
  mesh.points[1].z() =
      0.1;  // in space the order determines which of two surfaces it is, and this one does not fold
  mesh.quads = {{1, 2, 3, 0}};
  EXPECT_EQ(search(mesh).pairs, 0);
}

TEST(SelfIntersection, PairsThatShareAVertex) {
  MeshFile mesh;
  mesh.points = {{0, 0, 0},  {2, 1, 0},   {2, -1, 0},   {1, 0, 1},
                 {1, 0, -1}, {3, 0.5, 0}, {3, -0.5, 0}, {4, 2, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 3, 4}};  // the second pierces the first
  EXPECT_EQ(search(mesh).vertex_sharing, 1);
  mesh.triangles[1] = {0, 5, 6};  // in one plane, one inside the cone of the other
  EXPECT_EQ(search(mesh).vertex_sharing, 1);
  mesh.triangles[1] = {0, 7, 3};  // side on side: 0, 1 and 7 lie on one line
  EXPECT_EQ(search(mesh).vertex_sharing, 1);
  mesh.points[7] = {-2, 1, 0.5};
  EXPECT_EQ(search(mesh).pairs, 0);
}

TEST(SelfIntersection, NeighbourhoodGoesByIndex) {
  // Two halves of a square that do not share their points touch all along the diagonal.
  MeshFile mesh;
  mesh.points = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  mesh.quads = {{0, 1, 2, 3}};
  EXPECT_EQ(search(mesh).pairs, 0);
  EXPECT_EQ(search(soup_of_triangles(mesh)).disjoint, 1);
}

TEST(SelfIntersection, Duplicate) {
  MeshFile mesh = cube_of_triangles();
  mesh.triangles.push_back(mesh.triangles[4]);
  const SelfIntersections s = search(mesh);
  EXPECT_EQ(s.edge_sharing, 1);
  EXPECT_EQ(s.pairs, 1);
}

TEST(SelfIntersection, OneCubeCornerInTheOther) {
  // By hand: the face x = 1 of one and the face y = 0.75 of the other cross along a segment, and so on: six
  // pairs of faces do. Each segment runs in z (or x, or y) over 0.25, starting in a corner of the small
  // overlap; which of the two triangles of a face it runs through follows from the diagonals. Brute force
  // counts them.
  const MeshFile mesh = together(cube_of_triangles(), cube_of_triangles({0.75, 0.7, 0.65}));
  const SelfIntersections s = search(mesh);
  EXPECT_GE(s.pairs, 6);
  EXPECT_EQ(s.disjoint, s.pairs);
  expect_same(s, brute_force(mesh));
  EXPECT_EQ(s.places.points.size(), std::min(std::size_t(s.pairs), kMaxPlaces));
}

TEST(SelfIntersection, StakeThroughATriangleByHand) {
  MeshFile mesh;
  mesh.points = {{-5, -5, 0}, {5, -5, 0}, {0, 8, 0}};
  mesh.triangles = {{0, 1, 2}};
  // A long box through the triangle: its four walls, of two triangles each, cross the plane z = 0.
  mesh = together(mesh, extrusion({{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}, 4.0));
  for (std::size_t p = 3; p < mesh.points.size(); ++p) mesh.points[p].z() -= 2.0;
  EXPECT_EQ(search(mesh).pairs, 8);
  EXPECT_EQ(search(mesh).disjoint, 8);
}

TEST(SelfIntersection, DegenerateTrianglesMeetNothing) {
  MeshFile mesh = cube_of_triangles();
  mesh.points.emplace_back(0.5, 0.5, -3.0);
  mesh.points.emplace_back(0.5, 0.5, 3.0);
  mesh.points.emplace_back(0.5, 0.5, 0.0);
  mesh.triangles.push_back({8, 9, 10});  // a needle through the cube
  mesh.triangles.push_back({8, 8, 8});
  mesh.triangles.push_back({0, 1, 1});
  EXPECT_EQ(search(mesh).pairs, 0);
}

// Small integer coordinates make every special position common: shared positions, touching corners, edges on
// faces, overlaps in a plane.
TEST(SelfIntersection, RandomSoupsAgreeWithExactConstruction) {
  std::mt19937 random(11);
  std::int64_t disjoint = 0, vertex_sharing = 0, edge_sharing = 0;
  for (int round = 0; round < 60; ++round) {
    std::uniform_int_distribution<int> coordinate(0, 2 + round % 4);
    MeshFile mesh;
    for (int i = 0; i < 12; ++i)
      mesh.points.emplace_back(coordinate(random), coordinate(random), round % 3 ? coordinate(random) : 0);
    std::uniform_int_distribution<std::uint32_t> index(0, 11);
    for (int i = 0; i < 10; ++i) mesh.triangles.push_back({index(random), index(random), index(random)});
    for (int i = 0; i < 4; ++i)
      mesh.quads.push_back({index(random), index(random), index(random), index(random)});
    const SelfIntersections certain = brute_force(mesh);
    expect_same(search(mesh), certain);
    disjoint += certain.disjoint;
    vertex_sharing += certain.vertex_sharing;
    edge_sharing += certain.edge_sharing;
  }
  EXPECT_GT(disjoint, 100);
  EXPECT_GT(vertex_sharing, 100);
  EXPECT_GT(edge_sharing, 20);
}

TEST(SelfIntersection, RandomRealSoupAgreesAtAnyThreadCount) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> centre(0.0, 1.0), offset(-0.15, 0.15);
  MeshFile mesh;
  for (std::uint32_t t = 0; t < 300; ++t) {
    const Eigen::Vector3d c(centre(random), centre(random), centre(random));
    for (int k = 0; k < 3; ++k)
      mesh.points.push_back(c + Eigen::Vector3d(offset(random), offset(random), offset(random)));
    mesh.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
  }
  const SelfIntersections certain = brute_force(mesh);
  EXPECT_GT(certain.pairs, 50);
  std::vector<SelfIntersections> found;
  for (std::size_t threads : {1u, 3u}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    found.push_back(search(mesh));
    expect_same(found.back(), certain);
  }
  EXPECT_EQ(found[0].places.polygons, found[1].places.polygons);
  EXPECT_EQ(found[0].places.points, found[1].places.points);
}

TEST(SelfIntersection, CanBeCancelled) {
  const MeshFile mesh = torus(30, 30);
  const std::atomic<bool> stop = true;
  RunContext context;
  context.cancel = &stop;
  const TriangleSoup soup(mesh);
  EXPECT_THROW(find_self_intersections(soup, TriangleTree(soup), context), Cancelled);
}

}  // namespace self_intersection_test
}  // namespace hermesh::validation
