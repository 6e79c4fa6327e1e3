// The kernels in vectors of sixteen floats, a batch in one register. This file alone is compiled with -mavx512f; see
// kernels_avx2.cpp for what it must not use.
#include <immintrin.h>

#include "algorithms/voxelization/distance/kernels/constants.h"
#include "algorithms/voxelization/distance/kernels/kernels.h"

namespace hermesh::kernels::avx512 {

#include "algorithms/voxelization/distance/kernels/kernels.inc"

}  // namespace hermesh::kernels::avx512
