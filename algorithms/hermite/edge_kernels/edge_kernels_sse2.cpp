#include <immintrin.h>

#include "algorithms/hermite/edge_kernels/edge_kernels.h"
#include "algorithms/hermite/with_normal_code.h"

// Vectors of four: what every processor that runs the program has.
namespace hermesh::edge_kernels::sse2 {

#include "algorithms/hermite/edge_kernels/edge_kernels.inc"

}  // namespace hermesh::edge_kernels::sse2
