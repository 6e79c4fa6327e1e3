#include "algorithms/extraction/manifold_dual_contouring/cube_collapse.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <cmath>

#include "algorithms/extraction/manifold_dual_contouring/collapse_embedding.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// Shape of a triangle, 1 for equilateral and 0 for degenerate: a collapse makes none below this unless there was a worse
/// one in its place.
constexpr double kPoorShape = 0.05;
/// A triangle may not turn by more than some 84 degrees in one collapse.
constexpr double kLeastCosine = 0.1;

double shape(const Corners& t) {
  const double twice_area = (t[1] - t[0]).cross(t[2] - t[0]).norm();
  const double squares = (t[1] - t[0]).squaredNorm() + (t[2] - t[1]).squaredNorm() + (t[0] - t[2]).squaredNorm();
  return squares > 0 ? 2.0 * std::sqrt(3.0) * twice_area / squares : 0.0;
}

bool is_well_shaped(const Collapse::NewFace& made, const Corners& before) {
  const Vector3d normal_before = (before[1] - before[0]).cross(before[2] - before[0]);
  const double size = made.normal.norm();
  constexpr double kDegenerate = 1e-9;  // of its sides squared
  if (size <= kDegenerate * ((made.at[1] - made.at[0]).squaredNorm() + (made.at[2] - made.at[0]).squaredNorm()))
    return false;
  if (made.normal.dot(normal_before) < kLeastCosine * size * normal_before.norm()) return false;
  const double now = shape(made.at);
  return now >= kPoorShape || now >= shape(before);
}

}  // namespace

CubeCollapse::CubeCollapse(DecimatedMesh& mesh, const FilePoints& file, const DecimationCube& cube,
                           std::span<const std::uint32_t> triangles, CubeNumbers& numbers)
    : mesh_(mesh),
      file_(file),
      cube_(cube),
      local_(mesh, cube, triangles, numbers),
      distance_(mesh, local_, collapse_) {
  for (std::uint32_t v = 0; v < local_.vertices.size(); ++v)
    if (local_.vertices[v].here && !local_.vertices[v].free) stir(v);
}

WideQuadric CubeCollapse::quadric_about(std::span<const std::uint32_t> vertices, const Vector3d& anchor) const {
  WideQuadric sum;
  for (const std::uint32_t w : vertices)
    sum.add(mesh_.quadrics[local_.vertices[w].global], local_.vertices[w].point - anchor);
  return sum;
}

bool CubeCollapse::gather(std::uint32_t v, std::span<const std::uint32_t> going, const Vector3d& x) {
  if (!cube_.holds(x)) {
    stir(v);
    return false;
  }
  collapse_.v = v;
  collapse_.going.assign(going.begin(), going.end());
  collapse_.x = x;
  collapse_.v_moves = local_.vertices[v].point != x;
  collapse_.made.clear();
  collapse_.old.clear();
  const std::uint32_t question = local_.ask();
  local_.vertices[v].seen = question;
  for (const std::uint32_t w : going) local_.vertices[w].seen = question;
  for (const std::uint32_t w : going)
    if (!make_faces(w, question)) return false;
  if (collapse_.v_moves && !make_faces(v, question)) return false;
  std::sort(collapse_.old.begin(), collapse_.old.end());
  collapse_.old.erase(std::unique(collapse_.old.begin(), collapse_.old.end()), collapse_.old.end());
  return true;
}

/// The faces of `moved` that have no other corner that the point stands for.
bool CubeCollapse::make_faces(std::uint32_t moved, std::uint32_t question) {
  bool good = true;
  local_.for_each_face(moved, [&](std::uint32_t f, int i) {
    if (!good) return;
    const auto& corners = local_.faces[f].corners;
    const std::uint32_t a = corners[(i + 1) % 3], b = corners[(i + 2) % 3];
    collapse_.old.push_back(f);
    if (local_.vertices[a].seen == question || local_.vertices[b].seen == question) return;
    const Corners at = {collapse_.x, local_.vertices[a].point, local_.vertices[b].point};
    Collapse::NewFace made{f, i, at, {a, b}, {}, (at[1] - at[0]).cross(at[2] - at[0]), {}};
    for (const Vector3d& p : at) made.box.add(p);
    good = is_short(at, moved) && is_well_shaped(made, {local_.vertices[moved].point, at[1], at[2]});
    collapse_.made.push_back(made);
  });
  return good;
}

bool CubeCollapse::is_short(const Corners& at, std::uint32_t moved) {
  const double limit = cube_.longest_edge * cube_.longest_edge;
  const bool is = (at[1] - at[0]).squaredNorm() <= limit && (at[2] - at[0]).squaredNorm() <= limit;
  if (!is) stir(moved);
  return is;
}

bool CubeCollapse::passes() {
  return distance_.attach_samples() && distance_.point_is_near() && is_embedded(local_, collapse_) &&
         distance_.edges_are_near();
}

void CubeCollapse::apply() {
  for (const std::uint32_t f : collapse_.old) {
    mesh_.first_sample[local_.faces[f].global] = kNoSample;
    local_.faces[f].box = Box3();
  }
  for (const Collapse::NewFace& made : collapse_.made) {
    CubeMesh::Face& face = local_.faces[made.face];
    face.corners[made.corner] = collapse_.v;
    face.box = made.box;
    mesh_.triangles[face.global][made.corner] = local_.vertices[collapse_.v].global;
  }
  for (const std::uint32_t f : collapse_.old)
    if (local_.faces[f].gone()) mesh_.triangles[local_.faces[f].global] = {kNoTriangle, kNoTriangle, kNoTriangle};
  for (const Collapse::Attached& entry : collapse_.attached) {
    const std::uint32_t triangle = local_.faces[collapse_.made[entry.triangle].face].global;
    mesh_.next_sample[entry.sample] = mesh_.first_sample[triangle];
    mesh_.first_sample[triangle] = entry.sample;
    std::atomic_ref(mesh_.attached_to[entry.sample]).store(triangle, std::memory_order_relaxed);
  }
  merge_vertices();
  for (const Collapse::NewFace& made : collapse_.made) local_.grid->add(made.face, made.box);
  for (const std::uint32_t f : collapse_.old)
    if (local_.faces[f].gone()) local_.count_out();
  stir(collapse_.v);
  for (const Collapse::NewFace& made : collapse_.made)
    if (local_.vertices[made.others[0]].here) stir(made.others[0]);
}

void CubeCollapse::merge_vertices() {
  CubeMesh::Vertex& staying = local_.vertices[collapse_.v];
  WideQuadric q = quadric_about(collapse_.going, collapse_.x);
  q.add(mesh_.quadrics[staying.global], staying.point - collapse_.x);
  if (collapse_.v_moves) mesh_.unmoved[staying.global] = 0;
  staying.point = mesh_.points[staying.global] = collapse_.x;
  mesh_.below[staying.global] = distance_.below();
  mesh_.quadrics[staying.global] = q.about(Vector3d::Zero());
  ++staying.version;
  for (const std::uint32_t w : collapse_.going) {
    mesh_.unmoved[local_.vertices[w].global] = 0;
    local_.vertices[w].gone = true;
    local_.merge_corners(w, collapse_.v);
  }
}

}  // namespace hermesh
