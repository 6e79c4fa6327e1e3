#include <immintrin.h>

#include "algorithms/extraction/dual_contouring/kernels/leaf_kernels.h"

// The kernels in vectors of four, on which every machine that runs the program can rely.
namespace hermesh::leaf_kernels::sse2 {

#include "algorithms/extraction/dual_contouring/kernels/leaf_kernels.inc"

}  // namespace hermesh::leaf_kernels::sse2
