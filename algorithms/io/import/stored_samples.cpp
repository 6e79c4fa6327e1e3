#include "algorithms/io/import/stored_samples.h"

#include <openvdb/tools/Prune.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <vector>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/core/parallel.h"
#include "algorithms/io/vdb_archive.h"
#include "algorithms/lattice/memory_estimate.h"

namespace hermesh {
namespace {

using Tree = openvdb::FloatTree;
using Leaf = Tree::LeafNodeType;

/// Dimensions as sentences have them.
std::string dims_text(const std::array<std::int64_t, 3>& dims) {
  return std::to_string(dims[0]) + " x " + std::to_string(dims[1]) + " x " + std::to_string(dims[2]);
}

/// The samples as floats, in the order of the file, x fastest.
std::vector<float> read_values(ByteSource& source, const StoredSamples& stored, const ImportOptions& options,
                               RunContext& context) {
  source.skip(stored.offset - source.position(), context);
  const std::size_t size = size_of(stored.format.type);
  const std::size_t count = static_cast<std::size_t>(stored.dims[0] * stored.dims[1] * stored.dims[2]);
  // A million samples at a time: bytes of the file and floats need not be there in full side by side.
  constexpr std::size_t kPart = std::size_t{1} << 20;
  std::vector<unsigned char> bytes(std::min(count, kPart) * size);
  // It grows with what is read: a gzipped file that claims too much ends before memory does.
  std::vector<float> values;
  DecodeCounts counts;
  while (values.size() < count) {
    const std::size_t first = values.size(), part = std::min(kPart, count - first);
    const auto packed = std::span(bytes).first(part * size);
    source.read(packed, context);
    values.resize(first + part);
    const DecodeCounts now = decode_samples(packed, stored.format, stored.slope, stored.intercept,
                                            std::span(values).subspan(first));
    counts.not_finite += now.not_finite, counts.rounded += now.rounded;
    context.progress("read volume", static_cast<double>(values.size()) / static_cast<double>(count));
  }
  // All are counted before one complains: how many there are decides what to do about them.
  if (counts.not_finite > 0 && !options.replacement)
    throw Error(
        stored.file + " holds " + std::to_string(counts.not_finite) +
        " samples that are NaN, infinite or too large for single precision; say what takes their place with "
        "--replace-nan VALUE");
  if (counts.not_finite > 0) {
    for (float& value : values)
      if (!std::isfinite(value)) value = *options.replacement;
    context.note(std::to_string(counts.not_finite) + " samples of " + stored.file +
                 " that are no finite number were replaced");
  }
  if (counts.rounded > 0)
    context.note(std::to_string(counts.rounded) + " samples of " + stored.file +
                 " were rounded to single precision");
  return values;
}

/// The next lower single precision; near 0 the next normal one, which survives where denormal numbers are
/// flushed to 0.
float just_below(float value) {
  const float next = std::nextafter(value, -std::numeric_limits<float>::infinity());
  return std::fabs(next) < std::numeric_limits<float>::min() ? -std::numeric_limits<float>::min() : next;
}

/// One leaf of the samples; those beyond the box are background and inactive.
Leaf* make_leaf(const std::vector<float>& values, const std::array<std::int64_t, 3>& dims,
                const openvdb::Coord& lower, float background) {
  Leaf* leaf = new Leaf(lower, background, false);
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y)
      for (int z = 0; z < 8; ++z) {
        const std::int64_t i = lower.x() + x, j = lower.y() + y, k = lower.z() + z;
        if (i >= dims[0] || j >= dims[1] || k >= dims[2]) continue;
        // In a leaf z runs fastest, in the file x.
        const auto offset = static_cast<openvdb::Index>(64 * x + 8 * y + z);
        leaf->setValueOn(offset, values[static_cast<std::size_t>(i + dims[0] * (j + dims[1] * k))]);
      }
  return leaf;
}

openvdb::FloatGrid::Ptr make_grid(const std::vector<float>& values, const StoredSamples& stored,
                                  float background, RunContext& context) {
  std::array<std::size_t, 3> blocks;
  for (int axis = 0; axis < 3; ++axis) blocks[axis] = static_cast<std::size_t>((stored.dims[axis] + 7) / 8);
  // Leaves are filled in parallel, each by one thread; they enter the tree one after the other, which no two
  // threads may change at once.
  std::vector<std::unique_ptr<Leaf>> leaves(blocks[0] * blocks[1] * blocks[2]);
  parallel_blocks(leaves.size(), context, [&](std::size_t i) {
    const openvdb::Coord lower(static_cast<int>(8 * (i / (blocks[1] * blocks[2]))),
                               static_cast<int>(8 * (i / blocks[2] % blocks[1])),
                               static_cast<int>(8 * (i % blocks[2])));
    leaves[i].reset(make_leaf(values, stored.dims, lower, background));
  });
  auto grid = openvdb::FloatGrid::create(background);
  // The tree owns the leaves from here on.
  for (auto& leaf : leaves) grid->tree().addLeaf(leaf.release());
  openvdb::tools::prune(grid->tree());  // exactly constant regions only
  return grid;
}

}  // namespace

std::uint64_t check_stored(const StoredSamples& stored, std::uint64_t at_most) {
  constexpr std::int64_t kMost = std::int64_t{1}
                                 << 30;  // of an axis: what index coordinates are sure to hold
  const std::string claim = dims_text(stored.dims) + " samples of " + name_of(stored.format);
  for (const std::int64_t dim : stored.dims)
    if (dim < 1 || dim > kMost)
      throw Error(stored.file + " cannot hold " + claim + ": each dimension must be from 1 to 2^30");
  // Products of numbers up to 2^30 overflow; a double is exact enough to refuse them.
  const double bytes = double(stored.dims[0]) * double(stored.dims[1]) * double(stored.dims[2]) *
                       double(size_of(stored.format.type));
  if (bytes + double(stored.offset) > double(at_most))
    throw Error(stored.file + " is too short for " + claim + " behind " + std::to_string(stored.offset) +
                " bytes; it is truncated, or the dimensions are wrong");
  // At its peak there are the floats, the leaves, and what a growing vector keeps of its old room.
  const double needed =
      bytes / double(size_of(stored.format.type)) * 3.0 * sizeof(float);  // samples, leaves, growth
  if (const auto available = available_memory(); available && needed > double(*available)) {
    char text[120];
    std::snprintf(text, sizeof text,
                  " would need about %.3g GiB, and %.3g GiB are available; crop or resample it first",
                  needed / 0x1p30, double(*available) / 0x1p30);
    throw Error(stored.file + text);
  }
  return static_cast<std::uint64_t>(bytes);
}

LevelSet read_stored(ByteSource& source, const StoredSamples& stored, const ImportOptions& options,
                     RunContext& context) {
  const Stage stage(context, "read volume");
  initialize_openvdb();
  const std::vector<float> values = read_values(source, stored, options, context);
  // All samples are finite by now, so they have a least and a greatest.
  const auto [lowest, highest] = std::ranges::minmax_element(values);
  // Below every sample, so that what lies beyond the box is outside at any isovalue.
  const float background = just_below(*lowest);
  if (!std::isfinite(background))
    throw Error(stored.file + " holds the least of all numbers; rescale its samples");
  const openvdb::FloatGrid::Ptr grid = make_grid(values, stored, background, context);
  // OpenVDB multiplies rows from the left: the transpose of what multiplies columns.
  openvdb::math::Mat4d matrix;  // of rows
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column) matrix(row, column) = stored.to_world(column, row);
  try {
    grid->setTransform(openvdb::math::Transform::createLinearTransform(matrix));
  } catch (const openvdb::Exception&) {  // it looks at the determinant, whatever the unit of length
    throw Error(stored.file +
                " has voxels that are too small or too flat for OpenVDB; scale its transform up");
  }
  grid->setName("volume");
  grid->setGridClass(openvdb::GRID_UNKNOWN);
  grid->insertMeta("hermesh_source",
                   openvdb::StringMetadata(std::filesystem::path(stored.file).filename().string()));
  grid->insertMeta("hermesh_sample_type", openvdb::StringMetadata(name_of(stored.format)));
  grid->insertMeta("hermesh_minimum", openvdb::FloatMetadata(*lowest));
  grid->insertMeta("hermesh_maximum", openvdb::FloatMetadata(*highest));
  return make_level_set(grid);
}

void write_imported(const std::filesystem::path& path, const LevelSet& volume, RunContext& context) {
  const Stage stage(context, "write volume");
  write_grids(path, {volume.grid().grid});
}

}  // namespace hermesh
