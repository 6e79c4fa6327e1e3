#include "algorithms/core/quad_diagonals.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <variant>

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// Smallest significant difference of cosines and of ratios of squared lengths: far above rounding.
constexpr double kAlike = 1e-9;

/// Properties of a quad's division along one diagonal.
struct Cut {
  bool proper = false;  ///< both halves face as the whole
  double cosine = -1;   ///< of the angle between the halves' normals; −1 if one has no area
  double squared_length = 0;
};

/// Returns the division along a–c of the quad a b c d with this normal as a whole.
Cut cut_along(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d,
              const Vector3d& normal) {
  const Vector3d first = (b - a).cross(c - a), second = (c - a).cross(d - a);
  Cut cut;
  cut.proper = first.dot(normal) > 0 && second.dot(normal) > 0;
  const double lengths = first.norm() * second.norm();
  if (lengths > 0) cut.cosine = first.dot(second) / lengths;
  cut.squared_length = (c - a).squaredNorm();
  return cut;
}

/// Returns true if b–d is a better diagonal than a–c, by the four criteria of the header in their order.
bool other_is_better(const PolygonMesh& mesh, const Quad& q) {
  const auto at = [&](int i) { return Vector3d(mesh.points[q[std::size_t(i)]].cast<double>()); };
  const Vector3d a = at(0), b = at(1), c = at(2), d = at(3);
  // Twice the vector area of the quad, independent of the diagonal.
  const Vector3d normal = (c - a).cross(d - b);
  const Cut own = cut_along(a, b, c, d, normal), other = cut_along(b, c, d, a, normal);
  // A concave quad has one proper diagonal, a convex one two; a self-intersecting quad may have none.
  if (own.proper != other.proper) return other.proper;
  if (std::abs(own.cosine - other.cosine) > kAlike) return other.cosine > own.cosine;
  const double longer = std::max(own.squared_length, other.squared_length);
  if (std::abs(own.squared_length - other.squared_length) > kAlike * longer)
    return other.squared_length < own.squared_length;
  return std::min(q[1], q[3]) < std::min(q[0], q[2]);
}

/// Moves the values of the first corner of each rotated quad after those of its last, in a corner attribute.
void turn_corners(const PolygonMesh& mesh, const std::vector<char>& turned, MeshAttribute& attribute) {
  if (attribute.domain != AttributeDomain::corner) return;
  const std::size_t n = std::size_t(attribute.components), first = 3 * mesh.triangles.size();
  std::visit(
      [&](auto& values) {
        for (std::size_t i = 0; i < turned.size(); ++i) {
          const auto at = values.begin() + std::ptrdiff_t((first + 4 * i) * n);
          if (turned[i]) std::rotate(at, at + std::ptrdiff_t(n), at + std::ptrdiff_t(4 * n));
        }
      },
      attribute.values);
}

}  // namespace

void choose_diagonals(PolygonMesh& mesh) {
  std::vector<char> turned(mesh.quads.size(), 0);
  tbb::parallel_for(std::size_t(0), mesh.quads.size(), [&](std::size_t i) {
    Quad& q = mesh.quads[i];
    if (!other_is_better(mesh, q)) return;
    // Quads are divided from their first corner to their third: rotation by one selects the other diagonal.
    std::rotate(q.begin(), q.begin() + 1, q.end());
    turned[i] = 1;
  });
  for (MeshAttribute& attribute : mesh.attributes) turn_corners(mesh, turned, attribute);
}

}  // namespace hermesh
