// A splash: droplets, sheets and ligaments in the proportions of the fluid simulation of tables 9.3 and 9.4,
// which is not to be had (Aldén 2011, §9.2).
#include <algorithm>
#include <cmath>

#include "experiments/cases/recipe_shapes.h"

namespace hermesh::recipes {

using Eigen::Vector3d;

namespace {

/// Half of the box's sides, which are as 716 : 928 : 2671, the longest one being 1.
const Vector3d kHalf(0.134032, 0.173718, 0.5);
constexpr double kWater = -0.11;  ///< height of the pool's surface
constexpr double kGap = 0.001;    ///< least gap between droplets
constexpr double kGravity = 0.9;  ///< lengths per squared unit of time

/// A crown: a ring of thin sheet that leans outwards.
struct Crown {
  double x, z, radius, height, flare, thickness;
  GradientNoise noise;

  /// Share of the full height that the rim reaches.
  double rim(double turns) const {
    const auto [c, s] = on_circle(turns);
    return 0.75 + 0.45 * noise({2.5 * c, 2.5 * s, 0.5});
  }
  /// A point on the middle surface of the sheet: `up` from 0 below the water to 1 at the rim.
  Vector3d middle(double turns, double up, double aside) const {
    const auto [c, s] = on_circle(turns);
    const double reach =
        radius * (0.85 + flare * up * up) + 0.004 * noise({3.0 * c, 3.0 * s, 4.0 * up}) + aside;
    return {x + reach * c, kWater - 0.012 + (height * rim(turns) + 0.012) * up, z + reach * s};
  }
};

void append(PolygonMesh& mesh, const PolygonMesh& part) {
  const std::uint32_t first = next_index(mesh);
  mesh.points.insert(mesh.points.end(), part.points.begin(), part.points.end());
  for (const auto& [a, b, c] : part.triangles) mesh.triangles.push_back({first + a, first + b, first + c});
}

/// Turns a closed part inside out if its volume is negative.
PolygonMesh facing_outwards(PolygonMesh part) {
  double volume = 0.0;
  const Vector3d origin = part.points[0].cast<double>();
  for (const auto& [a, b, c] : part.triangles) {
    const Vector3d p = part.points[a].cast<double>() - origin, q = part.points[b].cast<double>() - origin,
                   r = part.points[c].cast<double>() - origin;
    volume += p.dot(Vector3d(q.y() * r.z() - q.z() * r.y(), q.z() * r.x() - q.x() * r.z(),
                             q.x() * r.y() - q.y() * r.x()));
  }
  if (volume < 0.0)
    for (Triangle& triangle : part.triangles) std::swap(triangle[1], triangle[2]);
  return part;
}

/// A closed sheet around the crown's ring: outside upwards, inside downwards, thicker at its rim.
PolygonMesh sheet_of(const Crown& crown, double detail) {
  const auto around = static_cast<std::uint32_t>(400 * detail),
             upward = static_cast<std::uint32_t>(40 * detail);
  PolygonMesh mesh;
  for (std::uint32_t i = 0; i < around; ++i)
    for (std::uint32_t j = 0; j < 2 * upward; ++j) {
      const bool outside = j < upward;
      const double up = double(outside ? j : 2 * upward - 1 - j) / (upward - 1);
      const double bead = std::max(0.0, up - 0.9) * 10.0;
      const double half = 0.5 * crown.thickness * (1.0 - 0.6 * up + 0.8 * bead * bead);
      add_point(mesh, crown.middle(double(i) / around, up, outside ? half : -half));
    }
  const std::uint32_t loop = 2 * upward;
  for (std::uint32_t i = 0; i < around; ++i)
    for (std::uint32_t j = 0; j < loop; ++j) {
      const std::uint32_t i2 = (i + 1) % around, j2 = (j + 1) % loop;
      add_quad(mesh, i * loop + j, i2 * loop + j, i2 * loop + j2, i * loop + j2);
    }
  return facing_outwards(std::move(mesh));
}

/// A box whose upper side has waves; the points of its lower side stand below those of the upper one.
PolygonMesh pool_of_waves(const GradientNoise& noise, double detail) {
  const auto nx = static_cast<std::uint32_t>(140 * detail), nz = static_cast<std::uint32_t>(520 * detail);
  PolygonMesh mesh;
  for (const bool upper : {false, true})
    for (std::uint32_t j = 0; j <= nz; ++j)
      for (std::uint32_t i = 0; i <= nx; ++i) {
        const double x = kHalf.x() * (2.0 * i / nx - 1.0), z = kHalf.z() * (2.0 * j / nz - 1.0);
        const double wave =
            0.006 * noise({18.0 * x, 0.3, 18.0 * z}) + 0.002 * noise({70.0 * x, 0.7, 70.0 * z});
        add_point(mesh, {x, upper ? kWater + wave : -kHalf.y(), z});
      }
  const std::uint32_t layer = (nx + 1) * (nz + 1);
  const auto at = [&](std::uint32_t i, std::uint32_t j, bool upper) {
    return j * (nx + 1) + i + (upper ? layer : 0);
  };
  for (std::uint32_t j = 0; j < nz; ++j)
    for (std::uint32_t i = 0; i < nx; ++i) {
      add_quad(mesh, at(i, j, true), at(i, j + 1, true), at(i + 1, j + 1, true), at(i + 1, j, true));
      add_quad(mesh, at(i, j, false), at(i + 1, j, false), at(i + 1, j + 1, false), at(i, j + 1, false));
    }
  for (std::uint32_t i = 0; i < nx; ++i) {
    add_quad(mesh, at(i, 0, false), at(i, 0, true), at(i + 1, 0, true), at(i + 1, 0, false));
    add_quad(mesh, at(i, nz, false), at(i + 1, nz, false), at(i + 1, nz, true), at(i, nz, true));
  }
  for (std::uint32_t j = 0; j < nz; ++j) {
    add_quad(mesh, at(0, j, false), at(0, j + 1, false), at(0, j + 1, true), at(0, j, true));
    add_quad(mesh, at(nx, j, false), at(nx, j, true), at(nx, j + 1, true), at(nx, j + 1, false));
  }
  return mesh;
}

/// The path of a drop or ligament that flies off a rim.
struct Flight {
  Vector3d start, velocity;
  Vector3d at(double time) const {
    return start + time * velocity - Vector3d(0, 0.5 * kGravity * time * time, 0);
  }
};

Flight flight_from(const Crown& crown, Random& random) {
  const double turns = random.uniform();
  const auto [c, s] = on_circle(turns);
  const double out = random.uniform(0.02, 0.22), up = random.uniform(0.05, 0.42);
  return {crown.middle(turns, 1.0, 0.0),
          {out * c + random.uniform(-0.05, 0.05), up, out * s + random.uniform(-0.05, 0.05)}};
}

bool is_inside(const Vector3d& p, double radius) {
  return (p.array().abs() + radius < kHalf.array()).all() && p.y() - radius > kWater - 0.02;
}

/// A thread along a flight, thinner and thinner, with beads and a round end. Empty if it would leave the box.
PolygonMesh ligament(const Flight& flight, Random& random, double detail) {
  const auto around = static_cast<std::uint32_t>(std::max(6.0, 12 * detail)),
             rings = static_cast<std::uint32_t>(40 * detail);
  const double duration = random.uniform(0.05, 0.25), thick = random.uniform(0.0012, 0.0035),
               beads = random.uniform(2.0, 6.0), phase = random.uniform();
  const Vector3d aside{random.uniform(-1, 1), random.uniform(-0.2, 0.2), random.uniform(-1, 1)};
  PolygonMesh mesh;
  const auto centre = [&](double share) { return flight.at(duration * share); };
  for (std::uint32_t ring = 0; ring <= rings + 1; ++ring) {
    const double share = double(ring) / (rings + 1);
    if (!is_inside(centre(share), 2.0 * thick)) return {};
    if (ring == 0 || ring == rings + 1) {
      add_point(mesh, centre(share));
      continue;
    }
    const Vector3d along = (centre(share + 0.01) - centre(share - 0.01)).normalized();
    const Vector3d u = (aside - along * along.dot(aside)).normalized(),
                   v(along.y() * u.z() - along.z() * u.y(), along.z() * u.x() - along.x() * u.z(),
                     along.x() * u.y() - along.y() * u.x());
    const double round = std::sqrt(std::min(1.0, 24.0 * std::min(share, 1.0 - share)));
    const double radius =
        thick * round * (1.0 - 0.7 * share) * (1.0 + 0.3 * on_circle(beads * share + phase).second);
    for (std::uint32_t i = 0; i < around; ++i) {
      const auto [c, s] = on_circle(double(i) / around);
      add_point(mesh, centre(share) + radius * (c * u + s * v));
    }
  }
  connect_rings(mesh, around);
  return facing_outwards(std::move(mesh));
}

void add_droplet(PolygonMesh& mesh, const Vector3d& centre, double radius, double detail) {
  static constexpr double kSmallest = 0.0006;
  const double cuts = std::clamp(3.0 * detail * std::sqrt(radius / kSmallest), 2.0, 60.0);
  add_sphere(mesh, octahedral_sphere(static_cast<std::uint32_t>(cuts)), radius, centre, false);
}

/// Radii fall off with the square: many small droplets and a few large ones.
double droplet_radius(Random& random) {
  constexpr double kSmall = 0.0006, kLarge = 0.012;
  return kSmall / (1.0 - random.uniform() * (1.0 - kSmall / kLarge));
}

}  // namespace

PolygonMesh splash(const RecipeParameters& parameters, RunContext& context) {
  Random random(parameters.at("seed"));
  const double detail = parameters.at("detail");
  const GradientNoise waves(random.bits());
  const double only = std::floor(parameters.at("part"));
  const auto wanted = [&](double part) { return only == 0 || only == part; };
  PolygonMesh mesh = wanted(1) ? pool_of_waves(waves, detail) : PolygonMesh();
  std::vector<Crown> crowns;
  constexpr int kMostTries = 1000;  // fewer crowns are made if no space is left
  for (int tries = 0; crowns.size() < parameters.at("crowns") && tries < kMostTries; ++tries) {
    const double radius = random.uniform(0.025, 0.07), reach = 1.5 * radius;
    const Crown crown{random.uniform(reach - kHalf.x(), kHalf.x() - reach),
                      random.uniform(reach - 0.5, 0.5 - reach),
                      radius,
                      random.uniform(0.03, 0.13),
                      random.uniform(0.1, 0.5),
                      random.uniform(0.0016, 0.004),
                      GradientNoise(random.bits())};
    const auto meets = [&](const Crown& other) {
      const double apart = reach + 1.5 * other.radius, x = crown.x - other.x, z = crown.z - other.z;
      return x * x + z * z < apart * apart;
    };
    if (std::any_of(crowns.begin(), crowns.end(), meets)) continue;
    crowns.push_back(crown);
    if (wanted(2)) append(mesh, sheet_of(crowns.back(), detail));
  }
  // Without crowns, drops and ligaments start from the middle of the pool.
  const std::vector<Crown> sources =
      crowns.empty() ? std::vector<Crown>{{0, 0, 0.05, 0.05, 0.2, 0.003, GradientNoise(1)}} : crowns;
  const auto source = [&]() -> const Crown& { return sources[random.bits() % sources.size()]; };
  for (int made = 0; made < parameters.at("ligaments");) {
    context.check();
    const PolygonMesh thread = ligament(flight_from(source(), random), random, detail);
    if (thread.points.empty()) continue;
    if (wanted(3)) append(mesh, thread);
    ++made;
  }
  constexpr double kTop = 0.004;
  if (wanted(4))
    add_droplet(mesh, {0.0, kHalf.y() - kTop, 0.0}, kTop,
                detail);  // so that the box is as high as it should be
  std::vector<std::pair<Vector3d, double>> droplets;
  // Where no room is left there are fewer.
  std::size_t tries = 0, most = 20 * static_cast<std::size_t>(parameters.at("droplets"));
  while (droplets.size() + 1 < parameters.at("droplets") && tries++ < most) {
    context.check();
    const double radius = droplet_radius(random);
    const Vector3d centre = flight_from(source(), random).at(random.uniform(0.08, 0.7));
    // Droplets that touch have long become one; few of those that are left would be in the air.
    const auto touches = [&](const auto& other) {
      const double apart = radius + other.second + kGap;
      return (centre - other.first).squaredNorm() < apart * apart;
    };
    if (!is_inside(centre, radius) || std::any_of(droplets.begin(), droplets.end(), touches)) continue;
    if (wanted(4)) add_droplet(mesh, centre, radius, detail);
    droplets.emplace_back(centre, radius);
  }
  const auto length = static_cast<float>(parameters.at("length"));
  for (Eigen::Vector3f& point : mesh.points) point *= length;
  return mesh;
}

}  // namespace hermesh::recipes
