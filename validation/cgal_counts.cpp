#include <CGAL/Polygon_mesh_processing/connected_components.h>
#include <CGAL/Polygon_mesh_processing/manifoldness.h>
#include <CGAL/Polygon_mesh_processing/measure.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>

#include <boost/container/small_vector.hpp>

#include "validation/geometry/triangle_soup.h"
#include "validation/library_counts.h"

namespace hermesh::validation {
namespace {

namespace PMP = CGAL::Polygon_mesh_processing;

// Plain doubles suffice, because no predicate is evaluated.
using Kernel = CGAL::Simple_cartesian<double>;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;
using Polygon = boost::container::small_vector<std::size_t, 4>;

const char* const kName = "CGAL";

std::vector<Polygon> polygon_soup(const MeshFile& file) {
  std::vector<Polygon> soup;
  soup.reserve(std::size_t(polygon_count(file)));
  for (const Triangle& t : file.triangles) soup.emplace_back(t.begin(), t.end());
  for (const Quad& q : file.quads) soup.emplace_back(q.begin(), q.end());
  return soup;
}

std::vector<Kernel::Point_3> shifted_points(const MeshFile& file, const Eigen::Vector3d& centre) {
  std::vector<Kernel::Point_3> points;
  points.reserve(file.points.size());
  for (const Eigen::Vector3d& p : file.points)
    points.emplace_back(p.x() - centre.x(), p.y() - centre.y(), p.z() - centre.z());
  return points;
}

// Finds the position of a defect by adding polygon after polygon, because CGAL's test of a soup reports none.
std::string refusal_with_place(const MeshFile& file, double unit) {
  Mesh mesh;
  for (std::size_t p = 0; p < file.points.size(); ++p) mesh.add_vertex(Kernel::Point_3(0, 0, 0));
  std::vector<Mesh::Vertex_index> vertices;
  for (std::int64_t p = 0; p < polygon_count(file); ++p) {
    const PolygonCorners corners = polygon_corners(file, p);
    if (repeats_corner(corners))
      return "CGAL does not take the polygons for a surface mesh: " + describe_polygon(file, p, unit) +
             " has one point at two corners.";
    vertices.clear();
    for (int k = 0; k < corners.count; ++k) vertices.emplace_back(corners.points[k]);
    if (mesh.add_face(vertices) == Mesh::null_face())
      return "CGAL does not take the polygons for a surface mesh: an edge or a point of " +
             describe_polygon(file, p, unit) + " is used up by the polygons before it.";
  }
  std::vector<Mesh::Halfedge_index> singular;
  PMP::non_manifold_vertices(mesh, std::back_inserter(singular));
  if (singular.empty()) return "CGAL does not take the polygons for a surface mesh.";
  return "CGAL finds more than one fan of polygons at the point " +
         describe_point(unit * file.points[std::size_t(target(singular.front(), mesh))]) + ".";
}

// Returns a halfedge of a polygon that ends at the apex of the fan that cuts it.
Mesh::Halfedge_index fan_start(const Mesh& mesh, const MeshFile& file, Mesh::Face_index f) {
  const std::size_t polygon = std::size_t(f);
  const auto first = mesh.halfedge(f);
  if (polygon < file.triangles.size()) return first;
  const Quad quad =
      cut_from_first(file.points, file.quads[polygon - file.triangles.size()], QuadRule::as_given);
  for (const auto h : CGAL::halfedges_around_face(first, mesh))
    if (std::size_t(mesh.target(h)) == quad[0]) return h;
  return first;
}

LibraryFindings count(Mesh& mesh, const MeshFile& file) {
  LibraryFindings findings;
  findings.polygons = std::int64_t(mesh.number_of_faces());
  for (const auto e : mesh.edges()) findings.boundary_edges += mesh.is_border(e);
  std::int64_t used = 0;
  for (const auto v : mesh.vertices()) used += !mesh.is_isolated(v);
  findings.euler_characteristic = used - std::int64_t(mesh.number_of_edges()) + findings.polygons;
  const auto component = mesh.add_property_map<Mesh::Face_index, std::size_t>("f:component").first;
  findings.components = std::int64_t(PMP::connected_components(mesh, component));
  const Kernel::Point_3 centre(0, 0, 0);
  for (const auto f : mesh.faces()) {
    const auto first = fan_start(mesh, file, f);
    const Kernel::Point_3& a = mesh.point(mesh.target(first));
    for (auto h = mesh.next(first); mesh.next(h) != first; h = mesh.next(h)) {
      const Kernel::Point_3 &b = mesh.point(mesh.target(h)), &c = mesh.point(mesh.target(mesh.next(h)));
      findings.area += CGAL::sqrt(CGAL::squared_area(a, b, c));
      findings.volume += CGAL::volume(centre, a, b, c);
    }
  }
  return findings;
}

}  // namespace

LibraryCounts count_with_cgal(const MeshFile& file, const MeshReport& ours, RunContext& context,
                              double unit) {
  const std::vector<Polygon> soup = polygon_soup(file);
  if (!PMP::is_polygon_soup_a_polygon_mesh(soup)) {
    context.check();
    return library_refused(kName, refusal_with_place(file, unit), file, ours);
  }
  context.check();
  Mesh mesh;
  PMP::polygon_soup_to_polygon_mesh(shifted_points(file, box_of(file).centre()), soup, mesh);
  context.check();
  return library_loaded(kName, count(mesh, file), file, ours);
}

}  // namespace hermesh::validation
