#include "reference/pseudo_normal_voxelizer.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "algorithms/core/level_set_grid.h"
#include "reference/test_meshes.h"
#include "reference/variants.h"

namespace hermesh {
namespace pseudo_normal_voxelizer_test {

using Eigen::Vector3d;

/// The box of two opposite corners, closed and oriented, of twelve triangles.
PolygonMesh box(const Eigen::Vector3f& low, const Eigen::Vector3f& high) {
  PolygonMesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.points.emplace_back(i & 1 ? high.x() : low.x(), i & 2 ? high.y() : low.y(),
                             i & 4 ? high.z() : low.z());
  mesh.quads = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  return mesh;
}

struct Signs {
  std::size_t compared = 0, wrong = 0;
};
/// Signs of the active voxels farther than a thousandth of a voxel from the surface.
template <class Inside>
Signs signs_of(const LevelSet& level_set, Inside&& inside) {
  const openvdb::FloatGrid& grid = *level_set.grid().grid;
  Signs signs;
  for (auto value = grid.cbeginValueOn(); value; ++value) {
    if (std::abs(*value) < 1e-3 * level_set.voxel_size()) continue;
    const openvdb::Vec3d p = grid.transform().indexToWorld(value.getCoord());
    ++signs.compared;
    signs.wrong += (*value < 0.0f) != inside(Vector3d(p.x(), p.y(), p.z()));
  }
  return signs;
}

TEST(NearestPart, IsTheFaceAnEdgeOrACorner) {
  const std::array<Vector3d, 3> t = {Vector3d(0, 0, 0), Vector3d(4, 0, 0), Vector3d(0, 4, 0)};
  const auto part = [&](double x, double y, double z) { return nearest_part({x, y, z}, t).part; };
  EXPECT_EQ(part(1, 1, 5), TrianglePart::kFace);
  EXPECT_EQ(part(1, 1, -5), TrianglePart::kFace);
  EXPECT_EQ(part(2, -1, 3), TrianglePart::kEdge0);
  EXPECT_EQ(part(3, 3, 0), TrianglePart::kEdge1);
  EXPECT_EQ(part(-1, 2, 0), TrianglePart::kEdge2);
  EXPECT_EQ(part(-1, -1, 2), TrianglePart::kCorner0);
  EXPECT_EQ(part(5, -1, 0), TrianglePart::kCorner1);
  EXPECT_EQ(part(-1, 6, 0), TrianglePart::kCorner2);
  EXPECT_NEAR((nearest_part({3, 3, 7}, t).point - Vector3d(2, 2, 0)).norm(), 0.0, 1e-12);
  EXPECT_EQ(nearest_part({1, 1, 0}, {t[0], t[1], t[1]}).part, TrianglePart::kEdge0) << "without area";
}

/// At a cube's corner three faces meet with a right angle each, however they are cut into triangles: the sum
/// of the normals is along the diagonal. Without the angles the face that is cut there would count twice.
TEST(PseudoNormals, ThoseOfACubesCornersAreDiagonals) {
  const PolygonMesh mesh = box({0, 0, 0}, {1, 1, 1});
  const std::vector<Triangle> triangles = triangulated(mesh);
  const PseudoNormals normals(mesh.points, triangles);
  for (std::uint32_t t = 0; t < triangles.size(); ++t)
    for (int i = 0; i < 3; ++i) {
      const auto part = static_cast<TrianglePart>(static_cast<int>(TrianglePart::kCorner0) + i);
      const Vector3d outwards = 2.0 * mesh.points[triangles[t][i]].cast<double>() - Vector3d::Ones();
      EXPECT_NEAR((normals.of(t, part) - 0.5 * std::numbers::pi * outwards).norm(), 0.0, 1e-12)
          << t << ' ' << i;
    }
  // An edge between two triangles of one face has their normal twice; a cube's own edge those of both faces.
  for (std::uint32_t t = 0; t < triangles.size(); ++t)
    for (int i = 0; i < 3; ++i) {
      const auto part = static_cast<TrianglePart>(static_cast<int>(TrianglePart::kEdge0) + i);
      const double length =
          (mesh.points[triangles[t][i]] - mesh.points[triangles[t][(i + 1) % 3]]).cast<double>().norm();
      EXPECT_NEAR(normals.of(t, part).norm(), length > 1.2 ? 2.0 : std::sqrt(2.0), 1e-12) << t << ' ' << i;
    }
}

TEST(PseudoNormalVoxelizer, IsRightOnClosedOrientedModels) {
  for (const PolygonMesh& mesh :
       {test::turned_cube(1.0), test::torus(1.0, 0.4, 40, 20), test::sphere(1.0, 4)}) {
    const LevelSet truth = test::voxelize("exact", mesh, 0.09, 2.5, 4.0),
                   found = test::voxelize("pseudo-normals", mesh, 0.09, 2.5, 4.0);
    const openvdb::FloatGrid &a = *truth.grid().grid, &b = *found.grid().grid;
    EXPECT_EQ(a.activeVoxelCount(), b.activeVoxelCount());
    for (auto value = a.cbeginValueOn(); value; ++value)
      ASSERT_NEAR(*value, b.tree().getValue(value.getCoord()), 1e-6) << value.getCoord();
    EXPECT_FLOAT_EQ(b.background(), 0.225f);
  }
}

TEST(PseudoNormalVoxelizer, SolidsAreFilledByTilesAndFramesFollow) {
  PolygonMesh mesh = test::sphere(10.0, 4);
  mesh.origin = Vector3d(1e6, -1e6, 0.0);
  const LevelSet level_set = test::voxelize("pseudo-normals", mesh, 0.25);
  const openvdb::FloatGrid& grid = *level_set.grid().grid;
  EXPECT_FLOAT_EQ(grid.tree().getValue(grid.transform().worldToIndexCellCentered({1e6, -1e6, 0.0})), -0.75f);
  EXPECT_FLOAT_EQ(grid.tree().getValue({100, 0, 0}), 0.75f);
}

/// Near a sheet that lies within another part the normal indicates outside, though the point is inside of the
/// union: on one side of each wall that dives into the other box a layer of the band's width comes out wrong.
TEST(PseudoNormalVoxelizer, FailsWherePartsOverlap) {
  const Eigen::Vector3f shift(0.95f, 0.85f, 0.75f);
  const PolygonMesh both =
      test::joined(box({-1, -1, -1}, {1, 1, 1}), box(shift.array() - 1.0f, shift.array() + 1.0f));
  const auto inside = [&](const Vector3d& p) {
    return p.cwiseAbs().maxCoeff() < 1.0 || (p - shift.cast<double>()).cwiseAbs().maxCoeff() < 1.0;
  };
  const Signs signs = signs_of(test::voxelize("pseudo-normals", both, 0.11), inside);
  EXPECT_GT(20 * signs.wrong, signs.compared) << signs.wrong << " of " << signs.compared;
}

/// One face of six is reversed, as in unoriented models: in front of it the normal indicates inside, behind
/// it outside.
TEST(PseudoNormalVoxelizer, FailsWhereFacesAreTurnedOver) {
  PolygonMesh mesh = box({-1, -1, -1}, {1, 1, 1});
  std::swap(mesh.quads[0][1], mesh.quads[0][3]);
  const auto inside = [](const Vector3d& p) { return p.cwiseAbs().maxCoeff() < 1.0; };
  const Signs signs = signs_of(test::voxelize("pseudo-normals", mesh, 0.11), inside);
  EXPECT_GT(10 * signs.wrong, signs.compared) << signs.wrong << " of " << signs.compared;
}

TEST(PseudoNormalVoxelizer, RefusesAMeshWithoutArea) {
  PolygonMesh flat;
  flat.points = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  flat.triangles = {{0, 1, 2}};
  EXPECT_THROW(test::voxelize("pseudo-normals", flat, 0.1), Error);
}

}  // namespace pseudo_normal_voxelizer_test
}  // namespace hermesh
