// The minimisers of several quadratic error functions at a time.
#pragma once

#include "algorithms/lattice/simd/simd_level.h"

namespace hermesh::qef_kernels {

/// Sums that are solved at a time: as many as keep the vector units busy. A lane's result does not depend on
/// the others.
constexpr int kLanes = 16;
using Lanes = float[kLanes];

/// Symmetric 3×3 matrices with their eigenvectors, one per lane. With normals of unit length single precision
/// suffices: the truncated entries are a thousand times as large as the error.
struct EigenLanes {
  alignas(64) Lanes diagonal[3], off[3];  ///< off[i] is the entry of the two axes other than i
  alignas(64) Lanes vectors[3][3];        ///< by eigenvalue, by coordinate
};

/// See simd_level.h.
struct Kernels {
  SimdLevel level;
  /// Computes the steps from the mass points, by the retained singular values; `m` is overwritten.
  void (*solve)(EigenLanes& m, float truncation, const Lanes (&slopes)[3], Lanes (&step)[3]);
  static const Kernels sse2, avx2, avx512;
};

}  // namespace hermesh::qef_kernels
