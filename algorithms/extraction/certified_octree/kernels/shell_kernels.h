// Which triangles of a mesh may be in one prism or two, compiled for several levels of vector code; all give
// the same bits. Light and free of the standard library's functions, because what two levels share the linker
// may take from either.
#pragma once

#include <cstdint>

#include "algorithms/lattice/active_cells.h"
#include "algorithms/lattice/simd/simd_level.h"

namespace hermesh::shell_kernels {

/// How many prisms are looked at together (see Surface::certain), and the floats in the longest vectors.
constexpr int kMostPrisms = 2, kLargestVector = 8;

/// How far a place is beyond each of a prism's three walls, above its lid and below its bottom; negative
/// inside. Walls are not flat: between lid and bottom they are within `spread` of a plane.
struct Planes {
  static constexpr int kLid = 3, kBottom = 4, kAll = 5;
  float normals[kAll][3];
  float offsets[kAll];  ///< subtracted
  float spread[3];
  float rounding;  ///< what is less than this is not certain
};

/// What is certain of a point and a prism. Triangles all of whose corners are beyond one plane are not in the
/// prism, nor above or below it if all are between lid and bottom.
enum Certain {
  kBeyondWall /* and the two after it */,
  kAboveLid = 3,
  kBelowBottom,
  kBetweenLids,
  kAllCertain
};

/// A mesh with a point for most cells of a lattice, or several, and a quad for most edges that it crosses.
struct Surface {
  const float *x, *y,
      *z;  ///< coordinates of points, relative to the corners of their blocks; kLargestVector more can be
           ///< read
  const std::uint32_t (*quads)[4];
  const std::uint8_t*
      upright;  ///< 1 for quads whose triangles, 012 and 023, both face up along the block's direction
  /// What is certain of each point of the windows; kLargestVector more can be written. Bit kMostPrisms c + p
  /// says that c (a Certain) is certain of prism p.
  std::uint16_t* certain;
};

/// What is looked at in a block of the lattice: its points and quads. Masks of edges are eight words, one a
/// layer x, with bit 8y+z for the edge's first sample. Quads are in the order of samples, those of one sample
/// in that of axes.
struct Block {
  const ActiveCells* cells;
  std::uint32_t first_later, later_points;             ///< cells' further points: all of them are looked at
  const std::uint64_t *crossing[3], *without_quad[3];  ///< edges along each axis
  std::uint32_t first_quad;
  std::uint16_t quads_before[8];  ///< quads of the block before each layer
};

/// The part of a block that is looked at. All corners of its quads must be among the points of some window.
struct Window {
  struct Part {
    std::uint64_t rows;  ///< bits of each layer
    int first, end;      ///< layers
  };
  const Block* block;
  float corner[3];
  Part cells, samples;
  unsigned facing;  ///< a bit a prism: what is upright in the block faces up in the prism
};

struct Box {
  float lower[3], upper[3];
};

/// What is asked of a surface. All coordinates are relative to one place.
struct Scan {
  const Surface* surface;
  const Window* windows;  ///< ascending by first_point
  int window_count;
  const Planes* prisms;
  int prism_count;  ///< kMostPrisms at most
  const Box* own;
  int own_count;
};

/// A quad of which a triangle may be in some prism, and does not certainly face up and lie between lid and
/// bottom.
struct Candidate {
  std::uint32_t quad;
  std::uint8_t near[2],
      between[2];  ///< a bit a prism: those it may be in, and of which it is between lid and bottom
};

/// What a scan finds. In `inside` a bit a prism: one of the points in the own boxes is in it; in `beyond`:
/// one is between its walls, but above or below it.
struct Found {
  unsigned inside, beyond;
  int candidates;
};

/// Finds candidates. `out` has room for a candidate for each edge of the windows' blocks.
using Look = Found(const Scan& scan, Candidate* out);

/// See simd_level.h.
struct Kernels {
  SimdLevel level;
  Look* look;
  static const Kernels sse2, avx2, avx512;
};

}  // namespace hermesh::shell_kernels
