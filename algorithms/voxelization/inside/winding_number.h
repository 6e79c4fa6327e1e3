// The generalised winding number of a triangle soup (Jacobson et al., Robust Inside-Outside Segmentation
// using Generalized Winding Numbers, ACM TOG 32(4), 2013): 1 inside a closed surface that is wound
// counter-clockwise seen from outside, 0 outside, and something between near holes.
#pragma once

#include <optional>

#include "algorithms/search/triangle_tree.h"
#include "algorithms/voxelization/distance/index_soup.h"
#include "algorithms/voxelization/inside/orientation.h"
#include "algorithms/voxelization/inside/winding_kernels.h"

namespace hermesh {

/// Hierarchical evaluation (Barill et al., Fast Winding Numbers for Soups and Clouds, ACM TOG 37(4), 2018):
/// boxes far away by their multipoles up to second order, triangles nearby by their exact solid angles.
/// Refers to the tree and to `turns`, which must outlive it; takes about 13 bytes per triangle. Queries may
/// run in parallel. The error against the exact sum stays below 0.01, most often far below.
class WindingNumber {
 public:
  /// @param tree the triangles
  /// @param turns for each triangle 1 as given, −1 reversed, 0 left out (Orientation::turns); empty: all 1
  explicit WindingNumber(const TriangleTree& tree, std::span<const std::int8_t> turns = {});

  /// Returns the number at a point in voxels relative to the mesh's origin. On a triangle, one of the values
  /// on its two sides.
  double at(const Eigen::Vector3d& p) const;
  /// Computes the numbers at points near each other, such as a block's samples in any order: they share one
  /// descent. Positions are rounded to 1e-7 of the extent of each 512 consecutive points.
  /// @param points in voxels relative to the mesh's origin
  /// @param values as many as points
  void at(std::span<const Eigen::Vector3d> points, std::span<float> values) const {
    evaluate(points, values, kFar);
  }
  /// Computes the numbers as at() does, with an error some sixty times smaller, in ten times the time or
  /// more.
  void at_finely(std::span<const Eigen::Vector3d> points, std::span<float> values) const {
    evaluate(points, values, 4.0 * kFar);
  }

 private:
  /// Radii away from which a box counts as far.
  static constexpr double kFar = 2.0;

  void evaluate(std::span<const Eigen::Vector3d> points, std::span<float> values, double far) const;

  const TriangleTree& tree_;
  std::span<const std::int8_t> turns_;
  std::vector<winding::Multipole> multipoles_;  ///< by box number
};

/// The orientation and the winding number of a mesh. Keeps a reference to the mesh, and copies its triangles
/// if it has quads.
class OrientedWinding {
 public:
  explicit OrientedWinding(const IndexSoup& soup) : OrientedWinding(soup.mesh(), soup.scale()) {}
  OrientedWinding(const OrientedWinding&) = delete;
  OrientedWinding& operator=(const OrientedWinding&) = delete;

  const Orientation& orientation() const { return orientation_; }
  /// Returns true if the number distinguishes inside and outside.
  bool usable() const { return orientation_.verdict == Orientation::Verdict::usable; }
  /// Returns the winding number, for points in voxels relative to the mesh's origin.
  const WindingNumber& number() const { return number_; }
  /// Returns the winding number of the closed shells that face inwards (Orientation::inward), if there are
  /// any.
  std::optional<WindingNumber> inward() const {
    if (orientation_.inward.empty()) return std::nullopt;
    return WindingNumber(tree_, orientation_.inward);
  }

 private:
  OrientedWinding(const PolygonMesh& mesh, double scale)
      : triangles_(mesh.quads.empty() ? std::vector<Triangle>() : triangulated(mesh)),
        faces_(mesh.quads.empty() ? std::span<const Triangle>(mesh.triangles) : triangles_),
        orientation_(orient_faces(mesh.points, faces_)),
        tree_(mesh.points, faces_, scale),
        number_(tree_, orientation_.turns) {}

  std::vector<Triangle> triangles_;
  std::span<const Triangle> faces_;
  Orientation orientation_;
  TriangleTree tree_;
  WindingNumber number_;
};

}  // namespace hermesh
