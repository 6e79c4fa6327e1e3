// Sixteen floats or eight doubles, whatever the width of the machine's registers. This header and kernels.inc
// are compiled once for each level of vector code, each time inside a namespace of its own, so nothing here
// may be shared between levels: no standard library, or the linker could pick a copy that the machine cannot
// execute.
//
// Every operation is elementwise and rounded once, as IEEE 754 says, so all levels give the same bytes.

struct Floats {
#if defined(__AVX512F__)
  static constexpr int kRegisters = 1;
  __m512 r[1];
#elif defined(__AVX2__)
  static constexpr int kRegisters = 2;
  __m256 r[2];
#else
  static constexpr int kRegisters = 4;
  __m128 r[4];
#endif
};

struct Doubles {
#if defined(__AVX512F__)
  static constexpr int kRegisters = 1;
  __m512d r[1];
#elif defined(__AVX2__)
  static constexpr int kRegisters = 2;
  __m256d r[2];
#else
  static constexpr int kRegisters = 4;
  __m128d r[4];
#endif
};

#if defined(__AVX512F__)
inline __m512 register_of(float x) { return _mm512_set1_ps(x); }
inline __m512d register_of(double x) { return _mm512_set1_pd(x); }
inline __m512 load_register(const float* at, int) { return _mm512_loadu_ps(at); }
inline __m512d load_register(const double* at, int) { return _mm512_load_pd(at); }
inline void store_register(float* at, int, __m512 x) { _mm512_storeu_ps(at, x); }
inline void store_register(double* at, int, __m512d x) { _mm512_store_pd(at, x); }
// 512-bit minimum and maximum have masked forms only in some compilers' headers; these are the plain ones.
inline __m512 min_register(__m512 a, __m512 b) { return _mm512_min_ps(a, b); }
inline __m512 max_register(__m512 a, __m512 b) { return _mm512_max_ps(a, b); }
inline __m512d min_register(__m512d a, __m512d b) { return _mm512_min_pd(a, b); }
inline __m512d max_register(__m512d a, __m512d b) { return _mm512_max_pd(a, b); }
inline __m512 sqrt_register(__m512 a) { return _mm512_sqrt_ps(a); }
inline __m512d sqrt_register(__m512d a) { return _mm512_sqrt_pd(a); }
inline unsigned less_bits(__m512 a, __m512 b) { return _mm512_cmp_ps_mask(a, b, _CMP_LT_OQ); }
inline unsigned less_bits(__m512d a, __m512d b) { return _mm512_cmp_pd_mask(a, b, _CMP_LT_OQ); }
inline __m512 keep_register(__m512 test, __m512 value) {
  return _mm512_maskz_mov_ps(_mm512_cmp_ps_mask(test, _mm512_setzero_ps(), _CMP_NLT_UQ), value);
}
inline __m512i replace_register(__m512 a, __m512 b, __m512i old_value, __m512i new_value) {
  return _mm512_mask_mov_epi32(old_value, _mm512_cmp_ps_mask(a, b, _CMP_LT_OQ), new_value);
}
inline __m512d load_wide(const float* at, int) { return _mm512_cvtps_pd(_mm256_loadu_ps(at)); }
inline void store_narrow(float* at, int, __m512d x) { _mm256_storeu_ps(at, _mm512_cvtpd_ps(x)); }
inline __m512 choose_register(unsigned bits, int, __m512 set, __m512 clear) {
  return _mm512_mask_mov_ps(clear, __mmask16(bits), set);
}
constexpr int kFloatLanes = 16, kDoubleLanes = 8;
using Integers = __m512i;
inline Integers load_integers(const int* at) { return _mm512_load_si512(at); }
inline void store_integers(int* at, Integers x) { _mm512_store_si512(at, x); }
inline Integers integers_of(int x) { return _mm512_set1_epi32(x); }
#elif defined(__AVX2__)
inline __m256 register_of(float x) { return _mm256_set1_ps(x); }
inline __m256d register_of(double x) { return _mm256_set1_pd(x); }
inline __m256 load_register(const float* at, int i) { return _mm256_loadu_ps(at + 8 * i); }
inline __m256d load_register(const double* at, int i) { return _mm256_load_pd(at + 4 * i); }
inline void store_register(float* at, int i, __m256 x) { _mm256_storeu_ps(at + 8 * i, x); }
inline void store_register(double* at, int i, __m256d x) { _mm256_store_pd(at + 4 * i, x); }
inline __m256 min_register(__m256 a, __m256 b) { return _mm256_min_ps(a, b); }
inline __m256 max_register(__m256 a, __m256 b) { return _mm256_max_ps(a, b); }
inline __m256d min_register(__m256d a, __m256d b) { return _mm256_min_pd(a, b); }
inline __m256d max_register(__m256d a, __m256d b) { return _mm256_max_pd(a, b); }
inline __m256 sqrt_register(__m256 a) { return _mm256_sqrt_ps(a); }
inline __m256d sqrt_register(__m256d a) { return _mm256_sqrt_pd(a); }
inline unsigned less_bits(__m256 a, __m256 b) {
  return unsigned(_mm256_movemask_ps(_mm256_cmp_ps(a, b, _CMP_LT_OQ)));
}
inline unsigned less_bits(__m256d a, __m256d b) {
  return unsigned(_mm256_movemask_pd(_mm256_cmp_pd(a, b, _CMP_LT_OQ)));
}
inline __m256 keep_register(__m256 test, __m256 value) {
  return _mm256_andnot_ps(_mm256_cmp_ps(test, _mm256_setzero_ps(), _CMP_LT_OQ), value);
}
inline __m256i replace_register(__m256 a, __m256 b, __m256i old_value, __m256i new_value) {
  return _mm256_blendv_epi8(old_value, new_value, _mm256_castps_si256(_mm256_cmp_ps(a, b, _CMP_LT_OQ)));
}
inline __m256d load_wide(const float* at, int i) { return _mm256_cvtps_pd(_mm_loadu_ps(at + 4 * i)); }
inline void store_narrow(float* at, int i, __m256d x) { _mm_storeu_ps(at + 4 * i, _mm256_cvtpd_ps(x)); }
inline __m256 choose_register(unsigned bits, int i, __m256 set, __m256 clear) {
  const __m256i lane = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
  const __m256i here = _mm256_and_si256(_mm256_set1_epi32(int(bits >> (8 * i))), lane);
  return _mm256_blendv_ps(clear, set, _mm256_castsi256_ps(_mm256_cmpeq_epi32(here, lane)));
}
constexpr int kFloatLanes = 8, kDoubleLanes = 4;
using Integers = __m256i;
inline Integers load_integers(const int* at) {
  return _mm256_load_si256(reinterpret_cast<const __m256i*>(at));
}
inline void store_integers(int* at, Integers x) { _mm256_store_si256(reinterpret_cast<__m256i*>(at), x); }
inline Integers integers_of(int x) { return _mm256_set1_epi32(x); }
#else
inline __m128 register_of(float x) { return _mm_set1_ps(x); }
inline __m128d register_of(double x) { return _mm_set1_pd(x); }
inline __m128 load_register(const float* at, int i) { return _mm_loadu_ps(at + 4 * i); }
inline __m128d load_register(const double* at, int i) { return _mm_load_pd(at + 2 * i); }
inline void store_register(float* at, int i, __m128 x) { _mm_storeu_ps(at + 4 * i, x); }
inline void store_register(double* at, int i, __m128d x) { _mm_store_pd(at + 2 * i, x); }
inline __m128 min_register(__m128 a, __m128 b) { return _mm_min_ps(a, b); }
inline __m128 max_register(__m128 a, __m128 b) { return _mm_max_ps(a, b); }
inline __m128d min_register(__m128d a, __m128d b) { return _mm_min_pd(a, b); }
inline __m128d max_register(__m128d a, __m128d b) { return _mm_max_pd(a, b); }
inline __m128 sqrt_register(__m128 a) { return _mm_sqrt_ps(a); }
inline __m128d sqrt_register(__m128d a) { return _mm_sqrt_pd(a); }
inline unsigned less_bits(__m128 a, __m128 b) { return unsigned(_mm_movemask_ps(_mm_cmplt_ps(a, b))); }
inline unsigned less_bits(__m128d a, __m128d b) { return unsigned(_mm_movemask_pd(_mm_cmplt_pd(a, b))); }
inline __m128 keep_register(__m128 test, __m128 value) {
  return _mm_andnot_ps(_mm_cmplt_ps(test, _mm_setzero_ps()), value);
}
inline __m128i replace_register(__m128 a, __m128 b, __m128i old_value, __m128i new_value) {
  const __m128i less = _mm_castps_si128(_mm_cmplt_ps(a, b));
  return _mm_or_si128(_mm_and_si128(less, new_value), _mm_andnot_si128(less, old_value));
}
inline __m128d load_wide(const float* at, int i) {
  return _mm_cvtps_pd(_mm_loadl_pi(_mm_setzero_ps(), reinterpret_cast<const __m64*>(at + 2 * i)));
}
inline void store_narrow(float* at, int i, __m128d x) {
  _mm_storel_pi(reinterpret_cast<__m64*>(at + 2 * i), _mm_cvtpd_ps(x));
}
inline __m128 choose_register(unsigned bits, int i, __m128 set, __m128 clear) {
  const __m128i lane = _mm_setr_epi32(1, 2, 4, 8);
  const __m128i here = _mm_and_si128(_mm_set1_epi32(int(bits >> (4 * i))), lane);
  const __m128 chosen = _mm_castsi128_ps(_mm_cmpeq_epi32(here, lane));
  return _mm_or_ps(_mm_and_ps(chosen, set), _mm_andnot_ps(chosen, clear));
}
constexpr int kFloatLanes = 4, kDoubleLanes = 2;
using Integers = __m128i;
inline Integers load_integers(const int* at) { return _mm_load_si128(reinterpret_cast<const __m128i*>(at)); }
inline void store_integers(int* at, Integers x) { _mm_store_si128(reinterpret_cast<__m128i*>(at), x); }
inline Integers integers_of(int x) { return _mm_set1_epi32(x); }
#endif

inline Floats all(float x) {
  Floats result;
  for (int i = 0; i < Floats::kRegisters; ++i) result.r[i] = register_of(x);
  return result;
}
inline Floats load(const float* at) {
  Floats result;
  for (int i = 0; i < Floats::kRegisters; ++i) result.r[i] = load_register(at, i);
  return result;
}
inline void store(float* at, Floats x) {
  for (int i = 0; i < Floats::kRegisters; ++i) store_register(at, i, x.r[i]);
}
inline Floats operator+(Floats a, Floats b) {
  for (int i = 0; i < Floats::kRegisters; ++i) a.r[i] = a.r[i] + b.r[i];
  return a;
}
inline Floats operator-(Floats a, Floats b) {
  for (int i = 0; i < Floats::kRegisters; ++i) a.r[i] = a.r[i] - b.r[i];
  return a;
}
inline Floats operator*(Floats a, Floats b) {
  for (int i = 0; i < Floats::kRegisters; ++i) a.r[i] = a.r[i] * b.r[i];
  return a;
}
inline Floats smaller(Floats a, Floats b) {
  for (int i = 0; i < Floats::kRegisters; ++i) a.r[i] = min_register(a.r[i], b.r[i]);
  return a;
}
inline Floats larger(Floats a, Floats b) {
  for (int i = 0; i < Floats::kRegisters; ++i) a.r[i] = max_register(a.r[i], b.r[i]);
  return a;
}
inline Floats square_root(Floats a) {
  for (int i = 0; i < Floats::kRegisters; ++i) a.r[i] = sqrt_register(a.r[i]);
  return a;
}
/// Lanes of `value` where `test` is not below 0, and 0 where it is.
inline Floats where_not_negative(Floats test, Floats value) {
  for (int i = 0; i < Floats::kRegisters; ++i) value.r[i] = keep_register(test.r[i], value.r[i]);
  return value;
}
/// Bits of a comparison: bit i is set where lane i of `a` is less than that of `b`.
inline unsigned less(Floats a, Floats b) {
  unsigned bits = 0;
  for (int i = 0; i < Floats::kRegisters; ++i) bits |= less_bits(a.r[i], b.r[i]) << (i * kFloatLanes);
  return bits;
}

/// Selects lane i of `set` where bit i is set, of `clear` where it is not.
inline Floats choose(unsigned bits, Floats set, Floats clear) {
  for (int i = 0; i < Floats::kRegisters; ++i) clear.r[i] = choose_register(bits, i, set.r[i], clear.r[i]);
  return clear;
}

inline Doubles all(double x) {
  Doubles result;
  for (int i = 0; i < Doubles::kRegisters; ++i) result.r[i] = register_of(x);
  return result;
}
inline Doubles load(const double* at) {
  Doubles result;
  for (int i = 0; i < Doubles::kRegisters; ++i) result.r[i] = load_register(at, i);
  return result;
}
inline void store(double* at, Doubles x) {
  for (int i = 0; i < Doubles::kRegisters; ++i) store_register(at, i, x.r[i]);
}
/// Loads eight floats as doubles; `at` need not be aligned.
inline Doubles widened(const float* at) {
  Doubles result;
  for (int i = 0; i < Doubles::kRegisters; ++i) result.r[i] = load_wide(at, i);
  return result;
}
/// Stores eight values rounded to single precision; `at` need not be aligned.
inline void store_rounded(float* at, Doubles x) {
  for (int i = 0; i < Doubles::kRegisters; ++i) store_narrow(at, i, x.r[i]);
}
inline Doubles operator+(Doubles a, Doubles b) {
  for (int i = 0; i < Doubles::kRegisters; ++i) a.r[i] = a.r[i] + b.r[i];
  return a;
}
inline Doubles operator-(Doubles a, Doubles b) {
  for (int i = 0; i < Doubles::kRegisters; ++i) a.r[i] = a.r[i] - b.r[i];
  return a;
}
inline Doubles operator*(Doubles a, Doubles b) {
  for (int i = 0; i < Doubles::kRegisters; ++i) a.r[i] = a.r[i] * b.r[i];
  return a;
}
inline Doubles operator/(Doubles a, Doubles b) {
  for (int i = 0; i < Doubles::kRegisters; ++i) a.r[i] = a.r[i] / b.r[i];
  return a;
}
inline Doubles smaller(Doubles a, Doubles b) {
  for (int i = 0; i < Doubles::kRegisters; ++i) a.r[i] = min_register(a.r[i], b.r[i]);
  return a;
}
inline Doubles larger(Doubles a, Doubles b) {
  for (int i = 0; i < Doubles::kRegisters; ++i) a.r[i] = max_register(a.r[i], b.r[i]);
  return a;
}
inline Doubles square_root(Doubles a) {
  for (int i = 0; i < Doubles::kRegisters; ++i) a.r[i] = sqrt_register(a.r[i]);
  return a;
}
inline unsigned less(Doubles a, Doubles b) {
  unsigned bits = 0;
  for (int i = 0; i < Doubles::kRegisters; ++i) bits |= less_bits(a.r[i], b.r[i]) << (i * kDoubleLanes);
  return bits;
}
