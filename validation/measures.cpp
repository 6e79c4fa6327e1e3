#include "validation/measures.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <numbers>

#include "validation/geometry/exact_predicates.h"
#include "validation/geometry/places.h"

namespace hermesh::validation {
namespace {

struct MeasureSums {
  double volume = 0.0, area = 0.0;
  double smallest_angle = 180.0, worst_aspect = 0.0;
  std::int64_t degenerate = 0;
  std::int64_t last_degenerate = -1;  // polygon, so that a quad counts once
  Places places;

  void add(const Corners& c, const Eigen::Vector3d& centre, std::int64_t polygon) {
    const Eigen::Vector3d ab = c[1] - c[0], bc = c[2] - c[1], ca = c[0] - c[2];
    const double twice_area = ab.cross(-ca).norm();
    area += 0.5 * twice_area;
    volume += (c[0] - centre).dot((c[1] - centre).cross(c[2] - centre)) / 6.0;
    if (collinear(c)) {
      if (polygon != last_degenerate) {
        ++degenerate;
        add_place(places, (c[0] + c[1] + c[2]) / 3.0, polygon);
      }
      last_degenerate = polygon;
      smallest_angle = 0.0;
      worst_aspect = std::numeric_limits<double>::infinity();
      return;
    }
    std::array<double, 3> side{ab.norm(), bc.norm(), ca.norm()};
    std::sort(side.begin(), side.end());
    // The smallest angle lies opposite to the shortest side: its sine is the area over the two others.
    const double cosine = (side[1] * side[1] + side[2] * side[2] - side[0] * side[0]) / 2.0;
    smallest_angle = std::min(smallest_angle, std::atan2(twice_area, cosine) * 180.0 / std::numbers::pi);
    const double perimeter = side[0] + side[1] + side[2];
    worst_aspect = std::max(worst_aspect, side[2] * perimeter / (2.0 * std::numbers::sqrt3 * twice_area));
  }

  void append(const MeasureSums& later) {
    volume += later.volume;
    area += later.area;
    smallest_angle = std::min(smallest_angle, later.smallest_angle);
    worst_aspect = std::max(worst_aspect, later.worst_aspect);
    degenerate += later.degenerate;
    append_places(places, later.places);
  }
};

}  // namespace

void measure_triangles(const MeshFile& mesh, const TriangleSoup& soup, MeshReport& report,
                       RunContext& context) {
  const Box box = box_of(mesh);
  const Eigen::Vector3d centre = box.centre();
  // A range never parts the two halves of a quad: ranges are of polygons.
  const std::size_t undivided = soup.undivided;
  const auto add_range = [&](const tbb::blocked_range<std::size_t>& range, MeasureSums sums) {
    context.check();
    for (std::size_t p = range.begin(); p < range.end(); ++p) {
      const std::size_t first = p < undivided ? p : undivided + 2 * (p - undivided);
      const std::size_t end = p < undivided ? first + 1 : first + 2;
      for (std::size_t t = first; t < end; ++t) sums.add(soup.corners(t), centre, std::int64_t(p));
    }
    return sums;
  };
  const auto join = [](MeasureSums left, const MeasureSums& right) {
    left.append(right);
    return left;
  };
  const tbb::blocked_range<std::size_t> all(0, undivided + mesh.quads.size(), 4096);
  const MeasureSums sums = tbb::parallel_deterministic_reduce(all, MeasureSums{}, add_range, join);
  report.volume = sums.volume;
  report.area = sums.area;
  report.smallest_angle = undivided + mesh.quads.size() > 0 ? sums.smallest_angle : 0.0;
  report.worst_aspect = sums.worst_aspect;
  report.degenerate_polygons = sums.degenerate;
  report.degenerate_places = sums.places;
}

}  // namespace hermesh::validation
