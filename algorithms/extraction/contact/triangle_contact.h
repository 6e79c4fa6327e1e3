// Whether two triangles meet anywhere but in the corners that they share: a test that may say "perhaps", never wrongly "no".
#pragma once

#include <Eigen/Core>
#include <array>

#include "algorithms/core/polygon_mesh.h"

namespace hermesh {

using Corners = std::array<Eigen::Vector3d, 3>;

/// True if it is certain that the triangles are apart, or meet only in their shared corners or their shared edge. The
/// first `shared` (0, 1 or 2) corners of both are the same points; other corners that happen to coincide count as
/// contact, and so does whatever is nearer than rounding can tell (about 1e-9 of the triangles' size). By separating
/// planes (Gottschalk et al. 1996, with the planes through a shared corner or edge as closed ones).
bool certainly_apart(const Corners& a, const Corners& b, int shared);

/// Corners of the same name are the same point. False if all are.
struct NamedTriangle {
  Triangle names;
  Corners corners;
};
bool certainly_apart(NamedTriangle a, NamedTriangle b);

/// The same of two triangles of a mesh, by numbers of its points; false if they have all corners in common.
/// @param points[i] the place of point i
template <class Points>
bool certainly_apart(Triangle a, Triangle b, const Points& points) {
  const auto named = [&](const Triangle& t) {
    return NamedTriangle{t, {points[t[0]], points[t[1]], points[t[2]]}};
  };
  return certainly_apart(named(a), named(b));
}

}  // namespace hermesh
