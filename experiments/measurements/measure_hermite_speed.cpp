// Speed of making and combining Hermite data, compared with OpenVDB's mesher on the same level set and with
// the speed of the memory.
#include <openvdb/tools/VolumeToMesh.h>
#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/core/parallel.h"
#include "algorithms/hermite/combine.h"
#include "algorithms/hermite/samplers.h"
#include "algorithms/thesis/voxels/dense_hermite.h"
#include "experiments/measurements/measurements.h"

namespace hermesh {
namespace {

/// Times a[i] = b[i] + s c[i] over arrays that exceed all caches, with all threads: three streams. An untimed
/// sweep first restores page tables that the system dropped since the last one, so that the time is that of
/// the memory and does not depend on the previous contender.
class Triad {
 public:
  Triad() : a_(kSize), b_(kSize, 1.0f), c_(kSize, 2.0f) {}
  double run() {
    sweep();
    return timed([&] { sweep(); });
  }
  static constexpr double kBytes = 3.0 * sizeof(float) * (1 << 25);

 private:
  void sweep() {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, kSize, 1 << 16), [&](const auto& range) {
      for (std::size_t i = range.begin(); i < range.end(); ++i) a_[i] = b_[i] + 0.5f * c_[i];
    });
  }

  static constexpr std::size_t kSize = 1 << 25;
  std::vector<float> a_, b_, c_;
};

/// Allocates and writes the leaves of a dense grid: a lower bound of the time to make one.
double write_floor(std::size_t leaves, std::size_t bytes_a_leaf) {
  std::vector<std::unique_ptr<std::byte[]>> blocks(leaves);
  return timed([&] {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, leaves, 16), [&](const auto& range) {
      for (std::size_t i = range.begin(); i < range.end(); ++i) {
        blocks[i] = std::make_unique_for_overwrite<std::byte[]>(bytes_a_leaf);
        std::fill_n(blocks[i].get(), bytes_a_leaf, std::byte{1});
      }
    });
  });
}

double openvdb_mesh(const LevelSet& level_set) {
  std::vector<openvdb::Vec3s> points;
  std::vector<openvdb::Vec3I> triangles;
  std::vector<openvdb::Vec4I> quads;
  return timed(
      [&] { openvdb::tools::volumeToMesh(*level_set.grid().grid, points, triangles, quads, 0.0, 0.0); });
}

/// Adds the times of a contender and, if it moves bytes, their ratio to the time at the triad's bandwidth.
void note_times(MeasuredRow& row, const std::vector<double>& seconds, double bytes,
                const std::vector<double>& triad) {
  const double middle = median(seconds), shortest = std::ranges::min(seconds);
  row.values["seconds"] = middle;
  row.values["minimum"] = shortest;
  if (bytes == 0) return;
  row.values["floor"] = middle / median(triad) * Triad::kBytes / bytes;
  row.values["floor_of_shortest"] = shortest / std::ranges::min(triad) * Triad::kBytes / bytes;
}

std::string triad_label(const std::string& table) { return "triad, beside " + table; }

/// Interleaved contenders with the values of their rows, and the triad, since the speed of the memory depends
/// on the other load of the machine.
class Race {
 public:
  Race(std::string table, int repetitions, Triad& triad)
      : table_(std::move(table)), repetitions_(repetitions) {
    add(
        "triad", [&triad] { return triad.run(); }, 0, Triad::kBytes, -1);
  }

  /// `compared_with`: number of the contender of its ratio, or −1.
  int add(const std::string& label, std::function<double()> run, double items, double bytes,
          int compared_with) {
    entries_.push_back({label, items, bytes, compared_with});
    work_.push_back(std::move(run));
    return int(entries_.size()) - 1;
  }
  void run(std::vector<MeasuredRow>& rows) {
    const auto seconds = race(work_, repetitions_, 1e9, true);
    const double bytes_a_second = Triad::kBytes / median(seconds[0]);
    rows.push_back({"memory", triad_label(table_), {{"gigabytes", bytes_a_second / 1e9}}});
    for (std::size_t i = 0; i < entries_.size(); ++i) {
      const auto& [label, items, bytes, compared_with] = entries_[i];
      const double middle = median(seconds[i]);
      MeasuredRow row{table_, label};
      note_times(row, seconds[i], bytes, seconds[0]);
      if (items > 0) row.values["ns"] = 1e9 * middle / items;
      if (compared_with >= 0) row.values["ratio"] = median(seconds[std::size_t(compared_with)]) / middle;
      rows.push_back(std::move(row));
    }
  }

 private:
  struct Entry {
    std::string label;
    double items, bytes;
    int compared_with;
  };
  std::string table_;
  int repetitions_;
  std::vector<Entry> entries_;
  std::vector<std::function<double()>> work_;
};

/// Times a conversion that moves so many bytes, and the memory, with 1, 2, 4, … threads: cores share the
/// memory, so a conversion bounded by arithmetic with few of them approaches the memory's speed with many.
void time_by_threads(const std::string& label, const std::function<double()>& conversion, double bytes,
                     int repetitions, Triad& triad, std::vector<MeasuredRow>& rows) {
  const std::vector<std::size_t> counts = thread_counts();
  std::vector<std::function<double()>> work;  // the memory by count, then the conversion
  for (const std::function<double()>& run :
       {std::function<double()>([&triad] { return triad.run(); }), conversion})
    for (const std::size_t count : counts)
      work.push_back([count, run] {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, count);
        return run();
      });
  const auto seconds = race(work, repetitions, 1e9, true);
  for (std::size_t i = 0; i < seconds.size(); ++i) {
    const std::size_t n = counts.size(), count = i % n;
    MeasuredRow row{"threads", i < n ? "triad" : label};
    row.values["threads"] = counts[count];
    note_times(row, seconds[i], i < n ? 0 : bytes, seconds[count]);
    row.values["speedup"] = median(seconds[i - count]) / median(seconds[i]);
    rows.push_back(std::move(row));
  }
}

// Labels by table: all contenders of a table run if one of its rows is wanted.
constexpr const char* kMemory[] = {"level set, read", "sparse, written", "dense 10-byte voxels, written"};
constexpr const char* kSampling[] = {"triad",
                                     "openvdb volumeToMesh",
                                     "level set → sparse, packed",
                                     "level set → sparse, float",
                                     "dense 10-byte voxels, write floor",
                                     "sparse → dense 10-byte voxels"};
constexpr const char* kThreads[] = {kSampling[0], kSampling[2]};
constexpr const char* kUnion[] = {"triad", "sparse: unpack, unite, pack", "sparse: unite packed",
                                  "10-byte voxels: unpack to float voxels, unite, pack",
                                  "10-byte voxels: unite packed, operands kept"};

}  // namespace

PackedHermite shifted(PackedHermite hermite) {
  std::int32_t low = 0, high = 0;
  for (const SignLeaf& leaf : hermite.leaves)
    low = std::min(low, leaf.lower[0]), high = std::max(high, leaf.lower[0]);
  const std::int32_t shift = ((high - low) / 10) & ~7;
  for (SignLeaf& leaf : hermite.leaves) leaf.lower[0] += shift;
  return hermite;
}

std::vector<MeasuredRow> measure_hermite_speed(const MeasurementInput& input) {
  const bool memory = input.wants_any("memory", kMemory), threads = input.wants_any("threads", kThreads);
  const bool races_sampling =
      input.wants_any("sampling", kSampling) || input.wants("memory", triad_label("sampling"));
  const bool races_unions = input.wants_any("union", kUnion) || input.wants("memory", triad_label("union"));
  if (!memory && !threads && !races_sampling && !races_unions) return {};
  RunContext& context = input.context;
  const int repetitions = int(input.parameters.number("repetitions"));
  const LoadedCase model = input.tables.load(input.parameters.text("case"), context);
  const LevelSet level_set =
      voxelized(model.mesh, {.resolution = input.parameters.number("resolution")}, input);
  Triad triad;
  constexpr NormalCodeId kCode = NormalCodeId::octahedral;
  const PackedHermite a = sample_level_set_packed(level_set, 0.0, kCode, context), b = shifted(a);
  const FixedDense dense_a = to_dense<FixedVoxel>(a, context), dense_b = to_dense<FixedVoxel>(b, context);
  const auto crossings = double(a.crossings.size());
  const double read = 2048.0 * double(level_set.grid().grid->tree().leafCount());
  const auto written = double(a.memory_bytes());
  const double more_as_floats = crossings * (sizeof(EdgeCrossing) - sizeof(PackedCrossing));
  const double dense_bytes = double(dense_a.memory_bytes());

  std::vector<MeasuredRow> rows;
  for (const auto& [label, bytes] :
       {std::pair(kMemory[0], read), {kMemory[1], written}, {kMemory[2], dense_bytes}})
    rows.push_back({"memory", label, {{"mebibytes", bytes / (1 << 20)}}});

  Race sampling("sampling", repetitions, triad);
  const std::function<double()> sample_packed = [&] {
    return timed([&] { sample_level_set_packed(level_set, 0.0, kCode, context); });
  };
  const int peer = sampling.add(
      kSampling[1], [&] { return openvdb_mesh(level_set); }, crossings, 0, -1);
  sampling.add(kSampling[2], sample_packed, crossings, read + written, peer);
  sampling.add(
      kSampling[3], [&] { return timed([&] { sample_level_set(level_set, 0.0, context); }); }, crossings,
      read + written + more_as_floats, peer);
  const int floor = sampling.add(
      kSampling[4], [&] { return write_floor(dense_a.leaves(), FixedDense::bytes_per_leaf()); }, crossings,
      dense_bytes, peer);
  sampling.add(
      kSampling[5], [&] { return timed([&] { to_dense<FixedVoxel>(a, context); }); }, crossings, dense_bytes,
      floor);
  if (races_sampling) sampling.run(rows);
  if (threads) time_by_threads(kThreads[1], sample_packed, read + written, repetitions, triad, rows);

  Race unions("union", repetitions, triad);
  const int unpacked = unions.add(
      kUnion[1],
      [&] {
        return timed([&] {
          pack(combine(Boolean::unite, unpack(a, context), unpack(b, context), context), kCode, context);
        });
      },
      2 * crossings, 0, -1);
  unions.add(
      kUnion[2], [&] { return timed([&] { combine(Boolean::unite, a, b, context); }); }, 2 * crossings,
      3 * written, unpacked);
  const int dense_unpacked = unions.add(
      kUnion[3],
      [&] {
        return timed([&] {
          FloatDense x = to_dense<FloatVoxel>(to_sparse(dense_a, context), context);
          FloatDense y = to_dense<FloatVoxel>(to_sparse(dense_b, context), context);
          to_dense<FixedVoxel>(
              to_sparse(combine(Boolean::unite, std::move(x), std::move(y), context), context), context,
              kCode);
        });
      },
      2 * crossings, 0, -1);
  unions.add(
      kUnion[4], [&] { return timed([&] { combine(Boolean::unite, dense_a, dense_b, context); }); },
      2 * crossings, 3 * dense_bytes, dense_unpacked);
  if (races_unions) unions.run(rows);
  return rows;
}

}  // namespace hermesh
