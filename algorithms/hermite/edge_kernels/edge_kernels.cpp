#include "algorithms/hermite/edge_kernels/edge_kernels.h"

#include "algorithms/lattice/simd/simd_level.h"

namespace hermesh::edge_kernels {

// Each level is compiled in a source file of its own, with its own flags; this one has those of the whole program.
namespace sse2 {
extern const Kernels kKernels;
}
namespace avx2 {
extern const Kernels kKernels;
}
namespace avx512 {
extern const Kernels kKernels;
}

// The level is asked once a conversion, not once a leaf.
const Kernels& chosen() {
  // All levels give the same bytes, so the choice shows in time only.
  return of_level(chosen_simd_level(), sse2::kKernels, avx2::kKernels, avx512::kKernels);
}

}  // namespace hermesh::edge_kernels
