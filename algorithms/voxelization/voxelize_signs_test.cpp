// The signs that voxelize() gives to samples: shells, holes, crevices, and meshes without an inside.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "algorithms/voxelization/inside/winding_number.h"
#include "algorithms/voxelization/voxelize_for_tests.h"

namespace hermesh {
namespace voxelize_signs_test {

using Eigen::Vector3d;
using Eigen::Vector3f;
using namespace voxelize_for_tests;

TEST(VoxelizeSigns, NestedShellsAreFilledOrKept) {
  PolygonMesh mesh = sphere({0, 0, 0}, 20.0);
  append(mesh, sphere({0, 0, 0}, 10.0), true);
  const Voxelization filled = run(mesh, {.signs = SignRule::flood_fill});
  EXPECT_FLOAT_EQ(at(filled, 0, 0, 0), -3.0f);
  EXPECT_FALSE(filled.distance->tree().isValueOn({10, 0, 0})) << "the wall of a filled cavity bounds nothing";
  const Voxelization kept = run(mesh, {.signs = SignRule::winding_number});
  EXPECT_FLOAT_EQ(at(kept, 0, 0, 0), 3.0f);
  EXPECT_LT(at(kept, 12, 0, 0), 0.0);
  EXPECT_GT(at(kept, 8, 0, 0), 0.0);
}

TEST(VoxelizeSigns, AutomaticSignsKeepCavitiesThatFaceInwards) {
  PolygonMesh mesh = sphere({0, 0, 0}, 20.0);
  append(mesh, sphere({0, 0, 0}, 12.0), true);
  append(mesh, sphere({0, 0, 0}, 6.0));  // a body in the cavity
  append(mesh, sphere({50, 0, 0}, 8.0));
  for (const bool inside_out : {false, true}) {
    if (inside_out)
      for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
    RunContext context;
    const Voxelization v = voxelize(mesh, {}, context);
    EXPECT_TRUE(context.notes.empty()) << context.notes[0];
    EXPECT_LT(at(v, 0, 0, 0), 0.0);
    EXPECT_GT(at(v, 9, 0, 0), 0.0);
    EXPECT_LT(at(v, 16, 0, 0), 0.0);
    EXPECT_LT(at(v, 50, 0, 0), 0.0);
    EXPECT_GT(at(v, 30, 0, 0), 0.0);
  }
}

TEST(VoxelizeSigns, AShellThatFacesOutwardsWithinASolidIsFilled) {
  PolygonMesh mesh = sphere({0, 0, 0}, 20.0);
  append(mesh, sphere({0, 0, 0}, 12.0));
  EXPECT_LT(at(run(mesh), 0, 0, 0), 0.0);
  // A cavity that boxes enclose between them has no shell of its own.
  PolygonMesh room = box({-10, -10, -10}, {10, 10, -7});
  append(room, box({-10, -10, 7}, {10, 10, 10}));
  append(room, box({-10, -10, -8}, {10, -7, 8}));
  append(room, box({-10, 7, -8}, {10, 10, 8}));
  append(room, box({-10, -8, -8}, {-7, 8, 8}));
  append(room, box({7, -8, -8}, {10, 8, 8}));
  EXPECT_LT(at(run(room), 0, 0, 0), 0.0);
}

TEST(VoxelizeSigns, ANoteNamesACavityWithAWallThinnerThanAVoxel) {
  PolygonMesh mesh = sphere({100, 0, 0}, 20.0);
  append(mesh, sphere({100, 0, 0}, 19.7), true);
  RunContext context;
  const Voxelization v = voxelize(mesh, {}, context);
  EXPECT_LT(at(v, 100, 0, 0), 0.0);
  ASSERT_EQ(context.notes.size(), 1u);
  EXPECT_NE(context.notes[0].find("avity"), std::string::npos) << context.notes[0];
}

TEST(VoxelizeSigns, AutomaticSignsCloseAHole) {
  const PolygonMesh mesh = opened(20.0, 15.0);
  RunContext context;
  const Voxelization v = voxelize(mesh, {}, context);
  ASSERT_EQ(context.notes.size(), 1u);
  EXPECT_NE(context.notes[0].find("leaks"), std::string::npos);
  EXPECT_FLOAT_EQ(at(v, 0, 0, 0), -3.0f);
  EXPECT_FLOAT_EQ(at(v, 0, 0, 24), 3.0f);
  // Signs as the exact winding number has them, and a surface across the hole with a band around it.
  for (int z = 8; z < 22; ++z)
    for (int x = -6; x < 6; ++x) {
      const double w = exact_winding_number(mesh.points, mesh.triangles, 1.0, Vector3d(x, 1, z));
      if (std::abs(w - 0.5) > 0.02) {
        EXPECT_EQ(at(v, x, 1, z) < 0, w > 0.5) << x << ' ' << z << ' ' << w;
      }
      if (at(v, x, 1, z) < 0 && at(v, x, 1, z + 1) > 0) {
        EXPECT_LT(at(v, x, 1, z + 1) - at(v, x, 1, z), 1.6);
      }
    }
}

/// Its samples have coordinates of both signs, which truncation towards 0 instead of down once confused.
TEST(VoxelizeSigns, TheSurfaceAcrossAHoleDoesNotDependOnWhereTheHoleIs) {
  // The border is a saddle's, so the surface across is bent.
  PolygonMesh here = sphere({0, 0, 0}, 9.0, 48);
  std::erase_if(here.triangles, [&](const Triangle& t) {
    const Vector3f& p = here.points[t[0]];
    return p.z() > -2 + 0.05f * (p.x() * p.x() - p.y() * p.y());
  });
  PolygonMesh there = here;
  for (Vector3f& p : there.points) p += Vector3f(64, 64, 64);
  RunContext context;
  const Voxelization a = voxelize(here, {}, context), b = voxelize(there, {}, context);
  int in_cap = 0;
  for (int x = -6; x <= 6; ++x)
    for (int y = -6; y <= 6; ++y)
      for (int z = -8; z <= 6; ++z) {
        EXPECT_NEAR(at(a, x, y, z), at(b, x + 64, y + 64, z + 64), 1e-3) << x << ' ' << y << ' ' << z;
        in_cap += std::abs(at(a, x, y, z)) < 1;
      }
  EXPECT_GT(in_cap, 200);
}

TEST(VoxelizeSigns, AVoxelAtTheBottomOfACreviceIsOutside) {
  // Two boxes 0.4 voxels apart along the diagonal plane: no grid edge leads into the gap, which voxels lie
  // in.
  PolygonMesh mesh;
  const Vector3d along = Vector3d(1, 1, 0).normalized(), across = Vector3d(1, -1, 0).normalized();
  for (const double side : {-1.0, 1.0}) {
    PolygonMesh half = box({-15, 0.2, -8.3}, {15, 9, 8.3});
    for (Vector3f& p : half.points)
      p = (double(p.x()) * along + side * double(p.y()) * across + double(p.z()) * Vector3d::UnitZ())
              .cast<float>();
    append(mesh, half, side > 0);
  }
  const Voxelization v = run(mesh);
  EXPECT_GT(at(v, 9, 9, 0), 0.0) << "near the mouth";
  EXPECT_LT(at(v, 4, -2, 0), 0.0);
  EXPECT_LT(at(v, -2, 4, 0), 0.0);
}

TEST(VoxelizeSigns, VoxelsOneBehindTheOtherInASlitAreOutside) {
  // Between two boxes 0.2 to 0.4 voxel apart, which no grid edge goes along: a voxel deep in the slit sees
  // others in it, and only those at its mouth see the space around the boxes.
  for (int turn = 0; turn < 3; ++turn) {
    const Eigen::Matrix3d rotation =
        (Eigen::AngleAxisd(0.5 + 0.13 * turn, Vector3d::UnitX()) * Eigen::AngleAxisd(0.3, Vector3d::UnitY()))
            .toRotationMatrix();
    const double half = 0.1 + 0.05 * turn;
    PolygonMesh mesh;
    for (const double side : {-1.0, 1.0}) {
      PolygonMesh plate = box({-15, -15, side > 0 ? half : -8}, {15, 15, side > 0 ? 8 : -half});
      for (Vector3f& p : plate.points) p = (rotation * p.cast<double>()).cast<float>();
      append(mesh, plate);
    }
    const Voxelization v = run(mesh);
    int in_slit = 0;
    for (auto value = v.distance->cbeginValueOn(); value; ++value) {
      const openvdb::Coord c = value.getCoord();
      const Vector3d p = rotation.transpose() * Vector3d(c.x(), c.y(), c.z());
      if (std::abs(p.z()) > half - 1e-3 || std::max(std::abs(p.x()), std::abs(p.y())) > 15) continue;
      ++in_slit;
      EXPECT_GT(*value, 0.0) << p.transpose();
    }
    EXPECT_GT(in_slit, 100);
  }
}

TEST(VoxelizeSigns, AVoxelThatOnlyAWayWithABendLeadsToIsOutside) {
  // A chamber around (0, 0, z) with a narrow passage that turns twice before it ends at y = 8.2; no straight
  // segment leads through it. Plugged, it is a cavity.
  const auto block = [](double gap, bool plugged) {
    PolygonMesh mesh = box({-8.2, -8.2, -6.3}, {-0.3, 8.2, 6.3});
    append(mesh, box({-0.5, -8.2, -6.3}, {8.2, -0.3, 6.3}));
    append(mesh, box({-0.5, 0.3, -6.3}, {0.5, 8.2, 6.3}));
    append(mesh, box({0.3, -0.5, -6.3}, {0.7, 0.3 - gap, 6.3}));
    append(mesh, box({0.5 + gap, -0.5, -6.3}, {8.2, 8.2, 6.3}));
    append(mesh, box({-8.2, -8.2, 6.1}, {8.2, 8.2, 9.2}));
    append(mesh, box({-8.2, -8.2, -9.2}, {8.2, 8.2, -6.1}));
    if (plugged) append(mesh, box({0.45, 5.3, -6.3}, {0.65, 5.7, 6.3}));
    return mesh;
  };
  for (const double gap : {0.1, 0.002}) {
    const Voxelization open = run(block(gap, false)), closed = run(block(gap, true));
    for (int z = -5; z <= 5; ++z) {
      EXPECT_NEAR(at(open, 0, 0, z), 0.3, 1e-5) << gap;
      EXPECT_LT(at(closed, 0, 0, z), 0.0) << gap;
    }
    EXPECT_LT(at(open, -3, 3, 0), 0.0) << gap;
  }
}

TEST(VoxelizeSigns, APocketThatLooksIntoASharpCreaseFromWithinIsNotOutside) {
  // A closed prism, inside out, that narrows to a crease on the lattice: a hair off one of the walls there is
  // behind the other.
  PolygonMesh mesh;
  for (const float z : {-1.3f, 1.3f})
    for (const Vector3f& p :
         {Vector3f(3.5f, 0, z), Vector3f(3.2f, 0.0685714286f, z), Vector3f(-3.5f, 1.6f, z),
          Vector3f(-3.5f, -1.6f, z), Vector3f(3.2f, -0.0685714286f, z)})
      mesh.points.push_back(p);
  for (std::uint32_t i = 0; i < 5; ++i) {
    const std::uint32_t j = (i + 1) % 5;
    mesh.triangles.push_back({i, j + 5, j});
    mesh.triangles.push_back({i, i + 5, j + 5});
  }
  for (std::uint32_t i = 1; i < 4; ++i) {
    mesh.triangles.push_back({0, i, i + 1});
    mesh.triangles.push_back({5, i + 6, i + 5});
  }
  const Voxelization v = run(mesh, {.signs = SignRule::flood_fill});
  for (int x = -3; x <= 3; ++x) EXPECT_LT(at(v, x, 0, 0), 0.0) << x;
}

TEST(VoxelizeSigns, WindingNumbersOnVoxelsOfTheSurfaceMakeNoCaps) {
  const PolygonMesh mesh = box({-10, -10, -10}, {10, 10, 10});
  const Voxelization v = run(mesh, {.signs = SignRule::winding_number});
  EXPECT_LT(compare(mesh, v, 1.0, 3.0, 5).worst, 1e-5);
  EXPECT_EQ(compare(mesh, v, 1.0, 3.0, 5).active, 0u);
}

TEST(VoxelizeSigns, FloodFillStaysAFloodFillWhenAsked) {
  RunContext context;
  const Voxelization v = voxelize(opened(20.0, 15.0), {.signs = SignRule::flood_fill}, context);
  EXPECT_GT(at(v, 0, 0, 0), 0.0) << "the outside gets in through the hole";
}

TEST(VoxelizeSigns, AThinPlateIsNoLeak) {
  RunContext context;
  const Voxelization v = voxelize(box({-20, -20, 0.4}, {20, 20, 0.6}), {}, context);
  EXPECT_TRUE(v.is_signed);
  EXPECT_EQ(context.notes.size(), 0u) << context.notes[0];
  EXPECT_NEAR(at(v, 0, 0, 0), 0.4, 1e-6);
}

TEST(VoxelizeSigns, WithoutAnInsideThereIsNoSign) {
  PolygonMesh strip;  // Möbius
  constexpr int n = 60;
  for (int i = 0; i < n; ++i) {
    const double phi = 2 * std::numbers::pi * i / n;
    for (const double s : {-4.0, 4.0})
      strip.points.push_back(Vector3d((15 + s * std::cos(phi / 2)) * std::cos(phi),
                                      (15 + s * std::cos(phi / 2)) * std::sin(phi), s * std::sin(phi / 2))
                                 .cast<float>());
  }
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t a = 2 * i, b = a + 1;
    const std::uint32_t c = i + 1 < n ? a + 2 : 1, d = i + 1 < n ? a + 3 : 0;
    strip.triangles.push_back({a, b, c});
    strip.triangles.push_back({c, b, d});
  }
  RunContext context;
  const Voxelization v = voxelize(strip, {}, context);
  EXPECT_FALSE(v.is_signed);
  EXPECT_EQ(v.distance->getName(), "udf");
  ASSERT_EQ(context.notes.size(), 1u);
  EXPECT_LT(compare(strip, v, 1.0, 3.0, 5).worst, 1e-5);
}

}  // namespace voxelize_signs_test
}  // namespace hermesh
