#include <immintrin.h>

#include "algorithms/extraction/certified_octree/kernels/shell_kernels.h"

// The kernels for AVX2: vectors of eight floats.
namespace hermesh::shell_kernels::avx2 {

#include "algorithms/extraction/certified_octree/kernels/shell_kernels.inc"

}  // namespace hermesh::shell_kernels::avx2
