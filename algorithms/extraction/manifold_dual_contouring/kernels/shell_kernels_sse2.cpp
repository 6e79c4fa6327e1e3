#include <immintrin.h>

#include "algorithms/extraction/manifold_dual_contouring/kernels/shell_kernels.h"

namespace hermesh::shell_kernels::sse2 {

#include "algorithms/extraction/manifold_dual_contouring/kernels/shell_kernels.inc"

}  // namespace hermesh::shell_kernels::sse2
