#include "validation/library_counts.h"

#include <cmath>
#include <sstream>

#include "validation/geometry/triangle_soup.h"
#include "validation/topology.h"

namespace hermesh::validation {
namespace {

bool fits_half_edges(const MeshFile& mesh, const MeshReport& ours) {
  if (!ours.manifold() || !ours.oriented()) return false;
  for (std::int64_t p = 0; p < polygon_count(mesh); ++p)
    if (repeats_corner(polygon_corners(mesh, p))) return false;
  return true;
}

template <class Number>
void expect_equal(const std::string& what, Number theirs, Number ours, double tolerance,
                  LibraryCounts& counts) {
  // NaN is never equal.
  if (std::abs(double(theirs) - double(ours)) <= tolerance) return;
  std::ostringstream sentence;
  sentence.precision(12);
  sentence << counts.library << " finds " << what << " " << theirs << " where our count is " << ours << ".";
  counts.disagreements.push_back(sentence.str());
}

}  // namespace

LibraryCounts library_loaded(const std::string& library, const LibraryFindings& theirs, const MeshFile& mesh,
                             const MeshReport& ours) {
  LibraryCounts counts;
  counts.library = library;
  counts.loaded = true;
  counts.boundary_edges = theirs.boundary_edges;
  counts.components = theirs.components;
  counts.euler_characteristic = theirs.euler_characteristic;
  counts.volume = theirs.volume;
  counts.area = theirs.area;
  if (!fits_half_edges(mesh, ours))
    counts.disagreements.push_back(
        library +
        " loads the mesh although our counts say that a half-edge structure cannot "
        "hold it.");
  expect_equal("a number of polygons of", theirs.polygons, polygon_count(mesh), 0.0, counts);
  expect_equal("a number of boundary edges of", theirs.boundary_edges, ours.boundary_edges, 0.0, counts);
  expect_equal("a number of components of", theirs.components, ours.components, 0.0, counts);
  expect_equal("an Euler characteristic of", theirs.euler_characteristic, ours.euler_characteristic, 0.0,
               counts);
  const double tolerance = 1e-9 * ours.area;
  expect_equal("an area of", theirs.area, ours.area, tolerance, counts);
  expect_equal("a volume of", theirs.volume, ours.volume, tolerance * box_of(mesh).diagonal(), counts);
  return counts;
}

LibraryCounts library_refused(const std::string& library, const std::string& refusal, const MeshFile& mesh,
                              const MeshReport& ours) {
  LibraryCounts counts;
  counts.library = library;
  counts.refusal = refusal;
  if (fits_half_edges(mesh, ours))
    counts.disagreements.push_back("By our counts a half-edge structure can hold the mesh, but: " + refusal);
  return counts;
}

std::string describe_point(const Eigen::Vector3d& point) {
  std::ostringstream text;
  text.precision(7);
  text << "(" << point.x() << ", " << point.y() << ", " << point.z() << ")";
  return text.str();
}

std::string describe_polygon(const MeshFile& mesh, std::int64_t polygon, double unit) {
  const PolygonCorners corners = polygon_corners(mesh, polygon);
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (int k = 0; k < corners.count; ++k) centre += mesh.points[corners.points[k]] / corners.count;
  return "polygon " + std::to_string(polygon) + " at " + describe_point(unit * centre);
}

PolygonCorners polygon_corners(const MeshFile& mesh, std::int64_t polygon) {
  const std::size_t p = std::size_t(polygon);
  if (p >= mesh.triangles.size()) return {mesh.quads[p - mesh.triangles.size()], 4};
  const Triangle& t = mesh.triangles[p];
  return {{t[0], t[1], t[2], t[2]}, 3};
}

bool repeats_corner(const PolygonCorners& corners) {
  const auto& p = corners.points;
  return corners.count == 3 ? repeats_corner(Triangle{p[0], p[1], p[2]}) : repeats_corner(Quad(p));
}

}  // namespace hermesh::validation
