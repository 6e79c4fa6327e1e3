#include "algorithms/remesh/two_sided_proof.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <numeric>
#include <utility>

namespace hermesh {
namespace {

/// Radius of the pieces of polygons that are tested for bounding something, in errors.
constexpr double kFreePiece = 1.0 / 16.0;
/// The first limit that is tried, and the step beyond the largest distance found, in errors.
constexpr double kFirstLimit = 0.8, kLimitStep = 0.02;

}  // namespace

double area(const std::vector<Eigen::Vector3f>& points, const Triangle& t) {
  const Eigen::Vector3d a = points[t[0]].cast<double>(), b = points[t[1]].cast<double>(),
                        c = points[t[2]].cast<double>();
  return 0.5 * (b - a).cross(c - a).norm();
}

SolidSurface surface_of(BoundaryTriangles boundary, std::span<const std::int8_t> turns, bool over_holes) {
  SolidSurface surface{std::move(boundary.points), {}, {}};
  for (std::size_t i = 0; i < boundary.triangles.size(); ++i) {
    const Triangle& t = boundary.triangles[i];
    if (boundary.ids[i] < 0) {
      surface.caps.push_back(t);
      surface.cap_area += area(surface.points, t);
    } else if (turns.empty() || turns[static_cast<std::size_t>(boundary.ids[i])] != 0) {
      surface.triangles.push_back(t);
      surface.area += area(surface.points, t);
    }
  }
  if (over_holes) surface.triangles.insert(surface.triangles.end(), surface.caps.begin(), surface.caps.end());
  return surface;
}

TwoSidedProof::TwoSidedProof(const PolygonMesh& mesh, double error, bool by_winding, bool keeps_open)
    : error_(error), rounding_(kOffSurface * bounds(mesh).size().norm()), keeps_open_(keeps_open) {
  if (by_winding) winding_.emplace(IndexSoup(mesh, 1.0));
}

std::span<const std::int8_t> TwoSidedProof::turns() const {
  return winding_ ? std::span<const std::int8_t>(winding_->orientation().turns)
                  : std::span<const std::int8_t>();
}

std::optional<std::array<Eigen::Vector3d, 2>> TwoSidedProof::sides_of(const Corners& piece) const {
  const Eigen::Vector3d normal = (piece[1] - piece[0]).cross(piece[2] - piece[0]).normalized();
  if (!normal.allFinite() || normal.isZero()) return std::nullopt;
  const Eigen::Vector3d middle = (piece[0] + piece[1] + piece[2]) / 3.0, step = rounding_ * normal;
  return std::array<Eigen::Vector3d, 2>{middle + step, middle - step};
}

bool TwoSidedProof::bounds_solid(const std::vector<Eigen::Vector3f>& points, const Triangle& triangle) const {
  const auto sides = sides_of({points[triangle[0]].cast<double>(), points[triangle[1]].cast<double>(),
                               points[triangle[2]].cast<double>()});
  return sides && winding_->number().at((*sides)[0]) < 0.5 && winding_->number().at((*sides)[1]) > 0.5;
}

void TwoSidedProof::bound_nothing(std::span<const Corners> pieces, std::span<std::uint8_t> results) const {
  std::vector<Eigen::Vector3d> points;  // two for each piece that has an area
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const auto sides = sides_of(pieces[i]);
    results[i] = !sides;
    if (sides) points.insert(points.end(), sides->begin(), sides->end());
  }
  std::vector<float> numbers(points.size());
  winding_->number().at(points, numbers);
  for (std::size_t i = 0, next = 0; i < pieces.size(); ++i) {
    if (results[i]) continue;
    const bool before = numbers[next] > 0.5f, behind = numbers[next + 1] > 0.5f;
    results[i] = before == behind && (before || !keeps_open_);
    next += 2;
  }
}

bool TwoSidedProof::bounds_nothing(const SolidSurface& surface, const Far& at) const {
  if (!winding_) return false;
  const Triangle& t = surface.triangles[at.triangle];
  Corners piece;
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d from_corner = surface.points[t[i]].cast<double>() - at.place;
    // Normals mean nothing on the triangle's edges, so a small piece next to the corner is tested.
    piece[i] =
        at.place + std::min(1.0, kFreePiece * error_ / std::max(from_corner.norm(), 1e-300)) * from_corner;
  }
  std::uint8_t result = 0;
  bound_nothing(std::span(&piece, 1), std::span(&result, 1));
  return result;
}

TwoSidedDistance TwoSidedProof::compare(std::span<const Eigen::Vector3f> points,
                                        const std::vector<Triangle>& triangles, const Eigen::Vector3d& offset,
                                        const SolidSurface& surface, const SurfaceDistance& to,
                                        const SurfaceDistance& from, Wanted wanted, bool lists_pieces,
                                        const RunContext& context) const {
  FreePieces free;
  if (winding_)
    free = {.are_free = [this](std::span<const Corners> pieces,
                               std::span<std::uint8_t> results) { bound_nothing(pieces, results); },
            .radius = kFreePiece * error_};
  const auto hold = [&](const SurfaceDistance& other, std::span<const Eigen::Vector3f> of,
                        const Eigen::Vector3d& shift, const std::vector<Triangle>& held,
                        const FreePieces& may_be_free) {
    return wanted == Wanted::small_bound
               ? smallest_bound(other, of, shift, held, may_be_free, lists_pieces, context)
               : other.hold(of, shift, held, error_, context, may_be_free,
                            lists_pieces ? Wanted::far_pieces : wanted);
  };
  const DistanceFromSurface there = hold(to, points, offset, triangles, {}),
                            back = hold(from, surface.points, -offset, surface.triangles, free);
  TwoSidedDistance result{there.upper, back.upper, back.free_area, {}};
  for (const FarTriangle& f : there.far)
    result.far.push_back({f.place + offset, f.distance, false, 0, f.radius, f.area});
  for (const FarTriangle& f : back.far)
    result.far.push_back({f.place, f.distance, true, f.triangle, f.radius, f.area});
  return result;
}

/// Returns SurfaceDistance::hold() with the smallest limit, to a few hundredths of the error, that holds and
/// is at most the error.
DistanceFromSurface TwoSidedProof::smallest_bound(const SurfaceDistance& to,
                                                  std::span<const Eigen::Vector3f> points,
                                                  const Eigen::Vector3d& offset,
                                                  std::vector<Triangle> triangles, const FreePieces& free,
                                                  bool lists_pieces, const RunContext& context) const {
  DistanceFromSurface all;
  std::vector<std::uint32_t> numbers(triangles.size());
  std::iota(numbers.begin(), numbers.end(), 0u);
  for (double limit = kFirstLimit * error_;;) {
    const bool is_last = limit >= error_;
    if (is_last) limit = error_;
    // Before the last limit nothing is free, because a far piece may still be near enough.
    DistanceFromSurface now =
        to.hold(points, offset, triangles, limit, context, is_last ? free : FreePieces{},
                is_last && lists_pieces ? Wanted::far_pieces : Wanted::small_bound);
    all.upper = std::max(all.upper, now.upper);
    all.free_area += now.free_area;
    // Only triangles beyond this limit are compared with the next.
    std::vector<Triangle> left;
    std::vector<std::uint32_t> left_numbers;
    double farthest = limit;
    for (FarTriangle& f : now.far) {
      left.push_back(triangles[f.triangle]);
      f.triangle = numbers[f.triangle];
      left_numbers.push_back(f.triangle);
      farthest = std::max(farthest, f.distance);
    }
    if (is_last || now.far.empty()) {
      all.far = std::move(now.far);
      return all;
    }
    triangles = std::move(left);
    numbers = std::move(left_numbers);
    limit = farthest + kLimitStep * error_;
  }
}

}  // namespace hermesh
