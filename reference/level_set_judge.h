// Judges a level set against its polygons: the distance in every voxel or in many of them, the set of active
// voxels, and the signs. It takes the oracles' word alone and knows no voxelizer.
//
// What is true depends on the mesh and the grid's spacing, not on who is judged: a truth is worked out once
// and then compared with any number of level sets.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "algorithms/core/level_set.h"
#include "reference/winding_oracle.h"

namespace hermesh {

using VoxelIndex = std::array<int, 3>;

/// Which voxels are looked at.
struct VoxelSelection {
  double band = 3.0;         ///< voxels from the surface, on both sides
  std::int64_t samples = 0;  ///< 0: all; else this many within the band, drawn evenly over the surface
  std::uint64_t seed = 1;    ///< of the draw
};

/// A voxel whose value is not the true one, or that should or should not be active.
struct VoxelFinding {
  VoxelIndex voxel;
  double truth = 0.0;  ///< distance in voxels
  double value = 0.0;  ///< magnitude found, in voxels
  bool active = true;
  bool bounds_solid = true;  ///< whether the nearest point lies on the solid's boundary
};

struct DistanceReport {
  static constexpr double kFine = 1e-4, kCoarse = 0.05;  ///< voxels
  std::int64_t compared = 0;                             ///< active voxels
  double max = 0.0, rms = 0.0;                           ///< errors of magnitude over them, in voxels
  std::int64_t fine = 0, coarse = 0;                     ///< voxels that are off by more than that
  /// Of those off by more than kFine: how many have their nearest point on the solid's boundary, and how many
  /// on a sheet inside the solid, of which a level set of the solid is free to know nothing; with the largest
  /// error of each. Of more than 20,000 an even part is asked, the worst among them; `classified` says how
  /// many.
  std::int64_t classified = 0, on_boundary = 0, on_inner_sheet = 0;
  double on_boundary_max = 0.0, on_inner_sheet_max = 0.0;
  /// Active although kFine or more beyond the band's width; inactive although kFine or more within it, those
  /// whose nearest point lies on an inner sheet apart.
  std::int64_t stray = 0, missing = 0, missing_inner_sheet = 0;
  std::vector<VoxelFinding> places;  ///< the first ten: worst errors, then the active set's
};

/// True distances around a surface.
class DistanceTruth {
 public:
  /// Keeps references to the oracles. `solid` decides what the boundary is. @throws Cancelled.
  DistanceTruth(const DistanceOracle& surface, const WindingOracle& solid, const VoxelSelection& selection,
                const RunContext& context);

  /// Samples of the level set are expected at world = mesh's origin + voxel_size · index. The widths are
  /// those of the side that the level set itself takes a voxel to be on; a wrong sign is no matter of
  /// distance.
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
  std::vector<Block> blocks_;    ///< of all voxels, else empty
  std::vector<Sample> samples_;  ///< else these
};

/// Who says on which side a voxel is.
enum class SignOracle {
  kParity,           ///< rays vote: right for closed surfaces with any winding
  kUnanimousParity,  ///< the same, but voxels whose rays disagree are left out
  kWinding,          ///< the winding number is above one half
};

struct SignReport {
  std::int64_t inside = 0, outside = 0;  ///< voxels that truly are, all farther than kNear from the surface
  std::int64_t wrong_inside = 0, wrong_outside = 0;  ///< of each, those with the other sign
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
