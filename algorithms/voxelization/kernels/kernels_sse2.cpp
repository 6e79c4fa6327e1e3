#include <immintrin.h>

#include "algorithms/voxelization/kernels/constants.h"
#include "algorithms/voxelization/kernels/kernels.h"

namespace hermesh::kernels::sse2 {

#include "algorithms/voxelization/kernels/kernels.inc"

}  // namespace hermesh::kernels::sse2
