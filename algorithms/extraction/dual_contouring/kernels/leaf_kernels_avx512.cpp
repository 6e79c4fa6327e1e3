#include <immintrin.h>

#include "algorithms/extraction/dual_contouring/kernels/leaf_kernels.h"

namespace hermesh::leaf_kernels::avx512 {

#include "algorithms/extraction/dual_contouring/kernels/leaf_kernels.inc"

}  // namespace hermesh::leaf_kernels::avx512
