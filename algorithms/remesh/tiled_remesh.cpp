#include "algorithms/remesh/tiled_remesh.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>

#include "algorithms/core/run_context.h"
#include "algorithms/extraction/certified_collapse/manifold_dual_contouring.h"
#include "algorithms/io/written_precision.h"
#include "algorithms/voxelization/closed_polygons.h"

namespace hermesh {
namespace {

/// A hash of bytes (FNV-1a) that distinguishes tasks.
class TaskHash {
 public:
  template <class T>
  void add(const T& value) {
    static_assert(std::has_unique_object_representations_v<T> || std::is_floating_point_v<T>);
    add(&value, sizeof value);
  }
  void add(const void* data, std::size_t size) {
    const auto* bytes = static_cast<const unsigned char*>(data);
    for (std::size_t i = 0; i < size; ++i) value_ = (value_ ^ bytes[i]) * 0x100000001b3u;
  }
  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 0xcbf29ce484222325u;
};

std::uint64_t task_of(const PolygonMesh& mesh, double voxel_size,
                      const ManifoldDualContouringOptions& options, bool written_in_single) {
  TaskHash hash;
  for (int a = 0; a < 3; ++a) hash.add(mesh.origin[a]);
  for (const Eigen::Vector3f& p : mesh.points) hash.add(p.data(), 3 * sizeof(float));
  for (const Triangle& t : mesh.triangles) hash.add(t);
  for (const Quad& q : mesh.quads) hash.add(q);
  hash.add(voxel_size);
  hash.add(options.tile);
  hash.add(options.tolerance);
  hash.add(options.nearness.moment);
  hash.add(options.nearness.relaxation);
  hash.add(static_cast<int>(options.uniform.placement));
  hash.add(options.uniform.truncation);
  hash.add(options.uniform.reach);
  hash.add(static_cast<int>(written_in_single));
  return hash.value();
}

/// Returns the tiles that may have a cell of the surface, ascending.
std::vector<TileAt> tiles_at(const PolygonMesh& mesh, double voxel_size, int side) {
  constexpr double kNear = 2.0;  // voxels; both samples of an edge that a triangle crosses, and its cells
  std::set<TileAt> tiles;
  for (const Triangle& t : triangulated(mesh)) {
    Bounds box;
    for (const std::uint32_t p : t) box.add(mesh.points[p].cast<double>() / voxel_size);
    TileAt first, last;
    for (int a = 0; a < 3; ++a) {
      first[a] = static_cast<std::int32_t>(std::floor((box.lower[a] - kNear) / side));
      last[a] = static_cast<std::int32_t>(std::floor((box.upper[a] + kNear) / side));
    }
    for (TileAt tile = first; tile[0] <= last[0]; ++tile[0])
      for (tile[1] = first[1]; tile[1] <= last[1]; ++tile[1])
        for (tile[2] = first[2]; tile[2] <= last[2]; ++tile[2]) tiles.insert(tile);
  }
  return {tiles.begin(), tiles.end()};
}

ManifoldDualContouringOptions tile_options(const PolygonMesh& mesh, const ExtractRecipe& recipe,
                                           const IndexToWorld& placement, RunContext& context) {
  const auto check = [](bool holds, const std::string& what) {
    if (!holds) throw Error("tiles need " + what);
  };
  check(recipe.chosen.extractor.name == "manifold-dual-contouring",
        "the extractor manifold-dual-contouring, not " + recipe.chosen.extractor.name);
  const Options& options = recipe.chosen.options;
  check(recipe.isovalue == 0.0 && !recipe.field && !recipe.hermite,
        "isovalue 0 and no mask or tolerance grid");
  check(!options.is("hermite", "level-set"), "Hermite data of the polygons, not -o hermite=level-set");
  check(options.is("representation", "sparse-float"), "-o representation=sparse-float");
  const LevelSet none;
  ManifoldDualContouringOptions read = read_manifold_dual_contouring_options(
      {.level_set = none, .source = &mesh, .options = options, .context = context}, placement);
  check(read.tile > 0, "a side, -o tile=512");
  return read;
}

/// Replaces the times of stages since `first` by a sum for each name.
void add_up_stages(std::vector<std::pair<std::string, double>>& stages, std::size_t first) {
  std::map<std::string, double> sums;
  for (std::size_t i = first; i < stages.size(); ++i) sums[stages[i].first] += stages[i].second;
  stages.resize(first);
  stages.insert(stages.end(), sums.begin(), sums.end());
}

}  // namespace

TilePart remesh_tiles(const PolygonMesh& mesh, const VoxelizeRecipe& voxelizing,
                      const ExtractRecipe& extracting, const TileJob& job, RunContext& context) {
  if (voxelizing.chosen.voxelizer.name != "hermesh" ||
      !voxelizing.chosen.options.is("signs", "winding-number"))
    throw Error("tiles need the voxelizer hermesh with signs=winding-number");
  if (voxelizing.thin != ThinRule::drop) throw Error("tiles need thin parts to be dropped");
  const double voxel_size = voxel_size_of(voxelizing, mesh);
  const ClosedPolygons polygons(mesh, voxel_size);
  if (!extracting.out.empty()) check_written_precision(extracting.out, polygons.outline());
  IndexToWorld placement = polygons.placement();
  TilePart part{.task = 0,
                .job = job,
                .origin = {},
                .written_in_single = extracting.written_in_single || is_written_in_single(extracting.out),
                .tiles = {}};
  if (part.written_in_single) placement.offset += placement.origin, placement.origin.setZero();
  part.origin = placement.origin;
  const ManifoldDualContouringOptions options = tile_options(mesh, extracting, placement, context);
  part.task = task_of(mesh, voxel_size, options, part.written_in_single);
  const FilePoints file(placement, options.uniform.caps);
  const std::vector<TileAt> tiles = tiles_at(mesh, voxel_size, options.tile);
  const OneProgress progress(context, "tiles");
  const std::size_t first_stage = context.stage_seconds.size();
  for (std::size_t i = std::size_t(job.number) - 1; i < tiles.size(); i += std::size_t(job.count)) {
    progress.update(double(i) / double(tiles.size()));
    SampleBox box;
    for (int a = 0; a < 3; ++a) {
      box.lower[a] = tiles[i][a] * options.tile - kTileHalo;
      box.upper[a] = (tiles[i][a] + 1) * options.tile + kTileHalo + 8;  // one block has no upper neighbours
    }
    FloatHermite hermite = polygons.hermite(box, context);
    if (hermite.leaves.empty()) continue;
    hermite.placement = placement;
    const auto view = view_of(hermite, context);
    std::vector<VertexKey> keys;
    UniformMesh uniform = uniform_mesh(view, options.uniform, file, context,
                                       {.side = options.tile,
                                        .whole = polygons.extent(),
                                        .known = {box.lower, box.upper - Eigen::Vector3i::Constant(8)},
                                        .keys = &keys});
    TilePatches patches(std::move(uniform), std::move(keys),
                        {.side = options.tile, .tolerance = options.tolerance, .nearness = options.nearness},
                        file, tiles[i]);
    if (!patches.tiles().empty()) part.tiles.push_back(patches.decimated(tiles[i], context));
    add_up_stages(context.stage_seconds, first_stage);
  }
  return part;
}

PolygonMesh join_parts(std::vector<TilePart> parts) {
  std::ranges::sort(parts, {}, [](const TilePart& part) { return part.job.number; });
  std::vector<TileMesh> tiles;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    TilePart& part = parts[i];
    if (part.task != parts[0].task || part.job.count != parts[0].job.count)
      throw Error("the parts are of different polygons, options or numbers of jobs; make all of them again");
    if (part.job.number != int(i) + 1)
      throw Error("of " + std::to_string(part.job.count) + " parts number " +
                  std::to_string(part.job.number <= int(i) ? part.job.number : int(i) + 1) +
                  (part.job.number <= int(i) ? " occurs twice" : " is missing"));
    std::ranges::move(part.tiles, std::back_inserter(tiles));
  }
  if (parts.empty() || int(parts.size()) < parts[0].job.count)
    throw Error("of " + std::to_string(parts.empty() ? 1 : parts[0].job.count) + " parts number " +
                std::to_string(parts.size() + 1) + " is missing");
  if (tiles.empty()) throw Error("the solid contains no sample, so there is no mesh; use smaller voxels");
  return join_tiles(std::move(tiles), parts[0].origin);
}

}  // namespace hermesh
