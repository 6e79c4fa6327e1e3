#include "algorithms/remesh/bounded_remesh.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <tuple>

#include "algorithms/remesh/manifold_polygons.h"
#include "algorithms/search/triangle_tree.h"
#include "algorithms/voxelization/voxelize_for_tests.h"

namespace hermesh {
namespace bounded_remesh_test {

using Eigen::Vector3d;
using voxelize_for_tests::sphere;

/// The box as twelve triangles.
PolygonMesh box(const Vector3d& low, const Vector3d& high) {
  PolygonMesh mesh = voxelize_for_tests::box(low, high);
  mesh.triangles = triangulated(mesh);
  mesh.quads.clear();
  return mesh;
}

/// Distance from the surface of the box from `low` to `high`, in closed form.
double from_box(const Vector3d& p, const Vector3d& low, const Vector3d& high) {
  const Vector3d outside = (low - p).cwiseMax(p - high);
  if (outside.maxCoeff() > 0) return outside.cwiseMax(0.0).norm();
  return -outside.maxCoeff();
}

/// Calls f with positions distributed over each triangle.
template <class F>
void for_each_place(const PolygonMesh& mesh, int n, F&& f) {
  for (const Triangle& t : mesh.triangles)
    for (int i = 0; i <= n; ++i)
      for (int j = 0; i + j <= n; ++j)
        f(Vector3d((i * mesh.world(t[0]) + j * mesh.world(t[1]) + (n - i - j) * mesh.world(t[2])) /
                   double(n)));
}

/// Remeshes through a volume.
BoundedMesh remesh(const PolygonMesh& mesh, BoundedRemeshOptions options) {
  RunContext context;
  options.through_volume = true;
  return bounded_remesh(mesh, options, context);
}

/// Remeshes within the error; expects both bounds to hold.
BoundedMesh reached(const PolygonMesh& mesh, const BoundedRemeshOptions& options) {
  BoundedMesh made = remesh(mesh, options);
  EXPECT_TRUE(made.unmet.empty());
  EXPECT_LE(made.to_surface, options.error);
  EXPECT_LE(made.from_surface, options.error);
  return made;
}

PolygonMesh turned(PolygonMesh mesh) {
  const Eigen::Quaterniond turn = Eigen::Quaterniond(0.8, 0.3, -0.4, 0.33).normalized();
  for (Eigen::Vector3f& p : mesh.points) p = (turn * p.cast<double>()).cast<float>();
  return mesh;
}

/// Appends another mesh, optionally reversed.
void append(PolygonMesh& mesh, const PolygonMesh& other, bool reversed = false) {
  const auto first = std::uint32_t(mesh.points.size());
  for (std::size_t i = 0; i < other.points.size(); ++i)
    mesh.points.push_back((other.world(i) - mesh.origin).cast<float>());
  for (const Triangle& t : other.triangles)
    mesh.triangles.push_back({first + t[0], first + t[reversed ? 2 : 1], first + t[reversed ? 1 : 2]});
}

/// Removes the triangles in the plane z = 1.
void open_lid(PolygonMesh& mesh) {
  std::erase_if(mesh.triangles, [&](const Triangle& t) {
    return std::all_of(t.begin(), t.end(), [&](std::uint32_t p) { return mesh.world(p).z() == 1.0; });
  });
}

double nearest_vertex(const PolygonMesh& mesh, const Vector3d& at) {
  double nearest = 1;
  for (std::size_t i = 0; i < mesh.points.size(); ++i)
    nearest = std::min(nearest, (mesh.world(i) - at).norm());
  return nearest;
}

TEST(BoundedRemesh, ABoxIsKeptToTheErrorWithAFewTriangles) {
  const Vector3d low(0.1, -0.2, 0.3), high(1.1, 0.5, 0.9);
  const BoundedMesh made = reached(box(low, high), {.error = 0.02});
  EXPECT_LE(made.mesh.triangle_count(), 60u);
  EXPECT_GE(made.mesh.triangle_count(), 12u);
  double farthest = 0;
  for_each_place(made.mesh, 24,
                 [&](const Vector3d& p) { farthest = std::max(farthest, from_box(p, low, high)); });
  EXPECT_LE(farthest, made.to_surface);
  for (int corner = 0; corner < 8; ++corner) {
    const Vector3d at(corner & 1 ? high.x() : low.x(), corner & 2 ? high.y() : low.y(),
                      corner & 4 ? high.z() : low.z());
    EXPECT_LE(nearest_vertex(made.mesh, at), 0.03);
  }
}

TEST(BoundedRemesh, PlanePartsNeedFewVoxelsHoweverSmallTheError) {
  const PolygonMesh polygons = box(Vector3d(0, 0, 0), Vector3d(1, 1, 1));
  for (const double error : {0.02, 0.002, 0.0005}) {
    const BoundedMesh made = reached(polygons, {.error = error});
    EXPECT_EQ(made.mesh.triangle_count(), 12u);
    EXPECT_GT(made.voxel_size, 0.01);
  }
  // Across the lattice, too.
  const BoundedMesh made =
      reached(turned(box(Vector3d(0.1, -0.2, 0.3), Vector3d(1.1, 0.5, 0.9))), {.error = 0.01});
  EXPECT_EQ(made.mesh.triangle_count(), 12u);
  EXPECT_GT(made.voxel_size, 0.04);
}

TEST(BoundedRemesh, WhatLargeVoxelsDoNotShowIsThereAllTheSame) {
  // A box with a shaft within, a sixtieth of it wide.
  PolygonMesh both = box(Vector3d(0, 0, 0), Vector3d(1, 0.7, 0.6));
  append(both, box(Vector3d(0.4013, 0.3307, 0.2), Vector3d(0.4173, 0.3467, 0.5)), true);
  const BoundedMesh made = reached(both, {.error = 0.004});
  EXPECT_LE(nearest_vertex(made.mesh, Vector3d(0.4013, 0.3307, 0.2)), 0.0061);
}

TEST(BoundedRemesh, ASphereNeedsFewerTrianglesTheLargerTheError) {
  const PolygonMesh polygons = sphere(Vector3d(5, 5, 5), 1.0, 48);
  std::size_t before = 1u << 30;
  for (const double error : {0.015, 0.04, 0.1}) {
    const BoundedMesh made = reached(polygons, {.error = error});
    for_each_place(made.mesh, 8, [&](const Vector3d& p) {
      // The polygons themselves lie up to 0.0022 within the sphere.
      EXPECT_LE(std::abs((p - Vector3d(5, 5, 5)).norm() - 1.0), error + 0.0022);
    });
    EXPECT_LT(made.mesh.triangle_count(), before);
    before = made.mesh.triangle_count();
  }
}

TEST(BoundedRemesh, FacesWithinTheSolidDoNotCount) {
  // Of two boxes that overlap, the faces of each within the other bound nothing.
  PolygonMesh both = box(Vector3d(0, 0, 0), Vector3d(1, 1, 1));
  append(both, box(Vector3d(0.5, 0.25, 0.25), Vector3d(1.5, 0.75, 0.75)));
  const BoundedMesh made = reached(both, {.error = 0.03});
  // No position of the mesh is deep within either box.
  for_each_place(made.mesh, 16, [&](const Vector3d& p) {
    const double in_first = std::min((p - Vector3d(0, 0, 0)).minCoeff(), (Vector3d(1, 1, 1) - p).minCoeff());
    const double in_other =
        std::min((p - Vector3d(0.5, 0.25, 0.25)).minCoeff(), (Vector3d(1.5, 0.75, 0.75) - p).minCoeff());
    EXPECT_LE(in_first, 0.031);
    EXPECT_LE(in_other, 0.031);
  });
}

TEST(BoundedRemesh, AHoleIsRefusedWithItsPlaceUnlessItMayBeClosed) {
  PolygonMesh open = box(Vector3d(0, 0, 0), Vector3d(1, 1, 1));
  open_lid(open);
  ASSERT_EQ(open.triangles.size(), 10u);
  const BoundedMesh refused = remesh(open, {.error = 0.05});
  ASSERT_FALSE(refused.unmet.empty());
  EXPECT_TRUE(refused.mesh.empty());
  EXPECT_EQ(refused.unmet.front().why, Unmet::hole);
  const Vector3d at = refused.unmet.front().place;
  EXPECT_GT(at.z(), 0.5);
  EXPECT_GT(at.x(), 0.0);
  EXPECT_LT(at.x(), 1.0);
  EXPECT_NE(explanation(refused).find("hole"), std::string::npos);

  const BoundedMesh closed = reached(open, {.error = 0.05, .over_holes = true});
  EXPECT_GT(closed.hole_area, 0.5);
  EXPECT_FALSE(closed.mesh.empty());
}

TEST(BoundedRemesh, ASolidWithASmallHoleDoesNotBecomeAShell) {
  PolygonMesh tall = box(Vector3d(0, 0, -9), Vector3d(1, 1, 1)),
              flat = box(Vector3d(0, 0, 0.5), Vector3d(1, 1, 1));
  open_lid(tall);
  open_lid(flat);
  const BoundedRemeshOptions keep{.error = 0.05, .thin = ThinRule::keep};
  // The hole of the first has a fortieth of the polygons' area, that of the second a third.
  const BoundedMesh refused = remesh(tall, keep);
  ASSERT_FALSE(refused.unmet.empty());
  EXPECT_EQ(refused.unmet.front().why, Unmet::hole);
  EXPECT_FALSE(reached(flat, keep).mesh.empty());
}

TEST(BoundedRemesh, AWallTooThinIsRefusedWithItsThickness) {
  const PolygonMesh wall = box(Vector3d(0, 0, 0.01), Vector3d(1, 1, 0.0104));
  const BoundedMesh refused = remesh(wall, {.error = 0.05});
  ASSERT_FALSE(refused.unmet.empty());
  EXPECT_EQ(refused.unmet.front().why, Unmet::thin);
  EXPECT_NEAR(refused.thickness, 0.0004, 1e-6);
  // With voxels as small as the wall is thick it is there.
  const BoundedMesh made = reached(box(Vector3d(0, 0, 0.01), Vector3d(1, 1, 0.02)), {.error = 0.05});
  EXPECT_LE(made.voxel_size, 0.02);
}

/// A box with a fin of a height over a diagonal of its lid, 2e-4 thick at the middle of its foot, nothing at
/// its ends and its tip. (In a cube the diagonal would run through samples.)
PolygonMesh box_with_fin(double height) {
  const double width = 0.83;
  PolygonMesh mesh = box(Vector3d(0, 0, 0), Vector3d(1, width, 1));
  open_lid(mesh);
  const auto add = [&](const Vector3d& p) {
    mesh.points.push_back((p - mesh.origin).cast<float>());
    return std::uint32_t(mesh.points.size() - 1);
  };
  const auto corner = [&](double x, double y) {
    std::uint32_t p = 0;
    while ((mesh.world(p) - Vector3d(x, y, 1)).norm() > 1e-6) ++p;
    return p;
  };
  const std::uint32_t a = corner(0, 0), b = corner(1, 0), c = corner(1, width), d = corner(0, width);
  const Vector3d middle(0.5, 0.5 * width, 1), across = 1e-4 * Vector3d(width, -1, 0).normalized();
  const std::uint32_t foot = add(middle + across), other_foot = add(middle - across),
                      tip = add(middle + Vector3d(0, 0, height));
  for (const Triangle& t : {Triangle{a, b, foot},
                            {b, c, foot},
                            {c, d, other_foot},
                            {d, a, other_foot},
                            {a, foot, tip},
                            {foot, c, tip},
                            {c, other_foot, tip},
                            {other_foot, a, tip}})
    mesh.triangles.push_back(t);
  return mesh;
}

TEST(BoundedRemesh, AFinIsRefusedAtOnceWithItsThickness) {
  const BoundedMesh refused = remesh(box_with_fin(0.5), {.error = 0.05});
  ASSERT_FALSE(refused.unmet.empty());
  EXPECT_EQ(refused.unmet.front().why, Unmet::thin);
  const Vector3d at = refused.unmet.front().place;
  EXPECT_GT(at.z(), 1.05);
  // The sides are planes, so the fin thins out evenly from the middle of its foot to its ends and its tip.
  EXPECT_NEAR(refused.thickness, 2e-4 * (2.0 * std::min(at.x(), 1.0 - at.x()) - (at.z() - 1.0) / 0.5), 1e-6);
  EXPECT_EQ(refused.rounds, 0);
}

TEST(BoundedRemesh, AFinThatIsShallowerThanTheErrorNeedNotBeShown) {
  const BoundedMesh made = reached(box_with_fin(0.03), {.error = 0.05});
  EXPECT_GT(made.voxel_size, 2e-3);
}

/// Expects each point of the mesh and of the polygons outside of the excepted balls to be within the error of
/// the other; and both distances to be as large as stated at the balls' centres.
void expect_bound_outside_balls(const PolygonMesh& polygons, const BoundedMesh& made) {
  const auto distance = [](const PolygonMesh& mesh, const Vector3d& p) {
    double nearest = HUGE_VAL;
    for (const Triangle& t : mesh.triangles)
      nearest = std::min(nearest, squared_distance(p, mesh.world(t[0]), mesh.world(t[1]), mesh.world(t[2])));
    return std::sqrt(nearest);
  };
  const auto is_excepted = [&](const Vector3d& p) {
    return std::ranges::any_of(
        made.excepted, [&](const UnmetPlace& ball) { return (p - ball.place).norm() <= ball.radius; });
  };
  std::size_t outside = 0;
  for (const auto& [from, to, bound] : {std::tuple(&polygons, &made.mesh, made.from_surface),
                                        std::tuple(&made.mesh, &polygons, made.to_surface)}) {
    EXPECT_LE(bound, made.error);
    for_each_place(*from, 24, [&, to = to, bound = bound](const Vector3d& p) {
      if (is_excepted(p)) return;
      ++outside;
      EXPECT_LE(distance(*to, p), bound + 1e-6);
    });
  }
  EXPECT_GT(outside, 1000u);
  for (const UnmetPlace& ball : made.excepted) {
    EXPECT_GT(ball.radius, 0.0);
    EXPECT_GT(ball.area, 0.0);
    EXPECT_GE(std::max(distance(polygons, ball.place), distance(made.mesh, ball.place)),
              ball.distance - 1e-6);
  }
}

TEST(BoundedRemesh, ThinPartsMayBeExceptedWhileTheBoundHoldsElsewhere) {
  const PolygonMesh polygons = box_with_fin(0.5);
  EXPECT_NE(explanation(remesh(polygons, {.error = 0.05})).find("--except-thin"), std::string::npos);
  const BoundedMesh made = remesh(polygons, {.error = 0.05, .except_thin = true});
  ASSERT_TRUE(made.unmet.empty());
  ASSERT_FALSE(made.excepted.empty());
  expect_bound_outside_balls(polygons, made);
  // Only the fin, from the error above the lid on, is excepted: half its base times its height, on two sides.
  const double length = std::hypot(1.0, 0.83), fin = length * 0.5;
  EXPECT_LE(made.excepted_area(), fin);
  EXPECT_GE(made.excepted_area(), 0.8 * 0.9 * 0.9 * fin);
  for (const UnmetPlace& ball : made.excepted) {
    EXPECT_EQ(ball.why, Unmet::thin);
    EXPECT_GT(ball.place.z(), 1.0);
    EXPECT_LE(ball.radius, 4.0 * 0.05);
  }
}

TEST(BoundedRemesh, AHoleMayBeExcepted) {
  PolygonMesh open = box(Vector3d(0, 0, 0), Vector3d(1, 1, 1));
  open_lid(open);
  const BoundedMesh made = remesh(open, {.error = 0.05, .except_thin = true});
  ASSERT_TRUE(made.unmet.empty());
  ASSERT_FALSE(made.excepted.empty());
  expect_bound_outside_balls(open, made);
  EXPECT_NEAR(made.excepted_area(), 1.0, 0.2);
  EXPECT_EQ(made.excepted.front().why, Unmet::hole);
}

TEST(BoundedRemesh, ExceptionsChangeNothingWhereTheBoundHolds) {
  const PolygonMesh polygons = box(Vector3d(0.1, -0.2, 0.3), Vector3d(1.1, 0.5, 0.9));
  const BoundedMesh made = reached(polygons, {.error = 0.02, .except_thin = true});
  EXPECT_TRUE(made.excepted.empty());
  EXPECT_EQ(made.mesh, remesh(polygons, {.error = 0.02}).mesh);
}

TEST(BoundedRemesh, NotesADifferentNumberOfComponents) {
  // A crumb that is smaller than the error, next to the box, is not shown by voxels that show the box.
  PolygonMesh both = box(Vector3d(0, 0, 0), Vector3d(1, 1, 1));
  append(both, box(Vector3d(1.003, 0.513, 0.513), Vector3d(1.008, 0.518, 0.518)));
  const BoundedMesh made = reached(both, {.error = 0.05});
  EXPECT_EQ(made.topology.components, 2u);
  EXPECT_EQ(made.topology.genus, 0);
  EXPECT_EQ(topology_of(made.mesh.points, made.mesh.triangles).components, 1u);
  EXPECT_EQ(notes(made).size(), 1u);
  EXPECT_TRUE(notes(reached(box(Vector3d(0, 0, 0), Vector3d(1, 1, 1)), {.error = 0.05})).empty());
}

TEST(Topology, CountsComponentsAndHandles) {
  const auto of = [](const PolygonMesh& mesh) { return topology_of(mesh.points, triangulated(mesh)); };
  // The sphere is a soup, whose vertices are only joined by their positions.
  PolygonMesh mesh = sphere(Vector3d(0, 0, 0), 1.0, 8);
  EXPECT_EQ(of(mesh).components, 1u);
  EXPECT_EQ(of(mesh).genus, 0);
  append(mesh, box(Vector3d(3, 3, 3), Vector3d(4, 4, 4)));
  EXPECT_EQ(of(mesh).components, 2u);
  EXPECT_EQ(of(mesh).genus, 0);
  open_lid(mesh);
  EXPECT_EQ(of(mesh).genus, 0);
  mesh.triangles.pop_back();
  EXPECT_EQ(of(mesh).genus, std::nullopt);
  // A torus of 3 by 3 quads.
  PolygonMesh torus;
  for (int i = 0; i < 9; ++i) torus.points.push_back({float(i), 0, 0});
  for (std::uint32_t i = 0; i < 3; ++i)
    for (std::uint32_t j = 0; j < 3; ++j) {
      const auto at = [](std::uint32_t u, std::uint32_t v) { return 3 * (u % 3) + v % 3; };
      torus.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      torus.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  EXPECT_EQ(of(torus).genus, 1);
}

/// Remeshes without a volume if possible; expects both bounds to hold.
BoundedMesh simplified(const PolygonMesh& mesh, double error) {
  RunContext context;
  BoundedMesh made = bounded_remesh(mesh, {.error = error}, context);
  EXPECT_TRUE(made.unmet.empty());
  EXPECT_LE(made.to_surface, error);
  EXPECT_LE(made.from_surface, error);
  return made;
}

TEST(BoundedRemesh, AValidMeshNeedsNoVolume) {
  const PolygonMesh polygons = sphere(Vector3d(5, 5, 5), 1.0, 48);
  for (const double error : {0.003, 0.02, 0.1}) {
    const BoundedMesh made = simplified(polygons, error);
    EXPECT_EQ(made.voxel_size, 0.0);
    for_each_place(made.mesh, 8, [&](const Vector3d& p) {
      EXPECT_LE(std::abs((p - Vector3d(5, 5, 5)).norm() - 1.0), error + 0.0022);
    });
    if (error < 0.01) continue;
    EXPECT_LE(double(made.mesh.triangle_count()),
              1.2 * double(remesh(polygons, {.error = error}).mesh.triangle_count()));
  }
  const PolygonMesh cube = turned(box(Vector3d(0.1, -0.2, 0.3), Vector3d(1.1, 0.5, 0.9)));
  const BoundedMesh exact = simplified(cube, 1e-5);
  EXPECT_EQ(exact.voxel_size, 0.0);
  EXPECT_EQ(exact.mesh.triangle_count(), 12u);
  EXPECT_LE(std::max(exact.to_surface, exact.from_surface), 1e-6);
}

/// A sphere one vertex of which is pushed over its neighbours, so that triangles intersect.
PolygonMesh folded_sphere() {
  PolygonMesh polygons = sphere(Vector3d(0, 0, 0), 1.0, 48);
  const Eigen::Vector3f at = polygons.points[3 * 2400],
                        beyond = 1.003f * (at + 0.13f * at.unitOrthogonal()).normalized();
  for (Eigen::Vector3f& p : polygons.points)
    if (p == at) p = beyond;
  return polygons;
}

TEST(BoundedRemesh, FewTrianglesThatMeetOthersAreCollapsed) {
  const PolygonMesh polygons = folded_sphere();
  EXPECT_GT(
      manifold_polygons(polygons, std::vector<std::int8_t>(polygons.triangles.size(), 1), {})->pairs.size(),
      3u);
  const BoundedMesh made = simplified(polygons, 0.15);
  EXPECT_EQ(made.voxel_size, 0.0);
  EXPECT_EQ(topology_of(made.mesh.points, made.mesh.triangles).genus, 0);
  for_each_place(made.mesh, 8, [&](const Vector3d& p) { EXPECT_NEAR(p.norm(), 1.0, 0.16); });
}

TEST(BoundedRemesh, AValidMeshKeepsItsTopologyHoweverLargeTheError) {
  // A crumb next to a box with a cavity, all nearer to each other than the error.
  PolygonMesh mesh = box(Vector3d(0, 0, 0), Vector3d(1, 1, 1));
  append(mesh, box(Vector3d(0.01, 0.01, 0.01), Vector3d(0.99, 0.99, 0.99)), true);
  append(mesh, box(Vector3d(1.003, 0.513, 0.513), Vector3d(1.008, 0.518, 0.518)));
  const BoundedMesh made = simplified(mesh, 0.05);
  EXPECT_EQ(made.voxel_size, 0.0);
  EXPECT_EQ(topology_of(made.mesh.points, made.mesh.triangles).components, 3u);
  EXPECT_TRUE(notes(made).empty());
  // Given inside out as a whole.
  for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
  EXPECT_EQ(simplified(mesh, 0.05).mesh, made.mesh);
}

TEST(BoundedRemesh, PolygonsThatAreNoValidMeshBecomeAVolume) {
  const PolygonMesh cube = box(Vector3d(0, 0, 0), Vector3d(1, 1, 1));
  const auto with = [&](const Vector3d& low, const Vector3d& high, bool reversed = false) {
    PolygonMesh mesh = cube;
    append(mesh, box(low, high), reversed);
    return mesh;
  };
  PolygonMesh split = cube;  // a vertex on an edge, in one of its two triangles only
  split.points.push_back({0.5f, 0.0f, 0.0f});
  const auto has_edge = [](const Triangle& t, const PolygonMesh& mesh) {
    int on_edge = 0;
    for (const std::uint32_t p : t) on_edge += mesh.points[p].y() == 0.0f && mesh.points[p].z() == 0.0f;
    return on_edge == 2;
  };
  const auto at =
      std::ranges::find_if(split.triangles, [&](const Triangle& t) { return has_edge(t, split); });
  ASSERT_NE(at, split.triangles.end());
  Triangle first = *at, second = *at;
  for (std::size_t i = 0, replaced = 0; i < 3; ++i)
    if (split.points[first[i]].y() == 0.0f && split.points[first[i]].z() == 0.0f)
      (replaced++ == 0 ? first : second)[i] = 8;
  *at = first;
  split.triangles.push_back(second);
  for (const PolygonMesh& mesh :
       {with(Vector3d(0.5, 0.25, 0.25), Vector3d(1.5, 0.75, 0.75)),    // overlap
        with(Vector3d(1, 0.25, 0.25), Vector3d(1.5, 0.75, 0.75)),      // contact
        with(Vector3d(1, 1, 1), Vector3d(1.5, 1.5, 1.5)),              // a shared corner
        with(Vector3d(0.25, 0.25, 0.25), Vector3d(0.75, 0.75, 0.75)),  // a shell that bounds nothing
        with(Vector3d(0, 0, 0), Vector3d(1, 1, 1)), split})
    EXPECT_GT(simplified(mesh, 0.04).voxel_size, 0.0);
}

TEST(BoundedRemesh, ABudgetIsKept) {
  const PolygonMesh polygons = sphere(Vector3d(0, 0, 0), 1.0, 24);
  RunContext context;
  double before = 1.0;
  for (const std::size_t budget : {100u, 300u}) {
    const BoundedMesh made = remesh_to_budget(polygons, budget, {}, context);
    ASSERT_TRUE(made.unmet.empty());
    EXPECT_LE(made.mesh.triangle_count(), budget);
    EXPECT_GE(made.mesh.triangle_count(), budget / 2);
    EXPECT_LT(made.to_surface, before);
    before = made.to_surface;
  }
}

/// A rotated prism over a star with the requested number of points: only plane parts, and no edge along the
/// lattice.
PolygonMesh turned_star(int points) {
  PolygonMesh mesh;
  const Eigen::Quaterniond turn = Eigen::Quaterniond(0.8, 0.3, -0.4, 0.33).normalized();
  const auto add = [&](double x, double y, double z) {
    mesh.points.push_back((turn * Vector3d(x, y, z)).cast<float>());
    return std::uint32_t(mesh.points.size() - 1);
  };
  const std::uint32_t bottom = add(0, 0, 0), top = add(0, 0, 0.4), n = std::uint32_t(2 * points);
  for (std::uint32_t i = 0; i < n; ++i)
    for (const double z : {0.0, 0.4})
      add((1 + i % 2) * std::cos(2 * M_PI * i / n), (1 + i % 2) * std::sin(2 * M_PI * i / n), z);
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t a = 2 + 2 * i, b = 2 + 2 * ((i + 1) % n);
    for (const Triangle& t : {Triangle{bottom, b, a}, {top, a + 1, b + 1}, {a, b, b + 1}, {a, b + 1, a + 1}})
      mesh.triangles.push_back(t);
  }
  return mesh;
}

TEST(BoundedRemesh, ABudgetEndsAtOnceWhereFewerTrianglesAreExact) {
  for (const PolygonMesh& polygons :
       {box(Vector3d(-1, -1, -1), Vector3d(1, 1, 1)), box(Vector3d(0, 0, 0), Vector3d(2, 3, 4)),
        turned(box(Vector3d(0.1, -0.2, 0.3), Vector3d(1.1, 0.5, 0.9)))}) {
    RunContext context;
    const BoundedMesh made = remesh_to_budget(polygons, 500, {.most_points = 1e6}, context);
    ASSERT_TRUE(made.unmet.empty());
    EXPECT_EQ(made.mesh.triangle_count(), 12u);
    EXPECT_LE(std::max(made.to_surface, made.from_surface), 2e-4 * bounds(polygons).size().norm());
  }
}

TEST(BoundedRemesh, ATryThatFailsLosesNothing) {
  // Voxels small enough to show more of such a small object are below the smallest permitted voxel size.
  for (const double scale : {1.0, 1e-2, 1e-3, 3e-4}) {
    SCOPED_TRACE(scale);
    PolygonMesh polygons = turned_star(9);
    for (Eigen::Vector3f& p : polygons.points) p *= float(scale);
    RunContext context;
    const BoundedMesh made =
        remesh_to_budget(polygons, 500, {.most_points = 3e5, .through_volume = true}, context);
    ASSERT_TRUE(made.unmet.empty());
    EXPECT_LE(made.mesh.triangle_count(), 500u);
    EXPECT_LE(std::max(made.to_surface, made.from_surface), made.error);
    EXPECT_LE(made.error, 0.05 * bounds(polygons).size().norm());
  }
  // An object for which no voxel is small enough is an error.
  PolygonMesh polygons = turned_star(9);
  for (Eigen::Vector3f& p : polygons.points) p *= 1e-7f;
  RunContext context;
  EXPECT_THROW(remesh_to_budget(polygons, 500, {.through_volume = true}, context), Error);
}

TEST(BoundedRemesh, RefusesWhatHasNoBound) {
  RunContext context;
  const PolygonMesh cube = box(Vector3d(0, 0, 0), Vector3d(1, 1, 1));
  for (const double error : {0.0, -1.0, std::nan(""), HUGE_VAL})
    EXPECT_THROW(remesh(cube, {.error = error}), Error);
  EXPECT_THROW(remesh(PolygonMesh(), {.error = 0.1}), Error);
  PolygonMesh flat;
  flat.points = {{0, 0, 0}, {1, 0, 0}, {0, 0, 0}};
  flat.triangles = {{0, 1, 2}};
  EXPECT_THROW(remesh(flat, {.error = 0.1}), Error);
}

TEST(BoundedRemesh, NotesNoGenusOfAMeshThatTouchesItself) {
  // Two boxes with a common edge, whose four polygons leave the genus of the mesh undefined.
  BoundedMesh made;
  made.mesh = box(Vector3d(0, 0, 0), Vector3d(1, 1, 1));
  made.topology = topology_of(made.mesh.points, made.mesh.triangles);
  EXPECT_EQ(made.topology.genus, 0);
  append(made.mesh, box(Vector3d(1, 1, 0), Vector3d(2, 2, 1)));
  EXPECT_FALSE(topology_of(made.mesh.points, made.mesh.triangles).genus);
  EXPECT_TRUE(notes(made).empty());  // by the vertices of the edge they are one component
}

TEST(BoundedRemesh, SameBytesAtAnyThreadCount) {
  const PolygonMesh polygons = sphere(Vector3d(0.3, 0.2, 0.1), 1.0, 24);
  std::vector<PolygonMesh> made;
  for (const std::size_t threads : {1u, 2u, 7u}) {
    tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    made.push_back(remesh(polygons, {.error = 0.03}).mesh);
    made.push_back(simplified(folded_sphere(), 0.1).mesh);
  }
  for (std::size_t i = 2; i < made.size(); ++i) EXPECT_EQ(made[i], made[i % 2]);
}

TEST(BoundedRemesh, SameExceptionsAtAnyThreadCount) {
  std::vector<BoundedMesh> made;
  for (const std::size_t threads : {1u, 3u}) {
    tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    made.push_back(remesh(box_with_fin(0.5), {.error = 0.05, .except_thin = true}));
  }
  EXPECT_EQ(made[0].mesh, made[1].mesh);
  ASSERT_EQ(made[0].excepted.size(), made[1].excepted.size());
  for (std::size_t i = 0; i < made[0].excepted.size(); ++i) {
    EXPECT_EQ(made[0].excepted[i].place, made[1].excepted[i].place);
    EXPECT_EQ(made[0].excepted[i].radius, made[1].excepted[i].radius);
    EXPECT_EQ(made[0].excepted[i].area, made[1].excepted[i].area);
  }
}

}  // namespace bounded_remesh_test
}  // namespace hermesh
