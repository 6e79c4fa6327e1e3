#include "algorithms/extraction/certified_octree/polygon_stars.h"

#include <Eigen/Geometry>
#include <atomic>
#include <cmath>

namespace hermesh {
namespace {

/// Threshold of the area of a parallelogram seen along a direction, in square voxels: far above the rounding
/// error for sides of a few tens of voxels.
constexpr double kTurnedUp = 1e-9;

}  // namespace

void PolygonStars::ask(std::uint32_t point) {
  std::atomic_ref(asked_[point]).store(1, std::memory_order_relaxed);
}

void PolygonStars::add(std::uint32_t point, const Eigen::Vector3d& up, const Eigen::Vector3d& to_first,
                       const Eigen::Vector3d& to_second) {
  // A sum, and a bit that is never cleared: the result does not depend on the thread schedule.
  const std::atomic_ref mark(marks_[point]);
  if (!(up.dot(to_first.cross(to_second)) > kTurnedUp)) {
    mark.fetch_or(kTurned, std::memory_order_relaxed);
    return;
  }
  // The triangle faces up, so it intersects the one ray perpendicular to `side` where it passes from the
  // negative half-space to the other one.
  const Eigen::Vector3d side = std::abs(up[0]) < 0.6 * up.norm() ? Eigen::Vector3d(0, up[2], -up[1])
                                                                 : Eigen::Vector3d(-up[2], 0, up[0]);
  if (side.dot(to_first) < 0 && side.dot(to_second) >= 0) mark.fetch_add(1, std::memory_order_relaxed);
}

}  // namespace hermesh
