#include "algorithms/search/surface_distance.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>

namespace hermesh {
namespace surface_distance_test {

using Eigen::Vector3d;
using Eigen::Vector3f;

struct Soup {
  std::vector<Vector3f> points;
  std::vector<Triangle> triangles;
};

/// The square from 0 to `side` at a height, of 2 n² triangles.
Soup square(float side, float height, std::uint32_t n = 1) {
  Soup soup;
  for (std::uint32_t y = 0; y <= n; ++y)
    for (std::uint32_t x = 0; x <= n; ++x)
      soup.points.emplace_back(side * float(x) / float(n), side * float(y) / float(n), height);
  for (std::uint32_t y = 0; y < n; ++y)
    for (std::uint32_t x = 0; x < n; ++x) {
      const std::uint32_t a = y * (n + 1) + x, b = a + 1, c = a + n + 1, d = c + 1;
      soup.triangles.push_back({a, b, d});
      soup.triangles.push_back({a, d, c});
    }
  return soup;
}

/// Returns the result for a small bound. Expects the same far triangles if any bound is sufficient.
DistanceFromSurface hold(const Soup& from, const Soup& to, double limit,
                         const Vector3d& offset = Vector3d::Zero(), const FreePieces& free = {}) {
  RunContext context;
  const SurfaceDistance surface(to.points, to.triangles);
  const auto found = [&](Wanted wanted) {
    return surface.hold(from.points, offset, from.triangles, limit, context, free, wanted);
  };
  DistanceFromSurface small = found(Wanted::small_bound);
  const DistanceFromSurface any = found(Wanted::any_bound);
  const auto numbers = [](const DistanceFromSurface& d) {
    std::vector<std::uint32_t> far;
    for (const FarTriangle& f : d.far) far.push_back(f.triangle);
    return far;
  };
  EXPECT_EQ(numbers(any), numbers(small));
  EXPECT_LE(any.upper, limit);
  return small;
}

TEST(SurfaceDistance, ParallelSquaresAreTheirHeightApart) {
  for (const std::uint32_t n : {1u, 7u}) {
    const DistanceFromSurface near = hold(square(1, 0), square(1, 0.25f, n), 0.2501);
    EXPECT_TRUE(near.far.empty());
    EXPECT_GE(near.upper, 0.25);
    EXPECT_LE(near.upper, 0.2501);
    const DistanceFromSurface far = hold(square(1, 0), square(1, 0.25f, n), 0.2499);
    ASSERT_EQ(far.far.size(), 2u);
    EXPECT_NEAR(far.far[0].distance, 0.25, 1e-6);
    EXPECT_NEAR(far.far[0].place.z(), 0.0, 1e-6);
  }
}

TEST(SurfaceDistance, ALargeTriangleIsCoveredByManySmallOnes) {
  // No one of the small triangles is near all of the large one, at a limit far below its size.
  const DistanceFromSurface found = hold(square(1, 0), square(1, 1e-3f, 64), 2e-3);
  EXPECT_TRUE(found.far.empty());
  EXPECT_GE(found.upper, 1e-3 - 1e-9);
}

TEST(SurfaceDistance, PlanePartsAreShownToBeNearHoweverSmallTheLimit) {
  // By as many pieces as the triangles overlap in: halved ones would be millions, which count as far.
  for (const std::uint32_t n : {1u, 3u, 7u}) {
    Soup to = square(1, 5e-7f, n);
    for (Triangle& t : to.triangles) t = {t[2], t[0], t[1]};
    Soup from = square(1, 0, 5);
    for (Vector3f& p : from.points) p.x() = 1 - p.x();  // the other diagonals
    const DistanceFromSurface near = hold(from, to, 1e-6);
    EXPECT_TRUE(near.far.empty());
    EXPECT_GE(near.upper, 5e-7);
    EXPECT_EQ(hold(from, to, 4e-7).far.size(), from.triangles.size());
    // A notch between the triangles is not stepped over, nor is a rim.
    to.triangles.pop_back();
    EXPECT_FALSE(hold(from, to, 1e-6).far.empty());
    EXPECT_FALSE(hold(square(1.00001f, 0, 2), square(1, 5e-7f, n), 1e-6).far.empty());
  }
}

TEST(SurfaceDistance, WhatIsJustTooFarIsFarAtEverySizeAndTurn) {
  // A triangle that is divided into few or many parts, oblique to the square: one corner only is too far,
  // then none.
  const Soup to = square(4, 0, 40);
  for (const float side : {0.1f, 0.3f, 0.5f, 1.0f, 2.5f})
    for (const float slim : {1.0f, 0.5f, 0.05f}) {
      const Soup from{{{0.7f, 0.7f, 0.05f}, {0.7f + side, 0.8f, 0.0f}, {0.8f, 0.7f + slim * side, 0.1f}},
                      {{0, 1, 2}}};
      EXPECT_EQ(hold(from, to, 0.0995).far.size(), 1u) << side << ' ' << slim;
      EXPECT_TRUE(hold(from, to, 0.1005).far.empty()) << side << ' ' << slim;
    }
}

TEST(SurfaceDistance, AHoleIsFoundWithItsDistance) {
  Soup holed = square(1, 0, 10);
  // The square of a tenth from (0.5, 0.5) on is left out: its middle is a twentieth from its rim.
  holed.triangles.erase(holed.triangles.begin() + 2 * 55, holed.triangles.begin() + 2 * 55 + 2);
  EXPECT_TRUE(hold(square(1, 0), holed, 0.0501).far.empty());
  const DistanceFromSurface found = hold(square(1, 0), holed, 0.04);
  ASSERT_FALSE(found.far.empty());
  EXPECT_GT(found.far[0].distance, 0.04);
  EXPECT_NEAR(found.far[0].place.x(), 0.55, 0.05);
  EXPECT_NEAR(found.far[0].place.y(), 0.55, 0.05);
}

TEST(SurfaceDistance, TrianglesWithoutAreaAreMeasuredToo) {
  Soup needle{{{0, 0, 0}, {1, 0, 0}, {0.5f, 0, 0}, {2, 2, 2}}, {{0, 1, 2}, {3, 3, 3}}};
  const DistanceFromSurface found = hold(needle, square(1, 0.5f), 0.6);
  ASSERT_EQ(found.far.size(), 1u);
  EXPECT_EQ(found.far[0].triangle, 1u);
  EXPECT_NEAR(found.far[0].distance, std::min(1.2, std::sqrt(1 + 1 + 1.5 * 1.5)),
              1e-6);  // at most twice the limit
}

TEST(SurfaceDistance, TheOffsetMovesWhatIsAskedAbout) {
  const Soup soup = square(1, 0, 3);
  EXPECT_TRUE(hold(soup, soup, 0.3, Vector3d(0, 0, 0.29)).far.empty());
  const DistanceFromSurface found = hold(soup, soup, 0.3, Vector3d(0, 0, 0.31));
  ASSERT_EQ(found.far.size(), soup.triangles.size());
  EXPECT_NEAR(found.far[0].place.z(), 0.0, 1e-6);  // in the frame of the queried triangles
}

TEST(SurfaceDistance, FreePiecesNeedNotBeNear) {
  // The part above x = 0.5 is free; the other half is far.
  const Soup from = square(1, 0),
             to{{{0, 0, 0}, {0.5f, 0, 0}, {0.5f, 1, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 3}}};
  FreePieces free;
  free.radius = 0.01;
  const auto accept = [&](auto is_free) {
    free.are_free = [is_free](std::span<const std::array<Vector3d, 3>> pieces,
                              std::span<std::uint8_t> results) {
      std::ranges::transform(pieces, results.begin(), is_free);
    };
  };
  accept([](const auto& piece) { return piece[0].x() + piece[1].x() + piece[2].x() > 1.5; });
  const DistanceFromSurface found = hold(from, to, 0.1, Vector3d::Zero(), free);
  EXPECT_TRUE(found.far.empty());
  EXPECT_NEAR(found.free_area, 0.4, 0.02);  // the part farther than a tenth from the half
  // If all pieces may be far, no triangle is reported; nor are pieces on the border of the near part, at any
  // limit.
  const Soup slanted{{{0.03f, 0.02f, 0.01f}, {0.97f, 0.41f, 0.3f}, {0.33f, 0.99f, 0.5f}}, {{0, 1, 2}}},
      corner{{{0, 0, 0}, {0.4f, 0, 0}, {0.4f, 0.3f, 0}}, {{0, 1, 2}}};
  accept([](const auto&) { return true; });
  for (const double limit : {0.05, 0.1, 0.1003, 0.1234}) {
    EXPECT_TRUE(hold(from, to, limit, Vector3d::Zero(), free).far.empty()) << limit;
    EXPECT_TRUE(hold(slanted, corner, limit, Vector3d::Zero(), free).far.empty()) << limit;
  }
  accept([](const auto&) { return false; });
  EXPECT_EQ(hold(from, to, 0.1, Vector3d::Zero(), free).far.size(), 2u);
}

TEST(SurfaceDistance, RandomSoupsHoldExactlyWhereSamplesDo) {
  std::mt19937 random(20091103);
  std::uniform_real_distribution<float> coordinate(0, 1);
  for (int round = 0; round < 20; ++round) {
    Soup a, b;
    for (Soup* soup : {&a, &b})
      for (std::uint32_t i = 0; i < 30; ++i) {
        const Vector3f at(coordinate(random), coordinate(random), coordinate(random));
        for (int k = 0; k < 3; ++k)
          soup->points.push_back(at +
                                 0.2f * Vector3f(coordinate(random), coordinate(random), coordinate(random)));
        soup->triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
      }
    const SurfaceDistance to(b.points, b.triangles);
    double sampled = 0;  // the largest distance of a dense set of samples
    for (const Triangle& t : a.triangles)
      for (int i = 0; i <= 20; ++i)
        for (int j = 0; i + j <= 20; ++j) {
          const Vector3f p =
              (float(i) * a.points[t[0]] + float(j) * a.points[t[1]] + float(20 - i - j) * a.points[t[2]]) /
              20;
          sampled = std::max(sampled, to.at(p.cast<double>(), 10.0));
        }
    EXPECT_FALSE(hold(a, b, 0.98 * sampled).far.empty());
    const DistanceFromSurface near = hold(a, b, 1.05 * sampled);
    EXPECT_TRUE(near.far.empty());
    EXPECT_GE(near.upper, sampled - 1e-6);
  }
}

TEST(SurfaceDistance, SameOutcomeAtAnyThreadCount) {
  const Soup from = square(1, 0, 40), to = square(0.7f, 0.1f, 9);
  std::vector<DistanceFromSurface> found;
  for (const std::size_t threads : {1u, 2u, 7u}) {
    tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    found.push_back(hold(from, to, 0.15));
  }
  ASSERT_FALSE(found[0].far.empty());
  for (const DistanceFromSurface& other : found) {
    EXPECT_EQ(other.upper, found[0].upper);
    ASSERT_EQ(other.far.size(), found[0].far.size());
    for (std::size_t i = 0; i < other.far.size(); ++i) EXPECT_EQ(other.far[i].place, found[0].far[i].place);
  }
}

TEST(SurfaceDistance, CanBeCancelled) {
  const Soup soup = square(1, 0, 10);
  std::atomic<bool> cancel = true;
  RunContext context;
  context.cancel = &cancel;
  EXPECT_THROW(SurfaceDistance(soup.points, soup.triangles)
                   .hold(soup.points, Vector3d::Zero(), soup.triangles, 1.0, context),
               Cancelled);
}

TEST(SurfaceDistance, ListsAllFarPieces) {
  const Soup from = square(1, 0, 3), to = square(0.5f, 0.1f);
  RunContext context;
  const double limit = 0.2;
  const DistanceFromSurface found =
      SurfaceDistance(to.points, to.triangles)
          .hold(from.points, Vector3d::Zero(), from.triangles, limit, context, {}, Wanted::far_pieces);
  EXPECT_LE(found.upper, limit);
  // Near is what lies within this distance of the other square, seen from above.
  const double beside = std::sqrt(limit * limit - 0.01);
  const double near = 0.25 + 2.0 * 0.5 * beside + M_PI * beside * beside / 4.0;
  double far = 0.0;
  for (const FarTriangle& piece : found.far) {
    far += piece.area;
    EXPECT_LE(piece.radius, 0.5 * limit);
  }
  EXPECT_GE(far, 1.0 - near);
  EXPECT_LE(far, 1.0 - near + 0.1);
  for (int x = 0; x <= 50; ++x)
    for (int y = 0; y <= 50; ++y) {
      const Vector3d p(x / 50.0, y / 50.0, 0.0);
      const double distance = std::hypot(std::max(0.0, p.x() - 0.5), std::max(0.0, p.y() - 0.5), 0.1);
      const bool is_listed = std::ranges::any_of(found.far, [&](const FarTriangle& piece) {
        return (p - piece.place).norm() <= piece.radius + 1e-9;
      });
      EXPECT_TRUE(is_listed || distance <= found.upper) << p.transpose();
    }
}

}  // namespace surface_distance_test
}  // namespace hermesh
