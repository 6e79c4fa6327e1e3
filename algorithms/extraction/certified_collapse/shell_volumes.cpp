#include "algorithms/extraction/certified_collapse/shell_volumes.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <tuple>

#include "algorithms/core/disjoint_sets.h"

namespace hermesh {
namespace {

/// Returns the sets' numbers from 0 on, in the order of their lowest members, for all members that are used.
template <class IsUsed>
std::vector<std::uint32_t> numbered(DisjointSets& sets, IsUsed&& is_used) {
  std::vector<std::uint32_t> number(sets.size(), FineMesh::kNone);
  std::uint32_t count = 0;
  for (std::uint32_t i = 0; i < number.size(); ++i) {
    if (!is_used(i)) continue;
    const std::uint32_t root = sets.find(i);
    if (number[root] == FineMesh::kNone) number[root] = count++;
    number[i] = number[root];
  }
  return number;
}

/// Returns the shells of each triangle of a complex. Two sides of triangles belong to one shell if they bound
/// the same piece and share a point, for the boundary of a piece is a manifold.
std::vector<std::array<std::uint32_t, 2>> shells_of_pieces(const FineMesh& fine,
                                                           std::span<const TrianglePieces> pieces) {
  struct Corner {
    std::uint32_t piece, point, side;
  };
  std::vector<Corner> corners;
  for (std::uint32_t t = 0; t < pieces.size(); ++t)
    for (std::uint32_t s = 0; s < 2; ++s)
      if (pieces[t][s] > 0)
        for (const std::uint32_t p : fine.triangles()[t]) corners.push_back({pieces[t][s], p, 2 * t + s});
  std::ranges::sort(corners, {}, [](const Corner& c) { return std::tuple(c.piece, c.point, c.side); });
  DisjointSets sets(2 * pieces.size());
  for (std::size_t i = 1; i < corners.size(); ++i)
    if (corners[i].piece == corners[i - 1].piece && corners[i].point == corners[i - 1].point)
      sets.join(corners[i].side, corners[i - 1].side);
  const std::vector<std::uint32_t> number =
      numbered(sets, [&](std::uint32_t i) { return pieces[i / 2][i % 2] > 0; });
  std::vector<std::array<std::uint32_t, 2>> result(pieces.size());
  for (std::size_t t = 0; t < result.size(); ++t) result[t] = {number[2 * t], number[2 * t + 1]};
  return result;
}

/// Returns the shell of each point of a mesh.
std::vector<std::uint32_t> shells_of_points(const FineMesh& fine) {
  DisjointSets sets(fine.points().size());
  for (const Triangle& t : fine.triangles())
    if (t[0] != FineMesh::kNone) sets.join(t[0], t[1]), sets.join(t[0], t[2]);
  return numbered(sets, [&](std::uint32_t p) { return !fine.around(p).empty(); });
}

}  // namespace

ShellVolumes::ShellVolumes(const FineMesh& fine, std::span<const TrianglePieces> pieces) : fine_(fine) {
  if (pieces.empty())
    by_point_ = shells_of_points(fine);
  else
    by_triangle_ = shells_of_pieces(fine, pieces);
  std::vector<Triangle> triangles;
  std::vector<std::uint32_t> numbers;
  for (std::uint32_t t = 0; t < fine.triangles().size(); ++t) {
    if (fine.triangles()[t][0] == kNone) continue;
    triangles.push_back(fine.triangles()[t]);
    numbers.push_back(t);
    for (const std::uint32_t shell : shells_of(t)) {
      if (shell == kNone) continue;
      if (shell >= apex_.size()) apex_.resize(shell + 1, kNone);
      if (apex_[shell] == kNone) apex_[shell] = fine.triangles()[t][0];
    }
  }
  volumes_ = volumes_of(fine.points(), triangles, numbers);
  // The volume of a shell with a boundary is undefined.
  if (pieces.empty())
    for (const std::uint32_t t : numbers)
      for (int i = 0; i < 3; ++i)
        if (fine.across(t, i) == kNone) volumes_[shells_of(t)[0]] = 0.0;
}

std::array<std::uint32_t, 2> ShellVolumes::shells_of(std::uint32_t triangle) const {
  if (!by_triangle_.empty()) return by_triangle_[triangle];
  return {by_point_[fine_.triangles()[triangle][0]], kNone};
}

std::vector<double> ShellVolumes::volumes_of(std::span<const Eigen::Vector3d> points,
                                             std::span<const Triangle> triangles,
                                             std::span<const std::uint32_t> origin) const {
  std::vector<double> volumes(apex_.size());
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const auto [behind, in_front] = shells_of(origin[i]);
    const auto add = [&](std::uint32_t shell, double sign) {
      if (shell == kNone) return;
      const Eigen::Vector3d& apex = fine_.points()[apex_[shell]];
      const Triangle& t = triangles[i];
      volumes[shell] +=
          sign * (points[t[0]] - apex).dot((points[t[1]] - apex).cross(points[t[2]] - apex)) / 6.0;
    };
    add(behind, 1.0);
    add(in_front, -1.0);
  }
  return volumes;
}

std::vector<std::uint8_t> ShellVolumes::changed(std::span<const Eigen::Vector3d> points,
                                                std::span<const Triangle> triangles,
                                                std::span<const std::uint32_t> origin,
                                                double most_change) const {
  const std::vector<double> volumes = volumes_of(points, triangles, origin);
  std::vector<std::uint8_t> result(volumes.size());
  for (std::size_t shell = 0; shell < result.size(); ++shell) {
    if (volumes_[shell] == 0.0) continue;
    const double share = volumes[shell] / volumes_[shell];
    result[shell] = !(share > 0.0) || std::abs(share - 1.0) > most_change;
  }
  return result;
}

}  // namespace hermesh
