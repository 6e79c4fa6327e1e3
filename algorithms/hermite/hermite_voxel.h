// A voxel of Hermite data in single precision, 52 bytes: the baseline that packed voxels are compared with.
#pragma once

#include <array>
#include <cstdint>
#include <ostream>

namespace hermesh {

/// The sign of a sample, and for each of its up-wind edges (towards the next sample along x, y, z) whether
/// the surface crosses it, where, and with what normal (Aldén 2011, §2.8 and figure 2.10).
struct HermiteVoxel {
  std::array<float, 3> offset{};                 ///< along the edge, 0 at this sample and 1 at the next
  std::array<std::array<float, 3>, 3> normal{};  ///< by edge; unit length in index space, towards the outside
  bool inside = false;
  std::uint8_t crossing = 0;  ///< bit a is set if the edge along axis a is crossed
  std::array<std::uint8_t, 2> padding{};  ///< named, because a file holds its bytes, too

  bool crosses(int axis) const { return (crossing >> axis) & 1; }

  bool operator==(const HermiteVoxel&) const = default;
  // OpenVDB asks of every value type that it can be added, compared for size and negated; for Hermite data
  // the sign is the only part for which that means anything.
  bool operator<(const HermiteVoxel& other) const { return inside && !other.inside; }
  bool operator>(const HermiteVoxel& other) const { return other < *this; }
  template <class Any>
  HermiteVoxel operator+(const Any&) const {
    return *this;
  }
  HermiteVoxel operator-(const HermiteVoxel&) const { return *this; }
  HermiteVoxel operator-() const {
    HermiteVoxel negated = *this;
    negated.inside = !inside;
    return negated;
  }
};
static_assert(sizeof(HermiteVoxel) == 52);

inline std::ostream& operator<<(std::ostream& out, const HermiteVoxel& voxel) {
  return out << (voxel.inside ? "inside" : "outside") << " crossing " << int(voxel.crossing);
}

}  // namespace hermesh
