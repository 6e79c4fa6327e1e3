#include <immintrin.h>

#include "algorithms/extraction/certified_octree/kernels/shell_kernels.h"

// The kernels for the level that every target is compiled for: vectors of four floats.
namespace hermesh::shell_kernels::sse2 {

#include "algorithms/extraction/certified_octree/kernels/shell_kernels.inc"

}  // namespace hermesh::shell_kernels::sse2
