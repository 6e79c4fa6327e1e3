// Several numbers at once, in registers as wide as the SIMD level of a source, and fixed numbers of them in
// as many registers as necessary. The compiler's own vector types: operators are elementwise, a comparison
// gives −1 or 0 in each lane, and `mask ? a : b` selects lane by lane. This header has the missing
// operations.
//
// Only for kernels, which are compiled once per level (see simd_level.h). Nothing here has external linkage,
// because the linker may take code shared by two levels from either; kernels do not call the standard library
// for the same reason. Every operation is elementwise and rounded once, as IEEE 754 specifies, so all levels
// give the same bytes.
//
// Also with AVX-512, vectors are of eight floats, unless HERMESH_WIDEST_VECTORS is defined: of the few dozen
// edges of a single leaf along an axis sixteen lanes would leave more idle than they gain.
#pragma once

#include <immintrin.h>

#include <cstdint>

#include "algorithms/lattice/simd/simd_level.h"

#if defined(__AVX512F__) && defined(HERMESH_WIDEST_VECTORS)
#define HERMESH_SIXTEEN_LANES
#endif

namespace hermesh::simd {
namespace {

/// The level that the compiler was given.
#if defined(__AVX512F__)
constexpr SimdLevel kLevel = SimdLevel::avx512;
#elif defined(__AVX2__)
constexpr SimdLevel kLevel = SimdLevel::avx2;
#else
constexpr SimdLevel kLevel = SimdLevel::sse2;
#endif

// ---- In one register.

#if defined(HERMESH_SIXTEEN_LANES)
constexpr int kLanes = 16;
#elif defined(__AVX2__)
constexpr int kLanes = 8;
#else
constexpr int kLanes = 4;
#endif
typedef float Floats __attribute__((vector_size(4 * kLanes)));
typedef double Doubles __attribute__((vector_size(4 * kLanes)));  ///< half as many
typedef std::int32_t Ints __attribute__((vector_size(4 * kLanes)));
typedef std::uint16_t Shorts __attribute__((vector_size(2 * kLanes)));

inline Floats all(float x) { return x - Floats{}; }
inline Doubles all(double x) { return x - Doubles{}; }
inline Ints all(int x) { return x - Ints{}; }
inline Floats load(const float* at) {
  Floats result;
  __builtin_memcpy(&result, at, sizeof result);
  return result;
}
inline Ints load(const std::int32_t* at) {
  Ints result;
  __builtin_memcpy(&result, at, sizeof result);
  return result;
}
/// Doubles are aligned to a register.
inline Doubles load(const double* at) {
  Doubles result;
  __builtin_memcpy(&result, __builtin_assume_aligned(at, sizeof result), sizeof result);
  return result;
}
inline void store(float* at, Floats x) { __builtin_memcpy(at, &x, sizeof x); }
inline void store(std::int32_t* at, Ints x) { __builtin_memcpy(at, &x, sizeof x); }
inline void store(double* at, Doubles x) {
  __builtin_memcpy(__builtin_assume_aligned(at, sizeof x), &x, sizeof x);
}
inline Ints widened(const std::uint16_t* at) {
  Shorts shorts;
  __builtin_memcpy(&shorts, at, sizeof shorts);
  return __builtin_convertvector(shorts, Ints);
}
inline Floats to_floats(Ints x) { return __builtin_convertvector(x, Floats); }
inline Floats magnitude(Floats x) { return (Floats)((Ints)x & 0x7fffffff); }
/// Returns x where the mask is −1, else 0.
inline Floats kept(Ints mask, Floats x) { return (Floats)((Ints)x & mask); }

/// Loads two numbers from each address.
inline __m128 two_pairs(const float* first, const float* second) {
  const __m128i low = _mm_loadl_epi64(reinterpret_cast<const __m128i*>(first));
  return _mm_loadh_pi(_mm_castsi128_ps(low), reinterpret_cast<const __m64*>(second));
}

// Of each width: smaller and larger are b if either is NaN, as in hardware; less gives a bit per lane;
// kept_unless_negative() is x if `test` is not below 0, else 0.
#if defined(HERMESH_SIXTEEN_LANES)
constexpr Ints kLaneBits{1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 2048, 4096, 8192, 16384, 32768};
inline Floats smaller(Floats a, Floats b) { return (Floats)_mm512_min_ps((__m512)a, (__m512)b); }
inline Doubles smaller(Doubles a, Doubles b) { return (Doubles)_mm512_min_pd((__m512d)a, (__m512d)b); }
inline Floats larger(Floats a, Floats b) { return (Floats)_mm512_max_ps((__m512)a, (__m512)b); }
inline Doubles larger(Doubles a, Doubles b) { return (Doubles)_mm512_max_pd((__m512d)a, (__m512d)b); }
inline Floats square_root(Floats x) { return (Floats)_mm512_sqrt_ps((__m512)x); }
inline Doubles square_root(Doubles x) { return (Doubles)_mm512_sqrt_pd((__m512d)x); }
inline unsigned less(Floats a, Floats b) { return _mm512_cmp_ps_mask((__m512)a, (__m512)b, _CMP_LT_OQ); }
inline unsigned less(Doubles a, Doubles b) { return _mm512_cmp_pd_mask((__m512d)a, (__m512d)b, _CMP_LT_OQ); }
inline bool any(Ints mask) { return _mm512_test_epi32_mask((__m512i)mask, (__m512i)mask) != 0; }
inline Floats kept_unless_negative(Floats test, Floats x) {
  return (Floats)_mm512_maskz_mov_ps(_mm512_cmp_ps_mask((__m512)test, _mm512_setzero_ps(), _CMP_NLT_UQ),
                                     (__m512)x);
}
inline Doubles load_widened(const float* at) { return (Doubles)_mm512_cvtps_pd(_mm256_loadu_ps(at)); }
inline void store_rounded(float* at, Doubles x) { _mm256_storeu_ps(at, _mm512_cvtpd_ps((__m512d)x)); }
inline Floats low_pairs(Floats a, Floats b) { return (Floats)_mm512_unpacklo_ps((__m512)a, (__m512)b); }
inline Floats high_pairs(Floats a, Floats b) { return (Floats)_mm512_unpackhi_ps((__m512)a, (__m512)b); }
inline Floats low_halves(Floats a, Floats b) { return (Floats)_mm512_shuffle_ps((__m512)a, (__m512)b, 0x44); }
inline Floats high_halves(Floats a, Floats b) {
  return (Floats)_mm512_shuffle_ps((__m512)a, (__m512)b, 0xee);
}
template <class Row>
inline Floats joined(Row&& row) {
  const __m512 two = _mm512_insertf32x4(_mm512_castps128_ps512(row(0)), row(1), 1);
  return (Floats)_mm512_insertf32x4(_mm512_insertf32x4(two, row(2), 2), row(3), 3);
}
#elif defined(__AVX2__)
constexpr Ints kLaneBits{1, 2, 4, 8, 16, 32, 64, 128};
inline Floats smaller(Floats a, Floats b) { return (Floats)_mm256_min_ps((__m256)a, (__m256)b); }
inline Doubles smaller(Doubles a, Doubles b) { return (Doubles)_mm256_min_pd((__m256d)a, (__m256d)b); }
inline Floats larger(Floats a, Floats b) { return (Floats)_mm256_max_ps((__m256)a, (__m256)b); }
inline Doubles larger(Doubles a, Doubles b) { return (Doubles)_mm256_max_pd((__m256d)a, (__m256d)b); }
inline Floats square_root(Floats x) { return (Floats)_mm256_sqrt_ps((__m256)x); }
inline Doubles square_root(Doubles x) { return (Doubles)_mm256_sqrt_pd((__m256d)x); }
inline unsigned less(Floats a, Floats b) { return unsigned(_mm256_movemask_ps((__m256)(a < b))); }
inline unsigned less(Doubles a, Doubles b) { return unsigned(_mm256_movemask_pd((__m256d)(a < b))); }
inline bool any(Ints mask) { return _mm256_movemask_epi8((__m256i)mask) != 0; }
inline Floats kept_unless_negative(Floats test, Floats x) {
  return (Floats)_mm256_andnot_ps((__m256)(test < 0.0f), (__m256)x);
}
inline Doubles load_widened(const float* at) { return (Doubles)_mm256_cvtps_pd(_mm_loadu_ps(at)); }
inline void store_rounded(float* at, Doubles x) { _mm_storeu_ps(at, _mm256_cvtpd_ps((__m256d)x)); }
inline Floats low_pairs(Floats a, Floats b) { return (Floats)_mm256_unpacklo_ps((__m256)a, (__m256)b); }
inline Floats high_pairs(Floats a, Floats b) { return (Floats)_mm256_unpackhi_ps((__m256)a, (__m256)b); }
inline Floats low_halves(Floats a, Floats b) { return (Floats)_mm256_shuffle_ps((__m256)a, (__m256)b, 0x44); }
inline Floats high_halves(Floats a, Floats b) {
  return (Floats)_mm256_shuffle_ps((__m256)a, (__m256)b, 0xee);
}
template <class Row>
inline Floats joined(Row&& row) {
  return (Floats)_mm256_insertf128_ps(_mm256_castps128_ps256(row(0)), row(1), 1);
}
inline Floats gather(const float* base, Ints index) {
  return (Floats)_mm256_i32gather_ps(base, (__m256i)index, 4);
}
inline void gather_pairs(const float* base, Ints index, Floats& first, Floats& second) {
  // Two loads of pairs and a shuffle are cheaper than two gathers of single numbers.
  std::int32_t at[8];
  __builtin_memcpy(at, &index, sizeof at);
  const auto two = [&](int i, int j) { return two_pairs(base + at[i], base + at[j]); };
  const __m256 a = _mm256_setr_m128(two(0, 1), two(4, 5)), b = _mm256_setr_m128(two(2, 3), two(6, 7));
  first = (Floats)_mm256_shuffle_ps(a, b, 0x88), second = (Floats)_mm256_shuffle_ps(a, b, 0xdd);
}
inline Ints gather(const int* base, Ints index) {
  return (Ints)_mm256_i32gather_epi32(base, (__m256i)index, 4);
}
#else
constexpr Ints kLaneBits{1, 2, 4, 8};
inline Floats smaller(Floats a, Floats b) { return (Floats)_mm_min_ps((__m128)a, (__m128)b); }
inline Doubles smaller(Doubles a, Doubles b) { return (Doubles)_mm_min_pd((__m128d)a, (__m128d)b); }
inline Floats larger(Floats a, Floats b) { return (Floats)_mm_max_ps((__m128)a, (__m128)b); }
inline Doubles larger(Doubles a, Doubles b) { return (Doubles)_mm_max_pd((__m128d)a, (__m128d)b); }
inline Floats square_root(Floats x) { return (Floats)_mm_sqrt_ps((__m128)x); }
inline Doubles square_root(Doubles x) { return (Doubles)_mm_sqrt_pd((__m128d)x); }
inline unsigned less(Floats a, Floats b) { return unsigned(_mm_movemask_ps((__m128)(a < b))); }
inline unsigned less(Doubles a, Doubles b) { return unsigned(_mm_movemask_pd((__m128d)(a < b))); }
inline bool any(Ints mask) { return _mm_movemask_epi8((__m128i)mask) != 0; }
inline Floats kept_unless_negative(Floats test, Floats x) {
  return (Floats)_mm_andnot_ps((__m128)(test < 0.0f), (__m128)x);
}
inline Doubles load_widened(const float* at) {
  return (Doubles)_mm_cvtps_pd(_mm_loadl_pi(_mm_setzero_ps(), reinterpret_cast<const __m64*>(at)));
}
inline void store_rounded(float* at, Doubles x) {
  _mm_storel_pi(reinterpret_cast<__m64*>(at), _mm_cvtpd_ps((__m128d)x));
}
inline Floats low_pairs(Floats a, Floats b) { return (Floats)_mm_unpacklo_ps((__m128)a, (__m128)b); }
inline Floats high_pairs(Floats a, Floats b) { return (Floats)_mm_unpackhi_ps((__m128)a, (__m128)b); }
inline Floats low_halves(Floats a, Floats b) { return (Floats)_mm_shuffle_ps((__m128)a, (__m128)b, 0x44); }
inline Floats high_halves(Floats a, Floats b) { return (Floats)_mm_shuffle_ps((__m128)a, (__m128)b, 0xee); }
template <class Row>
inline Floats joined(Row&& row) {
  return (Floats)row(0);
}
inline Floats gather(const float* base, Ints index) {
  return Floats{base[index[0]], base[index[1]], base[index[2]], base[index[3]]};
}
inline void gather_pairs(const float* base, Ints index, Floats& first, Floats& second) {
  first = gather(base, index), second = gather(base + 1, index);
}
inline Ints gather(const int* base, Ints index) {
  return Ints{base[index[0]], base[index[1]], base[index[2]], base[index[3]]};
}
#endif

/// Returns −1 in the lanes whose bits are set.
inline Ints mask_of(unsigned bits) { return (all(int(bits)) & kLaneBits) == kLaneBits; }

/// Rows of eight floats, their first samples `stride` apart: as many as a vector holds, or a vector's part of
/// one.
constexpr int kRows = kLanes < 8 ? 1 : kLanes / 8;
inline Floats load_rows(const float* first, std::size_t stride) {
#if defined(HERMESH_SIXTEEN_LANES)
  if (!(__builtin_constant_p(stride) && stride == 8))
    return (Floats)_mm512_insertf64x4((__m512d)_mm512_castps256_ps512(_mm256_loadu_ps(first)),
                                      (__m256d)_mm256_loadu_ps(first + stride), 1);
#endif
  static_cast<void>(stride);
  return load(first);
}

/// Four numbers of 32 bits in each lane of four vectors; in memory, rows of four.
struct Rows4 {
  Floats column[4];

  /// Builds row i of kLanes from `row(i)`, four numbers in a register.
  template <class Row>
  static Rows4 of(Row&& row) {
    Rows4 result;
    for (int k = 0; k < 4; ++k) result.column[k] = joined([&](int j) { return row(4 * j + k); });
    result.transpose();
    return result;
  }
  /// Loads row i from `row(i)`, a pointer to four numbers.
  template <class Row>
  static Rows4 gathered(Row&& row) {
    return of([&](int i) { return _mm_loadu_ps(reinterpret_cast<const float*>(row(i))); });
  }
  /// Rows 0 to `count` − 1 one after the other.
  void store_rows(void* out, int count) const {
    Rows4 rows = *this;
    rows.transpose();
    char* at = static_cast<char*>(out);
    if (count >= kLanes) {
      for (int i = 0; i < kLanes; ++i) rows.store_row(at + 16 * i, i);
    } else {
      for (int i = 0; i < count; ++i) rows.store_row(at + 16 * i, i);
    }
  }

  /// Stores all rows, in the order in which a transposition within each 16 bytes leaves them.
  void store_transposed(float* out) const {
    Rows4 rows = *this;
    rows.transpose();
    for (int k = 0; k < 4; ++k) store(out + kLanes * k, rows.column[k]);
  }
  /// Stores row i at `where(i)`.
  template <class Where>
  void scatter_rows(Where&& where) const {
    Rows4 rows = *this;
    rows.transpose();
    for (int i = 0; i < kLanes; ++i) rows.store_row(reinterpret_cast<char*>(where(i)), i);
  }

 private:
  void store_row(char* at, int i) const {
    __builtin_memcpy(at, reinterpret_cast<const char*>(&column[i & 3]) + 16 * (i >> 2), 16);
  }
  /// Transposes within each 16 bytes. Row i lies in vector i mod 4.
  void transpose() {
    const Floats a = low_pairs(column[0], column[1]), b = high_pairs(column[0], column[1]);
    const Floats c = low_pairs(column[2], column[3]), d = high_pairs(column[2], column[3]);
    column[0] = low_halves(a, c);
    column[1] = high_halves(a, c);
    column[2] = low_halves(b, d);
    column[3] = high_halves(b, d);
  }
};

// ---- A fixed number, in as many registers as it takes.

template <class Register, int registers>
struct Several {
  static constexpr int kRegisters = registers,
                       kLanesEach = sizeof(Register) / sizeof(decltype(Register{}[0] + 0));
  Register r[registers];
};
using Floats16 = Several<Floats, 16 / kLanes>;
using Doubles8 = Several<Doubles, 16 / kLanes>;

inline Floats16 sixteen(float x) {
  Floats16 result;
  for (Floats& r : result.r) r = all(x);
  return result;
}
inline Floats16 sixteen(const float* at) {
  Floats16 result;
  for (int i = 0; i < Floats16::kRegisters; ++i) result.r[i] = load(at + kLanes * i);
  return result;
}
inline Doubles8 eight(double x) {
  Doubles8 result;
  for (Doubles& r : result.r) r = all(x);
  return result;
}
inline Doubles8 eight(const double* at) {
  Doubles8 result;
  for (int i = 0; i < Doubles8::kRegisters; ++i) result.r[i] = load(at + kLanes / 2 * i);
  return result;
}
inline Doubles8 eight(const float* at) {
  Doubles8 result;
  for (int i = 0; i < Doubles8::kRegisters; ++i) result.r[i] = load_widened(at + kLanes / 2 * i);
  return result;
}
template <class R, int n, class Number>
inline void store(Number* at, Several<R, n> x) {
  for (int i = 0; i < n; ++i) store(at + x.kLanesEach * i, x.r[i]);
}
/// In single precision; `at` need not be aligned.
inline void store_rounded(float* at, Doubles8 x) {
  for (int i = 0; i < Doubles8::kRegisters; ++i) store_rounded(at + kLanes / 2 * i, x.r[i]);
}

template <class R, int n>
inline Several<R, n> operator+(Several<R, n> a, Several<R, n> b) {
  for (int i = 0; i < n; ++i) a.r[i] += b.r[i];
  return a;
}
template <class R, int n>
inline Several<R, n> operator-(Several<R, n> a, Several<R, n> b) {
  for (int i = 0; i < n; ++i) a.r[i] -= b.r[i];
  return a;
}
template <class R, int n>
inline Several<R, n> operator*(Several<R, n> a, Several<R, n> b) {
  for (int i = 0; i < n; ++i) a.r[i] *= b.r[i];
  return a;
}
template <class R, int n>
inline Several<R, n> operator/(Several<R, n> a, Several<R, n> b) {
  for (int i = 0; i < n; ++i) a.r[i] /= b.r[i];
  return a;
}
template <class R, int n>
inline Several<R, n> smaller(Several<R, n> a, Several<R, n> b) {
  for (int i = 0; i < n; ++i) a.r[i] = smaller(a.r[i], b.r[i]);
  return a;
}
template <class R, int n>
inline Several<R, n> larger(Several<R, n> a, Several<R, n> b) {
  for (int i = 0; i < n; ++i) a.r[i] = larger(a.r[i], b.r[i]);
  return a;
}
template <class R, int n>
inline Several<R, n> square_root(Several<R, n> x) {
  for (R& r : x.r) r = square_root(r);
  return x;
}
template <class R, int n>
inline unsigned less(Several<R, n> a, Several<R, n> b) {
  unsigned bits = 0;
  for (int i = 0; i < n; ++i) bits |= less(a.r[i], b.r[i]) << (a.kLanesEach * i);
  return bits;
}
inline Floats16 kept_unless_negative(Floats16 test, Floats16 x) {
  for (int i = 0; i < Floats16::kRegisters; ++i) x.r[i] = kept_unless_negative(test.r[i], x.r[i]);
  return x;
}
/// Returns lane i of `set` where bit i is set, otherwise of `clear`.
inline Floats16 choose(unsigned bits, Floats16 set, Floats16 clear) {
  for (int i = 0; i < Floats16::kRegisters; ++i)
    clear.r[i] = mask_of(bits >> (kLanes * i)) ? set.r[i] : clear.r[i];
  return clear;
}

}  // namespace
}  // namespace hermesh::simd
