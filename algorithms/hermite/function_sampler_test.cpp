#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>

#include "algorithms/hermite/samplers.h"
#include "algorithms/hermite/test_normals.h"

namespace hermesh {
namespace function_sampler_test {

using Eigen::Vector3d;

AnalyticSurface sphere(const Vector3d& centre, double radius) {
  return {[=](const Vector3d& p) { return (p - centre).norm() - radius; },
          [=](const Vector3d& p) { return Vector3d(p - centre); }};
}

IndexToWorld lattice(double voxel_size) {
  IndexToWorld placement;
  placement.linear *= voxel_size;
  return placement;
}

/// Calls f(world position, normal) for every crossing.
template <class F>
void for_each_hit(const FloatHermite& hermite, F&& f) {
  for_each_normal(hermite, [&](const Vector3d& place, const Vector3d& normal) {
    f(Vector3d(hermite.placement.local(place) + hermite.placement.origin), normal);
  });
}

TEST(FunctionSampler, HitsOfASphereAreOnItWithRadialNormals) {
  RunContext context;
  const Vector3d centre(0.31, -0.12, 0.27);
  const FloatHermite hermite =
      sample_function(sphere(centre, 2.0), lattice(0.1), {-30, -30, -30}, {30, 30, 30}, 1e-9, context);
  check_consistent(hermite);
  std::size_t hits = 0;
  for_each_hit(hermite, [&](const Vector3d& at, const Vector3d& normal) {
    ++hits;
    ASSERT_NEAR((at - centre).norm(), 2.0, 1e-7);  // offsets are in single precision
    ASSERT_GT(normal.dot((at - centre).normalized()), 1.0 - 1e-6);
  });
  EXPECT_NEAR(double(hits), 6.0 * M_PI * 400.0, 200.0);
}

TEST(FunctionSampler, ASteepAndCurvedFunctionIsBracketedToTheTolerance) {
  // Along an edge the value is a power of nine: the secant is far off, the bracket is not.
  const AnalyticSurface steep{[](const Vector3d& p) { return std::pow(p.norm() / 1.03, 9.0) - 1.0; },
                              [](const Vector3d& p) { return p; }, 20.0};
  RunContext context;
  for (const double tolerance : {1e-2, 1e-4, 1e-6})
    for_each_hit(sample_function(steep, lattice(0.25), {-8, -8, -8}, {8, 8, 8}, tolerance, context),
                 [&](const Vector3d& at, const Vector3d&) {
                   // Along the edge the error is at most the tolerance; the distance to the sphere is no
                   // larger.
                   ASSERT_LE(std::abs(at.norm() - 1.03), 0.25 * tolerance + 1e-7);
                 });
}

TEST(FunctionSampler, NormalsAreThoseOfIndexSpaceWhereVoxelsAreNoCubes) {
  IndexToWorld placement;
  placement.linear = Vector3d(0.1, 0.2, 0.4).asDiagonal();
  RunContext context;
  const AnalyticSurface ball = sphere(Vector3d::Zero(), 3.0);
  for_each_hit(sample_function(ball, placement, {-40, -20, -10}, {40, 20, 10}, 1e-9, context),
               [&](const Vector3d& at, const Vector3d& normal) {
                 const Vector3d expected = (placement.linear.transpose() * at).normalized();
                 ASSERT_GT(normal.dot(expected), 1.0 - 1e-5);
               });
}

TEST(FunctionSampler, FarFromTheOriginNothingIsLost) {
  IndexToWorld placement = lattice(0.1);
  placement.origin = Vector3d::Constant(1e6);
  RunContext context;
  const Vector3d centre = Vector3d::Constant(1e6);
  std::size_t hits = 0;
  for_each_hit(sample_function(sphere(centre, 1.0), placement, {-16, -16, -16}, {16, 16, 16}, 1e-9, context),
               [&](const Vector3d& at, const Vector3d&) {
                 ++hits;
                 ASSERT_NEAR((at - centre).norm(), 1.0, 1e-7);
               });
  EXPECT_GT(hits, 1000u);
}

TEST(FunctionSampler, RefusesWhatItCannotClose) {
  RunContext context;
  const auto sample = [&](const AnalyticSurface& surface, int half, double tolerance) {
    return sample_function(surface, lattice(1.0), {-half, -half, -half}, {half, half, half}, tolerance,
                           context);
  };
  EXPECT_THROW(sample(sphere(Vector3d::Zero(), 10.0), 9, 1e-6), Error);  // reaches the border
  EXPECT_THROW(sample(sphere(Vector3d::Zero(), 3.0), -1, 1e-6), Error);  // an empty box
  EXPECT_THROW(sample(sphere(Vector3d::Zero(), 3.0), 9, 0.0), Error);
  const AnalyticSurface nowhere{[](const Vector3d&) { return std::nan(""); },
                                [](const Vector3d& p) { return p; }};
  EXPECT_THROW(sample(nowhere, 9, 1e-6), Error);
  // Steeper than its declared Lipschitz constant: blocks that the surface passes through would be skipped,
  // and the data would be disconnected.
  AnalyticSurface steep = sphere(Vector3d::Zero(), 30.0);
  steep.value = [](const Vector3d& p) { return 4.0 * (p.norm() - 30.0); };
  EXPECT_THROW(sample(steep, 40, 1e-6), Error);
  steep.lipschitz = 4.0;
  EXPECT_FALSE(sample(steep, 40, 1e-6).leaves.empty());
  EXPECT_TRUE(sample(sphere(Vector3d::Constant(0.5), 0.1), 9, 1e-6).leaves.empty());  // between the samples
}

TEST(FunctionSampler, SameBytesAtAnyThreadCount) {
  RunContext context;
  const auto make = [&](int threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, std::size_t(threads));
    return sample_function(sphere(Vector3d(0.1, 0.2, 0.3), 20.0), lattice(1.0), {-30, -30, -30}, {30, 30, 30},
                           1e-6, context);
  };
  const FloatHermite one = make(1);
  for (const int threads : {2, 7}) {
    const FloatHermite other = make(threads);
    EXPECT_TRUE(one.leaves == other.leaves && one.crossings == other.crossings);
  }
}

}  // namespace function_sampler_test
}  // namespace hermesh
