#include "algorithms/extraction/certified_octree/kernels/shell_kernels.h"

#include "algorithms/lattice/simd/simd_level.h"

namespace hermesh::shell_kernels {

namespace sse2 {
extern Look* const kLook;
}
namespace avx2 {
extern Look* const kLook;
}
namespace avx512 {
extern Look* const kLook;
}

Look* chosen() { return of_level(chosen_simd_level(), sse2::kLook, avx2::kLook, avx512::kLook); }

}  // namespace hermesh::shell_kernels
