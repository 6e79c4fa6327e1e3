// Whether the polygons around a point hide one another.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace hermesh {

/// A quick test for points whose polygons lie around them in a closed ring, as in a manifold. A point's
/// *star* are the triangles that have it. It is *plain* if, seen along some direction, all its triangles are
/// turned the same way, and follow one another around the point once: then no two of them meet but in the
/// sides that they share. Used in turns: ask() for the points that matter, add() their triangles, then
/// is_plain().
class PolygonStars {
 public:
  explicit PolygonStars(std::size_t points) : asked_(points), marks_(points) {}

  /// Asks about a point. Safe to call from several threads at once, as is add(); but not one while the other
  /// is called.
  void ask(std::uint32_t point);
  bool is_asked(std::uint32_t point) const { return asked_[point] != 0; }
  /// Adds a triangle of a point and two others, given relative to the point: from the first to the second it
  /// is counter-clockwise seen from where `up` points to. All triangles of a point must have the same `up`.
  void add(std::uint32_t point, const Eigen::Vector3d& up, const Eigen::Vector3d& to_first,
           const Eigen::Vector3d& to_second);
  /// Whether a point's star is plain; false where nothing was asked.
  bool is_plain(std::uint32_t point) const { return asked_[point] && marks_[point] == 1; }

 private:
  static constexpr std::uint32_t kTurned = 1u << 31;
  std::vector<std::uint8_t> asked_;  ///< 1 for points that are asked about
  std::vector<std::uint32_t>
      marks_;  ///< for each point kTurned, and how many triangles lie across one ray from it
};

}  // namespace hermesh
