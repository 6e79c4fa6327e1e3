// The representations of Hermite data by name, for comparisons.
#pragma once

#include <cstddef>
#include <string>

#include "algorithms/core/level_set.h"
#include "algorithms/core/run_context.h"
#include "algorithms/hermite/sparse_hermite.h"

namespace hermesh {

enum class Representation {
  sparse_float,  ///< FloatHermite
  sparse,        ///< PackedHermite
  dense_float,   ///< FloatVoxel, 52 bytes
  fixed,         ///< FixedVoxel, 10 bytes
  thesis,        ///< ThesisVoxel, 10 bytes
  directed,      ///< DirectedVoxel, 12 bytes: offsets without normals
};

/// @throws Error for a name that is not one of "sparse-float", "sparse", "dense-float", "fixed", "thesis",
/// "directed".
Representation parse_representation(const std::string& name);

struct Represented {
  FloatHermite hermite;       ///< decoded again
  std::size_t bytes = 0;      ///< allocated by the representation
  std::size_t crossings = 0;  ///< number of crossings before
  std::size_t lost = 0;       ///< number of lost crossings, which were replaced by the middle of their edges
};

/// Adds statistics to the run: the bytes of the representation, in total, per crossing and per active voxel
/// of the level set.
void report_size(const Represented& data, const LevelSet& level_set, RunContext& context);
/// Adds those statistics and the number of lost crossings, with a note if there are any.
void report_figures(const Represented& data, const LevelSet& level_set, RunContext& context);

/// Stores the data in a representation, with normals in `code` if it packs them, and reads them again.
/// `thesis` ignores `code`.
Represented through(Representation representation, NormalCodeId code, FloatHermite hermite,
                    RunContext& context);

}  // namespace hermesh
