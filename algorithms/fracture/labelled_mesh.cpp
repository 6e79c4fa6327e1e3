#include "algorithms/fracture/labelled_mesh.h"

#include <algorithm>

#include "algorithms/core/parallel.h"
#include "algorithms/extraction/embedded_mesh/near_voxels.h"

namespace hermesh {

JointMesh joint_mesh(const LabelledGrid& grid, const DualContouringOptions& options, RunContext& context,
                     std::optional<double> from_voxels) {
  const FilePoints file(grid.placement());
  PolygonEdges edges;
  // uniform_mesh() does not depend on the pieces on the two sides of an edge, so one call makes the polygons
  // of all pieces, each seam once; `edges` maps each polygon to its edge, which stores its sides.
  UniformMesh uniform = from_voxels
                            ? uniform_mesh_near_voxels(grid, options, {*from_voxels, &grid.made_up_edges()},
                                                       file, context, &edges)
                            : uniform_mesh(grid, options, file, context, &edges);
  const Stage stage(context, "sides of the triangles");
  JointMesh mesh;
  mesh.placement = grid.placement();
  mesh.points = std::move(uniform.points);
  mesh.joints = uniform.counts.joints;
  mesh.several_sheets = uniform.counts.several_sheets;
  mesh.fanned_edges = uniform.counts.fanned_edges;
  mesh.escaped = uniform.counts.escaped;
  for (const auto& [block, cell] : uniform.counts.meeting_joints)
    mesh.meeting_joints.push_back({block, cell});
  // Triangles of fanned edges are first, followed by each quad as two triangles, abc and acd, i.e. with the
  // split chosen for it.
  const std::size_t fanned = uniform.triangles.size(), quads = uniform.quads.size();
  mesh.triangles = std::move(uniform.triangles);
  mesh.triangles.resize(fanned + 2 * quads);
  mesh.sides.resize(mesh.triangles.size());
  constexpr std::size_t kChunk = 4096;
  const auto in_chunks = [&](std::size_t n, auto&& f) {
    parallel_blocks((n + kChunk - 1) / kChunk, context, [&](std::size_t chunk) {
      for (std::size_t i = chunk * kChunk; i < std::min(n, (chunk + 1) * kChunk); ++i) f(i);
    });
  };
  // Each polygon writes only its own elements, so threads do not conflict.
  in_chunks(fanned, [&](std::size_t i) { mesh.sides[i] = grid.sides(edges.triangles[i]); });
  in_chunks(quads, [&](std::size_t i) {
    const Quad& q = uniform.quads[i];
    mesh.triangles[fanned + 2 * i] = {q[0], q[1], q[2]};
    mesh.triangles[fanned + 2 * i + 1] = {q[0], q[2], q[3]};
    mesh.sides[fanned + 2 * i] = mesh.sides[fanned + 2 * i + 1] = grid.sides(edges.quads[i]);
  });
  return mesh;
}

PieceTriangles::PieceTriangles(const JointMesh& mesh, std::uint32_t pieces) : first_(pieces + 2) {
  // A triangle of a seam counts for both of its pieces, one of the original surface for the piece behind it.
  for (const EdgeSides& sides : mesh.sides) {
    ++first_[sides.back];
    if (sides.front > 0) ++first_[sides.front];
  }
  // Convert counts to first indices; the entry after the last piece ends it, and that of piece 0 is empty.
  std::size_t sum = 0;
  for (std::size_t& first : first_) {
    const std::size_t here = first;
    first = sum;
    sum += here;
  }
  sides_.resize(sum);
  std::vector<std::size_t> next = first_;
  // Triangles ascend, so each piece has them in the order of the joint mesh.
  for (std::uint32_t t = 0; t < mesh.sides.size(); ++t) {
    sides_[next[mesh.sides[t].back]++] = {t, false};
    if (mesh.sides[t].front > 0) sides_[next[mesh.sides[t].front]++] = {t, true};
  }
}

PolygonMesh piece_mesh(const JointMesh& mesh, std::span<const PieceTriangles::Side> triangles) {
  // A piece's vertices have the same order as in the joint mesh, so both pieces of a seam number its vertices
  // in the same order. The coordinates have the same bits in both, because rounding to single precision does
  // not depend on the piece.
  std::vector<std::uint32_t> used;
  used.reserve(3 * triangles.size());
  for (const PieceTriangles::Side& side : triangles)
    used.insert(used.end(), mesh.triangles[side.triangle].begin(), mesh.triangles[side.triangle].end());
  std::sort(used.begin(), used.end());
  used.erase(std::unique(used.begin(), used.end()), used.end());

  PolygonMesh result;
  result.origin = mesh.placement.origin;
  const FilePoints file(mesh.placement);
  result.points.reserve(used.size());
  for (const std::uint32_t p : used) result.points.push_back(file.in_file(mesh.points[p]));
  std::vector<std::int32_t> surface, cutter, neighbour;
  result.triangles.reserve(triangles.size());
  const bool mirrors = mesh.placement.mirrors();
  // `neighbour` is the piece on the other side, so the two copies of a seam's triangle name each other's
  // piece.
  for (const auto& [number, reversed] : triangles) {
    Triangle t = mesh.triangles[number];
    for (std::uint32_t& p : t)
      p = static_cast<std::uint32_t>(std::lower_bound(used.begin(), used.end(), p) - used.begin());
    // Two reasons to turn a triangle, which cancel: the piece lies in front of it, or the lattice is
    // mirrored.
    if (reversed != mirrors) std::swap(t[1], t[2]);
    result.triangles.push_back(t);
    const EdgeSides& sides = mesh.sides[number];
    surface.push_back(sides.front > 0);
    cutter.push_back(sides.cutter);
    const std::uint32_t other = reversed ? sides.back : sides.front;
    neighbour.push_back(other > 0 ? static_cast<std::int32_t>(other) : -1);
  }
  const auto add = [&](const char* name, std::vector<std::int32_t>& values) {
    result.attributes.push_back({name, AttributeDomain::polygon, 1, std::move(values), {}});
  };
  add("surface", surface);
  add("cutter", cutter);
  add("neighbour", neighbour);
  return result;
}

}  // namespace hermesh
