// The part of a collapse's tests that keeps it within the tolerance of the fine mesh (decimation.h).
#pragma once

#include "algorithms/extraction/manifold_dual_contouring/cube_mesh.h"

namespace hermesh {

/// For one collapse after another, whose data it reads and, as for Collapse::attached, writes.
class CollapseDistance {
 public:
  CollapseDistance(DecimatedMesh& mesh, CubeMesh& cube, Collapse& collapse)
      : mesh_(mesh), cube_(cube), collapse_(collapse) {}

  /// Finds a new triangle within the tolerance for every sample of the old ones and for the ends that move.
  bool attach_samples();
  /// After attach_samples(): whether the new point is near the fine mesh.
  bool point_is_near();
  std::uint32_t below() const { return below_x_; }
  /// After that: whether the fine edges at the samples are near the new mesh, and the new edges near the fine one.
  bool edges_are_near();

 private:
  struct Part {
    Eigen::Vector3d from, to;
    double tolerance;
  };

  bool attach(std::uint32_t sample);
  bool edge_is_near(const Collapse::Attached& entry, std::uint32_t neighbour);
  bool edge_to_point_is_near(const Part& part, const Collapse::NewFace& mine, std::uint32_t sample);
  bool part_is_near(const Part& part, const TriangleReach& a, const TriangleReach& b, int depth);
  bool triangle_near(const Eigen::Vector3d& p, double within, TriangleReach& found);
  bool near_fine_around(const Eigen::Vector3d& p, double radius);
  bool near_fine(std::uint32_t t, const Eigen::Vector3d& p, double radius) const;
  bool new_edges_are_near();
  bool is_near_below(const Eigen::Vector3d& to, const Eigen::Vector3d& normal) const;
  bool segment_is_near(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

  DecimatedMesh& mesh_;
  CubeMesh& cube_;
  Collapse& collapse_;
  std::uint32_t question_ = 0;
  std::uint32_t below_x_ = 0;
  std::uint32_t below_ = 0;  ///< a fine triangle near the place looked at
};

}  // namespace hermesh
