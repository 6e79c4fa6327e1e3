#include "algorithms/variants.h"

#include "experiments/harness/harness.h"
#include "reference/variants.h"

namespace hermesh {

std::vector<Extractor> all_extractors() {
  const std::span<const Extractor> ours = our_extractors(), others = reference_extractors();
  std::vector<Extractor> all(ours.begin(), ours.end());
  all.insert(all.end(), others.begin(), others.end());
  return all;
}

std::vector<Voxelizer> all_voxelizers() {
  const std::span<const Voxelizer> ours = our_voxelizers(), others = reference_voxelizers();
  std::vector<Voxelizer> all(ours.begin(), ours.end());
  all.insert(all.end(), others.begin(), others.end());
  return all;
}

}  // namespace hermesh
