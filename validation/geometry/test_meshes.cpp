#include "validation/geometry/test_meshes.h"

#include <map>
#include <numbers>

namespace hermesh::validation::test {

MeshFile cube_of_quads(const Eigen::Vector3d& lower, double side) {
  MeshFile mesh;
  for (int p = 0; p < 8; ++p)
    mesh.points.push_back(lower + side * Eigen::Vector3d(p & 1, (p >> 1) & 1, p >> 2));
  mesh.quads = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  return mesh;
}

MeshFile cube_of_triangles(const Eigen::Vector3d& lower, double side) {
  MeshFile mesh = cube_of_quads(lower, side);
  for (const Quad& q : mesh.quads) {
    mesh.triangles.push_back({q[0], q[1], q[2]});
    mesh.triangles.push_back({q[0], q[2], q[3]});
  }
  mesh.quads.clear();
  return mesh;
}

MeshFile torus(int around, int across) {
  MeshFile mesh;
  const auto index = [&](int i, int j) { return std::uint32_t((i % around) * across + j % across); };
  for (int i = 0; i < around; ++i)
    for (int j = 0; j < across; ++j) {
      const double u = 2.0 * std::numbers::pi * i / around, v = 2.0 * std::numbers::pi * j / across;
      const double r = 1.0 + 0.25 * std::cos(v);
      mesh.points.emplace_back(r * std::cos(u), r * std::sin(u), 0.25 * std::sin(v));
      mesh.quads.push_back({index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)});
    }
  return mesh;
}

MeshFile prism(int sides) {
  std::vector<Eigen::Vector2d> profile;
  for (int i = 0; i < sides; ++i) {
    const double u = 2.0 * std::numbers::pi * i / sides;
    profile.emplace_back(std::cos(u), std::sin(u));
  }
  return extrusion(profile, 2.0);
}

MeshFile extrusion(const std::vector<Eigen::Vector2d>& profile, double depth) {
  MeshFile mesh;
  const std::uint32_t n = std::uint32_t(profile.size());
  for (const Eigen::Vector2d& p : profile) mesh.points.emplace_back(p.x(), p.y(), 0.0);
  for (const Eigen::Vector2d& p : profile) mesh.points.emplace_back(p.x(), p.y(), depth);
  for (std::uint32_t i = 0; i < n; ++i) mesh.quads.push_back({i, (i + 1) % n, n + (i + 1) % n, n + i});
  for (std::uint32_t i = 1; i + 1 < n; ++i) {
    mesh.triangles.push_back({0, i + 1, i});
    mesh.triangles.push_back({n, n + i, n + i + 1});
  }
  return mesh;
}

MeshFile reversed(MeshFile mesh) {
  for (Triangle& t : mesh.triangles) std::swap(t[0], t[1]);
  for (Quad& q : mesh.quads) std::swap(q[1], q[3]);
  return mesh;
}

MeshFile together(MeshFile a, const MeshFile& b) {
  const std::uint32_t base = std::uint32_t(a.points.size());
  a.points.insert(a.points.end(), b.points.begin(), b.points.end());
  for (const Triangle& t : b.triangles) a.triangles.push_back({base + t[0], base + t[1], base + t[2]});
  for (const Quad& q : b.quads) a.quads.push_back({base + q[0], base + q[1], base + q[2], base + q[3]});
  return a;
}

MeshFile welded(const MeshFile& mesh) {
  MeshFile result = mesh;
  result.points.clear();
  std::map<std::array<double, 3>, std::uint32_t> number;
  std::vector<std::uint32_t> renamed;
  for (const Eigen::Vector3d& p : mesh.points) {
    const auto [it, added] = number.try_emplace({p.x(), p.y(), p.z()}, std::uint32_t(result.points.size()));
    if (added) result.points.push_back(p);
    renamed.push_back(it->second);
  }
  for (Triangle& t : result.triangles)
    for (std::uint32_t& p : t) p = renamed[p];
  for (Quad& q : result.quads)
    for (std::uint32_t& p : q) p = renamed[p];
  return result;
}

MeshFile soup_of_triangles(const MeshFile& mesh) {
  MeshFile soup;
  const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    const std::uint32_t base = std::uint32_t(soup.points.size());
    for (std::uint32_t p : {a, b, c}) soup.points.push_back(mesh.points[p]);
    soup.triangles.push_back({base, base + 1, base + 2});
  };
  for (const Triangle& t : mesh.triangles) add(t[0], t[1], t[2]);
  for (const Quad& q : mesh.quads) add(q[0], q[1], q[2]), add(q[0], q[2], q[3]);
  return soup;
}

}  // namespace hermesh::validation::test
