#include "algorithms/remesh/solid_surface.h"

#include <Eigen/Geometry>
#include <utility>

namespace hermesh {

double area(const std::vector<Eigen::Vector3f>& points, const Triangle& t) {
  const Eigen::Vector3d a = points[t[0]].cast<double>(), b = points[t[1]].cast<double>(),
                        c = points[t[2]].cast<double>();
  return 0.5 * (b - a).cross(c - a).norm();
}

SolidSurface surface_of(BoundaryTriangles boundary, std::span<const std::int8_t> turns, bool over_holes) {
  SolidSurface surface{std::move(boundary.points), {}, {}};
  for (std::size_t i = 0; i < boundary.triangles.size(); ++i) {
    const Triangle& t = boundary.triangles[i];
    if (boundary.ids[i] < 0) {
      surface.caps.push_back(t);
      surface.cap_area += area(surface.points, t);
    } else if (turns.empty() || turns[static_cast<std::size_t>(boundary.ids[i])] != 0) {
      surface.triangles.push_back(t);
      surface.area += area(surface.points, t);
    }
  }
  if (over_holes) surface.triangles.insert(surface.triangles.end(), surface.caps.begin(), surface.caps.end());
  return surface;
}

Eigen::Vector3d middle(const SolidSurface& surface, std::uint32_t triangle) {
  const Triangle& t = surface.triangles[triangle];
  return (surface.points[t[0]].cast<double>() + surface.points[t[1]].cast<double>() +
          surface.points[t[2]].cast<double>()) /
         3.0;
}

}  // namespace hermesh
