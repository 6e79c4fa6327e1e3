#include "algorithms/voxelization/band.h"

#include <tbb/enumerable_thread_specific.h>

#include <cstring>
#include <deque>

#include "algorithms/core/parallel.h"

namespace hermesh {
namespace {

using kernels::Batch;
using kernels::kBatch;
using kernels::Kernels;

/// With more small triangles than this near a leaf's 512 voxels, a voxel looks for its triangle; with fewer, a triangle
/// for its voxels. Where the two take equally long, measured.
constexpr std::size_t kMany = 1500;

/// One leaf at a time; its buffers serve the next.
class LeafWork {
 public:
  LeafWork(const IndexSoup& soup, const TriangleBins& bins, double reach, bool ids, const RunContext& context)
      : soup_(soup), bins_(bins), reach_(reach), ids_(ids), context_(context), kernels_(kernels::chosen()) {}

  /// False when no voxel is within reach.
  bool run(const BlockAt& block, std::uint32_t number, float voxel_size, float* values, std::uint64_t* active,
           kernels::EdgeBits& crossed) {
    origin_ = {block[0] * 8.0, block[1] * 8.0, block[2] * 8.0};
    for (float& d : distances_.squared) d = float(reach_ * reach_) * 2.0f;
    if (ids_) std::memset(distances_.id, 0xff, sizeof distances_.id);
    crossed = {};
    crossed_ = &crossed;
    gather(block);
    if (triangles_ > kMany)
      look_from_voxels();
    else
      for (const TriangleBins::Cluster& cluster : clusters_)
        for (const std::uint32_t t : cluster.triangles) add(t);
    for (const std::uint32_t t : bins_.large(number)) add(t);
    flush();
    return kernels_.finish(distances_, float(reach_), voxel_size, values, active);
  }

  const kernels::Distances& distances() const { return distances_; }

 private:
  double gap2(const VoxelBox& box) const {
    double sum = 0;
    for (int a = 0; a < 3; ++a) {
      const double gap = std::max({0.0, box.low[a] - (origin_[a] + 7.0), origin_[a] - box.high[a]});
      sum += gap * gap;
    }
    return sum;
  }

  void gather(const BlockAt& block) {
    clusters_.clear();
    triangles_ = 0;
    bins_.for_each_cluster(block, [&](const TriangleBins::Cluster& cluster) {
      if (gap2(cluster.box) > reach_ * reach_) return;
      clusters_.push_back(cluster);
      triangles_ += cluster.triangles.size();
    });
  }

  TriangleCorners local(std::uint32_t t) const {
    TriangleCorners c = soup_.corners(t);
    for (std::size_t i = 0; i < 9; ++i) c[i] -= origin_[i % 3];
    return c;
  }

  static double gap(double a, double b, double c, double length) {
    return std::max({0.0, std::min({a, b, c}) - length, -std::max({a, b, c})});
  }

  void put(const TriangleCorners& c, std::uint32_t t) {
    for (std::size_t i = 0; i < 9; ++i) corners_.corner[i][count_] = c[i];
    batch_.id[count_++] = std::int32_t(t);
  }

  /// A triangle looks for its voxels and edges, together with fifteen others.
  void add(std::uint32_t t) {
    const TriangleCorners c = local(t);
    const double x = gap(c[0], c[3], c[6], 7.0), y = gap(c[1], c[4], c[7], 7.0), z = gap(c[2], c[5], c[8], 7.0);
    if (x * x + y * y + z * z > reach_ * reach_) return;
    put(c, t);
    if (count_ == kBatch) flush();
  }

  void flush() {
    if (count_ == 0) return;
    set_up(corners_, count_, batch_);
    kernels_.update(batch_, count_, float(reach_), ids_, distances_);
    kernels_.cross(corners_, count_, *crossed_);
    count_ = 0;
  }

  void set_up(kernels::Corners& corners, int count, Batch& batch) const {
    for (int j = count; j < kBatch; ++j) {
      for (auto& row : corners.corner) row[j] = row[0];
      batch.id[j] = batch.id[0];
    }
    for (unsigned thin = kernels_.set_up(corners, batch); thin; thin &= thin - 1)
      kernels::set_up_segment(corners, __builtin_ctz(thin), batch);
  }

  void look_from_voxels() {
    boxes_.resize((clusters_.size() + kBatch - 1) / kBatch);
    for (std::size_t i = 0; i < boxes_.size() * kBatch; ++i) set_box(i);
    pointers_.assign(clusters_.size(), nullptr);
    used_ = 0;
    const kernels::LazyBatches lazy{boxes_.data(), pointers_.data(), int(clusters_.size()), &prepare, this};
    kernels_.update_from_many(lazy, float(reach_), ids_, distances_);
    for (const TriangleBins::Cluster& cluster : clusters_)
      if (meets_edges(cluster.box)) cross(cluster);
  }

  void set_box(std::size_t i) {
    kernels::Boxes& boxes = boxes_[i / kBatch];
    for (std::size_t a = 0; a < 3; ++a) {
      const bool there = i < clusters_.size();
      // Rounding outwards by far more than single precision's error at this range.
      boxes.side[a][0][i % kBatch] = there ? float(clusters_[i].box.low[a] - origin_[a]) - 1e-5f : 1e18f;
      boxes.side[a][1][i % kBatch] = there ? float(clusters_[i].box.high[a] - origin_[a]) + 1e-5f : 1e18f;
    }
  }

  static const Batch* prepare(void* self, int i) { return static_cast<LeafWork*>(self)->prepare_batch(std::size_t(i)); }

  const Batch* prepare_batch(std::size_t i) {
    if (used_ == pool_.size()) pool_.emplace_back();
    Batch& batch = pool_[used_++];
    fetch(clusters_[i], batch);
    set_up(corners_, int(clusters_[i].triangles.size()), batch);
    return &batch;
  }

  void fetch(const TriangleBins::Cluster& cluster, Batch& batch) {
    int j = 0;
    for (const std::uint32_t t : cluster.triangles) {
      const TriangleCorners c = local(t);
      for (std::size_t i = 0; i < 9; ++i) corners_.corner[i][j] = c[i];
      batch.id[j++] = std::int32_t(t);
    }
  }

  /// Whether an edge of this leaf may meet the box: at least two of its sides must reach across a whole number.
  bool meets_edges(const VoxelBox& box) const {
    int across = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      const double low = box.low[a] - origin_[a] - 1e-6, high = box.high[a] - origin_[a] + 1e-6;
      if (high < 0.0 || low > 8.0) return false;
      across += std::floor(high) >= std::ceil(low) ? 1 : 0;
    }
    return across >= 2;
  }

  void cross(const TriangleBins::Cluster& cluster) {
    fetch(cluster, batch_);
    kernels_.cross(corners_, int(cluster.triangles.size()), *crossed_);
  }

  const IndexSoup& soup_;
  const TriangleBins& bins_;
  double reach_;
  bool ids_;
  const RunContext& context_;
  const Kernels& kernels_;
  std::array<double, 3> origin_{};
  std::vector<TriangleBins::Cluster> clusters_;
  std::size_t triangles_ = 0;
  kernels::Distances distances_;
  kernels::Corners corners_;
  Batch batch_;
  int count_ = 0;
  kernels::EdgeBits* crossed_ = nullptr;
  std::vector<kernels::Boxes> boxes_;
  std::vector<const Batch*> pointers_;
  std::deque<Batch> pool_;
  std::size_t used_ = 0;
};

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

std::unique_ptr<LeafTriangles> nearest_triangles(const kernels::Distances& distances) {
  auto result = std::make_unique<LeafTriangles>();
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y)
      for (int z = 0; z < 8; ++z)
        (*result)[std::size_t(x * 64 + y * 8 + z)] = distances.id[kernels::position(x, y, z)];
  return result;
}

}  // namespace

Band compute_band(const IndexSoup& soup, const TriangleBins& bins, double reach, double voxel_size, bool nearest,
                  RunContext& context) {
  Band band;
  band.blocks = bins.blocks().blocks();
  const std::size_t n = band.blocks.size();
  band.leaves.resize(n);
  band.crossed.resize(n);
  if (nearest) band.nearest.resize(n);
  tbb::enumerable_thread_specific<LeafWork> works(
      [&] { return LeafWork(soup, bins, reach, nearest, context); });
  // A part at a time, so that this thread can report between them.
  const std::size_t part = std::max<std::size_t>(1024, n / 64);
  for (std::size_t first = 0; first < n; first += part) {
    context.progress("distances", double(first) / double(n));
    tbb::parallel_for(tbb::blocked_range<std::size_t>(first, std::min(n, first + part), 8), [&](const auto& range) {
      LeafWork& work = works.local();
      alignas(64) float values[512];
      std::uint64_t active[8];
      for (std::size_t i = range.begin(); i != range.end(); ++i) {
        context.check();
        if (!work.run(band.blocks[i], std::uint32_t(i), float(voxel_size), values, active, band.crossed[i])) continue;
        band.leaves[i] = make_leaf(band.blocks[i], values, active);
        if (nearest) band.nearest[i] = nearest_triangles(work.distances());
      }
    });
  }
  return band;
}

}  // namespace hermesh
