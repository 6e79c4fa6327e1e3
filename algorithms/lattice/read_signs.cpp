#include "algorithms/lattice/read_signs.h"

#define HERMESH_WIDEST_VECTORS
#include "algorithms/lattice/simd/vectors.h"

namespace hermesh {
namespace HERMESH_SIMD_LEVEL {
namespace {

using namespace simd;

bool read_leaf(const float* values, const InsideRule& rule, std::uint64_t* inside) {
  // A comparison of magnitudes as whole numbers finds what is no number.
  constexpr std::int32_t kMagnitude = 0x7fffffff, kLargestFinite = 0x7f7fffff;
  const Floats iso = all(rule.isovalue);
  Ints greatest{};
  for (int word = 0; word < 8; ++word) {
    std::uint64_t bits = 0;
    for (int i = 0; i < 64; i += kLanes) {
      const Floats v = load(values + 64 * word + i);
      bits |= std::uint64_t{rule.scale > 0 ? less(v, iso) : less(iso, v)} << i;
      const Ints size = (Ints)v & kMagnitude;
      greatest = greatest > size ? greatest : size;
    }
    inside[word] = bits;
  }
  return !any(greatest > kLargestFinite);
}

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
