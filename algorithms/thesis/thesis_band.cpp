#include "algorithms/thesis/thesis_band.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <utility>

#include "algorithms/core/parallel.h"

namespace hermesh::thesis {
namespace {

using Eigen::Vector3d;

Vector3d closest_on_segment(const Vector3d& a, const Vector3d& b, const Vector3d& p) {
  const Vector3d ab = b - a;
  const double squared = ab.squaredNorm();
  // A side without length is its first corner.
  return squared > 0.0 ? Vector3d(a + ab * std::clamp((p - a).dot(ab) / squared, 0.0, 1.0)) : a;
}

/// The nearest point of the three sides, for triangles without an area to speak of.
Vector3d closest_on_border(const GridTriangle& t, const Vector3d& p) {
  Vector3d best = closest_on_segment(t[0], t[1], p);
  for (const Vector3d& q : {closest_on_segment(t[1], t[2], p), closest_on_segment(t[2], t[0], p)})
    if ((q - p).squaredNorm() < (best - p).squaredNorm()) best = q;
  return best;
}

/// Merges a block of a later subset into that of an earlier one, which takes precedence for equal distances.
void merge_block(BandBlock& into, const BandBlock& from) {
  into.boundary = either(into.boundary, from.boundary);
  into.set = either(into.set, from.set);
  for_each_bit(from.set, [&](int i) {
    if (!(from.squared_distance[i] < into.squared_distance[i])) return;
    into.squared_distance[i] = from.squared_distance[i];
    into.triangle[i] = from.triangle[i];
  });
}

}  // namespace

/// Determines the nearest point by the Voronoi regions of the corners, sides and inside (Ericson, Real-Time
/// Collision Detection, §5.1.5).
Vector3d closest_point(const GridTriangle& triangle, const Vector3d& p) {
  const auto& [a, b, c] = triangle;
  const Vector3d ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap), d3 = ab.dot(bp), d4 = ac.dot(bp), d5 = ab.dot(cp),
               d6 = ac.dot(cp);
  if (d1 <= 0 && d2 <= 0) return a;
  if (d3 >= 0 && d4 <= d3) return b;
  if (d6 >= 0 && d5 <= d6) return c;
  // The rest divides by the square of the area, which on a sliver is only rounding.
  const double vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
  if (!(ab.cross(ac).squaredNorm() > 1e-12 * ab.squaredNorm() * ac.squaredNorm()))
    return closest_on_border(triangle, p);
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + ab * (d1 / (d1 - d3));
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + ac * (d2 / (d2 - d6));
  if (va <= 0 && d4 >= d3 && d5 >= d6) return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
  return a + ab * (vb / (va + vb + vc)) + ac * (vc / (va + vb + vc));
}

std::int32_t Band::find_or_add(const Voxel& lower) {
  const auto [entry, is_new] = numbers_.try_emplace(lower, size());
  if (is_new) blocks_.push_back(std::make_unique<BandBlock>(lower));
  return entry->second;
}

void Band::merge(Band other, const RunContext& context) {
  for (std::unique_ptr<BandBlock>& theirs : other.blocks_) {
    context.check();
    // Blocks that only the other grid has are moved; each merged one is freed at once, so that memory does
    // not double.
    const auto [entry, is_new] = numbers_.try_emplace(theirs->lower, size());
    if (is_new) {
      blocks_.push_back(std::move(theirs));
    } else {
      merge_block(*blocks_[entry->second], *theirs);
      theirs.reset();
    }
  }
}

void Band::link(std::int32_t first, const RunContext& context) {
  parallel_blocks(std::size_t(size() - first), context, [&](std::size_t i) {
    BandBlock& own = *blocks_[first + std::int32_t(i)];
    for (int slot = 0; slot < 27; ++slot) {
      // Each thread writes to its own block. The other direction, below, is sequential, for an old block may
      // have several new neighbours.
      const auto there =
          numbers_.find({own.lower[0] + 8 * (slot / 9 - 1), own.lower[1] + 8 * (slot / 3 % 3 - 1),
                         own.lower[2] + 8 * (slot % 3 - 1)});
      if (there != numbers_.end()) own.neighbours[slot] = there->second;
    }
  });
  for (std::int32_t number = first; number < size(); ++number)
    for (int slot = 0; slot < 27; ++slot)
      // Slot 26 − s is opposite to slot s.
      if (const std::int32_t there = blocks_[number]->neighbours[slot]; there != kNoBlock)
        blocks_[there]->neighbours[26 - slot] = number;
}

PaddedMask::PaddedMask(const Band& band, const BandBlock& block, BlockMask BandBlock::*mask) {
  const BlockMask* masks[27];
  static constexpr BlockMask kEmpty{};
  for (int slot = 0; slot < 27; ++slot) {
    // Slot 13 is the block itself. A missing neighbour has no voxel set.
    const std::int32_t number = slot == 13 ? kNoBlock : block.neighbours[slot];
    masks[slot] = number == kNoBlock ? &kEmpty : &(band.block(number).*mask);
  }
  masks[13] = &(block.*mask);
  for (int x = -1; x <= 8; ++x)
    for (int y = -1; y <= 8; ++y) {
      const auto bits = [&](int dz) {
        const BlockMask& m = *masks[neighbour_slot(x >> 3, y >> 3, dz)];
        return std::uint32_t(m[x & 7] >> (8 * (y & 7))) & 0xff;
      };
      // Ten voxels along z in one word: the previous neighbour's last, this block's eight, the next
      // neighbour's first.
      rows_[x + 1][y + 1] = bits(-1) >> 7 | bits(0) << 1 | (bits(1) & 1) << 9;
    }
}

void PaddedMask::set_inner(const BlockMask& mask) {
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y) {
      // 0x201 are the two bits of the neighbours.
      std::uint32_t& r = rows_[x + 1][y + 1];
      r = (r & 0x201) | (std::uint32_t(mask[x] >> (8 * y)) & 0xff) << 1;
    }
}

BlockMask PaddedMask::face_neighbours() const {
  BlockMask result{};
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y) {
      const std::uint32_t straight = row(x - 1, y) | row(x + 1, y) | row(x, y - 1) | row(x, y + 1);
      // Shifts are steps along z.
      const std::uint32_t bits = straight | row(x, y) >> 1 | row(x, y) << 1;
      result[x] |= std::uint64_t((bits >> 1) & 0xff) << (8 * y);
    }
  return result;
}

BlockMask PaddedMask::face_and_edge_neighbours() const {
  BlockMask result{};
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y) {
      const std::uint32_t straight = row(x - 1, y) | row(x + 1, y) | row(x, y - 1) | row(x, y + 1);
      // Eighteen neighbours: 4 straight and 4 diagonal in the layer, and 5 above and below each.
      const std::uint32_t diagonal =
          row(x - 1, y - 1) | row(x - 1, y + 1) | row(x + 1, y - 1) | row(x + 1, y + 1);
      const std::uint32_t slanted = straight | row(x, y);  // these count a step along z to either side
      const std::uint32_t bits = straight | diagonal | slanted >> 1 | slanted << 1;
      result[x] |= std::uint64_t((bits >> 1) & 0xff) << (8 * y);
    }
  return result;
}

}  // namespace hermesh::thesis
