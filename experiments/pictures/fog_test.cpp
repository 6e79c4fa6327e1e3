#include "experiments/pictures/fog.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>

#include "algorithms/core/error.h"
#include "algorithms/core/level_set_grid.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// Density 1 at the samples 0 to 19 along each axis, 0.1 world units apart: trilinear interpolation spreads
/// it over 20 voxels.
LevelSet block_of_fog() {
  initialize_openvdb();
  const openvdb::FloatGrid::Ptr grid = openvdb::FloatGrid::create(0.0f);
  grid->fill(openvdb::CoordBBox({0, 0, 0}, {19, 19, 19}), 1.0f);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(0.1));
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  return make_level_set(grid);
}

TEST(FogScene, TransmittanceIsThatOfTheLengthInTheFog) {
  RunContext context;
  const FogScene scene(block_of_fog(), context);
  // A line across has 19 voxels of full density and two ramps of half a voxel's worth each: 2 world units.
  for (const double extinction : {0.1, 1.0, 3.0})
    EXPECT_NEAR(scene.transmittance({0.95, 0.95, 0.95}, Vector3d::UnitX(), extinction),
                std::exp(-2.0 * extinction), 1e-3);
  // Along a diagonal both ramps at an end are climbed at once, and t² over 0 to 1 is a third: 19 + 2/3
  // voxels.
  EXPECT_NEAR(-std::log(scene.transmittance({0.95, 0.95, 0.95}, {1, 1, 0}, 1.0)),
              0.1 * std::sqrt(2.0) * (19.0 + 2.0 / 3.0), 5e-3);
  EXPECT_DOUBLE_EQ(scene.transmittance({0.95, 5.0, 0.95}, Vector3d::UnitX(), 1.0), 1.0);
  EXPECT_DOUBLE_EQ(scene.transmittance({0.95, 0.95, 0.95}, Vector3d::UnitX(), 0.0), 1.0);
}

TEST(FogScene, ShowsFogWhereItIsAndShadesItFromTheLight) {
  RunContext context;
  const FogScene scene(block_of_fog(), context);
  const View view{.centre = {0.95, 0.95, 0.95}, .world_width = 4, .width = 40, .height = 40};
  const FogLook look{.extinction = 5.0, .towards_light = {1, 0, 0}};
  const Image image = scene.render(make_camera(0, 0), view, look, context);
  const auto blue_over_red = [&](int x, int y) {
    const std::uint32_t pixel = image.pixels[static_cast<std::size_t>(y * image.width + x)];
    return int(pixel & 0xff) - int(pixel >> 16 & 0xff);
  };
  const auto red = [&](int x, int y) {
    return image.pixels[static_cast<std::size_t>(y * 40 + x)] >> 16 & 0xff;
  };
  // The block covers the middle 20 of 40 pixels; fog is white, the sky is blue.
  EXPECT_GT(blue_over_red(3, 20), 40);
  EXPECT_LT(blue_over_red(27, 20), 20);
  // The light comes from +x, to the right.
  EXPECT_GT(red(27, 20), red(13, 20) + 20);
}

TEST(FogScene, TheSamePixelsAtAnyNumberOfThreads) {
  RunContext context;
  const View view{.centre = {0.95, 0.95, 0.95}, .world_width = 4, .width = 30, .height = 30};
  std::vector<std::vector<std::uint32_t>> pixels;
  for (const std::size_t threads : {1, 3}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    pixels.push_back(
        FogScene(block_of_fog(), context).render(make_camera(30, 20), view, FogLook(), context).pixels);
  }
  EXPECT_EQ(pixels[0], pixels[1]);
}

TEST(FogScene, RefusesEmptiness) {
  initialize_openvdb();
  RunContext context;
  EXPECT_THROW(FogScene(make_level_set(openvdb::FloatGrid::create(0.0f)), context), Error);
}

}  // namespace
}  // namespace hermesh
