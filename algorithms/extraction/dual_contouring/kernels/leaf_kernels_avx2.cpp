#include <immintrin.h>

#include "algorithms/extraction/dual_contouring/kernels/leaf_kernels.h"

// The kernels in vectors of eight.
namespace hermesh::leaf_kernels::avx2 {

#include "algorithms/extraction/dual_contouring/kernels/leaf_kernels.inc"

}  // namespace hermesh::leaf_kernels::avx2
