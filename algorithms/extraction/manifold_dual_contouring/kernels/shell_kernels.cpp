#include "algorithms/extraction/manifold_dual_contouring/kernels/shell_kernels.h"

#include "algorithms/core/simd_level.h"

namespace hermesh::shell_kernels {

namespace sse2 {
extern Classify* const kClassify;
}
namespace avx2 {
extern Classify* const kClassify;
}
namespace avx512 {
extern Classify* const kClassify;
}

Classify* chosen() {
  switch (chosen_simd_level()) {
    case SimdLevel::avx2:
      return avx2::kClassify;
    case SimdLevel::avx512:
      return avx512::kClassify;
    case SimdLevel::sse2:
      break;
  }
  return sse2::kClassify;
}

}  // namespace hermesh::shell_kernels
