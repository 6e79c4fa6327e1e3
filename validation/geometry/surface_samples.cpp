#include "validation/geometry/surface_samples.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace hermesh::validation {
namespace {

// The powers of the inverse of the plastic number, the real root of x³ = x + 1.
constexpr double kFirstStep = 0.7548776662466927;
constexpr double kSecondStep = 0.5698402909980532;

double fraction(double x) { return x - std::floor(x); }

}  // namespace

SurfaceSamples::SurfaceSamples(const TriangleSoup& soup, std::int64_t count) : soup_(soup), count_(count) {
  area_up_to_.reserve(soup.triangles.size());
  double total = 0.0;
  for (std::size_t t = 0; t < soup.triangles.size(); ++t) {
    const Corners c = soup.corners(t);
    total += 0.5 * (c[1] - c[0]).cross(c[2] - c[0]).norm();
    area_up_to_.push_back(total);
  }
  if (!(total > 0.0)) count_ = 0;
}

std::size_t SurfaceSamples::triangle(std::int64_t i) const {
  const double area = area_up_to_.back() * ((double(i) + 0.5) / double(count_));
  const auto found = std::upper_bound(area_up_to_.begin(), area_up_to_.end() - 1, area);
  return std::size_t(found - area_up_to_.begin());
}

Eigen::Vector3d SurfaceSamples::operator[](std::int64_t i) const {
  const Corners c = soup_.corners(triangle(i));
  double u = fraction(double(i) * kFirstStep), v = fraction(double(i) * kSecondStep);
  // The half of the square that is not the triangle folds onto it.
  if (u + v > 1.0) u = 1.0 - u, v = 1.0 - v;
  return c[0] + u * (c[1] - c[0]) + v * (c[2] - c[0]);
}

}  // namespace hermesh::validation
