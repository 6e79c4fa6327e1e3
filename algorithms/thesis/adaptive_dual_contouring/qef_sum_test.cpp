#include "algorithms/thesis/adaptive_dual_contouring/qef_sum.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cstdlib>
#include <random>
#include <vector>

#include "algorithms/extraction/dual_contouring/qef.h"
#include "algorithms/lattice/simd/simd_level.h"

namespace hermesh {
namespace qef_sum_test {

using Eigen::Vector3d;
using Eigen::Vector3f;

struct Planes {
  QefSum sum;
  Qef slow{Vector3d::Zero()};

  Planes() { sum.clear(); }
  void add(const Eigen::Vector3f& point, const Eigen::Vector3f& normal) {
    sum += QefSum::of_plane({point[0], point[1], point[2]}, {normal[0], normal[1], normal[2]});
    slow.add_plane(point.cast<double>(), normal.cast<double>());
  }
};

Vector3d minimiser(const QefSum& sum, double truncation) {
  const QefSum* const one[] = {&sum};
  Vector3d result;
  minimisers(one, {}, truncation, &result);
  return result;
}

/// Planes about a point in a block, all within an angle of some normal: from flat to a corner.
Planes random_planes(std::mt19937& random, float spread) {
  std::uniform_real_distribution<float> unit(-1.0f, 1.0f);
  const auto vector = [&] { return Vector3f(unit(random), unit(random), unit(random)); };
  const Vector3f middle = 3.0f * vector(), normal = vector().normalized();
  Planes planes;
  const int count = 3 + static_cast<int>(random() % 60);
  for (int i = 0; i < count; ++i) planes.add(middle + vector(), (normal + spread * vector()).normalized());
  return planes;
}

TEST(QefSum, TheSameMinimisersAndErrorsAsInDoublePrecision) {
  std::mt19937 random(1);
  for (const float spread : {0.0f, 1e-3f, 0.03f, 0.3f, 1.0f, 10.0f}) {
    std::vector<Planes> cases;
    std::vector<const QefSum*> sums;
    for (int i = 0; i < 500; ++i) cases.push_back(random_planes(random, spread));
    for (const Planes& planes : cases) sums.push_back(&planes.sum);
    std::vector<Vector3d> places(cases.size());
    minimisers(sums, {}, 0.1, places.data());
    for (std::size_t i = 0; i < cases.size(); ++i) {
      // A singular value next to the limit may fall on either side of it.
      const Vector3d a = cases[i].slow.minimiser(0.0999), b = cases[i].slow.minimiser(0.1001);
      EXPECT_LT(std::min((places[i] - a).norm(), (places[i] - b).norm()), 2e-5) << spread;
      EXPECT_NEAR(cases[i].sum.error(places[i]), cases[i].slow.error(places[i]), 1e-9);
    }
  }
}

TEST(QefSum, ALanesResultDoesNotDependOnTheOthers) {
  std::mt19937 random(2);
  std::vector<Planes> cases;
  std::vector<const QefSum*> sums;
  for (int i = 0; i < 37; ++i) cases.push_back(random_planes(random, 0.5f));
  for (const Planes& planes : cases) sums.push_back(&planes.sum);
  std::vector<Vector3d> places(cases.size());
  minimisers(sums, {}, 0.1, places.data());
  for (std::size_t i = 0; i < cases.size(); ++i) EXPECT_EQ(places[i], minimiser(cases[i].sum, 0.1));
}

TEST(QefSum, MinimisersAreTheSameAtAnyLevelOfVectorCode) {
  std::mt19937 random(3);
  std::vector<Planes> cases;
  std::vector<const QefSum*> sums;
  for (int i = 0; i < 300; ++i) cases.push_back(random_planes(random, 0.5f));
  for (const Planes& planes : cases) sums.push_back(&planes.sum);
  std::vector<std::vector<Vector3d>> places;
  for (const SimdLevel level : available_simd_levels()) {
    setenv("HERMESH_SIMD", std::string(name(level)).c_str(), 1);
    minimisers(sums, {}, 0.1, places.emplace_back(cases.size()).data());
    EXPECT_EQ(places.front(), places.back()) << name(level);
  }
  unsetenv("HERMESH_SIMD");
}

TEST(QefSum, ThreePlanesMeetInTheirCorner) {
  const Vector3f corner(0.25f, -3.5f, 1.75f);
  Planes planes;
  for (int axis = 0; axis < 3; ++axis)
    planes.add(corner + 0.5f * Vector3f::Unit((axis + 1) % 3), Vector3f::Unit(axis));
  EXPECT_LT((minimiser(planes.sum, 0.1) - corner.cast<double>()).norm(), 1e-6);
}

TEST(QefSum, OfALineOfMinimisersTheNearestToTheStartIsTaken) {
  // Two planes, x = 1 and y = 2, meet in a line along z; the crossings' mean has z = 1.5.
  Planes planes;
  planes.add({1.0f, 0.5f, 1.0f}, {1.0f, 0.0f, 0.0f});
  planes.add({0.5f, 2.0f, 2.0f}, {0.0f, 1.0f, 0.0f});
  const QefSum* const one[] = {&planes.sum};
  const Vector3d start(-3.0, 0.25, -4.0);
  for (const double truncation : {0.1, 0.0}) {
    EXPECT_LT((minimiser(planes.sum, truncation) - Vector3d(1.0, 2.0, 1.5)).norm(), 1e-6) << truncation;
    Vector3d place;
    minimisers(one, {&start, 1}, truncation, &place);
    EXPECT_LT((place - Vector3d(1.0, 2.0, -4.0)).norm(), 1e-6) << truncation;
  }
}

TEST(QefSum, WithoutTruncationNearlyParallelPlanesMeetWhereTheyDo) {
  // The planes z = 0.01 x and z = 0.2 − 0.01 x meet at x = 10: a truncation of 0.1 stays at the mass point.
  const float c = 1.0f / std::sqrt(1.0f + 1e-4f), s = 0.01f * c;
  Planes planes;
  planes.add({0.0f, 0.0f, 0.0f}, {-s, 0.0f, c});
  planes.add({0.0f, 0.0f, 0.2f}, {s, 0.0f, c});
  // Along x the two normals have the singular value √2·0.01, the others √2 and none at all.
  EXPECT_NEAR(minimiser(planes.sum, 0.1)[0], 0.0, 1e-3);
  EXPECT_LT((minimiser(planes.sum, 0.0) - Vector3d(10.0, 0.0, 0.1)).norm(), 1e-3);
  // The least truncation leaves a direction without a singular value unchanged, so no position is infinite.
  EXPECT_EQ(minimiser(planes.sum, 0.0), minimiser(planes.sum, kLeastTruncation));
}

TEST(QefSum, BothPrecisionsMeetAtTheirBorder) {
  std::mt19937 random(5);
  for (int i = 0; i < 200; ++i) {
    const Planes planes = random_planes(random, 1.0f);
    EXPECT_LT((minimiser(planes.sum, 0.001) - minimiser(planes.sum, 0.000999)).norm(), 1e-4);
  }
}

TEST(QefSum, SumsAddUp) {
  std::mt19937 random(3);
  Planes a = random_planes(random, 0.2f);
  const Planes b = random_planes(random, 0.2f);
  const Vector3d x(0.3, -0.7, 2.0);
  const double expected = a.sum.error(x) + b.sum.error(x);
  a.sum += b.sum;
  EXPECT_NEAR(a.sum.error(x), expected, 1e-9);
  EXPECT_EQ(a.sum.planes(), a.slow.planes() + b.slow.planes());
}

}  // namespace qef_sum_test
}  // namespace hermesh
