// What is on either side of a place of the surface, as far as straight ways that meet no triangle tell.
#pragma once

#include <map>
#include <memory>
#include <vector>

#include "algorithms/voxelization/regions.h"
#include "algorithms/voxelization/segment.h"
#include "algorithms/voxelization/triangle_bins.h"
#include "algorithms/voxelization/winding_number.h"

namespace hermesh {

/// What is certain about a place of the surface, or just off it: the outside is next to it, only the inside
/// is, or neither can be told, as in a crevice too narrow to lead to a voxel.
enum class Side { outer, inner, unknown };

/// Looks around among the triangles; each thread has its own, since it keeps what it looked up.
class SurfaceProbe {
 public:
  /// Keeps references. `inside`: the voxels inside each block of the bins. A thorough probe follows narrow
  /// spaces to where they are wider, and asks `winding`, unless that is null, about those that do not widen.
  SurfaceProbe(const IndexSoup& soup, const TriangleBins& bins, const std::vector<VoxelBits>& inside,
               bool thorough, const WindingNumber* winding);
  ~SurfaceProbe();
  SurfaceProbe(SurfaceProbe&&) noexcept;

  /// Whether the solid is on both sides of the surface at q with this unit normal.
  Side side(const Eigen::Vector3d& q, const Eigen::Vector3d& normal);

 private:
  using Voxel = std::array<std::int32_t, 3>;
  struct Neighbourhood;

  const Neighbourhood& neighbourhood_of(const Voxel& cell);
  int inside_at(const Voxel& voxel);
  Side seen_from(const Eigen::Vector3d& p);
  double free_part(const Eigen::Vector3d& from, const Eigen::Vector3d& to);
  double centre(Eigen::Vector3d& p, const Eigen::Vector3d& normal);
  Side follow(Eigen::Vector3d p, const Eigen::Vector3d& normal);
  bool is_wound_about(const Eigen::Vector3d& p) const;

  const IndexSoup& soup_;
  const TriangleBins& bins_;
  const std::vector<VoxelBits>& inside_;
  bool thorough_;
  const WindingNumber* winding_;
  BlockFinder finder_;
  std::map<BlockAt, std::unique_ptr<Neighbourhood>> blocks_;
  const Neighbourhood* last_ = nullptr;
  BlockAt last_block_{};
};

}  // namespace hermesh
