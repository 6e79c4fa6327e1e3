// The same counts by OpenMesh and CGAL, which share no code with ours nor with one another.
#pragma once

#include "validation/mesh_report.h"

namespace hermesh::validation {

/// The counts and measures that a library found in a mesh that it could load.
struct LibraryFindings {
  std::int64_t polygons = 0, boundary_edges = 0, components = 0, euler_characteristic = 0;
  double volume = 0.0, area = 0.0;
};

/// Counts by OpenMesh or CGAL and compares with ours. A half-edge structure holds exactly the meshes in which
/// no polygon repeats a corner and which have no non-manifold edge or vertex and no inconsistent edge. Both
/// functions refuse any other mesh, with the position of the first defect; `ours` must hold the counts of
/// topology.h. Every difference between a library and ours becomes a message: if the mesh loads, and if it
/// does boundary edges, components (by shared edges, which is equivalent in such a mesh), Euler
/// characteristic and number of polygons, exactly, and volume (about the same centre as ours) and area to
/// 1e-9 of the area, for the volume times the diagonal. Positions in messages are the mesh's coordinates
/// times `unit`. @throws Cancelled.
LibraryCounts count_with_openmesh(const MeshFile& mesh, const MeshReport& ours, RunContext& context,
                                  double unit = 1.0);
LibraryCounts count_with_cgal(const MeshFile& mesh, const MeshReport& ours, RunContext& context,
                              double unit = 1.0);

/// Compares the findings of a library that loaded the mesh with `ours`.
LibraryCounts library_loaded(const std::string& library, const LibraryFindings& theirs, const MeshFile& mesh,
                             const MeshReport& ours);
/// Records that a library refused the mesh; a disagreement if the mesh is loadable according to `ours`.
LibraryCounts library_refused(const std::string& library, const std::string& refusal, const MeshFile& mesh,
                              const MeshReport& ours);

/// Returns a text such as "polygon 12 at (0.5, 0, 1)", with the polygon's centre times `unit`.
std::string describe_polygon(const MeshFile& mesh, std::int64_t polygon, double unit = 1.0);
/// Returns a text such as "(0.5, 0, 1)".
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
