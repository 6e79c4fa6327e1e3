// The fewest triangles that any mesh of a surface within a distance can have, when the distance is small.
#pragma once

#include <optional>
#include <string>

#include "experiments/accuracy/exact_shapes.h"

namespace hermesh {

/// Largest area of a triangle whose distance to a surface of Gaussian curvature ±1 is at most 1 (a quadric,
/// for small distances; curvature K and distance ε scale it by ε/√|K|), with corners wherever they are best.
/// Elliptic: an equilateral triangle whose corners are as far outside as its middle is inside, 3√3 (L. Fejes
/// Tóth 1948); corners on the surface cover half of it. Hyperbolic: the largest
/// that a search over triangles and planes found, no proven optimum.
inline constexpr double kEllipticArea = 5.196152422706632;
inline constexpr double kHyperbolicArea = 6.13;

/// N · ε of the fewest triangles N within the distance ε of the shape, as ε goes to 0: the integral of √|K|
/// over the surface, divided by those areas. Parts with K = 0 cost nothing in this limit. None where the
/// shape has no facets to integrate over, or parts that are flat or have creases, for which the limit says
/// too little.
std::optional<double> triangles_times_error(const std::string& shape);

}  // namespace hermesh
