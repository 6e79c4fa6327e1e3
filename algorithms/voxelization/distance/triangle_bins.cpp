#include "algorithms/voxelization/distance/triangle_bins.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "algorithms/core/parallel.h"

namespace hermesh {
namespace {

/// A triangle whose box is longer than this, in voxels, is large, and filed under every block that it comes
/// near.
constexpr double kLargest = 4.0;
/// The intended number of triangles of a slab, and the most slabs: few enough triangles that the clusters of
/// three slabs are small compared with the volume, few enough slabs that each keeps all threads busy.
constexpr std::size_t kInSlab = 1 << 16;
constexpr std::size_t kMostSlabs = 16;
/// A thread whose queries come in any order keeps up to this many bins, or this many triangles.
constexpr std::size_t kCachedBins = 64, kCachedTriangles = 1 << 16;
/// Bins with more triangles than this are ordered by cells, which is faster and nearly as compact.
constexpr std::size_t kManyPieces = 256;

std::int32_t block_of(double voxel) { return static_cast<std::int32_t>(std::floor(voxel)) >> 3; }

BlockAt block_of_centre(const Bounds& box) {
  BlockAt block;
  for (int a = 0; a < 3; ++a) block[std::size_t(a)] = block_of(0.5 * (box.lower[a] + box.upper[a]));
  return block;
}

double gap(double low, double high, double from, double to) { return std::max({0.0, low - to, from - high}); }

/// Calls f(block) for the blocks of `within` with a voxel nearer than `reach` to the box.
template <class F>
void for_each_block_near(const Bounds& box, double reach, const BoundsOf<std::int32_t>& within, F&& f) {
  BlockAt from, to;
  for (int a = 0; a < 3; ++a) {
    // Only samples count, so the first block is that of the first sample within reach.
    from[a] = std::max(within.lower[a], block_of(std::ceil(box.lower[a] - reach)));
    to[a] = std::min(within.upper[a], block_of(std::floor(box.upper[a] + reach)));
  }
  const auto gap2 = [&](int axis, std::int32_t b) {
    const double g = gap(box.lower[axis], box.upper[axis], 8.0 * b, 8.0 * b + 7.0);
    return g * g;
  };
  for (std::int32_t x = from[0]; x <= to[0]; ++x)
    for (std::int32_t y = from[1]; y <= to[1]; ++y) {
      const double gap_xy = gap2(0, x) + gap2(1, y);
      if (gap_xy > reach * reach) continue;
      for (std::int32_t z = from[2]; z <= to[2]; ++z)
        if (gap_xy + gap2(2, z) <= reach * reach) f(BlockAt{x, y, z});
    }
}

/// A conservative test if a block has a voxel within reach of a triangle, by separating axes: the triangle's
/// normal and the outward normals of its edges. Any directions are correct: if the corners lie on a line
/// except for rounding, the normal is noise, and the test only accepts more blocks.
class TriangleSlab {
 public:
  explicit TriangleSlab(const TriangleCorners& c) {
    const Eigen::Map<const Eigen::Vector3d> p0(c.data()), p1(c.data() + 3), p2(c.data() + 6);
    const Eigen::Vector3d normal = (p1 - p0).cross(p2 - p0);
    const auto add = [&](const Eigen::Vector3d& direction) {
      if (!(direction.squaredNorm() > 0)) return;
      const Eigen::Vector3d n = direction.normalized();
      const double along[3] = {n.dot(p0), n.dot(p1), n.dot(p2)};
      normal_[count_] = n;
      lowest_[count_] = std::min({along[0], along[1], along[2]});
      highest_[count_] = std::max({along[0], along[1], along[2]});
      // Half the extent of a block's voxels along the normal, and some for rounding.
      radius_[count_] = 3.5 * n.cwiseAbs().sum() + 1e-6;
      ++count_;
    };
    add(normal);
    for (const auto& [a, b] : {std::pair(p0, p1), std::pair(p1, p2), std::pair(p2, p0)})
      add((b - a).cross(normal));
  }
  bool near(const BlockAt& block, double reach) const {
    const Eigen::Vector3d centre(block[0] * 8.0 + 3.5, block[1] * 8.0 + 3.5, block[2] * 8.0 + 3.5);
    for (int i = 0; i < count_; ++i) {
      const double at = normal_[i].dot(centre);
      if (std::max(at - highest_[i], lowest_[i] - at) > reach + radius_[i]) return false;
    }
    return true;
  }

 private:
  Eigen::Vector3d normal_[4];
  double lowest_[4], highest_[4], radius_[4];
  int count_ = 0;
};

/// Pieces of the work whose number depends only on its size, so that every thread count gives the same
/// result.
struct Chunks {
  std::size_t items, size, count;
  explicit Chunks(std::size_t n, std::size_t smallest = 8192)
      : items(n), size(std::max(smallest, (n + 63) / 64)), count((n + size - 1) / size) {}
  std::size_t begin(std::size_t chunk) const { return chunk * size; }
  std::size_t end(std::size_t chunk) const { return std::min(items, (chunk + 1) * size); }
};

template <class F>
void parallel_chunks(const Chunks& chunks, const RunContext& context, F&& f) {
  tbb::parallel_for(std::size_t(0), chunks.count, [&](std::size_t chunk) {
    context.check();
    f(chunk);
  });
}

/// The centre of a triangle's box.
struct Centre {
  Eigen::Vector3f at;  ///< twice the centre, in world units
  std::uint32_t triangle;
};

/// Orders triangles so that each sixteen in a row are close together, by halving the longest side
/// recursively.
void make_compact(std::span<Centre> centres) {
  while (centres.size() > kClusterSize) {
    Eigen::Vector3f low = centres[0].at, high = low;
    for (const Centre& c : centres) {
      low = low.cwiseMin(c.at);
      high = high.cwiseMax(c.at);
    }
    int axis = 0;
    (high - low).maxCoeff(&axis);
    // Whole clusters on the lower side.
    const std::size_t half = (centres.size() / 2 + kClusterSize - 1) / kClusterSize * kClusterSize;
    // Equal centres are ordered by number, so that the result is unique.
    std::nth_element(centres.begin(), centres.begin() + std::ptrdiff_t(half), centres.end(),
                     [&](const Centre& a, const Centre& b) {
                       return a.at[axis] != b.at[axis] ? a.at[axis] < b.at[axis] : a.triangle < b.triangle;
                     });
    make_compact(centres.first(half));
    centres = centres.subspan(half);
  }
}

/// Orders many triangles along the Morton curve through cells of half a voxel, by a counting sort, in linear
/// time. Fills `sorted`.
void sort_by_cell(const std::vector<Centre>& centres, const BlockAt& block, double scale,
                  std::vector<std::uint32_t>& cell, std::vector<Centre>& sorted) {
  constexpr int kBits = 4;
  std::vector<std::uint32_t> next((1 << 3 * kBits) + 1, 0);
  cell.resize(centres.size());
  for (std::size_t i = 0; i < centres.size(); ++i) {
    std::uint32_t key = 0;
    for (int a = 0; a < 3; ++a) {
      const double place = 0.5 * double(centres[i].at[a]) * scale - 8.0 * block[std::size_t(a)];
      const std::uint32_t c = std::uint32_t(std::clamp(place * 2.0, 0.0, 15.0));
      for (int bit = 0; bit < kBits; ++bit) key |= (c >> bit & 1u) << (3 * bit + a);
    }
    cell[i] = key;
    ++next[key + 1];
  }
  for (std::size_t c = 1; c < next.size(); ++c) next[c] += next[c - 1];
  sorted.resize(centres.size());
  for (std::size_t i = 0; i < centres.size(); ++i) sorted[next[cell[i]]++] = centres[i];
}

/// Returns the packed size of a step between two numbers, in bytes of seven bits.
std::size_t packed_size(std::uint32_t step) {
  std::size_t bytes = 1;
  for (; step >= 128; step >>= 7) ++bytes;
  return bytes;
}

/// Writes a step at `at`, and advances `at`.
void write_packed(std::uint32_t step, std::uint8_t*& at) {
  for (; step >= 128; step >>= 7) *at++ = std::uint8_t(step | 128);
  *at++ = std::uint8_t(step);
}

/// Returns the box as BinBounds, rounded outwards by truncation and the added 1. A small triangle lies well
/// within 0 to 255; the clamp is only a guard.
BinBounds in_sixteenths(const Bounds& box, const BlockAt& bin) {
  BinBounds result;
  for (int a = 0; a < 3; ++a) {
    const double start = 8.0 * bin[std::size_t(a)] - 3.0;
    result.lower[a] = std::uint8_t(std::clamp(16.0 * (box.lower[a] - start), 0.0, 255.0));
    result.upper[a] = std::uint8_t(std::clamp(16.0 * (box.upper[a] - start) + 1.0, 0.0, 255.0));
  }
  return result;
}

Bounds from_sixteenths(const BinBounds& box, const BlockAt& bin) {
  Bounds result;
  for (int a = 0; a < 3; ++a) {
    const double start = 8.0 * bin[std::size_t(a)] - 3.0;
    result.lower[a] = start + box.lower[a] / 16.0;
    result.upper[a] = start + box.upper[a] / 16.0;
  }
  return result;
}

/// The triangles of a bin in one piece of the work.
struct BinRun {
  explicit BinRun(std::uint32_t of_bin) : code(of_bin) {}
  std::uint32_t code;  ///< of the bin in the piece's set
  BinBounds box;
  std::uint32_t count = 0, first = 0, last = 0;  ///< triangles
  std::uint64_t bytes = 0;  ///< packed size of all except the first; later, their position
};

/// Numbers for the codes of a set, in the order of their first use.
class CodeNumbers {
 public:
  /// Returns the code's number, which is `next` if it has none.
  std::uint32_t operator()(std::uint32_t code, std::uint32_t next) {
    if (code >= numbers_.size()) numbers_.resize((code | 511) + 1, BlockTable::kNone);
    if (numbers_[code] == BlockTable::kNone) numbers_[code] = next;
    return numbers_[code];
  }

 private:
  std::vector<std::uint32_t> numbers_;
};

}  // namespace

/// The result of a first pass over the triangles, by piece of the work.
struct TriangleBins::Survey {
  std::vector<BlockSet> bins;  ///< of small triangles
  std::vector<std::vector<BinRun>> runs;
};

Bounds TriangleBins::bin_box(std::uint32_t bin) const {
  return from_sixteenths(box_of_bin_[bin], bin_at_[bin]);
}

bool TriangleBins::is_large(const Bounds& box) {
  double longest = 0;
  for (int a = 0; a < 3; ++a) longest = std::max(longest, box.upper[a] - box.lower[a]);
  return longest > kLargest;
}

TriangleBins::TriangleBins(const IndexSoup& soup, double reach, RunContext& context)
    : TriangleBins(soup, reach, context, BoundsOf<std::int32_t>::unbounded()) {}

TriangleBins::TriangleBins(const IndexSoup& soup, double reach, RunContext& context,
                           const BoundsOf<std::int32_t>& within)
    : soup_(soup),
      context_(context),
      reach_(reach),
      rings_(int(std::ceil((reach + 0.5 * kLargest) / 8.0))) {
  Survey found = survey();
  choose_blocks(found, within);
  pack(found);
  choose_slabs();
  if (slabs_.size() == 1) go_to_slab(0);
}

TriangleBins::Survey TriangleBins::survey() {
  const Chunks chunks(soup_.size());
  Survey found;
  found.bins.resize(chunks.count);
  found.runs.resize(chunks.count);
  all_large_.resize(chunks.count);
  parallel_chunks(chunks, context_, [&](std::size_t chunk) {
    // A chunk writes to its own runs and list of large triangles, and has its own numbers of bins until the
    // sets are merged.
    std::vector<BinRun>& runs = found.runs[chunk];
    CodeNumbers numbers;
    for (std::uint32_t t = std::uint32_t(chunks.begin(chunk)); t < chunks.end(chunk); ++t) {
      const Bounds box = in_voxels(box_of(t));
      if (is_large(box)) {
        all_large_[chunk].push_back(t);
        continue;
      }
      const BlockAt block = block_of_centre(box);
      const std::uint32_t code = found.bins[chunk].insert(block);
      const std::uint32_t number = numbers(code, std::uint32_t(runs.size()));
      if (number == runs.size()) runs.emplace_back(code);
      BinRun& run = runs[number];
      run.box.add(in_sixteenths(box, block));
      // The step to the first number of a run comes from an earlier chunk; see pack().
      if (run.count++ == 0)
        run.first = t;
      else
        run.bytes += packed_size(t - run.last);
      run.last = t;
    }
  });
  bins_ = BlockTable(found.bins);
  bin_at_ = bins_.blocks();
  return found;
}

/// Packs the triangles' numbers by bin. Computes the boxes again: for ten million triangles they would take
/// more memory than the volume.
void TriangleBins::pack(Survey& survey) {
  const std::size_t bins = bins_.size();
  first_byte_.assign(bins + 1, 0);
  count_.assign(bins, 0);
  box_of_bin_.assign(bins, {});
  // One thread visits the chunks in order: each run gets the position of its bytes within its bin, and the
  // number before its first step.
  std::vector<std::uint32_t> before(bins, 0);  // the last triangle so far
  for (std::size_t chunk = 0; chunk < survey.runs.size(); ++chunk) {
    const std::vector<std::uint32_t> translation = bins_.translation(survey.bins[chunk]);
    for (BinRun& run : survey.runs[chunk]) {
      const std::uint32_t bin = bins_.number(translation, run.code);
      const std::uint64_t size = run.bytes + packed_size(run.first - before[bin]);
      run.bytes = std::exchange(first_byte_[bin], first_byte_[bin] + size);
      count_[bin] += run.count;
      box_of_bin_[bin].add(run.box);
      run.first = std::exchange(before[bin], run.last);
    }
  }
  std::uint64_t total = 0;
  for (std::uint64_t& bytes : first_byte_) total += std::exchange(bytes, total);
  packed_.resize(total);
  const Chunks chunks(soup_.size());
  parallel_chunks(chunks, context_, [&](std::size_t chunk) {
    std::vector<BinRun>& runs = survey.runs[chunk];
    const std::vector<std::uint32_t> translation = bins_.translation(survey.bins[chunk]);
    // Each run has its own range of bytes.
    std::vector<std::uint8_t*> to;
    CodeNumbers numbers;
    for (const BinRun& run : runs) {
      numbers(run.code, std::uint32_t(to.size()));
      to.push_back(packed_.data() + first_byte_[bins_.number(translation, run.code)] + run.bytes);
    }
    for (std::uint32_t t = std::uint32_t(chunks.begin(chunk)); t < chunks.end(chunk); ++t) {
      const Bounds box = in_voxels(box_of(t));
      if (is_large(box)) continue;
      const std::uint32_t run = numbers(survey.bins[chunk].insert(block_of_centre(box)), 0);
      write_packed(t - std::exchange(runs[run].first, t), to[run]);
    }
    runs = {};
  });
}

/// Cuts space into slabs: across x unless another side is much longer, for blocks are numbered along x first,
/// so that queries in their order stay in a slab for long.
void TriangleBins::choose_slabs() {
  place_.resize(bins_.size());
  std::array<std::map<std::int32_t, std::size_t>, 3> layers;  // how many triangles
  for (std::size_t bin = 0; bin < bins_.size(); ++bin)
    for (std::size_t a = 0; a < 3; ++a) layers[a][bin_at_[bin][a]] += count_[bin];
  for (std::size_t a = 1; a < 3; ++a)
    if (layers[a].size() > 2 * layers[axis_].size()) axis_ = a;
  std::size_t left = 0, filed = 0;
  for (const auto& [layer, count] : layers[axis_]) left += count;
  const std::size_t share = std::max(kInSlab, (left + kMostSlabs - 1) / kMostSlabs);
  std::int32_t begin = left == 0 ? 0 : layers[axis_].begin()->first;
  for (const auto& [layer, count] : layers[axis_]) {
    filed += count;
    left -= count;
    // A slab is at least as thick as triangles reach, so only its neighbours matter to it.
    if (left == 0 || filed < share || layer + 1 - begin < rings_) continue;
    slabs_.push_back({.end = begin = layer + 1, .bins = {}, .files = {}});
    filed = 0;
  }
  // The last slab has no end, so that slab_of() is defined for every block.
  slabs_.push_back({.end = std::numeric_limits<std::int32_t>::max(), .bins = {}, .files = {}});
  for (std::uint32_t bin = 0; bin < bins_.size(); ++bin) {
    std::vector<std::uint32_t>& bins = slabs_[slab_of(bin_at_[bin])].bins;
    place_[bin] = std::uint32_t(bins.size());
    bins.push_back(bin);
  }
}

/// Finds the blocks near any triangle, and files the large triangles under theirs.
void TriangleBins::choose_blocks(const Survey& survey, const BoundsOf<std::int32_t>& within) {
  const std::size_t chunks = survey.bins.size();
  std::vector<BlockSet> sets(2 * chunks);
  std::vector<Pairs> pairs(chunks);
  tbb::parallel_for(std::size_t(0), chunks, [&](std::size_t chunk) {
    for (const BinRun& run : survey.runs[chunk]) {
      context_.check();
      // The box of a run gives a few blocks too many, in far less time than those of its triangles.
      for_each_block_near(from_sixteenths(run.box, survey.bins[chunk].block(run.code)), reach_, within,
                          [&](const BlockAt& block) { sets[chunk].insert(block); });
    }
    pairs[chunk] = file_large(all_large_[chunk], within, sets[chunks + chunk]);
  });
  blocks_ = BlockTable(sets);
  first_large_.assign(blocks_.size() + 1, 0);
  for (std::size_t chunk = 0; chunk < chunks; ++chunk) {
    const std::vector<std::uint32_t> translation = blocks_.translation(sets[chunks + chunk]);
    // Count, scan, fill; replaces a block's code in its set by its number in the table, too.
    for (auto& [block, triangle] : pairs[chunk]) ++first_large_[block = blocks_.number(translation, block)];
  }
  std::uint64_t total = 0;
  for (std::uint64_t& count : first_large_) total += std::exchange(count, total);
  large_.resize(total);
  std::vector<std::uint64_t> next(first_large_.begin(), first_large_.end() - 1);
  // Chunks in their order, so that the triangles of a block ascend.
  for (Pairs& chunk : pairs) {
    for (const auto& [block, triangle] : chunk) large_[next[block]++] = triangle;
    chunk = {};
  }
  all_large_ = {};
}

/// Returns the blocks near each large triangle, as codes of `blocks`, to which they are added.
TriangleBins::Pairs TriangleBins::file_large(const std::vector<std::uint32_t>& triangles,
                                             const BoundsOf<std::int32_t>& within,
                                             BlockSet& blocks) const {
  Pairs pairs;
  for (const std::uint32_t t : triangles) {
    context_.check();
    const TriangleSlab slab(soup_.corners(t));
    for_each_block_near(in_voxels(box_of(t)), reach_, within, [&](const BlockAt& block) {
      if (slab.near(block, reach_)) pairs.emplace_back(blocks.insert(block), t);
    });
  }
  return pairs;
}

// ---- Clusters.

std::size_t TriangleBins::slab_of(const BlockAt& block) const {
  std::size_t slab = 0;
  while (block[axis_] >= slabs_[slab].end && slab + 1 < slabs_.size()) ++slab;
  return slab;
}

void TriangleBins::go_to_slab(std::size_t slab) {
  for (std::size_t i = 0; i < slabs_.size(); ++i)
    // Advancing by one slab keeps two of three.
    if (i + 1 < slab || i > slab + 1) slabs_[i].files.reset();
  for (std::size_t i = slab == 0 ? 0 : slab - 1; i < std::min(slab + 2, slabs_.size()); ++i)
    if (!slabs_[i].files)
      slabs_[i].files = std::make_unique<Files>(make_files(slabs_[i].bins, Purpose::all_blocks));
}

void TriangleBins::forget_slabs() {
  if (slabs_.size() == 1) return;
  for (Slab& slab : slabs_) slab.files.reset();
}

std::size_t TriangleBins::bytes_in_memory() const {
  std::size_t bytes = packed_.size() + bins_.size() * (sizeof(BlockAt) + sizeof(BinBounds) + 16);
  for (const Slab& slab : slabs_)
    if (slab.files)
      bytes += 4 * slab.files->order.size() + sizeof(BoundsOf<float>) * slab.files->clusters.size();
  return bytes;
}

/// Returns the files of a bin for this thread only, made on its first query. They serve few queries, so the
/// triangles stay in the mesh's order, in which clusters are often compact, too.
const TriangleBins::Files& TriangleBins::own_files(std::uint32_t bin) const {
  std::unordered_map<std::uint32_t, Files>& cache = cache_.local();
  const auto known = cache.find(bin);
  if (known != cache.end()) return known->second;
  std::size_t triangles = 0;
  for (const auto& [other, files] : cache) triangles += files.order.size();
  if (cache.size() >= kCachedBins && triangles > kCachedTriangles) cache.clear();
  return cache.emplace(bin, make_files({bin}, Purpose::few_questions)).first->second;
}

/// Buffers for the sorting of one bin after the other by one thread.
struct TriangleBins::Sorter {
  std::vector<Centre> centres, sorted;
  std::vector<std::uint32_t> cells;
};

TriangleBins::Files TriangleBins::make_files(const std::vector<std::uint32_t>& bins, Purpose purpose) const {
  Files files;
  files.first.resize(bins.size() + 1);
  files.first_cluster.resize(bins.size() + 1);
  std::uint32_t triangles = 0, clusters = 0;
  for (std::size_t i = 0; i < bins.size(); ++i) {
    files.first[i] = triangles;
    files.first_cluster[i] = clusters;
    triangles += count_[bins[i]];
    clusters += (count_[bins[i]] + std::uint32_t(kClusterSize) - 1) / std::uint32_t(kClusterSize);
  }
  files.first.back() = triangles;
  files.first_cluster.back() = clusters;
  files.order.resize(triangles);
  files.clusters.resize(clusters);
  const auto some = [&](std::size_t begin, std::size_t end) {
    Sorter sorter;
    for (std::size_t i = begin; i < end; ++i) {
      context_.check();
      const std::span<std::uint32_t> of_bin(files.order.data() + files.first[i], count_[bins[i]]);
      unpack(bins[i], of_bin.data());
      if (purpose == Purpose::all_blocks) sort(bins[i], of_bin, sorter);
      enclose(of_bin, files.clusters.data() + files.first_cluster[i]);
    }
  };
  // The calling thread is probably one of many already.
  if (purpose == Purpose::few_questions) {
    some(0, bins.size());
    return files;
  }
  const Chunks chunks(bins.size(), 4);
  parallel_chunks(chunks, context_, [&](std::size_t chunk) { some(chunks.begin(chunk), chunks.end(chunk)); });
  return files;
}

/// Writes the numbers of a bin's triangles, ascending.
void TriangleBins::unpack(std::uint32_t bin, std::uint32_t* to) const {
  const std::uint8_t* at = packed_.data() + first_byte_[bin];
  std::uint32_t triangle = 0;
  for (std::uint32_t i = 0; i < count_[bin]; ++i) {
    int shift = 0;
    for (; *at & 128; shift += 7) triangle += std::uint32_t(*at++ & 127) << shift;
    triangle += std::uint32_t(*at++) << shift;
    *to++ = triangle;
  }
}

/// Orders the triangles of a bin so that each sixteen in a row are close together.
void TriangleBins::sort(std::uint32_t bin, std::span<std::uint32_t> triangles, Sorter& sorter) const {
  if (triangles.size() <= kClusterSize) return;
  std::vector<Centre>& centres = sorter.centres;
  centres.clear();
  for (const std::uint32_t t : triangles) {
    const BoundsOf<float> box = box_of(t);
    centres.push_back({box.lower + box.upper, t});
  }
  if (centres.size() > kManyPieces) {
    sort_by_cell(centres, bin_at_[bin], soup_.scale(), sorter.cells, sorter.sorted);
    centres.swap(sorter.sorted);
  } else {
    make_compact(centres);
  }
  std::transform(centres.begin(), centres.end(), triangles.begin(),
                 [](const Centre& c) { return c.triangle; });
}

/// Computes the boxes of each sixteen triangles, in the mesh's single precision, in which minima and maxima
/// are exact.
void TriangleBins::enclose(std::span<const std::uint32_t> triangles, BoundsOf<float>* clusters) const {
  for (std::size_t first = 0; first < triangles.size(); first += kClusterSize, ++clusters) {
    *clusters = box_of(triangles[first]);
    for (std::size_t i = first + 1; i < std::min(first + kClusterSize, triangles.size()); ++i)
      clusters->add(box_of(triangles[i]));
  }
}

}  // namespace hermesh
