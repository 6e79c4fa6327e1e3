// The voxelizers' part of THE table (variants.h), in a source of its own so that the library that voxelizes
// needs no extractor.
#include "algorithms/thesis/thesis_voxelizer.h"
#include "algorithms/variants.h"
#include "algorithms/voxelization/hermesh_voxelizer.h"

namespace hermesh {

std::span<const Voxelizer> our_voxelizers() {
  // The order is that of lists and tables: ours first, then the thesis's as printed, which is kept for
  // comparison.
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

}  // namespace hermesh
