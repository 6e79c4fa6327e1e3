#include "algorithms/thesis/voxels/representation.h"

#include <utility>

#include "algorithms/thesis/voxels/dense_hermite.h"

namespace hermesh {
namespace {

/// In the order of Representation; the names are those of the option `representation` of the extractors.
constexpr const char* kNames[] = {"sparse-float", "sparse", "dense-float", "fixed", "thesis", "directed"};

/// Stores by `store` and reads by `read`, in stages of their own, so that tables separate writing from
/// reading. The size is that in memory, with nodes and tiles.
template <class Store, class Read>
void pass_through(Represented& result, RunContext& context, Store&& store, Read&& read) {
  const auto stored = [&] {
    Stage stage(context, "store Hermite data");
    return store();
  }();
  result.bytes = stored.memory_bytes();
  Stage stage(context, "read Hermite data");
  result.hermite = read(stored);
}

template <class Voxel>
void through_dense(const FloatHermite& hermite, NormalCodeId code, Represented& result, RunContext& context) {
  pass_through(
      result, context, [&] { return to_dense<Voxel>(hermite, context, code); },
      [&](const DenseHermite<Voxel>& dense) { return to_sparse(dense, context, &result.lost); });
}

}  // namespace

Representation parse_representation(const std::string& name) {
  for (std::size_t i = 0; i < std::size(kNames); ++i)
    if (name == kNames[i]) return static_cast<Representation>(i);
  throw Error("there is no representation of Hermite data '" + name +
              "'; there are sparse-float, sparse, dense-float, fixed, thesis and directed");
}

void report_size(const Represented& data, const LevelSet& level_set, RunContext& context) {
  const auto bytes = static_cast<double>(data.bytes);
  context.figure("hermite_bytes", bytes);
  if (data.crossings > 0)
    context.figure("hermite_bytes_per_crossing", bytes / static_cast<double>(data.crossings));
  if (const std::size_t voxels = level_set.active_voxels(); voxels > 0)
    context.figure("hermite_bytes_per_voxel", bytes / static_cast<double>(voxels));
}

void report_figures(const Represented& data, const LevelSet& level_set, RunContext& context) {
  report_size(data, level_set, context);
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
  result.crossings = hermite.crossings.size();
  switch (representation) {
    case Representation::sparse_float:
      result.bytes = hermite.memory_bytes();
      result.hermite = std::move(hermite);
      break;
    case Representation::sparse:
      pass_through(
          result, context, [&] { return pack(hermite, code, context); },
          [&](const PackedHermite& packed) { return unpack(packed, context); });
      break;
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
