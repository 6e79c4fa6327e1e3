// Finds the triangles of a mesh that may be in one prism or two; compiled for several SIMD instruction sets,
// all with the same bits. Free of the standard library's functions, because the linker may take a function
// shared by two levels from either.
#pragma once

#include <cstdint>

#include "algorithms/lattice/active_cells.h"
#include "algorithms/lattice/simd/simd_level.h"

namespace hermesh::shell_kernels {

/// The number of prisms tested together (see Surface::certain), and the floats in the longest vectors.
constexpr int kMostPrisms = 2, kLargestVector = 8;

/// Distances of a position beyond a prism's three walls, above its lid and below its bottom; negative inside.
/// Walls are not flat: between lid and bottom they are within `spread` of a plane.
struct Planes {
  static constexpr int kLid = 3, kBottom = 4, kAll = 5;
  float normals[kAll][3];
  float offsets[kAll];  ///< subtracted
  float spread[3];
  float rounding;  ///< smaller distances are uncertain
};

/// Certain relations of a vertex and a prism. A triangle with all corners beyond one plane is not in the
/// prism, and one with all corners between lid and bottom is neither above nor below it.
enum Certain {
  kBeyondWall /* and the two after it */,
  kAboveLid = 3,
  kBelowBottom,
  kBetweenLids,
  kAllCertain
};

/// A mesh with one or more vertices for most active cells of a lattice, and a quad for most crossed edges.
struct Surface {
  /// Coordinates of vertices, relative to the corners of their blocks; kLargestVector more are readable.
  const float *x, *y, *z;
  const std::uint32_t (*quads)[4];
  const std::uint8_t*
      upright;  ///< 1 for quads whose triangles 012 and 023 face up along the block's direction
  /// For each vertex of the windows, with kLargestVector more writable: bit kMostPrisms c + p is set if c (a
  /// Certain) holds for prism p.
  std::uint16_t* certain;
};

/// The vertices and quads of a block of the lattice. Masks of edges are eight words, one for each x, with bit
/// 8y+z for the edge's first sample. Quads are ordered by sample and axis.
struct Block {
  const ActiveCells* cells;
  std::uint32_t first_later, later_points;             ///< vertices of further sheets: all are tested
  const std::uint64_t *crossing[3], *without_quad[3];  ///< edges along each axis
  std::uint32_t first_quad;
  std::uint16_t quads_before[8];  ///< quads of the block before each word
};

/// The part of a block to be tested. All corners of its quads must be among the vertices of some window.
struct Window {
  struct Part {
    std::uint64_t rows;  ///< bits of each word
    int first, end;      ///< words
  };
  const Block* block;
  float corner[3];
  Part cells, samples;
  unsigned facing;  ///< one bit per prism: upright quads of the block face up in the prism
};

struct Box {
  float lower[3], upper[3];
};

/// A request. All coordinates are relative to one position.
struct Scan {
  const Surface* surface;
  const Window* windows;  ///< ascending by first_point
  int window_count;
  const Planes* prisms;
  int prism_count;  ///< kMostPrisms at most
  const Box* own;
  int own_count;
};

/// A quad with a triangle that may be in some prism, and does not certainly face up between lid and bottom.
struct Candidate {
  std::uint32_t quad;
  std::uint8_t near[2],
      between[2];  ///< one bit per prism: it may be in it, and is between its lid and bottom
};

/// The result of a scan. In `inside`, one bit per prism: a vertex in the own boxes is in it; in `beyond`: one
/// is between its walls, but above or below it.
struct Found {
  unsigned inside, beyond;
  int candidates;
};

/// Finds candidates. `out` has room for one for each edge of the windows' blocks.
using Look = Found(const Scan& scan, Candidate* out);

/// See simd_level.h.
struct Kernels {
  SimdLevel level;
  Look* look;
  static const Kernels sse2, avx2, avx512;
};

}  // namespace hermesh::shell_kernels
