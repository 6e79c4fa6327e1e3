// Random solids for fracture trials, with parts that are barely connected, or connected across no lattice
// edge.
#pragma once

#include <cstdint>
#include <string>

#include "algorithms/core/polygon_mesh.h"

namespace hermesh {

/// A closed mesh that is not aligned with the lattice, its sampling resolution, and its cutters.
struct FractureTrial {
  std::string kind;  ///< solids, plates, shell or bars
  PolygonMesh mesh;
  double longest = 0.0;  ///< voxels along the longest side: 12 to 48
  std::string cutters;   ///< as parse_cutters() takes it: one to three planes, or two to twenty cells
};

/// Returns trial number `number`, the same on every machine. The kinds alternate.
FractureTrial fracture_trial(std::uint64_t number);

}  // namespace hermesh
