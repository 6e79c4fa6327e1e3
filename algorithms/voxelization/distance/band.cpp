#include "algorithms/voxelization/distance/band.h"

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <cstring>
#include <deque>
#include <numeric>
#include <utility>

#include "algorithms/core/parallel.h"
#include "algorithms/lattice/sample_side.h"

namespace hermesh {
namespace {

using kernels::Batch;
using kernels::kBatch;
using kernels::Kernels;

/// With more small triangles than this near a leaf's 512 voxels, a voxel searches its triangle; with fewer, a
/// triangle its voxels. At this number both take equally long, as measured.
constexpr std::size_t kManyTriangles = 1000;

/// Up to sixteen triangles that the kernels process together.
struct Pending {
  kernels::MeshCorners corners;
  std::int32_t id[kBatch];
  int count = 0;

  /// Appends triangle j of `from`, which is number `triangle` of the mesh.
  void add(const kernels::MeshCorners& from, int j, std::uint32_t triangle) {
    for (int i = 0; i < 9; ++i) corners.corner[i][count] = from.corner[i][j];
    id[count++] = std::int32_t(triangle);
  }
  /// Fills the unused lanes with copies of the first triangle, which change nothing.
  void fill() {
    for (int j = count; j < kBatch; ++j) {
      for (auto& row : corners.corner) row[j] = row[0];
      id[j] = id[0];
    }
  }
};

/// Fills a lane of the batch with a triangle's longest side, or with a point if all corners coincide.
void set_up_segment(const kernels::Corners& corners, int triangle, Batch& batch) {
  Eigen::Vector3d corner[3];
  for (int i = 0; i < 3; ++i)
    for (int axis = 0; axis < 3; ++axis) corner[i][axis] = corners.corner[3 * i + axis][triangle];
  int longest = 0;
  const auto side = [&](int i) -> Eigen::Vector3d { return corner[(i + 1) % 3] - corner[i]; };
  for (int i = 1; i < 3; ++i)
    if (side(i).squaredNorm() > side(longest).squaredNorm()) longest = i;
  const auto put = [&](int row, const Eigen::Vector3d& v) {
    for (int axis = 0; axis < 3; ++axis) batch.f[row + axis][triangle] = float(v[axis]);
  };
  const Eigen::Vector3d& start = corner[longest];
  const double length = side(longest).norm();
  const Eigen::Vector3d along =
      length > 0 ? Eigen::Vector3d(side(longest) / length) : Eigen::Vector3d(Eigen::Vector3d::UnitX());
  const Eigen::Vector3d normal = along.unitOrthogonal(), across = along.cross(normal);
  put(Batch::kHeight, normal);
  batch.f[Batch::kHeight + 3][triangle] = float(-normal.dot(start));
  for (int i = 0; i < 3; ++i) {
    const int edge = Batch::kEdge + Batch::kPerEdge * i;
    const double turn = i == 2 ? -1.0 : 1.0;
    put(edge, turn * across);
    batch.f[edge + 3][triangle] = float(-turn * across.dot(start));
    put(edge + Batch::kAlong, along);
    batch.f[edge + Batch::kLow][triangle] = float(along.dot(start));
    batch.f[edge + Batch::kHigh][triangle] = float(along.dot(start) + length);
  }
}

/// Computes one leaf at a time; its buffers serve the next. Each thread has its own.
class LeafWork {
 public:
  /// `without`: triangles to leave out, ascending; may be null.
  LeafWork(const IndexSoup& soup, const TriangleBins& bins, double reach, bool ids,
           const std::vector<std::uint32_t>* without = nullptr)
      : soup_(soup),
        bins_(bins),
        reach_(reach),
        ids_(ids),
        without_(without),
        kernels_(chosen_kernels<Kernels>()) {}

  /// Computes a block's values, active voxels and crossed edges; false when no voxel is within reach.
  bool run(const BlockAt& block, std::uint32_t number, float voxel_size, float* values, std::uint64_t* active,
           kernels::EdgeBits& crossed) {
    frame_ = {soup_.scale(), {block[0] * 8.0, block[1] * 8.0, block[2] * 8.0}};
    // Distances are those of the samples; sides, and so crossings, are those of their side_place()s.
    side_frame_ = frame_;
    for (std::size_t a = 0; a < 3; ++a) side_frame_.origin[a] += kSideShift[a];
    // Any start above reach² is correct, since finish() limits it. The bytes 0xff make every number −1, no
    // triangle.
    for (float& d : distances_.squared) d = float(reach_ * reach_) * 2.0f;
    if (ids_) std::memset(distances_.id, 0xff, sizeof distances_.id);
    crossed = {};
    crossed_ = &crossed;
    gather(block);
    // Searches from voxels use whole clusters, which may have triangles to leave out. Of equally near
    // triangles the first one stays the nearest; their order in the bins does not depend on the thread
    // schedule.
    if (triangles_ > kManyTriangles && !without_)
      look_from_voxels();
    else
      for (const TriangleBins::Cluster& cluster : clusters_) add(cluster.triangles);
    const std::span<const std::uint32_t> large = bins_.large(number);
    for (std::size_t i = 0; i < large.size(); i += kBatch)
      add(large.subspan(i, std::min<std::size_t>(kBatch, large.size() - i)));
    flush();
    flush_crossing();
    return kernels_.finish(distances_, float(reach_), voxel_size, values, active);
  }

  const kernels::Distances& distances() const { return distances_; }

 private:
  /// Squared distance in voxels from the box to the box of the block's samples.
  double gap2(const Bounds& box) const {
    double sum = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      const double gap =
          std::max({0.0, box.lower[a] - (frame_.origin[a] + 7.0), frame_.origin[a] - box.upper[a]});
      sum += gap * gap;
    }
    return sum;
  }

  /// Collects the clusters within reach of the block. Their spans are valid until the bins go to another
  /// slab.
  void gather(const BlockAt& block) {
    clusters_.clear();
    triangles_ = 0;
    bins_.for_each_cluster(block, [&](const TriangleBins::Cluster& cluster) {
      if (gap2(cluster.box) > reach_ * reach_) return;
      clusters_.push_back(cluster);
      triangles_ += cluster.triangles.size();
    });
  }

  /// Copies the corners of at most 16 triangles. Lanes beyond them are unchanged, and masked out later.
  void fetch(std::span<const std::uint32_t> triangles, kernels::MeshCorners& to) const {
    for (std::size_t j = 0; j < triangles.size(); ++j) {
      const Triangle t = soup_.triangle(triangles[j]);
      for (std::size_t c = 0; c < 3; ++c) {
        const Eigen::Vector3f& point = soup_.point(t[c]);
        for (int a = 0; a < 3; ++a) to.corner[3 * c + std::size_t(a)][j] = point[a];
      }
    }
  }

  /// Adds at most 16 triangles. Those that pass the box test are collected in `pending_` and `crossing_`
  /// until there are 16, so that the kernels work on full batches.
  void add(std::span<const std::uint32_t> triangles) {
    fetch(triangles, fetched_);
    const kernels::Near near = kernels_.near(fetched_, frame_, float(reach_));
    unsigned there = (2u << (triangles.size() - 1)) - 1;
    if (without_)
      for (std::size_t j = 0; j < triangles.size(); ++j)
        if (std::binary_search(without_->begin(), without_->end(), triangles[j])) there &= ~(1u << j);
    for (unsigned bits = near.within_reach & there; bits; bits &= bits - 1) {
      const int j = __builtin_ctz(bits);
      pending_.add(fetched_, j, triangles[std::size_t(j)]);
      if (pending_.count == kBatch) flush();
    }
    add_crossing(near.at_edges & there, triangles);
  }

  void add_crossing(unsigned bits, std::span<const std::uint32_t> triangles) {
    for (; bits; bits &= bits - 1) {
      const int j = __builtin_ctz(bits);
      crossing_.add(fetched_, j, triangles[std::size_t(j)]);
      if (crossing_.count == kBatch) flush_crossing();
    }
  }

  void flush() {
    if (pending_.count == 0) return;
    set_up(pending_, batch_);
    kernels_.update(batch_, pending_.count, float(reach_), ids_, distances_);
    pending_.count = 0;
  }

  void flush_crossing() {
    if (crossing_.count == 0) return;
    crossing_.fill();
    kernels_.to_leaf(crossing_.corners, side_frame_, corners_);
    kernels_.cross(corners_, crossing_.count, *crossed_);
    crossing_.count = 0;
  }

  /// Computes the linear functions of the pending triangles.
  void set_up(Pending& triangles, Batch& batch) {
    triangles.fill();
    std::memcpy(batch.id, triangles.id, sizeof batch.id);
    kernels_.to_leaf(triangles.corners, frame_, corners_);
    for (unsigned thin = kernels_.set_up(corners_, batch); thin; thin &= thin - 1)
      set_up_segment(corners_, __builtin_ctz(thin), batch);
  }

  /// Searches from each voxel among the clusters, whose batches are set up when first needed.
  void look_from_voxels() {
    boxes_.resize((clusters_.size() + kBatch - 1) / kBatch);
    for (std::size_t i = 0; i < boxes_.size() * kBatch; ++i) set_box(i);
    pointers_.assign(clusters_.size(), nullptr);
    // A deque does not move its batches when it grows.
    used_ = 0;
    const kernels::LazyBatches lazy{boxes_.data(), pointers_.data(), int(clusters_.size()), &prepare, this};
    kernels_.update_from_many(lazy, float(reach_), ids_, distances_);
    for (const TriangleBins::Cluster& cluster : clusters_) {
      // Edges are still found from the triangles; most clusters of tiny ones lie between the grid lines.
      // Being at an edge does not depend on the reach, so any reach is correct here.
      if (!meets_edges(cluster.box)) continue;
      fetch(cluster.triangles, fetched_);
      const unsigned there = (2u << (cluster.triangles.size() - 1)) - 1;
      add_crossing(kernels_.near(fetched_, frame_, 1.0f).at_edges & there, cluster.triangles);
    }
  }

  void set_box(std::size_t i) {
    kernels::Boxes& boxes = boxes_[i / kBatch];
    for (std::size_t a = 0; a < 3; ++a) {
      const bool there = i < clusters_.size();
      // The box is rounded outwards by far more than single precision's error at this range. The boxes that
      // fill up the last sixteen are so far away that none is ever near, and their squares are still finite.
      boxes.side[a][0][i % kBatch] =
          there ? float(clusters_[i].box.lower[a] - frame_.origin[a]) - 1e-5f : 1e18f;
      boxes.side[a][1][i % kBatch] =
          there ? float(clusters_[i].box.upper[a] - frame_.origin[a]) + 1e-5f : 1e18f;
    }
  }

  static const Batch* prepare(void* self, int i) {
    return static_cast<LeafWork*>(self)->prepare_batch(std::size_t(i));
  }

  const Batch* prepare_batch(std::size_t i) {
    if (used_ == pool_.size()) pool_.emplace_back();
    Batch& batch = pool_[used_++];
    const std::span<const std::uint32_t> triangles = clusters_[i].triangles;
    fetch(triangles, pending_.corners);
    std::copy(triangles.begin(), triangles.end(), pending_.id);
    pending_.count = int(triangles.size());
    set_up(pending_, batch);
    pending_.count = 0;
    return &batch;
  }

  /// Returns true if an edge of this leaf may intersect the box: an edge has integer coordinates on two axes,
  /// so that at least two of the box's sides must contain one. The margin of 1e-5 is wider than kSideShift.
  bool meets_edges(const Bounds& box) const {
    int across = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      const double low = box.lower[a] - frame_.origin[a] - 1e-5,
                   high = box.upper[a] - frame_.origin[a] + 1e-5;
      if (high < 0.0 || low > 8.0) return false;
      across += std::floor(high) >= std::ceil(low) ? 1 : 0;
    }
    return across >= 2;
  }

  const IndexSoup& soup_;
  const TriangleBins& bins_;
  double reach_;
  bool ids_;
  const std::vector<std::uint32_t>* without_;
  const Kernels& kernels_;
  kernels::LeafFrame frame_{}, side_frame_{};  ///< of the samples, and of the points that define their sides
  std::vector<TriangleBins::Cluster> clusters_;
  std::size_t triangles_ = 0;  ///< in the clusters
  kernels::Distances distances_;
  kernels::MeshCorners fetched_{};
  Pending pending_, crossing_;
  kernels::Corners corners_;
  Batch batch_;
  kernels::EdgeBits* crossed_ = nullptr;
  std::vector<kernels::Boxes> boxes_;
  std::vector<const Batch*> pointers_;
  std::deque<Batch> pool_;
  std::size_t used_ = 0;
};

/// Returns a leaf of OpenVDB with these values.
std::unique_ptr<FloatLeaf> make_leaf(const BlockAt& block, const float* values, const std::uint64_t* active) {
  auto leaf = std::make_unique<FloatLeaf>(
      openvdb::PartialCreate(), openvdb::Coord(block[0] * 8, block[1] * 8, block[2] * 8), 0.0f, false);
  leaf->buffer().allocate();
  std::memcpy(leaf->buffer().data(), values, 512 * sizeof(float));
  FloatLeaf::NodeMaskType mask;
  for (openvdb::Index x = 0; x < 8; ++x) mask.getWord<openvdb::Index64>(x) = active[x];
  leaf->setValueMask(mask);
  return leaf;
}

/// Calls f(block) for the blocks, in parallel, slab by slab of the bins, and reports progress between parts
/// of a slab. A task has few blocks: one of a fine mesh takes a good part of a millisecond.
template <class F>
void for_each_slab(TriangleBins& bins, const std::vector<BlockAt>& at, std::span<const std::uint32_t> blocks,
                   RunContext& context, F&& f) {
  std::vector<std::vector<std::uint32_t>> slabs(bins.slab_count());
  for (const std::uint32_t block : blocks) slabs[bins.slab_of(at[block])].push_back(block);
  const std::size_t part = std::max<std::size_t>(1024, blocks.size() / 64);
  std::size_t done = 0;
  for (std::size_t slab = 0; slab < slabs.size(); ++slab) {
    if (slabs[slab].empty()) continue;
    bins.go_to_slab(slab);
    for (std::size_t first = 0; first < slabs[slab].size(); first += part) {
      context.progress("distances", double(done + first) / double(blocks.size()));
      tbb::parallel_for(tbb::blocked_range<std::size_t>(first, std::min(slabs[slab].size(), first + part), 2),
                        [&](const auto& range) {
                          context.check();
                          for (std::size_t i = range.begin(); i != range.end(); ++i) f(slabs[slab][i]);
                        });
    }
    done += slabs[slab].size();
  }
  bins.forget_slabs();
}

/// Returns the nearest triangles in OpenVDB's order, from the kernels' order of 2×2×4 voxels.
LeafTriangles nearest_triangles(const kernels::Distances& distances) {
  LeafTriangles result;
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y)
      for (int z = 0; z < 8; ++z)
        result[std::size_t(x * 64 + y * 8 + z)] = distances.id[kernels::position(x, y, z)];
  return result;
}

}  // namespace

void find_leaves(const IndexSoup& soup, TriangleBins& bins, const BandWork& work, RunContext& context,
                 const std::function<void(const FoundLeaf&)>& found) {
  const std::vector<BlockAt> at = bins.blocks().blocks();
  std::vector<std::uint32_t> all;
  if (!work.blocks) {
    all.resize(at.size());
    std::iota(all.begin(), all.end(), 0u);
  }
  tbb::enumerable_thread_specific<LeafWork> works(
      [&] { return LeafWork(soup, bins, work.reach, work.nearest, work.without); });
  for_each_slab(bins, at, work.blocks ? *work.blocks : all, context, [&](std::uint32_t block) {
    LeafWork& of_thread = works.local();
    FoundLeaf leaf;
    leaf.block = block;
    leaf.any =
        of_thread.run(at[block], block, float(work.voxel_size), leaf.values, leaf.active, leaf.crossed);
    if (work.nearest && leaf.any) leaf.nearest = nearest_triangles(of_thread.distances());
    found(leaf);
  });
}

Band compute_band(const IndexSoup& soup, TriangleBins& bins, const BandWork& work, RunContext& context) {
  Band band;
  band.voxel_size = work.voxel_size;
  band.blocks = bins.blocks().blocks();
  band.leaves.resize(band.blocks.size());
  band.crossed.resize(band.blocks.size());
  if (work.nearest) band.nearest.resize(band.blocks.size());
  find_leaves(soup, bins, work, context, [&](const FoundLeaf& leaf) {
    band.crossed[leaf.block] = leaf.crossed;
    if (!leaf.any) return;
    band.leaves[leaf.block] = make_leaf(band.blocks[leaf.block], leaf.values, leaf.active);
    if (work.nearest) band.nearest[leaf.block] = std::make_unique<LeafTriangles>(leaf.nearest);
  });
  return band;
}

}  // namespace hermesh
