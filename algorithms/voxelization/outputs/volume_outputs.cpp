#include "algorithms/voxelization/outputs/volume_outputs.h"

#include <openvdb/tools/ChangeBackground.h>
#include <openvdb/tools/Prune.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <sstream>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/core/parallel.h"
#include "algorithms/hermite/samplers.h"
#include "algorithms/io/atomic_file.h"
#include "algorithms/io/vdb_archive.h"
#include "algorithms/lattice/memory_estimate.h"
#include "algorithms/lattice/sample_side.h"
#include "algorithms/search/triangle_point.h"
#include "algorithms/thesis/voxels/hermite_file.h"
#include "algorithms/voxelization/distance/index_soup.h"

namespace hermesh {
namespace {

constexpr const char* kNames =
    "sdf, udf, closest-point, triangle-id, fog, hermite, attributes, attribute:NAME";

// ---- Volumes from the distances.

/// Replaces every value, including those of tiles and inactive ones; active(value, was_active) decides which
/// are active then. Leaves are processed in parallel, the few tiles above them by the calling thread.
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

/// Returns distances without sign, of a band with signs. The background is positive already.
openvdb::FloatGrid::Ptr make_udf(const openvdb::FloatGrid& sdf, RunContext& context) {
  const Stage stage(context, "udf");
  const openvdb::FloatGrid::Ptr grid = sdf.deepCopy();
  map_values(
      grid->tree(), context, [](float distance) { return std::abs(distance); },
      [](float, bool on) { return on; });
  grid->setName("udf");
  grid->setGridClass(openvdb::GRID_UNKNOWN);  // programs take a level set to have signs
  return grid;
}

/// Returns fog (§5.6): 1 inside, and a linear ramp from 1 at the inner end of the band to 0 at the surface,
/// or at the outer end of the band.
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
        // Exactly 1 beyond the band, where division might give a little less.
        if (distance <= -inner) return 1.0f;
        if (distance < 0.0f && distance >= -on_surface)
          distance = 0.0f;  // a sample on the surface, which has no depth
        return std::clamp((outer - distance) / (outer + inner), 0.0f, 1.0f);
      },
      [](float density, bool) { return density > 0.0f; });
  // Pruning makes tiles of leaves that are all 1 or all 0.
  openvdb::tools::changeBackground(grid->tree(), 0.0f);
  openvdb::tools::prune(grid->tree());
  grid->setName("fog");
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  return grid;
}

/// Returns the nearest triangles with the user's numbers. A copy, for the other grids need triangulated()'s.
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

// ---- Values from the surface.

/// The closest point of one voxel.
struct Foot {
  std::uint32_t voxel;  ///< in its leaf
  std::uint32_t triangle;
  TrianglePoint point;  ///< relative to the mesh's origin
};

/// Reads one attribute at closest points.
class AttributeSampler {
 public:
  AttributeSampler(const PolygonMesh& mesh, const MeshAttribute& attribute)
      : mesh_(mesh), attribute_(attribute) {}

  /// Returns a component, interpolated (Aldén 2011, §5.2: barycentric interpolation of the closest point).
  double number(const Foot& foot, int component) const {
    const auto& values = std::get<std::vector<float>>(attribute_.values);
    const auto value = [&](int corner) {
      return double(values[place(foot.triangle, corner) + std::size_t(component)]);
    };
    if (attribute_.domain == AttributeDomain::polygon) return value(0);
    const Eigen::Vector3d& w = foot.point.weights;
    return w[0] * value(0) + w[1] * value(1) + w[2] * value(2);
  }
  /// Returns the number of the nearest corner: between two materials there is no third.
  std::int32_t whole(const Foot& foot) const {
    int corner = 0;
    foot.point.weights.maxCoeff(&corner);
    return std::get<std::vector<std::int32_t>>(attribute_.values)[place(foot.triangle, corner)];
  }
  /// Returns the first three components, with 0 for those that are missing.
  Eigen::Vector3d vector(const Foot& foot) const {
    Eigen::Vector3d result = Eigen::Vector3d::Zero();
    for (int i = 0; i < std::min(3, attribute_.components); ++i) result[i] = number(foot, i);
    return result;
  }
  /// Returns a direction of unit length: the triangle's own if the normals of the corners cancel.
  Eigen::Vector3d normal(const Foot& foot) const {
    constexpr double kCancelled = 1e-6;
    const Eigen::Vector3d sum = vector(foot);
    return sum.norm() > kCancelled ? sum.normalized() : triangle_normal(foot.triangle);
  }

 private:
  /// Returns the index of the first component of a corner's element in the array of values.
  std::size_t place(std::uint32_t triangle, int corner) const {
    return element(triangle, std::size_t(corner)) * std::size_t(attribute_.components);
  }
  /// Returns the number of the point, corner or polygon that has the values of a triangle's corner. Corners
  /// and polygons are those of all triangles, then those of all quads.
  std::size_t element(std::size_t triangle, std::size_t corner) const {
    if (attribute_.domain == AttributeDomain::point) return IndexSoup(mesh_, 1.0).triangle(triangle)[corner];
    const std::size_t triangles = mesh_.triangles.size();
    const bool polygon = attribute_.domain == AttributeDomain::polygon;
    if (triangle < triangles) return polygon ? triangle : 3 * triangle + corner;
    // A quad (a,b,c,d) is the triangles abc and acd.
    const std::size_t half = triangle - triangles, quad = half / 2;
    if (polygon) return triangles + quad;
    return 3 * triangles + 4 * quad + (half % 2 == 1 && corner > 0 ? corner + 1 : corner);
  }
  /// Returns the triangle's own unit normal, or zero if it has no area.
  Eigen::Vector3d triangle_normal(std::uint32_t triangle) const {
    const auto [a, b, c] = IndexSoup(mesh_, 1.0).triangle(triangle);
    const auto point = [&](std::uint32_t i) { return Eigen::Vector3d(mesh_.points[i].cast<double>()); };
    return (point(b) - point(a)).cross(point(c) - point(a)).normalized();  // zero stays zero
  }

  const PolygonMesh& mesh_;
  const MeshAttribute& attribute_;
};

/// Closest points of a leaf's voxels, and the voxels without one.
struct Feet {
  std::vector<Foot> found;
  std::vector<std::uint32_t> missing;
};

/// A grid over the voxels of the nearest triangles. Different leaves may be filled at the same time.
struct Layer {
  std::string name;
  openvdb::GridBase::Ptr grid;
  std::function<void(std::size_t leaf, const Feet&)> fill;  ///< a voxel without a triangle becomes inactive
  std::function<void()> prune;                              ///< removes leaves without active voxels
};

/// Makes a layer from sample(foot), the value at a closest point.
template <class Grid, class Sample>
Layer make_layer(const std::string& name, const openvdb::Int32Grid& nearest,
                 typename Grid::ValueType background, Sample sample) {
  using Tree = typename Grid::TreeType;
  // The topology is that of the triangles from the start, so that filling adds no node, and leaf i is the
  // same block in all layers.
  const auto grid = Grid::create(std::make_shared<Tree>(nearest.tree(), background, openvdb::TopologyCopy()));
  grid->setTransform(nearest.transform().copy());
  grid->setName(name);
  std::vector<typename Tree::LeafNodeType*> leaves;
  grid->tree().getNodes(leaves);
  return {name, grid,
          [leaves, sample, background](std::size_t leaf, const Feet& feet) {
            for (const Foot& foot : feet.found) leaves[leaf]->setValueOnly(foot.voxel, sample(foot));
            for (const std::uint32_t voxel : feet.missing) leaves[leaf]->setValueOff(voxel, background);
          },
          [grid] { openvdb::tools::pruneInactive(grid->tree()); }};
}

openvdb::Vec3d to_vec3d(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

/// Returns the attribute's name, different from those of the voxelizer's own grids.
std::string grid_name(const MeshAttribute& attribute) {
  constexpr std::array names = {"sdf", "udf", "fog", "hermite", "closest-point", "triangle-id"};
  return (std::ranges::find(names, attribute.name) != names.end() ? "attribute-" : "") + attribute.name;
}

/// Appends the grids of one attribute, two if it has four components: OpenVDB has no vector of four.
void add_layers(const PolygonMesh& mesh, const MeshAttribute& attribute, const openvdb::Int32Grid& nearest,
                std::vector<Layer>& layers) {
  const AttributeSampler sampler(mesh, attribute);
  const std::string name = grid_name(attribute);
  const bool normal =
      attribute.components == 3 && (attribute.name == "normal" || attribute.name.ends_with("-normal"));
  const auto component = [&](const std::string& grid, int i) {
    return make_layer<openvdb::FloatGrid>(
        grid, nearest, 0.0f, [sampler, i](const Foot& foot) { return float(sampler.number(foot, i)); });
  };
  if (std::holds_alternative<std::vector<std::int32_t>>(attribute.values)) {
    layers.push_back(make_layer<openvdb::Int32Grid>(
        name, nearest, -1, [sampler](const Foot& foot) { return sampler.whole(foot); }));
  } else if (attribute.components == 1) {
    layers.push_back(component(name, 0));
  } else {
    layers.push_back(make_layer<openvdb::Vec3SGrid>(
        name, nearest, openvdb::Vec3s(0.0f), [sampler, normal](const Foot& foot) {
          return openvdb::Vec3s(to_vec3d(normal ? sampler.normal(foot) : sampler.vector(foot)));
        }));
  }
  openvdb::GridBase& grid = *layers.back().grid;
  grid.setVectorType(normal ? openvdb::VEC_COVARIANT_NORMALIZE : openvdb::VEC_INVARIANT);
  grid.setIsInWorldSpace(normal);
  for (std::size_t i = 0; i < attribute.labels.size(); ++i)
    grid.insertMeta("label_" + std::to_string(i), openvdb::StringMetadata(attribute.labels[i]));
  if (attribute.components != 4) return;
  layers.push_back(component(name + "-alpha", 3));
  layers.back().grid->setVectorType(openvdb::VEC_INVARIANT);
  layers.back().grid->setIsInWorldSpace(false);
}

/// Throws Error for an attribute with a wrong number of values, or one that is not finite.
void check_attribute(const PolygonMesh& mesh, const MeshAttribute& attribute) {
  const std::size_t polygons = mesh.triangles.size() + mesh.quads.size(),
                    corners = 3 * mesh.triangles.size() + 4 * mesh.quads.size();
  const std::size_t elements = attribute.domain == AttributeDomain::point    ? mesh.points.size()
                               : attribute.domain == AttributeDomain::corner ? corners
                                                                             : polygons;
  const std::size_t size = std::visit([](const auto& values) { return values.size(); }, attribute.values);
  const bool whole = std::holds_alternative<std::vector<std::int32_t>>(attribute.values);
  const std::string the_attribute = "the attribute '" + attribute.name + "'";
  if (attribute.components < 1 || attribute.components > (whole ? 1 : 4))
    throw Error(the_attribute + " cannot have " + std::to_string(attribute.components) + " components");
  if (size != elements * std::size_t(attribute.components))
    throw Error(the_attribute + " has " + std::to_string(size) + " values, but the mesh needs " +
                std::to_string(elements * std::size_t(attribute.components)));
  if (const auto* numbers = std::get_if<std::vector<float>>(&attribute.values))
    if (!std::ranges::all_of(*numbers, [](float value) { return std::isfinite(value); }))
      throw Error(the_attribute + " has a value that is not finite");
}

/// Returns the closest points of a leaf's voxels on their nearest triangles.
Feet find_feet(const PolygonMesh& mesh, const openvdb::Int32Tree::LeafNodeType& leaf, double voxel_size) {
  const IndexSoup soup(mesh, 1.0);
  Feet feet;
  feet.found.reserve(leaf.onVoxelCount());
  for (auto voxel = leaf.cbeginValueOn(); voxel; ++voxel) {
    if (*voxel < 0) {
      feet.missing.push_back(voxel.pos());
      continue;
    }
    const openvdb::Coord at = voxel.getCoord();
    const auto& [a, b, c] = Facet(soup.corners(std::size_t(*voxel))).corner;
    feet.found.push_back({voxel.pos(), std::uint32_t(*voxel),
                          closest_point(voxel_size * Eigen::Vector3d(at.x(), at.y(), at.z()), a, b, c)});
  }
  return feet;
}

/// Makes the grid of closest points, if requested, and those of the attributes, over the voxels of `nearest`
/// and with its transform. @throws Error for an invalid attribute; Cancelled.
std::vector<openvdb::GridBase::Ptr> transfer_from_surface(const PolygonMesh& mesh,
                                                          const openvdb::Int32Grid& nearest,
                                                          double voxel_size, bool closest_points,
                                                          const std::vector<const MeshAttribute*>& attributes,
                                                          RunContext& context) {
  const Stage stage(context, "values from the surface");
  std::vector<Layer> layers;
  if (closest_points) {
    layers.push_back(make_layer<openvdb::Vec3SGrid>(
        "closest-point", nearest, openvdb::Vec3s(0.0f),
        [](const Foot& foot) { return openvdb::Vec3s(to_vec3d(foot.point.position)); }));
    // Points, which a program that moves the grid has to move along: an absolute vector in world space.
    layers[0].grid->setVectorType(openvdb::VEC_CONTRAVARIANT_ABSOLUTE);
    layers[0].grid->setIsInWorldSpace(true);
  }
  for (const MeshAttribute* attribute : attributes) {
    context.check();
    check_attribute(mesh, *attribute);
    add_layers(mesh, *attribute, nearest, layers);
  }
  std::vector<const openvdb::Int32Tree::LeafNodeType*> leaves;
  nearest.tree().getNodes(leaves);
  parallel_blocks(leaves.size(), context, [&](std::size_t i) {
    const Feet feet = find_feet(mesh, *leaves[i], voxel_size);
    for (const Layer& layer : layers) layer.fill(i, feet);
  });
  std::vector<openvdb::GridBase::Ptr> grids;
  for (const Layer& layer : layers) {
    layer.prune();
    grids.push_back(layer.grid);
  }
  if (closest_points)
    grids.front()->insertMeta(kZeroOfPositions, openvdb::Vec3DMetadata(to_vec3d(mesh.origin)));
  return grids;
}

// ---- Requests.

/// Returns the requested attributes, in the order of the mesh, each once. @throws Error if one does not
/// exist.
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

/// Throws Error for grids that need an inside if there is none. Called before the work and after it.
void check_signs(const VolumeRequest& request, bool is_signed) {
  if (is_signed) return;
  for (const auto& [asked, name] : {std::pair(request.fog, "fog"), std::pair(request.hermite, "hermite")})
    if (asked)
      throw Error("the grid " + std::string(name) +
                  " needs an inside, but the distances have no sign; leave it out");
}

/// Returns the bytes in addition to those of the distances: leaves of 512 values for each grid, and for the
/// triangles that some are made from.
double bytes_of_outputs(const VolumeRequest& request, const std::vector<const MeshAttribute*>& attributes,
                        double leaves) {
  std::size_t bytes = (request.udf ? 4 : 0) + (request.fog ? 4 : 0) +
                      (request.hermite ? sizeof(FloatVoxel) : 0) +
                      (request.closest_point ? sizeof(openvdb::Vec3s) : 0);
  // Two components become a vector of three.
  for (const MeshAttribute* attribute : attributes)
    bytes += 4 * std::size_t(attribute->components == 2 ? 3 : attribute->components);
  if (request.triangle_id || request.closest_point || !attributes.empty()) bytes += 4;
  return 512.0 * leaves * double(bytes);
}

/// Throws Error for grids that together need more memory than is available. Unknown memory is enough.
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
  const std::pair<const char*, bool VolumeRequest::*> grids[] = {
      {"sdf", &VolumeRequest::sdf},
      {"udf", &VolumeRequest::udf},
      {"triangle-id", &VolumeRequest::triangle_id},
      {"closest-point", &VolumeRequest::closest_point},
      {"fog", &VolumeRequest::fog},
      {"hermite", &VolumeRequest::hermite},
      {"attributes", &VolumeRequest::all_attributes}};
  for (std::string name; std::getline(names, name, ',');) {
    const auto grid = std::ranges::find_if(grids, [&](const auto& known) { return name == known.first; });
    if (grid != std::end(grids))
      request.*grid->second = true;
    else if (name.starts_with(attribute))
      request.attributes.push_back(name.substr(attribute.size()));
    else
      throw Error("unknown grid '" + name + "'; choose from " + kNames);
  }
  request.sdf |= request.hermite;
  // getline() ignores a comma at the end.
  if (list.empty() || list.back() == ',')
    throw Error("a name is missing in the list of grids; choose from " + std::string(kNames));
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
  // For the distances only, voxelize() does the same.
  if (!request.only_sdf()) check_fits(mesh, options, request, attributes);

  VoxelizeOptions with_nearest = options;
  with_nearest.nearest = request.triangle_id || request.closest_point || !attributes.empty();
  const Voxelization made = by(with_nearest);
  check_signs(request, made.is_signed);

  VolumeOutputs outputs;
  outputs.active_voxels = made.distance->activeVoxelCount();
  // Without signs the distances themselves are "udf".
  if (request.sdf || (request.udf && !made.is_signed)) outputs.grids.push_back(made.distance);
  if (request.udf && made.is_signed) outputs.grids.push_back(make_udf(*made.distance, context));
  if (request.triangle_id)
    outputs.grids.push_back(make_triangle_id(made.nearest, request.triangle_numbers, context));
  if (request.closest_point || !attributes.empty())
    for (const auto& grid : transfer_from_surface(mesh, *made.nearest, options.voxel_size,
                                                  request.closest_point, attributes, context))
      outputs.grids.push_back(grid);
  if (request.fog) outputs.grids.push_back(make_fog(*made.distance, options, request.fog_exterior, context));
  if (request.hermite) outputs.hermite = sample_polygons(make_level_set(made.distance), 0.0, mesh, context);
  return outputs;
}

std::filesystem::path hermite_path(const std::filesystem::path& path) {
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
