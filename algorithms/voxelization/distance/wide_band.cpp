#include "algorithms/voxelization/distance/wide_band.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <set>

#include "algorithms/core/parallel.h"
#include "algorithms/search/triangle_tree.h"

namespace hermesh {
namespace {

using openvdb::Coord;
using FloatLeaf = openvdb::FloatTree::LeafNodeType;
using IntLeaf = openvdb::Int32Tree::LeafNodeType;

/// The band on one side of the surface.
struct BandSide {
  bool asked = false;  ///< the band is widened here
  double width = 0;    ///< voxels
  float limit = 0;     ///< world units
};

/// Queries for the voxels of a leaf one after the other: each result bounds the search for the next.
class VoxelQueries {
 public:
  explicit VoxelQueries(const TriangleTree& tree) : tree_(tree) {}

  NearestTriangle operator()(const Eigen::Vector3d& p, double width) {
    // Distance changes by no more than the step between the points; the rest is for rounding.
    const double known = last_ + (p - at_).norm() + 1e-6;
    NearestTriangle found{width * width, TriangleTree::kNone};
    if (known < width) found = tree_.nearest(p, known * known);
    // Nothing is found for a bound beyond the width, or one that rounding made too small.
    if (found.triangle == TriangleTree::kNone) found = tree_.nearest(p, width * width);
    at_ = p;
    last_ = found.triangle == TriangleTree::kNone ? kFar : std::sqrt(found.squared);
    return found;
  }

 private:
  static constexpr double kFar = 1e300;
  const TriangleTree& tree_;
  Eigen::Vector3d at_ = Eigen::Vector3d::Zero();
  double last_ = kFar;
};

class Widening {
 public:
  Widening(const BoundaryTriangles& boundary, double voxel_size, const BandWidths& near,
           const BandWidths& wide, openvdb::FloatGrid& distance, openvdb::Int32Grid* nearest,
           RunContext& context)
      : boundary_(boundary),
        voxel_size_(voxel_size),
        tree_(boundary.points, boundary.triangles, 1.0 / voxel_size),
        distance_(distance),
        nearest_(nearest),
        context_(context) {
    sides_[0] = {wide.exterior > near.exterior, wide.exterior, float(wide.exterior * voxel_size)};
    sides_[1] = {wide.interior > near.interior, wide.interior, float(wide.interior * voxel_size)};
  }

  void run() {
    std::vector<FloatLeaf*> leaves;
    distance_.tree().getNodes(leaves);
    std::vector<std::unique_ptr<IntLeaf>> ids(leaves.size());
    for (const FloatLeaf* leaf : leaves) known_.insert(leaf->origin());
    // The triangles go to copies of their leaves: only one thread may add leaves to a tree, and all read it
    // here.
    parallel_blocks(leaves.size(), context_, [&](std::size_t i) {
      if (nearest_) ids[i] = ids_of(leaves[i]->origin());
      complete(*leaves[i], ids[i].get());
    });
    add_ids(ids);
    std::vector<Coord> around;
    for (const FloatLeaf* leaf : leaves) add_neighbours(leaf->origin(), around);
    // Ring by ring outwards and inwards, until a ring has no voxel in the band.
    while (!around.empty()) around = add_blocks(around);
  }

 private:
  const BandSide& side_of(float value) const { return sides_[value < 0 ? 1 : 0]; }

  std::unique_ptr<IntLeaf> ids_of(const Coord& origin) const {
    const IntLeaf* leaf = nearest_->tree().probeConstLeaf(origin);
    return leaf ? std::make_unique<IntLeaf>(*leaf) : std::make_unique<IntLeaf>(origin, -1, false);
  }

  void add_ids(std::vector<std::unique_ptr<IntLeaf>>& ids) {
    for (std::unique_ptr<IntLeaf>& leaf : ids)
      if (leaf && !leaf->isEmpty()) nearest_->tree().addLeaf(leaf.release());
  }

  /// Completes the inactive voxels of a leaf: they keep their sign, and get their distance within the band.
  /// Active ones are correct already.
  void complete(FloatLeaf& leaf, IntLeaf* ids) const {
    VoxelQueries query(tree_);
    for (openvdb::Index i = 0; i < FloatLeaf::SIZE; ++i) {
      const float before = leaf.getValue(i);
      const BandSide& side = side_of(before);
      if (leaf.isValueOn(i) || !side.asked) continue;
      const Coord at = leaf.offsetToGlobalCoord(i);
      const NearestTriangle found = query(Eigen::Vector3d(at.x(), at.y(), at.z()), side.width);
      const float value = float(std::sqrt(found.squared) * voxel_size_);
      const bool on = found.triangle != TriangleTree::kNone && value < side.limit;
      // Out of reach, the value is the new width.
      leaf.setValueOnly(i, std::copysign(on ? value : side.limit, before));
      leaf.setActiveState(i, on);
      if (ids && on) ids->setValueOn(i, boundary_.ids[found.triangle]);
    }
  }

  /// Appends the unvisited blocks around one that are on a widened side.
  void add_neighbours(const Coord& block, std::vector<Coord>& around) {
    for (int x = -8; x <= 8; x += 8)
      for (int y = -8; y <= 8; y += 8)
        for (int z = -8; z <= 8; z += 8) {
          const Coord at = block.offsetBy(x, y, z);
          if (side_of(distance_.tree().getValue(at)).asked && known_.insert(at).second) around.push_back(at);
        }
  }

  /// Makes leaves of blocks without one, and returns the blocks around those that have a voxel in the band. A
  /// block without a leaf lies on one side as a whole. The path from a voxel to the surface leads through
  /// blocks that touch each other and have a voxel in the band, so that none is missed.
  std::vector<Coord> add_blocks(const std::vector<Coord>& blocks) {
    std::vector<std::unique_ptr<FloatLeaf>> leaves(blocks.size());
    std::vector<std::unique_ptr<IntLeaf>> ids(blocks.size());
    parallel_blocks(blocks.size(), context_, [&](std::size_t i) {
      // The flood fill has signed the tiles.
      leaves[i] = std::make_unique<FloatLeaf>(blocks[i], distance_.tree().getValue(blocks[i]), false);
      if (nearest_) ids[i] = std::make_unique<IntLeaf>(blocks[i], -1, false);
      complete(*leaves[i], ids[i].get());
    });
    add_ids(ids);
    std::vector<Coord> around;
    for (std::size_t i = 0; i < blocks.size(); ++i) {
      // A block without a voxel in the band stays a tile.
      if (leaves[i]->isEmpty()) continue;
      distance_.tree().addLeaf(leaves[i].release());
      add_neighbours(blocks[i], around);
    }
    return around;
  }

  const BoundaryTriangles& boundary_;
  double voxel_size_;
  TriangleTree tree_;
  openvdb::FloatGrid& distance_;
  openvdb::Int32Grid* nearest_;
  RunContext& context_;
  BandSide sides_[2];      ///< exterior, interior
  std::set<Coord> known_;  ///< all visited blocks
};

}  // namespace

void widen_band(const BoundaryTriangles& boundary, double voxel_size, const BandWidths& near,
                const BandWidths& wide, openvdb::FloatGrid& distance, openvdb::Int32Grid* nearest,
                RunContext& context) {
  Widening(boundary, voxel_size, near, wide, distance, nearest, context).run();
}

}  // namespace hermesh
