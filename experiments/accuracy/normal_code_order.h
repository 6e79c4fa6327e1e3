// Codes of normals at other resolutions than the one in use, to see with which power of their step the error
// falls.
#pragma once

#include <cstdint>
#include <vector>

#include "algorithms/core/run_context.h"
#include "algorithms/hermite/normal_code.h"
#include "experiments/accuracy/slope_fit.h"

namespace hermesh {

/// Errors in radians against the step, 1 over the number of levels, at 4 to 10 bits a component; and how many
/// normals of those tried at the resolution in use do not come out as the code in use has them.
struct NormalCodeOrder {
  std::vector<ErrorsAtSize> mean, max;
  std::size_t differing = 0;
};

/// The codes' quantisation with any number of levels, without their packing into bits. Three draws of
/// `normals` random normals for each resolution. @throws Cancelled.
NormalCodeOrder normal_code_order(NormalCodeId code, std::size_t normals, std::uint64_t seed,
                                  const RunContext& context);

}  // namespace hermesh
