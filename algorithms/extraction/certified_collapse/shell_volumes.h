// The closed shells of a fine mesh, and the change of their volumes when vertices are merged.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "algorithms/extraction/certified_collapse/fine_mesh.h"

namespace hermesh {

/// Numbers of the pieces behind and in front of a triangle; 0 is the outside.
using TrianglePieces = std::array<std::uint32_t, 2>;

/// The shells of a fine mesh, i.e. the connected components of the boundary of each piece, and their volumes.
///
/// **Why volumes.** A shell that is closed, connected and free of self-intersection encloses one body, and
/// its signed volume is plus or minus the volume of that body: plus if it faces outwards. Freedom from
/// self-intersection and a bounded distance do not imply the sign, because a shell as small as the tolerance
/// can be merged into its mirror image.
class ShellVolumes {
 public:
  /// @param fine closed and oriented, or a complex of patches; shells with a boundary are ignored
  /// @param pieces of each triangle of a complex; empty if all triangles have piece 1 behind and 0 in front
  ShellVolumes(const FineMesh& fine, std::span<const TrianglePieces> pieces);

  /// Returns a flag for each shell: 1 if its volume has a different sign than in the fine mesh, or differs
  /// from that volume by more than the fraction `most_change` of it.
  /// @param points, triangles of the mesh that results from merging vertices of the fine one
  /// @param origin for each triangle the fine triangle whose corners were merged into its corners
  std::vector<std::uint8_t> changed(std::span<const Eigen::Vector3d> points,
                                    std::span<const Triangle> triangles,
                                    std::span<const std::uint32_t> origin,
                                    double most_change = std::numeric_limits<double>::infinity()) const;
  /// Returns true if a fine triangle belongs to a flagged shell.
  bool is_in(const std::vector<std::uint8_t>& shells, std::uint32_t fine_triangle) const {
    const auto [behind, in_front] = shells_of(fine_triangle);
    return (behind != kNone && shells[behind]) || (in_front != kNone && shells[in_front]);
  }

 private:
  static constexpr std::uint32_t kNone = FineMesh::kNone;
  /// Returns the shell that contains the triangle and the one that contains it reversed; kNone if there is
  /// none.
  std::array<std::uint32_t, 2> shells_of(std::uint32_t fine_triangle) const;
  std::vector<double> volumes_of(std::span<const Eigen::Vector3d> points, std::span<const Triangle> triangles,
                                 std::span<const std::uint32_t> origin) const;

  const FineMesh& fine_;
  std::vector<std::uint32_t> by_point_;                    ///< shell of each point; empty for a complex
  std::vector<std::array<std::uint32_t, 2>> by_triangle_;  ///< shells of each triangle; empty without pieces
  std::vector<std::uint32_t> apex_;  ///< a vertex of each shell, about which its volume is computed
  std::vector<double> volumes_;      ///< of each shell of the fine mesh, voxels³; 0 if it has a boundary
};

}  // namespace hermesh
