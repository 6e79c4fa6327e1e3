#include "algorithms/lattice/memory_estimate.h"

#include <sys/resource.h>
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "algorithms/core/error.h"
#include "algorithms/lattice/block_table.h"

namespace hermesh {
namespace {

/// Bytes of a float leaf of 8³ voxels with its masks, and of the nodes of 16³ and 32³ children above it.
constexpr double kLeafBytes = 2152.0, kMiddleBytes = 33.8e3, kUpperBytes = 270e3;
/// OpenVDB's meshToVolume stores a closest-polygon index with each distance, and dilated copies of both: 3.2
/// to 3.5 times the finished grid, measured on four meshes at three resolutions each.
constexpr double kPeakOverGrid = 3.5;
/// OpenVDB's scale maps refuse a determinant below 3e-15, which is a voxel of 1.4423e-5.
constexpr double kSmallestVoxel = 1.4423e-5;
/// Largest accepted voxel coordinate, half of the range of 32-bit indices.
constexpr double kLargestIndex = 1 << 30;

std::string format(const char* pattern, double value) {
  char text[64];
  std::snprintf(text, sizeof text, pattern, value);
  return text;
}

std::string gibibytes(double bytes) { return format("%.3g GiB", bytes / (1024.0 * 1024.0 * 1024.0)); }

/// Items per task; constant, so that sums do not depend on the number of threads.
constexpr std::size_t kItemsPerTask = 1 << 16;

Bounds joined(Bounds a, const Bounds& b) {
  // A NaN of either is preserved.
  const auto pick = [](double x, double y, bool first) {
    return std::isnan(x) || (first && !std::isnan(y)) ? x : y;
  };
  for (int axis = 0; axis < 3; ++axis) {
    a.lower[axis] = pick(a.lower[axis], b.lower[axis], a.lower[axis] < b.lower[axis]);
    a.upper[axis] = pick(a.upper[axis], b.upper[axis], a.upper[axis] > b.upper[axis]);
  }
  return a;
}

/// Properties of the polygons.
struct Measured {
  Bounds box;       ///< bounds of the corners, relative to the mesh's origin; not finite if a corner is not
  double area = 0;  ///< square world units; NaN if a corner is
};

/// Accumulates bounds and area of triangles. Bounds are exact in single precision; the area is summed in
/// double precision.
class Measure {
 public:
  void add(const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& c) {
    low_ = low_.min(a.array()).min(b.array()).min(c.array());
    high_ = high_.max(a.array()).max(b.array()).max(c.array());
    const Eigen::Vector3d p = a.cast<double>();
    area_ += 0.5 * (b.cast<double>() - p).cross(c.cast<double>() - p).norm();
  }
  Measured result() const {
    // Comparisons ignore NaN, but the area includes every coordinate.
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const Eigen::Array3f high = std::isnan(area_) ? Eigen::Array3f::Constant(nan) : high_;
    return {{low_.matrix().cast<double>(), high.matrix().cast<double>()}, area_};
  }

 private:
  Eigen::Array3f low_ = Eigen::Array3f::Constant(std::numeric_limits<float>::infinity()), high_ = -low_;
  double area_ = 0;
};

Measured measure(const PolygonMesh& mesh) {
  const std::size_t triangles = mesh.triangles.size(), n = triangles + mesh.quads.size();
  std::vector<Measured> parts((n + kItemsPerTask - 1) / kItemsPerTask);
  tbb::parallel_for(std::size_t(0), parts.size(), [&](std::size_t part) {
    const std::size_t begin = part * kItemsPerTask, end = std::min(n, begin + kItemsPerTask);
    Measure measure;
    for (std::size_t i = begin; i < std::min(end, triangles); ++i) {
      const Triangle& t = mesh.triangles[i];
      measure.add(mesh.points[t[0]], mesh.points[t[1]], mesh.points[t[2]]);
    }
    for (std::size_t i = std::max(begin, triangles); i < end; ++i) {
      const Quad& q = mesh.quads[i - triangles];
      // The diagonal makes no difference to an estimate.
      measure.add(mesh.points[q[0]], mesh.points[q[1]], mesh.points[q[2]]);
      measure.add(mesh.points[q[0]], mesh.points[q[2]], mesh.points[q[3]]);
    }
    parts[part] = measure.result();
  });
  Measured all;
  for (const Measured& part : parts) {
    all.box = joined(all.box, part.box);
    all.area += part.area;
  }
  return all;
}

/// Returns the numbers of blocks of 8³, 128³ and 4096³ voxels that hold a point, including the few points
/// that no polygon uses.
std::array<double, 3> blocks_with_points(const PolygonMesh& mesh, double voxel_size) {
  std::vector<BlockSet> parts((mesh.points.size() + kItemsPerTask - 1) / kItemsPerTask);
  const double scale = 1.0 / (8.0 * voxel_size);
  tbb::parallel_for(std::size_t(0), parts.size(), [&](std::size_t part) {
    for (std::size_t i = part * kItemsPerTask; i < std::min(mesh.points.size(), (part + 1) * kItemsPerTask);
         ++i) {
      BlockAt block;
      for (int axis = 0; axis < 3; ++axis)
        // Clamped to the range of integers, since estimate_band() does not check it.
        block[std::size_t(axis)] = static_cast<std::int32_t>(
            std::floor(std::clamp(double(mesh.points[i][axis]) * scale, -kLargestIndex, kLargestIndex)));
      parts[part].insert(block);
    }
  });
  const BlockTable table(parts);
  // 16 blocks along an axis are 128 voxels, 512 are 4096: the widths of OpenVDB's two levels of nodes.
  std::vector<BlockSet> coarse(2);
  for (const BlockAt& block : table.blocks()) {
    coarse[0].insert({block[0] >> 4, block[1] >> 4, block[2] >> 4});
    coarse[1].insert({block[0] >> 9, block[1] >> 9, block[2] >> 9});
  }
  return {double(table.size()), double(BlockTable({coarse[0]}).size()),
          double(BlockTable({coarse[1]}).size())};
}

/// Inputs of estimates for blocks of any size.
struct BandSize {
  double surface;         ///< area in faces of voxels
  double thickness;       ///< thickness of the band, voxels
  Eigen::Vector3d sides;  ///< sides of the box around the band, voxels
};

/// Numbers of blocks of one size, as estimates.
struct Blocks {
  double along_surface, scattered, all;
};

/// Estimates the numbers of blocks. A plane layer of thickness t with unit normal n meets (e |n|₁ + t) / e³
/// blocks of edge e per unit of area, and |n|₁ is 3/2 on average over all directions. Blocks with points
/// beyond those explained by the area are small scattered pieces, each as large as a point's ball. The box is
/// the upper limit.
Blocks count_blocks(double with_points, const BandSize& layer, double edge) {
  const double volume = edge * edge * edge;
  // Blocks with points that the area explains: a layer without thickness (t = 0).
  const double bare = layer.surface * 1.5 * edge / volume;
  Blocks blocks;
  blocks.along_surface = layer.surface * (1.5 * edge + layer.thickness) / volume;
  blocks.scattered = std::max(0.0, with_points - bare);
  const double box = ((layer.sides / edge).array() + 1.0).prod();
  blocks.all =
      std::min(box, blocks.along_surface + blocks.scattered * std::pow(edge + layer.thickness, 3) / volume);
  return blocks;
}

std::optional<std::uint64_t> number_in(const std::string& path) {
  std::ifstream file(path);
  std::uint64_t value = 0;
  if (file >> value) return value;
  return std::nullopt;
}

/// Returns the value of the line "name[:] value" of a file such as /proc/meminfo.
std::optional<std::uint64_t> field_of(const std::string& path, const std::string& name) {
  std::ifstream file(path);
  std::string word;
  while (file >> word) {
    std::uint64_t value = 0;
    if (word == name || word == name + ":") {
      if (file >> value) return value;
      return std::nullopt;
    }
    file.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
  }
  return std::nullopt;
}

/// Returns the memory left in a control group: its limit minus its use, not counting page cache that can be
/// dropped.
std::optional<std::uint64_t> left_in_group(const std::string& limit_file, const std::string& usage_file,
                                           const std::string& stat_file, const std::string& cache_field) {
  const auto limit = number_in(limit_file);
  const auto usage = number_in(usage_file);
  if (!limit || !usage) return std::nullopt;
  const std::uint64_t cache = std::min(field_of(stat_file, cache_field).value_or(0), *usage);
  const std::uint64_t used = *usage - cache;
  return *limit > used ? *limit - used : 0;
}

/// Returns the memory left under a limit of this process; `use` is the line of /proc/self/status that counts
/// against it.
std::optional<std::uint64_t> left_of_limit(int resource, const std::string& use) {
  struct rlimit limit = {};
  if (getrlimit(static_cast<__rlimit_resource_t>(resource), &limit) != 0 || limit.rlim_cur == RLIM_INFINITY)
    return std::nullopt;
  const std::uint64_t used = 1024 * field_of("/proc/self/status", use).value_or(0);
  return limit.rlim_cur > used ? limit.rlim_cur - used : 0;
}

void check_arguments(double voxel_size, double exterior_band, double interior_band) {
  if (!std::isfinite(voxel_size) || voxel_size <= 0.0)
    throw Error("The voxel size must be a finite number above 0, not " + format("%g", voxel_size) + ".");
  if (voxel_size < kSmallestVoxel || voxel_size > double(std::numeric_limits<float>::max()))
    throw Error("A voxel size of " + format("%g", voxel_size) +
                " is outside of what OpenVDB's transforms take (1.45e-05 to 3.4e+38 world units): use larger "
                "voxels, or scale the mesh.");
  for (const double band : {exterior_band, interior_band})
    if (!std::isfinite(band) || band < 1.0)
      throw Error("A narrow band must be a finite number of voxels, at least 1, not " + format("%g", band) +
                  ".");
}

void check_coordinates(const PolygonMesh& mesh, const Bounds& box, double voxel_size, double band) {
  if (!mesh.origin.allFinite() || !box.lower.allFinite() || !box.upper.allFinite())
    throw Error("The mesh holds a coordinate that is not finite: repair it before voxelizing.");
  const double largest = std::max(box.lower.cwiseAbs().maxCoeff(), box.upper.cwiseAbs().maxCoeff());
  if (largest / voxel_size + band > kLargestIndex)
    throw Error("A voxel size of " + format("%g", voxel_size) + " puts the mesh at voxel coordinates up to " +
                format("%.3g", largest / voxel_size) +
                ", beyond the range of a grid (1.07e+09): use larger "
                "voxels.");
}

BandEstimate estimate(const PolygonMesh& mesh, const Measured& measured, double voxel_size,
                      double exterior_band, double interior_band) {
  // The band lies around the surface on both sides, plus one sample where its ends fall between samples.
  const double reach = 2.0 * std::max(exterior_band, interior_band) + 1.0;
  const BandSize layer{measured.area / voxel_size / voxel_size, exterior_band + interior_band,
                       measured.box.size() / voxel_size + Eigen::Vector3d::Constant(reach)};

  BandEstimate estimate;
  const auto [small, middle, large] = blocks_with_points(mesh, voxel_size);
  const Blocks leaves = count_blocks(small, layer, 8.0);
  estimate.leaves = leaves.all;
  // The least of three counts: the filled box, all samples of the leaves, and the band's own volume with
  // scattered pieces. A piece far below a voxel is a ball of the exterior band's radius.
  const double ball = 4.0 / 3.0 * std::numbers::pi * std::pow(exterior_band, 3);
  estimate.active_voxels = std::min(
      {layer.sides.prod(), 512.0 * leaves.all, layer.thickness * layer.surface + leaves.scattered * ball});
  // Eight upper nodes meet at the grid's origin, where most meshes lie.
  estimate.grid_bytes = kLeafBytes * leaves.all + kMiddleBytes * count_blocks(middle, layer, 128.0).all +
                        kUpperBytes * (8.0 + count_blocks(large, layer, 4096.0).all);
  estimate.peak_bytes = kPeakOverGrid * estimate.grid_bytes;
  return estimate;
}

}  // namespace

BandEstimate estimate_band(const PolygonMesh& mesh, double voxel_size, double exterior_band,
                           double interior_band) {
  return estimate(mesh, measure(mesh), voxel_size, exterior_band, interior_band);
}

std::optional<std::uint64_t> available_memory() {
  // In units of 1024 bytes.
  std::optional<std::uint64_t> available = field_of("/proc/meminfo", "MemAvailable");
  if (available) *available *= 1024;
  // Control groups of version 2, then of version 1, then this process's limits: the least of all that are
  // set.
  const std::string root = "/sys/fs/cgroup/";
  for (const auto& left :
       {left_in_group(root + "memory.max", root + "memory.current", root + "memory.stat", "inactive_file"),
        left_in_group(root + "memory/memory.limit_in_bytes", root + "memory/memory.usage_in_bytes",
                      root + "memory/memory.stat", "total_inactive_file"),
        left_of_limit(RLIMIT_AS, "VmSize"), left_of_limit(RLIMIT_DATA, "VmData")})
    if (left && (!available || *left < *available)) available = left;
  return available;
}

void check_fits_memory(double bytes, const std::string& what) {
  const std::optional<std::uint64_t> available = available_memory();
  if (available && bytes > double(*available))
    throw Error(what + " would need about " + gibibytes(bytes) + " of memory, and " +
                gibibytes(double(*available)) + " are available");
}

void check_voxelization_fits(const PolygonMesh& mesh, double voxel_size, double exterior_band,
                             double interior_band) {
  // In this order each check can rely on the previous ones.
  check_arguments(voxel_size, exterior_band, interior_band);
  if (mesh.empty()) throw Error("The mesh holds no polygon to voxelize.");
  const Measured measured = measure(mesh);
  check_coordinates(mesh, measured.box, voxel_size, std::max(exterior_band, interior_band));
  const BandEstimate estimated = estimate(mesh, measured, voxel_size, exterior_band, interior_band);
  const std::optional<std::uint64_t> available = available_memory();
  if (available && estimated.peak_bytes > double(*available))
    throw Error("A voxel size of " + format("%g", voxel_size) + " would need about " +
                gibibytes(estimated.peak_bytes) + " for " + format("%.3g", estimated.active_voxels) +
                " active voxels, and " + gibibytes(double(*available)) +
                " are available: use larger voxels or narrower bands.");
}

}  // namespace hermesh
