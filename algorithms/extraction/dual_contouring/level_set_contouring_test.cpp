// Compares contouring directly from the samples with the general method, which uses Hermite data.
#include <gtest/gtest.h>
#include <openvdb/tools/Clip.h>
#include <openvdb/tools/LevelSetSphere.h>
#include <tbb/global_control.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numeric>
#include <random>
#include <tuple>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/extraction/dual_contouring/dual_contouring.h"
#include "algorithms/extraction/dual_contouring/qef.h"
#include "algorithms/hermite/samplers.h"
#include "algorithms/lattice/simd/simd_level.h"

namespace hermesh {
namespace level_set_contouring_test {

using openvdb::Coord;
using openvdb::FloatGrid;
using Placement = DualContouringOptions::Placement;

PolygonMesh by_hermite_data(const LevelSet& volume, double isovalue, const DualContouringOptions& options) {
  RunContext context;
  const FloatHermite hermite = sample_level_set(volume, isovalue, context);
  return dual_contouring(view_of(hermite, context), options, context);
}
PolygonMesh straight(const LevelSet& volume, double isovalue, const DualContouringOptions& options) {
  RunContext context;
  return contour_level_set(volume, isovalue, options, context);
}

/// OpenVDB visits its leaves node by node: 4096, 128 and 8 samples wide, each in the order of x, y and z.
auto order_in_tree(const std::array<std::int32_t, 3>& lower) {
  const auto at = [&](int bits) { return std::tuple(lower[0] >> bits, lower[1] >> bits, lower[2] >> bits); };
  return std::tuple(at(12), at(7), at(3));
}

/// Indices of the general method's vertices and quads in the order of the fast one's, and the function that
/// computes a vertex.
class Correspondence {
 public:
  std::vector<std::uint32_t> points, quads;

  Correspondence(const LevelSet& volume, double isovalue)
      : hermite_(sample_level_set(volume, isovalue, context_)), view_(view_of(hermite_, context_)) {
    const HermiteView::Blocks& blocks = view_.blocks();
    std::vector<std::uint32_t> first_point{0}, first_quad{0};
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      for_each_bit(cells_with_crossings(blocks, b), [&](int cell) { cells_.emplace_back(b, cell); });
      std::uint32_t edges = 0;
      for (const BlockMask& axis : blocks[b].crossing) edges += static_cast<std::uint32_t>(count(axis));
      first_point.push_back(static_cast<std::uint32_t>(cells_.size()));
      first_quad.push_back(first_quad.back() + edges);
    }
    std::vector<std::size_t> order(blocks.size());
    std::iota(order.begin(), order.end(), 0);
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return order_in_tree(blocks[a].lower) < order_in_tree(blocks[b].lower);
    });
    for (const std::size_t b : order) {
      for (std::uint32_t i = first_point[b]; i < first_point[b + 1]; ++i) points.push_back(i);
      for (std::uint32_t i = first_quad[b]; i < first_quad[b + 1]; ++i) quads.push_back(i);
    }
  }

  /// Returns the root mean square distance of a position from the planes of a cell, in voxels; both given by
  /// the general method's index.
  double misfit(std::uint32_t point, const Eigen::Vector3d& local) const {
    const auto [b, cell] = cells_[point];
    const HermiteView::Block& block = view_.blocks()[b];
    const IndexToWorld& placement = view_.placement();
    Eigen::Vector3d at = placement.linear.inverse() * (local - placement.offset);
    for (int axis = 0; axis < 3; ++axis) at[axis] -= block.lower[axis] - placement.base[axis];
    Qef qef(Eigen::Vector3d(cell >> 6, cell >> 3 & 7, cell & 7));
    for (int axis = 0; axis < 3; ++axis)
      for (int step = 0; step < 4; ++step) {
        int p[3] = {cell >> 6, cell >> 3 & 7, cell & 7};
        p[(axis + 1) % 3] += step & 1, p[(axis + 2) % 3] += step >> 1;
        const auto [there, sample] = locate(block.neighbours, p[0], p[1], p[2]);
        if (there < 0 || !test(view_.blocks()[static_cast<std::size_t>(there)].crossing[axis], sample))
          continue;
        const EdgeCrossing crossing = view_.crossing(there, sample, axis);
        Eigen::Vector3d place(p[0], p[1], p[2]);
        place[axis] += crossing.offset;
        qef.add_plane(place, Eigen::Vector3d(crossing.normal[0], crossing.normal[1], crossing.normal[2]));
      }
    return std::sqrt(qef.error(at) / qef.planes());
  }

 private:
  RunContext context_;
  FloatHermite hermite_;
  decltype(view_of(std::declval<const FloatHermite&>(), std::declval<RunContext&>())) view_;
  std::vector<std::pair<std::size_t, int>> cells_;  ///< block and cell of each point
};

/// Expects both methods to give the same quads around the same cells, except for a share of diagonals, and
/// vertices within 0.002 voxel. If several positions are equally good within rounding, the two methods may
/// choose different ones: then both must fit the planes equally well, except for a share of cells at the
/// threshold above which a vertex may leave its cell.
void expect_same_polygons(const LevelSet& volume, double isovalue, Placement placement, std::size_t at_least,
                          double share) {
  SCOPED_TRACE(placement == Placement::average   ? "average"
               : placement == Placement::optimal ? "optimal"
                                                 : "unbiased");
  const DualContouringOptions options{.placement = placement, .linear_crossings = true};
  const PolygonMesh general = by_hermite_data(volume, isovalue, options),
                    fast = straight(volume, isovalue, options);
  ASSERT_EQ(fast.points.size(), general.points.size());
  ASSERT_EQ(fast.quads.size(), general.quads.size());
  ASSERT_GE(fast.quads.size(), at_least);
  EXPECT_EQ(fast.origin, general.origin);
  const Correspondence correspondence(volume, isovalue);
  ASSERT_EQ(correspondence.points.size(), fast.points.size());
  std::size_t turned = 0, moved = 0, worse = 0;
  for (std::size_t i = 0; i < fast.quads.size(); ++i) {
    Quad quad = fast.quads[i];
    for (std::uint32_t& corner : quad) corner = correspondence.points[corner];
    const Quad& expected = general.quads[correspondence.quads[i]];
    if (quad == expected) continue;
    ++turned;
    const bool by_one = quad == Quad{expected[1], expected[2], expected[3], expected[0]} ||
                        quad == Quad{expected[3], expected[0], expected[1], expected[2]};
    ASSERT_TRUE(by_one) << "quad " << i;
  }
  for (std::size_t i = 0; i < fast.points.size(); ++i) {
    const std::uint32_t point = correspondence.points[i];
    if ((fast.world(i) - general.world(point)).norm() < 0.002 * volume.voxel_size()) continue;
    ++moved;
    const double fits = correspondence.misfit(point, fast.points[i].cast<double>());
    worse += fits > correspondence.misfit(point, general.points[point].cast<double>()) + 0.002;
  }
  EXPECT_LE(static_cast<double>(turned), share * static_cast<double>(fast.quads.size()));
  EXPECT_LE(static_cast<double>(moved), share * static_cast<double>(fast.points.size()));
  EXPECT_LE(static_cast<double>(worse), 0.0005 * static_cast<double>(fast.points.size()));
  if (placement == Placement::average) {
    EXPECT_EQ(moved, 0u);
  }
}

void expect_same_polygons(const LevelSet& volume, double isovalue, std::size_t at_least,
                          double share = 0.01) {
  expect_same_polygons(volume, isovalue, Placement::average, at_least, 0.0005);
  for (const Placement placement : {Placement::unbiased, Placement::optimal})
    expect_same_polygons(volume, isovalue, placement, at_least, share);
}

FloatGrid::Ptr sphere(float radius, openvdb::Vec3f centre, float half_width = 3.0f) {
  return openvdb::tools::createLevelSetSphere<FloatGrid>(radius, centre, 1.0f, half_width);
}

/// Samples −9…13 along each axis with the values of `value`, active if `active` returns true.
template <class Value, class Active>
FloatGrid::Ptr cube(float background, bool level_set, Value&& value, Active&& active) {
  const FloatGrid::Ptr grid = FloatGrid::create(background);
  if (level_set) grid->setGridClass(openvdb::GRID_LEVEL_SET);
  for (int x = -9; x < 14; ++x)
    for (int y = -9; y < 14; ++y)
      for (int z = -9; z < 14; ++z) {
        const float here = value(x, y, z);
        if (active())
          grid->tree().setValueOn(Coord(x, y, z), here);
        else
          grid->tree().setValueOff(Coord(x, y, z), here);
      }
  return grid;
}

constexpr auto kAlways = [] { return true; };

/// Returns a cube with sharp edges, none of which is parallel to an axis of the grid.
FloatGrid::Ptr turned_cube() {
  const Eigen::Vector3d u = Eigen::Vector3d(2, 1, 2) / 3, v = Eigen::Vector3d(-2, 2, 1) / 3, w = u.cross(v);
  const FloatGrid::Ptr grid = FloatGrid::create(4.0f);
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  for (int x = -30; x <= 30; ++x)
    for (int y = -30; y <= 30; ++y)
      for (int z = -30; z <= 30; ++z) {
        const Eigen::Vector3d p(x - 0.2, y + 0.3, z);
        const double distance = std::max({std::abs(u.dot(p)), std::abs(v.dot(p)), std::abs(w.dot(p))}) - 15.4;
        if (std::abs(distance) < 4.0) grid->tree().setValueOn(Coord(x, y, z), float(distance));
        if (distance <= -4.0) grid->tree().setValueOff(Coord(x, y, z), -4.0f);
      }
  return grid;
}

class LevelSetContouringTest : public testing::Test {
 protected:
  void SetUp() override { initialize_openvdb(); }
};

TEST_F(LevelSetContouringTest, SpheresAcrossNodesOfTheTree) {
  for (const openvdb::Vec3f centre :
       {openvdb::Vec3f(-2.3f, 127.6f, 1.7f), openvdb::Vec3f(4095.2f, 0.1f, -128.4f)})
    expect_same_polygons(make_level_set(sphere(30.0f, centre)), 0.0, 10000);
}

TEST_F(LevelSetContouringTest, AnIsovalueInsideTheBand) {
  expect_same_polygons(make_level_set(sphere(20.0f, {0.2f, 0.1f, 0.7f})), 1.25, 5000);
}

TEST_F(LevelSetContouringTest, ThinBandsWhoseStencilsReachBeyondTheData) {
  for (const float half_width : {2.0f, 1.5f, 1.2f})
    expect_same_polygons(make_level_set(sphere(20.0f, {0.2f, 0.1f, 0.7f}, half_width)), 0.0, 5000);
}

TEST_F(LevelSetContouringTest, SharpEdgesAndPointsThatLeaveTheirCells) {
  expect_same_polygons(make_level_set(turned_cube()), 0.0, 5000, 0.03);
}

TEST_F(LevelSetContouringTest, ATransformThatMirrorsShearsAndIsFarAway) {
  const FloatGrid::Ptr grid = sphere(15.0f, {0.2f, 0.1f, 0.7f});
  const openvdb::Mat4d matrix(-0.5, 0.1, 0.0, 0.0, 0.0, 0.25, 0.0, 0.0, 0.05, 0.0, 0.5, 0.0, 1e6, -2e5, 3.0,
                              1.0);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(matrix));
  expect_same_polygons(make_level_set(grid), 0.0, 3000);
}

TEST_F(LevelSetContouringTest, WhiteNoiseOfALevelSet) {
  for (const float background : {-1.0f, 1.0f}) {
    std::mt19937 random(11);
    std::uniform_real_distribution<float> noise(-1.0f, 1.0f);
    const auto value = [&](int, int, int) { return noise(random); };
    expect_same_polygons(make_level_set(cube(background, true, value, kAlways)), 0.0, 10000, 0.03);
  }
}

TEST_F(LevelSetContouringTest, ScatteredActiveSamplesOfAVolumeThatIsNoLevelSet) {
  for (const float background : {-1.0f, 1.0f})
    for (const double isovalue : {0.0, 0.31}) {
      std::mt19937 random(12);
      std::uniform_real_distribution<float> noise(-1.0f, 1.0f);
      const auto value = [&](int, int, int) { return noise(random); };
      expect_same_polygons(make_level_set(cube(background, false, value, [&] { return random() % 3 != 0; })),
                           isovalue, 10000, 0.03);
    }
}

/// Every edge is crossed: the most that a leaf can have, and the capacity of its lists.
FloatGrid::Ptr checkerboard() {
  std::mt19937 random(14);
  std::uniform_real_distribution<float> size(0.2f, 1.0f);
  return cube(
      1.0f, true, [&](int x, int y, int z) { return (x + y + z) % 2 == 0 ? size(random) : -size(random); },
      kAlways);
}

TEST_F(LevelSetContouringTest, LeavesAllOfWhoseEdgesAreCrossed) {
  expect_same_polygons(make_level_set(checkerboard()), 0.0, 3 * 23 * 23 * 22, 0.03);
}

TEST_F(LevelSetContouringTest, SamplesExactlyAtTheIsovalue) {
  std::mt19937 random(5);
  const auto value = [&](int, int, int) { return float(int(random() % 3) - 1); };
  // Many diagonals and positions are equally good here: only quads and average vertices are compared.
  expect_same_polygons(make_level_set(cube(2.0f, true, value, kAlways)), 0.0, Placement::average, 3000, 0.01);
}

TEST_F(LevelSetContouringTest, TilesBesideSamplesOfTheOtherSignAndBesideEachOther) {
  const FloatGrid::Ptr grid = FloatGrid::create(2.0f);
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  grid->tree().addTile(1, Coord(0, 0, 0), -1.5f, true);     // 8³ samples inside, within the background
  grid->tree().addTile(1, Coord(8, 0, 0), -0.5f, false);    // adjacent to another
  grid->tree().addTile(2, Coord(128, 0, 0), -1.0f, false);  // 128³ samples
  grid->tree().setValueOn(Coord(3, 9, 3), -0.25f);          // a leaf adjacent to a tile
  expect_same_polygons(make_level_set(grid), 0.0, Placement::average, 6 * 128 * 128, 0.0005);
}

TEST_F(LevelSetContouringTest, ABandThatWasClipped) {
  const FloatGrid::Ptr clipped =
      openvdb::tools::clip(*sphere(20.0f, {0.2f, 0.1f, 0.7f}), openvdb::BBoxd({-8, -11, -16}, {9, 40, 24}));
  clipped->setGridClass(openvdb::GRID_LEVEL_SET);
  expect_same_polygons(make_level_set(clipped), 0.0, Placement::average, 500, 0.002);
}

TEST_F(LevelSetContouringTest, OnASphereEveryAveragePointIsTheMeanOfItsCellsCrossings) {
  // One voxel inside at the origin, all others at 1: each of the eight cells around it has three crossings,
  // at 1/4.
  const FloatGrid::Ptr grid = FloatGrid::create(1.0f);
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  grid->tree().setValueOn(Coord(0, 0, 0), -1.0f / 3.0f);
  const PolygonMesh mesh = straight(make_level_set(grid), 0.0, {.placement = Placement::average});
  ASSERT_EQ(mesh.points.size(), 8u);
  ASSERT_EQ(mesh.quads.size(), 6u);
  for (std::size_t i = 0; i < 8; ++i)
    for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(std::abs(mesh.world(i)[axis]), 0.25 / 3, 1e-6);
}

TEST_F(LevelSetContouringTest, EmptyVolumesAndValuesThatAreNotFinite) {
  const FloatGrid::Ptr grid = FloatGrid::create(1.0f);
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  EXPECT_TRUE(straight(make_level_set(grid), 0.0, {}).empty());
  grid->tree().setValueOn(Coord(0, 0, 0), std::nanf(""));
  EXPECT_THROW(straight(make_level_set(grid), 0.0, {}), Error);
}

TEST_F(LevelSetContouringTest, SameBytesAtAnyLevelOfVectorCodeAndAnyThreadCount) {
  std::mt19937 random(13);
  std::uniform_real_distribution<float> noise(-1.0f, 1.0f);
  const auto value = [&](int, int, int) { return noise(random); };
  for (const LevelSet& volume : {make_level_set(sphere(50.0f, {0.1f, 0.2f, 0.3f})),
                                 make_level_set(turned_cube()), make_level_set(checkerboard()),
                                 make_level_set(cube(1.0f, false, value, [&] { return random() % 3 != 0; }))})
    for (const Placement placement : {Placement::average, Placement::unbiased, Placement::optimal}) {
      const DualContouringOptions options{.placement = placement, .linear_crossings = true};
      const PolygonMesh expected = straight(volume, 0.0, options);
      for (const SimdLevel level : available_simd_levels()) {
        setenv("HERMESH_SIMD", std::string(name(level)).c_str(), 1);
        EXPECT_TRUE(straight(volume, 0.0, options) == expected) << name(level);
      }
      unsetenv("HERMESH_SIMD");
      for (const int threads : {1, 2, 7}) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, std::size_t(threads));
        EXPECT_TRUE(straight(volume, 0.0, options) == expected) << threads << " threads";
      }
    }
}

}  // namespace level_set_contouring_test
}  // namespace hermesh
