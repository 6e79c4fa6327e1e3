// The same counts by other people's libraries, which share no code with ours nor with one another.
#pragma once

#include "validation/mesh_report.h"

namespace hermesh::validation {

/// The counts and measures that a library found in a mesh that it could load.
struct LibraryFindings {
  std::int64_t polygons = 0, boundary_edges = 0, components = 0, euler_characteristic = 0;
  double volume = 0.0, area = 0.0;
};

/// Counts by OpenMesh, and below by CGAL, compared with ours. A half-edge structure holds exactly the meshes
/// in which no polygon repeats a corner and which have no non-manifold edge or vertex and no inconsistent
/// edge. Both functions refuse any other mesh with the place where they met the first trouble; `ours` must
/// hold the counts of topology.h and measures.h, and every difference between a library and ours becomes a
/// sentence: in whether the mesh loads, and where it does in boundary edges, components (by shared edges: the
/// same thing in such a mesh), Euler characteristic and number of polygons, exactly, and in volume (about the
/// same centre as ours) and area to 1e-9 of the area, for the volume times the diagonal. Places in sentences
/// are the mesh's coordinates times `unit`.
/// @throws Cancelled.
LibraryCounts count_with_openmesh(const MeshFile& mesh, const MeshReport& ours, RunContext& context,
                                  double unit = 1.0);
/// Counts by CGAL, in all else as count_with_openmesh().
LibraryCounts count_with_cgal(const MeshFile& mesh, const MeshReport& ours, RunContext& context,
                              double unit = 1.0);

/// Compares the findings of a library that loaded the mesh with `ours`; both functions above end with this.
LibraryCounts library_loaded(const std::string& library, const LibraryFindings& theirs, const MeshFile& mesh,
                             const MeshReport& ours);
/// Records that a library refused the mesh, and whether `ours` says that it has to.
LibraryCounts library_refused(const std::string& library, const std::string& refusal, const MeshFile& mesh,
                              const MeshReport& ours);

/// A polygon in words, such as "polygon 12 at (0.5, 0, 1)", by the polygon's centre times `unit`.
std::string describe_polygon(const MeshFile& mesh, std::int64_t polygon, double unit = 1.0);
/// A point in words, such as "(0.5, 0, 1)".
std::string describe_point(const Eigen::Vector3d& point);

/// The corners of a polygon, three or four of them. Polygons are numbered triangles first, then quads.
struct PolygonCorners {
  std::array<std::uint32_t, 4> points;
  int count;
};
PolygonCorners polygon_corners(const MeshFile& mesh, std::int64_t polygon);
inline std::int64_t polygon_count(const MeshFile& mesh) {
  return std::int64_t(mesh.triangles.size() + mesh.quads.size());
}
bool repeats_corner(const PolygonCorners& corners);

}  // namespace hermesh::validation
