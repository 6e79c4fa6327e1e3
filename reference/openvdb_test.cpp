#include <gtest/gtest.h>
#include <openvdb/tools/ChangeBackground.h>

#include <atomic>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "algorithms/core/level_set_grid.h"
#include "reference/test_meshes.h"
#include "reference/variants.h"

namespace hermesh {
namespace openvdb_test {

const double kSphereVolume = 4.0 / 3.0 * std::numbers::pi;

TEST(OpenvdbExtractor, SphereIsClosedOutwardAndOfTheRightVolume) {
  const LevelSet level_set = test::voxelize("openvdb", test::sphere(1.0, 5), 0.05);
  for (const char* adaptivity : {"0", "0.1", "1"}) {
    const PolygonMesh mesh = test::extract("openvdb", level_set, {{"adaptivity", adaptivity}});
    EXPECT_TRUE(test::closed_and_oriented(mesh)) << adaptivity;
    EXPECT_EQ(test::euler_characteristic(mesh), 2) << adaptivity;
    // At adaptivity 1 a leaf has about one point, and the sphere is a coarse polyhedron.
    EXPECT_NEAR(test::signed_volume(mesh), kSphereVolume, 0.1 * kSphereVolume) << adaptivity;
  }
}

TEST(OpenvdbExtractor, AdaptivityTakesPolygonsAway) {
  const LevelSet level_set = test::voxelize("openvdb", test::turned_cube(1.0), 0.05);
  const PolygonMesh uniform = test::extract("openvdb", level_set);
  const PolygonMesh adaptive = test::extract("openvdb", level_set, {{"adaptivity", "0.5"}});
  EXPECT_TRUE(uniform.triangles.empty());
  EXPECT_LT(4 * adaptive.triangle_count(), uniform.triangle_count());
}

TEST(OpenvdbExtractor, IsovalueMovesTheSurface) {
  const LevelSet level_set = test::voxelize("openvdb", test::sphere(1.0, 5), 0.05);
  const double volume = test::signed_volume(test::extract("openvdb", level_set, {}, 0.1));
  EXPECT_NEAR(volume, kSphereVolume * std::pow(1.1, 3), 0.02 * volume);
}

TEST(ReferenceExtractors, InsideIsTheSameForAll) {
  const LevelSet level_set = test::voxelize("openvdb", test::sphere(1.0, 4), 0.1);
  const openvdb::FloatGrid::Ptr plain = level_set.grid().grid->deepCopy(), fog = plain->deepCopy();
  plain->setGridClass(openvdb::GRID_UNKNOWN);
  fog->setGridClass(openvdb::GRID_FOG_VOLUME);
  openvdb::tools::changeBackground(fog->tree(), -fog->background());
  for (auto value = fog->beginValueOn(); value; ++value) value.setValue(-*value);
  for (const Extractor& extractor : reference_extractors())
    for (const LevelSet& volume : {level_set, make_level_set(plain), make_level_set(fog)}) {
      const PolygonMesh mesh = test::extract(extractor.name, volume);
      EXPECT_TRUE(test::closed_and_oriented(mesh)) << extractor.name;
      EXPECT_NEAR(test::signed_volume(mesh), kSphereVolume, 0.2 * kSphereVolume) << extractor.name;
    }
}

TEST(ReferenceExtractors, NanIsRefused) {
  const LevelSet level_set = test::voxelize("openvdb", test::sphere(1.0, 4), 0.1);
  const openvdb::FloatGrid::Ptr grid = level_set.grid().grid->deepCopy();
  grid->tree().setValue({10, 0, 0}, std::numeric_limits<float>::quiet_NaN());
  for (const Extractor& extractor : reference_extractors()) {
    EXPECT_THROW(test::extract(extractor.name, make_level_set(grid)), Error) << extractor.name;
    EXPECT_THROW(test::extract(extractor.name, level_set, {}, std::nan("")), Error) << extractor.name;
  }
}

TEST(ReferenceExtractors, PlateausAtTheIsovalueEndInAMeshOrAnError) {
  initialize_openvdb();
  const openvdb::FloatGrid::Ptr grid = openvdb::FloatGrid::create(1.0f);
  std::mt19937 random(2);
  openvdb::FloatGrid::Accessor values = grid->getAccessor();
  for (int x = 0; x < 10; ++x)
    for (int y = 0; y < 10; ++y)
      for (int z = 0; z < 10; ++z) values.setValue({x, y, z}, float(int(random() % 3) - 1));
  for (const char* extractor : {"openvdb", "marching-cubes-decimated"})
    EXPECT_TRUE(test::closed_and_oriented(test::extract(extractor, make_level_set(grid)))) << extractor;
  // The trilinear isosurface is no surface there. Refinement may end, and then the mesh is good.
  try {
    EXPECT_TRUE(test::closed_and_oriented(
        test::extract("cgal-surface-mesher", make_level_set(grid), {{"max_points", "5000"}})));
  } catch (const Error&) {
  }
}

TEST(OpenvdbExtractor, FarFromTheOriginNothingIsLost) {
  PolygonMesh near_mesh = test::sphere(1.0, 4), far_mesh = near_mesh;
  far_mesh.origin = Eigen::Vector3d(1 << 24, -(1 << 26), 0.0);
  const PolygonMesh here = test::extract("openvdb", test::voxelize("openvdb", near_mesh, 0.1));
  const PolygonMesh there = test::extract("openvdb", test::voxelize("openvdb", far_mesh, 0.1));
  ASSERT_EQ(here.points.size(), there.points.size());
  EXPECT_EQ(here.quads, there.quads);
  double largest = 0.0;
  for (std::size_t i = 0; i < here.points.size(); ++i)
    largest = std::max(largest, (there.world(i) - far_mesh.origin - here.world(i)).norm());
  // Doubles are 1.5e-8 apart at 2^26, single precision would be 8.
  EXPECT_LT(largest, 1e-6);
}

TEST(OpenvdbExtractor, EmptyGridGivesAnEmptyMesh) {
  initialize_openvdb();
  EXPECT_TRUE(test::extract("openvdb", make_level_set(openvdb::FloatGrid::create(1.0f))).empty());
}

TEST(OpenvdbExtractor, NoiseIsClosedAtEveryAdaptivity) {
  initialize_openvdb();
  const openvdb::FloatGrid::Ptr grid = openvdb::FloatGrid::create(1.0f);
  std::mt19937 random(1);
  openvdb::FloatGrid::Accessor values = grid->getAccessor();
  for (int x = 0; x < 24; ++x)
    for (int y = 0; y < 24; ++y)
      for (int z = 0; z < 24; ++z) values.setValue({x, y, z}, float(random() % 2048) / 1024.0f - 1.0f);
  for (const char* adaptivity : {"0", "0.5"})
    EXPECT_TRUE(test::closed_and_oriented(
        test::extract("openvdb", make_level_set(grid), {{"adaptivity", adaptivity}})))
        << adaptivity;
}

TEST(OpenvdbVoxelizer, BandsBackgroundNameAndPlacement) {
  PolygonMesh mesh = test::sphere(1.0, 5);
  mesh.origin = Eigen::Vector3d(100.0, 0.0, 0.0);
  const LevelSet level_set = test::voxelize("openvdb", mesh, 0.05, 2.0, 4.0);
  const openvdb::FloatGrid& grid = *level_set.grid().grid;
  EXPECT_EQ(grid.getName(), "sdf");
  EXPECT_EQ(grid.getGridClass(), openvdb::GRID_LEVEL_SET);
  EXPECT_FLOAT_EQ(grid.background(), 0.1f);
  const openvdb::Coord centre = grid.transform().worldToIndexCellCentered({100.0, 0.0, 0.0});
  EXPECT_FLOAT_EQ(grid.tree().getValue(centre), -0.2f);
  EXPECT_NEAR(grid.tree().getValue(centre + openvdb::Coord(20, 0, 0)), 0.0, 0.01);
}

TEST(OpenvdbVoxelizer, OpenMeshIsNoted) {
  PolygonMesh mesh = test::sphere(1.0, 4);
  mesh.triangles.resize(mesh.triangles.size() / 2);
  RunContext context;
  find_variant(reference_voxelizers(), "openvdb").voxelize({mesh, 0.1, 3.0, 3.0, context});
  EXPECT_EQ(context.notes.size(), 1u);
}

TEST(ReferenceVariants, AllStopWhenCancelled) {
  const PolygonMesh mesh = test::sphere(1.0, 4);
  const LevelSet level_set = test::voxelize("openvdb", mesh, 0.1);
  const std::atomic<bool> cancel = true;
  for (const Voxelizer& voxelizer : reference_voxelizers()) {
    RunContext context;
    context.cancel = &cancel;
    EXPECT_THROW(voxelizer.voxelize({mesh, 0.1, 3.0, 3.0, context}), Cancelled) << voxelizer.name;
  }
  for (const Extractor& extractor : reference_extractors()) {
    RunContext context;
    context.cancel = &cancel;
    const Options options(extractor.name, extractor.options, {});
    EXPECT_THROW(extractor.extract({level_set, 0.0, nullptr, options, context}), Cancelled) << extractor.name;
  }
}

}  // namespace openvdb_test
}  // namespace hermesh
