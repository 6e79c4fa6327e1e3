#include "algorithms/fracture/joint_decimation.h"

#include "algorithms/extraction/certified_collapse/certified_decimation.h"

namespace hermesh {
namespace {

/// Whether two triangles belong to one patch: the same two pieces on the same sides, the same cutter.
bool same_patch(const EdgeSides& a, const EdgeSides& b) {
  return a.back == b.back && a.front == b.front && a.cutter == b.cutter;
}

/// For each point 1 if triangles of more than one patch meet there, else 0.
std::vector<std::uint8_t> rims(const JointMesh& mesh) {
  std::vector<std::uint8_t> result(mesh.points.size());
  std::vector<std::uint32_t> first(mesh.points.size(), FineMesh::kNone);
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
    for (const std::uint32_t p : mesh.triangles[t]) {
      if (first[p] == FineMesh::kNone) first[p] = t;
      if (!same_patch(mesh.sides[first[p]], mesh.sides[t])) result[p] = 1;
    }
  return result;
}

}  // namespace

void decimate_joint_mesh(JointMesh& mesh, double tolerance, RunContext& context) {
  if (tolerance <= 0 || mesh.triangles.empty()) return;
  // All patches are decimated as one mesh, so the proof that no two triangles meet holds across pieces, too.
  const FilePoints file(mesh.placement);
  const FineMesh fine(mesh.points, mesh.triangles, context);
  // Where more than two triangles share an edge its ends lie on a rim, and rims are pinned: that is what
  // decimate_certified() asks of a complex of patches.
  const std::vector<float> asked(mesh.points.size(), static_cast<float>(tolerance));
  CertifiedMesh coarse = decimate_certified(fine, asked, rims(mesh), file, context);
  std::vector<EdgeSides> sides;
  // A coarse triangle is a fine one whose corners went elsewhere, within its patch: it keeps its sides.
  for (const std::uint32_t t : coarse.fine_triangle) sides.push_back(mesh.sides[t]);
  mesh.points = std::move(coarse.points);
  mesh.triangles = std::move(coarse.triangles);
  mesh.sides = std::move(sides);
}

}  // namespace hermesh
