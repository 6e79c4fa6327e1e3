#include "algorithms/extraction/manifold_dual_contouring/collapse_embedding.h"

#include <Eigen/Geometry>
#include <algorithm>

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// The new triangles and one another. Seen along their mean normal they cannot meet if all face the viewer and go round
/// the point once.
bool fan_is_embedded(const Collapse& collapse) {
  const Vector3d& x = collapse.x;
  Vector3d mean = Vector3d::Zero();
  for (const Collapse::NewFace& made : collapse.made) mean += made.normal;
  bool facing = collapse.v_moves && mean.norm() > 0;
  for (const Collapse::NewFace& made : collapse.made) facing = facing && made.normal.dot(mean) > 0.05 * made.normal.norm() * mean.norm();
  if (facing) {
    const Vector3d side = mean.unitOrthogonal(), up = mean.cross(side);
    int turns = 0;  // steps of the ring from below to above on the side of `side`
    for (const Collapse::NewFace& made : collapse.made) {
      const Vector3d a = made.at[1] - x, b = made.at[2] - x;
      const double ya = a.dot(up), yb = b.dot(up);
      if (ya < 0 && yb >= 0) ++turns;
    }
    if (turns == 1) return true;
  }
  for (std::size_t i = 0; i < collapse.made.size(); ++i)
    for (std::size_t j = i + 1; j < collapse.made.size(); ++j) {
      const Collapse::NewFace &a = collapse.made[i], &b = collapse.made[j];
      const bool follows = a.others[1] == b.others[0], precedes = a.others[0] == b.others[1];
      if (follows && precedes) return false;
      const Corners at_a = follows ? Corners{x, a.at[2], a.at[1]} : a.at;
      const Corners at_b = precedes ? Corners{x, b.at[2], b.at[1]} : b.at;
      if (!certainly_apart(at_a, at_b, follows || precedes ? 2 : 1)) return false;
    }
  return true;
}

/// The first corner of a new triangle is that of v; if v moved, no other triangle has it.
bool is_apart(const CubeMesh& cube, const Collapse& collapse, const Collapse::NewFace& made,
              const CubeMesh::Face& face) {
  // Shared corners to the front, in the same order in both.
  std::array<std::uint32_t, 3> mine = {collapse.v, made.others[0], made.others[1]}, theirs = face.corners;
  Corners a = made.at, b;
  int shared = 0;
  for (int i = 0; i < 3; ++i)
    for (int j = shared; j < 3; ++j)
      if (mine[i] == theirs[j]) {
        std::swap(theirs[j], theirs[shared]);
        std::swap(mine[i], mine[shared]);
        std::swap(a[i], a[shared]);
        ++shared;
        break;
      }
  for (int j = 0; j < 3; ++j) b[j] = cube.vertices[theirs[j]].point;
  return certainly_apart(a, b, shared);
}

}  // namespace

bool is_embedded(CubeMesh& cube, const Collapse& collapse) {
  if (!fan_is_embedded(collapse)) return false;
  const std::uint32_t question = cube.ask();
  for (const std::uint32_t f : collapse.old) cube.faces[f].seen = question;
  Box3 box;
  for (const Collapse::NewFace& made : collapse.made) {
    box.lower = box.lower.cwiseMin(made.box.lower);
    box.upper = box.upper.cwiseMax(made.box.upper);
  }
  bool apart = true;
  cube.grid->visit(
      box, [&](std::uint32_t f) { return cube.faces[f].gone(); },
      [&](std::uint32_t f) {
        if (!apart || cube.faces[f].seen == question) return;
        cube.faces[f].seen = question;
        if (!box.overlaps(cube.faces[f].box)) return;
        for (const Collapse::NewFace& made : collapse.made)
          if (apart && made.box.overlaps(cube.faces[f].box)) apart = is_apart(cube, collapse, made, cube.faces[f]);
      });
  return apart;
}

}  // namespace hermesh
