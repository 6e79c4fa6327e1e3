#include "reference/level_set_judge.h"

#include <gtest/gtest.h>

#include <functional>

#include "algorithms/core/level_set_grid.h"
#include "reference/test_meshes.h"

namespace hermesh {
namespace level_set_judge_test {

using Eigen::Vector3d;
using openvdb::Coord;

/// Axis-aligned box of twelve triangles.
PolygonMesh box(const Vector3d& lower, const Vector3d& upper) {
  PolygonMesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.points.push_back(
        Vector3d(i & 1 ? upper.x() : lower.x(), i & 2 ? upper.y() : lower.y(), i & 4 ? upper.z() : lower.z())
            .cast<float>());
  mesh.quads = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  return mesh;
}

TEST(DistanceOracle, CubeByHand) {
  const DistanceOracle oracle(triangles_in_voxels(box({-1, -1, -1}, {1, 1, 1}), 0.5));  // half side 2 voxels
  EXPECT_DOUBLE_EQ(oracle.distance({0, 0, 0}), 2.0);
  EXPECT_DOUBLE_EQ(oracle.distance({5, 0.3, 0}), 3.0);
  EXPECT_DOUBLE_EQ(oracle.distance({5, 6, 0}), 5.0);
  EXPECT_DOUBLE_EQ(oracle.distance({4, 4, 4}), std::sqrt(12.0));
  EXPECT_DOUBLE_EQ(oracle.distance({5, 0, 0}, 1.5), 1.5);  // the bound, where that is smaller
  EXPECT_EQ(oracle.nearest_point({5, 6, 1}), Vector3d(2, 2, 1));
  EXPECT_TRUE(oracle.any_within({5, 0, 0}, 3.0));
  EXPECT_FALSE(oracle.any_within({5, 0, 0}, 2.999));
  EXPECT_EQ(oracle.triangles_within({2, 0.5, 0.1}, 1e-6).size(), 1u);
  EXPECT_GE(oracle.triangles_within({2, 2, 2}, 1e-6).size(), 3u);
  EXPECT_TRUE(oracle.parity({1.9, 0.1, 0.2}).inside());
  EXPECT_FALSE(oracle.parity({2.1, 0.1, 0.2}).inside());
  EXPECT_EQ(oracle.blocks_within(1.0, RunContext{}).size(), 8u);
}

TEST(DistanceOracle, NoTriangleOfAnyAreaIsAnError) {
  PolygonMesh mesh = box({0, 0, 0}, {1, 1, 1});
  mesh.quads = {{0, 0, 1, 1}};
  EXPECT_THROW(DistanceOracle(triangles_in_voxels(mesh, 0.1)), Error);
}

/// Points on a lattice through the box [−1.3, 1.3]³ in world units.
void for_lattice(double voxel, const std::function<void(const Vector3d&)>& f) {
  for (double x = -1.3; x < 1.3; x += 0.37)
    for (double y = -1.3; y < 1.3; y += 0.41)
      for (double z = -1.3; z < 1.3; z += 0.43) f(Vector3d(x, y, z) / voxel);
}

TEST(WindingOracle, IsTheSumOfSolidAnglesOnAnySoup) {
  PolygonMesh holed = test::sphere(1.0, 3);
  holed.triangles.erase(holed.triangles.begin() + 3, holed.triangles.begin() + 40);
  PolygonMesh mixed = test::joined(test::sphere(1.0, 2), test::sphere(0.6, 2, {0.5, 0, 0}));
  for (std::size_t i = 0; i < mixed.triangles.size(); i += 3)
    std::swap(mixed.triangles[i][0], mixed.triangles[i][1]);
  mixed.triangles.push_back(mixed.triangles[5]);
  for (const PolygonMesh& mesh : {test::sphere(1.0, 3), holed, mixed}) {
    const DistanceOracle surface(triangles_in_voxels(mesh, 0.1));
    const WindingOracle winding(surface);
    for_lattice(0.1, [&](const Vector3d& p) {
      EXPECT_NEAR(std::abs(winding(p)), std::abs(winding_number(surface.triangles(), p)), 1e-9)
          << p.transpose();
    });
  }
}

TEST(WindingOracle, InsideOutIsTurnedRound) {
  const DistanceOracle surface(triangles_in_voxels(test::reversed(test::sphere(1.0, 3)), 0.1));
  EXPECT_NEAR(winding_number(surface.triangles(), Vector3d::Zero()), -1.0, 1e-12);
  EXPECT_NEAR(WindingOracle(surface)(Vector3d::Zero()), 1.0, 1e-12);
}

TEST(WindingOracle, InsideOutIsTurnedRoundDespiteAHole) {
  // Five faces of a cube of edge 2, wound inwards. The cone from a point has a volume of −8 and a third of
  // the missing face times the point's height above it: at most −8 + 4 · 2 / 3.
  PolygonMesh open = box({-1, -1, -1}, {1, 1, 1});
  open.quads.pop_back();
  open = test::reversed(open);
  const DistanceOracle surface(triangles_in_voxels(open, 1.0));
  EXPECT_NEAR(winding_number(surface.triangles(), Vector3d::Zero()), -5.0 / 6.0, 1e-12);
  EXPECT_NEAR(WindingOracle(surface)(Vector3d::Zero()), 5.0 / 6.0, 1e-12);
}

TEST(WindingOracle, ASheetKeepsItsWinding) {
  // A square in the plane y = z: the cone to it from a point of its box has the volume (y − z) / 3, which is
  // ⅓ in one corner and −⅓ in the opposite one.
  PolygonMesh sheet;
  sheet.points = {{0, 0, 0}, {1, 0, 0}, {1, 1, 1}, {0, 1, 1}};
  sheet.quads = {{0, 1, 2, 3}};
  for (const PolygonMesh& mesh : {sheet, test::reversed(sheet)}) {
    const DistanceOracle surface(triangles_in_voxels(mesh, 0.1));
    const Vector3d below(5, 6, 4), above(5, 4, 6);
    for (const Vector3d& p : {below, above})
      EXPECT_NEAR(WindingOracle(surface)(p), winding_number(surface.triangles(), p), 1e-12);
  }
}

TEST(WindingOracle, KnowsTheBoundaryFromASheetInside) {
  const DistanceOracle surface(triangles_in_voxels(
      test::joined(box({-1, -1, -1}, {1, 1, 1}), box({0, -0.5, -0.5}, {2, 0.5, 0.5})), 0.1));
  const WindingOracle solid(surface);
  EXPECT_TRUE(solid.bounds_solid(surface, {-10, 1, 2}));
  EXPECT_TRUE(solid.bounds_solid(surface, {-10, -10, -10}));  // a corner
  EXPECT_TRUE(solid.bounds_solid(surface, {15, 5, 1}));
  EXPECT_FALSE(solid.bounds_solid(surface, {0, 1, 2}));   // the second box's side within the first
  EXPECT_FALSE(solid.bounds_solid(surface, {10, 1, 2}));  // and the other way round
}

TEST(WindingOracle, BoundaryOfTwoBoxesIsThatOfTheirUnion) {
  const DistanceOracle surface(triangles_in_voxels(
      test::joined(box({-1, -1, -1}, {1, 1, 1}), box({0, -0.5, -0.5}, {2, 0.5, 0.5})), 0.5));
  const DistanceOracle boundary(solid_boundary(surface, WindingOracle(surface), 0.05, RunContext{}));
  // In voxels: a cube of half side 2, and a bar of half width 1 from 0 to 4 along x.
  EXPECT_NEAR(surface.distance({1.0, 0, 0}), 1.0, 1e-12);
  EXPECT_NEAR(boundary.distance({1.0, 0, 0}), std::sqrt(2.0), 0.05);  // the seam, at (2, 1, 0)
  EXPECT_NEAR(boundary.distance({3.0, 0, 0}), 1.0, 1e-12);
  EXPECT_NEAR(boundary.distance({-1.5, 0, 0}), 0.5, 1e-12);
}

/// A cube turned against the grid, its exact level set, and the truth about it.
class Judge : public testing::Test {
 protected:
  static constexpr double kVoxel = 0.1;
  using Change = std::function<void(openvdb::FloatGrid&)>;

  LevelSet exact() const { return test::voxelize("exact", mesh_, kVoxel); }
  LevelSet changed(const Change& change) const {
    const openvdb::FloatGrid::Ptr copy = exact().grid().grid->deepCopy();
    change(*copy);
    return make_level_set(copy);
  }
  DistanceReport distances(const LevelSet& level_set, std::int64_t samples = 0) const {
    return DistanceTruth(surface_, solid_, {3.0, samples, 1}, context_)
        .judge(level_set, mesh_.origin, 3.0, 3.0, context_);
  }
  SignReport signs(const LevelSet& level_set, SignOracle oracle = SignOracle::kParity,
                   std::int64_t samples = 0) const {
    return SignTruth(surface_, solid_, oracle, {3.0, samples, 1}, context_).judge(level_set);
  }
  /// An active voxel whose value (in voxels) is near the given one.
  Coord voxel_with(double value) const {
    const openvdb::FloatGrid::ConstPtr grid = exact().grid().grid;
    for (auto v = grid->cbeginValueOn(); v; ++v)
      if (std::abs(*v / kVoxel - value) < 0.05) return v.getCoord();
    ADD_FAILURE() << "no voxel";
    return {};
  }

  RunContext context_;
  PolygonMesh mesh_ = test::turned_cube(1.0);
  DistanceOracle surface_{triangles_in_voxels(mesh_, kVoxel)};
  WindingOracle solid_{surface_};
};

TEST_F(Judge, AcceptsTheExactLevelSet) {
  for (const std::int64_t samples : {0, 2000}) {
    const DistanceReport report = distances(exact(), samples);
    EXPECT_GE(report.compared, samples ? 1990 : 10'000);
    EXPECT_LT(report.max, 1e-5);
    EXPECT_EQ(report.fine + report.stray + report.missing + report.missing_inner_sheet, 0);
    EXPECT_TRUE(report.places.empty());
    for (const SignOracle oracle :
         {SignOracle::kParity, SignOracle::kUnanimousParity, SignOracle::kWinding}) {
      if (samples == 0 && oracle != SignOracle::kParity) continue;
      const SignReport sides = signs(exact(), oracle, samples);
      EXPECT_GT(sides.inside, 500);
      EXPECT_GT(sides.outside, 500);
      EXPECT_EQ(sides.wrong(), 0);
    }
  }
}

TEST_F(Judge, FindsAPlantedValue) {
  const Coord at = voxel_with(-1.5);
  const DistanceReport report = distances(
      changed([&](auto& grid) { grid.tree().setValueOn(at, grid.tree().getValue(at) - 0.06f * kVoxel); }));
  EXPECT_EQ(report.fine, 1);
  EXPECT_EQ(report.coarse, 1);
  EXPECT_EQ(report.on_boundary, 1);
  EXPECT_EQ(report.on_inner_sheet, 0);
  EXPECT_NEAR(report.max, 0.06, 1e-5);
  EXPECT_NEAR(report.on_boundary_max, 0.06, 1e-5);
  EXPECT_NEAR(report.rms, 0.06 / std::sqrt(double(report.compared)), 1e-5);
  ASSERT_EQ(report.places.size(), 1u);
  EXPECT_EQ(report.places[0].voxel, (VoxelIndex{at.x(), at.y(), at.z()}));
  EXPECT_NEAR(report.places[0].value - report.places[0].truth, 0.06, 1e-5);
}

TEST_F(Judge, FindsAValueThatIsNoNumber) {
  const Coord at = voxel_with(1.5);
  const DistanceReport report =
      distances(changed([&](auto& grid) { grid.tree().setValueOn(at, std::nanf("")); }));
  EXPECT_EQ(report.fine, 1);
  EXPECT_TRUE(std::isinf(report.max));
}

TEST_F(Judge, FindsAPlantedSign) {
  const Coord in = voxel_with(-2.0), out = voxel_with(0.5);
  const LevelSet grid = changed([&](auto& g) {
    for (const Coord& at : {in, out}) g.tree().setValueOn(at, -g.tree().getValue(at));
  });
  EXPECT_EQ(distances(grid).fine, 0);  // the magnitude is right
  const SignReport report = signs(grid);
  EXPECT_EQ(report.wrong_inside, 1);
  EXPECT_EQ(report.wrong_outside, 1);
  ASSERT_EQ(report.places.size(), 2u);
  for (const VoxelFinding& place : report.places) EXPECT_LT(place.truth * place.value, 0.0);
  EXPECT_NEAR(report.wrong_share(), 2.0 / double(report.inside + report.outside), 1e-15);
}

TEST_F(Judge, FindsMissingAndStrayVoxels) {
  const Coord missing = voxel_with(2.0);
  const DistanceReport report = distances(changed([&](auto& grid) {
    grid.tree().setValueOff(missing, grid.background());
    grid.tree().setValueOn(voxel_with(2.93).offsetBy(0, 0, 0), grid.background());
    grid.tree().setValueOn({200, 0, 0}, grid.background());  // far from every block
    grid.tree().setValueOn({0, 0, 0}, -grid.background());   // deep inside
  }));
  EXPECT_EQ(report.missing, 1);
  EXPECT_EQ(report.missing_inner_sheet, 0);
  EXPECT_EQ(report.stray, 2);
  // Losing a whole leaf is found, too.
  const DistanceReport holed =
      distances(changed([&](auto& grid) { grid.tree().addTile(1, missing, grid.background(), false); }));
  EXPECT_GT(holed.missing, 10);
}

TEST_F(Judge, FindsThemInSamplesToo) {
  const LevelSet shifted = changed([&](auto& grid) {
    for (auto v = grid.beginValueOn(); v; ++v) v.setValue(*v + 0.01f * kVoxel);
  });
  const DistanceReport report = distances(shifted, 2000);
  EXPECT_EQ(report.fine, report.compared);
  EXPECT_NEAR(report.max, 0.01, 1e-5);
  const LevelSet narrow = test::voxelize("exact", mesh_, kVoxel, 2.0, 2.0);
  EXPECT_GT(distances(narrow, 2000).missing, 400);
  const LevelSet wide = test::voxelize("exact", mesh_, kVoxel, 3.9, 3.9);
  EXPECT_GT(distances(wide, 2000).stray, 100);
}

TEST_F(Judge, TellsSheetsInsideTheSolidApart) {
  mesh_ = test::joined(box({-1, -1, -1}, {1, 1, 1}), box({0, -0.55, -0.55}, {2, 0.55, 0.55}));
  const DistanceOracle surface(triangles_in_voxels(mesh_, kVoxel));
  const WindingOracle solid(surface);
  const DistanceTruth truth(surface, solid, {}, context_);
  const auto judged = [&](const Coord& at, bool on) {
    return truth.judge(changed([&](auto& grid) {
                         grid.tree().setValueOn(at, 0.07f * kVoxel);
                         if (!on) grid.tree().setValueOff(at);
                       }),
                       mesh_.origin, 3.0, 3.0, context_);
  };
  EXPECT_EQ(judged({2, 0, 0}, true).on_inner_sheet, 1);
  EXPECT_EQ(judged({18, 0, 0}, true).on_boundary, 1);
  EXPECT_EQ(judged({2, 0, 0}, false).missing_inner_sheet, 1);
  EXPECT_EQ(judged({2, 0, 0}, false).missing, 0);
  EXPECT_EQ(judged({18, 0, 0}, false).missing, 1);
}

TEST_F(Judge, TheDrawIsTheSameForTheSameSeed) {
  const DistanceReport a = distances(exact(), 500), b = distances(exact(), 500);
  EXPECT_EQ(a.compared, b.compared);
  EXPECT_EQ(a.rms, b.rms);
}

TEST_F(Judge, RefusesSamplesThatLieElsewhere) {
  const LevelSet moved = changed([](auto& grid) {
    grid.setTransform(openvdb::math::Transform::createLinearTransform(kVoxel));
    grid.transform().postTranslate({0.3 * kVoxel, 0, 0});
  });
  EXPECT_THROW(distances(moved), Error);
}

}  // namespace level_set_judge_test
}  // namespace hermesh
