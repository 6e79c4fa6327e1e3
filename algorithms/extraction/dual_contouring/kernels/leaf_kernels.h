// The work on one 8³ leaf of dual contouring from a level set, compiled for several levels of vector code;
// all give the same bytes. Light and free of the standard library's functions, because what two levels share
// the linker may take from either.
//
// Coordinates are those of the leaf: sample (x,y,z) from 0 to 7, cell (x,y,z) between samples x and x+1 and
// so on. Bits are in the order of BlockMask, word x, bit 8y+z. A cell of the leaf has its corners in the leaf
// and in seven upper neighbours; the cells around an edge that starts in the leaf lie in it and in seven
// lower neighbours.
#pragma once

#include <cstdint>

#include "algorithms/hermite/edge_kernels/edge_kernels.h"
#include "algorithms/lattice/active_cells.h"

namespace hermesh::leaf_kernels {

/// Signs of the leaf and its upper neighbours, at dx + 2dy + 4dz: 8 words each. Crossing edges need those of
/// one step along one axis alone.
struct UpperSigns {
  const std::uint64_t* inside[8];
};

/// Floats in the longest vectors.
inline constexpr int kLargestVector = 8;

/// Which cells of a leaf have a point, and which quads its crossing edges have. 96 bytes.
struct LeafCells : ActiveCells {
  std::uint32_t first_quad;  ///< number of the quad of the first crossing edge: by axis, in that by sample
  std::uint16_t points, quads;
};

/// Lower neighbours that hold a cell with one of the leaf's crossing edges, as bits of 1 << (dx + 2dy + 4dz)
/// with the offsets turned positive: bit 1 is the neighbour below along x.
using LowerNeeds = unsigned;

/// Finds a leaf's active cells and how many points and quads it has; first_point and first_quad are left
/// alone. Returns the lower neighbours that its quads need.
using Count = LowerNeeds(const UpperSigns& signs, LeafCells& cells);

/// A crossing as a tangent plane, in voxels from the cell's centre.
struct Plane {
  float point[3], normal[3];
};

/// Interface of the plain code, in double precision, for the rare cells that the vector code leaves over.
class PlainCode {
 public:
  /// Finds the cell's point, in voxels from the cell's centre, from `count` planes; `place` gets three
  /// numbers.
  virtual void place(const Plane* planes, int count, float* place) const = 0;

 protected:
  ~PlainCode() = default;
};

/// What places are found by, for all leaves alike.
struct PlaceRules {
  double linear[3][3];  ///< voxels to mesh, by row
  /// For placement by planes alone.
  float truncation, reach;  ///< as in DualContouringOptions; the truncation is no less than kLeastTruncation
  float smooth_share;       ///< DualContouringOptions::smooth_share()
  const PlainCode* plain;
};

/// What a leaf's cells are placed from. Average placement reads the values of the leaf and its upper
/// neighbours alone, and of what else a LeafInput has only the signs, the isovalue and the scale.
struct PlaceInput : edge_kernels::LeafInput {
  UpperSigns signs;
  const LeafCells* cells;
  double corner[3];  ///< where the leaf's first sample is in the mesh's coordinates
  const PlaceRules* rules;
};
/// Below it single precision cannot tell which singular values are to be dropped.
inline constexpr float kLeastTruncation = 0.03f;

/// Crossings of all edges that a leaf's cells have, by axis and place of the first sample: offset, and the
/// normal along the edge and the axes after it, of unit length; zeros where none is.
struct RecordCube {
  static constexpr int kX = 81, kY = 9, kOfAxis = 729, kAll = 3 * kOfAxis;
  static int number(int axis, int x, int y, int z) { return kOfAxis * axis + kX * x + kY * y + z; }
};

/// Single cells, with one sheet each.
struct PlainCells {
  const float (*records)[4];  ///< a RecordCube
  const std::uint16_t* cell;  ///< 64x + 8y + z; kLargestVector more can be read, and are cells, too
  int count;
};
/// What PlaceFlat takes for flat enough.
struct FlatPlaces {
  float truncation;    ///< no less than kLeastTruncation
  float smooth_share;  ///< DualContouringOptions::smooth_share()
  float margin;        ///< places are so far off the cell's faces
  /// Square of the distance from the planes, root mean square, where the minimiser lies within the cell, and
  /// where it is held there.
  float most_error, most_error_held;
};

/// Where the points and offsets of a leaf are written.
struct PlaceOutput {
  float* points;   ///< points of the leaf's cells, in the mesh's coordinates, three numbers a point
  float* offsets;  ///< where the leaf's edges are crossed, from their first sample, in voxels
};

/// Cells of several leaves whose planes are not nearly parallel, or whose minimiser lies outside of them. A
/// leaf has some few, which would leave most lanes of a vector idle.
struct LaterCells {
  /// When there are this many they had better be placed; a leaf may add 512.
  static constexpr int kEnough = 64, kMost = kEnough + 512 + kLargestVector;
  static constexpr int kSums = 14;

  int count = 0;
  float sums[kSums][kMost];  ///< sums over the cells' planes, as Quadrics has them
  float place[3][kMost];     ///< the minimiser, from the cell's centre, of cells that are not general
  bool general[kMost];       ///< has more than one large eigenvalue
  float records[kMost][12]
               [4];  ///< crossings of the cell's edges, by axis, in that by place, as in a RecordCube
  struct Target {
    float* point;
    double corner[3];  ///< the leaf's
    std::uint16_t cell;
  } target[kMost];
};

/// Places each cell at the mean of its crossings.
using PlaceAverage = void(const PlaceInput& input, const PlaceOutput& output);
/// Places each cell by the minimiser of its quadratic error function, as dual_contouring() does, or adds it
/// to `later`, which has less than kEnough cells before.
using PlaceOptimal = void(const PlaceInput& input, const PlaceOutput& output, LaterCells& later);
/// Places the later cells, and forgets them.
using PlaceLater = void(const PlaceRules& rules, LaterCells& later);

/// What a leaf's quads are made from.
struct ConnectInput {
  UpperSigns signs;
  /// Cells of the leaf and its lower neighbours, at dx + 2dy + 4dz with the offsets turned positive; null
  /// where there is no leaf or none of its cells is needed.
  const LeafCells* cells[8];
  const float* points;  ///< the mesh's points; one number more can be read
  const float*
      offsets;  ///< where the leaf's edges are crossed, as in PlaceOutput; kLargestVector more can be read
  float corner[3];        ///< where the leaf's first sample is in the mesh's coordinates
  float to_voxels[3][4];  ///< what a step along each axis of the mesh is in voxels, and 0
  bool mirrors;           ///< turns the quads about
};

/// Places each cell by the minimiser of its quadratic error function, held within the cell. `place` gets the
/// coordinates by axis, in voxels from the cell's first corner, and has room for kLargestVector more.
/// `placed` is 0 where the cell is another case: more than one large eigenvalue, or too large an error.
using PlaceFlat = void(const PlainCells& cells, const FlatPlaces& flat, float* const* place,
                       std::uint8_t* placed);
/// Places each cell at the mean of its crossings; `place` is as for PlaceFlat.
using PlaceMean = void(const PlainCells& cells, float* const* place);

/// One quad for each crossing edge that starts in the leaf, four point numbers each, by axis, in that by
/// sample.
using Connect = void(const ConnectInput& input, std::uint32_t* quads);

/// See simd_level.h.
struct Kernels {
  SimdLevel level;
  Count* count;
  PlaceAverage* place_average;
  PlaceOptimal* place_optimal;
  PlaceLater* place_later;
  PlaceFlat* place_flat;
  PlaceMean* place_mean;
  Connect* connect;
  static const Kernels sse2, avx2, avx512;
};

}  // namespace hermesh::leaf_kernels
