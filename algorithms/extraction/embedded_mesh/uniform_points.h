// The vertices of the uniform mesh during its construction.
#pragma once

#include <Eigen/Core>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace hermesh {

/// Positions of vertices by number, those of cells first and then those on fanned edges (uniform_mesh.h);
/// index space relative to the placement's base. If few are requested, memory is allocated for these only, in
/// runs of eight numbers: cells that merge need no vertex, but the others are scattered among them.
class UniformPoints {
 public:
  /// Returns contiguous room for `count` vertices.
  static UniformPoints of_all(std::size_t count) {
    UniformPoints result;
    // With spare capacity for the few vertices on edges, to avoid a reallocation.
    result.places_.reserve(count + count / 32);
    result.places_.resize(count);
    return result;
  }
  /// Returns numbers for `count` vertices, with room for none yet.
  static UniformPoints of_few(std::size_t count) {
    UniformPoints result;
    result.is_whole_ = false;
    result.number(count);
    return result;
  }

  /// Returns the position of a vertex that there is room for. Not safe to call during make_room().
  Eigen::Vector3d& operator[](std::uint32_t point) { return places_[slot(point)]; }
  const Eigen::Vector3d& operator[](std::uint32_t point) const { return places_[slot(point)]; }

  /// Requests room for a vertex from make_room(). Safe to call concurrently.
  void ask(std::uint32_t point) {
    if (is_whole_) return;
    const std::uint32_t run = point / kRun;
    if (runs_[run] != kNone) return;
    const std::uint64_t bit = std::uint64_t{1} << (run % 64);
    const std::atomic_ref asked(asked_[run / 64]);
    if (!(asked.load(std::memory_order_relaxed) & bit)) asked.fetch_or(bit, std::memory_order_relaxed);
  }
  /// Makes room for all requested vertices, by ascending number, so that the result does not depend on the
  /// order of requests. Existing values are preserved, but may move in memory.
  void make_room() {
    std::size_t runs = 0, slot = places_.size();
    for (const std::uint64_t asked : asked_) runs += static_cast<std::size_t>(std::popcount(asked));
    // With spare capacity for those that follow when merged cells are split.
    const std::size_t slots = slot + kRun * runs;
    if (slots > places_.capacity()) places_.reserve(slots + slots / 8);
    places_.resize(slots);
    for (std::size_t i = 0; i < asked_.size(); ++i)
      for (std::uint64_t left = std::exchange(asked_[i], 0); left != 0; left &= left - 1, slot += kRun)
        runs_[64 * i + static_cast<std::size_t>(std::countr_zero(left))] = static_cast<std::uint32_t>(slot);
  }
  /// Changes the number of vertices to `count`, with room for those from `first` on.
  void extend(std::size_t first, std::size_t count) {
    if (is_whole_) {
      places_.resize(count);
      return;
    }
    number(count);
    for (std::size_t point = first; point < count; ++point) ask(static_cast<std::uint32_t>(point));
    make_room();
  }

  /// Returns the index of a vertex among slots(), for parallel arrays.
  std::size_t slot(std::uint32_t point) const {
    return is_whole_ ? point : runs_[point / kRun] + std::size_t{point % kRun};
  }
  std::size_t slots() const { return places_.size(); }

  /// Moves the positions out, by number. Only for objects made by of_all().
  std::vector<Eigen::Vector3d> take() { return std::move(places_); }

 private:
  static constexpr std::uint32_t kNone = 0xffffffffu, kRun = 8;
  UniformPoints() = default;
  void number(std::size_t points) {
    runs_.resize((points + kRun - 1) / kRun, kNone);
    asked_.resize((runs_.size() + 63) / 64);
  }

  std::vector<Eigen::Vector3d> places_;
  std::vector<std::uint32_t> runs_;   ///< slot of each run's first vertex; kNone if there is no room for it
  std::vector<std::uint64_t> asked_;  ///< requested runs, one bit each
  bool is_whole_ = true;
};

}  // namespace hermesh
