#include <immintrin.h>

#include "algorithms/extraction/dual_contouring/kernels/leaf_kernels.h"

// The kernels in vectors of eight with masks and lists by VBMI2.
namespace hermesh::leaf_kernels::avx512 {

#include "algorithms/extraction/dual_contouring/kernels/leaf_kernels.inc"

}  // namespace hermesh::leaf_kernels::avx512
