#include "algorithms/extraction/manifold_dual_contouring/loose_polygons.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <unordered_map>
#include <utility>

#include "algorithms/core/parallel.h"
#include "algorithms/extraction/manifold_dual_contouring/triangle_contact.h"
#include "algorithms/extraction/manifold_dual_contouring/triangle_grid.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// Triangles by the cubes of a lattice that their boxes touch.
class TrianglesByPlace {
 public:
  void add(std::uint32_t triangle, const Box3& box) {
    for_each_place(box, [&](std::uint64_t place) { entries_.emplace_back(place, triangle); });
  }
  /// Before the first question.
  void sort() {
    std::ranges::sort(entries_);
    for (std::size_t first = 0, end; first < entries_.size(); first = end) {
      for (end = first; end < entries_.size() && entries_[end].first == entries_[first].first;) ++end;
      ranges_.emplace(entries_[first].first, std::pair(first, end));
    }
  }
  /// Calls f(triangle) for those that share a cube with the box, some of them more than once.
  template <class F>
  void for_each_near(const Box3& box, F&& f) const {
    for_each_place(box, [&](std::uint64_t place) {
      const auto found = ranges_.find(place);
      if (found == ranges_.end()) return;
      for (std::size_t i = found->second.first; i < found->second.second; ++i) f(entries_[i].second);
    });
  }

 private:
  static constexpr double kWidth = 8;  ///< voxels
  /// Numbers of cubes; two far apart may have the same.
  template <class F>
  static void for_each_place(const Box3& box, F&& f) {
    const auto index = [](double x) { return static_cast<std::int64_t>(std::floor(x / kWidth)); };
    constexpr int kBits = 21;
    const auto part = [](std::int64_t x) {
      return static_cast<std::uint64_t>(x) & ((std::uint64_t{1} << kBits) - 1);
    };
    for (std::int64_t x = index(box.lower[0]); x <= index(box.upper[0]); ++x)
      for (std::int64_t y = index(box.lower[1]); y <= index(box.upper[1]); ++y)
        for (std::int64_t z = index(box.lower[2]); z <= index(box.upper[2]); ++z)
          f(part(x) << (2 * kBits) | part(y) << kBits | part(z));
  }
  std::vector<std::pair<std::uint64_t, std::uint32_t>> entries_;  ///< places and triangles, ascending
  std::unordered_map<std::uint64_t, std::pair<std::size_t, std::size_t>>
      ranges_;  ///< of each place's entries
};

}  // namespace

std::vector<std::size_t> loose_polygons_that_meet(const std::vector<Vector3d>& points,
                                                  const LargeArray<Quad>& quads,
                                                  const std::vector<Triangle>& triangles,
                                                  const std::vector<LoosePolygon>& loose,
                                                  RunContext& context) {
  // Numbers: the triangles, and then two for each quad.
  const auto triangle_of = [&](std::size_t number) {
    if (number < triangles.size()) return triangles[number];
    const Quad& q = quads[(number - triangles.size()) / 2];
    return (number - triangles.size()) % 2 == 0 ? Triangle{q[0], q[1], q[2]} : Triangle{q[0], q[2], q[3]};
  };
  const auto box_of = [&](const Triangle& t) {
    Box3 box;
    for (const std::uint32_t p : t) box.add(points[p]);
    return box;
  };
  struct Tested {
    std::size_t number, other_half;  ///< that of the same quad, or itself
    Triangle triangle;
    Box3 box;
    std::size_t loose;

    /// The triangles of two quads that have one diagonal would not meet, but be four at an edge.
    bool shares_diagonal(const Triangle& t, std::size_t other) const {
      if (other_half == number || other == other_half) return false;
      const std::size_t end = other_half > number ? 2 : 1;  // 012 or 023 of the quad
      return std::ranges::count(t, triangle[0]) + std::ranges::count(t, triangle[end]) == 2;
    }
  };
  std::vector<Tested> tested;
  const auto add = [&](std::size_t number, std::size_t other_half, std::size_t i) {
    const Triangle t = triangle_of(number);
    tested.push_back({number, other_half, t, box_of(t), i});
  };
  for (std::size_t i = 0; i < loose.size(); ++i) {
    if (!loose[i].is_quad) {
      add(loose[i].number, loose[i].number, i);
    } else {
      const std::size_t first = triangles.size() + 2 * std::size_t{loose[i].number};
      add(first, first + 1, i);
      add(first + 1, first, i);
    }
  }
  TrianglesByPlace by_place;
  for (std::size_t i = 0; i < tested.size(); ++i) by_place.add(static_cast<std::uint32_t>(i), tested[i].box);
  by_place.sort();
  std::vector<std::uint8_t> meets(loose.size());
  parallel_blocks(triangles.size() + 2 * quads.size(), context, [&](std::size_t number) {
    const Triangle t = triangle_of(number);
    const Box3 box = box_of(t);
    by_place.for_each_near(box, [&](std::uint32_t i) {
      const Tested& other = tested[i];
      std::atomic_ref answer(meets[other.loose]);
      if (other.number == number || answer.load(std::memory_order_relaxed) || !box.overlaps(other.box))
        return;
      if (other.shares_diagonal(t, number) || !certainly_apart(t, other.triangle, points))
        answer.store(1, std::memory_order_relaxed);
    });
  });
  std::vector<std::size_t> result;
  for (std::size_t i = 0; i < loose.size(); ++i)
    if (meets[i]) result.push_back(i);
  return result;
}

}  // namespace hermesh
