#include "algorithms/voxelization/outputs/volume_outputs.h"

#include <openvdb/tools/ChangeBackground.h>
#include <openvdb/tools/Prune.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <sstream>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/core/parallel.h"
#include "algorithms/hermite/hermite_file.h"
#include "algorithms/hermite/samplers.h"
#include "algorithms/io/atomic_file.h"
#include "algorithms/io/vdb_archive.h"
#include "algorithms/lattice/memory_estimate.h"
#include "algorithms/lattice/sample_side.h"
#include "algorithms/voxelization/outputs/surface_transfer.h"

namespace hermesh {
namespace {

constexpr const char* kNames =
    "sdf, udf, closest-point, triangle-id, fog, hermite, attributes, attribute:NAME";

// ---- Volumes from the distances.

/// Replaces every value, those of tiles and inactive ones included; `active` says which are active then. The
/// leaves are for all threads, each leaf for one; the few tiles above them for the thread that calls.
template <class Map, class Active>
void map_values(openvdb::FloatTree& tree, const RunContext& context, Map map, Active active) {
  std::vector<openvdb::FloatTree::LeafNodeType*> leaves;
  tree.getNodes(leaves);
  parallel_blocks(leaves.size(), context, [&](std::size_t i) {
    for (openvdb::Index voxel = 0; voxel < openvdb::FloatTree::LeafNodeType::SIZE; ++voxel) {
      const float value = map(leaves[i]->getValue(voxel));
      const bool on = active(value, leaves[i]->isValueOn(voxel));
      leaves[i]->setValueOnly(voxel, value);
      leaves[i]->setActiveState(voxel, on);
    }
  });
  auto tile = tree.beginValueAll();
  // The iterator must stop above the leaves, whose values are new already.
  tile.setMaxDepth(openvdb::FloatTree::ValueAllIter::LEAF_DEPTH - 1);
  for (; tile; ++tile) {
    const float value = map(*tile);
    const bool on = active(value, tile.isValueOn());
    tile.setValue(value);
    tile.setActiveState(on);
  }
}

/// Distances without sign, of a band that has signs. The background is positive already.
openvdb::FloatGrid::Ptr make_udf(const openvdb::FloatGrid& sdf, RunContext& context) {
  const Stage stage(context, "udf");
  const openvdb::FloatGrid::Ptr grid = sdf.deepCopy();
  map_values(
      grid->tree(), context, [](float distance) { return std::abs(distance); },
      // What is near the surface is on both sides, so the same voxels stay active.
      [](float, bool on) { return on; });
  grid->setName("udf");
  grid->setGridClass(openvdb::GRID_UNKNOWN);  // programs take a level set to have signs
  return grid;
}

/// Fog (§5.6): 1 inside, and a linear ramp from 1 at the inner end of the band to 0 at the surface, or at the
/// outer end of the band.
openvdb::FloatGrid::Ptr make_fog(const openvdb::FloatGrid& sdf, const VoxelizeOptions& options, bool exterior,
                                 RunContext& context) {
  const Stage stage(context, "fog");
  const float inner = float(options.interior_band * options.voxel_size);
  const float outer = exterior ? float(options.exterior_band * options.voxel_size) : 0.0f;
  const float on_surface = float(kLeastDepth * options.voxel_size);
  const openvdb::FloatGrid::Ptr grid = sdf.deepCopy();
  map_values(
      grid->tree(), context,
      [=](float distance) {
        // Exactly 1 beyond the band, where division might leave a little less.
        if (distance <= -inner) return 1.0f;
        if (distance < 0.0f && distance >= -on_surface)
          distance = 0.0f;  // a sample on the surface, which is no depth
        return std::clamp((outer - distance) / (outer + inner), 0.0f, 1.0f);
      },
      [](float density, bool) { return density > 0.0f; });
  // The background was the exterior width, and inactive tiles of it are 0 by now; pruning makes tiles of
  // leaves that are all 1 or all 0.
  openvdb::tools::changeBackground(grid->tree(), 0.0f);
  openvdb::tools::prune(grid->tree());
  grid->setName("fog");
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  return grid;
}

/// The nearest triangles by the numbers that the user knows them by. A copy, for the other grids are made
/// from triangulated()'s.
openvdb::Int32Grid::Ptr make_triangle_id(const openvdb::Int32Grid::Ptr& nearest,
                                         const std::vector<std::uint32_t>& numbers, RunContext& context) {
  if (numbers.empty()) return nearest;
  const openvdb::Int32Grid::Ptr grid = nearest->deepCopy();
  std::vector<openvdb::Int32Tree::LeafNodeType*> leaves;
  grid->tree().getNodes(leaves);
  parallel_blocks(leaves.size(), context, [&](std::size_t i) {
    for (auto value = leaves[i]->beginValueOn(); value; ++value)
      if (*value >= 0) value.setValue(std::int32_t(numbers[std::size_t(*value)]));
  });
  return grid;
}

/// Exact hits of the polygons on the grid's edges whose ends differ in sign.
FloatHermite make_hermite(const openvdb::FloatGrid::Ptr& sdf, const PolygonMesh& mesh, RunContext& context) {
  return sample_polygons(make_level_set(sdf), 0.0, mesh, context);
}

// ---- What is asked for.

/// The attributes asked for, in the order of the mesh, each once however often it is named.
std::vector<const MeshAttribute*> chosen_attributes(const PolygonMesh& mesh, const VolumeRequest& request) {
  std::vector<const MeshAttribute*> chosen;
  std::string names;
  for (const MeshAttribute& attribute : mesh.attributes) {
    names += (names.empty() ? "" : ", ") + attribute.name;
    if (request.all_attributes || std::ranges::count(request.attributes, attribute.name) > 0)
      chosen.push_back(&attribute);
  }
  for (const std::string& name : request.attributes)
    if (std::ranges::find(mesh.attributes, name, &MeshAttribute::name) == mesh.attributes.end())
      throw Error("the mesh has no attribute '" + name + "'; it has " + (names.empty() ? "none" : names));
  if (request.all_attributes && chosen.empty()) throw Error("the mesh has no attributes");
  return chosen;
}

/// Refuses what is made of an inside if there is none. It is asked twice: before the work, and once it is
/// known.
void check_signs(const VolumeRequest& request, bool is_signed) {
  if (is_signed) return;
  for (const auto& [asked, name] : {std::pair(request.fog, "fog"), std::pair(request.hermite, "hermite")})
    if (asked)
      throw Error("the grid " + std::string(name) +
                  " needs an inside, but the distances have no sign; leave it out");
}

/// Bytes beyond those that the distances alone take: leaves of 512 values for each grid, and for the
/// triangles that some are made from.
double bytes_of_outputs(const VolumeRequest& request, const std::vector<const MeshAttribute*>& attributes,
                        double leaves) {
  std::size_t bytes = (request.udf ? 4 : 0) + (request.fog ? 4 : 0) +
                      (request.hermite ? sizeof(FloatVoxel) : 0) +
                      (request.closest_point ? sizeof(openvdb::Vec3s) : 0);
  for (const MeshAttribute* attribute : attributes) bytes += bytes_per_voxel(*attribute);
  if (request.triangle_id || request.closest_point || !attributes.empty()) bytes += 4;
  return 512.0 * leaves * double(bytes);
}

/// Refuses grids that together need more memory than there is, before the work begins. Unknown memory is
/// enough.
void check_fits(const PolygonMesh& mesh, const VoxelizeOptions& options, const VolumeRequest& request,
                const std::vector<const MeshAttribute*>& attributes) {
  check_voxelization_fits(mesh, options.voxel_size, options.exterior_band, options.interior_band);
  const BandEstimate estimate =
      estimate_band(mesh, options.voxel_size, options.exterior_band, options.interior_band);
  const double needed = estimate.peak_bytes + bytes_of_outputs(request, attributes, estimate.leaves);
  const std::optional<std::uint64_t> available = available_memory();
  if (!available || needed <= double(*available)) return;
  constexpr double kGiB = 1024.0 * 1024.0 * 1024.0;
  char text[200];
  std::snprintf(
      text, sizeof text,
      "These grids would need about %.3g GiB, and %.3g GiB are available: ask for fewer grids, larger "
      "voxels or narrower bands.",
      needed / kGiB, double(*available) / kGiB);
  throw Error(text);
}

}  // namespace

bool VolumeRequest::only_sdf() const {
  return sdf && !udf && !triangle_id && !closest_point && !fog && !hermite && !any_attributes();
}

VolumeRequest parse_volume_request(const std::string& list) {
  VolumeRequest request;
  std::istringstream names(list);
  const std::string attribute = "attribute:";
  for (std::string name; std::getline(names, name, ',');) {
    if (name == "sdf")
      request.sdf = true;
    else if (name == "udf")
      request.udf = true;
    else if (name == "triangle-id")
      request.triangle_id = true;
    else if (name == "closest-point")
      request.closest_point = true;
    else if (name == "fog")
      request.fog = true;
    else if (name == "hermite")
      request.hermite = request.sdf = true;
    else if (name == "attributes")
      request.all_attributes = true;
    else if (name.starts_with(attribute))
      request.attributes.push_back(name.substr(attribute.size()));
    else
      throw Error("there is no grid '" + name + "'; choose of " + kNames);
  }
  // getline() takes a comma at the end for the end of the list, and says nothing of the name that is missing.
  if (list.empty() || list.back() == ',')
    throw Error("a name is missing in the list of grids; choose of " + std::string(kNames));
  return request;
}

VolumeOutputs make_volume_outputs(const PolygonMesh& mesh, const VoxelizeOptions& options,
                                  const VolumeRequest& request, RunContext& context) {
  return make_volume_outputs(
      mesh, options, request, [&](const VoxelizeOptions& asked) { return voxelize(mesh, asked, context); },
      context);
}

VolumeOutputs make_volume_outputs(const PolygonMesh& mesh, const VoxelizeOptions& options,
                                  const VolumeRequest& request, const VoxelizeBy& by, RunContext& context) {
  const std::vector<const MeshAttribute*> attributes = chosen_attributes(mesh, request);
  check_signs(request, options.signs != SignRule::none);
  // For the distances alone voxelize() does the same.
  if (!request.only_sdf()) check_fits(mesh, options, request, attributes);

  // The triangles cost a number a voxel, so they are kept only where something is made from them.
  VoxelizeOptions with_nearest = options;
  with_nearest.nearest = request.triangle_id || request.closest_point || !attributes.empty();
  const Voxelization made = by(with_nearest);
  check_signs(request, made.is_signed);

  VolumeOutputs outputs;
  outputs.active_voxels = made.distance->activeVoxelCount();
  // Without signs the distances themselves are "udf", and there is no other grid to make of them.
  if (request.sdf || (request.udf && !made.is_signed)) outputs.grids.push_back(made.distance);
  if (request.udf && made.is_signed) outputs.grids.push_back(make_udf(*made.distance, context));
  if (request.triangle_id)
    outputs.grids.push_back(make_triangle_id(made.nearest, request.triangle_numbers, context));
  if (request.closest_point || !attributes.empty())
    for (const auto& grid : transfer_from_surface(mesh, *made.nearest, options.voxel_size,
                                                  {request.closest_point, attributes}, context))
      outputs.grids.push_back(grid);
  if (request.fog) outputs.grids.push_back(make_fog(*made.distance, options, request.fog_exterior, context));
  if (request.hermite) outputs.hermite = make_hermite(made.distance, mesh, context);
  return outputs;
}

std::filesystem::path hermite_path(const std::filesystem::path& path) {
  // The extension stays last, so that the file is still known for a .vdb.
  std::filesystem::path beside = path;
  return beside.replace_extension(".hermite" + path.extension().string());
}

void write_volume_outputs(const std::filesystem::path& path, const VolumeOutputs& outputs,
                          RunContext& context) {
  const Stage stage(context, "write volumes");
  AtomicFile volumes(path);
  write_sealed(volumes.path(), openvdb::GridCPtrVec(outputs.grids.begin(), outputs.grids.end()), path);
  if (!outputs.hermite) {
    volumes.commit();
    return;
  }
  // Both are complete before either gets its name.
  AtomicFile hermite(hermite_path(path));
  write_hermite(hermite.path(), *outputs.hermite, context);
  commit_together(hermite, volumes);
}

}  // namespace hermesh
