// What the importers share: from where samples lie in a file to a grid. Heavy (Eigen): private to
// algorithms/io/import.
#pragma once

#include <Eigen/Core>
#include <string>

#include "algorithms/io/import/byte_source.h"
#include "algorithms/io/import/import_volume.h"

namespace hermesh {

/// A box of samples in a file, x fastest, then y, then z.
struct StoredSamples {
  std::string file;  ///< name of the file that holds the samples, for sentences
  std::array<std::int64_t, 3> dims{};
  SampleFormat format;
  std::uint64_t offset = 0;  ///< place of the first sample in the file, unpacked bytes
  double slope = 1.0, intercept = 0.0;
  Eigen::Matrix4d to_world =
      Eigen::Matrix4d::Identity();  ///< index coordinates to millimeters, applied to columns
};

/// Bytes that the samples take. @throws Error for dimensions below 1 or beyond what a grid's index can be,
/// for more than `at_most` bytes in all, and for more memory than there is; nothing is allocated.
std::uint64_t check_stored(const StoredSamples& stored, std::uint64_t at_most);

/// Reads the samples from the source, which stands at or before the first, into a grid as import_volume.h
/// describes it. @throws Error for a source that ends early or is damaged, for samples that are not finite
/// unless they are replaced, and for a transform that OpenVDB does not take. @throws Cancelled.
LevelSet read_stored(ByteSource& source, const StoredSamples& stored, const ImportOptions& options,
                     RunContext& context);

}  // namespace hermesh
