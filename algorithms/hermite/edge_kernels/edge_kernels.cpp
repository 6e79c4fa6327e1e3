// Every operation is elementwise and rounded once, so all SIMD levels give the same bytes.
#include "algorithms/hermite/edge_kernels/edge_kernels.h"

#include "algorithms/hermite/normal_codes.h"

// The edges of many leaves are in one loop, enough for vectors of sixteen.
#define HERMESH_WIDEST_VECTORS
#include "algorithms/lattice/simd/bits.h"
#include "algorithms/lattice/simd/vectors.h"

namespace hermesh::edge_kernels {
namespace HERMESH_SIMD_LEVEL {
namespace {

using namespace simd;
// Each part uses those before it.
// clang-format off
#include "algorithms/hermite/edge_kernels/leaf_ends.inc"
#include "algorithms/hermite/edge_kernels/leaf_crossings.inc"
// clang-format on

constexpr Kernels kKernels = {
    kLevel,
    crossed,
    sample,
    {sample_packed<ThesisNormalCode>, sample_packed<BaptistaNormalCode>, sample_packed<RoundedNormalCode>,
     sample_packed<OctahedralNormalCode>, sample_packed<NearestNormalCode>}};
// The array is in the order of the codes, and has one kernel for each.
static_assert(kNormalCodes.size() == 5 && int(NormalCodeId::thesis) == 0 &&
              int(NormalCodeId::baptista) == 1 && int(NormalCodeId::rounded) == 2 &&
              int(NormalCodeId::octahedral) == 3 && int(NormalCodeId::nearest) == 4);

}  // namespace
}  // namespace HERMESH_SIMD_LEVEL

constinit const Kernels Kernels::HERMESH_SIMD_LEVEL = HERMESH_SIMD_LEVEL::kKernels;

}  // namespace hermesh::edge_kernels
