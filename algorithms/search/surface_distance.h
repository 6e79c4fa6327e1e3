// The one-sided distance of one surface from another, held against a limit with proof.
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

/// A triangle that is farther from the other surface than the limit, or is not shown to be within it.
struct FarTriangle {
  std::uint32_t triangle;  ///< its number among those that were asked about
  Eigen::Vector3d place;   ///< a place on it, in the frame of the points that were asked about
  double distance;         ///< of that place from the other surface, at most twice the limit
};

/// What a surface's distance from another is known to be.
struct DistanceFromSurface {
  /// No place of the triangles that are not in `far` is farther away than this; at most the limit.
  double upper = 0.0;
  double free_area = 0.0;  ///< area of the pieces that were found free, in the units of the points squared
  std::vector<FarTriangle> far;  ///< ascending by number
};

/// Parts of the triangles that are asked about which need not be near.
struct FreePieces {
  /// Whether a piece that is farther away than the limit may be; called from several threads. Null: none may.
  std::function<bool(const std::array<Eigen::Vector3d, 3>& piece)> is_free = {};
  /// Pieces that are asked for have at most this radius about their middle.
  double radius = 0.0;
};

/// What is asked for: the bound of all that is near as small as comes out, or whatever is within the limit,
/// sooner.
enum class Wanted { small_bound, any_bound };

/// A triangle soup that distances are measured to.
///
/// **Why a limit holds** for a piece of a triangle: where the piece's three corners are within the limit of
/// one triangle of the soup, all of the piece is, for the distance to a convex set is a convex function; and
/// where the distance of the piece's middle and the piece's radius add up to no more than the limit, by the
/// triangle inequality, as it does where points in rows over the piece are near enough for how far they are
/// from each other. Pieces for which none of these holds are cut along the sides of the triangle below where
/// that is large, so that the first rule holds for what is over it, and halved elsewhere. (Compare Tang, Lee
/// and Kim, Interactive Hausdorff Distance Computation for General Polygonal Models, 2009.) What has come to
/// more than four million pieces, or to pieces smaller than a 4096th of the limit, counts as far. The limit
/// is lowered by 1e-7 of the soup's extent for rounding.
class SurfaceDistance {
 public:
  /// Keeps references to the points (any units, about any origin) and triangles, which are finite and not
  /// empty.
  SurfaceDistance(std::span<const Eigen::Vector3f> points, std::span<const Triangle> triangles);

  /// Whether triangles keep to the limit. The same outcome for every number of threads.
  /// @param points in single precision, in the units of the soup's
  /// @param offset of their origin from the soup's
  /// @param triangles numbers of their points
  /// @param limit greater than 0
  /// @param context asked whether to stop
  /// @param free tells which pieces need not be near, in the frame of the points
  /// @param wanted whether the bound is to be small
  /// @throws Cancelled
  DistanceFromSurface hold(std::span<const Eigen::Vector3f> points, const Eigen::Vector3d& offset,
                           std::span<const Triangle> triangles, double limit, const RunContext& context,
                           const FreePieces& free = {}, Wanted wanted = Wanted::small_bound) const;

  /// The distance of a place in the soup's frame, or `most` where it is farther away.
  double at(const Eigen::Vector3d& p, double most) const;

  const TriangleTree& tree() const { return tree_; }

 private:
  struct Piece;
  class Walk;

  TriangleTree tree_;
  double rounding_ = 0.0;  ///< what distances may be wrong by
};

}  // namespace hermesh
