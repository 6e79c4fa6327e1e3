// The voxelizers' part of the table (variants.h), in its own source so that the library of voxelizers needs
// no extractor.
#include "algorithms/thesis/thesis_volumes.h"
#include "algorithms/variants.h"
#include "algorithms/voxelization/hermesh_voxelizer.h"
#include "algorithms/voxelization/outputs/volume_outputs.h"

namespace hermesh {

std::span<const Voxelizer> our_voxelizers() {
  static const std::vector<Voxelizer> table = {
      {.name = "hermesh",
       .summary = "exact distances in the whole band, vectorised; signs by flooding or winding numbers",
       .options = hermesh_voxelizer_options(),
       .voxelize = hermesh_voxelizer},
      // Chapter 5 with its faults, for comparison.
      {.name = "thesis",
       .summary =
           "sampled rasterisation, angle signs and layered expansion as printed (Aldén 2011, chapter 5)",
       .options = thesis_voxelizer_options(),
       .voxelize =
           [](const VoxelizationInput& input) {
             return thesis_voxelizer(input, thesis_voxelizer_options(input.options));
           }},
  };
  return table;
}

bool knows_triangles(const std::string& voxelizer) { return voxelizer == "hermesh" || voxelizer == "thesis"; }

VolumeOutputs make_volume_outputs(const Voxelizer& voxelizer, const VoxelizationInput& input,
                                  const VolumeRequest& request) {
  VoxelizeOptions options = voxelize_options(input);
  if (voxelizer.name == "hermesh") return make_volume_outputs(input.mesh, options, request, input.context);
  // Of the options only the signs are read before the voxelizer runs: fog and Hermite data need them.
  const ThesisVoxelizerOptions of_thesis = thesis_voxelizer_options(input.options);
  options.signs = of_thesis.signs ? SignRule::flood_fill : SignRule::none;
  return make_volume_outputs(
      input.mesh, options, request,
      [&](const VoxelizeOptions& asked) { return thesis_voxelization(input, of_thesis, asked.nearest); },
      input.context);
}

}  // namespace hermesh
