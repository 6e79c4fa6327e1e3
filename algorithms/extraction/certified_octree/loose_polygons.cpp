#include "algorithms/extraction/certified_octree/loose_polygons.h"

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <utility>

#include "algorithms/core/parallel.h"

namespace hermesh {
namespace {

constexpr double kWidth = 8;  ///< width of the cubes of the lattice, voxels

/// Returns the key of a cube; two distant cubes may have the same key, which only costs time.
std::uint64_t number_of(const std::array<std::int64_t, 3>& cube) {
  constexpr int kBits = 21;
  const auto part = [](std::int64_t x) {
    return static_cast<std::uint64_t>(x) & ((std::uint64_t{1} << kBits) - 1);
  };
  return part(cube[0]) << (2 * kBits) | part(cube[1]) << kBits | part(cube[2]);
}
std::array<std::int64_t, 3> cube_at(const Eigen::Vector3d& place) {
  const auto index = [&](int axis) { return static_cast<std::int64_t>(std::floor(place[axis] / kWidth)); };
  return {index(0), index(1), index(2)};
}

/// Calls f(key) for the cubes that a box overlaps.
template <class F>
void for_each_place(const Bounds& box, F&& f) {
  const std::array<std::int64_t, 3> first = cube_at(box.lower), last = cube_at(box.upper);
  for (std::int64_t x = first[0]; x <= last[0]; ++x)
    for (std::int64_t y = first[1]; y <= last[1]; ++y)
      for (std::int64_t z = first[2]; z <= last[2]; ++z) f(number_of({x, y, z}));
}

Bounds box_of(const NamedPolygon& polygon) {
  Bounds box;
  for (int i = 0; i < polygon.corners; ++i) box.add(polygon.points[i]);
  return box;
}

/// A triangle of a polygon, of the polygon's first corner and two consecutive ones, with a flag for each of
/// its corners that is settled.
struct Half {
  NamedTriangle triangle;
  std::array<bool, 3> settled;
  Bounds box;
  Half(const NamedPolygon& polygon, int which) {
    const std::array<std::size_t, 3> corners = {0, static_cast<std::size_t>(which + 1),
                                                static_cast<std::size_t>(which + 2)};
    for (std::size_t i = 0; i < 3; ++i) {
      triangle.names[i] = polygon.names[corners[i]];
      triangle.corners[i] = polygon.points[corners[i]];
      settled[i] = (polygon.settled >> corners[i]) & 1;
      box.add(triangle.corners[i]);
    }
  }
};
int halves(const NamedPolygon& polygon) { return polygon.corners - 2; }

/// Returns true if two triangles have a common corner around which no triangles intersect.
bool share_settled(const Half& a, const Half& b) {
  for (std::size_t i = 0; i < 3; ++i)
    if (a.settled[i] && std::ranges::find(b.triangle.names, a.triangle.names[i]) != b.triangle.names.end())
      return true;
  return false;
}

/// Returns true if a triangle has both ends of a quad's diagonal. The triangles of two quads with a common
/// diagonal would not intersect, but there would be four at one edge.
bool has_diagonal(const Half& t, const NamedPolygon& polygon) {
  const Triangle& names = t.triangle.names;
  return polygon.corners == 4 &&
         std::ranges::count(names, polygon.names[0]) + std::ranges::count(names, polygon.names[2]) == 2;
}

// Cheap tests first: the exact test is only for triangles whose boxes overlap.
bool may_meet(const Half& a, const Half& b) {
  return a.box.overlaps(b.box) && !share_settled(a, b) && !certainly_apart(a.triangle, b.triangle);
}

bool may_meet(const NamedPolygon& a, const NamedPolygon& b) {
  for (int i = 0; i < halves(a); ++i) {
    const Half one(a, i);
    for (int k = 0; k < halves(b); ++k) {
      const Half other(b, k);
      if (may_meet(one, other) || (has_diagonal(one, b) && !share_settled(one, other))) return true;
    }
  }
  return false;
}

}  // namespace

LoosePolygons::ByPlace::ByPlace(std::span<const Bounds> boxes, const RunContext& context) {
  // Count, scan, fill, and sort, so that the order does not depend on the thread schedule.
  std::vector<std::uint64_t> starts(boxes.size());
  parallel_blocks(boxes.size(), context,
                  [&](std::size_t i) { for_each_place(boxes[i], [&](std::uint64_t) { ++starts[i]; }); });
  entries_.resize(exclusive_scan(starts, "places of polygons"));
  parallel_blocks(boxes.size(), context, [&](std::size_t i) {
    for_each_place(boxes[i], [&, at = starts[i]](std::uint64_t place) mutable {
      entries_[at++] = {place, static_cast<std::uint32_t>(i)};
    });
  });
  tbb::parallel_sort(entries_);
  std::size_t places = 0;
  for (std::size_t i = 0; i < entries_.size(); ++i)
    places += i == 0 || entries_[i].place != entries_[i - 1].place;
  // Open addressing, at most a quarter full, so a search ends after a few steps and always at a free slot.
  ranges_.assign(std::bit_ceil(4 * places + 1), Range{0, 0, 0});
  for (std::uint32_t first = 0, end; first < entries_.size(); first = end) {
    for (end = first; end < entries_.size() && entries_[end].place == entries_[first].place;) ++end;
    ranges_[slot_of(entries_[first].place)] = {entries_[first].place, first, end};
  }
}

/// Returns the slot of a cube, or the free slot for it.
std::size_t LoosePolygons::ByPlace::slot_of(std::uint64_t place) const {
  std::uint64_t slot = (place * 0x9e3779b97f4a7c15u) >> 32;
  for (;; ++slot) {
    const Range& range = ranges_[slot & (ranges_.size() - 1)];
    if (range.first == range.end || range.place == place) return slot & (ranges_.size() - 1);
  }
}

template <class F>
void LoosePolygons::ByPlace::for_each_near(const Bounds& box, F&& f) const {
  for_each_place(box, [&](std::uint64_t place) {
    const Range& range = ranges_[slot_of(place)];
    for (std::uint32_t i = range.first; i < range.end; ++i) f(entries_[i].polygon, place);
  });
}

LoosePolygons::LoosePolygons(LargeArray<NamedPolygon> tested, const RunContext& context)
    : polygons_(std::move(tested)),
      boxes_([&] {
        std::vector<Bounds> boxes(polygons_.size());
        parallel_blocks(boxes.size(), context, [&](std::size_t i) { boxes[i] = box_of(polygons_[i]); });
        return boxes;
      }()),
      by_place_(boxes_, context),
      meets_(polygons_.size()) {}

/// Tested polygons near a box, with boxes relative to its lower corner, in single precision and widened by
/// more than the rounding error. Stored by coordinate and not by polygon, so that the compiler can compare
/// several at once.
struct LoosePolygons::Near {
  std::vector<std::uint32_t> polygons;
  std::array<std::vector<float>, 3> lower, upper;
  std::vector<std::uint8_t> overlap;
  Eigen::Vector3d origin;

  void begin(const Eigen::Vector3d& at) {
    origin = at;
    polygons.clear();
    for (auto* sides : {&lower, &upper})
      for (std::vector<float>& side : *sides) side.clear();
  }
  void add(std::uint32_t polygon, const Bounds& box) {
    polygons.push_back(polygon);
    for (int axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<std::size_t>(axis);
      lower[a].push_back(static_cast<float>(box.lower[axis] - origin[axis]) - kRounding);
      upper[a].push_back(static_cast<float>(box.upper[axis] - origin[axis]) + kRounding);
    }
  }
  /// Calls f(polygon) for those whose boxes overlap the given one.
  template <class F>
  void for_each_at(const Bounds& box, F&& f) {
    const Eigen::Vector3f from = (box.lower - origin).cast<float>(), to = (box.upper - origin).cast<float>();
    const std::size_t n = polygons.size();
    overlap.resize(n);
    const float *x0 = lower[0].data(), *y0 = lower[1].data(), *z0 = lower[2].data(), *x1 = upper[0].data(),
                *y1 = upper[1].data(), *z1 = upper[2].data();
    std::uint8_t* const out = overlap.data();
    // Comparisons without branches, separate from the calls, so that the compiler can vectorise them. The
    // calls follow.
    for (std::size_t i = 0; i < n; ++i)
      out[i] = (x0[i] <= to[0]) & (x1[i] >= from[0]) & (y0[i] <= to[1]) & (y1[i] >= from[1]) &
               (z0[i] <= to[2]) & (z1[i] >= from[2]);
    for (std::size_t i = 0; i < n; ++i)
      if (out[i]) f(polygons[i]);
  }

 private:
  static constexpr float kRounding = 1e-4f;
};

void LoosePolygons::find_near(const Bounds& box, Near& near) const {
  // Relative to the box: single precision is enough for the few voxels around.
  near.begin(box.lower);
  by_place_.for_each_near(box, [&](std::uint32_t polygon, std::uint64_t place) {
    // A pair may share several cubes of the lattice. It is reported once: for the cube where the common part
    // of their boxes begins.
    if (box.overlaps(boxes_[polygon]) &&
        place == number_of(cube_at(box.lower.cwiseMax(boxes_[polygon].lower))))
      near.add(polygon, boxes_[polygon]);
  });
}

void LoosePolygons::test_against(std::span<const NamedPolygon> polygons) {
  if (polygons.empty()) return;
  // The polygons of a batch are near one another, so the polygons near any of them are collected once.
  thread_local Near near;
  Bounds all;
  for (const NamedPolygon& polygon : polygons)
    for (int i = 0; i < polygon.corners; ++i) all.add(polygon.points[i]);
  find_near(all, near);
  for (const NamedPolygon& polygon : polygons)
    near.for_each_at(box_of(polygon), [&](std::uint32_t i) {
      // Several threads may find the same polygon; all of them write 1, so the order does not matter.
      const std::atomic_ref answer(meets_[i]);
      if (answer.load(std::memory_order_relaxed)) return;
      // The names identify the tested polygon among the given ones.
      const bool is_itself = polygons_[i].name == polygon.name;
      // A quad is also tested against itself: its halves share the diagonal, and may be folded onto one
      // another.
      if (is_itself ? halves(polygon) == 2 && may_meet(Half(polygon, 0), Half(polygon, 1))
                    : may_meet(polygon, polygons_[i]))
        answer.store(1, std::memory_order_relaxed);
    });
}

std::vector<std::size_t> LoosePolygons::that_meet() const {
  std::vector<std::size_t> result;
  for (std::size_t i = 0; i < meets_.size(); ++i)
    if (meets_[i]) result.push_back(i);
  return result;
}

}  // namespace hermesh
