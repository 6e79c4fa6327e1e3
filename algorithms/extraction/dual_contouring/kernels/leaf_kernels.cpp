#include "algorithms/extraction/dual_contouring/kernels/leaf_kernels.h"

#include "algorithms/lattice/simd/simd_level.h"

namespace hermesh::leaf_kernels {

namespace sse2 {
extern const Kernels kKernels;
}
namespace avx2 {
extern const Kernels kKernels;
}
namespace avx512 {
extern const Kernels kKernels;
}

const Kernels& chosen() {
  return of_level(chosen_simd_level(), sse2::kKernels, avx2::kKernels, avx512::kKernels);
}

}  // namespace hermesh::leaf_kernels
