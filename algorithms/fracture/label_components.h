// Splits disconnected pieces, and merges slivers into a neighbour.
#pragma once

#include <cstdint>
#include <vector>

#include "algorithms/core/run_context.h"
#include "algorithms/fracture/labelled_solid.h"

namespace hermesh {

struct ComponentOptions {
  /// True if disconnected parts of one piece become several pieces; else a piece may have several closed
  /// surfaces. Two samples are connected by a *contact*: a lattice edge, or an ambiguous face across which
  /// the surface of the whole solid joins them (LabelledSolid::joined_faces) and which belongs to no joint.
  /// Thin parts oblique to the lattice have many such faces and few edges.
  bool split = true;
  /// The least number of samples of a piece. A smaller one joins the neighbour that it has most contacts with
  /// (the lowest of equals), the smallest first. 0 keeps everything.
  std::uint64_t least_samples = 0;
};

/// A piece that was given to another one.
struct MergedSliver {
  std::uint32_t code;  ///< the code of the piece that no longer exists, as in LabelledSolid::codes
  std::uint64_t samples;
  std::uint32_t into_code;  ///< the code of the piece that has its samples now
};

struct ComponentReport {
  std::vector<MergedSliver> merged;
  std::uint64_t split_off = 0;   ///< pieces that splitting made more, before any was merged
  std::uint64_t small_kept = 0;  ///< pieces below the least number of samples that have no neighbour
};

/// Splits and merges pieces as the options specify and renumbers all of them from 1 to n without gaps, by
/// their code and then by their first sample. The result does not depend on the number of threads.
///
/// Simple cells (label_repair.h) remain simple if pieces are only renumbered. Splitting and merging may leave
/// cells that are not simple: corners of one piece that are connected only across an ambiguous face may
/// become parts of two pieces. So the labels have to be repaired afterwards.
/// @throws Cancelled
ComponentReport settle_components(LabelledSolid& solid, const ComponentOptions& options, RunContext& context);

}  // namespace hermesh
