// The part of a collapse's tests that keeps it within the tolerance of the fine mesh (decimation.h).
#pragma once

#include "algorithms/extraction/certified_collapse/cube_mesh.h"
#include "algorithms/extraction/contact/triangle_reach.h"

namespace hermesh {

/// The test of distances for one collapse after another. It reads the collapse that is under way, and writes
/// Collapse::attached.
class CollapseDistance {
 public:
  CollapseDistance(DecimatedMesh& mesh, CubeMesh& cube, Collapse& collapse)
      : mesh_(mesh), cube_(cube), collapse_(collapse) {}

  /// Whether the collapse keeps to the tolerance: every sample of the old triangles, and the ends that move,
  /// have a new triangle within their tolerance, and the new point and the new edges are within the tolerance
  /// of the fine mesh.
  bool passes();

 private:
  bool attach_samples();
  bool attach(std::uint32_t sample);
  bool point_is_near();
  bool near_fine_around(const Eigen::Vector3d& p, double radius);
  bool near_fine(std::uint32_t t, const Eigen::Vector3d& p, double radius) const;
  bool new_edges_are_near();
  bool is_near_below(const Eigen::Vector3d& to, const Eigen::Vector3d& normal) const;
  bool segment_is_near(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

  DecimatedMesh& mesh_;
  CubeMesh& cube_;
  Collapse& collapse_;
  std::vector<TriangleReach> reach_;  ///< tells what is near each new triangle
  std::uint32_t below_ = 0;           ///< a fine triangle near the place looked at last
};

}  // namespace hermesh
