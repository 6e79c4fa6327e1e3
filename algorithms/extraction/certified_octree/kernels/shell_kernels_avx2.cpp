#include <immintrin.h>

#include "algorithms/extraction/certified_octree/kernels/shell_kernels.h"

namespace hermesh::shell_kernels::avx2 {

#include "algorithms/extraction/certified_octree/kernels/shell_kernels.inc"

}  // namespace hermesh::shell_kernels::avx2
