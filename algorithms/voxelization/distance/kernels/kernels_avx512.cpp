#include <immintrin.h>

#include "algorithms/voxelization/distance/kernels/constants.h"
#include "algorithms/voxelization/distance/kernels/kernels.h"

namespace hermesh::kernels::avx512 {

#include "algorithms/voxelization/distance/kernels/kernels.inc"

}  // namespace hermesh::kernels::avx512
