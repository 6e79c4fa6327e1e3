#include "algorithms/search/surface_distance.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "algorithms/core/parallel.h"

namespace hermesh {
namespace {

using Corners = std::array<Eigen::Vector3d, 3>;

// Limits where no search of this kind can decide, such as at a point that is the limit away to the last
// digit.
constexpr std::size_t kMostPieces = 4'000'000;
constexpr double kSmallestPiece = 1.0 / 4096.0;  // of the limit
/// With Wanted::far_pieces: the same, and the largest radius of pieces that are listed, in limits.
constexpr double kSmallestListed = 1.0 / 16.0, kLargestListed = 0.5;
/// Points of a piece are tested in rows: largest distance of a point of the piece from the nearest of them,
/// in limits; most parts of a side; and least height of a piece, in its longest side, so that rows are no
/// closer than necessary.
constexpr double kBetweenRows = 0.8;
constexpr int kMostParts = 16;
constexpr double kLeastHeight = 0.3;
/// Length of a side of a triangle of the soup, in limits, from which on pieces are divided along it: pieces
/// of about a limit in size hold anyway.
constexpr double kLongSide = 2.0;
/// Distance, in limits, that a piece must extend over such a side, and within it, to be divided there.
constexpr double kReachesOver = 1.0 / 64.0;

double radius_about(const Eigen::Vector3d& middle, const Corners& piece) {
  double squared = 0.0;
  for (const Eigen::Vector3d& p : piece) squared = std::max(squared, (p - middle).squaredNorm());
  return std::sqrt(squared);
}

}  // namespace

/// A part of a triangle, and the triangle of the soup that was nearest to its parent.
struct SurfaceDistance::Piece {
  Corners corners;
  std::uint32_t nearest;
};

/// Tests one triangle after another; each thread has its own, for the stack.
class SurfaceDistance::Walk {
 public:
  Walk(const SurfaceDistance& surface, double limit, const Eigen::Vector3d& offset, const FreePieces& free,
       Wanted wanted, const RunContext& context)
      : context_(context),
        tree_(surface.tree_),
        limit_(limit - surface.rounding_),
        search_(4.0 * limit * limit),
        offset_(offset),
        free_(free),
        wanted_(wanted) {}

  /// Tests triangle `number`. Then `upper` is at least the largest distance, or a piece was added to `far`,
  /// all of its far pieces with Wanted::far_pieces.
  void test(const Corners& triangle, std::uint32_t number, DistanceFromSurface& result) {
    const bool lists = wanted_ == Wanted::far_pieces;
    double& upper = result.upper;
    // Neighbours are most often near the same triangle, even if it is not the nearest to each.
    stack_.assign(1, {triangle, wanted_ == Wanted::any_bound ? last_ : TriangleTree::kNone});
    std::size_t pieces = 0;
    while (!stack_.empty()) {
      if (pieces % 1024 == 0) context_.check();
      const Piece piece = stack_.back();
      stack_.pop_back();
      // The triangle nearest to the whole is most often near its parts, which saves the search.
      if (piece.nearest != TriangleTree::kNone && all_near(piece.corners, piece.nearest, upper)) continue;
      if (wanted_ == Wanted::any_bound && !is_large(piece.nearest) && all_near_in_rows(piece.corners, upper))
        continue;
      const Eigen::Vector3d middle = (piece.corners[0] + piece.corners[1] + piece.corners[2]) / 3.0;
      const double radius = radius_about(middle, piece.corners);
      const NearestTriangle found = nearest(middle, piece.nearest, radius);
      const double distance = std::sqrt(found.squared);
      // If nothing within twice the limit was found, or the middle is too far, no piece of it can hold.
      const bool is_far = found.triangle == TriangleTree::kNone || distance > limit_;
      if (!is_far) last_ = found.triangle;
      if (!is_far && distance + radius <= limit_) {
        upper = std::max(upper, distance + radius);
        continue;
      }
      const bool is_last =
          ++pieces > kMostPieces || radius < (lists ? kSmallestListed : kSmallestPiece) * limit_;
      const auto piece_area = [&] {
        return 0.5 * (piece.corners[1] - piece.corners[0]).cross(piece.corners[2] - piece.corners[0]).norm();
      };
      // The last pieces between near and free parts are a little too far, though their middles are not.
      if (free_.are_free && (is_last || (is_far && radius <= free_.radius)) && is_free(piece.corners)) {
        result.free_area += piece_area();
        continue;
      }
      // A piece that is certainly far may still contain free pieces.
      const bool may_be_listed = is_far && lists && radius <= kLargestListed * limit_,
                 is_middle_free = may_be_listed && !is_last && free_.are_free && is_free(piece.corners);
      if (is_middle_free && distance > limit_ + radius) {
        list_all_but_free(piece.corners, radius, number, distance, result);
        continue;
      }
      if (is_last || (may_be_listed && !is_middle_free) ||
          (is_far && !lists && (!free_.are_free || radius <= free_.radius))) {
        result.far.push_back({number, middle - offset_, distance, radius, piece_area()});
        if (!lists) return;
        continue;
      }
      if (!is_far && found.triangle != piece.nearest && all_near(piece.corners, found.triangle, upper))
        continue;
      // Pieces that straddle the limit would be cut into more and more slivers.
      if (is_far || lists || !cut_along(piece.corners, found.triangle)) halve(piece.corners, found.triangle);
    }
  }

 private:
  bool all_near(const Corners& piece, std::uint32_t triangle, double& upper) const {
    const Eigen::Vector3d a = tree_.corner(triangle, 0), b = tree_.corner(triangle, 1),
                          c = tree_.corner(triangle, 2);
    double largest = 0.0;
    for (const Eigen::Vector3d& p : piece) {
      largest = std::max(largest, squared_distance(p, a, b, c));
      if (largest > limit_ * limit_) return false;
    }
    upper = std::max(upper, std::sqrt(largest));
    return true;
  }

  /// Returns true if rows of points over a piece are so near, and so close to each other, that all of it is
  /// within the limit: no point of a triangle is farther from the nearest of its corners than its
  /// circumradius. This takes a quarter of the searches of bisection. False, soon, for pieces that are too
  /// large, too slim or too far for that.
  bool all_near_in_rows(const Corners& piece, double& upper) {
    const Eigen::Vector3d u = piece[1] - piece[0], v = piece[2] - piece[0];
    const double a = u.norm(), b = v.norm(), c = (v - u).norm(), longest = std::max({a, b, c}),
                 twice_area = u.cross(v).norm();
    if (!(twice_area >= kLeastHeight * longest * longest)) return false;
    const double circumradius = a * b * c / (2.0 * twice_area),
                 parts = std::ceil(circumradius / (kBetweenRows * limit_));
    if (!(parts >= 2.0 && parts <= kMostParts)) return false;
    const int n = int(parts);
    const double between = circumradius / n, enough = (limit_ - between) * (limit_ - between);
    for (int i = 0; i <= n; ++i)
      for (int j = 0; i + j <= n; ++j) {
        const Eigen::Vector3d p = piece[0] + (double(i) / n) * u + (double(j) / n) * v;
        const NearestTriangle found = tree_.nearest(p, enough, enough);
        if (found.triangle == TriangleTree::kNone) return false;
        last_ = found.triangle;
      }
    upper = std::max(upper, limit_);
    return true;
  }

  /// Returns the triangle nearest to p, or one that is near enough for all about p. The distance to `known`,
  /// which is near, or to the one found last saves most of the search.
  NearestTriangle nearest(const Eigen::Vector3d& p, std::uint32_t known, double radius) const {
    if (known == TriangleTree::kNone) known = last_;
    const double most = limit_ - radius,
                 enough = wanted_ == Wanted::any_bound && most > 0.0 ? most * most : -1.0;
    if (known == TriangleTree::kNone) return tree_.nearest(p, search_, enough);
    const double squared =
        squared_distance(p, tree_.corner(known, 0), tree_.corner(known, 1), tree_.corner(known, 2));
    const NearestTriangle found = tree_.nearest(p, std::min(squared, search_), enough);
    return found.triangle != TriangleTree::kNone || squared > search_ ? found
                                                                      : NearestTriangle{squared, known};
  }

  bool is_free(Corners piece) const {
    for (Eigen::Vector3d& p : piece) p -= offset_;
    std::uint8_t result = 0;
    free_.are_free(std::span(&piece, 1), std::span(&result, 1));
    return result;
  }

  /// Lists those parts of a far piece that are not free, as pieces no larger than the largest that may be
  /// free. Tests all parts at once, which takes a small part of the time of one test for each.
  void list_all_but_free(const Corners& piece, double radius, std::uint32_t number, double distance,
                         DistanceFromSurface& result) {
    const int n = int(std::ceil(radius / free_.radius));
    const Eigen::Vector3d u = (piece[1] - piece[0]) / n, v = (piece[2] - piece[0]) / n;
    parts_.clear();
    for (int i = 0; i < n; ++i)
      for (int j = 0; i + j < n; ++j) {
        const Eigen::Vector3d a = piece[0] - offset_ + i * u + j * v, b = a + u, c = a + v;
        parts_.push_back({a, b, c});
        if (i + j + 1 < n) parts_.push_back({b, b + v, c});
      }
    are_free_.assign(parts_.size(), 0);
    free_.are_free(parts_, are_free_);
    const double area = 0.5 * u.cross(v).norm();
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      if (are_free_[i]) {
        result.free_area += area;
        continue;
      }
      const Eigen::Vector3d middle = (parts_[i][0] + parts_[i][1] + parts_[i][2]) / 3.0;
      // All of the piece is at least this far away.
      result.far.push_back({number, middle, distance - radius, radius_about(middle, parts_[i]), area});
    }
  }

  bool is_large(std::uint32_t triangle) const {
    if (triangle == TriangleTree::kNone) return false;
    const Eigen::Vector3d a = tree_.corner(triangle, 0), b = tree_.corner(triangle, 1),
                          c = tree_.corner(triangle, 2);
    const double least = kLongSide * kLongSide * limit_ * limit_;
    return (b - a).squaredNorm() > least || (c - b).squaredNorm() > least || (a - c).squaredNorm() > least;
  }

  /// Divides a piece by the perpendicular plane through the side of a triangle of the soup over which it
  /// extends farthest. The part over the triangle is then near it, so that a plane part is shown to be near
  /// another by as many pieces as their triangles overlap in, for any limit. Returns false, with nothing
  /// divided, if the triangle is small or too far from the piece.
  bool cut_along(const Corners& piece, std::uint32_t triangle) {
    if (!is_large(triangle)) return false;
    const Corners at = {tree_.corner(triangle, 0), tree_.corner(triangle, 1), tree_.corner(triangle, 2)};
    const Eigen::Vector3d normal = (at[1] - at[0]).cross(at[2] - at[0]).normalized();
    if (!normal.allFinite() || normal.isZero()) return false;
    for (const Eigen::Vector3d& p : piece)
      if (std::abs(normal.dot(p - at[0])) > limit_) return false;
    double most = kReachesOver * limit_;
    std::array<double, 3> over;  // of the corners, over the side where the piece extends farthest
    bool found = false;
    for (int side = 0; side < 3; ++side) {
      const Eigen::Vector3d outwards = (at[(side + 1) % 3] - at[side]).cross(normal).normalized();
      std::array<double, 3> here;
      for (int i = 0; i < 3; ++i) here[i] = outwards.dot(piece[i] - at[side]);
      const auto [least, largest] = std::minmax_element(here.begin(), here.end());
      if (*least > -kReachesOver * limit_ || *largest <= most) continue;
      most = *largest;
      over = here;
      found = true;
    }
    if (!found) return false;
    // One corner is on one side of the plane, two on the other.
    int lone = 0;
    while ((over[lone] > 0) == (over[(lone + 1) % 3] > 0) || (over[lone] > 0) == (over[(lone + 2) % 3] > 0))
      ++lone;
    const int i = (lone + 1) % 3, j = (lone + 2) % 3;
    const auto on_plane = [&](int other) -> Eigen::Vector3d {
      return piece[lone] + over[lone] / (over[lone] - over[other]) * (piece[other] - piece[lone]);
    };
    const Eigen::Vector3d p = on_plane(i), q = on_plane(j);
    stack_.push_back({{p, piece[i], piece[j]}, triangle});
    stack_.push_back({{p, piece[j], q}, triangle});
    stack_.push_back({{piece[lone], p, q}, triangle});
    return true;
  }

  // Across its longest side, so that pieces do not become slim, whose radius would decrease slowly.
  void halve(const Corners& piece, std::uint32_t nearest) {
    int i = 0;
    for (int side = 1; side < 3; ++side)
      if ((piece[(side + 1) % 3] - piece[side]).squaredNorm() > (piece[(i + 1) % 3] - piece[i]).squaredNorm())
        i = side;
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    const Eigen::Vector3d half = 0.5 * (piece[i] + piece[j]);
    stack_.push_back({{half, piece[j], piece[k]}, nearest});
    stack_.push_back({{piece[i], half, piece[k]}, nearest});
  }

  const RunContext& context_;
  const TriangleTree& tree_;
  double limit_;            ///< reduced by a bound on the rounding errors
  double search_;           ///< square of the search radius for the nearest triangle
  Eigen::Vector3d offset_;  ///< of the frame of the queried pieces, relative to the soup's
  const FreePieces& free_;
  Wanted wanted_;
  std::uint32_t last_ = TriangleTree::kNone;  ///< that some piece was near
  std::vector<Piece> stack_;
  std::vector<Corners> parts_;  ///< of list_all_but_free()
  std::vector<std::uint8_t> are_free_;
};

SurfaceDistance::SurfaceDistance(std::span<const Eigen::Vector3f> points, std::span<const Triangle> triangles)
    : tree_(points, triangles, 1.0) {
  // Only points that a triangle uses: a scan may have stray ones far away.
  Bounds box;
  for (const Triangle& t : triangles)
    for (const std::uint32_t p : t) box.add(points[p].cast<double>());
  rounding_ = 1e-7 * box.size().norm();
}

DistanceFromSurface SurfaceDistance::hold(std::span<const Eigen::Vector3f> points,
                                          const Eigen::Vector3d& offset, std::span<const Triangle> triangles,
                                          double limit, const RunContext& context, const FreePieces& free,
                                          Wanted wanted) const {
  // Results of each block of triangles have their own entry.
  constexpr std::size_t kBlock = 64;
  std::vector<DistanceFromSurface> blocks((triangles.size() + kBlock - 1) / kBlock);
  parallel_blocks(blocks.size(), context, [&](std::size_t block) {
    Walk walk(*this, limit, offset, free, wanted, context);
    for (std::size_t t = block * kBlock; t < std::min(triangles.size(), (block + 1) * kBlock); ++t) {
      Corners corners;
      for (int i = 0; i < 3; ++i) corners[i] = offset + points[triangles[t][i]].cast<double>();
      walk.test(corners, static_cast<std::uint32_t>(t), blocks[block]);
    }
  });
  DistanceFromSurface result;
  for (const DistanceFromSurface& block : blocks) {
    result.upper = std::max(result.upper, block.upper);
    result.free_area += block.free_area;
    result.far.insert(result.far.end(), block.far.begin(), block.far.end());
  }
  // The limit was lowered by as much, so this is at most the limit.
  result.upper += rounding_;
  return result;
}

double SurfaceDistance::at(const Eigen::Vector3d& p, double most) const {
  return std::sqrt(tree_.nearest(p, most * most).squared);
}

}  // namespace hermesh
