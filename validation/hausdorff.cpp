#include "validation/hausdorff.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>

#include "validation/geometry/triangle_cover.h"

namespace hermesh::validation {
namespace {

// Triangles are refined a batch at a time, so that memory is bounded by the batch and not by the mesh.
constexpr std::size_t kBatch = std::size_t(1) << 16;
constexpr std::size_t kMostPieces = std::size_t(1) << 22;
constexpr int kMostLevels = 40;

// A point of `from` and the triangle of `to` that is closest to it.
struct Probe {
  Eigen::Vector3d point;
  double distance;
  std::uint32_t slot;
};

using Piece = std::array<Probe, 3>;

class BranchAndBound {
 public:
  BranchAndBound(const TriangleTree& to, double gap, const RunContext& context)
      : to_(to), gap_(gap), context_(context) {}

  HausdorffBound run(const TriangleSoup& from) {
    const std::vector<Probe> probes = probe_points(from);
    for (const Probe& p : probes) lower_ = std::max(lower_, p.distance);
    for (std::size_t first = 0; first < from.triangles.size(); first += kBatch) {
      const std::size_t count = std::min(kBatch, from.triangles.size() - first);
      refine(select(count, [&](std::size_t i) {
        const Triangle& t = from.triangles[first + i];
        return Piece{probes[t[0]], probes[t[1]], probes[t[2]]};
      }));
    }
    return {lower_, std::max(lower_, settled_)};
  }

 private:
  Probe probe(const Eigen::Vector3d& point, std::uint32_t guess) const {
    const ClosestHit hit = to_.closest(point, guess);
    return {point, std::sqrt(hit.squared), hit.slot};
  }

  double distance_to(std::uint32_t slot, const Eigen::Vector3d& point) const {
    return (closest_point(to_.corners(slot), point) - point).norm();
  }

  double bound_by(std::uint32_t slot, const Piece& piece) const {
    double bound = 0.0;
    for (const Probe& p : piece)
      bound = std::max(bound, p.slot == slot ? p.distance : distance_to(slot, p.point));
    return bound;
  }

  double upper_bound(const Piece& piece) const {
    const Eigen::Vector3d centre = (piece[0].point + piece[1].point + piece[2].point) / 3.0;
    const Probe middle = probe(centre, piece[0].slot);
    double radius = 0.0;
    for (const Probe& p : piece) radius = std::max(radius, (p.point - centre).norm());
    const double reach = middle.distance + radius, limit = lower_ + gap_;
    double bound = std::min(reach, bound_by(middle.slot, piece));
    for (const Probe& p : piece) bound = std::min(bound, bound_by(p.slot, piece));
    if (bound <= limit) return bound;
    return std::min(bound, cover_bound({piece[0].point, piece[1].point, piece[2].point}, to_, reach, limit));
  }

  // Of the points that no triangle uses the distance is 0.
  std::vector<Probe> probe_points(const TriangleSoup& from) const {
    std::vector<std::uint8_t> used(from.points.size(), 0);
    for (const Triangle& t : from.triangles)
      for (std::uint32_t p : t) used[p] = 1;
    std::vector<Probe> probes(from.points.size(), Probe{Eigen::Vector3d::Zero(), 0.0, 0});
    const auto probe_range = [&](const tbb::blocked_range<std::size_t>& range) {
      context_.check();
      std::uint32_t guess = 0;
      for (std::size_t i = range.begin(); i < range.end(); ++i) {
        if (!used[i]) continue;
        probes[i] = probe(from.points[i], guess);
        guess = probes[i].slot;
      }
    };
    // Fixed ranges: the guess decides which of two triangles at the same distance is the answer.
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, probes.size(), 512), probe_range,
                      tbb::simple_partitioner());
    return probes;
  }

  void refine(std::vector<Piece> pieces) {
    for (int level = 0; !pieces.empty(); ++level) {
      if (level == kMostLevels || pieces.size() > kMostPieces) {
        for (const Piece& piece : pieces) settled_ = std::max(settled_, upper_bound(piece));
        return;
      }
      pieces = cut(pieces);
    }
  }

  // Cuts every piece into four at the middles of its sides.
  std::vector<Piece> cut(const std::vector<Piece>& pieces) {
    std::vector<Piece> middles(pieces.size());
    const auto raise = [&](const tbb::blocked_range<std::size_t>& range, double lower) {
      context_.check();
      for (std::size_t i = range.begin(); i < range.end(); ++i)
        for (int k = 0; k < 3; ++k) {
          const Probe &a = pieces[i][k], &b = pieces[i][(k + 1) % 3];
          middles[i][k] = probe(0.5 * (a.point + b.point), a.slot);
          lower = std::max(lower, middles[i][k].distance);
        }
      return lower;
    };
    const tbb::blocked_range<std::size_t> all(0, pieces.size(), 256);
    const auto larger = [](double a, double b) { return std::max(a, b); };
    lower_ = tbb::parallel_deterministic_reduce(all, lower_, raise, larger);
    return select(4 * pieces.size(), [&](std::size_t i) {
      const Piece &p = pieces[i / 4], &m = middles[i / 4];
      const std::size_t k = i % 4;
      return k == 3 ? m : Piece{p[k], m[k], m[(k + 2) % 3]};
    });
  }

  // Keeps the pieces whose upper bound is too far above the lower bound, in order, and notes the bound of the
  // others.
  template <class MakePiece>
  std::vector<Piece> select(std::size_t count, const MakePiece& make) {
    struct Selected {
      double settled = 0.0;
      std::vector<Piece> open;
    };
    const auto select_range = [&](const tbb::blocked_range<std::size_t>& range, Selected selected) {
      context_.check();
      for (std::size_t i = range.begin(); i < range.end(); ++i) {
        const Piece piece = make(i);
        const double bound = upper_bound(piece);
        if (bound <= lower_ + gap_)
          selected.settled = std::max(selected.settled, bound);
        else
          selected.open.push_back(piece);
      }
      return selected;
    };
    const auto join = [](Selected left, const Selected& right) {
      left.settled = std::max(left.settled, right.settled);
      left.open.insert(left.open.end(), right.open.begin(), right.open.end());
      return left;
    };
    const tbb::blocked_range<std::size_t> all(0, count, 1024);
    Selected selected = tbb::parallel_deterministic_reduce(all, Selected{}, select_range, join);
    settled_ = std::max(settled_, selected.settled);
    return std::move(selected.open);
  }

  const TriangleTree& to_;
  double gap_;
  const RunContext& context_;
  double lower_ = 0.0;
  double settled_ = 0.0;
};

}  // namespace

HausdorffBound certified_distance(const TriangleSoup& from, const TriangleTree& to, double gap,
                                  RunContext& context) {
  HausdorffBound bound = BranchAndBound(to, gap, context).run(from);
  Box box;
  for (const Triangle& t : from.triangles)
    for (std::uint32_t p : t) box.add(from.points[p]);
  const double diagonal = std::max(box.diagonal(), to.bounds().diagonal());
  box.add(to.bounds());
  const double largest = std::max(box.lower.cwiseAbs().maxCoeff(), box.upper.cwiseAbs().maxCoeff());
  const double slack = 1e-7 * diagonal + 1e-15 * largest;
  return {std::max(0.0, bound.lower - slack), bound.upper + slack};
}

}  // namespace hermesh::validation
