#include "reference/agreed_faces.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/connected_components.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/repair_polygon_soup.h>
#include <CGAL/Surface_mesh.h>

#include <Eigen/Geometry>
#include <vector>

namespace hermesh {
namespace {

namespace PMP = CGAL::Polygon_mesh_processing;
using Point = CGAL::Exact_predicates_inexact_constructions_kernel::Point_3;
using SurfaceMesh = CGAL::Surface_mesh<Point>;

double area(const PolygonMesh& mesh, const Triangle& t) {
  const Eigen::Vector3d a = mesh.points[t[0]].cast<double>();
  const Eigen::Vector3d ab = mesh.points[t[1]].cast<double>() - a, ac = mesh.points[t[2]].cast<double>() - a;
  return 0.5 * ab.cross(ac).norm();
}

/// Returns true if two triangles have the same points in the same cyclic order.
bool same_winding(const std::vector<Point>& a_points, const std::vector<std::size_t>& a,
                  const std::vector<Point>& b_points, const std::vector<std::size_t>& b) {
  for (std::size_t shift = 0; shift < 3; ++shift) {
    bool same = true;
    for (std::size_t i = 0; i < 3; ++i) same = same && a_points[a[i]] == b_points[b[(i + shift) % 3]];
    if (same) return true;
  }
  return false;
}

}  // namespace

PolygonMesh with_agreeing_faces(const PolygonMesh& mesh) {
  PolygonMesh result;
  result.origin = mesh.origin;
  result.points = mesh.points;
  result.triangles = triangulated(mesh);
  std::vector<Point> given_points;
  for (const Eigen::Vector3f& p : mesh.points) given_points.emplace_back(p.x(), p.y(), p.z());
  std::vector<std::vector<std::size_t>> given;
  for (const Triangle& t : result.triangles) given.push_back({t[0], t[1], t[2]});
  PMP::merge_duplicate_points_in_polygon_soup(given_points, given);

  // Triangles two of whose corners are one have no side, and CGAL takes none.
  std::vector<std::size_t> kept;
  std::vector<std::vector<std::size_t>> faces;
  for (std::size_t i = 0; i < given.size(); ++i) {
    const auto& f = given[i];
    if (f[0] == f[1] || f[1] == f[2] || f[2] == f[0]) continue;
    kept.push_back(i);
    faces.push_back(f);
  }
  std::vector<Point> points = given_points;
  PMP::orient_polygon_soup(points, faces);
  SurfaceMesh surface;
  PMP::polygon_soup_to_polygon_mesh(points, faces, surface);
  auto patch = surface.add_property_map<SurfaceMesh::Face_index, std::size_t>("f:patch").first;
  std::vector<double> turned_area(PMP::connected_components(surface, patch), 0.0);
  std::vector<char> turned(faces.size());
  for (std::size_t i = 0; i < faces.size(); ++i) {
    turned[i] = !same_winding(points, faces[i], given_points, given[kept[i]]);
    const double of_face = area(mesh, result.triangles[kept[i]]);
    turned_area[patch[SurfaceMesh::Face_index(SurfaceMesh::size_type(i))]] += turned[i] ? of_face : -of_face;
  }
  for (std::size_t i = 0; i < faces.size(); ++i) {
    const bool over = turned_area[patch[SurfaceMesh::Face_index(SurfaceMesh::size_type(i))]] > 0.0;
    Triangle& t = result.triangles[kept[i]];
    if (bool(turned[i]) != over) std::swap(t[1], t[2]);
  }
  return result;
}

}  // namespace hermesh
