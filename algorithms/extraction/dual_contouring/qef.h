// The quadratic error function of dual contouring (Aldén 2011, §6.2; Ju et al. 2002).
//
// **Curvature bias.** Over its tangent plane a smooth surface has the height ½ uᵀHu. The mass point lies half
// the mean m of uᵀHu over the edge crossings off the surface, towards its concave side, and the minimiser the
// same distance off towards the other side: the mean of nᵢ·(x − pᵢ) is 0 there, and nᵢ turns against pᵢ.
// Halfway between them the two cancel. But the triangles between vertices of a curved surface are chords,
// which lie on its concave side: as a whole they are nearest to it, and enclose its volume, with vertices a
// little on the other side. The distance depends on how a lattice cuts the surface into cells, not on its
// curvature; the mean over all directions is kShareOfExact of the path, the same on spheres and tori
// (placement_test.cpp measures it). Crossings interpolated linearly from distances lie on the concave side
// themselves, which needs kShareOfLinear of the path. Planes are met everywhere between mass point and
// minimiser, features only at the minimiser. So the share rises to 1 as the planes turn against one another,
// and is 1 where truncation begins to keep the second direction.
#pragma once

#include <Eigen/Core>

namespace hermesh {

/// Sum of squared distances to tangent planes, E(x) = Σ (nᵢ·(x − pᵢ))² (eq. 6.1), about an anchor, so that
/// small differences of large coordinates never arise. Lengths in voxels.
class Qef {
 public:
  /// Shares of the path from the mass point to the minimiser without curvature bias on smooth surfaces: for
  /// exact crossings, and for linear interpolation in a level set.
  static constexpr double kShareOfExact = 0.79, kShareOfLinear = 0.88;
  /// turned() where the share begins to rise, as a share of the value that truncation keeps: a fold of 10° at
  /// the default truncation, or a radius of 8 voxels.
  static constexpr double kSmoothBelow = 0.7;

  /// `anchor` is a point near the cell; plane points are given in the same frame.
  explicit Qef(const Eigen::Vector3d& anchor) : anchor_(anchor) {}

  void add_plane(const Eigen::Vector3d& point, const Eigen::Vector3d& unit_normal);
  int planes() const { return planes_; }
  /// Returns the mean of the plane points: the average placement, and the start of the minimiser.
  Eigen::Vector3d mass_point() const { return anchor_ + sum_ / planes_; }

  /// Returns the minimiser nearest to the mass point by truncated singular value decomposition (§6.2.1, after
  /// Kobbelt et al. 2001): singular values of A below `truncation` times the largest are set to zero.
  Eigen::Vector3d minimiser(double truncation) const { return minimiser_near(mass_point(), truncation); }

  /// Returns the minimiser nearest to `start`: another one if the error has a line or a plane of minima.
  Eigen::Vector3d minimiser_near(const Eigen::Vector3d& start, double truncation) const;

  /// Returns the minimiser within the box, which is minimiser() if that lies inside. Otherwise each face,
  /// edge and corner of the box is tried for the smallest error, with the same truncation in the remaining
  /// directions.
  Eigen::Vector3d minimiser_within(const Eigen::Vector3d& lower, const Eigen::Vector3d& upper,
                                   double truncation) const;

  /// Returns the share of the path from the mass point to the minimiser: `smooth` if the planes are nearly
  /// parallel, 1 if truncation keeps more than one direction, and in between a smooth step by turned().
  double share_of_minimiser(double smooth, double truncation) const;

  /// Returns the unit direction of the line of minima if truncation keeps exactly two directions, else zero.
  Eigen::Vector3d line(double truncation) const;

  /// Returns true if all planes meet at `free`, and truncation keeps all three directions.
  bool has_corner(const Eigen::Vector3d& free, double truncation) const;

  double error(const Eigen::Vector3d& x) const;  ///< E(x), never negative

  /// Returns true if the planes of a feature meet at `free`, and not at `held`, so only `free` reproduces a
  /// polyhedron: no plane is farther than kMeet from `free` (the root of E bounds the largest distance),
  /// `held` is off by at least kApart and ten times the error of `free`, and turned() is at least kFeature:
  /// some 45° if one of five crossings lies on another plane.
  bool planes_meet(const Eigen::Vector3d& free, const Eigen::Vector3d& held) const;
  static constexpr double kMeet = 1e-3, kApart = 1e-6, kFeature = 0.05;

 private:
  /// Returns the sum of the products of two eigenvalues of AᵀA over the square of their sum: 0 if all planes
  /// are parallel.
  double turned() const;
  bool is_flat(double truncation, Eigen::Vector3d& axis, double& value) const;

  Eigen::Vector3d anchor_, sum_ = Eigen::Vector3d::Zero();
  Eigen::Matrix3d ata_ = Eigen::Matrix3d::Zero();
  Eigen::Vector3d atb_ = Eigen::Vector3d::Zero();
  double btb_ = 0.0;
  int planes_ = 0;
};

}  // namespace hermesh
