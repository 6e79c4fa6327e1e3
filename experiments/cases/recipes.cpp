#include "experiments/cases/recipes.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "algorithms/core/error.h"
#include "experiments/cases/recipe_shapes.h"

namespace hermesh::recipes {

using Eigen::Vector3d;

/// Uses Taylor series on an eighth of a turn around a quarter, where sixteen powers are exact to about the
/// last bit; multiples of a quarter turn are exact.
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

/// Adds one quadrant of the strip between two neighbouring rings of the octahedral sphere; the ring `inner`
/// has `steps` edges in the quadrant and the ring `outer` one more. Positions wrap around within each ring.
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

/// An octahedron whose faces are cut n times, mapped so that all triangles have about the same area (Roşca &
/// Plonka, Uniform spherical grids via equal area projection from the cube, 2011, have the octahedron's map):
/// ring a of the upper half is at height 1 - (a/n)² and has 4a points.
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

/// Adds a box whose corners are at(x, y, z) with x, y and z from 0 to 1.
template <class At>
void add_box(PolygonMesh& mesh, const At& at) {
  const std::uint32_t first = next_index(mesh);
  for (int corner = 0; corner < 8; ++corner)
    add_point(mesh, at(corner & 1, corner >> 1 & 1, corner >> 2 & 1));
  for (const Quad& q :
       {Quad{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}})
    add_quad(mesh, first + q[0], first + q[1], first + q[2], first + q[3]);
}

PolygonMesh turned_cube(const RecipeParameters& parameters, RunContext&) {
  PolygonMesh mesh;
  add_box(mesh, [&](int x, int y, int z) -> Vector3d {
    return turned(parameters.at("side") * (Vector3d(x, y, z) - Vector3d::Constant(0.5)), parameters);
  });
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

/// Returns the surface between two poles on the z axis: rings of `around` points at (radius, height), from
/// the bottom up.
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

// ---- Shapes with noise.

double GradientNoise::operator()(const Vector3d& point) const {
  const Vector3d cell = point.array().floor();
  const Vector3d at = point - cell;
  const Vector3d fade = at.array().cube() * (at.array() * (at.array() * 6.0 - 15.0) + 10.0);
  double value = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    double weight = 1.0;
    Vector3d offset;
    for (int axis = 0; axis < 3; ++axis) {
      const int bit = corner >> axis & 1;
      weight *= bit ? fade[axis] : 1.0 - fade[axis];
      offset[axis] = bit;
    }
    value += weight * gradient(cell + offset, at - offset);
  }
  return value;
}

/// The gradients are the twelve vectors from a cube's centre to the middles of its edges, four of them twice.
double GradientNoise::gradient(const Vector3d& lattice_point, const Vector3d& offset) const {
  std::uint64_t h = seed_;
  h ^= static_cast<std::uint64_t>(static_cast<std::int64_t>(lattice_point.x())) * 0x8da6b343u;
  h ^= static_cast<std::uint64_t>(static_cast<std::int64_t>(lattice_point.y())) * 0xd8163841u;
  h ^= static_cast<std::uint64_t>(static_cast<std::int64_t>(lattice_point.z())) * 0xcb1ab31fu;
  h = (h ^ (h >> 30)) * 0xbf58476d1ce4e5b9u;  // finaliser of splitmix64
  h = (h ^ (h >> 27)) * 0x94d049bb133111ebu;
  h >>= 60;
  const double u = h < 8 ? offset.x() : offset.y();
  const double v = h < 4 ? offset.y() : h == 12 || h == 14 ? offset.x() : offset.z();
  return (h & 1 ? -u : u) + (h & 2 ? -v : v);
}

/// Moving points along their rays from the centre cannot make a star-shaped mesh intersect itself.
PolygonMesh noise_sphere(const RecipeParameters& parameters, RunContext& context) {
  const double triangles = parameters.at("triangles"), radius = parameters.at("radius");
  PolygonMesh mesh =
      octahedral_sphere(std::max(1u, static_cast<std::uint32_t>(std::round(std::sqrt(triangles / 8.0)))));
  const GradientNoise noise(static_cast<std::uint64_t>(parameters.at("seed")));
  const double octaves = parameters.at("octaves");
  const auto displace = [&](Eigen::Vector3f& point) {
    const Vector3d direction = point.cast<double>();
    double height = 0.0, amplitude = parameters.at("amplitude"), frequency = parameters.at("frequency");
    for (int octave = 0; octave < octaves; ++octave) {
      height += amplitude * noise(direction * frequency);
      amplitude *= 0.5;
      frequency *= 2.0;
    }
    point = (direction * (radius * std::max(0.1, 1.0 + height))).cast<float>();
  };
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, mesh.points.size(), 4096), [&](const auto& range) {
    context.check();
    for (std::size_t i = range.begin(); i < range.end(); ++i) displace(mesh.points[i]);
  });
  return mesh;
}

// ---- A part.

namespace {

/// A line, or a quarter of a circle about `centre` from `start` turns on.
struct ProfilePiece {
  Eigen::Vector2d from, to;
  bool arc = false;
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  double start = 0.0;

  double length() const { return arc ? (from - centre).norm() * std::numbers::pi / 2.0 : (to - from).norm(); }
  Eigen::Vector2d at(double share) const {
    if (!arc) return from + share * (to - from);
    const auto [x, y] = on_circle(start + share / 4.0);
    return centre + (from - centre).norm() * Eigen::Vector2d(x, y);
  }
};

/// Outline of the part, star-shaped about (0, -0.1): a blend with a radius of 0.4, a sharp notch, a chamfer,
/// a blend with a radius of 0.25, and sharp corners.
const std::vector<ProfilePiece>& part_profile() {
  static const std::vector<ProfilePiece> pieces = {{{1, -0.6}, {1, 0.2}},
                                                   {{1, 0.2}, {0.6, 0.6}, true, {0.6, 0.2}, 0.0},
                                                   {{0.6, 0.6}, {0.2, 0.6}},
                                                   {{0.2, 0.6}, {0, 0.35}},
                                                   {{0, 0.35}, {-0.2, 0.6}},
                                                   {{-0.2, 0.6}, {-0.7, 0.6}},
                                                   {{-0.7, 0.6}, {-1, 0.3}},
                                                   {{-1, 0.3}, {-1, -0.35}},
                                                   {{-1, -0.35}, {-0.75, -0.6}, true, {-0.75, -0.35}, 0.5},
                                                   {{-0.75, -0.6}, {1, -0.6}}};
  return pieces;
}

constexpr double part_height = 0.8;
constexpr double part_radius = 0.8;  ///< about the profile's mean distance to its centre

std::uint32_t steps_of_length(double length, double step) {
  return static_cast<std::uint32_t>(std::max(1.0, std::round(length / step)));
}

std::size_t part_triangles(double step) {
  std::size_t around = 0;
  for (const ProfilePiece& piece : part_profile()) around += steps_of_length(piece.length(), step);
  const std::size_t up = steps_of_length(part_height, step), inwards = steps_of_length(part_radius, step);
  return 2 * around * up + 2 * around * (2 * inwards - 1);
}

/// Returns a prism over the profile. Rings of points shrink towards the centre of the lower cap, climb the
/// side, and shrink again.
PolygonMesh part_with_step(double step) {
  std::vector<Eigen::Vector2d> outline;
  for (const ProfilePiece& piece : part_profile()) {
    const std::uint32_t steps = steps_of_length(piece.length(), step);
    for (std::uint32_t i = 0; i < steps; ++i) outline.push_back(piece.at(double(i) / steps));
  }
  const std::uint32_t up = steps_of_length(part_height, step), inwards = steps_of_length(part_radius, step);
  const auto around = static_cast<std::uint32_t>(outline.size());
  const Eigen::Vector2d centre(0.0, -0.1);
  PolygonMesh mesh;
  const auto add_ring = [&](double share, double height) {
    for (const Eigen::Vector2d& point : outline) {
      const Eigen::Vector2d p = centre + share * (point - centre);
      add_point(mesh, {p.x(), p.y(), height});
    }
  };
  add_point(mesh, {centre.x(), centre.y(), -part_height / 2});
  for (std::uint32_t i = 1; i < inwards; ++i) add_ring(double(i) / inwards, -part_height / 2);
  for (std::uint32_t i = 0; i <= up; ++i) add_ring(1.0, part_height * (double(i) / up - 0.5));
  for (std::uint32_t i = inwards - 1; i > 0; --i) add_ring(double(i) / inwards, part_height / 2);
  add_point(mesh, {centre.x(), centre.y(), part_height / 2});
  connect_rings(mesh, around);
  return mesh;
}

}  // namespace

/// Uses the longest step that gives at least the requested number of triangles.
PolygonMesh cad_part(const RecipeParameters& parameters, RunContext&) {
  double coarse = 1.0, fine = 1.0;
  while (part_triangles(fine) < parameters.at("triangles")) fine /= 2.0;
  for (int i = 0; i < 40; ++i) {
    const double middle = (coarse + fine) / 2.0;
    (part_triangles(middle) < parameters.at("triangles") ? coarse : fine) = middle;
  }
  return part_with_step(fine);
}

// ---- Shapes that test signs: overlaps, holes, narrow gaps and thin plates.

PolygonMesh sphere_cluster(const RecipeParameters& parameters, RunContext&) {
  const PolygonMesh sphere = octahedral_sphere(static_cast<std::uint32_t>(parameters.at("cuts")));
  Random random(parameters.at("seed"));
  PolygonMesh mesh;
  for (int i = 0; i < parameters.at("spheres"); ++i) {
    Vector3d centre;
    for (int axis = 0; axis < 3; ++axis) centre[axis] = parameters.at("spread") * (random.uniform() - 0.5);
    add_sphere(mesh, sphere, parameters.at("radius"), centre, false);
  }
  const std::vector<Triangle> once = mesh.triangles;
  for (int copy = 1; copy < parameters.at("copies"); ++copy)
    mesh.triangles.insert(mesh.triangles.end(), once.begin(), once.end());
  if (parameters.at("turned") > 0.0)
    for (Triangle& triangle : mesh.triangles)
      if (random.bits() & 1) std::swap(triangle[1], triangle[2]);
  return mesh;
}

/// A sphere with a ring of points about one of its poles, which bounds a hole of its diameter if `open`. The
/// uv-sphere is turned so that the hole faces no axis of the grid.
PolygonMesh holed_sphere(const RecipeParameters& parameters, RunContext&) {
  const auto around = static_cast<std::uint32_t>(parameters.at("around"));
  const double radius = parameters.at("radius"), hole = parameters.at("hole") / 2.0;
  const RecipeParameters turn = {{"about_x", 25.0}, {"about_y", 40.0}, {"about_z", 10.0}};
  PolygonMesh mesh;
  const auto add = [&](double x, double y, double z) { add_point(mesh, turned({x, y, z}, turn)); };
  add(0, 0, -radius);
  const auto ring = [&](double out, double height) {
    for (std::uint32_t i = 0; i < around; ++i) {
      const auto [x, y] = on_circle(double(i) / around);
      add(out * x, out * y, height);
    }
  };
  const std::uint32_t strips = around / 2;
  for (std::uint32_t i = 1; i < strips; ++i) {
    const auto [height, out] = on_circle(0.5 - 0.5 * i / strips);
    // The ring of the hole replaces the rings within one and a half times its radius.
    if (height > 0.0 && out * radius < 1.5 * hole) break;
    ring(radius * out, radius * height);
  }
  if (hole > 0.0) ring(hole, std::sqrt(radius * radius - hole * hole));
  add(0, 0, radius);
  connect_rings(mesh, around);
  if (hole > 0.0 && parameters.at("open") > 0.0) {
    const std::uint32_t pole = next_index(mesh) - 1;
    std::erase_if(mesh.triangles, [&](const Triangle& t) { return std::ranges::find(t, pole) != t.end(); });
    mesh.points.pop_back();
  }
  return mesh;
}

PolygonMesh sheets(const RecipeParameters& parameters, RunContext&) {
  const double width = parameters.at("width"), thickness = parameters.at("thickness");
  const double step = thickness + parameters.at("gap"), plates = parameters.at("plates");
  PolygonMesh mesh;
  for (int plate = 0; plate < plates; ++plate) {
    const double bottom = step * plate - 0.5 * (step * (plates - 1) + thickness);
    add_box(mesh, [&](int x, int y, int z) {
      return turned({width * (x - 0.5), width * (y - 0.5), bottom + thickness * z}, parameters);
    });
  }
  return mesh;
}

}  // namespace hermesh::recipes

namespace hermesh {
namespace {

struct RecipeParameter {
  std::string name;
  double fallback, minimum, maximum;
};
struct Recipe {
  std::string name;
  std::vector<RecipeParameter> parameters;
  PolygonMesh (*make)(const RecipeParameters& parameters, RunContext& context);
};

constexpr double kMostTriangles = 1e8;  ///< about ten times the largest case

/// See cases.toml for the meaning of the parameters.
const std::vector<Recipe>& recipe_table() {
  static const RecipeParameter kCuts{"cuts", 64, 1, 3000}, kAround{"around", 128, 3, 10000},
      kRadius{"radius", 1, 1e-6, 1e6}, kAboutX{"about_x", 0, -360, 360}, kAboutY{"about_y", 0, -360, 360},
      kAboutZ{"about_z", 0, -360, 360};
  static const std::vector<Recipe> recipes = {
      {"noise-sphere",
       {{"triangles", 1e6, 8, kMostTriangles},
        kRadius,
        {"octaves", 7, 0, 20},
        {"amplitude", 0.25, 0, 1},
        {"frequency", 2, 0.01, 1000},
        {"seed", 1, 0, 1e9}},
       recipes::noise_sphere},
      {"turned-cube", {{"side", 1, 1e-6, 1e6}, kAboutX, kAboutY, kAboutZ}, recipes::turned_cube},
      {"torus",
       {{"major_radius", 1, 1e-6, 1e6}, {"minor_radius", 0.4, 1e-6, 1e6}, kAround, {"across", 64, 3, 10000}},
       recipes::torus},
      {"nested-spheres",
       {{"outer", 1, 1e-6, 1e6}, {"cavity", 0.7, 1e-6, 1e6}, {"core", 0.4, 1e-6, 1e6}, kCuts},
       recipes::nested_spheres},
      {"overlapping-spheres", {kRadius, {"distance", 1, 0, 1e6}, kCuts}, recipes::overlapping_spheres},
      {"sphere-cluster",
       {kRadius,
        {"spheres", 8, 1, 1000},
        {"spread", 2, 0, 1e6},
        kCuts,
        {"copies", 1, 1, 10},
        {"turned", 0, 0, 1},
        {"seed", 1, 0, 1e9}},
       recipes::sphere_cluster},
      {"holed-sphere", {kRadius, {"hole", 0.1, 0, 1e6}, {"open", 0, 0, 1}, kAround}, recipes::holed_sphere},
      {"sheets",
       {{"plates", 1, 1, 1000},
        {"width", 1, 1e-6, 1e6},
        {"thickness", 0.1, 1e-9, 1e6},
        {"gap", 0.1, 1e-9, 1e6},
        kAboutX,
        kAboutY,
        kAboutZ},
       recipes::sheets},
      {"splash",
       {{"length", 10, 1e-6, 1e6},
        {"crowns", 14, 0, 1000},
        {"ligaments", 400, 0, 1e5},
        {"droplets", 6000, 1, 1e6},
        {"detail", 1, 0.1, 10},
        {"part", 0, 0, 4},
        {"seed", 1, 0, 1e9}},
       recipes::splash},
      {"uv-sphere", {kRadius, kAround, {"upward", 64, 2, 10000}}, recipes::uv_sphere},
      {"cylinder", {kRadius, {"height", 2, 1e-6, 1e6}, kAround}, recipes::cylinder},
      {"cad-part", {{"triangles", 20000, 100, kMostTriangles}}, recipes::cad_part}};
  return recipes;
}

}  // namespace

std::vector<std::string> recipe_names() {
  std::vector<std::string> names;
  for (const Recipe& each : recipe_table()) names.push_back(each.name);
  return names;
}

bool is_recipe(const std::string& name) {
  return std::ranges::find(recipe_table(), name, &Recipe::name) != recipe_table().end();
}

PolygonMesh make_recipe(const std::string& name, RecipeParameters parameters, RunContext& context) {
  const auto recipe = std::ranges::find(recipe_table(), name, &Recipe::name);
  if (recipe == recipe_table().end()) {
    std::string names;
    for (const std::string& each : recipe_names()) names += (names.empty() ? "" : ", ") + each;
    throw Error("unknown recipe '" + name + "'; expected one of " + names);
  }
  for (const auto& [key, value] : parameters) {
    const auto parameter = std::ranges::find(recipe->parameters, key, &RecipeParameter::name);
    if (parameter == recipe->parameters.end())
      throw Error("recipe " + name + " has no parameter '" + key + "'");
    if (!(value >= parameter->minimum && value <= parameter->maximum))
      throw Error("parameter '" + key + "' of recipe " + name + " is out of its range");
  }
  for (const RecipeParameter& parameter : recipe->parameters)
    parameters.emplace(parameter.name, parameter.fallback);
  const Stage stage(context, "generate");
  return recipe->make(parameters, context);
}

}  // namespace hermesh
