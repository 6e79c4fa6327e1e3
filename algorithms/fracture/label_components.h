// Pieces that fall apart become several, and slivers go to a neighbour.
#pragma once

#include <cstdint>
#include <vector>

#include "algorithms/core/run_context.h"
#include "algorithms/fracture/labelled_solid.h"

namespace hermesh {

struct ComponentOptions {
  /// Samples of one piece that do not hang together become several pieces; else a piece may have several
  /// closed surfaces. Two samples hang together by a *contact*: a lattice edge, or an ambiguous face across
  /// which the whole's surface joins them (LabelledSolid::joined_faces) and which no joint shares, for what
  /// is thin and aslant in the lattice has many of these and few edges.
  bool split = true;
  /// In voxels, that is samples: whatever is smaller joins the neighbour that it has most contacts
  /// with (the lowest of equals), the smallest first. 0 keeps everything.
  std::uint64_t least_samples = 0;
};

/// A piece that was given to another one.
struct MergedSliver {
  std::uint32_t code;  ///< as in LabelledSolid::codes
  std::uint64_t samples;
  std::uint32_t into_code;
};

struct ComponentReport {
  std::vector<MergedSliver> merged;
  std::uint64_t split_off = 0;   ///< pieces more than codes, before any was merged
  std::uint64_t small_kept = 0;  ///< below the least volume, but without a neighbour
};

/// Numbers the pieces anew, 1 to n without a gap, by their code and then by their first sample.
///
/// What is simple (label_repair.h) stays so where pieces only get other numbers. Splitting and merging may
/// leave cells that are not: corners of one piece that hang together across an ambiguous face only may come
/// to lie in two pieces. So the labels are to be repaired after it.
ComponentReport settle_components(LabelledSolid& solid, const ComponentOptions& options, RunContext& context);

}  // namespace hermesh
