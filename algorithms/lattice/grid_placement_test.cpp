#include "algorithms/lattice/grid_placement.h"

#include <gtest/gtest.h>

#include <random>

#include "algorithms/core/level_set_grid.h"

namespace hermesh {
namespace grid_placement_test {

using openvdb::Coord;

TEST(ActiveBox, IsThatOfVoxelsAndTilesAtAllLevels) {
  std::mt19937 random(17);
  const auto at_most = [&](int n) { return std::uniform_int_distribution<int>(-n, n)(random); };
  EXPECT_TRUE(active_box(openvdb::FloatTree(1.0f)).empty());
  for (int round = 0; round < 200; ++round) {
    openvdb::FloatTree tree(1.0f);
    for (int i = round % 12; i > 0; --i) {
      const Coord place(at_most(5000), at_most(300), at_most(40));
      switch (random() % 8) {
        case 0:
          tree.addTile(1 + random() % 3, place, 0.5f, random() % 2 == 0);
          break;
        case 1:
          tree.touchLeaf(place);  // without an active voxel
          break;
        default:
          for (int voxel = 0; voxel < 4; ++voxel)
            tree.setValue(place.offsetBy(at_most(9), at_most(9), at_most(9)), 0.5f);
      }
    }
    openvdb::CoordBBox expected;
    tree.evalActiveVoxelBoundingBox(expected);
    const openvdb::CoordBBox box = active_box(tree);
    EXPECT_EQ(box.empty(), expected.empty()) << round;
    if (!expected.empty()) {
      EXPECT_EQ(box, expected) << round;
    }
  }
}

TEST(GridPlacement, OfAShearedMirroredGridIsTheGridsOwn) {
  initialize_openvdb();
  auto grid = openvdb::FloatGrid::create(1.0f);
  openvdb::Mat4R matrix = openvdb::Mat4R::identity();
  matrix(0, 0) = -0.5;
  matrix(0, 1) = 0.1;
  matrix(2, 2) = 3.0;
  matrix.setTranslation(openvdb::Vec3R(1e5, 2, 3));
  grid->setTransform(openvdb::math::Transform::createLinearTransform(matrix));
  grid->tree().setValue(Coord(5, -6, 7), -1.0f);
  const IndexToWorld placement = placement_of(*grid);
  const openvdb::Vec3d expected = grid->indexToWorld(Coord(5, -6, 7));
  const Eigen::Vector3d found =
      placement.origin +
      placement.local(Eigen::Vector3d(5 - placement.base[0], -6 - placement.base[1], 7 - placement.base[2]));
  for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(found[axis], expected[axis], 1e-9);
  EXPECT_TRUE(placement.mirrors());
}

}  // namespace grid_placement_test
}  // namespace hermesh
