// What files of scenes have in common: parts that are placed by transforms, some of them many times. Private
// to algorithms/io.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "algorithms/io/mesh_file_formats.h"

namespace hermesh::mesh_formats {

/// An affine map of points in double precision. The type is not Eigen's, whose products would also multiply
/// the last row.
struct Placement {
  Eigen::Matrix3d linear = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Eigen::Vector3d operator()(const Eigen::Vector3d& point) const { return linear * point + translation; }
  /// The map that applies `inner` first.
  Placement operator*(const Placement& inner) const {
    return {linear * inner.linear, (*this)(inner.translation)};
  }
  bool is_finite() const { return linear.allFinite() && translation.allFinite(); }
};

/// Triangles over points of their own, in the coordinates of the part.
struct ScenePart {
  std::vector<Eigen::Vector3d> points;
  std::vector<Triangle> triangles;  ///< every corner is a point of the part

  /// Bytes that one more copy of the part takes in a mesh.
  double cost() const {
    return double(points.size() * sizeof(Eigen::Vector3d) + triangles.size() * sizeof(Triangle));
  }
};

/// Puts parts into the mesh of a builder and counts what they cost, so that a small file which repeats its
/// parts millions of times is refused before memory is.
class PartPlacer {
 public:
  explicit PartPlacer(MeshBuilder& builder) : builder_(builder) {}

  /// Counts bytes that are about to be taken, or work that takes as long as writing them would. @throws Error
  /// where all that was counted is more than half of the machine's memory.
  void spend(double bytes);
  /// Adds a copy of the part, whose cost was spent before. A placement that mirrors turns its triangles
  /// round, so that they still face outwards; one that flattens leaves the part out. @throws Error if the
  /// placement is not finite.
  void place(const ScenePart& part, const Placement& placement);
  /// Notes how many parts were left out, once all are placed.
  void note_left_out();

 private:
  MeshBuilder& builder_;
  double spent_ = 0.0;
  std::size_t flattened_ = 0;
};

}  // namespace hermesh::mesh_formats
