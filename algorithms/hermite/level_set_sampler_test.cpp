// The sampler against a plain one that looks up every sample in the tree.
#include <gtest/gtest.h>
#include <openvdb/tools/LevelSetSphere.h>
#include <openvdb/tools/Prune.h>
#include <tbb/global_control.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <map>
#include <random>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/hermite/samplers.h"
#include "algorithms/hermite/test_normals.h"
#include "algorithms/lattice/simd/simd_level.h"

namespace hermesh {
namespace level_set_sampler_test {

using Eigen::Vector3d;
using openvdb::Coord;
using EdgeKey = std::array<int, 4>;  ///< first sample and axis

/// A gradient from central differences of data, one-sided where data end.
Vector3d plain_gradient(const openvdb::FloatGrid& grid, const Coord& at) {
  const bool level_set = grid.getGridClass() == openvdb::GRID_LEVEL_SET;
  const auto is_data = [&](const Coord& p) {
    const float value = grid.tree().getValue(p);
    return level_set ? std::abs(value) < grid.background() : grid.tree().isValueOn(p);
  };
  Vector3d result = Vector3d::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    Coord low = at, high = at;
    --low[axis], ++high[axis];
    const double below = grid.tree().getValue(low), here = grid.tree().getValue(at),
                 above = grid.tree().getValue(high);
    if (is_data(low) && is_data(high))
      result[axis] = 0.5 * (above - below);
    else if (is_data(high) && is_data(at))
      result[axis] = above - here;
    else if (is_data(low) && is_data(at))
      result[axis] = here - below;
  }
  return result;
}

std::map<EdgeKey, EdgeCrossing> plain_sampler(const openvdb::FloatGrid& grid, double isovalue,
                                              const openvdb::CoordBBox& box) {
  const bool greater_is_inside =
      grid.getGridClass() != openvdb::GRID_LEVEL_SET && grid.background() < isovalue;
  const double scale = greater_is_inside ? -1.0 : 1.0;
  const auto value = [&](const Coord& at) { return scale * (double(grid.tree().getValue(at)) - isovalue); };
  std::map<EdgeKey, EdgeCrossing> result;
  for (auto it = box.begin(); it; ++it)
    for (int axis = 0; axis < 3; ++axis) {
      Coord next = *it;
      ++next[axis];
      const double from = value(*it), to = value(next);
      if ((from < 0) == (to < 0)) continue;
      const double t = from / (from - to);
      Vector3d normal = scale * ((1 - t) * plain_gradient(grid, *it) + t * plain_gradient(grid, next));
      if (!(normal[axis] * (to - from) > 0)) normal[axis] = to - from;
      normal.normalize();
      result[EdgeKey{(*it).x(), (*it).y(), (*it).z(), axis}] = {
          float(t), {float(normal[0]), float(normal[1]), float(normal[2])}};
    }
  return result;
}

void expect_as_plain(const openvdb::FloatGrid::Ptr& grid, double isovalue, std::size_t at_least) {
  RunContext context;
  const FloatHermite hermite = sample_level_set(make_level_set(grid), isovalue, context);
  check_consistent(hermite);
  openvdb::CoordBBox box = grid->evalActiveVoxelBoundingBox();
  box.expand(12);
  std::map<EdgeKey, EdgeCrossing> expected = plain_sampler(*grid, isovalue, box);
  ASSERT_GE(expected.size(), at_least);
  for (std::size_t leaf = 0; leaf < hermite.leaves.size(); ++leaf)
    for_each_crossing(hermite, leaf, [&](int axis, int sample, const EdgeCrossing& crossing) {
      const auto& lower = hermite.leaves[leaf].lower;
      const auto found = expected.find(
          {lower[0] + (sample >> 6), lower[1] + ((sample >> 3) & 7), lower[2] + (sample & 7), axis});
      ASSERT_NE(found, expected.end());
      // Single precision divides by the difference of the ends, which is small where the surface runs along
      // the edge.
      ASSERT_NEAR(crossing.offset, found->second.offset, 1e-4);
      for (int a = 0; a < 3; ++a)
        ASSERT_NEAR(crossing.normal[a], found->second.normal[a], 2e-5) << "axis " << a;
      expected.erase(found);
    });
  EXPECT_EQ(expected.size(), 0u);
}

class LevelSetSamplerTest : public testing::Test {
 protected:
  void SetUp() override { initialize_openvdb(); }
};

TEST_F(LevelSetSamplerTest, SpheresAcrossNodesOfTheTree) {
  for (const float half_width : {3.0f, 2.0f, 1.3f})
    expect_as_plain(openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(
                        30.0f, openvdb::Vec3f(-2.3f, 127.6f, 1.7f), 1.0f, half_width),
                    0.0, 10000);
}

TEST_F(LevelSetSamplerTest, AnIsovalueInsideTheBand) {
  expect_as_plain(openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(
                      20.0f, openvdb::Vec3f(0.2f, 0.1f, 0.7f), 1.0f, 3.0f),
                  1.25, 5000);
}

/// The band extends beyond values of the magnitude of the background: to six voxels inside of a surface and
/// three outside, and over all of a volume with a background of 0.
TEST_F(LevelSetSamplerTest, TheBackgroundsMagnitudeIsNotTheBandsEverywhere) {
  const Vector3d centre(0.2, 0.1, 0.7);
  for (const auto& [background, isovalue] : {std::pair(3.0f, -4.0), std::pair(0.0f, 0.0)}) {
    const auto grid = openvdb::FloatGrid::create(background);
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    for (int x = -19; x <= 19; ++x)
      for (int y = -19; y <= 19; ++y)
        for (int z = -19; z <= 19; ++z)
          grid->tree().setValueOn(Coord(x, y, z),
                                  std::min(3.0f, float((Vector3d(x, y, z) - centre).norm() - 14.0)));
    RunContext context;
    const FloatHermite hermite = sample_level_set(make_level_set(grid), isovalue, context);
    std::size_t crossings = 0;
    for_each_normal(hermite, [&](const Vector3d& place, const Vector3d& normal) {
      ++crossings;
      ASSERT_GT(normal.dot((place - centre).normalized()), 0.999) << background;
    });
    EXPECT_GT(crossings, 1500u);
  }
}

/// Samples that are clamped inside are no data, although their magnitude is less than that of the background:
/// the normals of a plane stay exact. Without tiles inside, the clamping is detected from the samples.
TEST_F(LevelSetSamplerTest, ABandThatIsNarrowerInside) {
  constexpr float kOutside = 4.0f, kInside = 1.2f;
  constexpr int kSide = 32;
  const Vector3d up = Vector3d(0.3, 0.5, 1.0).normalized();
  for (const bool tiles : {true, false}) {
    const auto grid = openvdb::FloatGrid::create(kOutside);
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    for (int x = 0; x < kSide; ++x)
      for (int y = 0; y < kSide; ++y)
        for (int z = 0; z < kSide; ++z) {
          const auto distance = float(up.dot(Vector3d(x, y, z) - Vector3d::Constant(15.3)));
          if (distance < kOutside && distance > -kInside)
            grid->tree().setValueOn(Coord(x, y, z), distance);
          else
            grid->tree().setValueOff(Coord(x, y, z), std::clamp(distance, -kInside, kOutside));
        }
    if (tiles) openvdb::tools::prune(grid->tree());
    RunContext context;
    const FloatHermite hermite = sample_level_set(make_level_set(grid), 0.0, context);
    int checked = 0;
    for_each_normal(hermite, [&](const Vector3d& place, const Vector3d& normal) {
      if (place.minCoeff() < 3 || place.maxCoeff() > kSide - 4) return;  // the plane ends beyond
      ++checked;
      ASSERT_GT(normal.dot(up), 1.0 - 1e-5) << tiles;
    });
    EXPECT_GT(checked, 800) << tiles;
  }
}

/// Squares of the differences would overflow single precision, or vanish in it.
TEST_F(LevelSetSamplerTest, HugeAndTinyValuesHaveTheSameNormals) {
  const auto scaled = [](float scale) {
    const auto grid = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(
        20.0f, openvdb::Vec3f(0.2f, 0.1f, 0.7f), 1.0f);
    for (auto it = grid->beginValueAll(); it; ++it) it.setValue(*it * scale);
    grid->tree().root().setBackground(3.0f * scale, false);
    RunContext context;
    return sample_level_set(make_level_set(grid), 0.0, context);
  };
  const FloatHermite expected = scaled(1.0f);
  for (const float scale : {0x1p80f, 0x1p-84f, 0x1p-110f}) {
    const FloatHermite found = scaled(scale);
    ASSERT_EQ(found.crossings.size(), expected.crossings.size()) << scale;
    for (std::size_t i = 0; i < found.crossings.size(); ++i) {
      ASSERT_NEAR(found.crossings[i].offset, expected.crossings[i].offset, 1e-5) << scale;
      for (int a = 0; a < 3; ++a)
        ASSERT_NEAR(found.crossings[i].normal[a], expected.crossings[i].normal[a], 1e-5) << scale;
    }
  }
}

TEST_F(LevelSetSamplerTest, ScatteredActiveSamplesOfAVolumeThatIsNoLevelSet) {
  // White noise, a third of it not active, over a background on either side of the isovalue.
  for (const float background : {-1.0f, 1.0f})
    for (const double isovalue : {0.0, 0.31}) {
      const auto grid = openvdb::FloatGrid::create(background);
      std::mt19937 random(11);
      std::uniform_real_distribution<float> values(-1.0f, 1.0f);
      for (int x = -9; x < 14; ++x)
        for (int y = -9; y < 14; ++y)
          for (int z = -9; z < 14; ++z) {
            const float value = values(random);
            if (random() % 3 == 0)
              grid->tree().setValueOff(Coord(x, y, z), value);
            else
              grid->tree().setValueOn(Coord(x, y, z), value);
          }
      expect_as_plain(grid, isovalue, 10000);
    }
}

TEST_F(LevelSetSamplerTest, SmoothFog) {
  const auto grid = openvdb::FloatGrid::create(0.0f);
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  for (int x = -20; x <= 20; ++x)
    for (int y = -20; y <= 20; ++y)
      for (int z = -20; z <= 20; ++z) {
        const double density = 1.0 - Vector3d(x - 0.3, y + 0.4, z).norm() / 18.0;
        if (density > 0) grid->tree().setValueOn(Coord(x, y, z), float(density));
      }
  expect_as_plain(grid, 0.4, 1000);
}

TEST_F(LevelSetSamplerTest, SamplesExactlyAtTheIsovalueAreOutside) {
  // Integers with a third of zeros: offsets of exactly 0 and 1 and no NaN.
  const auto grid = openvdb::FloatGrid::create(2.0f);
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  std::mt19937 random(5);
  for (int x = 0; x < 20; ++x)
    for (int y = 0; y < 20; ++y)
      for (int z = 0; z < 20; ++z) grid->tree().setValueOn(Coord(x, y, z), float(int(random() % 3) - 1));
  expect_as_plain(grid, 0.0, 3000);
}

TEST_F(LevelSetSamplerTest, EmptyAndFullVolumes) {
  RunContext context;
  const auto empty = openvdb::FloatGrid::create(3.0f);
  EXPECT_TRUE(sample_level_set(make_level_set(empty), 0.0, context).leaves.empty());
  // All samples are inside: there is no surface, and the outermost sign is inside.
  const auto full = openvdb::FloatGrid::create(-3.0f);
  full->setGridClass(openvdb::GRID_LEVEL_SET);
  const FloatHermite hermite = sample_level_set(make_level_set(full), 0.0, context);
  EXPECT_TRUE(hermite.leaves.empty());
  EXPECT_TRUE(hermite.outermost_inside);
}

/// A level set of noise, which crosses edges everywhere and of which every seventh sample is no data:
/// stencils end at all sides of leaves and of nodes of the tree, and there are tiles of both signs around it.
openvdb::FloatGrid::Ptr noise_with_tiles() {
  const auto grid = openvdb::FloatGrid::create(3.0f);
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  grid->tree().addTile(1, Coord(128, 128, 104), -3.0f, false);
  grid->tree().addTile(1, Coord(128, 128, 152), -3.0f, false);
  std::mt19937 random(23);
  std::uniform_real_distribution<float> values(-1.0f, 1.0f);
  for (int x = 111; x < 141; ++x)
    for (int y = 111; y < 141; ++y)
      for (int z = 112; z < 152; ++z) {
        const float value = values(random);
        if (random() % 7 == 0)
          grid->tree().setValueOff(Coord(x, y, z), std::copysign(3.0f, value));
        else
          grid->tree().setValueOn(Coord(x, y, z), value);
      }
  return grid;
}

TEST_F(LevelSetSamplerTest, NoiseWithStencilsThatEndAnywhere) {
  expect_as_plain(noise_with_tiles(), 0.0, 40000);
}

/// Every edge is crossed, in more consecutive leaves than the kernels process at once, to test the capacity
/// of their lists. Samples of the lowest layers are no data.
openvdb::FloatGrid::Ptr checkerboard() {
  const auto grid = openvdb::FloatGrid::create(1.0f);
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  std::mt19937 random(14);
  std::uniform_real_distribution<float> size(0.2f, 0.9f);
  for (int x = 0; x < 24; ++x)
    for (int y = 0; y < 24; ++y)
      for (int z = 0; z < 80; ++z) {
        const float value = (x + y + z) % 2 == 0 ? size(random) : -size(random);
        if (x > 1 && y > 1 && z > 1)
          grid->tree().setValueOn(Coord(x, y, z), value);
        else
          grid->tree().setValueOff(Coord(x, y, z), std::copysign(1.0f, value));
      }
  return grid;
}

TEST_F(LevelSetSamplerTest, LeavesAllOfWhoseEdgesAreCrossed) {
  const auto grid = checkerboard();
  expect_as_plain(grid, 0.0, 3 * 23 * 23 * 79);
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  expect_as_plain(grid, 0.0, 3 * 23 * 23 * 79);
}

/// Expects that the data of a volume are the same bytes however they are made, packed in any code or not.
void expect_same_bytes(const openvdb::FloatGrid::Ptr& grid) {
  const LevelSet volume = make_level_set(grid);
  RunContext context;
  const FloatHermite expected = sample_level_set(volume, 0.0, context);
  const auto expect_same = [&](const std::string& how) {
    const FloatHermite again = sample_level_set(volume, 0.0, context);
    EXPECT_TRUE(again.leaves == expected.leaves && again.crossings == expected.crossings) << how;
    for (const NormalCodeId code : kNormalCodes) {
      const PackedHermite packed = sample_level_set_packed(volume, 0.0, code, context);
      EXPECT_EQ(packed.normal_code, code);
      EXPECT_TRUE(packed.leaves == expected.leaves) << how;
      EXPECT_TRUE(packed.crossings == pack(expected, code, context).crossings) << how << ", " << name(code);
    }
  };
  for (const SimdLevel level : available_simd_levels()) {
    setenv("HERMESH_SIMD", std::string(name(level)).c_str(), 1);
    expect_same(std::string(name(level)));
  }
  unsetenv("HERMESH_SIMD");
  for (const int threads : {1, 2, 7}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, std::size_t(threads));
    expect_same(std::to_string(threads) + " threads");
  }
}

TEST_F(LevelSetSamplerTest, SameBytesAtAnyLevelOfVectorCodeAndAnyThreadCount) {
  expect_same_bytes(openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(
      50.0f, openvdb::Vec3f(0.1f, 0.2f, 0.3f), 1.0f));
  expect_same_bytes(noise_with_tiles());
  const auto fog = noise_with_tiles();  // not a level set: inactive samples are no data
  fog->setGridClass(openvdb::GRID_FOG_VOLUME);
  expect_same_bytes(fog);
  expect_same_bytes(checkerboard());
}

TEST_F(LevelSetSamplerTest, CrossingsAreInAscendingOrderOfLeavesAndSignsFollowFromThem) {
  RunContext context;
  const auto sphere =
      openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(40.0f, openvdb::Vec3f(0.0f, 0.0f, 0.0f), 1.0f);
  const FloatHermite hermite = sample_level_set(make_level_set(sphere), 0.0, context);
  EXPECT_TRUE(std::is_sorted(hermite.leaves.begin(), hermite.leaves.end(),
                             [](const SignLeaf& a, const SignLeaf& b) { return a.lower < b.lower; }));
  int missing_inside = 0;
  for (int x = -64; x < 64; x += 8)
    for (int y = -64; y < 64; y += 8)
      for (int z = -64; z < 64; z += 8) {
        if (hermite.find({x, y, z})) continue;
        const bool inside = sphere->tree().getValue(Coord(x + 3, y + 3, z + 3)) < 0.0f;
        ASSERT_EQ(hermite.sign_without_leaf({x, y, z}), inside);
        missing_inside += inside;
      }
  EXPECT_GT(missing_inside, 100);
}

TEST_F(LevelSetSamplerTest, ErrorsOfWhatRunsBesideTheSamplingAndCancellationArriveWhole) {
  const auto grid = [] {
    return openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(40.0f, openvdb::Vec3f(0.0f, 0.0f, 0.0f),
                                                                    1.0f);
  };
  for (const int threads : {1, 2, 7}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, std::size_t(threads));
    RunContext context;
    const auto perspective = grid();
    perspective->setTransform(openvdb::math::Transform::createFrustumTransform(
        openvdb::BBoxd(openvdb::Vec3d(0), openvdb::Vec3d(64)), 0.5, 10.0, 1.0));
    try {
      sample_level_set(make_level_set(perspective), 0.0, context);
      ADD_FAILURE() << "perspective with " << threads << " threads";
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("perspective"), std::string::npos) << error.what();
    }
    std::atomic<bool> cancel = true;
    context.cancel = &cancel;
    EXPECT_THROW(sample_level_set(make_level_set(grid()), 0.0, context), Cancelled) << threads;
  }
}

}  // namespace level_set_sampler_test
}  // namespace hermesh
