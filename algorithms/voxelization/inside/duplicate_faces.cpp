#include "algorithms/voxelization/inside/duplicate_faces.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <tuple>

#include "algorithms/core/disjoint_sets.h"
#include "algorithms/core/groups.h"

namespace hermesh {
namespace {

/// Whether a triangle runs through its points as their ascending order does, turned about or not.
bool same_winding(const Triangle& t, const Triangle& sorted) {
  const auto start = static_cast<std::size_t>(std::find(t.begin(), t.end(), sorted[0]) - t.begin());
  return t[(start + 1) % 3] == sorted[1];
}

}  // namespace

DuplicateFaces find_duplicates(std::span<const Triangle> triangles) {
  // Faces with the same points are next to each other once their points are sorted, and they by these.
  struct Face {
    Triangle points;  ///< sorted
    std::uint32_t number;
  };
  std::vector<Face> faces(triangles.size());
  tbb::parallel_for(std::size_t{0}, faces.size(), [&](std::size_t i) {
    faces[i] = {triangles[i], static_cast<std::uint32_t>(i)};
    std::sort(faces[i].points.begin(), faces[i].points.end());
  });
  tbb::parallel_sort(faces.begin(), faces.end(), [](const Face& a, const Face& b) {
    // With the number the order is unique, and the face that is left the first of its kind in the file.
    return std::tie(a.points, a.number) < std::tie(b.points, b.number);
  });
  DuplicateFaces result;
  for_groups(
      std::span<const Face>(faces), [](const Face& a, const Face& b) { return a.points == b.points; },
      [&](std::span<const Face> same) {
        if (same.size() == 1 || is_degenerate(same[0].points)) return;
        const auto forward = [](std::span<const Triangle> all, const Face& face) {
          return same_winding(all[face.number], face.points);
        };
        // A face counts once, in the winding that is left over when opposite ones cancel. Where nothing is
        // left over, one still stands for the place, and find_double_walls() says whether it bounds anything.
        std::ptrdiff_t net = 0;
        for (const Face& face : same) net += forward(triangles, face) ? 1 : -1;
        std::uint32_t left = same[0].number;
        for (const Face& face : same)
          if (net != 0 && forward(triangles, face) == (net > 0)) {
            left = face.number;
            break;
          }
        if (net == 0) result.cancelling.push_back(left);
        for (const Face& face : same)
          if (face.number != left) result.dropped.push_back(face.number);
      });
  return result;
}

std::vector<std::uint32_t> find_double_walls(std::span<const Triangle> triangles,
                                             const DuplicateFaces& duplicates) {
  if (duplicates.cancelling.empty()) return {};
  // Each side of every face that is left, sorted by edge, so that one pass sees all faces around an edge.
  constexpr std::uint32_t kSingle = ~0u;
  struct Edge {
    std::uint32_t low, high;
    std::uint32_t wall;  ///< its number in `cancelling`, kSingle for a face that does not cancel
    bool operator<(const Edge& o) const {
      return std::tie(low, high, wall) < std::tie(o.low, o.high, o.wall);
    }
  };
  std::vector<std::uint32_t> wall_of(triangles.size(), kSingle);
  for (std::uint32_t i = 0; i < duplicates.cancelling.size(); ++i) wall_of[duplicates.cancelling[i]] = i;
  std::vector<char> dropped(triangles.size(), 0);
  for (const std::uint32_t face : duplicates.dropped) dropped[face] = 1;
  std::vector<Edge> edges;
  edges.reserve(3 * (triangles.size() - duplicates.dropped.size()));
  for (std::size_t face = 0; face < triangles.size(); ++face) {
    const Triangle& t = triangles[face];
    // A face that is there several times counts once; a degenerate one has no edge of its own.
    if (dropped[face] || is_degenerate(t)) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax({t[k], t[(k + 1) % 3]});
      edges.push_back({low, high, wall_of[face]});
    }
  }
  tbb::parallel_sort(edges.begin(), edges.end());
  DisjointSets walls(duplicates.cancelling.size());
  // By wall, later by set: odd edges that are there with the faces and not without, less those that are there
  // without and not with.
  std::vector<std::int64_t> balance(walls.size());
  for_groups(
      std::span<const Edge>(edges),
      [](const Edge& a, const Edge& b) { return a.low == b.low && a.high == b.high; },
      [&](std::span<const Edge> same) {  // the walls come first
        // kSingle is the largest number, so the walls at an edge are its first entries; they belong together.
        if (same[0].wall == kSingle) return;
        std::size_t count = 0;
        while (count < same.size() && same[count].wall != kSingle)
          walls.join(same[0].wall, same[count++].wall);
        // Only an odd number of walls changes the parity: +1 where the others are even in number, and closed
        // without the walls.
        if (count % 2 == 1) balance[same[0].wall] += (same.size() - count) % 2 == 0 ? 1 : -1;
      });
  for (std::uint32_t i = 0; i < walls.size(); ++i)
    if (walls.find(i) != i) balance[walls.find(i)] += balance[i];
  std::vector<std::uint32_t> result;
  for (std::uint32_t i = 0; i < duplicates.cancelling.size(); ++i)
    if (balance[walls.find(i)] > 0) result.push_back(duplicates.cancelling[i]);
  return result;
}

}  // namespace hermesh
