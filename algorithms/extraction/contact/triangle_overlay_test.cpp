#include "algorithms/extraction/contact/triangle_overlay.h"

#include <gtest/gtest.h>

#include <random>

#include "algorithms/extraction/certified_collapse/fine_mesh.h"
#include "algorithms/search/triangle_tree.h"

namespace hermesh {
namespace triangle_overlay_test {

using Eigen::Vector3d;

/// n x n squares of side 1 over the origin, cut along the diagonal, at height z(x, y), facing up.
template <class Height>
FineMesh sheet(int n, Height&& z) {
  std::vector<Vector3d> points;
  std::vector<Triangle> triangles;
  for (int y = 0; y <= n; ++y)
    for (int x = 0; x <= n; ++x) points.emplace_back(x, y, z(x, y));
  for (int y = 0; y < n; ++y)
    for (int x = 0; x < n; ++x) {
      const auto at = static_cast<std::uint32_t>(y * (n + 1) + x),
                 above = at + static_cast<std::uint32_t>(n) + 1;
      triangles.push_back({at, at + 1, above + 1});
      triangles.push_back({at, above + 1, above});
    }
  return FineMesh(std::move(points), std::move(triangles));
}

bool is_near(const Corners& t, const FineMesh& mesh, std::uint32_t start, double within) {
  return TriangleOverlay(mesh.triangles().size()).is_near(t, mesh, start, [&](std::uint32_t) {
    return within;
  });
}

TEST(TriangleOverlay, FindsTheGreatestHeightWhereverItIs) {
  // A tent whose ridge, at height 1, passes through no corner of the triangle: its own corners have heights 1
  // and −0.
  const FineMesh tent = sheet(8, [](int x, int) { return x == 4 ? 1.0 : 0.0; });
  const Corners t = {Vector3d(2.5, 2, 0), Vector3d(5.5, 2, 0), Vector3d(4, 5, 0)};
  const std::uint32_t start = 2 * (2 * 8 + 3);
  EXPECT_TRUE(is_near(t, tent, start, 1.0));
  EXPECT_FALSE(is_near(t, tent, start, 0.999));
  // Next to the ridge: the side at x = 3.5 is the highest, half way up.
  const Corners beside = {Vector3d(1.5, 2, 0), Vector3d(3.5, 2, 0), Vector3d(2.5, 5, 0)};
  EXPECT_TRUE(is_near(beside, tent, 2 * (2 * 8 + 2), 0.5));
  EXPECT_FALSE(is_near(beside, tent, 2 * (2 * 8 + 2), 0.499));
}

TEST(TriangleOverlay, SlackIgnoresASeamAlongTheSides) {
  // The sheet turns down steeply at x = 4, a millionth before the triangle's side.
  const FineMesh crease = sheet(8, [](int x, int) { return -100.0 * std::max(0, x - 4); });
  const double side = 4.000001;
  const Corners t = {Vector3d(1.5, 2, 0), Vector3d(side, 2, 0), Vector3d(side, 5, 0)};
  const std::uint32_t start = 2 * (2 * 8 + 3);
  const auto is_near_with = [&](const Corners& triangle, double slack) {
    return TriangleOverlay(crease.triangles().size())
        .is_near(
            triangle, crease, start, [](std::uint32_t) { return 0.01; }, slack);
  };
  EXPECT_FALSE(is_near_with(t, 0.0));
  EXPECT_TRUE(is_near_with(t, 0.0025));
  // A seam as wide as the slack is not ignored.
  const Corners wider = {t[0], Vector3d(4.0025, 2, 0), Vector3d(4.0025, 5, 0)};
  EXPECT_FALSE(is_near_with(wider, 0.0025));
}

TEST(TriangleOverlay, SaysNoWhereTheMeshEndsOrFacesTheOtherWay) {
  const FineMesh flat = sheet(4, [](int, int) { return 0.0; });
  EXPECT_TRUE(
      is_near({Vector3d(0.2, 0.2, 0.1), Vector3d(3.8, 0.2, 0.1), Vector3d(2, 3.8, 0.1)}, flat, 10, 0.2));
  EXPECT_FALSE(
      is_near({Vector3d(0.2, 0.2, 0.1), Vector3d(4.2, 0.2, 0.1), Vector3d(2, 3.8, 0.1)}, flat, 10, 0.2))
      << "one corner lies beyond the rim";
  EXPECT_FALSE(
      is_near({Vector3d(0.2, 0.2, 0.1), Vector3d(2, 3.8, 0.1), Vector3d(3.8, 0.2, 0.1)}, flat, 10, 0.2))
      << "turned over";
  EXPECT_FALSE(is_near({Vector3d(9, 9, 0), Vector3d(10, 9, 0), Vector3d(9, 10, 0)}, flat, 10, 0.2))
      << "elsewhere";
}

TEST(TriangleOverlay, SaysNoWhereTheFirstFaceLiesElsewhere) {
  const auto one = [](Vector3d a, Vector3d b, Vector3d c) { return FineMesh({a, b, c}, {{0, 1, 2}}); };
  EXPECT_FALSE(is_near({Vector3d(0, 0, 0), Vector3d(1, 0, 0), Vector3d(0, 1, 0)},
                       one({-1, -1, 0}, {0.5, -1, 0}, {-1, 0.5, 0}), 0, 0.01))
      << "apart by a side of the face";
  EXPECT_FALSE(is_near({Vector3d(0, 0, 0), Vector3d(10, 0, 0), Vector3d(0, 10, 0)},
                       one({0, 0, 0}, {-5, 1, 0}, {1, -5, 0}), 0, 0.01))
      << "a corner in common";
  EXPECT_FALSE(is_near({Vector3d(0, 0, 0), Vector3d(4, 0, 0), Vector3d(2, 3, 0)},
                       one({1, 5e-10, 0}, {2, -1, 0}, {3, 5e-10, 0}), 0, 0.01))
      << "a part too narrow to lead on to the others";
  // A fan whose steep sector lies below the triangle; the first face is the sector on the other side.
  const FineMesh fan({{0, 0, 0}, {-5, 1, 0}, {1, -5, 0}, {3, 3, -6}}, {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}});
  EXPECT_FALSE(is_near({Vector3d(0, 0, 0), Vector3d(1, 0, 0), Vector3d(0.7, 0.7, 0)}, fan, 0, 0.1));
}

TEST(TriangleOverlay, NeverSaysYesWhereSamplesSayNo) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> height(-0.4, 0.4), place(0.5, 7.5), share(0.0, 1.0);
  int near = 0, far = 0;
  for (int trial = 0; trial < 600; ++trial) {
    const FineMesh rough = sheet(8, [&](int, int) { return height(random); });
    Corners t;
    for (Vector3d& p : t) p = Vector3d(place(random), place(random), 0.5 * height(random));
    const Vector3d n = (t[1] - t[0]).cross(t[2] - t[0]);
    if (n.norm() < 0.5) continue;
    if (n[2] < 0) std::swap(t[1], t[2]);
    const Vector3d middle = (t[0] + t[1] + t[2]) / 3.0;
    const double within = 0.3 + 0.3 * share(random);
    // Every other search starts at a face that need not be under the triangle.
    const std::uint32_t start =
        trial % 2 ? rough.walk(0, middle) : static_cast<std::uint32_t>(random() % 128);
    const bool said = is_near(t, rough, start, within);
    (said ? near : far) += 1;
    if (!said) continue;
    for (int sample = 0; sample < 200; ++sample) {
      double a = share(random), b = share(random);
      if (a + b > 1) a = 1 - a, b = 1 - b;
      const Vector3d p = t[0] + a * (t[1] - t[0]) + b * (t[2] - t[0]);
      double nearest = 1e300;
      for (std::uint32_t f = 0; f < rough.triangles().size(); ++f) {
        const Corners c = rough.corners(f);
        nearest = std::min(nearest, squared_distance(p, c[0], c[1], c[2]));
      }
      ASSERT_LE(std::sqrt(nearest), within + 1e-9) << trial;
    }
  }
  EXPECT_GT(near, 20);
  EXPECT_GT(far, 20);
}

}  // namespace triangle_overlay_test
}  // namespace hermesh
