// Certifies that a triangle is nowhere farther from a mesh than a bound.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "algorithms/extraction/certified_collapse/fine_mesh.h"
#include "algorithms/extraction/contact/triangle_overlay.h"
#include "algorithms/extraction/contact/triangle_reach.h"
#include "algorithms/search/triangle_tree.h"

namespace hermesh {

/// Largest excess of the proved distance over the bound, voxels: pieces need not get smaller than this.
inline constexpr double kDistanceSlack = 0.005;

/// Proves that triangles are near a mesh, one after another.
///
/// **Why it holds.** Most triangles are covered by the mesh directly above or below, no farther away than the
/// bound (triangle_overlay.h), except for a seam along its sides that is within half of kDistanceSlack of the
/// rest. The others, at creases and boundaries, are cut into pieces until each is
/// covered so, or until its corners are within the bound of one triangle of the mesh (the distance to a
/// convex set is convex), or until its middle's distance and its radius add up to no more than the bound and
/// kDistanceSlack. The proof may fail although the triangle is near: the nearest triangle of the mesh is
/// searched only locally, and the number of pieces is limited.
class DistanceCertificate {
 public:
  DistanceCertificate(const FineMesh& mesh, TriangleOverlay& overlay) : mesh_(mesh), overlay_(overlay) {}

  /// Returns true if the whole triangle is proved to be within the bound of the mesh.
  /// @param start a triangle of the mesh near it
  /// @param bound returns the largest distance from a given face of the mesh, voxels; called for every face
  ///   that the proof rests on
  /// @param seen called with faces of the mesh that are over some of the triangle and within their bounds
  ///   there, as by TriangleOverlay::is_near()
  template <class Bound, class Seen>
  bool holds(const Corners& triangle, std::uint32_t start, const Bound& bound, Seen&& seen) {
    const Eigen::Vector3d middle = (triangle[0] + triangle[1] + triangle[2]) / 3.0;
    start = mesh_.walk(start, middle);
    if (overlay_.is_near(triangle, mesh_, start, bound, seen, 0.5 * kDistanceSlack)) return true;
    pieces_left_ = kMostPieces;
    return holds_in_pieces(triangle, start, bound, nullptr);
  }

 private:
  /// A triangle of the mesh, and the largest distance of a piece from it.
  struct Face {
    TriangleReach reach;
    double within;
    bool is_near(const Corners& piece) const {
      return reach.near(piece[0], within) && reach.near(piece[1], within) && reach.near(piece[2], within);
    }
  };

  /// Returns true if a piece is near, whole or halved. `last` is the face nearest to the triangle from which
  /// the piece is cut, or null.
  template <class Bound>
  bool holds_in_pieces(const Corners& piece, std::uint32_t start, const Bound& bound, const Face* last) {
    if (last && last->is_near(piece)) return true;
    if (--pieces_left_ < 0) return false;
    const Eigen::Vector3d middle = (piece[0] + piece[1] + piece[2]) / 3.0;
    double squared;
    const std::uint32_t found = mesh_.nearest_around(start, middle, squared);
    const double distance = std::sqrt(squared), within = bound(found);
    if (distance > within) return false;
    double radius = 0;
    for (const Eigen::Vector3d& p : piece) radius = std::max(radius, (p - middle).norm());
    if (distance + radius <= within + kDistanceSlack) return true;
    const Face face{TriangleReach(mesh_.corners(found)), within};
    if (face.is_near(piece) || overlay_.is_near(piece, mesh_, found, bound, 0.5 * kDistanceSlack))
      return true;

    int i = 0;
    for (int side = 1; side < 3; ++side)
      if ((piece[(side + 1) % 3] - piece[side]).squaredNorm() > (piece[(i + 1) % 3] - piece[i]).squaredNorm())
        i = side;
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    const Eigen::Vector3d half = 0.5 * (piece[i] + piece[j]);
    return holds_in_pieces({piece[i], half, piece[k]}, found, bound, &face) &&
           holds_in_pieces({half, piece[j], piece[k]}, found, bound, &face);
  }

  static constexpr int kMostPieces = 512;

  const FineMesh& mesh_;
  TriangleOverlay& overlay_;
  int pieces_left_ = 0;
};

}  // namespace hermesh
