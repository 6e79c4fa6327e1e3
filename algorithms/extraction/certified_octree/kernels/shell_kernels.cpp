// Every operation is elementwise and rounded once.
#include "algorithms/extraction/certified_octree/kernels/shell_kernels.h"

#include "algorithms/lattice/simd/bits.h"
#include "algorithms/lattice/simd/vectors.h"

namespace hermesh::shell_kernels {
namespace HERMESH_SIMD_LEVEL {
namespace {

using namespace simd;

inline Ints lane_numbers() {
  Ints result;
  for (int i = 0; i < kLanes; ++i) result[i] = i;
  return result;
}

/// Returns the lanes with positions in one of the own boxes.
inline Ints own_lanes(const Scan& scan, Floats x, Floats y, Floats z) {
  Ints own{};
  for (int i = 0; i < scan.own_count; ++i) {
    const Box& box = scan.own[i];
    own |= (x > box.lower[0]) & (x < box.upper[0]) & (y > box.lower[1]) & (y < box.upper[1]) &
           (z > box.lower[2]) & (z < box.upper[2]);
  }
  return own;
}

/// Determines the certain relations of consecutive vertices to the prisms.
template <int prisms>
inline void tell_points(const Scan& scan, const float* corner, std::uint32_t first, int count, Found& found) {
  const Surface& surface = *scan.surface;
  for (int done = 0; done < count; done += kLanes) {
    const std::uint32_t at = first + static_cast<std::uint32_t>(done);
    const Floats x = load(surface.x + at) + corner[0], y = load(surface.y + at) + corner[1],
                 z = load(surface.z + at) + corner[2];
    // Certain relations leave room for the rounding of single precision; the caller tests triangles of
    // vertices without one in double.
    Ints inside[prisms], beyond_it[prisms];
    Ints certain{};
#pragma GCC unroll 2
    for (int prism = 0; prism < prisms; ++prism) {
      const Planes& planes = scan.prisms[prism];
      const auto beyond = [&](int plane) {
        const float* n = planes.normals[plane];
        return n[0] * x + n[1] * y + n[2] * z - planes.offsets[plane];
      };
      const auto note = [&](Ints mask, int what) { certain |= mask & (1 << (kMostPrisms * what + prism)); };
      Ints within = lane_numbers() < count - done;
#pragma GCC unroll 3
      for (int wall = 0; wall < 3; ++wall) {
        const Floats by = beyond(wall);
        const float certain_by = planes.spread[wall] + planes.rounding;
        note(by > certain_by, kBeyondWall + wall);
        within &= by < -certain_by;
      }
      const Floats above = beyond(Planes::kLid), below = beyond(Planes::kBottom);
      // Lid and bottom are flat, unlike the walls, and need no spread.
      const Ints up = above > planes.rounding, down = below > planes.rounding;
      const Ints between = larger(above, below) < -planes.rounding;
      note(up, kAboveLid), note(down, kBelowBottom), note(between, kBetweenLids);
      inside[prism] = within & between;
      beyond_it[prism] = within & (up | down);
    }
    // The own boxes matter only until a result is known for each prism.
    Ints news{};
    for (int prism = 0; prism < prisms; ++prism) {
      if (!(found.inside >> prism & 1)) news |= inside[prism];
      if (!(found.beyond >> prism & 1)) news |= beyond_it[prism];
    }
    if (any(news)) {
      const Ints own = own_lanes(scan, x, y, z);
      for (int prism = 0; prism < prisms; ++prism) {
        found.inside |= unsigned{any(inside[prism] & own)} << prism;
        found.beyond |= unsigned{any(beyond_it[prism] & own)} << prism;
      }
    }
    // Values written beyond the run are right or overwritten later, because the windows ascend.
    const Shorts narrow = __builtin_convertvector(certain, Shorts);
    __builtin_memcpy(surface.certain + at, &narrow, sizeof narrow);
  }
}

/// Returns the bits below the first bit of a nonzero word, and those up to its last bit.
inline std::uint64_t before_first(std::uint64_t word) { return (word & -word) - 1; }
inline std::uint64_t until_last(std::uint64_t word) { return ~std::uint64_t{0} >> __builtin_clzll(word); }

/// Does the same for the vertices of all windows.
template <int prisms>
inline void tell_points(const Scan& scan, Found& found) {
  for (const Window* window = scan.windows; window < scan.windows + scan.window_count; ++window) {
    const Block& block = *window->block;
    const ActiveCells& cells = *block.cells;
    for (int x = window->cells.first; x < window->cells.end; ++x) {
      const std::uint64_t active = cells.active[x], asked = active & window->cells.rows;
      if (asked == 0) continue;
      // Vertices are numbered by cell, so those of a row are consecutive; those between two rows are
      // included.
      const int first = popcount(active & before_first(asked)), end = popcount(active & until_last(asked));
      tell_points<prisms>(scan, window->corner,
                          cells.first_point + cells.before[x] + static_cast<std::uint32_t>(first),
                          end - first, found);
    }
    if (block.later_points > 0)
      tell_points<prisms>(scan, window->corner, block.first_later, static_cast<int>(block.later_points),
                          found);
  }
}

/// Returns the prisms, one bit each, that a triangle may be in, by the certain relations of all its corners.
inline unsigned may_be_in(unsigned certain, unsigned prisms) {
  unsigned out = 0;
  for (int what = kBeyondWall; what <= kBelowBottom; ++what) out |= certain >> (kMostPrisms * what);
  return ~out & prisms;
}

/// Writes the quads that may be in a prism, without branches: other quads are overwritten.
inline int find_candidates(const Scan& scan, Candidate* out) {
  const Surface& surface = *scan.surface;
  const unsigned prisms = (1u << scan.prism_count) - 1;
  Candidate* next = out;
  for (const Window* window = scan.windows; window < scan.windows + scan.window_count; ++window) {
    const Block& block = *window->block;
    for (int x = window->samples.first; x < window->samples.end; ++x) {
      std::uint64_t quads[3], any_axis = 0;
      for (int axis = 0; axis < 3; ++axis)
        any_axis |= quads[axis] = block.crossing[axis][x] & ~block.without_quad[axis][x];
      const std::uint64_t asked = any_axis & window->samples.rows;
      if (asked == 0) continue;
      const std::uint64_t before = before_first(asked), until = until_last(asked);
      // Quads are numbered by word and sample: skip those before the first row requested, and stop after the
      // last.
      std::uint32_t number = block.first_quad + block.quads_before[x], end = number;
      for (const std::uint64_t word : quads) {
        number += static_cast<std::uint32_t>(popcount(word & before));
        end += static_cast<std::uint32_t>(popcount(word & until));
      }
      // Quads between two rows, whose relations may be outdated, are in no prism, so the result for them is
      // irrelevant.
      for (; number < end; ++number) {
        const std::uint32_t* quad = surface.quads[number];
        const unsigned both = surface.certain[quad[0]] & surface.certain[quad[2]];
        const unsigned a = both & surface.certain[quad[1]], b = both & surface.certain[quad[3]];
        const unsigned near_a = may_be_in(a, prisms), near_b = may_be_in(b, prisms);
        const unsigned between_a = a >> (kMostPrisms * kBetweenLids) & prisms,
                       between_b = b >> (kMostPrisms * kBetweenLids) & prisms;
        const unsigned facing = surface.upright[number] ? window->facing : 0;
        *next = {number,
                 {static_cast<std::uint8_t>(near_a & ~(between_a & facing)),
                  static_cast<std::uint8_t>(near_b & ~(between_b & facing))},
                 {static_cast<std::uint8_t>(between_a), static_cast<std::uint8_t>(between_b)}};
        next += (next->near[0] | next->near[1]) != 0;
      }
    }
  }
  return static_cast<int>(next - out);
}

Found look(const Scan& scan, Candidate* out) {
  Found found{};
  if (scan.prism_count == 1)
    tell_points<1>(scan, found);
  else
    tell_points<kMostPrisms>(scan, found);
  found.candidates = find_candidates(scan, out);
  return found;
}

}  // namespace
}  // namespace HERMESH_SIMD_LEVEL

constinit const Kernels Kernels::HERMESH_SIMD_LEVEL = {simd::kLevel, HERMESH_SIMD_LEVEL::look};

}  // namespace hermesh::shell_kernels
