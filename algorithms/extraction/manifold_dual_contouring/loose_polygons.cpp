#include "algorithms/extraction/manifold_dual_contouring/loose_polygons.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>

namespace hermesh {
namespace {

constexpr double kWidth = 8;  ///< of the lattice's cubes, voxels

/// Numbers of the cubes that a box touches; two far apart may have the same.
template <class F>
void for_each_place(const Box3& box, F&& f) {
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

Box3 box_of(const Corners& corners) {
  Box3 box;
  for (const Eigen::Vector3d& p : corners) box.add(p);
  return box;
}

}  // namespace

void LoosePolygons::ByPlace::add(std::uint32_t triangle, const Box3& box) {
  for_each_place(box, [&](std::uint64_t place) { entries_.emplace_back(place, triangle); });
}

void LoosePolygons::ByPlace::sort() {
  std::ranges::sort(entries_);
  std::size_t places = 0;
  for (std::size_t i = 0; i < entries_.size(); ++i)
    places += i == 0 || entries_[i].first != entries_[i - 1].first;
  ranges_.assign(std::bit_ceil(4 * places + 1), Range{0, 0, 0});
  for (std::uint32_t first = 0, end; first < entries_.size(); first = end) {
    for (end = first; end < entries_.size() && entries_[end].first == entries_[first].first;) ++end;
    ranges_[slot_of(entries_[first].first)] = {entries_[first].first, first, end};
  }
}

/// Where it is, or would be.
std::size_t LoosePolygons::ByPlace::slot_of(std::uint64_t place) const {
  std::uint64_t slot = (place * 0x9e3779b97f4a7c15u) >> 32;
  for (;; ++slot) {
    const Range& range = ranges_[slot & (ranges_.size() - 1)];
    if (range.first == range.end || range.place == place) return slot & (ranges_.size() - 1);
  }
}

template <class F>
void LoosePolygons::ByPlace::for_each_near(const Box3& box, F&& f) const {
  for_each_place(box, [&](std::uint64_t place) {
    const Range& range = ranges_[slot_of(place)];
    for (std::uint32_t i = range.first; i < range.end; ++i) f(entries_[i].second);
  });
}

/// Calls f(triangle, half).
template <class F>
void LoosePolygons::for_each_triangle(const NamedPolygon& polygon, F&& f) {
  for (std::size_t half = 0; half + 2 < static_cast<std::size_t>(polygon.corners); ++half)
    f(NamedTriangle{{polygon.names[0], polygon.names[half + 1], polygon.names[half + 2]},
                    {polygon.points[0], polygon.points[half + 1], polygon.points[half + 2]}},
      static_cast<int>(half));
}

LoosePolygons::LoosePolygons(std::vector<NamedPolygon> tested)
    : polygons_(std::move(tested)), meets_(polygons_.size()) {
  for (std::size_t i = 0; i < polygons_.size(); ++i)
    for_each_triangle(polygons_[i], [&](const NamedTriangle& t, int half) {
      const Box3 box = box_of(t.corners);
      by_place_.add(static_cast<std::uint32_t>(tested_.size()), box);
      tested_.push_back({t, box, i, half});
    });
  by_place_.sort();
}

/// The triangles of two quads that have one diagonal would not meet, but be four at an edge.
bool LoosePolygons::shares_diagonal(const Tested& tested, const Triangle& t) const {
  const NamedPolygon& polygon = polygons_[tested.polygon];
  return polygon.corners == 4 &&
         std::ranges::count(t, polygon.names[0]) + std::ranges::count(t, polygon.names[2]) == 2;
}

void LoosePolygons::test_against(const NamedPolygon& polygon) {
  for_each_triangle(polygon, [&](const NamedTriangle& t, int half) {
    const Box3 box = box_of(t.corners);
    by_place_.for_each_near(box, [&](std::uint32_t i) {
      const Tested& tested = tested_[i];
      const bool is_itself = polygons_[tested.polygon].name == polygon.name;
      const std::atomic_ref answer(meets_[tested.polygon]);
      if ((is_itself && tested.half == half) || answer.load(std::memory_order_relaxed) ||
          !box.overlaps(tested.box))
        return;
      if ((!is_itself && shares_diagonal(tested, t.names)) || !certainly_apart(t, tested.triangle))
        answer.store(1, std::memory_order_relaxed);
    });
  });
}

std::vector<std::size_t> LoosePolygons::that_meet() const {
  std::vector<std::size_t> result;
  for (std::size_t i = 0; i < meets_.size(); ++i)
    if (meets_[i]) result.push_back(i);
  return result;
}

}  // namespace hermesh
