#include <immintrin.h>

#include "algorithms/hermite/edge_kernels/edge_kernels.h"

namespace hermesh::edge_kernels::avx2 {

#include "algorithms/hermite/edge_kernels/edge_kernels.inc"

}  // namespace hermesh::edge_kernels::avx2
