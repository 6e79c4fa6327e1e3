#include "validation/geometry/triangle_tree.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>

#include "algorithms/core/error.h"

namespace hermesh::validation {
namespace {

constexpr std::size_t kLeafSize = 4;           // the fastest of 2, 4 and 8 for closest points
constexpr std::size_t kParallelSplit = 16384;  // below this a task costs more than it saves

Eigen::Vector3d closest_on_segment(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                   const Eigen::Vector3d& p) {
  const Eigen::Vector3d u = b - a;
  const double length = u.squaredNorm();
  if (!(length > 0.0)) return a;
  return a + std::clamp(u.dot(p - a) / length, 0.0, 1.0) * u;
}

Eigen::Vector3d closest_on_edges(const Corners& t, const Eigen::Vector3d& p) {
  Eigen::Vector3d best = closest_on_segment(t[0], t[1], p);
  for (int k = 1; k < 3; ++k) {
    const Eigen::Vector3d q = closest_on_segment(t[k], t[(k + 1) % 3], p);
    if ((q - p).squaredNorm() < (best - p).squaredNorm()) best = q;
  }
  return best;
}

// Contains all that the median splits compare, so that they access no other memory.
struct Item {
  std::array<float, 3> centre;
  std::uint32_t triangle;
};

// Splits the items of a node, then those of its children, level by level down to the leaves.
struct Splitter {
  std::vector<Item>& items;
  int depth;

  std::size_t first(std::size_t index, int level) const { return (items.size() * index) >> level; }

  void split(std::size_t index, int level) const {
    if (level == depth) return;
    const auto begin = items.begin() + std::ptrdiff_t(first(index, level));
    const auto middle = items.begin() + std::ptrdiff_t(first(2 * index + 1, level + 1));
    const auto end = items.begin() + std::ptrdiff_t(first(index + 1, level));
    const int axis = longest_axis(begin, end);
    std::nth_element(begin, middle, end, [axis](const Item& a, const Item& b) {
      return a.centre[axis] != b.centre[axis] ? a.centre[axis] < b.centre[axis] : a.triangle < b.triangle;
    });
    const auto left = [&] { split(2 * index, level + 1); };
    const auto right = [&] { split(2 * index + 1, level + 1); };
    if (std::size_t(end - begin) > kParallelSplit) {
      tbb::parallel_invoke(left, right);
    } else {
      left();
      right();
    }
  }

  static int longest_axis(std::vector<Item>::const_iterator begin, std::vector<Item>::const_iterator end) {
    std::array<float, 3> lower = begin->centre, upper = begin->centre;
    for (auto it = begin; it != end; ++it)
      for (int k = 0; k < 3; ++k) {
        lower[k] = std::min(lower[k], it->centre[k]);
        upper[k] = std::max(upper[k], it->centre[k]);
      }
    int axis = 0;
    for (int k = 1; k < 3; ++k)
      if (upper[k] - lower[k] > upper[axis] - lower[axis]) axis = k;
    return axis;
  }
};

}  // namespace

Eigen::Vector3d closest_point(const Corners& t, const Eigen::Vector3d& p) {
  const Eigen::Vector3d ab = t[1] - t[0], bc = t[2] - t[1], ca = t[0] - t[2];
  const Eigen::Vector3d normal = ab.cross(bc);
  const double area = normal.squaredNorm();
  const double longest = std::max({ab.squaredNorm(), bc.squaredNorm(), ca.squaredNorm()});
  const Eigen::Vector3d ap = p - t[0];
  if (area > 1e-16 * longest * longest && normal.cross(ab).dot(ap) >= 0.0 &&
      normal.cross(bc).dot(p - t[1]) >= 0.0 && normal.cross(ca).dot(p - t[2]) >= 0.0)
    return p - (normal.dot(ap) / area) * normal;
  return closest_on_edges(t, p);
}

TriangleTree::TriangleTree(const TriangleSoup& soup) {
  const std::size_t n = soup.triangles.size();
  if (n == 0) throw Error("a mesh without polygons has no surface to measure a distance to");
  while ((n >> depth_) > kLeafSize && depth_ < kMaxDepth) ++depth_;
  // Centres are relative to the first point, because single precision is too coarse far from the origin.
  const Eigen::Vector3d origin = soup.points[soup.triangles[0][0]];
  std::vector<Item> items(n);
  const auto chunks = tbb::blocked_range<std::size_t>(0, n, 4096);
  tbb::parallel_for(chunks, [&](const tbb::blocked_range<std::size_t>& range) {
    for (std::size_t t = range.begin(); t < range.end(); ++t) {
      const Eigen::Vector3f c = (box_of(soup.corners(t)).centre() - origin).cast<float>();
      items[t] = {{c.x(), c.y(), c.z()}, std::uint32_t(t)};
    }
  });
  Splitter{items, depth_}.split(0, 0);
  order_.resize(n);
  corners_.resize(n);
  tbb::parallel_for(chunks, [&](const tbb::blocked_range<std::size_t>& range) {
    for (std::size_t slot = range.begin(); slot < range.end(); ++slot) {
      order_[slot] = items[slot].triangle;
      corners_[slot] = soup.corners(items[slot].triangle);
    }
  });
  boxes_.resize(2 * leaves() - 1);
  tbb::parallel_for(std::size_t(0), leaves(), [&](std::size_t leaf) {
    for (std::size_t slot = first_slot(leaf); slot < first_slot(leaf + 1); ++slot)
      boxes_[leaves() - 1 + leaf].add(box_of(corners_[slot]));
  });
  for (std::size_t node = leaves() - 1; node-- > 0;) {
    boxes_[node] = boxes_[2 * node + 1];
    boxes_[node].add(boxes_[2 * node + 2]);
  }
}

ClosestHit TriangleTree::slot_hit(const Eigen::Vector3d& point, std::uint32_t slot) const {
  const Eigen::Vector3d q = closest_point(corners_[slot], point);
  return {(q - point).squaredNorm(), q, slot};
}

ClosestHit TriangleTree::closest(const Eigen::Vector3d& point, ClosestHit best) const {
  struct Entry {
    std::size_t node;
    double squared;
  } stack[kMaxDepth + 2];
  int top = 0;
  stack[top++] = {0, boxes_[0].squared_distance(point)};
  while (top > 0) {
    const Entry e = stack[--top];
    if (e.squared >= best.squared) continue;
    if (e.node >= leaves() - 1) {
      const std::size_t leaf = e.node - (leaves() - 1);
      for (std::size_t slot = first_slot(leaf); slot < first_slot(leaf + 1); ++slot) {
        const ClosestHit hit = slot_hit(point, std::uint32_t(slot));
        if (hit.squared < best.squared) best = hit;
      }
      continue;
    }
    Entry near{2 * e.node + 1, boxes_[2 * e.node + 1].squared_distance(point)};
    Entry far{2 * e.node + 2, boxes_[2 * e.node + 2].squared_distance(point)};
    if (far.squared < near.squared) std::swap(near, far);
    if (far.squared < best.squared) stack[top++] = far;
    if (near.squared < best.squared) stack[top++] = near;
  }
  return best;
}

}  // namespace hermesh::validation
