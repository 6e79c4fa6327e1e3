#include "algorithms/extraction/certified_collapse/cube_collapse.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// What shape() of a triangle a collapse may make at least, unless there was a worse one in its place.
constexpr double kPoorShape = 0.05;
/// A triangle may not turn by more than some 84 degrees in one collapse.
constexpr double kLeastCosineToOld = 0.1;
/// How far a triangle of a bold collapse, where nobody looks at what is below, may face away from the fine
/// triangle that it began as: some 72 degrees. A triangle that faced the wrong way before need not do so for
/// ever then.
constexpr double kLeastCosineToFine = 0.3;

/// Shape of a triangle, 1 for equilateral and 0 for degenerate: its area over the sum of its squared sides,
/// scaled.
double shape(const Corners& t) {
  const double twice_area = (t[1] - t[0]).cross(t[2] - t[0]).norm();
  const double squares =
      (t[1] - t[0]).squaredNorm() + (t[2] - t[1]).squaredNorm() + (t[0] - t[2]).squaredNorm();
  return squares > 0 ? 2.0 * std::sqrt(3.0) * twice_area / squares : 0.0;
}

}  // namespace

CubeCollapse::CubeCollapse(DecimatedMesh& mesh, Collapses kind, const FilePoints& file,
                           const DecimationCube& cube, std::span<const std::uint32_t> triangles,
                           CubeNumbers& numbers)
    : mesh_(mesh),
      kind_(kind),
      file_(file),
      cube_(cube),
      local_(mesh, cube, triangles, numbers),
      distance_(mesh, local_, collapse_) {
  // What the cube's border forbids now may be done in the next round, whose borders lie elsewhere.
  for (std::uint32_t v = 0; v < local_.vertices.size(); ++v)
    if (local_.vertices[v].here && !local_.vertices[v].free) mark_dirty(v);
}

WideQuadric CubeCollapse::quadric_about(std::uint32_t u, std::uint32_t v, const Vector3d& anchor) const {
  WideQuadric sum;
  for (const std::uint32_t w : {u, v})
    sum.add(mesh_.quadrics[local_.vertices[w].global], local_.vertices[w].point - anchor);
  return sum;
}

WideQuadric CubeCollapse::quadric_of_faces(std::uint32_t u, std::uint32_t v, const Vector3d& anchor) const {
  WideQuadric sum;
  const auto add = [&](std::uint32_t f) {
    const auto& c = local_.faces[f].corners;
    const Vector3d corner = local_.vertices[c[0]].point - anchor;
    const Vector3d normal = (local_.vertices[c[1]].point - local_.vertices[c[0]].point)
                                .cross(local_.vertices[c[2]].point - local_.vertices[c[0]].point);
    const double size = normal.norm();
    if (size > 0) sum.add_plane(normal / size, -normal.dot(corner) / size, 0.5 * size);
  };
  local_.for_each_face(u, [&](std::uint32_t f, int) { add(f); });
  // The two faces beside the edge are around both ends.
  local_.for_each_face(v, [&](std::uint32_t f, int) {
    const auto& c = local_.faces[f].corners;
    if (c[0] != u && c[1] != u && c[2] != u) add(f);
  });
  return sum;
}

bool CubeCollapse::gather(std::uint32_t going, std::uint32_t v, const Vector3d& x) {
  // Points stay in the cube, or triangles that belong to it could reach into another one.
  if (!cube_.holds(x)) {
    mark_dirty(v);
    return false;
  }
  collapse_.v = v;
  collapse_.going = going;
  collapse_.x = x;
  collapse_.v_moves = local_.vertices[v].point != x;
  collapse_.made.clear();
  collapse_.old.clear();
  collapse_.attached.clear();
  // The faces beside the edge are found from both ends, and counted as old from the one that goes.
  return make_faces(going) && (!collapse_.v_moves || make_faces(v));
}

/// Makes the faces around one end of the edge as they will be, but for the two beside the edge, which go. If
/// the other end moves, the same is done for it.
bool CubeCollapse::make_faces(std::uint32_t moved) {
  const std::uint32_t other = moved == collapse_.v ? collapse_.going : collapse_.v;
  bool good = true;
  local_.for_each_face(moved, [&](std::uint32_t f, int i) {
    if (!good) return;
    const auto& corners = local_.faces[f].corners;
    const std::uint32_t a = corners[(i + 1) % 3], b = corners[(i + 2) % 3];
    if (a == other || b == other) {
      if (moved != collapse_.v) collapse_.old.push_back(f);
      return;
    }
    collapse_.old.push_back(f);
    const Corners at = {collapse_.x, local_.vertices[a].point, local_.vertices[b].point};
    const Collapse::NewFace made{f, i, at, {a, b}, (at[1] - at[0]).cross(at[2] - at[0])};
    good = is_short(at, moved) && is_well_shaped(made, {local_.vertices[moved].point, at[1], at[2]});
    collapse_.made.push_back(made);
  });
  return good;
}

/// Whether the new edges of a face are no longer than a cube of this round may make; where they are, the next
/// round may.
bool CubeCollapse::is_short(const Corners& at, std::uint32_t moved) {
  const double limit = cube_.longest_edge * cube_.longest_edge;
  const bool is = (at[1] - at[0]).squaredNorm() <= limit && (at[2] - at[0]).squaredNorm() <= limit;
  if (!is) mark_dirty(moved);
  return is;
}

/// Whether a face keeps some area, does not turn over and is no sliver.
bool CubeCollapse::is_well_shaped(const Collapse::NewFace& made, const Corners& before) const {
  const Vector3d normal_before =
      kind_ == Collapses::bold
          ? mesh_.fine->normal(mesh_.fine_triangle[local_.faces[made.face].global]).cast<double>()
          : (before[1] - before[0]).cross(before[2] - before[0]);
  const double size = made.normal.norm(),
               least = kind_ == Collapses::bold ? kLeastCosineToFine : kLeastCosineToOld;
  constexpr double kDegenerate = 1e-9;  // of its sides squared
  if (size <=
      kDegenerate * ((made.at[1] - made.at[0]).squaredNorm() + (made.at[2] - made.at[0]).squaredNorm()))
    return false;
  if (made.normal.dot(normal_before) < least * size * normal_before.norm()) return false;
  const double now = shape(made.at);
  return now >= kPoorShape || now >= shape(before);
}

bool CubeCollapse::passes() { return kind_ == Collapses::bold || distance_.passes(); }

void CubeCollapse::apply() {
  // All old faces are gone first, and those that are only changed come back: what is gone then are the two
  // beside the edge. Samples are in the lists of the new faces alone.
  for (const std::uint32_t f : collapse_.old) mesh_.first_sample[local_.faces[f].global] = kNoSample;
  for (const std::uint32_t f : collapse_.old) local_.faces[f].gone = true;
  for (const Collapse::NewFace& made : collapse_.made) {
    CubeMesh::Face& face = local_.faces[made.face];
    face.corners[made.corner] = collapse_.v;
    face.gone = false;
    mesh_.triangles[face.global][made.corner] = local_.vertices[collapse_.v].global;
  }
  for (const std::uint32_t f : collapse_.old)
    if (local_.faces[f].gone)
      mesh_.triangles[local_.faces[f].global] = {kNoTriangle, kNoTriangle, kNoTriangle};
  for (const Collapse::Attached& entry : collapse_.attached) {
    const std::uint32_t triangle = local_.faces[collapse_.made[entry.triangle].face].global;
    mesh_.next_sample[entry.sample] = mesh_.first_sample[triangle];
    mesh_.first_sample[triangle] = entry.sample;
  }
  // What has changed is worth another look in the next round; points of other cubes are not ours to write.
  merge_vertices();
  mark_dirty(collapse_.v);
  for (const Collapse::NewFace& made : collapse_.made)
    if (local_.vertices[made.others[0]].here) mark_dirty(made.others[0]);
}

void CubeCollapse::merge_vertices() {
  CubeMesh::Vertex &staying = local_.vertices[collapse_.v], &going = local_.vertices[collapse_.going];
  // The point stands for the planes of both ends, whatever they stood for themselves.
  const WideQuadric q = quadric_about(collapse_.going, collapse_.v, collapse_.x);
  float& tolerance = mesh_.least_tolerance[staying.global];
  tolerance = std::min(tolerance, mesh_.least_tolerance[going.global]);
  mesh_.unmoved[going.global] = 0;
  if (collapse_.v_moves) {  // else it may be a corner of another cube's triangles, read at the same time
    mesh_.unmoved[staying.global] = 0;
    staying.point = mesh_.points[staying.global] = collapse_.x;
  }
  mesh_.quadrics[staying.global] = q.about(Vector3d::Zero());
  ++staying.version;
  going.gone = true;
  local_.merge_corners(collapse_.going, collapse_.v);

  joins_.push_back({.going = going.global,
                    .node = {.first = staying.global,
                             .merges = true,
                             .place = collapse_.x,
                             .quadric = mesh_.quadrics[staying.global]}});
}

}  // namespace hermesh
