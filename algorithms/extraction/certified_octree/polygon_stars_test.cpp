#include "algorithms/extraction/certified_octree/polygon_stars.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace hermesh {
namespace polygon_stars_test {

using Eigen::Vector3d;

/// Returns true if the star of triangles from the origin to each two consecutive points of a ring is plain,
/// seen from above.
bool is_plain(const std::vector<Vector3d>& ring, const Vector3d& up = Vector3d::UnitZ()) {
  PolygonStars stars(2);
  stars.ask(1);
  for (std::size_t i = 0; i < ring.size(); ++i) stars.add(1, up, ring[i], ring[(i + 1) % ring.size()]);
  EXPECT_FALSE(stars.is_asked(0) || stars.is_plain(0));
  return stars.is_plain(1);
}

/// Returns a ring of points, evenly spaced around the origin, with the given number of turns.
std::vector<Vector3d> around(int places, int turns) {
  std::vector<Vector3d> ring;
  for (int i = 0; i < places; ++i) {
    const double angle = 0.1 + 2 * std::numbers::pi * turns * i / places;
    ring.emplace_back(3 * std::cos(angle), 3 * std::sin(angle), i % 3 - 1);
  }
  return ring;
}

TEST(PolygonStars, ArePlainIfTheyGoAroundOnce) {
  EXPECT_TRUE(is_plain(around(3, 1)));
  EXPECT_TRUE(is_plain(around(8, 1)));
  EXPECT_FALSE(is_plain(around(7, 2)));
  EXPECT_FALSE(is_plain(around(7, 6)));  // the opposite orientation
  EXPECT_FALSE(is_plain({}));
}

TEST(PolygonStars, ArePlainSeenAlongAnyAxis) {
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<Vector3d> ring = around(6, 1);
    for (Vector3d& place : ring) {
      const Vector3d old = place;
      for (int i = 0; i < 3; ++i) place[(i + axis + 1) % 3] = old[i];
    }
    EXPECT_TRUE(is_plain(ring, Vector3d::Unit(axis)));
    EXPECT_FALSE(is_plain(ring, -Vector3d::Unit(axis)));
  }
}

TEST(PolygonStars, AreNotPlainIfATriangleIsTurnedOver) {
  std::vector<Vector3d> ring = around(6, 1);
  std::swap(ring[2], ring[3]);
  EXPECT_FALSE(is_plain(ring));
}

TEST(PolygonStars, AreNotPlainIfATriangleStandsUpright) {
  std::vector<Vector3d> ring = around(6, 1);
  ring[3] = ring[2] + Vector3d(0, 0, 1);
  EXPECT_FALSE(is_plain(ring));
}

/// A ray that passes along a side counts that side once.
TEST(PolygonStars, MayHaveASideAnywhere) {
  for (int i = 0; i < 64; ++i) {
    const double turned = std::numbers::pi * i / 32;
    std::vector<Vector3d> ring;
    for (int k = 0; k < 4; ++k)
      ring.emplace_back(std::round(4 * std::cos(turned + k * std::numbers::pi / 2)),
                        std::round(4 * std::sin(turned + k * std::numbers::pi / 2)), 0);
    EXPECT_TRUE(is_plain(ring)) << i;
  }
}

}  // namespace polygon_stars_test
}  // namespace hermesh
