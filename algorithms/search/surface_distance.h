// Certified upper bounds of the one-sided distance from one surface to another.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"
#include "algorithms/search/triangle_tree.h"

namespace hermesh {

/// A triangle that is farther from the other surface than the limit, or not shown to be within it; or, with
/// Wanted::far_pieces, such a piece of one.
struct FarTriangle {
  std::uint32_t triangle;  ///< its number among the tested ones
  Eigen::Vector3d place;   ///< a point on it, in the frame of the tested points
  double distance;         ///< of that point from the other surface, at most twice the limit
  double radius = 0.0;     ///< of a ball around `place` that contains the piece
  double area = 0.0;       ///< of the piece
};

/// Result of SurfaceDistance::hold().
struct DistanceFromSurface {
  /// Upper bound of the distance of the triangles that are not in `far`; at most the limit.
  double upper = 0.0;
  double free_area = 0.0;        ///< area of the free pieces, in the units of the points squared
  std::vector<FarTriangle> far;  ///< ascending by number of the triangle
};

/// Parts of the tested triangles that need not be near.
struct FreePieces {
  /// Sets a result for each of some pieces near each other: 1 if it is accepted although it is farther away
  /// than the limit. Called from several threads. Null: none is accepted.
  std::function<void(std::span<const std::array<Eigen::Vector3d, 3>> pieces, std::span<std::uint8_t> results)>
      are_free = {};
  /// Largest radius of the pieces that are accepted, about their middle.
  double radius = 0.0;
};

/// Requested result: a bound of the near parts as small as possible; any bound within the limit, faster; or a
/// small bound and all pieces that it does not hold for, most of them within half of the limit of their
/// place.
enum class Wanted { small_bound, any_bound, far_pieces };

/// A triangle soup that distances are measured to.
///
/// **Why a limit holds** for a piece of a triangle: if the piece's three corners are within the limit of one
/// triangle of the soup, all of the piece is, for the distance to a convex set is a convex function; and if
/// the distance of the piece's middle and the piece's radius add up to at most the limit, by the triangle
/// inequality, as it does if points in rows over the piece are near enough for their distance from each
/// other. Pieces for which none of these holds are divided along the sides of the triangle below if that is
/// large, so that the first rule holds for the part over it, and halved otherwise. (Compare Tang, Lee and
/// Kim, Interactive Hausdorff Distance Computation for General Polygonal Models, 2009.) More than four
/// million pieces, or pieces smaller than a 4096th of the limit, count as far. The limit is lowered by 1e-7
/// of the soup's extent for rounding.
class SurfaceDistance {
 public:
  /// Keeps references to the points (any units, about any origin) and triangles, which are finite and not
  /// empty.
  SurfaceDistance(std::span<const Eigen::Vector3f> points, std::span<const Triangle> triangles);

  /// Tests triangles against the limit. The result is the same for every number of threads.
  /// @param points in single precision, in the units of the soup's
  /// @param offset of their origin from the soup's
  /// @param triangles indices of their points
  /// @param limit greater than 0
  /// @param context for cancellation
  /// @param free pieces that need not be near, in the frame of the points
  /// @param wanted size of the bound
  /// @throws Cancelled
  DistanceFromSurface hold(std::span<const Eigen::Vector3f> points, const Eigen::Vector3d& offset,
                           std::span<const Triangle> triangles, double limit, const RunContext& context,
                           const FreePieces& free = {}, Wanted wanted = Wanted::small_bound) const;

  /// Returns the distance of a point in the soup's frame, or `most` if it is farther away.
  double at(const Eigen::Vector3d& p, double most) const;

  const TriangleTree& tree() const { return tree_; }
  /// Largest error of a distance that is due to rounding, in the units of the points.
  double rounding() const { return rounding_; }

 private:
  struct Piece;
  class Walk;

  TriangleTree tree_;
  double rounding_ = 0.0;
};

}  // namespace hermesh
