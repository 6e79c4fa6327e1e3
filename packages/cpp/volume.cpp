// Volumes: arrays, values, files, OpenVDB's grids.
#include <openvdb/openvdb.h>
#include <openvdb/tools/ChangeBackground.h>
#include <openvdb/tools/Dense.h>
#include <openvdb/tools/Interpolation.h>
#include <openvdb/tools/Prune.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "algorithms/core/level_set.h"
#include "algorithms/io/import/import_volume.h"
#include "algorithms/io/vdb_archive.h"
#include "algorithms/io/vdb_file.h"
#include "algorithms/lattice/memory_estimate.h"
#include "algorithms/thesis/voxels/dense_hermite.h"
#include "hermesh/openvdb.h"
#include "packages/cpp/volume_grid.h"

namespace hermesh::v1 {

// ---- Inside and outside.

const Volume::Grid& Inside::grid(const Volume& volume) {
  if (!volume.grid_) throw Error("the volume holds nothing");
  return *volume.grid_;
}

Volume Inside::volume_of(Volume::Grid&& grid) {
  return Volume(std::make_shared<const Volume::Grid>(std::move(grid)));
}

LevelSet Inside::level_set(const Volume& volume) {
  const Volume::Grid& grid = Inside::grid(volume);
  if (!grid.level_set)
    throw Error("the volume '" + grid.name + "' holds " + grid.grid->valueType() +
                " values; one of floats is needed");
  return grid.level_set;
}

Volume Inside::volume(const LevelSet& level_set) {
  const openvdb::FloatGrid::ConstPtr& grid = level_set.grid().grid;
  return volume_of({grid, level_set, grid->getName()});
}

openvdb::GridBase::ConstPtr to_openvdb(const Volume& volume) { return Inside::grid(volume).grid; }

namespace {

/// Returns a grid of any scalar type as one of floats; null for other types. A grid of floats is shared.
openvdb::FloatGrid::ConstPtr as_float(const openvdb::GridBase::ConstPtr& grid) {
  if (auto same = openvdb::gridConstPtrCast<openvdb::FloatGrid>(grid)) return same;
  openvdb::FloatGrid::Ptr converted;
  if (const auto mask = openvdb::gridConstPtrCast<openvdb::MaskGrid>(grid)) {
    // Active samples of a mask become 1.
    converted = openvdb::FloatGrid::create(
        std::make_shared<openvdb::FloatTree>(mask->tree(), 0.0f, 1.0f, openvdb::TopologyCopy()));
    converted->insertMeta(*mask);
    converted->setTransform(mask->transform().copy());
    return converted;
  }
  using Numbers =
      openvdb::TypeList<openvdb::DoubleGrid, openvdb::Int32Grid, openvdb::Int64Grid, openvdb::BoolGrid>;
  grid->apply<Numbers>(
      [&](const auto& numbers) { converted = std::make_shared<openvdb::FloatGrid>(numbers); });
  return converted;
}

}  // namespace

Volume from_openvdb(const openvdb::GridBase::ConstPtr& grid) {
  return run([&] {
    require(grid != nullptr, "there is no grid");
    initialize_openvdb();
    const openvdb::FloatGrid::ConstPtr floats = as_float(grid);
    if (!floats) return Inside::volume_of({grid, {}, grid->getName()});
    return Inside::volume_of({floats, make_level_set(floats), grid->getName()});
  });
}

Volume::Volume() = default;

std::string Volume::name() const { return Inside::grid(*this).name; }

Volume Volume::with_name(const std::string& name) const {
  Grid named = Inside::grid(*this);
  named.name = name;
  return Inside::volume_of(std::move(named));
}

std::string Volume::value_type() const { return Inside::grid(*this).grid->valueType(); }
bool Volume::is_level_set() const {
  return Inside::grid(*this).grid->getGridClass() == openvdb::GRID_LEVEL_SET;
}

// ---- Positions of samples.

namespace {

openvdb::math::Transform::Ptr transform_of(const Placement& placement) {
  // OpenVDB multiplies row vectors from the left, so its matrix is the transpose of ours.
  openvdb::Mat4d matrix = openvdb::Mat4d::identity();
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column) {
      require(std::isfinite(placement.rows[row][column]), "the placement has a number that is not finite");
      matrix[column][row] = placement.rows[row][column];
    }
  Eigen::Matrix3d linear;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) linear(row, column) = placement.rows[row][column];
  const double scale = linear.colwise().norm().prod();
  require(std::abs(linear.determinant()) > 1e-12 * scale && scale > 0.0,
          "the placement cannot be inverted: voxels have no volume");
  // OpenVDB simplifies the map to a scale if possible, and so knows that voxels are cubes.
  return openvdb::math::Transform::createLinearTransform(matrix);
}

openvdb::CoordBBox box_of(const std::array<int, 3>& lower, const std::array<int, 3>& dims) {
  const openvdb::Coord first(lower[0], lower[1], lower[2]);
  double count = 1.0;
  for (int axis = 0; axis < 3; ++axis) {
    require(dims[axis] >= 1 &&
                double(lower[axis]) + double(dims[axis]) <= double(std::numeric_limits<int>::max()),
            "a box of samples has at least 1 on each side, and ends below index 2^31");
    count *= double(dims[axis]);
  }
  check_fits_memory(count * sizeof(float), "the array of samples");
  return {first, first.offsetBy(dims[0] - 1, dims[1] - 1, dims[2] - 1)};
}

}  // namespace

Placement Volume::placement() const {
  const openvdb::math::Transform& transform = Inside::grid(*this).grid->transform();
  // The columns of an affine map are its values at the unit vectors, minus that at zero.
  const openvdb::Vec3d zero = transform.indexToWorld(openvdb::Vec3d(0, 0, 0));
  Placement placement;
  for (int axis = 0; axis < 3; ++axis) {
    openvdb::Vec3d unit(0, 0, 0);
    unit[axis] = 1;
    const openvdb::Vec3d column = transform.indexToWorld(unit) - zero;
    for (int row = 0; row < 3; ++row) placement.rows[row][axis] = column[row];
  }
  for (int row = 0; row < 3; ++row) placement.rows[row][3] = zero[row];
  return placement;
}

double Volume::voxel_size() const {
  return std::cbrt(std::abs(Inside::grid(*this).grid->transform().voxelVolume()));
}
double Volume::background() const { return Inside::level_set(*this).background(); }
std::pair<float, float> Volume::value_range() const {
  return run([&] { return hermesh::value_range(Inside::level_set(*this)); });
}
std::size_t Volume::active_voxels() const { return Inside::grid(*this).grid->activeVoxelCount(); }
std::size_t Volume::memory_bytes() const { return Inside::grid(*this).grid->memUsage(); }

std::array<int, 3> Volume::lower() const {
  const openvdb::CoordBBox box = Inside::grid(*this).grid->evalActiveVoxelBoundingBox();
  if (box.empty()) return {};
  return {box.min().x(), box.min().y(), box.min().z()};
}

std::array<int, 3> Volume::dims() const {
  const openvdb::CoordBBox box = Inside::grid(*this).grid->evalActiveVoxelBoundingBox();
  if (box.empty()) return {};
  return {box.dim().x(), box.dim().y(), box.dim().z()};
}

// ---- Arrays.

Volume Volume::from_dense(std::span<const float> values, std::array<int, 3> dims,
                          const DenseOptions& options) {
  return run([&] {
    initialize_openvdb();
    const openvdb::CoordBBox box = box_of(options.lower, dims);
    require(values.size() == box.volume(), "the array holds " + std::to_string(values.size()) +
                                               " samples, but " + std::to_string(dims[0]) + " x " +
                                               std::to_string(dims[1]) + " x " + std::to_string(dims[2]) +
                                               " are " + std::to_string(box.volume()));
    const auto infinite = std::ranges::find_if_not(values, [](float value) { return std::isfinite(value); });
    require(infinite == values.end(), "sample " + std::to_string(infinite - values.begin()) +
                                          " of the array is not a finite number; replace it first");
    const auto [least, greatest] = std::ranges::minmax(values);
    const float largest = std::max(std::abs(least), std::abs(greatest));
    const float background = options.background ? *options.background
                             : options.level_set
                                 ? largest
                                 : std::nextafter(least, -std::numeric_limits<float>::infinity());
    require(std::isfinite(background) && (!options.level_set || background > 0.0f),
            "the background must be a finite number, and above 0 for a level set");
    const openvdb::FloatGrid::Ptr grid = openvdb::FloatGrid::create(background);
    grid->setTransform(transform_of(options.placement));
    grid->setName(!options.name.empty() ? options.name : options.level_set ? "sdf" : "volume");
    // OpenVDB reads the array through a non-const pointer and does not change it.
    const openvdb::tools::Dense<float, openvdb::tools::LayoutZYX> dense(box,
                                                                        const_cast<float*>(values.data()));
    if (options.level_set) {
      grid->setGridClass(openvdb::GRID_LEVEL_SET);
      openvdb::tools::copyFromDense(dense, *grid, 0.0f);
      // Beyond the band only the sign of a value matters.
      for (auto leaf = grid->tree().beginLeaf(); leaf; ++leaf)
        for (auto value = leaf->beginValueAll(); value; ++value) {
          if (std::abs(*value) < background) continue;
          value.setValue(std::copysign(background, *value));
          value.setValueOff();
        }
      openvdb::tools::pruneInactive(grid->tree());
      openvdb::tools::prune(grid->tree());
    } else {
      // Samples with the background's value are known, too: the background is a value below all samples
      // meanwhile.
      const float least_of_all = std::min(least, background);
      const float none = std::nextafter(least_of_all, -std::numeric_limits<float>::infinity());
      require(std::isfinite(none),
              "the least sample is the least number of single precision, and no background lies below it");
      openvdb::tools::changeBackground(grid->tree(), none);
      openvdb::tools::copyFromDense(dense, *grid, 0.0f);
      openvdb::tools::changeBackground(grid->tree(), background);
      openvdb::tools::prune(grid->tree());
    }
    return Inside::volume(make_level_set(grid));
  });
}

DenseVolume Volume::to_dense(std::array<int, 3> lower, std::array<int, 3> dims) const {
  return run([&] {
    const LevelSet level_set = Inside::level_set(*this);
    const openvdb::CoordBBox box = box_of(lower, dims);
    DenseVolume result{lower, dims, std::vector<float>(box.volume())};
    openvdb::tools::Dense<float, openvdb::tools::LayoutZYX> dense(box, result.values.data());
    openvdb::tools::copyToDense(*level_set.grid().grid, dense);
    return result;
  });
}

DenseVolume Volume::to_dense() const {
  const std::array<int, 3> sides = dims();
  return sides == std::array<int, 3>{} ? DenseVolume() : to_dense(lower(), sides);
}

std::vector<float> Volume::sample(std::span<const double> places) const {
  return run([&] {
    require(places.size() % 3 == 0, "the array of places holds " + std::to_string(places.size()) +
                                        " numbers, which is no multiple of 3");
    const LevelSet level_set = Inside::level_set(*this);
    const openvdb::FloatGrid& grid = *level_set.grid().grid;
    std::vector<float> values(places.size() / 3);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, values.size(), 1024), [&](const auto& range) {
      // An accessor caches the last leaf, and belongs to one thread.
      const openvdb::FloatGrid::ConstAccessor samples = grid.getConstAccessor();
      for (std::size_t i = range.begin(); i < range.end(); ++i) {
        const openvdb::Vec3d world(places[3 * i], places[3 * i + 1], places[3 * i + 2]);
        values[i] = openvdb::tools::BoxSampler::sample(samples, grid.transform().worldToIndex(world));
      }
    });
    return values;
  });
}

// ---- Files.

Volume read_vdb(const std::filesystem::path& path, Context& context, const std::string& name) {
  return run(context, [&](RunContext& inner) {
    register_dense_grids();
    return Inside::volume(read_level_set(path, name, inner));
  });
}

std::vector<std::string> grid_names(const std::filesystem::path& path) {
  return run([&] {
    register_dense_grids();
    return about_vdb_file(path, [&] {
      VdbReader file(path);
      return file.names();
    });
  });
}

void write_vdb(const std::filesystem::path& path, std::span<const Volume> volumes, Context& context) {
  run(context, [&](RunContext& inner) {
    const Stage stage(inner, "write volume");
    initialize_openvdb();
    require(!volumes.empty(), "there is no volume to write into '" + path.string() + "'");
    openvdb::GridCPtrVec grids;
    std::set<std::string> names;
    for (const Volume& volume : volumes) {
      const auto& held = Inside::grid(volume);
      require(names.insert(held.name).second,
              "two volumes for '" + path.string() + "' have the name '" + held.name + "'");
      if (held.grid->getName() == held.name) {
        grids.push_back(held.grid);
        continue;
      }
      // A shallow copy, so that its name does not change the shared grid.
      const openvdb::GridBase::Ptr grid = openvdb::ConstPtrCast<openvdb::GridBase>(held.grid)->copyGrid();
      grid->setName(held.name);
      grids.push_back(grid);
    }
    write_grids(path, grids);
    return true;
  });
}

void write_vdb(const std::filesystem::path& path, const Volume& volume, Context& context) {
  write_vdb(path, std::span(&volume, 1), context);
}

Volume import_volume(const std::filesystem::path& path, const ImportOptions& options, Context& context) {
  return run(context, [&](RunContext& inner) {
    require(std::isfinite(options.replace_nan.value_or(0.0f)),
            "the value that replaces samples that are not finite must be finite");
    const hermesh::ImportOptions chosen{.replacement = options.replace_nan, .frame = options.frame};
    if (!options.raw) {
      require(is_nifti_path(path),
              "unknown format of '" + path.string() +
                  "': its name ends neither in .nii, .hdr nor .img (.gz may follow); give the layout of raw "
                  "samples");
      return Inside::volume(import_nifti(path, chosen, inner));
    }
    require(!options.frame, "a frame is one of a NIfTI file; for raw samples give an offset");
    for (const std::int64_t side : options.raw->dims)
      require(side >= 1, "the numbers of raw samples must be three numbers above 0");
    const RawLayout layout{.dims = options.raw->dims,
                           .format = parse_sample_format(options.raw->type),
                           .spacing = options.raw->spacing,
                           .offset = options.raw->offset};
    return Inside::volume(import_raw(path, layout, chosen, inner));
  });
}

}  // namespace hermesh::v1
