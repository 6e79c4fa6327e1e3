#include "algorithms/thesis/adaptive_dual_contouring/qef_kernels.h"

#include "algorithms/lattice/simd/vectors.h"

// Plain loops over lanes, compiled as those of winding_kernels.cpp; every lane's operations are the same at
// all levels, and so are its bytes.
namespace hermesh::qef_kernels {
namespace HERMESH_SIMD_LEVEL {
namespace {

inline float larger(float a, float b) { return a < b ? b : a; }

/// Applies Jacobi's rotation in the plane of the axes p and q, which makes their common entry 0; r is the
/// third axis.
[[gnu::always_inline]] inline void rotate(EigenLanes& m, int p, int q, int r) {
  constexpr float kTiny = 1e-30f;
  for (int i = 0; i < kLanes; ++i) {
    const float d = m.diagonal[q][i] - m.diagonal[p][i], e = 2.0f * m.off[r][i];
    // The tangent of the smaller of the two possible angles; with kTiny a matrix of zeros is unchanged.
    const float t =
        __builtin_copysignf(1.0f, d) * e / (__builtin_fabsf(d) + __builtin_sqrtf(d * d + e * e) + kTiny);
    const float c = 1.0f / __builtin_sqrtf(1.0f + t * t), s = t * c;
    m.diagonal[p][i] -= t * m.off[r][i];
    m.diagonal[q][i] += t * m.off[r][i];
    m.off[r][i] = 0.0f;
    const float rp = m.off[q][i], rq = m.off[p][i];
    m.off[q][i] = c * rp - s * rq;
    m.off[p][i] = s * rp + c * rq;
    for (int a = 0; a < 3; ++a) {
      const float vp = m.vectors[p][a][i], vq = m.vectors[q][a][i];
      m.vectors[p][a][i] = c * vp - s * vq;
      m.vectors[q][a][i] = s * vp + c * vq;
    }
  }
}

/// Computes the eigenvalues of AᵀA, which are the squares of A's singular values, and their eigenvectors: for
/// a symmetric 3×3 matrix this replaces the singular value decomposition of A (eq. 6.4).
[[gnu::always_inline]] inline void decompose(EigenLanes& m) {
  for (int k = 0; k < 3; ++k)
    for (int a = 0; a < 3; ++a)
      for (int i = 0; i < kLanes; ++i) m.vectors[k][a][i] = k == a ? 1.0f : 0.0f;
  constexpr int kSweeps = 3;  // a test compares the remainder with a solver in double precision
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    rotate(m, 0, 1, 2);
    rotate(m, 0, 2, 1);
    rotate(m, 1, 2, 0);
  }
}

void solve(EigenLanes& m, float truncation, const Lanes (&slopes)[3], Lanes (&step)[3]) {
  decompose(m);
  // Squares of singular values are compared.
  const float share = truncation * truncation;
  for (int i = 0; i < kLanes; ++i) {
    const float largest = larger(m.diagonal[0][i], larger(m.diagonal[1][i], m.diagonal[2][i]));
    step[0][i] = step[1][i] = step[2][i] = 0.0f;
    for (int k = 0; k < 3; ++k) {
      const float value = m.diagonal[k][i];
      const auto& v = m.vectors[k];
      const float along = v[0][i] * slopes[0][i] + v[1][i] * slopes[1][i] + v[2][i] * slopes[2][i];
      const float scale = value > share * largest ? along / value : 0.0f;  // false if all are 0
      for (int a = 0; a < 3; ++a) step[a][i] += scale * v[a][i];
    }
  }
}

}  // namespace
}  // namespace HERMESH_SIMD_LEVEL

constinit const Kernels Kernels::HERMESH_SIMD_LEVEL = {simd::kLevel, HERMESH_SIMD_LEVEL::solve};

}  // namespace hermesh::qef_kernels
