#include "algorithms/extraction/volume_attributes.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <atomic>
#include <cmath>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/core/parallel.h"
#include "algorithms/io/vdb_archive.h"

namespace hermesh {
namespace {

using openvdb::Coord;

/// The eight samples around a position, with trilinear weights.
struct WeightedCorner {
  Coord at;
  double weight;
};
std::array<WeightedCorner, 8> corners_around(const openvdb::Vec3d& index) {
  const Coord low = Coord::floor(index);
  const openvdb::Vec3d share = index - low.asVec3d();
  std::array<WeightedCorner, 8> corners;
  for (int i = 0; i < 8; ++i) {
    const int offset[3] = {i & 1, (i >> 1) & 1, i >> 2};
    double weight = 1.0;
    for (int axis = 0; axis < 3; ++axis) weight *= offset[axis] ? share[axis] : 1.0 - share[axis];
    corners[static_cast<std::size_t>(i)] = {low.offsetBy(offset[0], offset[1], offset[2]), weight};
  }
  return corners;
}

/// Returns the index coordinates of a vertex in a grid with its own transform.
openvdb::Vec3d index_of(const PolygonMesh& mesh, std::size_t point,
                        const openvdb::math::Transform& transform) {
  const Eigen::Vector3d world = mesh.world(point);
  return transform.worldToIndex(openvdb::Vec3d(world.x(), world.y(), world.z()));
}

double component_of(double value, int) { return value; }
template <class T>
double component_of(const openvdb::math::Vec3<T>& value, int component) {
  return double(value[component]);
}

void note_missing(std::size_t missing, const std::string& name, RunContext& context) {
  if (missing > 0)
    context.note(std::to_string(missing) + " points lie beyond the active voxels of the grid " + name);
}

/// Returns the world position to be added to the grid's values: zero unless the grid has closest points of
/// `hermesh voxelize`, relative to a position near the mesh, for which single precision is enough.
openvdb::Vec3d zero_of_positions(const openvdb::GridBase& grid) {
  const auto zero = grid.getMetadata<openvdb::Vec3DMetadata>(kZeroOfPositions);
  return zero ? zero->value() : openvdb::Vec3d(0.0);
}

/// Interpolates the first `components` components of the grid's values into those of the attribute from
/// `first`.
template <class Grid>
void interpolate(const Grid& grid, const PolygonMesh& mesh, MeshAttribute& attribute, int first,
                 int components, RunContext& context) {
  std::vector<float>& values = std::get<std::vector<float>>(attribute.values);
  std::atomic<std::size_t> missing{0};
  const openvdb::Vec3d zero = zero_of_positions(grid);
  parallel_blocks((mesh.points.size() + 1023) / 1024, context, [&](std::size_t block) {
    typename Grid::ConstAccessor access = grid.getConstAccessor();
    const std::size_t end = std::min(mesh.points.size(), 1024 * (block + 1));
    for (std::size_t point = 1024 * block; point < end; ++point) {
      double sums[3] = {}, weights = 0.0;
      for (const WeightedCorner& corner : corners_around(index_of(mesh, point, grid.transform()))) {
        typename Grid::ValueType value;
        // Inactive samples have no data; the division below normalises the weights of the others.
        if (corner.weight <= 0.0 || !access.probeValue(corner.at, value)) continue;
        weights += corner.weight;
        for (int i = 0; i < components; ++i) sums[i] += corner.weight * component_of(value, i);
      }
      if (weights <= 0.0) ++missing;
      for (int i = 0; i < components; ++i)
        values[point * std::size_t(attribute.components) + std::size_t(first + i)] =
            weights > 0.0 ? static_cast<float>(zero[i] + sums[i] / weights) : 0.0f;
    }
  });
  note_missing(missing, grid.getName(), context);
}

template <class Grid>
void take_nearest(const Grid& grid, const PolygonMesh& mesh, MeshAttribute& attribute, RunContext& context) {
  std::vector<std::int32_t>& values = std::get<std::vector<std::int32_t>>(attribute.values);
  std::atomic<std::size_t> missing{0};
  parallel_blocks((mesh.points.size() + 1023) / 1024, context, [&](std::size_t block) {
    typename Grid::ConstAccessor access = grid.getConstAccessor();
    const std::size_t end = std::min(mesh.points.size(), 1024 * (block + 1));
    for (std::size_t point = 1024 * block; point < end; ++point) {
      double largest = -1.0;
      values[point] = -1;
      for (const WeightedCorner& corner : corners_around(index_of(mesh, point, grid.transform()))) {
        typename Grid::ValueType value;
        // Of equal weights the first corner wins.
        if (corner.weight <= largest || !access.probeValue(corner.at, value)) continue;
        largest = corner.weight;
        values[point] = static_cast<std::int32_t>(value);
      }
      if (largest < 0.0) ++missing;
    }
  });
  note_missing(missing, grid.getName(), context);
}

/// Scales vectors of three to unit length; zeros, of vertices without data, remain.
void normalise(std::vector<float>& values) {
  for (std::size_t i = 0; i + 3 <= values.size(); i += 3) {
    const double length = std::hypot(double(values[i]), double(values[i + 1]), double(values[i + 2]));
    if (length > 0.0)
      for (std::size_t j = i; j < i + 3; ++j) values[j] = static_cast<float>(values[j] / length);
  }
}

/// Returns the labels of a grid's values, from 0 up to the first one that the metadata lack.
std::vector<std::string> labels_of(const openvdb::GridBase& grid) {
  std::vector<std::string> labels;
  for (int i = 0;; ++i) {
    const auto label = grid.getMetadata<openvdb::StringMetadata>("label_" + std::to_string(i));
    if (!label) return labels;
    labels.push_back(label->value());
  }
}

/// Calls f with the grid cast to its own type if that is one of `Grids`. Returns true if it is.
template <class... Grids, class F>
bool with_grid(const openvdb::GridBase::Ptr& grid, F&& f) {
  const auto attempt = [&]<class Grid>(const typename Grid::Ptr& typed) {
    return typed ? (f(*typed), true) : false;
  };
  return (attempt.template operator()<Grids>(openvdb::gridPtrCast<Grids>(grid)) || ...);
}

/// Returns the attribute of one grid, with `alpha` (or null) as the fourth component of vectors.
/// @throws Error for a type that cannot be sampled; Cancelled.
MeshAttribute sample_grid(const openvdb::GridBase::Ptr& grid, const openvdb::FloatGrid::Ptr& alpha,
                          const PolygonMesh& mesh, RunContext& context) {
  MeshAttribute attribute;
  attribute.name = grid->getName();
  const auto resize = [&](int components) {
    attribute.components = components;
    std::get<0>(attribute.values).resize(mesh.points.size() * std::size_t(components));
  };
  if (with_grid<openvdb::FloatGrid, openvdb::DoubleGrid>(grid, [&](const auto& typed) {
        resize(1);
        interpolate(typed, mesh, attribute, 0, 1, context);
      }))
    return attribute;
  if (with_grid<openvdb::Vec3SGrid, openvdb::Vec3DGrid>(grid, [&](const auto& typed) {
        const int own = attribute.name == "uv" ? 2 : 3;
        resize(alpha ? 4 : own);
        interpolate(typed, mesh, attribute, 0, own, context);
      })) {
    if (alpha) interpolate(*alpha, mesh, attribute, 3, 1, context);
    if (attribute.components == 3 && (attribute.name == "normal" || attribute.name.ends_with("-normal")))
      normalise(std::get<0>(attribute.values));
    return attribute;
  }
  attribute.values = std::vector<std::int32_t>(mesh.points.size());
  attribute.labels = labels_of(*grid);
  if (with_grid<openvdb::Int32Grid, openvdb::Int64Grid, openvdb::BoolGrid>(
          grid, [&](const auto& typed) { take_nearest(typed, mesh, attribute, context); }))
    return attribute;
  throw Error("the grid '" + attribute.name + "' holds " + grid->valueType() +
              " values, which cannot be sampled at a mesh's points");
}

bool can_be_sampled(const openvdb::GridBase& grid) {
  return grid.isType<openvdb::FloatGrid>() || grid.isType<openvdb::DoubleGrid>() ||
         grid.isType<openvdb::Vec3SGrid>() || grid.isType<openvdb::Vec3DGrid>() ||
         grid.isType<openvdb::Int32Grid>() || grid.isType<openvdb::Int64Grid>() ||
         grid.isType<openvdb::BoolGrid>();
}

/// Returns the names of the grids of "all". @throws Error if the file has none
std::vector<std::string> all_attributes(VdbReader& file, const std::filesystem::path& path) {
  std::vector<std::string> names;
  for (const std::string& name : file.names()) {
    if (name == "sdf" || name == "udf" || name == "fog") continue;
    // The alpha of another grid is that grid's fourth component.
    if (name.ends_with("-alpha") && file.has(name.substr(0, name.size() - 6))) continue;
    // Type and class are in the metadata, so no voxels of skipped grids are read.
    const openvdb::GridBase::Ptr grid = file.read_metadata(name);
    if (can_be_sampled(*grid) && grid->getGridClass() != openvdb::GRID_LEVEL_SET) names.push_back(name);
  }
  if (names.empty())
    throw Error(path.string() + " has no attributes; it has the grids " + file.joined_names());
  return names;
}

}  // namespace

std::vector<std::string> sample_attributes(PolygonMesh& mesh, const std::filesystem::path& vdb,
                                           const std::vector<std::string>& names, RunContext& context) {
  const Stage stage(context, "attributes");
  return about_vdb_file(vdb, [&] {
    VdbReader file(vdb);
    const std::vector<std::string> chosen =
        names == std::vector<std::string>{"all"} ? all_attributes(file, vdb) : names;
    // One grid at a time, so that the largest one bounds the memory.
    for (const std::string& name : chosen) {
      const std::string alpha_name = name + "-alpha";
      openvdb::FloatGrid::Ptr alpha;
      if (file.has(alpha_name)) alpha = openvdb::gridPtrCast<openvdb::FloatGrid>(file.read(alpha_name));
      mesh.attributes.push_back(sample_grid(file.read(name), alpha, mesh, context));
    }
    return chosen;
  });
}

}  // namespace hermesh
