// Scalar volumes of other programs: NIfTI-1 and raw samples.
//
// The result is a grid of floats with an active sample for each of the file's, so that the active voxels fill
// the box of the data and it is known where these end (extraction/volume_ends.h); constant regions become
// tiles. Its transform takes index coordinates to millimetres. Its class is "unknown": it is no distance. Its
// background is the next single precision below the smallest value, so that what is greater than an isovalue
// is inside. Metadata say where it comes from: hermesh_source (the file's name without folders),
// hermesh_sample_type, hermesh_minimum and hermesh_maximum, within which isovalues make sense.
//
// The reader of NIfTI is our own. Debian's libniftiio writes its complaints to stderr, allocates what a
// header asks for before it looks at the file, and multiplies dimensions unchecked; of its features we need a
// header of 348 bytes.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>

#include "algorithms/core/level_set.h"
#include "algorithms/core/run_context.h"
#include "algorithms/io/import/sample_type.h"

namespace hermesh {

struct ImportOptions {
  /// Value in place of samples that are NaN, infinite or too large for single precision; none: they are
  /// refused.
  std::optional<float> replacement;
  /// Number, from 0, of the frame in NIfTI files of more than three dimensions; none: the first, with a note.
  std::optional<std::int64_t> frame;
};

/// Whether the path ends in .nii, .hdr or .img, also with .gz behind.
bool is_nifti_path(const std::filesystem::path& path);

/// Imports NIfTI-1 in one file (.nii) or two (.hdr and .img, either of which may be named), in either order
/// of bytes, each file also gzipped; integers of 1 to 8 bytes, float32 and float64, which the datatype
/// decides, whatever bitpix says. scl_slope and scl_inter are applied; a slope that is not finite, as one of
/// 0, means that samples are not scaled. The transform is the sform of the file, else (where it is empty or
/// singular, too) its qform, else the sizes of its voxels alone; a unit of length other than millimeters is
/// converted. What was forgiven is a note. @throws Error, one sentence that names the file, for one that is
/// missing, truncated, damaged, no NIfTI-1 (ANALYZE 7.5 and NIfTI-2 are named), of colours, complex or
/// 128-bit numbers, with a singular transform, with more samples than the file can hold (before anything is
/// allocated) or memory can; for a frame that there is not, and for samples that are not finite, unless there
/// is a replacement. @throws Cancelled.
LevelSet import_nifti(const std::filesystem::path& path, const ImportOptions& options, RunContext& context);

/// How raw samples lie in a file, x fastest, then y, then z.
struct RawLayout {
  std::array<std::int64_t, 3> dims{};  ///< samples
  SampleFormat format;
  std::array<double, 3> spacing{1.0, 1.0, 1.0};  ///< distances of samples, world units (mm)
  std::uint64_t offset = 0;                      ///< place of the first sample, bytes (unpacked)
};

/// Imports raw samples, the first of which lies at the origin of the world. @throws Error as import_nifti()
/// does, for a spacing that is not finite and above 0, and for a file that does not end with the last sample:
/// dimensions that are wrong would pass for right.
LevelSet import_raw(const std::filesystem::path& path, const RawLayout& layout, const ImportOptions& options,
                    RunContext& context);

/// Writes the grid with its name (`volume` after an import) and metadata, aside and then renamed.
/// @throws Error if the path cannot be written.
void write_imported(const std::filesystem::path& path, const LevelSet& volume, RunContext& context);

}  // namespace hermesh
