#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "experiments/cases/recipe_random.h"
#include "experiments/cases/recipe_shapes.h"

namespace hermesh::recipes {

using Eigen::Vector3d;

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

}  // namespace hermesh::recipes
