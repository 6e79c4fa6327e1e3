// The octahedral code with the rounding that suits its lattice.
#pragma once

#include "algorithms/hermite/normal_codes/octahedral.h"

namespace hermesh {

/// On a face of the octahedron the points with whole coordinates form a lattice of equilateral triangles.
/// Rounding two of the three coordinates takes a point of a parallelogram about it; the nearest point of the
/// lattice needs all three (Conway and Sloane, Fast Quantizing and Decoding, 1982, algorithm for A2): round
/// each, and where they no longer add up, move the one that was rounded furthest. The same 16 bits, and a
/// third off the largest error.
struct NearestNormalCode : OctahedralNormalCode {
  static constexpr const char* name = "nearest";

  [[gnu::always_inline]] static std::uint16_t pack(const std::array<float, 3>& normal) {
    using namespace octant_slots;
    const Projection at = project(normal, kExtent * kStep);
    const int a = nearest_step(at.a), b = nearest_step(at.b), c = nearest_step(at.c);
    const int missing = kExtent - a - b - c;  // -1, 0 or 1
    // How far each was moved the wrong way: down where one is missing, up where there is one too many.
    const int way = sign_mask(missing);
    const int of_a = negated_if(way, below(at.a, a));
    const int of_b = negated_if(way, below(at.b, b));
    const int of_c = negated_if(way, below(at.c, c));
    const int a_most = ~sign_mask(of_a - of_b) & ~sign_mask(of_a - of_c);
    const int b_most = ~sign_mask(of_b - of_c) & ~a_most;
    return of_lattice(a + (a_most & missing), b + (b_most & missing), at.negative);
  }
};

}  // namespace hermesh
