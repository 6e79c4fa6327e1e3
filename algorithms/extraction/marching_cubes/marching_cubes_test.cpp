#include "algorithms/extraction/marching_cubes/marching_cubes.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <map>
#include <random>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/voxelization/voxelize_for_tests.h"

namespace hermesh {
namespace marching_cubes_test {

using openvdb::Coord;

openvdb::FloatGrid::Ptr outside_grid() {
  initialize_openvdb();
  auto grid = openvdb::FloatGrid::create(1.0f);
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  return grid;
}

/// Returns true if each edge of a triangle also belongs to another triangle, in the opposite direction.
bool is_closed(const PolygonMesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> sum;
  for (const Triangle& t : mesh.triangles)
    for (int i = 0; i < 3; ++i) {
      const std::uint32_t a = t[i], b = t[(i + 1) % 3];
      sum[std::minmax(a, b)] += a < b ? 1 : -1;
    }
  return std::ranges::all_of(sum, [](const auto& edge) { return edge.second == 0; });
}

/// Returns the number of vertices, one for each edge that changes sign, of a mesh that must be closed.
std::size_t points(const openvdb::FloatGrid::Ptr& grid, double isovalue) {
  RunContext context;
  const PolygonMesh mesh = marching_cubes(make_level_set(grid), isovalue, nullptr, context);
  EXPECT_TRUE(is_closed(mesh));
  return mesh.points.size();
}

TEST(MarchingCubes, OneInsideVoxelHasSixCrossingEdgesWhereverItLies) {
  for (const Coord at :
       {Coord(3, 3, 3), Coord(0, 0, 0), Coord(7, 7, 7), Coord(-1, 8, -8), Coord(4095, 0, -4096)}) {
    auto grid = outside_grid();
    grid->tree().setValue(at, -1.0f);
    EXPECT_EQ(points(grid, 0.0), 6u) << at;
  }
}

TEST(MarchingCubes, ATileOfTheOtherSignIsWalledIn) {
  // A single inside tile of 8³ in the background, where the tree has no leaf at all: 6 faces of 64 edges
  // each.
  auto grid = outside_grid();
  grid->tree().addTile(1, Coord(16, 16, 16), -1.0f, true);
  EXPECT_EQ(points(grid, 0.0), 6u * 64u);
  // And one of 128³.
  auto large = outside_grid();
  large->tree().addTile(2, Coord(0, 0, 0), -1.0f, true);
  EXPECT_EQ(points(large, 0.0), 6u * 128u * 128u);
}

TEST(MarchingCubes, AnActiveVoxelBesideATileOfTheOtherSign) {
  auto grid = outside_grid();
  grid->tree().addTile(1, Coord(0, 0, 0), -1.0f, true);
  grid->tree().setValue(Coord(8, 3, 3), 0.5f);  // its leaf does not replace the tile
  EXPECT_EQ(points(grid, 0.0), 6u * 64u);
}

TEST(MarchingCubes, AnIsovalueBeyondTheBackgroundHasNoSurfaceAndIsQuick) {
  auto grid = outside_grid();
  for (int i = 0; i < 100; ++i) grid->tree().setValue(Coord(1000 * i, -1000 * i, 0), -0.5f);
  EXPECT_EQ(points(grid, 1.5), 0u);
  EXPECT_EQ(points(grid, -1.5), 0u);
}

TEST(MarchingCubes, AnOutsideTileInAnInsideBackgroundIsWalledIn) {
  initialize_openvdb();
  auto grid = openvdb::FloatGrid::create(-1.0f);
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  grid->tree().addTile(2, Coord(0, 0, 0), 1.0f, true);
  EXPECT_EQ(points(grid, 0.0), 6u * 128u * 128u);
}

TEST(MarchingCubes, ASampleAtTheIsovalueIsOutside) {
  auto grid = outside_grid();
  grid->tree().setValue(Coord(3, 3, 3), 0.0f);
  EXPECT_EQ(points(grid, 0.0), 0u);
  EXPECT_EQ(points(grid, 0.5), 6u);
}

TEST(MarchingCubes, ABandOfOneVoxelIsEnough) {
  using namespace voxelize_for_tests;
  // Where a face lies on samples, the other end of its edges is a whole voxel away, and so beyond the band.
  for (const PolygonMesh& solid :
       {sphere({0.3, -0.2, 0.1}, 9.7), sphere({0, 0, 0}, 5.0, 140), box({-8, -8, -8}, {8, 8, 8})}) {
    const auto mesh = [&](double band) {
      RunContext context;
      const Voxelization made = run(solid, {.exterior_band = band, .interior_band = band});
      return marching_cubes(make_level_set(made.distance), 0.0, nullptr, context);
    };
    const auto volume = [](const PolygonMesh& made) {
      double sum = 0.0;
      for (const auto& [a, b, c] : made.triangles) {
        const Eigen::Vector3d p = made.points[a].cast<double>(), q = made.points[b].cast<double>();
        sum += p.cross(q).dot(made.points[c].cast<double>()) / 6.0;
      }
      return sum;
    };
    // Leaves differ, and with them the order of the points.
    const PolygonMesh narrow = mesh(1.0), wide = mesh(3.0);
    EXPECT_TRUE(is_closed(narrow));
    EXPECT_EQ(narrow.triangles.size(), wide.triangles.size());
    EXPECT_EQ(narrow.points.size(), wide.points.size());
    EXPECT_NEAR(volume(narrow) / volume(wide), 1.0, 1e-6);
  }
}

TEST(MarchingCubes, DenseFogIsInside) {
  initialize_openvdb();
  auto grid = openvdb::FloatGrid::create(0.0f);
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  grid->tree().setValue(Coord(3, 3, 3), 1.0f);
  EXPECT_EQ(points(grid, 0.5), 6u);
}

/// Cells that start outside the leaves, at all sides, edges and corners of leaves: each belongs to one leaf.
TEST(MarchingCubes, CellsBelowLeavesAreMadeOnce) {
  std::mt19937 random(5);
  for (int round = 0; round < 20; ++round) {
    auto grid = outside_grid();
    for (int i = 0; i < 60; ++i) {
      const auto at = [&] { return static_cast<int>(random() % 5) * 8 - static_cast<int>(random() % 2); };
      grid->tree().setValue(Coord(at(), at(), at()), -1.0f);
    }
    std::size_t edges = 0;
    for (auto voxel = grid->cbeginValueOn(); voxel; ++voxel)
      for (int axis = 0; axis < 3; ++axis)
        for (const int side : {-1, 1}) {
          Coord next = voxel.getCoord();
          next[axis] += side;
          edges += grid->tree().getValue(next) > 0;
        }
    EXPECT_EQ(points(grid, 0.0), edges) << round;
  }
}

}  // namespace marching_cubes_test
}  // namespace hermesh
