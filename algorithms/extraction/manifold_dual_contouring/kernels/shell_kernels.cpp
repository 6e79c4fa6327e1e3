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
  return of_level(chosen_simd_level(), sse2::kClassify, avx2::kClassify, avx512::kClassify);
}

}  // namespace hermesh::shell_kernels
