#include "algorithms/lattice/read_signs.h"

#define HERMESH_WIDEST_VECTORS
#include "algorithms/lattice/simd/vectors.h"

namespace hermesh {
namespace HERMESH_SIMD_LEVEL {
namespace {

using namespace simd;

// A comparison of magnitudes as integers finds infinity and NaN: with the sign bit cleared, floats are
// ordered as their bits are, and infinity and all NaNs come after the largest finite number.
//
// A sample is compared with the isovalue instead of signed_value() with 0. Both agree, because the difference
// of two different floats is never rounded to 0; and if greater is inside, the comparison is reversed.

bool read_leaf(const float* values, const InsideRule& rule, std::uint64_t* inside) {
  constexpr std::int32_t kMagnitude = 0x7fffffff, kLargestFinite = 0x7f7fffff;
  const Floats iso = all(rule.isovalue);
  // The greatest magnitude of each lane suffices for the test after the loop.
  Ints greatest{};
  // A word is a layer along x: 64 consecutive samples, whose comparisons are its bits in order.
  for (int word = 0; word < 8; ++word) {
    std::uint64_t bits = 0;
    for (int i = 0; i < 64; i += kLanes) {
      const Floats v = load(values + 64 * word + i);
      // Comparisons are ordered: NaN counts as outside here, and the leaf is rejected because of it.
      bits |= std::uint64_t{rule.scale > 0 ? less(v, iso) : less(iso, v)} << i;
      const Ints size = (Ints)v & kMagnitude;
      greatest = greatest > size ? greatest : size;
    }
    inside[word] = bits;
  }
  return !any(greatest > kLargestFinite);
}

// Rows are read for layers of edges across leaves. Samples that are not finite are found by read_leaf().
std::uint64_t read_rows(const float* values, std::size_t stride, const InsideRule& rule) {
  const Floats iso = all(rule.isovalue);
  std::uint64_t bits = 0;
  for (std::size_t row = 0; row < 8; row += kRows)
    for (std::size_t z = 0; z < 8; z += kLanes) {
      const Floats v = load_rows(values + stride * row + z, stride);
      bits |= std::uint64_t{rule.scale > 0 ? less(v, iso) : less(iso, v)} << (8 * row + z);
    }
  return bits;
}

}  // namespace
}  // namespace HERMESH_SIMD_LEVEL

constinit const SignReader SignReader::HERMESH_SIMD_LEVEL = {simd::kLevel, HERMESH_SIMD_LEVEL::read_leaf,
                                                             HERMESH_SIMD_LEVEL::read_rows};

}  // namespace hermesh
