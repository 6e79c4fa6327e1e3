// Balls around the exceptions of a bound.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <functional>
#include <map>
#include <utility>
#include <vector>

#include "algorithms/remesh/bounded_remesh.h"
#include "algorithms/remesh/two_sided_proof.h"

namespace hermesh {

/// Balls that contain the pieces for which a bound is not proved; world units.
class ExceptionBalls {
 public:
  /// Makes balls that contain all pieces, each around the farthest piece that no earlier one contains.
  ExceptionBalls(std::vector<Far> pieces, double error) : error_(error) {
    std::ranges::stable_sort(pieces, std::greater<>(), &Far::distance);
    for (const Far& piece : pieces) {
      UnmetPlace* ball = find(piece, [&](const UnmetPlace&) { return kBall * error_; });
      if (!ball) {
        cells_[cell_of(piece, 13)].push_back(balls_.size());
        ball = &balls_.emplace_back(Unmet::thin, piece.place, piece.distance);
      }
      ball->radius = std::max(ball->radius, (piece.place - ball->place).norm() + piece.radius);
      ball->area += piece.area;
    }
  }

  /// Returns true if a ball contains a piece or nearly so.
  bool nearly_contain(const Far& piece) {
    return find(piece, [&](const UnmetPlace& ball) { return ball.radius + kAroundBall * error_; });
  }
  std::vector<UnmetPlace> list() && { return std::move(balls_); }

 private:
  /// In errors: radius of the balls, except around single larger pieces, and the distance from them within
  /// which collapses may cause other exceptions.
  static constexpr double kBall = 4.0, kAroundBall = 0.5;

  /// Returns a ball that contains a piece if it has the radius `radius(ball)`; null if there is none.
  template <class F>
  UnmetPlace* find(const Far& piece, const F& radius) {
    for (int n = 0; n < 27; ++n)
      if (const auto found = cells_.find(cell_of(piece, n)); found != cells_.end())
        for (const std::size_t i : found->second)
          if ((piece.place - balls_[i].place).norm() + piece.radius <= radius(balls_[i])) return &balls_[i];
    return nullptr;
  }
  /// Returns one of the 27 cells around a piece, the middle one for 13.
  std::array<int, 3> cell_of(const Far& piece, int n) const {
    const Eigen::Vector3d at = (piece.place / ((kBall + kAroundBall) * error_)).array().floor();
    return {int(at.x()) + n / 9 - 1, int(at.y()) + n / 3 % 3 - 1, int(at.z()) + n % 3 - 1};
  }

  double error_;
  std::vector<UnmetPlace> balls_;
  std::map<std::array<int, 3>, std::vector<std::size_t>> cells_;  ///< numbers of balls by their centres' cell
};

}  // namespace hermesh
