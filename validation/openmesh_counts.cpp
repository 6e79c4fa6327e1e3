#include <Eigen/Geometry>
#include <OpenMesh/Core/Mesh/PolyMesh_ArrayKernelT.hh>
#include <algorithm>
#include <vector>

#include "validation/geometry/triangle_soup.h"
#include "validation/library_counts.h"

namespace hermesh::validation {
namespace {

struct Traits : OpenMesh::DefaultTraits {
  using Point = OpenMesh::Vec3d;
};
using Mesh = OpenMesh::PolyMesh_ArrayKernelT<Traits>;

const char* const kName = "OpenMesh";

Eigen::Vector3d position(const Mesh& mesh, Mesh::VertexHandle v) {
  const OpenMesh::Vec3d& p = mesh.point(v);
  return {p[0], p[1], p[2]};
}

// Adds all polygons. Returns a message about the first rejected one, or an empty string.
std::string load(const MeshFile& file, double unit, Mesh& mesh, const RunContext& context) {
  const auto polygons = std::size_t(polygon_count(file));
  mesh.reserve(file.points.size(), file.points.size() + polygons, polygons);
  for (const Eigen::Vector3d& p : file.points) mesh.add_vertex(OpenMesh::Vec3d(p.x(), p.y(), p.z()));
  std::vector<Mesh::VertexHandle> handles;
  for (std::int64_t p = 0; p < polygon_count(file); ++p) {
    if (p % 65536 == 0) context.check();
    const PolygonCorners corners = polygon_corners(file, p);
    // add_face() requires distinct corners.
    if (repeats_corner(corners))
      return "OpenMesh cannot hold " + describe_polygon(file, p, unit) +
             ", which has one point at two corners.";
    handles.clear();
    for (int k = 0; k < corners.count; ++k) handles.emplace_back(int(corners.points[k]));
    if (!mesh.add_face(handles).is_valid())
      return "OpenMesh refuses " + describe_polygon(file, p, unit) +
             ": an edge or a point of it is used up by the polygons before it.";
  }
  return {};
}

// Returns a message about the first vertex with several fans, or an empty string. OpenMesh accepts two fans
// at one vertex if one of them is open when the other is added. Then either the vertex has two gaps, or a
// walk around it misses polygons.
std::string find_singular_vertex(const MeshFile& file, double unit, const Mesh& mesh) {
  std::vector<std::uint32_t> polygons_at(file.points.size(), 0);
  for (std::int64_t p = 0; p < polygon_count(file); ++p) {
    const PolygonCorners corners = polygon_corners(file, p);
    for (int k = 0; k < corners.count; ++k) ++polygons_at[corners.points[k]];
  }
  for (const auto v : mesh.vertices()) {
    if (polygons_at[std::size_t(v.idx())] == 0) continue;
    std::uint32_t reached = 0;
    for (auto it = mesh.cvf_ccwbegin(v); it.is_valid(); ++it) ++reached;
    if (!mesh.is_manifold(v) || reached != polygons_at[std::size_t(v.idx())])
      return "OpenMesh finds more than one fan of polygons at the point " +
             describe_point(unit * position(mesh, v)) + ".";
  }
  return {};
}

std::int64_t count_components(const Mesh& mesh) {
  std::vector<std::uint8_t> seen(mesh.n_faces(), 0);
  std::vector<Mesh::FaceHandle> stack;
  std::int64_t components = 0;
  for (const auto start : mesh.faces()) {
    if (seen[std::size_t(start.idx())]) continue;
    ++components;
    seen[std::size_t(start.idx())] = 1;
    stack.push_back(start);
    while (!stack.empty()) {
      const Mesh::FaceHandle f = stack.back();
      stack.pop_back();
      for (auto it = mesh.cff_begin(f); it.is_valid(); ++it) {
        if (seen[std::size_t(it->idx())]) continue;
        seen[std::size_t(it->idx())] = 1;
        stack.push_back(*it);
      }
    }
  }
  return components;
}

// Returns the corners of a polygon, beginning at the apex of the fan that cuts it.
std::vector<Eigen::Vector3d> fan(const Mesh& mesh, const MeshFile& file, Mesh::FaceHandle f) {
  std::vector<Eigen::Vector3d> corners;
  std::size_t start = 0;
  const std::size_t polygon = std::size_t(f.idx());
  const bool quad = polygon >= file.triangles.size();
  const std::uint32_t first =
      quad ? cut_from_first(file.points, file.quads[polygon - file.triangles.size()], QuadRule::as_given)[0]
           : 0;
  for (auto it = mesh.cfv_ccwbegin(f); it.is_valid(); ++it) {
    if (quad && std::uint32_t(it->idx()) == first) start = corners.size();
    corners.push_back(position(mesh, *it));
  }
  std::rotate(corners.begin(), corners.begin() + std::ptrdiff_t(start), corners.end());
  return corners;
}

LibraryFindings count(const Mesh& mesh, const MeshFile& file) {
  LibraryFindings findings;
  findings.polygons = std::int64_t(mesh.n_faces());
  for (const auto e : mesh.edges()) findings.boundary_edges += mesh.is_boundary(e);
  std::int64_t used = 0;
  for (const auto v : mesh.vertices()) used += !mesh.is_isolated(v);
  findings.euler_characteristic = used - std::int64_t(mesh.n_edges()) + findings.polygons;
  findings.components = count_components(mesh);
  const Eigen::Vector3d centre = box_of(file).centre();
  for (const auto f : mesh.faces()) {
    const std::vector<Eigen::Vector3d> corners = fan(mesh, file, f);
    const Eigen::Vector3d first = corners[0] - centre;
    for (std::size_t i = 2; i < corners.size(); ++i) {
      const Eigen::Vector3d last = corners[i - 1] - centre, next = corners[i] - centre;
      findings.area += 0.5 * (last - first).cross(next - first).norm();
      findings.volume += first.dot(last.cross(next)) / 6.0;
    }
  }
  return findings;
}

}  // namespace

LibraryCounts count_with_openmesh(const MeshFile& file, const MeshReport& ours, RunContext& context,
                                  double unit) {
  // Refused polygons are reported, not printed to the terminal.
  omerr().disable();
  Mesh mesh;
  std::string refusal = load(file, unit, mesh, context);
  if (refusal.empty()) refusal = find_singular_vertex(file, unit, mesh);
  if (!refusal.empty()) return library_refused(kName, refusal, file, ours);
  context.check();
  return library_loaded(kName, count(mesh, file), file, ours);
}

}  // namespace hermesh::validation
