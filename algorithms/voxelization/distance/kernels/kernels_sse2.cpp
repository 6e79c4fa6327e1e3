// The kernels in vectors of four floats, compiled as all other code is: they run on whatever runs the program.
// Headers come first, for what is included within the namespace may include nothing itself.
#include <immintrin.h>

#include "algorithms/voxelization/distance/kernels/constants.h"
#include "algorithms/voxelization/distance/kernels/kernels.h"

namespace hermesh::kernels::sse2 {

#include "algorithms/voxelization/distance/kernels/kernels.inc"

}  // namespace hermesh::kernels::sse2
