// A triangle cut along the lines in which others cross it, so that each part has one and the same space above
// it and one and the same space below it.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "algorithms/voxelization/distance/segment.h"

namespace hermesh {

/// A convex part of a triangle, in voxels, wound as the triangle is.
struct TriangleFace {
  std::vector<Eigen::Vector3d> corners;
  bool whole = true;  ///< no other triangle crosses it

  /// The mean of the corners, which is within.
  Eigen::Vector3d middle() const;
  /// Area in voxels².
  double area() const;
  /// The largest distance between two corners.
  double size() const;
  /// The distance of a place within from the border.
  double room_at(const Eigen::Vector3d& place) const;
};

/// Collects the lines that cut one triangle, and then cuts it. All in voxels.
class TriangleCutter {
 public:
  /// Prepares a triangle, which must have an area.
  explicit TriangleCutter(const Facet& triangle);

  /// Cuts the triangle where another one meets it: along the line in which they cross, along an edge that
  /// ends within a thousandth of a voxel of it, and along the outline of one that lies that near as a whole.
  /// Does nothing where they meet in a point or along the triangle's own border.
  void add(const Facet& other);

  /// Cuts the triangle into no more than `most` faces, the largest of which are cut first (an autopartition:
  /// Paterson & Yao 1990); those that would have to be cut further are not whole. Only faces for which
  /// `matters` holds are cut.
  std::vector<TriangleFace> faces(std::size_t most,
                                  const std::function<bool(const TriangleFace&)>& matters) const;
  /// Whether any line cuts the triangle.
  bool has_cuts() const { return !cuts_.empty(); }

 private:
  using Place = Eigen::Vector2d;
  struct Cut {
    Place from, to;
  };
  struct Side {
    Place inward;  ///< unit normal
    double offset;
  };
  struct Part {
    std::vector<Place> corners;
    std::vector<Cut> cuts;
    double area = 0;
  };

  Place flat(const Eigen::Vector3d& place) const;
  void add_cut(const Place& from, const Place& to);
  std::vector<Cut> longest_cuts(std::size_t most) const;
  TriangleFace face(const Part& part) const;
  static std::vector<Side> sides(const std::vector<Place>& corners);
  static bool clip(const std::vector<Side>& sides, Cut& cut);
  static bool split(Part& part, Part& other);

  Facet triangle_;
  Eigen::Vector3d normal_, along_, across_;  ///< unit vectors; the latter two in the triangle's plane
  std::vector<Place> outline_;
  std::vector<Side> border_;
  std::vector<Cut> cuts_;
};

}  // namespace hermesh
