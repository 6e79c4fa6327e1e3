// Whether two triangles meet anywhere but in the corners that they share: a test that may say "perhaps",
// never wrongly "no".
#pragma once

#include <Eigen/Core>
#include <array>

#include "algorithms/core/polygon_mesh.h"

namespace hermesh {

/// The corners of a triangle.
using Corners = std::array<Eigen::Vector3d, 3>;

/// True if it is certain that the triangles are apart, or meet only in their shared corners or their shared
/// edge. The first `shared` (0, 1 or 2) corners of both are the same points; other corners that happen to
/// coincide count as contact, and so does whatever is nearer than rounding can tell (about 1e-9 of the
/// triangles' size). By separating planes (Gottschalk et al. 1996, with the planes through a shared corner or
/// edge as closed ones).
bool certainly_apart(const Corners& a, const Corners& b, int shared);

/// A triangle whose corners have names: corners of the same name are the same point.
struct NamedTriangle {
  Triangle names;
  Corners corners;
};
/// Whether two triangles are certainly apart, but for what their names say that they share; false if all
/// corners are shared.
bool certainly_apart(NamedTriangle a, NamedTriangle b);

/// Whether two triangles of a mesh are certainly apart, but for the points that they share; false if they
/// share all three. `points[i]` is the place of point i.
template <class Points>
bool certainly_apart(Triangle a, Triangle b, const Points& points) {
  const auto named = [&](const Triangle& t) {
    return NamedTriangle{t, {points[t[0]], points[t[1]], points[t[2]]}};
  };
  return certainly_apart(named(a), named(b));
}

}  // namespace hermesh
