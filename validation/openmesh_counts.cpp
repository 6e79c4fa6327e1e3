#include <Eigen/Geometry>
#include <OpenMesh/Core/Mesh/PolyMesh_ArrayKernelT.hh>
#include <numeric>

#include "validation/library_counts.h"
#include "validation/triangle_soup.h"

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

// Adds all polygons. Returns a sentence about the first that is refused, or nothing.
std::string load(const MeshFile& file, Mesh& mesh, const RunContext& context) {
  const auto polygons = std::size_t(polygon_count(file));
  mesh.reserve(file.points.size(), file.points.size() + polygons, polygons);
  for (const Eigen::Vector3d& p : file.points) mesh.add_vertex(OpenMesh::Vec3d(p.x(), p.y(), p.z()));
  std::vector<Mesh::VertexHandle> handles;
  for (std::int64_t p = 0; p < polygon_count(file); ++p) {
    if (p % 65536 == 0) context.check();
    const PolygonCorners corners = polygon_corners(file, p);
    // add_face() takes it for granted that the corners differ.
    if (repeats_corner(corners))
      return "OpenMesh cannot hold " + describe_polygon(file, p) + ", which has one point at two corners.";
    handles.clear();
    for (int k = 0; k < corners.count; ++k) handles.emplace_back(int(corners.points[k]));
    if (!mesh.add_face(handles).is_valid())
      return "OpenMesh refuses " + describe_polygon(file, p) +
             ": an edge or a point of it is used up by the polygons before it.";
  }
  return {};
}

// OpenMesh takes two fans at one point as long as one of them is open when the other comes. Then either the
// point has two gaps, or walking around it leaves polygons out.
std::string find_singular_vertex(const MeshFile& file, const Mesh& mesh) {
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
             describe_point(position(mesh, v)) + ".";
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

LibraryFindings count(const Mesh& mesh, const Eigen::Vector3d& centre) {
  LibraryFindings findings;
  findings.polygons = std::int64_t(mesh.n_faces());
  for (const auto e : mesh.edges()) findings.boundary_edges += mesh.is_boundary(e);
  std::int64_t used = 0;
  for (const auto v : mesh.vertices()) used += !mesh.is_isolated(v);
  findings.euler_characteristic = used - std::int64_t(mesh.n_edges()) + findings.polygons;
  findings.components = count_components(mesh);
  for (const auto f : mesh.faces()) {
    auto it = mesh.cfv_ccwbegin(f);
    const Eigen::Vector3d first = position(mesh, *it++) - centre;
    Eigen::Vector3d last = position(mesh, *it++) - centre;
    for (; it.is_valid(); ++it) {
      const Eigen::Vector3d next = position(mesh, *it) - centre;
      findings.area += 0.5 * (last - first).cross(next - first).norm();
      findings.volume += first.dot(last.cross(next)) / 6.0;
      last = next;
    }
  }
  return findings;
}

}  // namespace

LibraryCounts count_with_openmesh(const MeshFile& file, const MeshReport& ours, RunContext& context) {
  // Its complaints about polygons that it refuses go into the report rather than to the terminal.
  omerr().disable();
  Mesh mesh;
  std::string refusal = load(file, mesh, context);
  if (refusal.empty()) refusal = find_singular_vertex(file, mesh);
  if (!refusal.empty()) return library_refused(kName, refusal, file, ours);
  context.check();
  return library_loaded(kName, count(mesh, box_of(file).centre()), file, ours);
}

}  // namespace hermesh::validation
