#include <tbb/parallel_sort.h>

#include <bit>
#include <cmath>
#include <deque>
#include <iterator>
#include <numbers>
#include <utility>

#include "algorithms/core/parallel.h"
#include "algorithms/thesis/thesis_band.h"

namespace hermesh::thesis {
namespace {

using Eigen::Vector3d;

// ---- §5.3, the outer shell.

/// Returns the sample at step k along an axis, on line (u, v) of a block.
int sample_on_line(int axis, int u, int v, int k) {
  std::array<int, 3> local;
  local[axis] = k, local[(axis + 1) % 3] = u, local[(axis + 2) % 3] = v;
  return sample_index(local[0], local[1], local[2]);
}

/// Marks the first voxel with a distance of every line along a column of blocks, unless it is a boundary
/// voxel. Each of the 64 lines has a bit in `pending` until its first voxel is found.
template <class Iterator>
void mark_first_voxels(Band& band, int axis, bool backwards, Iterator begin, Iterator end) {
  std::uint64_t pending = ~std::uint64_t(0);
  for (Iterator entry = begin; entry != end && pending; ++entry) {
    BandBlock& block = band.block(entry->second);
    for (std::uint64_t lines = pending; lines; lines &= lines - 1) {
      const int line = std::countr_zero(lines);
      for (int step = 0; step < 8; ++step) {
        const int sample = sample_on_line(axis, line >> 3, line & 7, backwards ? 7 - step : step);
        if (!test(block.set, sample)) continue;
        if (!test(block.boundary, sample)) add(block.outside, sample);
        pending &= ~(std::uint64_t(1) << line);
        break;
      }
    }
  }
}

/// Marks the seeds of the flood fill, from both ends of every grid line along an axis.
void mark_seeds(Band& band, int axis, const RunContext& context) {
  std::vector<std::pair<Voxel, std::int32_t>> order(band.size());
  parallel_blocks(order.size(), context, [&](std::size_t i) {
    const Voxel& lower = band.block(std::int32_t(i)).lower;
    order[i] = {{lower[(axis + 1) % 3], lower[(axis + 2) % 3], lower[axis]}, std::int32_t(i)};
  });
  // By line and then along it: the blocks of a column are consecutive, and columns share no block, so each is
  // one thread's.
  tbb::parallel_sort(order.begin(), order.end());
  std::vector<std::size_t> columns;  // where each begins
  for (std::size_t i = 0; i < order.size(); ++i)
    if (i == 0 || order[i].first[0] != order[i - 1].first[0] || order[i].first[1] != order[i - 1].first[1])
      columns.push_back(i);
  columns.push_back(order.size());
  parallel_blocks(columns.size() - 1, context, [&](std::size_t c) {
    const auto begin = order.begin() + std::ptrdiff_t(columns[c]),
               end = order.begin() + std::ptrdiff_t(columns[c + 1]);
    mark_first_voxels(band, axis, false, begin, end);
    mark_first_voxels(band, axis, true, std::make_reverse_iterator(end), std::make_reverse_iterator(begin));
  });
}

/// Extends the outside within a block, and from its neighbours into it. Returns true if it grew.
bool flood_block(const Band& band, BandBlock& block) {
  // The boundary voxels are the wall that restricts the flood fill.
  const BlockMask open = without(block.set, block.boundary), before = block.outside;
  PaddedMask outside(band, block, &BandBlock::outside);
  while (true) {
    const BlockMask grown = either(block.outside, both(outside.face_neighbours(), open));
    if (grown == block.outside) return grown != before;
    block.outside = grown;
    outside.set_inner(grown);
  }
}

/// Floods block by block, and again the blocks next to one that changed, until none changes. The outside only
/// grows, so that the result does not depend on the order.
void flood(Band& band, const RunContext& context) {
  std::deque<std::int32_t> queue;
  std::vector<bool> queued(band.size(), true);
  for (std::int32_t number = 0; number < band.size(); ++number) queue.push_back(number);
  for (std::size_t visits = 0; !queue.empty(); ++visits) {
    if (visits % 1024 == 0) context.check();
    const std::int32_t number = queue.front();
    queue.pop_front();
    queued[number] = false;
    if (!flood_block(band, band.block(number))) continue;
    for (const int slot : {4, 10, 12, 14, 16, 22})  // those that share a face
      if (const std::int32_t next = band.block(number).neighbours[slot]; next != kNoBlock && !queued[next]) {
        queued[next] = true;
        queue.push_back(next);
      }
  }
}

// ---- §5.3, boundary voxels.

/// The rule of §5.3 for boundary voxels.
struct BoundarySigns {
  Band& band;
  const Triangles& triangles;
  double cosine;  ///< of the sign angle

  /// Returns the vector from a voxel's centre to its closest point, from its triangle.
  Vector3d to_surface(const BandBlock& block, int sample) const {
    const Vector3d p = centre(block.voxel(sample));
    return closest_point(triangles[block.triangle[sample]], p) - p;
  }

  /// Returns true if the vector of a neighbour that the flood fill marked makes an angle below the sign angle
  /// with the voxel's own: both are then on the same side of the surface.
  bool is_outside(const BandBlock& block, int sample) const {
    Vector3d own = Vector3d::Zero();
    for (const std::array<int, 3>& step : kNeighbours) {
      const Place there = neighbour(band, block, sample, step);
      if (!there.in(&BandBlock::outside)) continue;
      if (own.isZero(0.0)) own = to_surface(block, sample);
      if (own.isZero(0.0)) return false;
      const Vector3d other = to_surface(*there.block, there.sample);
      if (own.dot(other) > cosine * own.norm() * other.norm()) return true;
    }
    return false;
  }

  /// Evaluates the boundary voxels of a block by the marks of the flood fill. The results are stored in
  /// `found_outside`, so no voxel depends on another's.
  void evaluate(BandBlock& block) const {
    block.found_outside = {};
    for_each_bit(block.boundary, [&](int sample) {
      if (is_outside(block, sample)) add(block.found_outside, sample);
    });
  }
};

}  // namespace

void determine_signs(Band& band, const Triangles& triangles, double sign_angle, RunContext& context) {
  const Stage stage(context, "signs");
  for (int axis = 0; axis < 3; ++axis) mark_seeds(band, axis, context);
  flood(band, context);
  context.progress("signs", 0.5);
  const BoundarySigns signs{band, triangles, std::cos(sign_angle * std::numbers::pi / 180.0)};
  const std::size_t blocks = std::size_t(band.size());
  parallel_blocks(blocks, context, [&](std::size_t i) { signs.evaluate(band.block(std::int32_t(i))); });
  parallel_blocks(blocks, context, [&](std::size_t i) {
    BandBlock& block = band.block(std::int32_t(i));
    block.outside = either(block.outside, block.found_outside);
  });
}

void remove_unwanted_voxels(Band& band, RunContext& context) {
  const Stage stage(context, "clean-up");
  // Each algorithm writes one mask and reads another's neighbourhood, so the order of the voxels does not
  // matter.
  const auto for_each_block = [&](auto&& f) {
    parallel_blocks(std::size_t(band.size()), context,
                    [&](std::size_t i) { f(band.block(std::int32_t(i))); });
  };
  for_each_block([&](BandBlock& block) {  // algorithm 3
    const BlockMask near = PaddedMask(band, block, &BandBlock::outside).face_and_edge_neighbours();
    const BlockMask unwanted = without(block.boundary, near);
    block.boundary = without(block.boundary, unwanted);
    block.set = without(block.set, unwanted);
  });
  for_each_block([&](BandBlock& block) {  // algorithm 4
    const BlockMask near = PaddedMask(band, block, &BandBlock::boundary).face_and_edge_neighbours();
    block.set = without(block.set, without(without(block.set, block.boundary), near));
    block.outside = both(block.outside, block.set);
  });
}

}  // namespace hermesh::thesis
