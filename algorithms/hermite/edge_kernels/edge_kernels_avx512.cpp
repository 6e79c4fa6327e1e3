#include <immintrin.h>

#include "algorithms/hermite/edge_kernels/edge_kernels.h"
#include "algorithms/hermite/with_normal_code.h"

// Vectors of eight or sixteen, as vectors.inc says.
namespace hermesh::edge_kernels::avx512 {

#include "algorithms/hermite/edge_kernels/edge_kernels.inc"

}  // namespace hermesh::edge_kernels::avx512
