// The Hermite data of 8³ leaves of a scalar volume, compiled for several levels of vector code; all give the same
// bytes. Light and free of the standard library's functions, because what two levels share the linker may take from
// either. Bits are in the order of BlockMask, word x, bit 8y+z.
#pragma once

#include <cstdint>

#include "algorithms/hermite/crossing.h"

namespace hermesh::edge_kernels {

/// The plain code for edges whose stencils have samples that are no data, or differences whose squares single precision
/// has no room for, which the vector code does not do.
class PlainCrossing {
 public:
  /// Of an edge along `axis` that starts in the leaf or a step beyond: offset, and the normal along the axis and the two
  /// after it.
  virtual void crossing(int x, int y, int z, int axis, float* record) const = 0;

 protected:
  ~PlainCrossing() = default;
};

/// The samples that a leaf's crossings are made from.
struct LeafInput {
  /// Samples of the leaf and its neighbours by neighbour_slot(), 512 each; where there is no leaf all must be infinite.
  const float* values[27];
  /// Stencils with samples of no less than data_below in magnitude are left to `incomplete`; where active[13] is not null,
  /// so are those with samples without a bit there.
  const std::uint64_t* active[27];
  float data_below;
  float isovalue, scale;  ///< as in InsideRule
  const PlainCrossing* incomplete;
};
/// With its crossed edges.
struct EdgeInput : LeafInput {
  std::uint64_t crossing[3][8];  ///< as Crossed finds them
};

/// Leaves whose crossings are found together: a few hundred crossings, enough for long loops, and caches hold their ends.
constexpr int kBatch = 8;
constexpr int kMostCrossings = 3 * 512;  ///< of a leaf

/// The edges that start in the leaf and are crossed, by axis; `inside` and `beyond` as in SignLeaf. Returns how many.
using Crossed = int(const std::uint64_t* inside, const std::uint64_t* beyond, std::uint64_t (*crossing)[8]);
/// The crossings of those edges by leaf, in it by axis, in that by sample. With t the offset, the gradient is that of both
/// ends by central differences, interpolated: (1 − t) ∇v(s) + t ∇v(s + e). Packed ones are as pack() has them, with tags of
/// 0.
///
/// Of `count` leaves with the same isovalue and scale, at most kBatch. Behind the last crossing `out` has room for kOutRoom
/// more, and what they are is not said.
template <class Crossing>
using Sample = void(const EdgeInput* leaves, int count, Crossing* out);
constexpr int kOutRoom = 128;

struct Kernels {
  Crossed* crossed;
  Sample<EdgeCrossing>* sample;
  Sample<PackedCrossing>* sample_packed[kNormalCodes.size()];  ///< by NormalCodeId
};

/// For the level of vector code that is chosen, see simd_level.h.
const Kernels& chosen();

}  // namespace hermesh::edge_kernels
