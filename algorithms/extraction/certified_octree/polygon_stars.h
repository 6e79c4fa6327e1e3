// Tests whether the polygons around a vertex can intersect one another.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace hermesh {

/// A quick test for vertices whose polygons form a closed ring around them, as in a manifold. The *star* of a
/// vertex consists of its triangles. It is *plain* if there is a direction from which all its triangles
/// appear counter-clockwise and surround the vertex exactly once; then no two of them intersect except in
/// their shared edges. Call ask() for the vertices to test, then add() for all their triangles, then
/// is_plain().
class PolygonStars {
 public:
  explicit PolygonStars(std::size_t points) : asked_(points), marks_(points) {}

  /// Requests a test of a vertex. Concurrent calls are safe, as are those of add(), but calls of one must not
  /// overlap calls of the other.
  void ask(std::uint32_t point);
  bool is_asked(std::uint32_t point) const { return asked_[point] != 0; }
  /// Adds a triangle of a vertex. Its other two corners are given relative to the vertex, in the order that
  /// is counter-clockwise in a plain star seen from `up`. All triangles of a vertex must have the same `up`.
  void add(std::uint32_t point, const Eigen::Vector3d& up, const Eigen::Vector3d& to_first,
           const Eigen::Vector3d& to_second);
  /// Returns true if the star of a vertex is plain; false if its test was not requested.
  bool is_plain(std::uint32_t point) const { return asked_[point] && marks_[point] == 1; }

 private:
  static constexpr std::uint32_t kTurned = 1u << 31;
  std::vector<std::uint8_t> asked_;  ///< 1 for vertices to be tested
  std::vector<std::uint32_t>
      marks_;  ///< by vertex: number of triangles that intersect one ray, | kTurned if one is reversed
};

}  // namespace hermesh
