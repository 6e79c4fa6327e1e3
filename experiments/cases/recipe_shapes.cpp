#include "experiments/cases/recipe_shapes.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace hermesh::recipes {

using Eigen::Vector3d;

/// Cosine and sine by Taylor series on an eighth of a turn around a quarter, where sixteen powers are exact
/// to the last bit or so; multiples of a quarter turn are exact.
std::pair<double, double> on_circle(double turns) {
  const double quarter = std::round(4.0 * turns);
  const double angle = (turns - quarter / 4.0) * 2.0 * std::numbers::pi;
  double cosine = 1.0, sine = 1.0;
  for (int power = 16; power >= 2; power -= 2) {
    cosine = 1.0 - cosine * angle * angle / (power * (power - 1));
    sine = 1.0 - sine * angle * angle / (power * (power + 1));
  }
  sine *= angle;
  switch (static_cast<long>(quarter) & 3) {
    case 0:
      return {cosine, sine};
    case 1:
      return {-sine, cosine};
    case 2:
      return {-cosine, -sine};
    default:
      return {sine, -cosine};
  }
}

void add_quad(PolygonMesh& mesh, std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
  mesh.triangles.push_back({a, b, c});
  mesh.triangles.push_back({a, c, d});
}

void connect_rings(PolygonMesh& mesh, std::uint32_t around) {
  const std::uint32_t last = next_index(mesh) - 1;
  for (std::uint32_t i = 0; i < around; ++i) {
    const std::uint32_t j = (i + 1) % around;
    mesh.triangles.push_back({0, 1 + j, 1 + i});
    for (std::uint32_t ring = 1; ring < last - around; ring += around)
      add_quad(mesh, ring + i, ring + j, ring + around + j, ring + around + i);
    mesh.triangles.push_back({last, last - around + i, last - around + j});
  }
}

namespace {

/// One quadrant of the strip between two neighbouring rings of the octahedral sphere; the ring `inner` has
/// `steps` edges in the quadrant and the ring `outer` one more. Positions wrap around within each ring.
void add_octahedral_strip(PolygonMesh& mesh, std::uint32_t inner, std::uint32_t outer, std::uint32_t steps,
                          std::uint32_t quadrant, bool upper) {
  const auto at_inner = [&](std::uint32_t i) {
    return steps == 0 ? inner : inner + (quadrant * steps + i) % (4 * steps);
  };
  const auto at_outer = [&](std::uint32_t i) {
    return outer + (quadrant * (steps + 1) + i) % (4 * (steps + 1));
  };
  const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    mesh.triangles.push_back(upper ? Triangle{a, b, c} : Triangle{a, c, b});
  };
  for (std::uint32_t i = 0; i <= steps; ++i) {
    add(at_inner(i), at_outer(i), at_outer(i + 1));
    if (i < steps) add(at_inner(i), at_outer(i + 1), at_inner(i + 1));
  }
}

}  // namespace

/// Unit sphere of 8 n² triangles: an octahedron whose faces are cut n times, mapped so that all triangles
/// have about the same area (Roşca & Plonka, Uniform spherical grids via equal area projection from the cube,
/// 2011, have the octahedron's map): ring a of the upper half is at height 1 - (a/n)² and has 4a points.
PolygonMesh octahedral_sphere(std::uint32_t n) {
  PolygonMesh mesh;
  mesh.points.reserve(4 * std::size_t(n) * n + 2);
  mesh.triangles.reserve(8 * std::size_t(n) * n);
  std::vector<std::uint32_t> first;  // point of each ring, from the upper pole to the lower one
  for (std::uint32_t ring = 0; ring <= 2 * n; ++ring) {
    first.push_back(next_index(mesh));
    const std::uint32_t a = std::min(ring, 2 * n - ring);
    const double share = double(a) / n, height = (1.0 - share * share) * (ring <= n ? 1.0 : -1.0);
    const double radius = share * std::sqrt(2.0 - share * share);  // the root of 1 - height²
    for (std::uint32_t i = 0; i < std::max(1u, 4 * a); ++i) {
      const auto [x, y] = on_circle(a ? double(i) / (4 * a) : 0.0);
      add_point(mesh, {radius * x, radius * y, height});
    }
  }
  for (std::uint32_t ring = 0; ring < 2 * n; ++ring)
    for (std::uint32_t quadrant = 0; quadrant < 4; ++quadrant)
      if (ring < n)
        add_octahedral_strip(mesh, first[ring], first[ring + 1], ring, quadrant, true);
      else
        add_octahedral_strip(mesh, first[ring + 1], first[ring], 2 * n - ring - 1, quadrant, false);
  return mesh;
}

void add_sphere(PolygonMesh& mesh, const PolygonMesh& unit_sphere, double radius, const Vector3d& centre,
                bool inwards) {
  const std::uint32_t first = next_index(mesh);
  for (const Eigen::Vector3f& point : unit_sphere.points)
    add_point(mesh, centre + radius * point.cast<double>());
  for (const auto& [a, b, c] : unit_sphere.triangles)
    mesh.triangles.push_back(inwards ? Triangle{first + a, first + c, first + b}
                                     : Triangle{first + a, first + b, first + c});
}

PolygonMesh nested_spheres(const RecipeParameters& parameters, RunContext&) {
  const PolygonMesh sphere = octahedral_sphere(static_cast<std::uint32_t>(parameters.at("cuts")));
  PolygonMesh mesh;
  add_sphere(mesh, sphere, parameters.at("outer"), Vector3d::Zero(), false);
  add_sphere(mesh, sphere, parameters.at("cavity"), Vector3d::Zero(), true);
  add_sphere(mesh, sphere, parameters.at("core"), Vector3d::Zero(), false);
  return mesh;
}

PolygonMesh overlapping_spheres(const RecipeParameters& parameters, RunContext&) {
  const PolygonMesh sphere = octahedral_sphere(static_cast<std::uint32_t>(parameters.at("cuts")));
  const Vector3d shift(parameters.at("distance") / 2.0, 0.0, 0.0);
  PolygonMesh mesh;
  add_sphere(mesh, sphere, parameters.at("radius"), -shift, false);
  add_sphere(mesh, sphere, parameters.at("radius"), shift, false);
  return mesh;
}

Vector3d turned(const Vector3d& point, const RecipeParameters& parameters) {
  const auto [cx, sx] = on_circle(parameters.at("about_x") / 360.0);
  const auto [cy, sy] = on_circle(parameters.at("about_y") / 360.0);
  const auto [cz, sz] = on_circle(parameters.at("about_z") / 360.0);
  Vector3d p = point;
  p = Vector3d(p.x(), cx * p.y() - sx * p.z(), sx * p.y() + cx * p.z());
  p = Vector3d(cy * p.x() + sy * p.z(), p.y(), cy * p.z() - sy * p.x());
  return {cz * p.x() - sz * p.y(), sz * p.x() + cz * p.y(), p.z()};
}

PolygonMesh turned_cube(const RecipeParameters& parameters, RunContext&) {
  PolygonMesh mesh;
  for (int corner = 0; corner < 8; ++corner) {
    const Vector3d p = Vector3d(corner & 1, corner >> 1 & 1, corner >> 2 & 1) - Vector3d::Constant(0.5);
    add_point(mesh, turned(parameters.at("side") * p, parameters));
  }
  for (const Quad& q :
       {Quad{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}})
    add_quad(mesh, q[0], q[1], q[2], q[3]);
  return mesh;
}

PolygonMesh torus(const RecipeParameters& parameters, RunContext&) {
  const auto around = static_cast<std::uint32_t>(parameters.at("around"));
  const auto across = static_cast<std::uint32_t>(parameters.at("across"));
  const double major = parameters.at("major_radius"), minor = parameters.at("minor_radius");
  PolygonMesh mesh;
  for (std::uint32_t i = 0; i < around; ++i) {
    const auto [x, y] = on_circle(double(i) / around);
    for (std::uint32_t k = 0; k < across; ++k) {
      const auto [out, up] = on_circle(double(k) / across);
      const double radius = major + minor * out;
      add_point(mesh, {radius * x, radius * y, minor * up});
    }
  }
  for (std::uint32_t i = 0; i < around; ++i)
    for (std::uint32_t k = 0; k < across; ++k) {
      const std::uint32_t j = (i + 1) % around, l = (k + 1) % across;
      add_quad(mesh, i * across + k, j * across + k, j * across + l, i * across + l);
    }
  return mesh;
}

namespace {

/// Surface between two poles on the z axis: rings of equally many points, at (radius, height) each, from the
/// bottom up.
PolygonMesh stacked_rings(double bottom, const std::vector<std::pair<double, double>>& rings, double top,
                          std::uint32_t around) {
  PolygonMesh mesh;
  add_point(mesh, {0, 0, bottom});
  for (const auto& [radius, height] : rings)
    for (std::uint32_t i = 0; i < around; ++i) {
      const auto [x, y] = on_circle(double(i) / around);
      add_point(mesh, {radius * x, radius * y, height});
    }
  add_point(mesh, {0, 0, top});
  connect_rings(mesh, around);
  return mesh;
}

}  // namespace

PolygonMesh uv_sphere(const RecipeParameters& parameters, RunContext&) {
  const double radius = parameters.at("radius"), upward = parameters.at("upward");
  std::vector<std::pair<double, double>> rings;
  for (int i = 1; i < upward; ++i) {
    const auto [height, out] = on_circle(0.5 - 0.5 * i / upward);
    rings.emplace_back(radius * out, radius * height);
  }
  return stacked_rings(-radius, rings, radius, static_cast<std::uint32_t>(parameters.at("around")));
}

PolygonMesh cylinder(const RecipeParameters& parameters, RunContext&) {
  const double radius = parameters.at("radius"), half = parameters.at("height") / 2.0;
  return stacked_rings(-half, {{radius, -half}, {radius, half}}, half,
                       static_cast<std::uint32_t>(parameters.at("around")));
}

}  // namespace hermesh::recipes
