// Validates a level set against its polygons: the distance in every voxel or in many of them, the set of
// active voxels, and the signs. It relies only on the oracles and does not depend on any voxelizer.
//
// The true values depend on the mesh and the grid's spacing, not on the level set under test: they are
// computed once and then compared with any number of level sets.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "algorithms/core/level_set.h"
#include "reference/winding_oracle.h"

namespace hermesh {

using VoxelIndex = std::array<int, 3>;

/// The voxels that are validated.
struct VoxelSelection {
  double band = 3.0;         ///< voxels from the surface, on both sides
  std::int64_t samples = 0;  ///< 0: all voxels; else the number in the band, drawn evenly over the surface
  std::uint64_t seed = 1;    ///< seed of the draw
};

/// A voxel whose value is not the true one, or that should or should not be active.
struct VoxelFinding {
  VoxelIndex voxel;
  double truth = 0.0;  ///< distance in voxels
  double value = 0.0;  ///< magnitude found, in voxels
  bool active = true;
  bool bounds_solid = true;  ///< true if the nearest point lies on the solid's boundary
};

struct DistanceReport {
  static constexpr double kFine = 1e-4, kCoarse = 0.05;  ///< voxels
  std::int64_t compared = 0;                             ///< active voxels
  double max = 0.0, rms = 0.0;                           ///< errors of magnitude over `compared`, in voxels
  std::int64_t fine = 0, coarse = 0;                     ///< voxels that are off by more than kFine, kCoarse
  /// The voxels off by more than kFine, in two classes: those whose nearest point lies on the solid's
  /// boundary, and those whose nearest point lies on a sheet inside the solid, which a level set of the solid
  /// need not represent; with the largest error of either class. If there are more than 20,000, an even
  /// subset of them that includes the worst is classified; `classified` is its size.
  std::int64_t classified = 0, on_boundary = 0, on_inner_sheet = 0;
  double on_boundary_max = 0.0, on_inner_sheet_max = 0.0;
  /// `stray` counts voxels that are active although kFine or more beyond the band's width; `missing` and
  /// `missing_inner_sheet` those that are inactive although kFine or more within it, the latter where the
  /// nearest point lies on a sheet inside the solid.
  std::int64_t stray = 0, missing = 0, missing_inner_sheet = 0;
  std::vector<VoxelFinding> places;  ///< the first ten: the worst errors, then wrong states
};

/// True distances around a surface.
class DistanceTruth {
 public:
  /// Stores references to both oracles; `solid` determines the solid's boundary. @throws Cancelled.
  DistanceTruth(const DistanceOracle& surface, const WindingOracle& solid, const VoxelSelection& selection,
                const RunContext& context);

  /// Compares magnitudes. Samples of the level set are expected at world = mesh's origin + voxel_size ·
  /// index. A voxel is compared with the width of the band on the side that the level set itself takes it to
  /// be on; a wrong sign does not depend on the distance.
  /// @throws Error if the samples are elsewhere; Cancelled.
  DistanceReport judge(const LevelSet& level_set, const Eigen::Vector3d& origin, double exterior_band,
                       double interior_band, const RunContext& context) const;

 private:
  struct Block {
    VoxelIndex origin;
    std::array<float, kBlockVoxels> distance;
  };
  struct Sample {
    VoxelIndex voxel;
    double distance;
  };
  void classify(std::vector<VoxelFinding>& off, std::vector<VoxelFinding>& missing, DistanceReport& report,
                const RunContext& context) const;

  const DistanceOracle& surface_;
  const WindingOracle& solid_;
  std::vector<Block> blocks_;    ///< distances of all voxels, if all are looked at
  std::vector<Sample> samples_;  ///< else the voxels that were drawn
};

/// The oracle that decides on which side a voxel is.
enum class SignOracle {
  kParity,           ///< rays vote: right for closed surfaces with any winding
  kUnanimousParity,  ///< rays vote, and voxels whose rays disagree are left out
  kWinding,          ///< the winding number is above one half
};

struct SignReport {
  std::int64_t inside = 0,
               outside = 0;  ///< voxels truly on that side and farther than kNear from the surface
  std::int64_t wrong_inside = 0, wrong_outside = 0;  ///< those of them that have the other sign
  std::int64_t undecided = 0;                        ///< voxels whose rays disagree
  std::vector<VoxelFinding> places;  ///< the first ten wrong ones; the truth is negative inside
  std::int64_t wrong() const { return wrong_inside + wrong_outside; }
  double wrong_share() const { return inside + outside ? double(wrong()) / double(inside + outside) : 0.0; }
};

/// True sides around a surface.
class SignTruth {
 public:
  static constexpr double kNear = 1e-3;  ///< voxels: nearer to the surface no sign is called wrong
  SignTruth(const DistanceOracle& surface, const WindingOracle& winding, SignOracle oracle,
            const VoxelSelection& selection, const RunContext& context);
  SignReport judge(const LevelSet& level_set) const;

 private:
  struct Sample {
    VoxelIndex voxel;
    float signed_distance;
  };
  std::vector<Sample> samples_;
  std::int64_t undecided_ = 0;
};

}  // namespace hermesh
