// The loops over edges, cells and quads are plain C++ over arrays, vectorised by the compiler; every
// operation is elementwise and rounded once, so all instruction sets give the same bytes.
#include "algorithms/extraction/dual_contouring/kernels/leaf_kernels.h"

#include "algorithms/lattice/simd/bits.h"
#include "algorithms/lattice/simd/vectors.h"

namespace hermesh::leaf_kernels {
namespace HERMESH_SIMD_LEVEL {
namespace {

using namespace simd;
// Each part uses those before it.
// clang-format off
#include "algorithms/extraction/dual_contouring/kernels/leaf.inc"
#include "algorithms/extraction/dual_contouring/kernels/place_average.inc"
#include "algorithms/extraction/dual_contouring/kernels/crossings.inc"
#include "algorithms/extraction/dual_contouring/kernels/place_optimal.inc"
#include "algorithms/extraction/dual_contouring/kernels/connect.inc"
// clang-format on

constexpr Kernels kKernels = {kLevel,      count,      place_average, place_optimal,
                              place_later, place_flat, place_mean,    connect};

}  // namespace
}  // namespace HERMESH_SIMD_LEVEL

constinit const Kernels Kernels::HERMESH_SIMD_LEVEL = HERMESH_SIMD_LEVEL::kKernels;

}  // namespace hermesh::leaf_kernels
