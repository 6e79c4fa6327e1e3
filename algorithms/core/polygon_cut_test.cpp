// Polygons whose areas are known, and random ones: triangles face alike, do not overlap, and have the
// polygon's area.
#include "algorithms/core/polygon_cut.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <utility>

namespace hermesh {
namespace polygon_cut_test {

using Eigen::Vector3d;
using Polygon = std::vector<Vector3d>;

Polygon flat(std::initializer_list<std::pair<double, double>> corners) {
  Polygon polygon;
  for (const auto& [x, y] : corners) polygon.emplace_back(x, y, 0);
  return polygon;
}

Vector3d area(const Polygon& p, const Triangle& t) {
  return 0.5 * (p[t[1]] - p[t[0]]).cross(p[t[2]] - p[t[0]]);
}

/// Where all areas along the normal are positive and their sum is that of the polygon, nothing is covered
/// twice and nothing beyond it; and sides are those of the polygon or shared by two triangles.
void expect_cover(const Polygon& polygon, const Vector3d& whole) {
  const std::vector<Triangle> triangles = clip_ears(polygon, RunContext());
  ASSERT_EQ(triangles.size(), polygon.size() - 2);
  Vector3d sum = Vector3d::Zero();
  double absolute = 0;
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> sides;
  for (const Triangle& t : triangles) {
    const Vector3d a = area(polygon, t);
    EXPECT_GE(a.dot(whole), -1e-9 * whole.squaredNorm());
    sum += a;
    absolute += std::abs(a.dot(whole.normalized()));
    for (int i = 0; i < 3; ++i) {
      ++sides[{t[i], t[(i + 1) % 3]}];
      --sides[{t[(i + 1) % 3], t[i]}];
    }
  }
  EXPECT_NEAR(absolute, whole.norm(), 1e-9 * whole.norm());
  EXPECT_LT((sum - whole).norm(), 1e-9 * whole.norm());
  const auto n = static_cast<std::uint32_t>(polygon.size());
  for (const auto& [side, count] : sides) {
    const bool of_polygon = side.second == (side.first + 1) % n || side.first == (side.second + 1) % n;
    EXPECT_EQ(std::abs(count), of_polygon ? 1 : 0) << side.first << " " << side.second;
  }
}

TEST(IsFan, ConvexPolygonsAndThoseSeenWholeFromTheirFirstCorner) {
  EXPECT_TRUE(is_fan(flat({{0, 0}, {2, 0}, {3, 1}, {2, 2}, {0, 2}})));
  EXPECT_TRUE(is_fan(flat({{0, 0}, {0, 2}, {2, 2}, {3, 1}, {2, 0}})));  // clockwise
  // A fan would leave a corner that is straight on the side of a triangle, unless it begins there.
  EXPECT_FALSE(is_fan(flat({{0, 0}, {1, 0}, {2, 0}, {2, 2}, {0, 2}})));
  EXPECT_TRUE(is_fan(flat({{1, 0}, {2, 0}, {2, 2}, {0, 2}, {0, 0}})));
  const Polygon corner = flat({{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}});
  EXPECT_TRUE(is_fan(corner));
  Polygon turned = corner;
  std::rotate(turned.begin(), turned.begin() + 1, turned.end());
  EXPECT_FALSE(is_fan(turned));
}

TEST(ClipEars, NoTriangleIsFlatAtAStraightCorner) {
  Polygon square = flat({{0, 0}, {1, 0}, {2, 0}, {2, 2}, {0, 2}});
  for (std::size_t start = 0; start < square.size(); ++start) {
    for (const Triangle& t : clip_ears(square, RunContext())) EXPECT_GE(area(square, t).norm(), 0.9) << start;
    std::rotate(square.begin(), square.begin() + 1, square.end());
  }
}

TEST(ClipEars, Letters) {
  const Polygon l = flat({{2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}, {0, 0}});
  expect_cover(l, Vector3d(0, 0, 3));
  const Polygon u = flat({{0, 0}, {3, 0}, {3, 3}, {2, 3}, {2, 1}, {1, 1}, {1, 3}, {0, 3}});
  EXPECT_FALSE(is_fan(u));
  expect_cover(u, Vector3d(0, 0, 7));
  Polygon clockwise(u.rbegin(), u.rend());
  expect_cover(clockwise, Vector3d(0, 0, -7));
}

TEST(ClipEars, StraightCornersAndPointsThatCoincide) {
  expect_cover(flat({{0, 0}, {1, 0}, {2, 0}, {3, 0}, {3, 3}, {2, 3}, {2, 1}, {1, 1}, {1, 3}, {0, 3}}),
               Vector3d(0, 0, 7));
  expect_cover(flat({{0, 0}, {3, 0}, {3, 0}, {3, 3}, {2, 3}, {2, 1}, {1, 1}, {1, 3}, {0, 3}}),
               Vector3d(0, 0, 7));
  // Two triangles that meet in a point.
  expect_cover(flat({{0, 0}, {2, 0}, {1, 1}, {2, 2}, {0, 2}, {1, 1}}), Vector3d(0, 0, 2));
}

TEST(ClipEars, ABridgeToAHole) {
  const Polygon square =
      flat({{0, 0}, {4, 0}, {4, 4}, {0, 4}, {0, 0}, {1, 1}, {1, 3}, {3, 3}, {3, 1}, {1, 1}});
  EXPECT_FALSE(is_fan(square));
  for (std::size_t turn = 0; turn < square.size(); ++turn) {
    Polygon turned = square;
    std::rotate(turned.begin(), turned.begin() + static_cast<std::ptrdiff_t>(turn), turned.end());
    expect_cover(turned, Vector3d(0, 0, 12));
  }
  // Two holes from the same corner.
  expect_cover(flat({{0, 0},
                     {6, 0},
                     {6, 4},
                     {0, 4},
                     {0, 0},
                     {1, 2},
                     {2, 3},
                     {3, 2},
                     {1, 2},
                     {0, 0},
                     {4, 1},
                     {4, 2},
                     {5, 2},
                     {5, 1},
                     {4, 1}}),
               Vector3d(0, 0, 24 - 1 - 1));
}

TEST(ClipEars, NoneOfABorderThatCrossesItself) {
  EXPECT_TRUE(clip_ears(flat({{0, 0}, {4, 0}, {0, 4}, {4, 4}, {1, -2}, {3, 9}}), RunContext()).empty());
}

/// Returns triangles that meet in one point, with gaps between them.
Polygon petals(int count) {
  Polygon polygon;
  for (int i = 0; i < count; ++i) {
    const double angle = 2 * std::numbers::pi / count;
    polygon.emplace_back(0, 0, 0);
    polygon.emplace_back(std::cos(i * angle), std::sin(i * angle), 0);
    polygon.emplace_back(std::cos((i + 0.4) * angle), std::sin((i + 0.4) * angle), 0);
  }
  return polygon;
}

TEST(ClipEars, NoneOfManyCornersAtOnePointWhichWouldTakeQuadraticTime) {
  expect_cover(petals(100), Vector3d(0, 0, 50 * std::sin(0.4 * 2 * std::numbers::pi / 100)));
  EXPECT_TRUE(clip_ears(petals(20'000), RunContext()).empty());
}

/// Seen as a whole from a point inside, so that the area is a sum.
TEST(ClipEars, RandomStarsInRandomPlanes) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0, 1);
  for (const std::size_t n : {5u, 6u, 9u, 40u, 400u})
    for (int repeat = 0; repeat < 40; ++repeat) {
      const Eigen::Matrix3d turn =
          Eigen::Quaterniond(unit(random) - 0.5, unit(random) - 0.5, unit(random) - 0.5, unit(random) - 0.5)
              .normalized()
              .toRotationMatrix();
      const Vector3d away(1e3 * unit(random), -50, 7);
      Polygon star;
      double twice = 0;
      std::vector<double> radius(n);
      for (double& r : radius) r = 0.2 + unit(random);
      const double step = 2 * std::numbers::pi / double(n);
      for (std::size_t i = 0; i < n; ++i) {
        star.push_back(
            away + turn * (radius[i] * Vector3d(std::cos(step * double(i)), std::sin(step * double(i)), 0)));
        twice += radius[i] * radius[(i + 1) % n] * std::sin(step);
      }
      expect_cover(star, turn * Vector3d(0, 0, 0.5 * twice));
    }
}

/// Two walls about the origin, `turns` times around; nearly every corner of its inner wall hides the ears of
/// the others.
Polygon spiral(int corners, double turns) {
  Polygon polygon;
  const int steps = corners / 2;
  const auto add = [&](int i, double width) {
    const double turned = turns * i / steps, radius = 1 + 2 * turned + width;
    polygon.emplace_back(radius * std::cos(2 * std::numbers::pi * turned),
                         radius * std::sin(2 * std::numbers::pi * turned), 0);
  };
  for (int i = 0; i < steps; ++i) add(i, 1.0);
  for (int i = steps; i-- > 0;) add(i, 0.0);
  return polygon;
}

Vector3d enclosed(const Polygon& polygon) {
  Vector3d whole = Vector3d::Zero();
  for (std::size_t i = 0; i < polygon.size(); ++i)
    whole += 0.5 * polygon[i].cross(polygon[(i + 1) % polygon.size()]);
  return whole;
}

TEST(ClipEars, ASpiral) {
  const Polygon polygon = spiral(2000, 8);
  expect_cover(polygon, enclosed(polygon));
}

/// A zigzag over a straight boundary with the same number of corners, which leaves two straight rows when its
/// tips are cut off.
Polygon zigzag(int corners) {
  Polygon polygon;
  const int half = corners / 2;
  for (int i = 0; i < half; ++i) polygon.emplace_back(i, 0, 0);
  for (int i = half; i-- > 0;) polygon.emplace_back(i, 1 + i % 2 * 10, 0);
  return polygon;
}

Polygon random_star(int corners) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> radius(1, 2);
  Polygon polygon;
  for (int i = 0; i < corners; ++i) {
    const double angle = 2 * std::numbers::pi * i / corners, r = radius(random);
    polygon.emplace_back(r * std::cos(angle), r * std::sin(angle), 0);
  }
  return polygon;
}

/// Polygons with the requested number of corners that have few ears at a time, or only flat ones.
void expect_covers_of(int corners) {
  for (const double turns : {0.9, 40.0, 1000.0}) {
    const Polygon polygon = spiral(corners, turns);
    expect_cover(polygon, enclosed(polygon));
  }
  // A comb: its teeth hide one another's roots.
  const int quarter = corners / 4;
  Polygon comb;
  for (int i = 0; i < quarter; ++i)
    for (const auto& [x, y] :
         {std::pair(0, 0), std::pair(1, 1000 + i % 7), std::pair(2, 1000), std::pair(3, i % 5)})
      comb.emplace_back(4 * i + x, y, 0);
  comb.emplace_back(4 * quarter, -1, 0);
  comb.emplace_back(0, -1, 0);
  std::reverse(comb.begin(), comb.end());
  expect_cover(comb, enclosed(comb));
  // A box with all corners but four in a straight line, a quarter of which but one are left when the others
  // have become ears.
  Polygon box;
  for (int i = 0; i < quarter; ++i) box.emplace_back(i, 0, 0);
  for (int i = 0; i < quarter; ++i) box.emplace_back(quarter, i, 0);
  for (int i = quarter; i > 0; --i) box.emplace_back(i, quarter, 0);
  for (int i = quarter; i > 0; --i) box.emplace_back(0, i, 0);
  expect_cover(box, enclosed(box));
  for (const Polygon& polygon : {zigzag(corners), random_star(corners)})
    expect_cover(polygon, enclosed(polygon));
}
/// The time is about in proportion to the corners: seconds here, and hours if it were to their square.
TEST(ClipEars, NineHundredThousandCorners) {
  for (const Polygon& polygon : {zigzag(900'000), random_star(200'000)}) {
    const std::vector<Triangle> triangles = clip_ears(polygon, RunContext());
    ASSERT_EQ(triangles.size(), polygon.size() - 2);
    double sum = 0;
    for (const Triangle& t : triangles) sum += area(polygon, t).norm();
    EXPECT_NEAR(sum, enclosed(polygon).norm(), 1e-9 * sum);
  }
}
TEST(ClipEars, TwentyThousandCorners) { expect_covers_of(20'000); }
TEST(Slow, ClipEarsOfAHundredThousandCorners) { expect_covers_of(100'000); }

TEST(ClipEars, CancelEndsIt) {
  const std::atomic<bool> cancelled = true;
  RunContext context;
  context.cancel = &cancelled;
  EXPECT_THROW(clip_ears(spiral(10'000, 8), context), Cancelled);
}

}  // namespace polygon_cut_test
}  // namespace hermesh
