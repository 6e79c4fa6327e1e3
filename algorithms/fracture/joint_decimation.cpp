#include "algorithms/fracture/joint_decimation.h"

#include <optional>

#include "algorithms/extraction/manifold_dual_contouring/certified_decimation.h"

namespace hermesh {
namespace {

bool same_patch(const EdgeSides& a, const EdgeSides& b) {
  return a.back == b.back && a.front == b.front && a.cutter == b.cutter;
}

/// By point: whether triangles of more than one patch meet there.
std::vector<std::uint8_t> rims(const JointMesh& mesh) {
  std::vector<std::uint8_t> result(mesh.points.size());
  std::vector<std::uint32_t> first(mesh.points.size(), kNoTriangle);
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
    for (const std::uint32_t p : mesh.triangles[t]) {
      if (first[p] == kNoTriangle) first[p] = t;
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
  const std::optional<DecimatedMesh> coarse = decimate_certified(fine, asked, rims(mesh), file, context);
  if (!coarse) return;
  std::vector<std::uint32_t> number(coarse->points.size(), kNoSample);
  std::vector<EdgeSides> sides;
  mesh.points.clear();
  mesh.triangles.clear();
  for (std::size_t t = 0; t < coarse->triangles.size(); ++t) {
    Triangle corners = coarse->triangles[t];
    for (std::uint32_t& p : corners) {
      if (number[p] == kNoSample) {
        number[p] = static_cast<std::uint32_t>(mesh.points.size());
        mesh.points.push_back(coarse->points[p]);
      }
      p = number[p];
    }
    mesh.triangles.push_back(corners);
    sides.push_back(mesh.sides[coarse->fine_triangle[t]]);
  }
  mesh.sides = std::move(sides);
}

}  // namespace hermesh
