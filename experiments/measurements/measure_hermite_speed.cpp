// How fast Hermite data are made and combined, beside OpenVDB's mesher on the same level set and the memory's
// own speed.
#include <openvdb/tools/VolumeToMesh.h>
#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <functional>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/core/parallel.h"
#include "algorithms/hermite/combine.h"
#include "algorithms/hermite/dense/dense_combine.h"
#include "algorithms/hermite/samplers.h"
#include "experiments/harness/run_cells.h"
#include "experiments/measure.h"
#include "experiments/measurements/measurements.h"
#include "experiments/pipeline.h"

namespace hermesh {
namespace {

/// Bytes a second of a[i] = b[i] + s c[i] over arrays that no cache holds, all threads: three streams. A
/// sweep before the one that is timed finds the pages again that a system has taken its tables of away since
/// the last: it is the memory's speed that is asked for, not what a contender before left behind.
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

/// Allocates and writes as many blocks of a dense grid's leaf's size: what it cannot be faster than.
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

/// The surface moved a tenth of its length further along x, by whole leaves and so on the same lattice.
PackedHermite shifted(PackedHermite hermite) {
  std::int32_t low = 0, high = 0;
  for (const SignLeaf& leaf : hermite.leaves)
    low = std::min(low, leaf.lower[0]), high = std::max(high, leaf.lower[0]);
  const std::int32_t shift = ((high - low) / 10) & ~7;
  for (SignLeaf& leaf : hermite.leaves) leaf.lower[0] += shift;
  return hermite;
}

/// Notes how long a contender took, and, if it moves bytes, how many times as long as the triad's bandwidth
/// would take.
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

/// Contenders of one race, with what their rows say besides. The memory's own speed runs along, for it
/// changes with what else the machine does.
class Race {
 public:
  Race(std::string table, int repetitions, Triad& triad)
      : table_(std::move(table)), repetitions_(repetitions) {
    add(
        "triad", [&triad] { return triad.run(); }, 0, Triad::kBytes, -1);
  }

  /// `compared_with`: number of the contender that its ratio names, or −1.
  int add(const std::string& label, std::function<double()> run, double items, double bytes,
          int compared_with) {
    labels_.push_back({label, items, bytes, compared_with});
    contenders_.push_back(
        {.run = std::move(run), .budget_seconds = 1e9, .repetitions = repetitions_, .seconds = {}});
    return int(labels_.size()) - 1;
  }
  std::vector<MeasuredRow> run() {
    for (Contender& contender : contenders_) contender.run();  // warms caches and pools
    race(contenders_);
    const std::vector<double>& triad = contenders_[0].seconds;
    const double bytes_a_second = Triad::kBytes / median(triad);
    std::vector<MeasuredRow> rows = {{"memory", triad_label(table_), {{"gigabytes", bytes_a_second / 1e9}}}};
    for (std::size_t i = 0; i < labels_.size(); ++i) {
      const Entry& entry = labels_[i];
      const double seconds = median(contenders_[i].seconds);
      MeasuredRow row{table_, entry.label};
      note_times(row, contenders_[i].seconds, entry.bytes, triad);
      if (entry.items > 0) row.values["ns"] = 1e9 * seconds / entry.items;
      if (entry.compared_with >= 0)
        row.values["ratio"] = median(contenders_[std::size_t(entry.compared_with)].seconds) / seconds;
      rows.push_back(std::move(row));
    }
    return rows;
  }

 private:
  struct Entry {
    std::string label;
    double items, bytes;
    int compared_with;
  };
  std::string table_;
  int repetitions_;
  std::vector<Entry> labels_;
  std::vector<Contender> contenders_;
};

void append_rows(std::vector<MeasuredRow>& rows, std::vector<MeasuredRow> more) {
  std::ranges::move(more, std::back_inserter(rows));
}

/// A conversion that moves so many bytes, and the memory, with 1, 2, 4, … threads: cores share the memory, so
/// that what arithmetic bounds with few of them comes close to the memory's speed with many.
std::vector<MeasuredRow> by_threads(const std::string& label, const std::function<double()>& conversion,
                                    double bytes, int repetitions, Triad& triad) {
  constexpr auto kThreads = tbb::global_control::max_allowed_parallelism;
  std::vector<std::size_t> counts;
  const std::size_t most = tbb::global_control::active_value(kThreads);
  for (std::size_t count = 1; count < most; count *= 2) counts.push_back(count);
  counts.push_back(most);
  std::vector<Contender> contenders;  // the memory by count, then the conversion
  for (const std::function<double()>& run :
       {std::function<double()>([&triad] { return triad.run(); }), conversion})
    for (const std::size_t count : counts) {
      const auto limited = [count, run] {
        const tbb::global_control limit(kThreads, count);
        return run();
      };
      contenders.push_back(
          {.run = limited, .budget_seconds = 1e9, .repetitions = repetitions, .seconds = {}});
    }
  for (Contender& contender : contenders) contender.run();  // warms caches and pools
  race(contenders);
  std::vector<MeasuredRow> rows;
  for (std::size_t i = 0; i < contenders.size(); ++i) {
    const std::size_t n = counts.size(), count = i % n;
    MeasuredRow row{"threads", i < n ? "triad" : label};
    row.values["threads"] = counts[count];
    note_times(row, contenders[i].seconds, i < n ? 0 : bytes, contenders[count].seconds);
    row.values["speedup"] = median(contenders[i - count].seconds) / median(contenders[i].seconds);
    rows.push_back(std::move(row));
  }
  return rows;
}

// Labels, table by table: a race is run whole if one of its rows is wanted.
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

std::vector<MeasuredRow> measure_hermite_speed(const MeasurementInput& input) {
  const bool memory = input.wants_any("memory", kMemory), threads = input.wants_any("threads", kThreads);
  const bool races_sampling =
      input.wants_any("sampling", kSampling) || input.wants("memory", triad_label("sampling"));
  const bool races_unions = input.wants_any("union", kUnion) || input.wants("memory", triad_label("union"));
  if (!memory && !threads && !races_sampling && !races_unions) return {};
  RunContext& context = input.context;
  const int repetitions = int(input.parameters.number("repetitions"));
  const LoadedCase model = input.tables.load(input.parameters.text("case"), context);
  const LevelSet level_set = voxelize(model.mesh,
                                      {.chosen = choose(input.tables.voxelizers, "hermesh"),
                                       .resolution = input.parameters.number("resolution")},
                                      context);
  Triad triad;
  constexpr NormalCodeId kCode = NormalCodeId::octahedral;
  const PackedHermite a = sample_level_set_packed(level_set, 0.0, kCode, context), b = shifted(a);
  const FixedDense dense_a = to_dense<FixedVoxel>(a, context), dense_b = to_dense<FixedVoxel>(b, context);
  const auto crossings = double(a.crossings.size());
  const double read = 2048.0 * double(level_set.grid().grid->tree().leafCount());
  const auto written = double(a.memory_bytes());
  const double more_as_floats = crossings * (sizeof(EdgeCrossing) - sizeof(PackedCrossing));
  const double dense_bytes = double(dense_a.memory_bytes());

  std::vector<MeasuredRow> rows = {{"memory", kMemory[0], {{"mebibytes", read / (1 << 20)}}}};
  rows.push_back({"memory", kMemory[1], {{"mebibytes", written / (1 << 20)}}});
  rows.push_back({"memory", kMemory[2], {{"mebibytes", dense_bytes / (1 << 20)}}});

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
  if (races_sampling) append_rows(rows, sampling.run());
  if (threads) append_rows(rows, by_threads(kThreads[1], sample_packed, read + written, repetitions, triad));

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
  if (races_unions) append_rows(rows, unions.run());
  return rows;
}

}  // namespace

Measurement hermite_speed_measurement() {
  const MeasuredColumn seconds{"seconds", "time [s]", "median"}, minimum{"minimum", "min [s]", "shortest"};
  const MeasuredColumn floor{"floor", "÷ bandwidth",
                             "median time divided by that in which the triad's bandwidth would read the "
                             "input and write the result once"};
  const MeasuredColumn floor_of_shortest{
      "floor_of_shortest", "of shortest",
      "the same with the shortest time of either, which other work on the machine disturbs less"};
  const std::vector<MeasuredColumn> columns = {
      seconds,
      minimum,
      {"ns", "ns/crossing", "median time an edge crossing of the input"},
      floor,
      floor_of_shortest,
      {"ratio", "times as fast",
       "as the peer: volumeToMesh at adaptivity 0, the write floor, or the way over floats"}};
  return {.name = "hermite-speed",
          .summary = "time to make Hermite data from a level set and to unite them",
          .parameters = {{"case", "bunny-closed", "model", case_choices()},
                         {"resolution", "800", "voxels along its longest side", {}, 8, 20000},
                         {"repetitions", "9", "of every contender, in turns", {}, 1, 1000}},
          .tables = {{"memory",
                      "what is moved, and how fast the memory is",
                      "what",
                      {{"gigabytes", "GB/s",
                        "bandwidth of a triad a = b + s c with all threads, in turns with the table's "
                        "contenders, median"},
                       {"mebibytes", "MiB", "bytes"}}},
                     {"sampling", "level set to Hermite data", "contender", columns},
                     {"threads",
                      "the conversion and the memory by number of threads",
                      "contender",
                      {{"threads", "threads", "how many; the triad's bandwidth is that of as many"},
                       seconds,
                       minimum,
                       floor,
                       floor_of_shortest,
                       {"speedup", "speedup", "times as fast as with one thread, by medians"}}},
                     {"union", "union of the model with itself moved by a tenth of its length", "contender",
                      columns}},
          .measure = measure_hermite_speed};
}

}  // namespace hermesh
