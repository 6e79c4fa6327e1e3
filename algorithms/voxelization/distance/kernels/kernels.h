// The arithmetic of one 8³ leaf: squared distances of its 512 voxels to triangles, and the grid edges that
// triangles cross. Compiled for several SIMD levels, of which one is chosen at run time; all give the same
// bytes, for there is no fused multiply-add, no approximate instruction and no sum across lanes.
#pragma once

#include <cstdint>

#include "algorithms/lattice/simd/simd_level.h"

namespace hermesh::kernels {

/// Number of triangles in a batch, a lane each.
inline constexpr int kBatch = 16;

/// Corners of up to 16 triangles, in voxels, relative to a leaf's first voxel: corner[3 · corner +
/// axis][triangle].
struct Corners {
  alignas(64) double corner[9][kBatch];
};

/// Corners of up to 16 triangles in the mesh's world units and single precision: corner[3 · corner +
/// axis][triangle].
struct MeshCorners {
  alignas(64) float corner[9][kBatch];
};

/// The change from the mesh's units to voxels relative to a leaf's first voxel: corner · scale − origin.
struct LeafFrame {
  double scale;
  double origin[3];
};

/// The triangles of 16 that matter to a leaf, as bits.
struct Near {
  unsigned within_reach;  ///< the box is within reach of the leaf's voxels, with a margin for rounding
  unsigned at_edges;      ///< the box touches the box of the leaf's grid edges, with the same margin
};

/// Triangles as linear functions of position x (voxels, relative to a leaf's first voxel), so that a distance
/// is a few additions per voxel. With n the unit normal, and for edge i with unit direction e and in-plane
/// outward normal m:
///   height  n·x + c                  signed distance to the plane
///   across  m·x + c                  signed distance to the edge's line, positive outside
///   along   e·x, from `low` to `high` on the edge
/// so that d² = height² + (all across < 0 ? 0 : min over edges of across² + (along − clamp(along, low,
/// high))²). A triangle thinner than a millionth of a voxel is its longest side, a segment, whose three edges
/// are the same one seen from both sides, so nothing is inside.
struct Batch {
  enum { kHeight = 0, kEdge = 4, kPerEdge = 9, kAlong = 4, kLow = 7, kHigh = 8, kFloats = 31 };
  alignas(64) float f[kFloats][kBatch];
  alignas(64) std::int32_t id[kBatch];
};

/// Squared distances, voxels², of a leaf's voxels: 32 blocks of 2×2×4 voxels, 16 lanes each, so that a small
/// triangle touches few of them. position() gives the index of a voxel.
struct Distances {
  alignas(64) float squared[512];
  alignas(64) std::int32_t id[512];  ///< of the nearest triangle; only on request
};

/// Returns the index in Distances of voxel (x, y, z) of the leaf, each 0 … 7.
constexpr int position(int x, int y, int z) {
  return ((x >> 1) << 7 | (y >> 1) << 5 | (z >> 2) << 4) | ((x & 1) << 3 | (y & 1) << 2 | (z & 3));
}

/// Boxes of batches in voxels relative to the leaf's first voxel, sixteen at a time: [axis][low,
/// high][batch].
struct Boxes {
  alignas(64) float side[3][2][kBatch];
};

/// Batches that are set up when first needed.
struct LazyBatches {
  const Boxes* boxes;
  const Batch** batches;  ///< null until prepared
  int count;              ///< number of batches; boxes beyond it must be practically infinitely far away
  const Batch* (*prepare)(void* context, int batch);
  void* context;
};

/// Grid edges that triangles cross: bit 8y + z of word x, axis of the edge first. An edge belongs to its
/// lower end.
struct EdgeBits {
  std::uint64_t word[3][8];
};

/// See simd_level.h.
struct Kernels {
  SimdLevel level;
  /// Finds the triangles near a leaf by their boxes.
  Near (*near)(const MeshCorners&, const LeafFrame&, float reach);
  /// Converts the corners of 16 triangles to voxels relative to the leaf, in double precision.
  void (*to_leaf)(const MeshCorners&, const LeafFrame&, Corners&);
  /// Sets up 16 triangles at once. Bit i of the result: triangle i is thinner than a millionth of a voxel,
  /// and the caller has to fill its lane with a segment.
  unsigned (*set_up)(const Corners&, Batch&);
  /// Lowers the distances of the voxels within `reach` voxels of the first `count` triangles of the batch;
  /// beyond it they may be unchanged. With `ids`, stores the nearest triangle.
  void (*update)(const Batch&, int count, float reach, bool ids, Distances&);
  /// Lowers the distances as `update` does, for thousands of triangles far smaller than a voxel: one voxel
  /// and 16 triangles at once, without batches whose box is farther than the nearest triangle so far.
  void (*update_from_many)(const LazyBatches&, float reach, bool ids, Distances&);
  /// Adds the edges that the first `count` triangles cross, ends and borders included with a tolerance of
  /// 1e-9 voxel, so that no path along grid edges slips through between two triangles that share an edge.
  void (*cross)(const Corners&, int count, EdgeBits&);
  /// Writes the distances, in voxels times `scale`, in OpenVDB's order, none above reach · scale, and the
  /// voxels below it as bits. False when there is none.
  bool (*finish)(const Distances&, float reach, float scale, float* values, std::uint64_t* active);
  /// Makes `values` (distances in OpenVDB's order) negative, −`least` or less, where `inside` has a bit, and
  /// limits them on either side; leaves in `active` the bits of those below their limit.
  void (*apply_signs)(const std::uint64_t* inside, float exterior, float interior, float least, float* values,
                      std::uint64_t* active);
  static const Kernels sse2, avx2, avx512;
};

}  // namespace hermesh::kernels
