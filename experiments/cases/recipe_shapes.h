// The formulas of recipes.h and their shared parts: random numbers, noise and shapes with the same bits on
// every machine.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <utility>

#include "experiments/cases/recipes.h"

namespace hermesh::recipes {

/// Random numbers by splitmix64 (Steele, Lea & Flood, Fast Splittable Pseudorandom Number Generators, 2014).
class Random {
 public:
  explicit Random(double seed) : state_(static_cast<std::uint64_t>(seed)) {}
  std::uint64_t bits() {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  }
  /// Returns the next number in [0, 1).
  double uniform() { return static_cast<double>(bits() >> 11) * 0x1p-53; }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }

 private:
  std::uint64_t state_;
};

/// Gradient noise (Perlin, Improving Noise, SIGGRAPH 2002) with a hash instead of the permutation table.
class GradientNoise {
 public:
  explicit GradientNoise(std::uint64_t seed) : seed_(seed * 0x9e3779b97f4a7c15u) {}
  /// Returns a value between about −1 and 1; 0 if all coordinates are integers.
  double operator()(const Eigen::Vector3d& point) const;

 private:
  double gradient(const Eigen::Vector3d& lattice_point, const Eigen::Vector3d& offset) const;
  std::uint64_t seed_;
};

/// Returns the cosine and the sine of an angle in turns.
std::pair<double, double> on_circle(double turns);

inline void add_point(PolygonMesh& mesh, const Eigen::Vector3d& point) {
  mesh.points.push_back(point.cast<float>());
}

inline std::uint32_t next_index(const PolygonMesh& mesh) {
  return static_cast<std::uint32_t>(mesh.points.size());
}

/// Adds the triangles abc and acd.
void add_quad(PolygonMesh& mesh, std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d);

/// Adds triangles that connect the mesh's vertices: vertex 0, then rings of `around` vertices each,
/// counter-clockwise seen from the last vertex, then that vertex.
void connect_rings(PolygonMesh& mesh, std::uint32_t around);

/// Returns the unit sphere as 8 n² triangles of about the same area.
PolygonMesh octahedral_sphere(std::uint32_t n);

/// Adds a sphere; one that faces inwards bounds a cavity.
void add_sphere(PolygonMesh& mesh, const PolygonMesh& unit_sphere, double radius,
                const Eigen::Vector3d& centre, bool inwards);

/// Returns the point rotated about x, then y, then z, by the parameters about_x, about_y and about_z in
/// degrees.
Eigen::Vector3d turned(const Eigen::Vector3d& point, const RecipeParameters& parameters);

PolygonMesh torus(const RecipeParameters& parameters, RunContext& context);
PolygonMesh splash(const RecipeParameters& parameters, RunContext& context);

}  // namespace hermesh::recipes
