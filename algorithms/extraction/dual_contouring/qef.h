// The quadratic error function of dual contouring (Aldén 2011, §6.2; Ju et al. 2002).
#pragma once

#include <Eigen/Core>

namespace hermesh {

/// Sum of squared distances to tangent planes, E(x) = Σ (nᵢ·(x − pᵢ))² (eq. 6.1), gathered about an anchor so
/// that small differences of large coordinates never arise. It takes any unit of length; here voxels.
class Qef {
 public:
  /// `anchor` is a point near the cell; plane points are given in the same frame.
  explicit Qef(const Eigen::Vector3d& anchor) : anchor_(anchor) {}

  void add_plane(const Eigen::Vector3d& point, const Eigen::Vector3d& unit_normal);
  int planes() const { return planes_; }
  /// Mean of the plane points: the average placement, and where the minimiser starts from.
  Eigen::Vector3d mass_point() const { return anchor_ + sum_ / planes_; }

  /// Minimiser nearest to the mass point by truncated singular value decomposition (§6.2.1, after Kobbelt et
  /// al. 2001): singular values of A below `truncation` times the largest are set to zero.
  Eigen::Vector3d minimiser(double truncation) const { return minimiser_near(mass_point(), truncation); }

  /// The minimiser nearest to `start` instead: where the error has a line or a plane of minima, another of them.
  Eigen::Vector3d minimiser_near(const Eigen::Vector3d& start, double truncation) const;

  /// Minimiser within the box, which is minimiser() where that lies inside. Each face, edge and corner of
  /// the box is tried in turn for the smallest error, with the same truncation in the remaining directions.
  Eigen::Vector3d minimiser_within(const Eigen::Vector3d& lower, const Eigen::Vector3d& upper,
                                   double truncation) const;

  double error(const Eigen::Vector3d& x) const;  ///< E(x), never negative

 private:
  bool is_flat(double truncation, Eigen::Vector3d& axis, double& value) const;

  Eigen::Vector3d anchor_, sum_ = Eigen::Vector3d::Zero();
  Eigen::Matrix3d ata_ = Eigen::Matrix3d::Zero();
  Eigen::Vector3d atb_ = Eigen::Vector3d::Zero();
  double btb_ = 0.0;
  int planes_ = 0;
};

}  // namespace hermesh
