// The arithmetic of sampling a level set's edges, compiled for several levels of vector code; all give the same bytes.
// Light and free of the standard library, because what two levels share the linker may take from either.
#pragma once

namespace hermesh::edge_kernels {

/// Crossing edges of one leaf along one axis e; u and v are the axes after it.
struct Edges {
  int count;                      ///< at most 512
  int at[512];                    ///< indices of their first samples in the array of samples
  float offset[512];              ///< along the edge
  float normal[3][512];           ///< components along e, u and v
  float largest[512];             ///< magnitude among the twelve samples that went into it
};

/// Fills in all but count and at. `stride_…` are those of the array of samples. With t the offset, the gradient is that
/// of both ends by central differences, interpolated: (1 − t) ∇v(s) + t ∇v(s + e).
using Sample = void(const float* samples, int stride_e, int stride_u, int stride_v, float isovalue, float scale,
                    Edges& edges);

/// For the level of vector code that is chosen, see simd_level.h.
Sample* chosen();

}  // namespace hermesh::edge_kernels
