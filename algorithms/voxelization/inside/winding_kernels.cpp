#include "algorithms/voxelization/inside/winding_kernels.h"

#include "algorithms/lattice/simd/vectors.h"

// Plain loops, compiled with -fno-math-errno and -fno-trapping-math: square roots that set errno and
// comparisons that may trap could not be taken several at a time. All operations are of one lane and
// contraction is off, so wider registers give the same bits.
namespace hermesh::winding {
namespace HERMESH_SIMD_LEVEL {
namespace {

inline float square_root(float x) { return __builtin_sqrtf(x); }
inline double square_root(double x) { return __builtin_sqrt(x); }

/// atan(q)/q as a polynomial in q², for q in 0…1; the least relative error of its degree, 6.5e-7.
template <class Real>
[[gnu::always_inline]] inline Real arctan(Real q) {
  const Real s = q * q;
  Real p = Real(7.863377e-3);
  p = p * s - Real(3.7013002e-2);
  p = p * s + Real(8.3871192e-2);
  p = p * s - Real(1.34871915e-1);
  p = p * s + Real(1.98814825e-1);
  p = p * s - Real(3.33265149e-1);
  p = p * s + Real(9.99999348e-1);
  return p * q;
}

/// Returns atan2(y, x), and 0 rather than NaN if both are 0.
template <class Real>
[[gnu::always_inline]] inline Real arctan2(Real y, Real x) {
  constexpr Real kPi = Real(3.14159265358979324), kTiny = Real(1e-36);
  const Real ay = y < 0 ? -y : y, ax = x < 0 ? -x : x;
  const Real low = ay < ax ? ay : ax, high = ay < ax ? ax : ay;
  Real angle = arctan(low / (high + kTiny));
  angle = ay > ax ? kPi / 2 - angle : angle;
  angle = x < 0 ? kPi - angle : angle;
  return y < 0 ? -angle : angle;
}

/// Adds a triangle's solid angle at each point: van Oosterom & Strackee, The Solid Angle of a Plane Triangle,
/// IEEE Trans. Biomed. Eng. 30(2), 1983, eq. 8. The loop has scalars only, which the compiler can turn
/// into lanes.
template <class Real>
void add_solid_angle(const PlacedTriangle<Real>& triangle, const Targets& targets) {
  const auto [a, b, c] = triangle.corner;
  const Real nx = triangle.normal[0], ny = triangle.normal[1], nz = triangle.normal[2];
  const Real offset = triangle.offset;
  const Real a0 = a[0], a1 = a[1], a2 = a[2], b0 = b[0], b1 = b[1], b2 = b[2], c0 = c[0], c1 = c[1],
             c2 = c[2];
  const float* __restrict px = targets.x;
  const float* __restrict py = targets.y;
  const float* __restrict pz = targets.z;
  float* __restrict sum = targets.solid_angle;
  for (std::size_t i = 0; i < targets.count; ++i) {
    const Real x = Real(px[i]), y = Real(py[i]), z = Real(pz[i]);
    const Real ax = a0 - x, ay = a1 - y, az = a2 - z;
    const Real bx = b0 - x, by = b1 - y, bz = b2 - z;
    const Real cx = c0 - x, cy = c1 - y, cz = c2 - z;
    const Real la = square_root(ax * ax + ay * ay + az * az);
    const Real lb = square_root(bx * bx + by * by + bz * bz);
    const Real lc = square_root(cx * cx + cy * cy + cz * cz);
    const Real ab = ax * bx + ay * by + az * bz;
    const Real bc = bx * cx + by * cy + bz * cz;
    const Real ca = cx * ax + cy * ay + cz * az;
    // The triple product of equation 8 by the triangle's plane, which is the same for all points.
    const Real volume = offset - (nx * x + ny * y + nz * z);
    sum[i] += float(2 * arctan2(volume, la * (lb * lc + bc) + lb * ca + lc * ab));
  }
}

// With R from the point to the centre, R/|R|³ and its derivatives contracted with the moments:
// ∫n·R/|R|³ − 3 RᵀBR/|R|⁵ + 15/2 C(R,R,R)/|R|⁷.
void add_multipole(const Multipole& multipole, const float centre[3], const Targets& targets) {
  float b[6], c[10];
  // A symmetric tensor's components off the diagonal count as often as their indices can be ordered: 2 of a
  // pair; 3 of a triple with two equal, 6 of one with none.
  for (int k = 0; k < 6; ++k) b[k] = multipole.second[k] * (k == 1 || k == 2 || k == 4 ? -6.0f : -3.0f);
  for (int k = 0; k < 10; ++k)
    c[k] = multipole.third[k] * (k == 0 || k == 6 || k == 9 ? 7.5f : k == 4 ? 45.0f : 22.5f);
  const float a0 = multipole.first[0], a1 = multipole.first[1], a2 = multipole.first[2];
  const float per_radius = 1.0f / multipole.radius;
  const float c0 = centre[0], c1 = centre[1], c2 = centre[2];
  const float* __restrict px = targets.x;
  const float* __restrict py = targets.y;
  const float* __restrict pz = targets.z;
  float* __restrict sum = targets.solid_angle;
  for (std::size_t i = 0; i < targets.count; ++i) {
    const float x = (c0 - px[i]) * per_radius, y = (c1 - py[i]) * per_radius, z = (c2 - pz[i]) * per_radius;
    const float s = 1.0f / (x * x + y * y + z * z);
    const float linear = a0 * x + a1 * y + a2 * z;
    const float square = x * (b[0] * x + b[1] * y + b[2] * z) + y * (b[3] * y + b[4] * z) + b[5] * z * z;
    const float cube = x * (x * (c[0] * x + c[1] * y + c[2] * z) + y * (c[3] * y + c[4] * z) + c[5] * z * z) +
                       y * (y * (c[6] * y + c[7] * z) + c[8] * z * z) + c[9] * z * z * z;
    sum[i] += (linear + s * (square + s * cube)) * s * square_root(s);
  }
}

}  // namespace
}  // namespace HERMESH_SIMD_LEVEL

constinit const Kernels Kernels::HERMESH_SIMD_LEVEL = {simd::kLevel, HERMESH_SIMD_LEVEL::add_multipole,
                                                       HERMESH_SIMD_LEVEL::add_solid_angle<float>,
                                                       HERMESH_SIMD_LEVEL::add_solid_angle<double>};

}  // namespace hermesh::winding
