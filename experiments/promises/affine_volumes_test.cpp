// Volumes under random affine maps, with values over the range of single precision: the meshes of certified
// extractors have no self-intersections.
#include <gtest/gtest.h>
#include <openvdb/openvdb.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "experiments/promises/methods_for_tests.h"

namespace hermesh {
namespace affine_volumes_test {

using openvdb::Coord;

double uniform(std::mt19937& random, double low, double high) {
  return low + (high - low) * std::ldexp(double(random()), -32);
}

/// Returns an affine map that is turned or not, sheared or not, has scales that differ by axis, and may
/// mirror.
openvdb::math::Transform::Ptr random_map(std::mt19937& random) {
  Eigen::Matrix3d linear = Eigen::Matrix3d::Identity();
  const double steepest = std::pow(10.0, uniform(random, 0.0, 3.0));
  const bool is_turned = random() % 2, is_sheared = random() % 4, is_scaled = random() % 2,
             is_shifted = random() % 2;
  if (is_sheared)
    for (int row = 0; row < 3; ++row)
      for (int column = row + 1; column < 3; ++column)
        if (random() % 2) linear(row, column) = uniform(random, -steepest, steepest);
  if (is_sheared && random() % 2) linear.transposeInPlace();
  if (is_scaled)
    for (int axis = 0; axis < 3; ++axis) linear.col(axis) *= std::pow(10.0, uniform(random, -2.0, 2.0));
  for (int axis = 0; axis < 3; ++axis)
    if (random() % 4 == 0) linear.col(axis) *= -1.0;
  if (is_turned) {
    const Eigen::Vector3d axis(uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, 0.1, 1));
    linear = Eigen::AngleAxisd(uniform(random, 0, 6), axis.normalized()) * linear;
  }
  const Eigen::Matrix3d m = std::pow(10.0, uniform(random, -3.0, 3.0)) * linear;
  const double far = is_shifted ? 100.0 * m.norm() : 0.0;
  return openvdb::math::Transform::createLinearTransform(openvdb::math::Mat4d(  // of rows
      m(0, 0), m(1, 0), m(2, 0), 0.0, m(0, 1), m(1, 1), m(2, 1), 0.0, m(0, 2), m(1, 2), m(2, 2), 0.0,
      uniform(random, -far, far), uniform(random, -far, far), uniform(random, -far, far), 1.0));
}

/// Returns noise of 10³ samples somewhere near the map's origin: of any magnitude, of two that are far apart,
/// or uniform.
LevelSet random_volume(std::mt19937& random) {
  initialize_openvdb();
  const auto grid = openvdb::FloatGrid::create(3.0f);
  grid->setTransform(random_map(random));
  const Coord lower(int(random() % 40) - 20, int(random() % 40) - 20, int(random() % 40) - 20);
  const auto kind = random() % 4;
  const double scale = std::pow(10.0, uniform(random, -37.0, 37.0));
  for (const Coord& at : openvdb::CoordBBox(lower, lower.offsetBy(9))) {
    const double sign = random() % 2 ? 1.0 : -1.0;
    const double value = kind < 2    ? sign * std::pow(10.0, uniform(random, -37.9, 38.4))
                         : kind == 2 ? sign * (random() % 2 ? 1e-38 : 3e38)
                                     : uniform(random, -scale, scale);
    grid->tree().setValue(at, static_cast<float>(value));
  }
  return make_level_set(grid);
}

struct Method {
  const char* extractor;
  const char* tolerance;
};
constexpr Method kMethods[] = {{"manifold-dual-contouring", "0"}, {"certified-octree", "0.1"},
                               {"certified-octree", "4"},         {"manifold-dual-contouring", "0.3"},
                               {"certified-octree", "0"},         {"certified-octree", "20"}};

/// Expects the guarantees of every mesh; `each` is how many methods each volume goes through.
void expect_guarantees(std::uint32_t first, std::uint32_t count, std::uint32_t each) {
  RunContext context;
  std::size_t refused = 0, meshes = 0;
  for (std::uint32_t seed = first; seed < first + count; ++seed) {
    std::mt19937 random(seed);
    const LevelSet volume = random_volume(random);
    for (std::uint32_t i = 0; i < each; ++i) {
      const Method& method = kMethods[(seed + i) % std::size(kMethods)];
      SCOPED_TRACE("volume " + std::to_string(seed) + ", " + method.extractor + ", tolerance " +
                   method.tolerance);
      const ChosenExtractor chosen =
          choose(our_extractors(), method.extractor, {{"tolerance", method.tolerance}});
      MeshFile file;
      try {
        file = to_mesh_file(extract(volume, nullptr, {.chosen = chosen, .ends = Ends::closed}, context).mesh);
      } catch (const Error&) {  // single precision cannot hold the mesh to a thirty-second of a voxel
        ++refused;
        continue;
      }
      ++meshes;
      test_methods::expect_guarantees(chosen.extractor.promises, file, context);
    }
  }
  EXPECT_LT(refused, (refused + meshes) / 5);
}

TEST(AffineVolumes, MeshesDoNotIntersectThemselves) { expect_guarantees(0, 40, 1); }

TEST(Slow, AffineVolumesTo500) { expect_guarantees(0, 500, 3); }
TEST(Slow, AffineVolumesTo1000) { expect_guarantees(500, 500, 3); }
TEST(Slow, AffineVolumesTo1500) { expect_guarantees(1000, 500, 3); }
TEST(Slow, AffineVolumesTo2000) { expect_guarantees(1500, 500, 3); }

}  // namespace affine_volumes_test
}  // namespace hermesh
