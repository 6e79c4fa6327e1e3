#include "reference/test_meshes.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <set>

#include "reference/variants.h"

namespace hermesh::test {

using Eigen::Vector3d;
using Eigen::Vector3f;

PolygonMesh sphere(double radius, int levels, const Vector3d& centre) {
  PolygonMesh mesh;
  std::vector<Vector3d> points = {Vector3d::UnitX(),  -Vector3d::UnitX(), Vector3d::UnitY(),
                                  -Vector3d::UnitY(), Vector3d::UnitZ(),  -Vector3d::UnitZ()};
  mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  for (int level = 0; level < levels; ++level) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [entry, is_new] = middles.try_emplace(std::minmax(a, b), std::uint32_t(points.size()));
      if (is_new) points.push_back((points[a] + points[b]).normalized());
      return entry->second;
    };
    std::vector<Triangle> finer;
    for (const auto& [a, b, c] : mesh.triangles) {
      const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    mesh.triangles = finer;
  }
  for (const Vector3d& p : points) mesh.points.push_back((centre + radius * p).cast<float>());
  return mesh;
}

Eigen::Matrix3d turn() {
  const double degree = std::numbers::pi / 180.0;
  return (Eigen::AngleAxisd(40 * degree, Vector3d::UnitZ()) *
          Eigen::AngleAxisd(30 * degree, Vector3d::UnitY()) *
          Eigen::AngleAxisd(20 * degree, Vector3d::UnitX()))
      .toRotationMatrix();
}

PolygonMesh turned_cube(double half) {
  PolygonMesh mesh;
  for (int i = 0; i < 8; ++i) {
    const Vector3d corner(i & 1 ? half : -half, i & 2 ? half : -half, i & 4 ? half : -half);
    mesh.points.push_back((turn() * corner).cast<float>());
  }
  mesh.quads = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  return mesh;
}

PolygonMesh torus(double major, double minor, int rings, int sides) {
  PolygonMesh mesh;
  const auto index = [&](int i, int j) { return std::uint32_t((i % rings) * sides + j % sides); };
  for (int i = 0; i < rings; ++i)
    for (int j = 0; j < sides; ++j) {
      const double u = 2 * std::numbers::pi * i / rings, v = 2 * std::numbers::pi * j / sides;
      const double r = major + minor * std::cos(v);
      mesh.points.push_back(Vector3d(r * std::cos(u), r * std::sin(u), minor * std::sin(v)).cast<float>());
      mesh.triangles.push_back({index(i, j), index(i + 1, j), index(i + 1, j + 1)});
      mesh.triangles.push_back({index(i, j), index(i + 1, j + 1), index(i, j + 1)});
    }
  return mesh;
}

PolygonMesh joined(const PolygonMesh& first, const PolygonMesh& second) {
  PolygonMesh mesh = first;
  const auto shift = std::uint32_t(first.points.size());
  for (std::size_t i = 0; i < second.points.size(); ++i)
    mesh.points.push_back((second.world(i) - first.origin).cast<float>());
  for (Triangle t : second.triangles) {
    for (std::uint32_t& corner : t) corner += shift;
    mesh.triangles.push_back(t);
  }
  for (Quad q : second.quads) {
    for (std::uint32_t& corner : q) corner += shift;
    mesh.quads.push_back(q);
  }
  return mesh;
}

PolygonMesh reversed(PolygonMesh mesh) {
  for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
  for (Quad& q : mesh.quads) std::swap(q[1], q[3]);
  return mesh;
}

double signed_volume(const PolygonMesh& mesh) {
  double sum = 0.0;
  const auto point = [&](std::uint32_t i) { return Vector3d(mesh.points[i].cast<double>()); };
  for (const Triangle& t : triangulated(mesh)) sum += point(t[0]).dot(point(t[1]).cross(point(t[2]))) / 6.0;
  return sum;
}

bool closed_and_oriented(const PolygonMesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const Triangle& t : triangulated(mesh))
    for (int i = 0; i < 3; ++i) ++edges[{t[i], t[(i + 1) % 3]}];
  for (const auto& [edge, count] : edges) {
    const auto opposite = edges.find({edge.second, edge.first});
    if (count != 1 || opposite == edges.end() || opposite->second != 1) return false;
  }
  return true;
}

long euler_characteristic(const PolygonMesh& mesh) {
  std::set<std::uint32_t> points;
  std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
  const std::vector<Triangle> triangles = triangulated(mesh);
  for (const Triangle& t : triangles)
    for (int i = 0; i < 3; ++i) {
      points.insert(t[i]);
      edges.insert(std::minmax(t[i], t[(i + 1) % 3]));
    }
  return long(points.size()) - long(edges.size()) + long(triangles.size());
}

PolygonMesh extract(const std::string& extractor, const LevelSet& level_set,
                    const std::map<std::string, std::string>& options, double isovalue) {
  const Extractor& entry = find_variant(reference_extractors(), extractor);
  RunContext context;
  const Options checked(entry.name, entry.options, options);
  return entry.extract({level_set, isovalue, nullptr, checked, context});
}

LevelSet voxelize(const std::string& voxelizer, const PolygonMesh& mesh, double voxel_size, double exterior,
                  double interior) {
  RunContext context;
  return find_variant(reference_voxelizers(), voxelizer)
      .voxelize({mesh, voxel_size, exterior, interior, context});
}

}  // namespace hermesh::test
