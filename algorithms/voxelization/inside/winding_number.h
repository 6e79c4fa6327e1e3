// The generalised winding number of a triangle soup (Jacobson et al., Robust Inside-Outside Segmentation
// using Generalized Winding Numbers, ACM TOG 32(4), 2013): 1 inside a closed surface that is wound
// counter-clockwise seen from outside, 0 outside, and something between near holes.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/search/triangle_tree.h"
#include "algorithms/voxelization/inside/winding_kernels.h"

namespace hermesh {

/// Hierarchical evaluation (Barill et al., Fast Winding Numbers for Soups and Clouds, ACM TOG 37(4), 2018):
/// boxes far away by their multipoles up to second order, triangles nearby by their exact solid angles.
/// Refers to the tree and to `turns`, which have to outlive it; about 13 bytes a triangle. Queries may run in
/// parallel. The error against the exact sum stays below 0.01, most often far below.
class WindingNumber {
 public:
  /// How many radii away a box counts as far.
  static constexpr double kFar = 2.0;

  /// @param tree the triangles
  /// @param turns for each triangle 1 as given, −1 turned over, 0 left out (Orientation::turns); empty: all 1
  /// @param far how many radii away a box counts as far
  explicit WindingNumber(const TriangleTree& tree, std::span<const std::int8_t> turns = {},
                         double far = kFar);

  /// The number at a point in voxels relative to the mesh's origin. On a triangle, one of the values on its
  /// two sides.
  double at(const Eigen::Vector3d& p) const;
  /// The numbers at many points near each other, such as a block's samples in any order: they share one
  /// descent. Positions count to 1e-7 of the extent of each 512 consecutive points.
  /// @param points in voxels relative to the mesh's origin
  /// @param values as many as points
  void at(std::span<const Eigen::Vector3d> points, std::span<float> values) const {
    evaluate(points, values, far_);
  }
  /// The numbers at many points, as at() gives them, with an error that is some sixty times smaller, in ten
  /// times the time or more.
  /// @param points in voxels relative to the mesh's origin
  /// @param values as many as points
  void at_finely(std::span<const Eigen::Vector3d> points, std::span<float> values) const {
    evaluate(points, values, 4.0 * far_);
  }

  /// Bytes that the multipoles take.
  std::size_t byte_size() const { return multipoles_.size() * sizeof(winding::Multipole); }

 private:
  void evaluate(std::span<const Eigen::Vector3d> points, std::span<float> values, double far) const;

  const TriangleTree& tree_;
  std::span<const std::int8_t> turns_;
  double far_;
  std::vector<winding::Multipole> multipoles_;  ///< by box number
};

/// The winding number as a sum over all triangles by the formula of van Oosterom & Strackee in double
/// precision, in linear time.
/// @param points in world units
/// @param triangles by the numbers of their points
/// @param scale voxels per unit of the points
/// @param p a place in voxels
double exact_winding_number(std::span<const Eigen::Vector3f> points, std::span<const Triangle> triangles,
                            double scale, const Eigen::Vector3d& p);

}  // namespace hermesh
