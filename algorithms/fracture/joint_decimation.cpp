#include "algorithms/fracture/joint_decimation.h"

#include <algorithm>

#include "algorithms/extraction/certified_collapse/certified_decimation.h"

namespace hermesh {
namespace {

/// Share of a shell's volume that decimation may change.
constexpr double kMostChange = 0.01;
/// The share of a tolerance that is tried next, and the least one in voxels, below which it is 0.
constexpr float kLower = 0.25f, kLeastTolerance = 1.0f / 64;

/// Returns true if two triangles belong to one patch: the same two pieces on the same sides, and the same
/// cutter.
bool same_patch(const EdgeSides& a, const EdgeSides& b) {
  return a.back == b.back && a.front == b.front && a.cutter == b.cutter;
}

/// Returns 1 for each vertex at which triangles of more than one patch meet, else 0.
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
  // All patches are decimated as one mesh, so the proof that no two triangles intersect also holds across
  // pieces.
  const FilePoints file(mesh.placement);
  const FineMesh fine(mesh.points, mesh.triangles, context);
  // Edges shared by more than two triangles have their ends on a patch boundary, and patch boundaries are
  // pinned, as decimate_certified() requires of a complex of patches.
  std::vector<TrianglePieces> pieces;
  for (const EdgeSides& side : mesh.sides) pieces.push_back({side.back, side.front});
  const ShellVolumes shells(fine, pieces);
  const std::vector<std::uint8_t> pinned = rims(mesh);
  std::vector<float> asked(mesh.points.size(), static_cast<float>(tolerance));
  CertifiedMesh coarse;
  // A part that is not much thicker than the tolerance could lose most of its volume within it. This ends,
  // for a part whose tolerance is 0 does not change.
  for (;;) {
    coarse = decimate_certified(fine, asked, pinned, file, context, {}, pieces);
    const std::vector<std::uint8_t> changed =
        shells.changed(coarse.points, coarse.triangles, coarse.fine_triangle, kMostChange);
    if (std::ranges::find(changed, 1) == changed.end()) break;
    std::vector<std::uint8_t> lowers(asked.size());
    for (std::uint32_t t = 0; t < pieces.size(); ++t)
      if (shells.is_in(changed, t))
        for (const std::uint32_t p : fine.triangles()[t]) lowers[p] = 1;
    for (std::size_t p = 0; p < asked.size(); ++p)
      if (lowers[p]) asked[p] = kLower * asked[p] < kLeastTolerance ? 0.0f : kLower * asked[p];
  }
  std::vector<EdgeSides> sides;
  // A coarse triangle is a fine one whose corners went elsewhere, within its patch: it keeps its sides.
  for (const std::uint32_t t : coarse.fine_triangle) sides.push_back(mesh.sides[t]);
  mesh.points = std::move(coarse.points);
  mesh.triangles = std::move(coarse.triangles);
  mesh.sides = std::move(sides);
}

}  // namespace hermesh
