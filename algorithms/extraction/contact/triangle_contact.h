// A conservative intersection test of two triangles that may share vertices: it may report an intersection
// where there is none, but never misses one.
#pragma once

#include <Eigen/Core>
#include <array>

#include "algorithms/core/polygon_mesh.h"

namespace hermesh {

/// The corners of a triangle.
using Corners = std::array<Eigen::Vector3d, 3>;

/// Returns true if the triangles certainly intersect in nothing but their shared corners or their shared
/// edge. The first `shared` (0, 1 or 2) corners of both are the same points; other corners that happen to
/// coincide count as an intersection, as does any distance too small to distinguish from rounding (about 1e-9
/// of the triangles' size). Uses separating planes (Gottschalk et al. 1996), which may contain the shared
/// corner or edge.
bool certainly_apart(const Corners& a, const Corners& b, int shared);

/// A triangle whose corners have names: corners of the same name are the same point.
struct NamedTriangle {
  Triangle names;
  Corners corners;
};
/// Returns true if two triangles certainly intersect in nothing but the corners with equal names; false if
/// all corners are shared.
bool certainly_apart(NamedTriangle a, NamedTriangle b);

/// Returns true if two triangles of a mesh certainly intersect in nothing but their shared vertices or edge;
/// false if they share all three vertices. `points[i]` is the position of vertex i.
template <class Points>
bool certainly_apart(Triangle a, Triangle b, const Points& points) {
  const auto named = [&](const Triangle& t) {
    return NamedTriangle{t, {points[t[0]], points[t[1]], points[t[2]]}};
  };
  return certainly_apart(named(a), named(b));
}

}  // namespace hermesh
