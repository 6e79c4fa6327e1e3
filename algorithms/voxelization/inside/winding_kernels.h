// The inner loops of the winding number, over points that the compiler turns into lanes.
#pragma once

#include <cstddef>

#include "algorithms/lattice/simd/simd_level.h"

namespace hermesh::winding {

/// Points relative to an origin near them, in voxels, and the sum of solid angles at each, 4π for once
/// around. Every point has its own sum, so the bits do not depend on the number of lanes.
struct Targets {
  const float *x, *y, *z;
  float* solid_angle;
  std::size_t count;
};

/// Field of the triangles in a box, seen from afar: their area vectors n and the distances u from the box's
/// centre integrated up to second order, for a radius of 1 (Barill et al., Fast Winding Numbers for Soups and
/// Clouds, ACM TOG 37(4), 2018, equations 7–9). The field is harmonic, so symmetric tensors without traces
/// are sufficient.
struct Multipole {
  float radius = -1;  ///< in voxels, of a sphere about the box's centre that holds the triangles; −1: empty
  float first[3]{};   ///< ∫ n
  float second[6]{};  ///< ∫ n u: xx xy xz yy yz zz
  float third[10]{};  ///< ∫ n u u: xxx xxy xxz xyy xyz xzz yyy yyz yzz zzz
};

/// A triangle, and its plane: normal · (corner − p) is six times the volume of the tetrahedron with apex p.
template <class Real>
struct PlacedTriangle {
  Real corner[3][3];  ///< relative to the targets' origin
  Real normal[3];     ///< b−a cross c−a
  Real offset;        ///< normal · corner
};

/// See simd_level.h.
struct Kernels {
  SimdLevel level;
  /// Adds the field of the triangles in a box at points outside its sphere. `centre` is the box's, relative
  /// to the targets' origin.
  void (*add_multipole)(const Multipole& multipole, const float centre[3], const Targets& targets);
  /// Adds the solid angle of a triangle to within 3e-6; nothing for a point in its plane but outside it.
  void (*add_triangle)(const PlacedTriangle<float>& triangle, const Targets& targets);
  /// As add_triangle(), in double precision, for triangles that are large compared with the distances
  /// between the points.
  void (*add_large_triangle)(const PlacedTriangle<double>& triangle, const Targets& targets);
  static const Kernels sse2, avx2, avx512;
};

}  // namespace hermesh::winding
