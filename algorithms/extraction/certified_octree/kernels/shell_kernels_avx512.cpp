#include <immintrin.h>

#include "algorithms/extraction/certified_octree/kernels/shell_kernels.h"

// The kernels for AVX-512: vectors of eight floats here, too (vectors.inc says why).
namespace hermesh::shell_kernels::avx512 {

#include "algorithms/extraction/certified_octree/kernels/shell_kernels.inc"

}  // namespace hermesh::shell_kernels::avx512
