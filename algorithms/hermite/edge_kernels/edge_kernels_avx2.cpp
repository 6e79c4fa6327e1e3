#include <immintrin.h>

#include "algorithms/hermite/edge_kernels/edge_kernels.h"
#include "algorithms/hermite/with_normal_code.h"

// Vectors of eight.
namespace hermesh::edge_kernels::avx2 {

#include "algorithms/hermite/edge_kernels/edge_kernels.inc"

}  // namespace hermesh::edge_kernels::avx2
