// The Hermite data of 8³ leaves of a scalar volume, compiled for several levels of vector code; all give the same
// bytes. Light and free of the standard library's functions, because what two levels share the linker may take from
// either. Bits are in the order of BlockMask, word x, bit 8y+z.
#pragma once

#include <cstdint>

#include "algorithms/hermite/crossing.h"

namespace hermesh::edge_kernels {

/// Signs of the leaf and its upper neighbours, at dx + 2dy + 4dz: 8 words each. Crossing edges need those of one step
/// along one axis alone.
struct UpperSigns {
  const std::uint64_t* inside[8];
};

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

/// What a leaf's crossings are made from.
struct LeafInput {
  UpperSigns signs;
  /// Samples of the leaf and its neighbours by neighbour_slot(), 512 each; where there is no leaf all must be infinite.
  const float* values[27];
  /// Stencils with samples of no less than data_below in magnitude are left to `incomplete`; where active[13] is not null,
  /// so are those with samples without a bit there.
  const std::uint64_t* active[27];
  float data_below;
  float isovalue, scale;  ///< as in InsideRule
  const PlainCrossing* incomplete;
};

/// Leaves whose crossings are found together: a few hundred crossings, enough for long loops, and caches hold their ends.
constexpr int kBatch = 8;
constexpr int kMostCrossings = 3 * 512;  ///< of a leaf

/// How many edges that start in the leaf are crossed.
using Count = int(const UpperSigns& signs);
/// The crossings of those edges, by axis, in that by sample. With t the offset, the gradient is that of both ends by
/// central differences, interpolated: (1 − t) ∇v(s) + t ∇v(s + e). Packed ones are as pack() has them, with tags of 0.
///
/// Of `count` leaves with the same isovalue and scale, at most kBatch: those of leaf i go to out[i], and nothing beyond
/// them is written.
template <class Crossing>
using Sample = void(const LeafInput* leaves, int count, Crossing* const* out);

struct Kernels {
  Count* count;
  Sample<EdgeCrossing>* sample;
  Sample<PackedCrossing>* sample_packed[kNormalCodes.size()];  ///< by NormalCodeId
};

/// For the level of vector code that is chosen, see simd_level.h.
const Kernels& chosen();

}  // namespace hermesh::edge_kernels
