// Scalar volumes of other programs: NIfTI-1 and raw samples.
//
// The result is a grid of floats with an active sample for each of the file's, so the active voxels fill the
// box of the data (extraction/volume_ends.h needs its ends); constant regions become tiles. Its transform
// takes index coordinates to millimetres. Its class is "unknown", since its values are not distances. Its
// background is 0 if all values are positive, and else the next single precision below the smallest: values
// greater than an isovalue are inside. Metadata give the source: hermesh_source (the file's name without
// directories), hermesh_sample_type, hermesh_minimum and hermesh_maximum, the bounds of useful isovalues. If
// integer samples look like labels (few values, nearly all equal to their neighbours), a note recommends to
// import them as such.
//
// Debian's libniftiio is not used: it writes errors to stderr, allocates the memory that a header claims
// before it checks the file, and multiplies dimensions unchecked.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "algorithms/core/level_set.h"
#include "algorithms/core/run_context.h"
#include "algorithms/io/stored_number.h"

namespace hermesh {

/// Type and byte order of stored samples.
struct SampleFormat {
  NumberType type = NumberType::uint8;
  bool big_endian = false;

  bool operator==(const SampleFormat&) const = default;
};

std::string name_of(SampleFormat format);  ///< "int16le", "uint8"

/// Parses uint8, int8, uint16, int16, uint32, int32, uint64, int64, float32 or float64, with the suffix le
/// (least significant byte first, the default) or be. @throws Error that lists the types.
SampleFormat parse_sample_format(const std::string& name);

struct ImportOptions {
  /// Replaces samples that are NaN, infinite or too large for single precision, which are otherwise an error.
  std::optional<float> replacement;
  /// Frame, from 0, of NIfTI files of more than three dimensions; by default the first, with a note.
  std::optional<std::int64_t> frame;
};

/// Returns true if the path ends in .nii, .hdr or .img, possibly followed by .gz.
bool is_nifti_path(const std::filesystem::path& path);

/// Imports NIfTI-1 in one file (.nii) or two (.hdr and .img, either of which may be named), in either byte
/// order, each file possibly gzipped; integers of 1 to 8 bytes, float32 and float64, by datatype and not
/// bitpix. scl_slope and scl_inter are applied; a slope that is 0 or not finite means no scaling. The
/// transform is the sform of the file, else (or if that is empty or singular) its qform, else the sizes of
/// its voxels; a unit of length other than millimeters is converted. Deviations that were tolerated are
/// noted.
/// @throws Error that names the file if it is missing, truncated, damaged, no NIfTI-1 (ANALYZE 7.5 and
/// NIfTI-2 are named), of colours, complex or 128-bit numbers, with a singular transform, or with more
/// samples than the file (checked before any allocation) or memory can hold; for a missing frame, and for
/// samples that are not finite without a replacement. @throws Cancelled.
LevelSet import_nifti(const std::filesystem::path& path, const ImportOptions& options, RunContext& context);

/// Layout of raw samples, x fastest, then y, then z.
struct RawLayout {
  std::array<std::int64_t, 3> dims{};  ///< samples
  SampleFormat format;
  std::array<double, 3> spacing{1.0, 1.0, 1.0};  ///< distances of samples, world units (mm)
  std::uint64_t offset = 0;                      ///< of the first sample, bytes (unpacked)
};

/// Imports raw samples, the first of which is at the origin of the world. @throws Error like import_nifti(),
/// for a spacing that is not finite and above 0, and for a file with data after the last sample, which shows
/// wrong dimensions.
LevelSet import_raw(const std::filesystem::path& path, const RawLayout& layout, const ImportOptions& options,
                    RunContext& context);

struct LabelGrid;

/// A label map as read from a file: a grid `labels` of 32-bit integers, in which the voxels of labels are
/// active and the background is 0. Metadata and transform are those of a scalar volume.
struct ImportedLabels {
  std::array<int, 3> dims;                         ///< samples of the file
  double voxel_size;                               ///< millimetres, cube root of the voxel's volume
  std::map<std::uint32_t, std::uint64_t> samples;  ///< number of samples of each label
  std::shared_ptr<const LabelGrid> grid;
};

/// Imports the samples of a file like import_nifti() and import_raw(), as labels: whole numbers from 0, the
/// background, to 2147483647.
/// @throws Error as these, for a sample that is no label, and for a file without a label; Cancelled
ImportedLabels import_nifti_labels(const std::filesystem::path& path, const ImportOptions& options,
                                   RunContext& context);
ImportedLabels import_raw_labels(const std::filesystem::path& path, const RawLayout& layout,
                                 const ImportOptions& options, RunContext& context);

/// Writes a label map atomically. @throws Error if the path cannot be written.
void write_imported(const std::filesystem::path& path, const ImportedLabels& labels, RunContext& context);

/// Writes the grid atomically with its name (`volume` after an import) and metadata. @throws Error if the
/// path cannot be written.
void write_imported(const std::filesystem::path& path, const LevelSet& volume, RunContext& context);

}  // namespace hermesh
