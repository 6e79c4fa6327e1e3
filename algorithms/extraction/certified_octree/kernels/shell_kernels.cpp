#include "algorithms/extraction/certified_octree/kernels/shell_kernels.h"

#include "algorithms/lattice/simd/simd_level.h"

namespace hermesh::shell_kernels {

// Defined in shell_kernels.inc, once in each of these namespaces.
namespace sse2 {
extern Look* const kLook;
}
namespace avx2 {
extern Look* const kLook;
}
namespace avx512 {
extern Look* const kLook;
}

// Each level is compiled in a source file of its own, with options of its own: only its table is named here. The
// environment is read at each call, so tests can change the level.
Look* chosen() { return of_level(chosen_simd_level(), sse2::kLook, avx2::kLook, avx512::kLook); }

}  // namespace hermesh::shell_kernels
