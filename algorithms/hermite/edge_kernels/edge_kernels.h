// The Hermite data of 8³ leaves of a scalar volume, compiled for several SIMD levels; all give the same
// bytes. Lightweight and free of standard library functions, because the linker may take code that two levels
// share from either. Bits are in the order of BlockMask, word x, bit 8y+z.
#pragma once

#include <cstdint>

#include "algorithms/hermite/crossing.h"
#include "algorithms/lattice/simd/simd_level.h"

namespace hermesh::edge_kernels {

/// Interface of the plain code for edges whose stencils have samples that are no data, or differences whose
/// squares exceed single precision, which the vector code leaves out.
class PlainCrossing {
 public:
  /// Computes the crossing of an edge along `axis` that starts in the leaf or a step beyond; `record` gets
  /// the offset, and the normal along the axis and the two after it.
  virtual void crossing(int x, int y, int z, int axis, float* record) const = 0;

 protected:
  ~PlainCrossing() = default;
};

/// The samples for a leaf's crossings.
struct LeafInput {
  /// Samples of the leaf and its neighbours by neighbour_slot(), 512 each; without a leaf all must be
  /// infinite.
  const float* values[27];
  /// Stencils with samples of at least data_below in magnitude are left to `incomplete`; if active[13] is not
  /// null, so are those with samples without a bit there.
  const std::uint64_t* active[27];
  float data_below;
  float isovalue, scale;  ///< as in InsideRule
  const PlainCrossing* incomplete;
};
/// A LeafInput with the crossed edges of the leaf.
struct EdgeInput : LeafInput {
  std::uint64_t crossing[3][8];  ///< crossed edges by axis, as Crossed finds them
};

/// Leaves whose crossings are computed together: a few hundred crossings, enough for long loops, and the
/// caches hold their ends.
constexpr int kBatch = 8;
constexpr int kMostCrossings = 3 * 512;  ///< most crossings that a leaf can own

/// Finds the crossed edges that start in the leaf, by axis; `inside` and `beyond` as in SignLeaf. Returns
/// their number.
using Crossed = int(const std::uint64_t* inside, const std::uint64_t* beyond, std::uint64_t (*crossing)[8]);
/// Computes the crossings of the crossed edges of `count` leaves with the same isovalue and scale, at most
/// kBatch: by leaf, in it by axis, in that by sample. With t the offset, the gradient is that of both ends by
/// central differences, interpolated: (1 − t) ∇v(s) + t ∇v(s + e). Packed crossings are as by pack(), with
/// tags of 0. After the last crossing `out` has room for kOutRoom more, which are undefined afterwards.
template <class Crossing>
using Sample = void(const EdgeInput* leaves, int count, Crossing* out);
constexpr int kOutRoom = 128;

/// The kernels of one SIMD level, see simd_level.h.
struct Kernels {
  SimdLevel level;
  Crossed* crossed;
  Sample<EdgeCrossing>* sample;
  Sample<PackedCrossing>* sample_packed[kNormalCodes.size()];  ///< one for each NormalCodeId
  static const Kernels sse2, avx2, avx512;
};

}  // namespace hermesh::edge_kernels
