#include "algorithms/hermite/edge_kernels/edge_kernels.h"

#include "algorithms/core/simd_level.h"

namespace hermesh::edge_kernels {

namespace sse2 {
Sample sample;
}
namespace avx2 {
Sample sample;
}
namespace avx512 {
Sample sample;
}

Sample* chosen() {
  switch (chosen_simd_level()) {
    case SimdLevel::avx2:
      return avx2::sample;
    case SimdLevel::avx512:
      return avx512::sample;
    case SimdLevel::sse2:
      break;
  }
  return sse2::sample;
}

}  // namespace hermesh::edge_kernels
