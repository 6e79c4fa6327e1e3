// The kernels in vectors of eight floats. This file alone is compiled with -mavx2; functions of the standard library
// in it could end up in code that runs on every machine.
#include <immintrin.h>

#include "algorithms/voxelization/distance/kernels/constants.h"
#include "algorithms/voxelization/distance/kernels/kernels.h"

namespace hermesh::kernels::avx2 {

#include "algorithms/voxelization/distance/kernels/kernels.inc"

}  // namespace hermesh::kernels::avx2
