// Allocated bytes of volumes: tables 2.1 and 2.2 of the thesis, compared with sparse volumes.
#include <malloc.h>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/hermite/samplers.h"
#include "algorithms/lattice/memory_estimate.h"
#include "algorithms/thesis/voxels/dense_hermite.h"
#include "experiments/measurements/measurements.h"

namespace hermesh {
namespace {

constexpr double kMiB = 1024.0 * 1024.0;

/// Returns the result of `make`, and sets the resident MiB that it added, as counted by the kernel.
template <class Make>
auto resident(Make&& make, Json& mebibytes) {
  malloc_trim(0);
  const PeakMemory memory;
  auto made = make();
  const auto bytes = memory.bytes();
  mebibytes = bytes ? Json(double(*bytes) / kMiB) : Json(nullptr);
  return made;
}

/// The model, read when the first row needs it.
class Model {
 public:
  explicit Model(const MeasurementInput& input) : input_(input) {}
  LevelSet level_set(double resolution) {
    if (!loaded_) loaded_ = input_.tables.load(input_.parameters.text("case"), input_.context);
    return voxelized(loaded_->mesh, {.resolution = resolution}, input_);
  }

 private:
  const MeasurementInput& input_;
  std::optional<LoadedCase> loaded_;
};

std::vector<MeasuredRow> uniform_rows(Model& model, const MeasurementInput& input) {
  std::vector<MeasuredRow> rows;
  // Published MiB of three floats per voxel.
  for (const auto& [width, mebibytes] :
       {std::pair(64, 3.0), {128, 24.0}, {256, 192.0}, {512, 1536.0}, {1024, 12288.0}}) {
    input.context.check();
    MeasuredRow row{"uniform", std::to_string(width) + "³"};
    if (!input.wants(row.table, row.label)) continue;
    row.values["printed"] = mebibytes;
    const double bytes = 12.0 * width * width * width;
    const std::optional<std::uint64_t> available = available_memory();
    if (width <= input.parameters.number("largest_uniform") &&
        (!available || bytes < 0.8 * double(*available)))
      resident([&] { return std::vector<float>(std::size_t(bytes) / sizeof(float), 1.0f); },
               row.values["uniform"]);
    const LevelSet level_set = model.level_set(width);
    row.values["level_set"] = double(level_set.memory_bytes()) / kMiB;
    const PackedHermite sparse =
        sample_level_set_packed(level_set, 0.0, NormalCodeId::octahedral, input.context);
    row.values["sparse"] = double(sparse.memory_bytes()) / kMiB;
    rows.push_back(std::move(row));
  }
  return rows;
}

/// The memory of one representation.
struct Size {
  std::string label;
  Json printed;          ///< published bytes per voxel, or null
  double bytes_a_voxel;  ///< of the type; 0 without voxels
  std::size_t bytes;     ///< allocated, as counted by the data structure
  Json resident;         ///< MiB, as counted by the kernel
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

}  // namespace

std::vector<MeasuredRow> measure_hermite_memory(const MeasurementInput& input) {
  Model model(input);
  std::vector<MeasuredRow> rows = uniform_rows(model, input);
  for (MeasuredRow& row : representation_rows(model, input)) rows.push_back(std::move(row));
  return rows;
}

}  // namespace hermesh
