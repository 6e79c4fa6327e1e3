#include "algorithms/variants.h"

#include "algorithms/extraction/dual_contouring/dual_contouring.h"
#include "algorithms/extraction/marching_cubes/marching_cubes.h"
#include "algorithms/voxelization/hermesh_voxelizer.h"

namespace hermesh {

std::span<const Extractor> our_extractors() {
  static const std::vector<Extractor> table = {
      {.name = "marching-cubes",
       .summary = "triangles from a table of 256 sign patterns, closed and manifold (Lorensen & Cline 1987, "
                  "ambiguities resolved)",
       .promises = {.closed = true, .manifold = true, .oriented = true},
       .options = {},
       .extract = marching_cubes},
      {.name = "dual-contouring",
       .summary = "uniform dual contouring of Hermite data, keeps sharp features (Ju et al. 2002; Aldén "
                  "2011, chapter 6)",
       .promises = {.closed = true, .oriented = true},
       .options = dual_contouring_options(),
       .extract = dual_contouring},
  };
  return table;
}

std::span<const Voxelizer> our_voxelizers() {
  static const std::vector<Voxelizer> table = {
      {.name = "hermesh",
       .summary = "exact distances in the whole band, vectorised; signs by flooding or winding numbers",
       .options = hermesh_voxelizer_options(),
       .voxelize = hermesh_voxelizer},
  };
  return table;
}

}  // namespace hermesh
