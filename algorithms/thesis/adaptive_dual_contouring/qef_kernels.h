// The minimisers of quadratic error functions, several at a time.
#pragma once

#include "algorithms/lattice/simd/simd_level.h"

namespace hermesh::qef_kernels {

/// Sums that are solved at a time: as many as keep the vector units busy. A lane's result does not depend on
/// the others.
constexpr int kLanes = 16;
using Lanes = float[kLanes];

/// Symmetric 3×3 matrices with their eigenvectors, one a lane. Normals of unit length make entries of single
/// precision good enough: what is truncated is a thousand times as large as their error.
struct EigenLanes {
  alignas(64) Lanes diagonal[3], off[3];  ///< off[i] is the entry of the two axes other than i
  alignas(64) Lanes vectors[3][3];        ///< by eigenvalue, by coordinate
};

/// See simd_level.h.
struct Kernels {
  SimdLevel level;
  /// The steps from the mass points, by the singular values that are kept; `m` is used up.
  void (*solve)(EigenLanes& m, float truncation, const Lanes (&slopes)[3], Lanes (&step)[3]);
  static const Kernels sse2, avx2, avx512;
};

}  // namespace hermesh::qef_kernels
