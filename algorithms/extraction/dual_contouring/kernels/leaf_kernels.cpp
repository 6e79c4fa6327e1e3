#include "algorithms/extraction/dual_contouring/kernels/leaf_kernels.h"

#include "algorithms/lattice/simd/simd_level.h"

namespace hermesh::leaf_kernels {

// One body (leaf_kernels.inc), compiled once for each level in a source file with options of its own. This file has
// none, so that the choice itself runs on any machine.
namespace sse2 {
extern const Kernels kKernels;
}
namespace avx2 {
extern const Kernels kKernels;
}
namespace avx512 {
extern const Kernels kKernels;
}

// Asked anew for each extraction: tests change the level between two.
const Kernels& chosen() {
  return of_level(chosen_simd_level(), sse2::kKernels, avx2::kKernels, avx512::kKernels);
}

}  // namespace hermesh::leaf_kernels
