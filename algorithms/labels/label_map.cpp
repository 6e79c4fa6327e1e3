#include "algorithms/labels/label_map.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/core/parallel.h"
#include "algorithms/io/vdb_archive.h"
#include "algorithms/lattice/grid_placement.h"

namespace hermesh {
namespace {

using LabelGrids = openvdb::TypeList<openvdb::Int32Grid, openvdb::Int64Grid, openvdb::FloatGrid,
                                     openvdb::DoubleGrid, openvdb::BoolGrid>;

bool may_hold_labels(const openvdb::GridBase& grid) {
  return grid.apply<LabelGrids>([](const auto&) {});
}

/// Returns the name of the grid to read if the user named none.
std::string label_grid_name(VdbReader& file, const std::filesystem::path& path) {
  if (file.has("labels")) return "labels";
  std::vector<std::string> found;
  for (const std::string& name : file.names())
    if (may_hold_labels(*file.read_metadata(name))) found.push_back(name);
  if (found.size() == 1) return found[0];
  if (found.empty())
    throw Error(path.string() + " holds no grid of integers or real numbers (" + file.joined_names() + ")");
  throw Error(path.string() + " holds several grids (" + file.joined_names() + "); choose one with --grid");
}

/// Returns the value as a label. @throws Error if it is none
template <class Value>
std::uint32_t label_of(Value value, const openvdb::Coord& at, const std::string& what) {
  const double number = static_cast<double>(value);
  if (number >= 0.0 && number <= double(kGreatestLabel) && number == std::floor(number))
    return static_cast<std::uint32_t>(number);
  std::ostringstream message;
  message << what << " holds the value " << number << " at index " << at
          << ", which is not a label (a whole number from 0 to 2147483647)";
  throw Error(message.str());
}

/// The blocks of a tree that hold a label, in any order.
struct LabelBlocks {
  std::vector<std::array<std::int32_t, 3>> lowers;
  std::vector<LabelField::Values> values;

  void add(const openvdb::Coord& lower, const LabelField::Values& block) {
    if (std::ranges::all_of(block, [](std::uint32_t label) { return label == 0; })) return;
    lowers.push_back({lower.x(), lower.y(), lower.z()});
    values.push_back(block);
  }
};

template <class Grid>
LabelBlocks blocks_of(const Grid& grid, const std::string& what, const RunContext& context) {
  LabelBlocks blocks;
  for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf) {
    context.check();
    LabelField::Values values{};
    for (auto on = leaf->cbeginValueOn(); on; ++on) values[on.pos()] = label_of(*on, on.getCoord(), what);
    blocks.add(leaf->origin(), values);
  }
  auto tile = grid.tree().cbeginValueOn();
  tile.setMaxDepth(Grid::TreeType::ValueOnCIter::LEAF_DEPTH - 1);
  for (; tile; ++tile) {
    const std::uint32_t label = label_of(*tile, tile.getCoord(), what);
    if (label == 0) continue;
    LabelField::Values values;
    values.fill(label);
    const openvdb::CoordBBox box = tile.getBoundingBox();
    for (int x = box.min().x(); x < box.max().x(); x += 8)
      for (int y = box.min().y(); y < box.max().y(); y += 8)
        for (int z = box.min().z(); z < box.max().z(); z += 8) {
          context.check();
          blocks.add({x, y, z}, values);
        }
  }
  return blocks;
}

/// Returns the map with the blocks in ascending order.
LabelMap map_of(const LabelBlocks& blocks, const IndexToWorld& placement) {
  std::vector<std::size_t> order(blocks.lowers.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::ranges::sort(order, {}, [&](std::size_t i) { return blocks.lowers[i]; });
  LabelMap map{.placement = placement, .lowers = {}, .values = LabelField(order.size())};
  for (std::size_t i = 0; i < order.size(); ++i) {
    map.lowers.push_back(blocks.lowers[order[i]]);
    map.values.assign(static_cast<std::int32_t>(i), blocks.values[order[i]]);
  }
  return map;
}

/// Returns the placement of a grid with this transform whose labels are in these blocks.
IndexToWorld placement_of_labels(const openvdb::math::Transform& transform, const LabelBlocks& blocks) {
  const auto outline = openvdb::FloatGrid::create();
  outline->setTransform(transform.copy());
  openvdb::CoordBBox box;
  for (const auto& lower : blocks.lowers) {
    const openvdb::Coord first(lower[0], lower[1], lower[2]);
    box.expand(openvdb::CoordBBox(first, first.offsetBy(7)));
  }
  if (!box.empty())
    for (const openvdb::Coord& corner : {box.min(), box.max()}) outline->tree().setValueOn(corner);
  return placement_of(*outline);
}

}  // namespace

std::map<std::uint32_t, std::uint64_t> LabelMap::samples() const {
  std::map<std::uint32_t, std::uint64_t> result;
  for (std::size_t b = 0; b < lowers.size(); ++b) {
    const auto block = static_cast<std::int32_t>(b);
    if (values.is_uniform(block)) {
      result[values(block, 0)] += 512;
      continue;
    }
    std::uint32_t last = values(block, 0);
    std::uint64_t* count = &result[last];
    for (int i = 0; i < 512; ++i) {
      const std::uint32_t label = values(block, i);
      if (label != last) last = label, count = &result[label];
      ++*count;
    }
  }
  result.erase(0);
  return result;
}

LabelMap label_map(std::span<const std::uint32_t> values, const std::array<int, 3>& dims,
                   const IndexToWorld& placement, RunContext& context) {
  if (values.size() != std::size_t(dims[0]) * std::size_t(dims[1]) * std::size_t(dims[2]))
    throw Error("a label map needs a label for each sample");
  if (std::ranges::any_of(values, [](std::uint32_t label) { return label > kGreatestLabel; }))
    throw Error("a label must be at most 2147483647");
  LabelBlocks blocks;
  for (int x = 0; x < dims[0]; x += 8)
    for (int y = 0; y < dims[1]; y += 8)
      for (int z = 0; z < dims[2]; z += 8) {
        context.check();
        LabelField::Values block{};
        for (int i = 0; i < 512; ++i) {
          const int at[3] = {x + (i >> 6), y + ((i >> 3) & 7), z + (i & 7)};
          if (at[0] < dims[0] && at[1] < dims[1] && at[2] < dims[2])
            block[std::size_t(i)] =
                values[std::size_t(at[0]) +
                       std::size_t(dims[0]) *
                           (std::size_t(at[1]) + std::size_t(dims[1]) * std::size_t(at[2]))];
        }
        blocks.add({x, y, z}, block);
      }
  return map_of(blocks, placement);
}

bool is_label_map(const LevelSet& volume) { return volume.grid().grid->getName() == "labels"; }

LabelMap read_label_map(const std::filesystem::path& path, const std::string& grid_name,
                        RunContext& context) {
  const Stage stage(context, "read labels");
  initialize_openvdb();
  return about_vdb_file(path, [&] {
    VdbReader file(path);
    const std::string name = grid_name.empty() ? label_grid_name(file, path) : grid_name;
    const std::string what = "the grid '" + shown(name) + "' of " + path.string();
    if (!may_hold_labels(*file.read_metadata(name)))
      throw Error(what + " holds " + file.read_metadata(name)->valueType() + " values, which are not labels");
    const openvdb::GridBase::Ptr grid = file.read(name);
    LabelBlocks blocks;
    grid->apply<LabelGrids>([&](const auto& typed) { blocks = blocks_of(typed, what, context); });
    if (blocks.lowers.empty()) throw Error(what + " holds no label: all of its voxels are background");
    return map_of(blocks, placement_of_labels(grid->transform(), blocks));
  });
}

}  // namespace hermesh
