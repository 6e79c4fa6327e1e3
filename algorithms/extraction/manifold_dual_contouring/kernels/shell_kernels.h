// Where many points are beside a prism, compiled for several levels of vector code; all give the same bits.
// Light and free of the standard library's functions, because what two levels share the linker may take from
// either.
#pragma once

#include <cstdint>

namespace hermesh::shell_kernels {

/// By coordinate; up to kLargestVector numbers behind them are read, too.
struct Points {
  const float *x, *y, *z;
  int count;  ///< kMost at most
};
constexpr int kLargestVector = 16, kMost = 64;

/// How far a place is beyond each of a prism's walls (three, by each of their two pillars), above its lid and
/// below its bottom; negative inside.
struct Planes {
  static constexpr int kLid = 6, kBottom = 7, kAll = 8;
  float normals[kAll][3];
  float offsets[kAll];  ///< subtracted
  float rounding;       ///< what is less than this is not certain
};

/// What is certain of a point; polygons all of whose corners are beyond one plane are not in the prism, nor
/// above or below it if all are between lid and bottom.
enum Certain : std::uint8_t {
  kBeyondWall = 1,  ///< the first wall, and the next two bits the others
  kAboveLid = 8,
  kBelowBottom = 16,
  kBetweenLids = 32,
  kWithinWalls = 64,
  kOut = 31  ///< any of the first five
};

/// A bit a point: in the prism; and in between the walls, but above the lid or below the bottom.
struct Found {
  std::uint64_t inside, beyond;
};

/// @param out room for kMost + kLargestVector
using Classify = Found(const Points& points, const Planes& planes, std::uint8_t* out);

/// For the level of vector code that is chosen, see simd_level.h.
Classify* chosen();

}  // namespace hermesh::shell_kernels
