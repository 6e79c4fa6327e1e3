#include "algorithms/fracture/joint_decimation.h"

#include "algorithms/extraction/certified_collapse/certified_decimation.h"

namespace hermesh {
namespace {

bool same_patch(const EdgeSides& a, const EdgeSides& b) {
  return a.back == b.back && a.front == b.front && a.cutter == b.cutter;
}

/// By point: whether triangles of more than one patch meet there.
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
  const FilePoints file(mesh.placement);
  const FineMesh fine(mesh.points, mesh.triangles);
  const std::vector<float> asked(mesh.points.size(), static_cast<float>(tolerance));
  CertifiedMesh coarse = decimate_certified(fine, asked, rims(mesh), file, context);
  std::vector<EdgeSides> sides;
  for (const std::uint32_t t : coarse.fine_triangle) sides.push_back(mesh.sides[t]);
  mesh.points = std::move(coarse.points);
  mesh.triangles = std::move(coarse.triangles);
  mesh.sides = std::move(sides);
}

}  // namespace hermesh
