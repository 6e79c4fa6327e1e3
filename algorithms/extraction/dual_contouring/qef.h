// The quadratic error function of dual contouring (Aldén 2011, §6.2; Ju et al. 2002).
//
// **Curvature bias.** Over its tangent plane a smooth surface has the height ½ uᵀHu. The mass point lies half
// the mean m of uᵀHu over the crossings off the surface, towards its hollow side, and the minimiser as far
// off towards the other side: the mean of nᵢ·(x − pᵢ) is 0 there, and nᵢ turns against pᵢ. Half way from the
// one to the other the two cancel. But the triangles between points of a curved surface are chords, which lie
// on its hollow side: as a whole they are nearest to it, and enclose its volume, with points a little on the
// other side. How far depends on how a lattice cuts the surface into cells, not on its curvature; the mean
// over all directions is kShareOfExact of the way, the same on spheres and tori (placement_test.cpp measures
// it). Where crossings are interpolated linearly from distances they lie on the hollow side themselves, and
// points must go kShareOfLinear of the way. Planes are met everywhere between mass point and minimiser;
// features are met at the minimiser alone. So the share rises from there to 1 as the planes turn against one
// another, and is 1 where truncation begins to keep the second direction.
#pragma once

#include <Eigen/Core>

namespace hermesh {

/// Sum of squared distances to tangent planes, E(x) = Σ (nᵢ·(x − pᵢ))² (eq. 6.1), gathered about an anchor so
/// that small differences of large coordinates never arise. It takes any unit of length; here voxels.
class Qef {
 public:
  /// Shares of the way from the mass point to the minimiser that leave no curvature bias on smooth surfaces:
  /// with exact crossings, and with those that linear interpolation finds in a level set.
  static constexpr double kShareOfExact = 0.79, kShareOfLinear = 0.88;
  /// How much the planes are turned against one another where the share begins to rise, of what truncation
  /// keeps: a fold of 10° at the default truncation, or a radius of 8 voxels.
  static constexpr double kSmoothBelow = 0.7;

  /// `anchor` is a point near the cell; plane points are given in the same frame.
  explicit Qef(const Eigen::Vector3d& anchor) : anchor_(anchor) {}

  void add_plane(const Eigen::Vector3d& point, const Eigen::Vector3d& unit_normal);
  int planes() const { return planes_; }
  /// Mean of the plane points: the average placement, and where the minimiser starts from.
  Eigen::Vector3d mass_point() const { return anchor_ + sum_ / planes_; }

  /// Minimiser nearest to the mass point by truncated singular value decomposition (§6.2.1, after Kobbelt et
  /// al. 2001): singular values of A below `truncation` times the largest are set to zero.
  Eigen::Vector3d minimiser(double truncation) const { return minimiser_near(mass_point(), truncation); }

  /// The minimiser nearest to `start` instead: where the error has a line or a plane of minima, another of
  /// them.
  Eigen::Vector3d minimiser_near(const Eigen::Vector3d& start, double truncation) const;

  /// Minimiser within the box, which is minimiser() where that lies inside. Each face, edge and corner of
  /// the box is tried in turn for the smallest error, with the same truncation in the remaining directions.
  Eigen::Vector3d minimiser_within(const Eigen::Vector3d& lower, const Eigen::Vector3d& upper,
                                   double truncation) const;

  /// The share of the way from the mass point to the minimiser to go: `smooth` where the planes are nearly
  /// parallel, 1 where truncation keeps more than one direction, and in between a smooth step by turned().
  double share_of_minimiser(double smooth, double truncation) const;

  double error(const Eigen::Vector3d& x) const;  ///< E(x), never negative

  /// Whether the planes of a feature meet at `free`, and not at `held`, so that a polyhedron is reproduced by
  /// the one and not by the other: no plane is farther than kMeet from `free` (the root of E bounds the
  /// largest distance), `held` is off by kApart at least and by ten times as much as `free`, and the planes
  /// are turned by kFeature (as share_of_minimiser() measures it): by some 45°, where one of five crossings
  /// lies on another plane. Voxels.
  bool planes_meet(const Eigen::Vector3d& free, const Eigen::Vector3d& held) const;
  static constexpr double kMeet = 1e-3, kApart = 1e-6, kFeature = 0.05;

 private:
  /// The sum of the products of two eigenvalues of AᵀA over the square of their sum: 0 where all planes are
  /// parallel.
  double turned() const;
  bool is_flat(double truncation, Eigen::Vector3d& axis, double& value) const;

  Eigen::Vector3d anchor_, sum_ = Eigen::Vector3d::Zero();
  Eigen::Matrix3d ata_ = Eigen::Matrix3d::Zero();
  Eigen::Vector3d atb_ = Eigen::Vector3d::Zero();
  double btb_ = 0.0;
  int planes_ = 0;
};

}  // namespace hermesh
