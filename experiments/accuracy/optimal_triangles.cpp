#include "experiments/accuracy/optimal_triangles.h"

#include <cmath>

namespace hermesh {

std::optional<double> triangles_times_error(const std::string& shape) {
  if (shape != "sphere" && shape != "ellipsoid" && shape != "torus") return std::nullopt;
  const std::shared_ptr<const ExactShape> surface = exact_shape(shape);
  // Facets this small miss less than a ten-thousandth of the area.
  const PolygonMesh facets = surface->facets(0.02);
  double sum = 0.0;
  for (const Triangle& t : facets.triangles) {
    const Eigen::Vector3d a = facets.world(t[0]), b = facets.world(t[1]), c = facets.world(t[2]);
    const double curvature = surface->nearest((a + b + c) / 3.0).gaussian_curvature;
    const double area = 0.5 * (b - a).cross(c - a).norm();
    sum += area * std::sqrt(std::abs(curvature)) / (curvature > 0 ? kEllipticArea : kHyperbolicArea);
  }
  return sum;
}

}  // namespace hermesh
