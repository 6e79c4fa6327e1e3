#include "algorithms/extraction/manifold_dual_contouring/block_merging.h"

#include <algorithm>
#include <cmath>

namespace hermesh {
namespace {

using Eigen::Vector3d;

class BlockMerging {
 public:
  BlockMerging(CubeCollapse& collapses, double width)
      : collapses_(collapses), mesh_(collapses.mesh()), state_(mesh_.vertices.size(), State::elsewhere) {
    for (std::uint32_t v = 0; v < mesh_.vertices.size(); ++v)
      if (mesh_.vertices[v].free && !mesh_.vertices[v].gone) members_.push_back({block_of(v, width), v});
    std::sort(members_.begin(), members_.end());
  }

  void run(const RunContext& context) {
    for (std::size_t begin = 0, end; begin < members_.size(); begin = end) {
      context.check();
      for (end = begin; end < members_.size() && members_[end].first == members_[begin].first;) ++end;
      for (std::size_t i = begin; i < end; ++i) state_[members_[i].second] = State::waiting;
      for (std::size_t i = begin; i < end; ++i)
        if (state_[members_[i].second] == State::waiting) merge_around(members_[i].second);
      for (std::size_t i = begin; i < end; ++i) state_[members_[i].second] = State::elsewhere;
    }
  }

 private:
  enum class State : std::uint8_t { elsewhere, waiting, done };

  std::array<std::int32_t, 3> block_of(std::uint32_t v, double width) const {
    const Vector3d at = mesh_.vertices[v].point / width;
    return {static_cast<std::int32_t>(std::floor(at[0])), static_cast<std::int32_t>(std::floor(at[1])),
            static_cast<std::int32_t>(std::floor(at[2]))};
  }

  /// All vertices of the block that hang together with one.
  void merge_around(std::uint32_t first) {
    disc_.assign(1, first);
    state_[first] = State::done;
    for (std::size_t i = 0; i < disc_.size(); ++i)
      mesh_.for_each_face(disc_[i], [&](std::uint32_t f, int corner) {
        const std::uint32_t w = mesh_.faces[f].corners[(corner + 1) % 3];
        if (state_[w] != State::waiting) return;
        state_[w] = State::done;
        disc_.push_back(w);
      });
    if (disc_.size() < 3) return;
    if (collapses_.gather(disc_.front(), std::span(disc_).subspan(1), place()) && collapses_.collapse().v_moves &&
        is_disc() && collapses_.passes())
      collapses_.apply();
  }

  Vector3d place() const {
    Vector3d middle = Vector3d::Zero();
    for (const std::uint32_t w : disc_) middle += mesh_.vertices[w].point;
    middle /= double(disc_.size());
    double reach = 0;
    for (const std::uint32_t w : disc_) reach = std::max(reach, (mesh_.vertices[w].point - middle).norm());
    const Vector3d x = collapses_.quadric_about(disc_, middle).minimiser();
    return collapses_.rounded(middle + x * std::min(1.0, reach / std::max(x.norm(), 1e-30)));
  }

  /// Whether the old faces are a disc: their border, which the new faces stand on, is one cycle without repetition, and the
  /// Euler characteristic is 1.
  bool is_disc() const {
    const Collapse& collapse = collapses_.collapse();
    const std::size_t ring = collapse.made.size();
    if (ring < 4 || collapse.old.size() + 2 != 2 * disc_.size() + ring) return false;
    const std::uint32_t start = collapse.made.front().others[0];
    std::uint32_t at = start;
    for (std::size_t step = 1;; ++step) {
      std::uint32_t next = CubeMesh::kNone;
      for (const Collapse::NewFace& made : collapse.made) {
        if (made.others[0] != at) continue;
        if (next != CubeMesh::kNone) return false;
        next = made.others[1];
      }
      if (next == CubeMesh::kNone || step > ring) return false;
      if (next == start) return step == ring;
      at = next;
    }
  }

  CubeCollapse& collapses_;
  CubeMesh& mesh_;
  std::vector<State> state_;  ///< by vertex
  std::vector<std::pair<std::array<std::int32_t, 3>, std::uint32_t>> members_;
  std::vector<std::uint32_t> disc_;
};

}  // namespace

void merge_blocks(CubeCollapse& collapses, double width, const RunContext& context) {
  BlockMerging(collapses, width).run(context);
}

}  // namespace hermesh
