// Bytes of volumes, as they are allocated: tables 2.1 and 2.2 of the thesis, with sparse volumes beside them.
#include <malloc.h>

#include <optional>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/hermite/dense/dense_hermite.h"
#include "algorithms/hermite/samplers.h"
#include "algorithms/lattice/memory_estimate.h"
#include "experiments/harness/cell.h"
#include "experiments/harness/run_cells.h"
#include "experiments/measure.h"
#include "experiments/measurements/measurements.h"
#include "experiments/pipeline.h"

namespace hermesh {
namespace {

constexpr double kMiB = 1024.0 * 1024.0;

/// Resident bytes that `make` adds and keeps, as the kernel counts them, and what it made.
template <class Make>
auto resident(Make&& make, Json& mebibytes) {
  malloc_trim(0);
  const PeakMemory memory;
  auto made = make();
  const auto bytes = memory.bytes();
  mebibytes = bytes ? Json(double(*bytes) / kMiB) : Json(nullptr);
  return made;
}

/// The model, read when the first row asks for it.
class Model {
 public:
  explicit Model(const MeasurementInput& input) : input_(input) {}
  LevelSet level_set(double resolution) {
    if (!loaded_) loaded_ = input_.tables.load(input_.parameters.text("case"), input_.context);
    return voxelize(loaded_->mesh,
                    {.chosen = choose(input_.tables.voxelizers, "hermesh"), .resolution = resolution},
                    input_.context);
  }

 private:
  const MeasurementInput& input_;
  std::optional<LoadedCase> loaded_;
};

std::vector<MeasuredRow> uniform_rows(Model& model, const MeasurementInput& input) {
  // What the thesis printed for three floats a voxel.
  struct Printed {
    int width;
    double mebibytes;
  };
  std::vector<MeasuredRow> rows;
  for (const Printed& printed : {Printed{64, 3}, {128, 24}, {256, 192}, {512, 1536}, {1024, 12288}}) {
    input.context.check();
    MeasuredRow row{"uniform", std::to_string(printed.width) + "³"};
    if (!input.wants(row.table, row.label)) continue;
    row.values["printed"] = printed.mebibytes;
    const double bytes = 12.0 * printed.width * printed.width * printed.width;
    const std::optional<std::uint64_t> available = available_memory();
    if (printed.width <= input.parameters.number("largest_uniform") &&
        (!available || bytes < 0.8 * double(*available)))
      resident([&] { return std::vector<float>(std::size_t(bytes) / sizeof(float), 1.0f); },
               row.values["uniform"]);
    const LevelSet level_set = model.level_set(printed.width);
    row.values["level_set"] = double(level_set.memory_bytes()) / kMiB;
    const PackedHermite sparse =
        sample_level_set_packed(level_set, 0.0, NormalCodeId::octahedral, input.context);
    row.values["sparse"] = double(sparse.memory_bytes()) / kMiB;
    rows.push_back(std::move(row));
  }
  return rows;
}

/// What one representation takes.
struct Size {
  std::string label;
  Json printed;          ///< bytes a voxel in the thesis, where it says
  double bytes_a_voxel;  ///< of the type; 0 where there is no voxel
  std::size_t bytes;     ///< allocated, as the data structure counts them
  Json resident;         ///< MiB, as the kernel does
  std::size_t leaves;
};

MeasuredRow row_of_size(const Size& size, std::size_t band, std::size_t crossings) {
  MeasuredRow row{"representations", size.label};
  const auto bytes = double(size.bytes);
  if (!size.printed.is_null()) row.values["printed"] = size.printed;
  if (size.bytes_a_voxel > 0) row.values["type"] = size.bytes_a_voxel;
  row.values["mebibytes"] = bytes / kMiB;
  row.values["resident"] = size.resident;
  row.values["leaves"] = size.leaves;
  row.values["leaf"] = bytes / double(size.leaves);
  row.values["band"] = bytes / double(band);
  row.values["crossing"] = bytes / double(crossings);
  return row;
}

constexpr const char* kRepresentations[] = {"level set",
                                            "voxels, directed distances",
                                            "voxels, float Hermite",
                                            "voxels, quantised Hermite, thesis",
                                            "voxels, quantised Hermite, fixed",
                                            "sparse, float",
                                            "sparse, packed"};

template <class Voxel>
void add_dense_size(const std::string& label, const Json& printed, const FloatHermite& hermite,
                    const MeasurementInput& input, std::vector<Size>& sizes) {
  if (!input.wants("representations", label)) return;
  Size size{label, printed, double(sizeof(Voxel)), 0, {}, 0};
  const DenseHermite<Voxel> dense =
      resident([&] { return to_dense<Voxel>(hermite, input.context); }, size.resident);
  size.bytes = dense.memory_bytes();
  size.leaves = dense.leaves();
  sizes.push_back(size);
}

std::vector<MeasuredRow> representation_rows(Model& model, const MeasurementInput& input) {
  if (!input.wants_any("representations", kRepresentations)) return {};
  RunContext& context = input.context;
  const int resolution = int(input.parameters.number("resolution"));
  Size level_set_size{kRepresentations[0], 4, 4, 0, {}, 0};
  const LevelSet level_set = resident([&] { return model.level_set(resolution); }, level_set_size.resident);
  level_set_size.resident = nullptr;  // the voxelizer's own peak is in it
  level_set_size.bytes = level_set.memory_bytes();
  level_set_size.leaves = level_set.grid().grid->tree().leafCount();

  Size sparse_float{kRepresentations[5], nullptr, 0, 0, {}, 0},
      sparse{kRepresentations[6], nullptr, 0, 0, {}, 0};
  const FloatHermite hermite =
      resident([&] { return sample_level_set(level_set, 0.0, context); }, sparse_float.resident);
  sparse_float.bytes = hermite.memory_bytes();
  const PackedHermite packed =
      resident([&] { return pack(hermite, NormalCodeId::octahedral, context); }, sparse.resident);
  sparse.bytes = packed.memory_bytes();
  sparse_float.leaves = sparse.leaves = hermite.leaves.size();

  std::vector<Size> sizes = {level_set_size};
  add_dense_size<DirectedVoxel>(kRepresentations[1], 12, hermite, input, sizes);
  add_dense_size<FloatVoxel>(kRepresentations[2], 48, hermite, input, sizes);
  add_dense_size<ThesisVoxel>(kRepresentations[3], 10, hermite, input, sizes);
  add_dense_size<FixedVoxel>(kRepresentations[4], 10, hermite, input, sizes);
  sizes.insert(sizes.end(), {sparse_float, sparse});
  std::vector<MeasuredRow> rows;
  for (const Size& size : sizes)
    rows.push_back(row_of_size(size, level_set.active_voxels(), hermite.crossings.size()));
  return rows;
}

std::vector<MeasuredRow> measure_hermite_memory(const MeasurementInput& input) {
  Model model(input);
  std::vector<MeasuredRow> rows = uniform_rows(model, input);
  for (MeasuredRow& row : representation_rows(model, input)) rows.push_back(std::move(row));
  return rows;
}

}  // namespace

Measurement hermite_memory_measurement() {
  return {
      .name = "hermite-memory",
      .summary = "allocated bytes of uniform grids, level sets and Hermite data (tables 2.1 and 2.2)",
      .parameters =
          {{"case", "bunny-closed", "model whose level set and Hermite data are set beside them",
            case_choices()},
           {"resolution", "800", "voxels along its longest side", {}, 8, 20000},
           {"largest_uniform", "1024", "width of the largest uniform grid that is allocated", {}, 0, 4096}},
      .tables = {{"uniform",
                  "table 2.1: a uniform grid of three floats a voxel, and sparse volumes of the model at the "
                  "same width",
                  "voxels",
                  {{"printed", "printed [MiB]", "what the thesis says"},
                   {"uniform", "uniform [MiB]", "resident memory that the grid took"},
                   {"level_set", "level set [MiB]", "allocated by the model's narrow band"},
                   {"sparse", "sparse [MiB]", "allocated by its packed Hermite data"}}},
                 {"representations",
                  "table 2.2: representations of one surface",
                  "representation",
                  {{"printed", "printed [B]", "bytes a voxel that the thesis says"},
                   {"type", "type [B]", "bytes of the voxel's type"},
                   {"mebibytes", "allocated [MiB]", "by the data structure's own count"},
                   {"resident", "resident [MiB]", "that making it added, with what it needed on the way"},
                   {"leaves", "leaves", "blocks of 8³ samples that hold data"},
                   {"leaf", "B/leaf", "allocated bytes a leaf"},
                   {"band", "B/band voxel", "allocated bytes an active voxel of the level set"},
                   {"crossing", "B/crossing", "allocated bytes an edge crossing"}}}},
      .measure = measure_hermite_memory};
}

}  // namespace hermesh
