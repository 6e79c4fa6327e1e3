// The points of the uniform mesh of `manifold-dual-contouring` while it is made.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace hermesh {

/// By number, those of cells first and then those on fanned edges (uniform_mesh.h); index space relative to
/// the placement's base. Where few are wanted there is memory only for these, a run of numbers at a time:
/// what merges needs no point, but what does not lies scattered among it.
class UniformPoints {
 public:
  /// All in one piece.
  static UniformPoints of_all(std::size_t count) {
    UniformPoints result;
    // With room for the few points that come to lie on edges, without which all would move then.
    result.places_.reserve(count + count / 32);
    result.places_.resize(count);
    return result;
  }
  /// None as yet.
  static UniformPoints of_few(std::size_t count) {
    UniformPoints result;
    result.runs_.resize(runs_of(count), kNone);
    result.is_whole_ = false;
    return result;
  }

  /// Of a point that there is room for. Not safe while room is made.
  Eigen::Vector3d& operator[](std::uint32_t point) { return places_[slot(point)]; }
  const Eigen::Vector3d& operator[](std::uint32_t point) const { return places_[slot(point)]; }

  void make_room(std::uint32_t point) {
    if (is_whole_) return;
    std::uint32_t& run = runs_[point / kRun];
    if (run != kNone) return;
    run = static_cast<std::uint32_t>(places_.size());
    places_.resize(places_.size() + kRun);
  }
  /// There are `count` points then, with room for those from `first` on.
  void extend(std::size_t first, std::size_t count) {
    if (is_whole_) {
      places_.resize(count);
      return;
    }
    runs_.resize(runs_of(count), kNone);
    for (std::size_t point = first; point < count; ++point) make_room(static_cast<std::uint32_t>(point));
  }

  /// Where a point's place is among slots(): a number for arrays beside this one.
  std::size_t slot(std::uint32_t point) const {
    return is_whole_ ? point : runs_[point / kRun] + std::size_t{point % kRun};
  }
  std::size_t slots() const { return places_.size(); }

  /// Of of_all().
  std::vector<Eigen::Vector3d> take() { return std::move(places_); }

 private:
  static constexpr std::uint32_t kNone = 0xffffffffu, kRun = 8;
  static constexpr std::size_t runs_of(std::size_t points) { return (points + kRun - 1) / kRun; }
  UniformPoints() = default;

  std::vector<Eigen::Vector3d> places_;
  std::vector<std::uint32_t> runs_;  ///< slots of the first points of runs
  bool is_whole_ = true;
};

}  // namespace hermesh
