// Sparse scalar volumes: level sets, scans and the other outputs of voxelization.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "hermesh/context.h"
#include "hermesh/export.h"

namespace hermesh::HERMESH_V1 {

/// The rows of an affine map from the index (i, j, k) of a sample to its world position:
/// x = rows[0][0] i + rows[0][1] j + rows[0][2] k + rows[0][3], and so on.
struct Placement {
  std::array<std::array<double, 4>, 3> rows = {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};

  /// Returns a placement with cubic voxels along the axes: sample (i, j, k) at origin + voxel_size · (i, j,
  /// k), world units.
  static Placement uniform(double voxel_size, std::array<double, 3> origin = {0, 0, 0}) {
    return {{{{voxel_size, 0, 0, origin[0]}, {0, voxel_size, 0, origin[1]}, {0, 0, voxel_size, origin[2]}}}};
  }
};

/// A box of samples in one array: the value of sample (i, j, k) = lower + (x, y, z) is values[(x · dims[1] +
/// y) · dims[2] + z], the order of a numpy array of shape dims.
struct DenseVolume {
  std::array<int, 3> lower = {0, 0, 0};  ///< index of the first sample
  std::array<int, 3> dims = {0, 0, 0};
  std::vector<float> values = {};
};

/// Options of Volume::from_dense().
struct DenseOptions {
  std::array<int, 3> lower = {0, 0, 0};  ///< index of the first sample
  Placement placement = {};
  /// True: values are signed distances in world units, negative inside; those of at least the background
  /// become ±background. False: every sample is active, as in a scan, and the volume ends at its box.
  bool level_set = false;
  /// The value beyond the samples; none: the greatest magnitude of a level set, else the next single
  /// precision below the least value, so that values above an isovalue are inside.
  std::optional<float> background = {};
  std::string name = {};  ///< empty: "sdf" or "volume"
};

/// A sparse grid with its placement, which owns an OpenVDB grid. A level set has signed distances in world
/// units, negative inside, within a narrow band and ±background beyond. A volume is immutable, and copies
/// share the data.
///
/// Most volumes are of floats. Others (such as "closest-point" of voxelize_grids()) can be written and
/// converted to OpenVDB (hermesh/openvdb.h); functions that read values throw Error for them. All members
/// except `bool` throw Error for an empty volume.
class HERMESH_API Volume {
 public:
  /// Creates an empty volume.
  Volume();
  explicit operator bool() const noexcept { return grid_ != nullptr; }

  /// Returns a volume of an array in the order of DenseVolume. @throws Error for a wrong size, a value that
  /// is not finite, and a placement that cannot be inverted.
  static Volume from_dense(std::span<const float> values, std::array<int, 3> dims,
                           const DenseOptions& options = {});
  /// Returns the box of the active samples, or another, as an array. @throws Error for more than 2^31 samples
  /// along a side, or more than fit in memory.
  DenseVolume to_dense() const;
  DenseVolume to_dense(std::array<int, 3> lower, std::array<int, 3> dims) const;

  /// Returns the values at positions (x, y, z each, world units), trilinear between samples.
  std::vector<float> sample(std::span<const double> places) const;

  std::string name() const;
  Volume with_name(const std::string& name) const;  ///< the same samples
  std::string value_type() const;                   ///< "float", "int32", "vec3s", ...
  bool is_level_set() const;
  Placement placement() const;
  double voxel_size() const;                    ///< world units, cube root of a voxel's volume
  double background() const;                    ///< value beyond the samples; world units in a level set
  std::pair<float, float> value_range() const;  ///< least and greatest value of the samples
  std::size_t active_voxels() const;
  std::size_t memory_bytes() const;
  std::array<int, 3> lower() const;  ///< least indices of active samples
  std::array<int, 3> dims() const;   ///< sides of the box of the active samples, in samples

 private:
  friend struct Inside;
  struct Grid;
  explicit Volume(std::shared_ptr<const Grid> grid) : grid_(std::move(grid)) {}
  std::shared_ptr<const Grid> grid_;
};

/// Reads a scalar grid of a .vdb file; half and double precision, integers, bool and masks become floats. An
/// empty name selects the grid "sdf", or the only scalar grid.
/// @throws Error for a file that is missing or damaged, and a grid that is missing or not scalar; Cancelled.
HERMESH_API Volume read_vdb(const std::filesystem::path& path, Context& context,
                            const std::string& name = {});
/// Returns the names of the grids of a .vdb file. @throws Error as read_vdb().
HERMESH_API std::vector<std::string> grid_names(const std::filesystem::path& path);

/// Writes the volumes as the grids of one .vdb file, by their names, atomically. The same volumes give the
/// same bytes.
/// @throws Error for a path that cannot be written, and two volumes of one name; Cancelled.
HERMESH_API void write_vdb(const std::filesystem::path& path, std::span<const Volume> volumes,
                           Context& context);
HERMESH_API void write_vdb(const std::filesystem::path& path, const Volume& volume, Context& context);

/// Layout of raw samples in a file, x fastest, then y, then z.
struct RawSamples {
  std::array<std::int64_t, 3> dims = {0, 0, 0};
  /// uint8, int8, uint16, int16, uint32, int32, uint64, int64, float32 or float64, followed by "le" (default)
  /// or "be"
  std::string type = {};
  std::array<double, 3> spacing = {1, 1, 1};  ///< distances of samples, mm
  std::uint64_t offset = 0;                   ///< bytes before the first sample
};

/// Options of import_volume(), as of `hermesh import`.
struct ImportOptions {
  std::optional<RawSamples> raw = {};      ///< none: the file is NIfTI-1 (.nii, .hdr, .img)
  std::optional<float> replace_nan = {};   ///< replaces samples that are not finite; none: they are errors
  std::optional<std::int64_t> frame = {};  ///< of a NIfTI file, from 0; none: the first
};

/// Imports a CT or MRI (NIfTI-1) or raw samples, also gzipped: the volume "volume" in millimetres with all
/// samples active.
/// @throws Error for a file that is missing, damaged or of another kind or size than specified; Cancelled.
HERMESH_API Volume import_volume(const std::filesystem::path& path, const ImportOptions& options,
                                 Context& context);

}  // namespace hermesh::HERMESH_V1
