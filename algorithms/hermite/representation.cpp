#include "algorithms/hermite/representation.h"

#include "algorithms/core/run_context.h"
#include "algorithms/hermite/dense/dense_hermite.h"

namespace hermesh {
namespace {

/// Through a tree of voxels and back. Stages are timed apart, so that tables can tell writing from reading.
template <class Voxel>
void through_dense(const FloatHermite& hermite, NormalCodeId code, Represented& result, RunContext& context) {
  const DenseHermite<Voxel> dense = [&] {
    Stage stage(context, "store Hermite data");
    return to_dense<Voxel>(hermite, context, code);
  }();
  // The size is that of the tree with its nodes and tiles, as it is held in memory.
  result.bytes = dense.memory_bytes();
  Stage stage(context, "read Hermite data");
  result.hermite = to_sparse(dense, context, &result.lost);
}

}  // namespace

Representation parse_representation(const std::string& name) {
  // The names are those of the option `representation` of the extractors.
  if (name == "sparse-float") return Representation::sparse_float;
  if (name == "sparse") return Representation::sparse;
  if (name == "dense-float") return Representation::dense_float;
  if (name == "fixed") return Representation::fixed;
  if (name == "thesis") return Representation::thesis;
  if (name == "directed") return Representation::directed;
  throw Error("there is no representation of Hermite data '" + name +
              "'; there are sparse-float, sparse, dense-float, fixed, thesis and directed");
}

void report_size(const Represented& data, const LevelSet& level_set, RunContext& context) {
  // Figures end up in tables; a ratio without a denominator is left out rather than shown as infinite.
  const auto bytes = static_cast<double>(data.bytes);
  context.figure("hermite_bytes", bytes);
  if (data.crossings > 0)
    context.figure("hermite_bytes_per_crossing", bytes / static_cast<double>(data.crossings));
  // The band is the measure by which dense voxels are paid for, the crossings that of the sparse ones.
  const std::size_t voxels = level_set.active_voxels();
  if (voxels > 0) context.figure("hermite_bytes_per_voxel", bytes / static_cast<double>(voxels));
}

void report_figures(const Represented& data, const LevelSet& level_set, RunContext& context) {
  report_size(data, level_set, context);
  // Losses are a figure for tables and a note for whoever reads the run.
  context.figure("lost_crossings", static_cast<double>(data.lost));
  if (data.lost > 0)
    context.note(
        std::to_string(data.lost) + " of " + std::to_string(data.crossings) +
        " edge crossings were lost by the representation of the Hermite data and stand in the middle "
        "of their edges");
}

Represented through(Representation representation, NormalCodeId code, FloatHermite hermite,
                    RunContext& context) {
  Represented result;
  // Taken first, because the data may be moved away below.
  result.crossings = hermite.crossings.size();
  switch (representation) {
    case Representation::sparse_float:
      // Nothing to store: what is there already is the representation.
      result.bytes = hermite.memory_bytes();
      result.hermite = std::move(hermite);
      break;
    case Representation::sparse: {
      const PackedHermite packed = [&] {
        Stage stage(context, "store Hermite data");
        return pack(hermite, code, context);
      }();
      result.bytes = packed.memory_bytes();
      Stage stage(context, "read Hermite data");
      result.hermite = unpack(packed, context);
      break;
    }
    case Representation::dense_float:
      through_dense<FloatVoxel>(hermite, code, result, context);
      break;
    case Representation::fixed:
      through_dense<FixedVoxel>(hermite, code, result, context);
      break;
    case Representation::thesis:
      through_dense<ThesisVoxel>(hermite, code, result, context);
      break;
    case Representation::directed:
      through_dense<DirectedVoxel>(hermite, code, result, context);
      break;
  }
  return result;
}

}  // namespace hermesh
