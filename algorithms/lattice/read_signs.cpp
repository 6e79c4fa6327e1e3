#include "algorithms/lattice/read_signs.h"

#include <cmath>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

#include "algorithms/lattice/simd/simd_level.h"

namespace hermesh {
namespace {

// A comparison of magnitudes as whole numbers finds what is no number: with the sign bit cleared, floats are ordered as
// their bits are, and infinity and all NaNs come after the largest finite number.
//
// A sample is compared with the isovalue instead of signed_value() with 0. Both decide alike, because the difference of
// two floats that are not equal is never rounded to 0; and where greater is inside, the comparison is turned about.
#if defined(__x86_64__)
constexpr std::int32_t kMagnitude = 0x7fffffff, kLargestFinite = 0x7f7fffff;

bool read_signs_sse2(const float* values, const InsideRule& rule, BlockMask& inside) {
  const __m128 iso = _mm_set1_ps(rule.isovalue);
  const __m128i magnitude = _mm_set1_epi32(kMagnitude), largest = _mm_set1_epi32(kLargestFinite);
  __m128i bad = _mm_setzero_si128();
  // A word is a layer along x: 64 samples in a row of memory, whose comparisons are its bits in order.
  for (std::size_t word = 0; word < 8; ++word) {
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < 16; ++i) {
      const __m128 v = _mm_loadu_ps(values + 64 * word + 4 * i);
      const __m128 in = rule.scale > 0 ? _mm_cmplt_ps(v, iso) : _mm_cmpgt_ps(v, iso);
      bits |= static_cast<std::uint64_t>(_mm_movemask_ps(in)) << (4 * i);
      // SSE2 has no maximum of integers of 32 bits, so each comparison is kept instead of the greatest magnitude.
      bad = _mm_or_si128(bad, _mm_cmpgt_epi32(_mm_and_si128(_mm_castps_si128(v), magnitude), largest));
    }
    inside[word] = bits;
  }
  return _mm_movemask_epi8(bad) == 0;
}

[[gnu::target("avx2")]] bool read_signs_avx2(const float* values, const InsideRule& rule, BlockMask& inside) {
  const __m256 iso = _mm256_set1_ps(rule.isovalue);
  const __m256i magnitude = _mm256_set1_epi32(kMagnitude);
  // The greatest magnitude of each lane is enough: one comparison after the loop tells whether any was not finite.
  __m256i greatest = _mm256_setzero_si256();
  for (std::size_t word = 0; word < 8; ++word) {
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < 8; ++i) {
      const __m256 v = _mm256_loadu_ps(values + 64 * word + 8 * i);
      // Comparisons are ordered: what is no number counts as outside here, and the leaf is refused for it.
      const __m256 in = rule.scale > 0 ? _mm256_cmp_ps(v, iso, _CMP_LT_OQ) : _mm256_cmp_ps(v, iso, _CMP_GT_OQ);
      bits |= static_cast<std::uint64_t>(static_cast<unsigned>(_mm256_movemask_ps(in))) << (8 * i);
      greatest = _mm256_max_epi32(greatest, _mm256_and_si256(_mm256_castps_si256(v), magnitude));
    }
    inside[word] = bits;
  }
  return _mm256_movemask_epi8(_mm256_cmpgt_epi32(greatest, _mm256_set1_epi32(kLargestFinite))) == 0;
}

[[gnu::target("avx512f")]] bool read_signs_avx512(const float* values, const InsideRule& rule, BlockMask& inside) {
  const __m512 iso = _mm512_set1_ps(rule.isovalue);
  const __m512i magnitude = _mm512_set1_epi32(kMagnitude);
  __m512i greatest = _mm512_setzero_si512();
  for (std::size_t word = 0; word < 8; ++word) {
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      const __m512 v = _mm512_loadu_ps(values + 64 * word + 16 * i);
      const __mmask16 in =
          rule.scale > 0 ? _mm512_cmp_ps_mask(v, iso, _CMP_LT_OQ) : _mm512_cmp_ps_mask(v, iso, _CMP_GT_OQ);
      bits |= std::uint64_t{in} << (16 * i);
      // (With a mask, because without one GCC 12 takes the intrinsic's unused operand for one that is read.)
      greatest = _mm512_mask_max_epi32(greatest, 0xffff, greatest, _mm512_and_si512(_mm512_castps_si512(v), magnitude));
    }
    inside[word] = bits;
  }
  return _mm512_cmpgt_epi32_mask(greatest, _mm512_set1_epi32(kLargestFinite)) == 0;
}

// Rows are read for layers of edges across leaves. Nobody looks for samples that are not finite here; leaf() does that.
std::uint64_t read_rows_sse2(const float* values, std::size_t stride, const InsideRule& rule) {
  const __m128 iso = _mm_set1_ps(rule.isovalue);
  std::uint64_t bits = 0;
  for (std::size_t row = 0; row < 8; ++row)
    // A row is a byte of the result, and two vectors of four samples.
    for (std::size_t half = 0; half < 2; ++half) {
      const __m128 v = _mm_loadu_ps(values + stride * row + 4 * half);
      const __m128 in = rule.scale > 0 ? _mm_cmplt_ps(v, iso) : _mm_cmpgt_ps(v, iso);
      bits |= static_cast<std::uint64_t>(_mm_movemask_ps(in)) << (8 * row + 4 * half);
    }
  return bits;
}

[[gnu::target("avx2")]] std::uint64_t read_rows_avx2(const float* values, std::size_t stride, const InsideRule& rule) {
  const __m256 iso = _mm256_set1_ps(rule.isovalue);
  std::uint64_t bits = 0;
  for (std::size_t row = 0; row < 8; ++row) {
    const __m256 v = _mm256_loadu_ps(values + stride * row);
    const __m256 in = rule.scale > 0 ? _mm256_cmp_ps(v, iso, _CMP_LT_OQ) : _mm256_cmp_ps(v, iso, _CMP_GT_OQ);
    bits |= static_cast<std::uint64_t>(static_cast<unsigned>(_mm256_movemask_ps(in))) << (8 * row);
  }
  return bits;
}

// A row of eight samples is one vector of AVX2, so that AVX-512 has nothing to add there.
constexpr SignReader kSse2{read_signs_sse2, read_rows_sse2}, kAvx2{read_signs_avx2, read_rows_avx2},
    kAvx512{read_signs_avx512, read_rows_avx2};
#else
// On other processors the rule itself decides, one sample after the other.
bool read_signs_plain(const float* values, const InsideRule& rule, BlockMask& inside) {
  bool finite = true;
  inside = {};
  for (std::size_t i = 0; i < 512; ++i) {
    inside[i >> 6] |= static_cast<std::uint64_t>(rule(values[i])) << (i & 63);
    finite = finite && std::isfinite(values[i]);
  }
  return finite;
}
std::uint64_t read_rows_plain(const float* values, std::size_t stride, const InsideRule& rule) {
  std::uint64_t bits = 0;
  for (std::size_t row = 0; row < 8; ++row)
    for (std::size_t z = 0; z < 8; ++z)
      bits |= static_cast<std::uint64_t>(rule(values[stride * row + z])) << (8 * row + z);
  return bits;
}

constexpr SignReader kSse2{read_signs_plain, read_rows_plain}, kAvx2 = kSse2, kAvx512 = kSse2;
#endif

}  // namespace

const SignReader& chosen_sign_reader() { return of_level(chosen_simd_level(), kSse2, kAvx2, kAvx512); }

}  // namespace hermesh
