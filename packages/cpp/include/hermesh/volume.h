// Sparse scalar volumes: level sets, scans and what voxelize() makes besides.
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

/// The rows of an affine map from the index (i, j, k) of a sample to its place in the world:
/// x = rows[0][0] i + rows[0][1] j + rows[0][2] k + rows[0][3], and so on.
struct Placement {
  std::array<std::array<double, 4>, 3> rows = {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};

  /// Cubic voxels along the axes: sample (i, j, k) at origin + voxel_size · (i, j, k), world units.
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

/// How samples of an array become a volume.
struct DenseOptions {
  std::array<int, 3> lower = {0, 0, 0};  ///< index of the first sample
  Placement placement = {};
  /// True: values are signed distances in world units, negative inside, of which those nearer than the
  /// background are kept, and the others are ±background. False: every sample counts as known, as in a scan,
  /// and the volume ends at its box.
  bool level_set = false;
  /// The value beyond the samples; none: the greatest magnitude of a level set's values, else the next single
  /// precision below the least value, so that what is greater than an isovalue is inside.
  std::optional<float> background = {};
  std::string name = {};  ///< empty: "sdf" or "volume"
};

/// A sparse grid with its placement, an OpenVDB grid inside. As a level set: signed distance in world units,
/// negative inside, right within a narrow band and ±background beyond. A value: nobody changes a volume once
/// it is made, and copies share it.
///
/// Most are of floats. Others ("closest-point" of voxelize_grids(), say) can be written and handed to OpenVDB
/// (hermesh/openvdb.h); functions that look at values @throw Error for them. All but `bool` throw Error for a
/// volume that holds nothing.
class HERMESH_API Volume {
 public:
  /// Nothing.
  Volume();
  explicit operator bool() const noexcept { return grid_ != nullptr; }

  /// A volume of an array, see DenseVolume for its order. @throws Error for sizes that do not fit, a value
  /// that is not finite, and a placement that cannot be inverted.
  static Volume from_dense(std::span<const float> values, std::array<int, 3> dims,
                           const DenseOptions& options = {});
  /// The box of the active samples, or another, as an array. @throws Error for one that has more than 2^31
  /// samples a side or does not fit in memory.
  DenseVolume to_dense() const;
  DenseVolume to_dense(std::array<int, 3> lower, std::array<int, 3> dims) const;

  /// Values at places (x, y, z each, world units), trilinear between samples; one for each.
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

/// Reads a scalar grid of a .vdb file: floats, or half and double precision, whole numbers, bool and masks as
/// floats.
/// An empty name takes the grid "sdf", or the only scalar grid there is.
/// @throws Error for a file that is missing or damaged, and a grid that is not there or not scalar;
/// Cancelled.
HERMESH_API Volume read_vdb(const std::filesystem::path& path, Context& context,
                            const std::string& name = {});
/// Names of the grids of a .vdb file. @throws Error as read_vdb().
HERMESH_API std::vector<std::string> grid_names(const std::filesystem::path& path);

/// Writes the volumes as the grids of one .vdb file, by their names, beside the path and renamed. The same
/// volumes give the same bytes. @throws Error for a path that cannot be written, and two volumes of one name;
/// Cancelled.
HERMESH_API void write_vdb(const std::filesystem::path& path, std::span<const Volume> volumes,
                           Context& context);
HERMESH_API void write_vdb(const std::filesystem::path& path, const Volume& volume, Context& context);

/// How raw samples lie in a file, x fastest, then y, then z.
struct RawSamples {
  std::array<std::int64_t, 3> dims = {0, 0, 0};
  /// uint8, int8, uint16, int16, uint32, int32, uint64, int64, float32 or float64, with "le" (also if nothing
  /// is said) or "be" behind
  std::string type = {};
  std::array<double, 3> spacing = {1, 1, 1};  ///< distances of samples, mm
  std::uint64_t offset = 0;                   ///< bytes before the first sample
};

/// What `hermesh import` takes.
struct ImportOptions {
  std::optional<RawSamples> raw = {};  ///< none: the file is NIfTI-1 (.nii, .hdr, .img)
  std::optional<float> replace_nan =
      {};  ///< value in place of samples that are not finite; none: they are refused
  std::optional<std::int64_t> frame = {};  ///< of a NIfTI file, from 0; none: the first
};

/// Imports a CT or MRI (NIfTI-1) or raw samples, also gzipped: the volume "volume" in millimetres, every
/// sample of which is active. @throws Error for a file that is missing, damaged or of another kind or size
/// than was said; Cancelled.
HERMESH_API Volume import_volume(const std::filesystem::path& path, const ImportOptions& options,
                                 Context& context);

}  // namespace hermesh::HERMESH_V1
