#include "algorithms/hermite/edge_kernels/edge_kernels.h"

#include "algorithms/core/simd_level.h"

namespace hermesh::edge_kernels {

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
  switch (chosen_simd_level()) {
    case SimdLevel::avx2:
      return avx2::kKernels;
    case SimdLevel::avx512:
      return avx512::kKernels;
    case SimdLevel::sse2:
      break;
  }
  return sse2::kKernels;
}

}  // namespace hermesh::edge_kernels
