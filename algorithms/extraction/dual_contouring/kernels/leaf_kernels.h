// The work on one 8³ leaf of dual contouring from a level set, compiled for several SIMD instruction sets;
// all give the same bytes. No functions of the standard library are used here: if two of these files
// instantiate the same inline function, the linker may keep either copy.
//
// Coordinates are those of the leaf: sample (x,y,z) from 0 to 7, cell (x,y,z) between samples x and x+1 and
// so on. Bits are in the order of BlockMask, word x, bit 8y+z. A cell of the leaf has its corners in the leaf
// and in seven upper neighbours; the cells around an edge that starts in the leaf lie in it and in seven
// lower ones.
#pragma once

#include <cstdint>

#include "algorithms/hermite/edge_kernels/edge_kernels.h"
#include "algorithms/lattice/active_cells.h"

namespace hermesh::leaf_kernels {

/// Signs of the leaf and its upper neighbours, at dx + 2dy + 4dz: 8 words each. Crossing edges need only
/// those of one step along one axis.
struct UpperSigns {
  const std::uint64_t* inside[8];
};

/// Number of floats in the longest SIMD vectors.
inline constexpr int kLargestVector = 8;

/// The cells of a leaf with a vertex, and the quads of its crossing edges. 96 bytes.
struct LeafCells : ActiveCells {
  std::uint32_t first_quad;  ///< number of the first crossing edge's quad; ordered by axis, then by sample
  std::uint16_t points, quads;
};

/// Lower neighbours that contain a cell with one of the leaf's crossing edges, as bits 1 << (dx + 2dy + 4dz)
/// for negated offsets: bit 1 is the lower neighbour along x.
using LowerNeeds = unsigned;

/// The tangent plane at an edge crossing, in voxels from the cell's centre.
struct Plane {
  float point[3], normal[3];
};

/// Interface of the code in double precision for the rare cells whose vertex the vector code cannot compute.
class PlainCode {
 public:
  /// Computes the cell's vertex, three numbers in voxels from the cell's centre, from `count` planes.
  virtual void place(const Plane* planes, int count, float* place) const = 0;

 protected:
  ~PlainCode() = default;
};

/// Parameters of the placement, the same for all leaves.
struct PlaceRules {
  double linear[3][3];  ///< voxels to mesh, by row
  // Only for placement by planes:
  float truncation, reach;  ///< as in DualContouringOptions; the truncation is at least kLeastTruncation
  float smooth_share;       ///< DualContouringOptions::smooth_share()
  const PlainCode* plain;
};

/// Input of the placement. Average placement reads only the values of the leaf and its upper neighbours, the
/// signs, the isovalue and the scale.
struct PlaceInput : edge_kernels::LeafInput {
  UpperSigns signs;
  const LeafCells* cells;
  double corner[3];  ///< the leaf's first sample in the mesh's coordinates
  const PlaceRules* rules;
};
/// Least truncation for which single precision can decide which singular values to drop.
inline constexpr float kLeastTruncation = 0.03f;

/// Layout of the crossings of all edges of a leaf's cells, by axis and first sample: offset, and the unit
/// normal along the edge and the axes after it; zeros if the edge is not crossed.
struct RecordCube {
  static constexpr int kX = 81, kY = 9, kOfAxis = 729, kAll = 3 * kOfAxis;
  static int number(int axis, int x, int y, int z) { return kOfAxis * axis + kX * x + kY * y + z; }
};

/// Cells with one sheet each.
struct PlainCells {
  const float (*records)[4];  ///< a RecordCube
  const std::uint16_t* cell;  ///< 64x + 8y + z; padded with kLargestVector more valid cells
  int count;
};
/// Parameters of place_flat.
struct FlatPlaces {
  float truncation;    ///< no less than kLeastTruncation
  float smooth_share;  ///< DualContouringOptions::smooth_share()
  float margin;        ///< least distance of vertices from the cell's faces
  /// Largest mean squared distance from the planes if the minimiser lies within the cell, and if it is
  /// constrained to the cell.
  float most_error, most_error_held;
};

/// Destination of the vertices and offsets of a leaf.
struct PlaceOutput {
  float* points;   ///< of the leaf's cells, in the mesh's coordinates, three numbers each
  float* offsets;  ///< of the crossings of the leaf's edges from their first sample, voxels
};

/// Cells of several leaves whose planes are not nearly parallel, or whose minimiser lies outside of them. A
/// leaf has few, which would leave most lanes of a vector idle.
struct LaterCells {
  /// Call place_later() once `count` is at least kEnough; a leaf may add 512 cells.
  static constexpr int kEnough = 64, kMost = kEnough + 512 + kLargestVector;
  static constexpr int kSums = 14;

  int count = 0;
  float sums[kSums][kMost];  ///< sums over the cells' planes, as in Quadrics
  float place[3][kMost];     ///< the minimiser, from the cell's centre, of cells that are not general
  bool general[kMost];       ///< has more than one large eigenvalue
  float records[kMost][12]
               [4];  ///< crossings of the cell's edges, by axis, then by position, as in a RecordCube
  struct Target {
    float* point;
    double corner[3];  ///< the leaf's
    std::uint16_t cell;
  } target[kMost];
};

/// Input of a leaf's quads.
struct ConnectInput {
  UpperSigns signs;
  /// Cells of the leaf and its lower neighbours, at dx + 2dy + 4dz for negated offsets; null if there is no
  /// leaf or none of its cells is needed.
  const LeafCells* cells[8];
  const float* points;    ///< of the mesh; readable one number past the end
  const float* offsets;   ///< as in PlaceOutput; readable kLargestVector numbers past the end
  float corner[3];        ///< the leaf's first sample in the mesh's coordinates
  float to_voxels[3][4];  ///< a step along each axis of the mesh in voxels, and 0
  bool mirrors;           ///< reverses the quads
};

/// The functions of one instruction set (simd_level.h).
struct Kernels {
  SimdLevel level;
  /// Finds a leaf's active cells and its numbers of vertices and quads; does not set first_point and
  /// first_quad. Returns the lower neighbours that its quads need.
  LowerNeeds (*count)(const UpperSigns& signs, LeafCells& cells);
  /// Computes the vertex of each cell as the mean of its crossings.
  void (*place_average)(const PlaceInput& input, const PlaceOutput& output);
  /// Computes the vertex of each cell as the minimiser of its quadratic error function, as dual_contouring()
  /// does, or adds the cell to `later`, which must have fewer than kEnough cells before the call.
  void (*place_optimal)(const PlaceInput& input, const PlaceOutput& output, LaterCells& later);
  /// Computes the vertices of the cells in `later`, and empties it.
  void (*place_later)(const PlaceRules& rules, LaterCells& later);
  /// Computes the vertex of each cell as the minimiser of its quadratic error function, constrained to the
  /// cell. `place` gets the coordinates by axis, in voxels from the cell's first corner, and has room for
  /// kLargestVector more. `placed` is 0 for cells with more than one large eigenvalue, or too large an error.
  void (*place_flat)(const PlainCells& cells, const FlatPlaces& flat, float* const* place,
                     std::uint8_t* placed);
  /// Computes the vertex of each cell as the mean of its crossings; `place` is as for place_flat.
  void (*place_mean)(const PlainCells& cells, float* const* place);
  /// Writes the four vertices of the quad of each crossing edge that starts in the leaf, by axis, then by
  /// sample.
  void (*connect)(const ConnectInput& input, std::uint32_t* quads);
  static const Kernels sse2, avx2, avx512;
};

}  // namespace hermesh::leaf_kernels
