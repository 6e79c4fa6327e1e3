#include "algorithms/voxelization/outputs/surface_transfer.h"

#include <openvdb/tools/Prune.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <memory>
#include <span>

#include "algorithms/core/parallel.h"
#include "algorithms/io/vdb_archive.h"
#include "algorithms/search/triangle_point.h"
#include "algorithms/voxelization/distance/index_soup.h"

namespace hermesh {
namespace {

// ---- What a voxel asks of an attribute.

/// The closest point of one voxel.
struct Foot {
  std::uint32_t voxel;  ///< in its leaf
  std::uint32_t triangle;
  TrianglePoint point;  ///< relative to the mesh's origin
};

/// Reads one attribute at closest points. It is copied into the function of a grid, and reads alone.
class AttributeSampler {
 public:
  AttributeSampler(const PolygonMesh& mesh, const MeshAttribute& attribute)
      : mesh_(mesh), attribute_(attribute) {}

  /// A component, interpolated (Aldén 2011, §5.2: barycentric interpolation of the closest point).
  double number(const Foot& foot, int component) const {
    const auto& values = std::get<std::vector<float>>(attribute_.values);
    const auto value = [&](int corner) {
      return double(values[place(foot.triangle, corner) + std::size_t(component)]);
    };
    if (attribute_.domain == AttributeDomain::polygon) return value(0);
    const Eigen::Vector3d& w = foot.point.weights;
    return w[0] * value(0) + w[1] * value(1) + w[2] * value(2);
  }
  /// The number of the nearest corner: between two materials there is no third.
  std::int32_t whole(const Foot& foot) const {
    int corner = 0;
    foot.point.weights.maxCoeff(&corner);
    return std::get<std::vector<std::int32_t>>(attribute_.values)[place(foot.triangle, corner)];
  }
  /// The first three components, with 0 for those that are missing.
  Eigen::Vector3d vector(const Foot& foot) const {
    Eigen::Vector3d result = Eigen::Vector3d::Zero();
    for (int i = 0; i < std::min(3, attribute_.components); ++i) result[i] = number(foot, i);
    return result;
  }
  /// A direction, of unit length. Opposite normals of the corners may leave next to nothing of their mean.
  Eigen::Vector3d normal(const Foot& foot) const {
    constexpr double kCancelled = 1e-6;
    const Eigen::Vector3d sum = vector(foot);
    return sum.norm() > kCancelled ? sum.normalized() : triangle_normal(foot.triangle);
  }

 private:
  /// Place of the first component of an element in the array of values.
  std::size_t place(std::uint32_t triangle, int corner) const {
    return element(triangle, std::size_t(corner)) * std::size_t(attribute_.components);
  }
  /// Number of the point, corner or polygon that a corner of a triangle has its values from. Corners and
  /// polygons are those of all triangles, then those of all quads.
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
  /// The triangle's own unit normal, or zero where it has no area.
  Eigen::Vector3d triangle_normal(std::uint32_t triangle) const {
    const auto [a, b, c] = IndexSoup(mesh_, 1.0).triangle(triangle);
    const auto point = [&](std::uint32_t i) { return Eigen::Vector3d(mesh_.points[i].cast<double>()); };
    return (point(b) - point(a)).cross(point(c) - point(a)).normalized();  // zero stays zero
  }

  const PolygonMesh& mesh_;
  const MeshAttribute& attribute_;
};

// ---- A grid that is being filled.

/// A grid of any type while it is filled. One leaf is for one thread; different leaves may be filled at a
/// time.
class Layer {
 public:
  virtual ~Layer() = default;
  /// Gives voxels of a leaf the values at their closest points.
  virtual void fill(std::size_t leaf, std::span<const Foot> feet) = 0;
  /// Makes a voxel of a leaf inactive, for no triangle is near it.
  virtual void leave_out(std::size_t leaf, std::uint32_t voxel) = 0;
  virtual openvdb::GridBase::Ptr finish(const std::string& name) = 0;
};

/// A layer of one type of grid. `Sample` gives the value of a Foot.
template <class Grid, class Sample>
class SampledLayer final : public Layer {
 public:
  using Tree = typename Grid::TreeType;
  SampledLayer(const openvdb::Int32Grid& nearest, typename Grid::ValueType background, Sample sample)
      // The topology is that of the triangles from the start, so that filling in adds no node, and leaf i is
      // the same block in all layers.
      : grid_(Grid::create(std::make_shared<Tree>(nearest.tree(), background, openvdb::TopologyCopy()))),
        sample_(std::move(sample)) {
    grid_->setTransform(nearest.transform().copy());
    grid_->tree().getNodes(leaves_);
  }
  void fill(std::size_t leaf, std::span<const Foot> feet) override {
    for (const Foot& foot : feet) leaves_[leaf]->setValueOnly(foot.voxel, sample_(foot));
  }
  void leave_out(std::size_t leaf, std::uint32_t voxel) override {
    leaves_[leaf]->setValueOff(voxel, grid_->background());
  }
  openvdb::GridBase::Ptr finish(const std::string& name) override {
    // A leaf of which all voxels were left out says nothing.
    openvdb::tools::pruneInactive(grid_->tree());
    grid_->setName(name);
    return grid_;
  }

 private:
  typename Grid::Ptr grid_;
  Sample sample_;
  std::vector<typename Tree::LeafNodeType*> leaves_;
};

template <class Grid, class Sample>
std::unique_ptr<Layer> make_layer(const openvdb::Int32Grid& nearest, typename Grid::ValueType background,
                                  Sample sample) {
  return std::make_unique<SampledLayer<Grid, Sample>>(nearest, background, std::move(sample));
}

/// A layer, and what the grid says of itself.
struct NamedLayer {
  std::string name;
  openvdb::VecType kind = openvdb::VEC_INVARIANT;
  bool in_world = false;
  std::vector<std::string> labels = {};
  std::unique_ptr<Layer> layer = {};
};

openvdb::Vec3d to_vec3d(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

/// Points, which a program that moves the grid has to move along: an absolute vector in world space.
NamedLayer closest_point_layer(const openvdb::Int32Grid& nearest) {
  const auto position = [](const Foot& foot) { return openvdb::Vec3s(to_vec3d(foot.point.position)); };
  return {"closest-point",
          openvdb::VEC_CONTRAVARIANT_ABSOLUTE,
          true,
          {},
          make_layer<openvdb::Vec3SGrid>(nearest, openvdb::Vec3s(0.0f), position)};
}

/// The attribute's name, out of the way of the voxelizer's own grids.
std::string grid_name(const MeshAttribute& attribute) {
  constexpr std::array names = {"sdf", "udf", "fog", "hermite", "closest-point", "triangle-id"};
  return (std::ranges::find(names, attribute.name) != names.end() ? "attribute-" : "") + attribute.name;
}

bool is_normal(const MeshAttribute& attribute) {
  return attribute.components == 3 && (attribute.name == "normal" || attribute.name.ends_with("-normal"));
}

/// Adds the grids of one attribute, two where it has four components: OpenVDB has no vector of four.
void add_layers(const PolygonMesh& mesh, const MeshAttribute& attribute, const openvdb::Int32Grid& nearest,
                std::vector<NamedLayer>& layers) {
  const AttributeSampler sampler(mesh, attribute);
  NamedLayer& layer = layers.emplace_back();
  layer.name = grid_name(attribute);
  layer.labels = attribute.labels;
  const auto component = [&](int i) {
    return make_layer<openvdb::FloatGrid>(
        nearest, 0.0f, [sampler, i](const Foot& foot) { return float(sampler.number(foot, i)); });
  };
  if (std::holds_alternative<std::vector<std::int32_t>>(attribute.values)) {
    layer.layer = make_layer<openvdb::Int32Grid>(nearest, -1,
                                                 [sampler](const Foot& foot) { return sampler.whole(foot); });
  } else if (attribute.components == 1) {
    layer.layer = component(0);
  } else {
    const bool normal = is_normal(attribute);
    if (normal) layer.kind = openvdb::VEC_COVARIANT_NORMALIZE, layer.in_world = true;
    layer.layer =
        make_layer<openvdb::Vec3SGrid>(nearest, openvdb::Vec3s(0.0f), [sampler, normal](const Foot& foot) {
          return openvdb::Vec3s(to_vec3d(normal ? sampler.normal(foot) : sampler.vector(foot)));
        });
  }
  if (attribute.components == 4) {
    const std::string name = layer.name + "-alpha";  // `layer` does not outlive the next line
    NamedLayer& fourth = layers.emplace_back();
    fourth.name = name;
    fourth.layer = component(3);
  }
}

// ---- The work.

/// Refuses an attribute that the sampler would read beyond its end, or that holds what is no number.
void check(const PolygonMesh& mesh, const MeshAttribute& attribute) {
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

/// Closest points of a leaf's voxels, and the voxels that have none.
struct Feet {
  std::vector<Foot> found;
  std::vector<std::uint32_t> missing;
};

/// Finds the closest points of a leaf's voxels on the triangles that are known to be the nearest: no search.
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
    const auto [a, b, c] = soup.triangle(std::size_t(*voxel));
    const auto corner = [&](std::uint32_t i) { return Eigen::Vector3d(mesh.points[i].cast<double>()); };
    feet.found.push_back({voxel.pos(), std::uint32_t(*voxel),
                          closest_point(voxel_size * Eigen::Vector3d(at.x(), at.y(), at.z()), corner(a),
                                        corner(b), corner(c))});
  }
  return feet;
}

/// The layer's grid with its name, kind and labels.
openvdb::GridBase::Ptr finish(NamedLayer& layer) {
  const openvdb::GridBase::Ptr grid = layer.layer->finish(layer.name);
  grid->setVectorType(layer.kind);
  grid->setIsInWorldSpace(layer.in_world);
  for (std::size_t i = 0; i < layer.labels.size(); ++i)
    grid->insertMeta("label_" + std::to_string(i), openvdb::StringMetadata(layer.labels[i]));
  return grid;
}

}  // namespace

std::size_t bytes_per_voxel(const MeshAttribute& attribute) {
  // Two components become a vector of three.
  return 4 * std::size_t(attribute.components == 2 ? 3 : attribute.components);
}

std::vector<openvdb::GridBase::Ptr> transfer_from_surface(const PolygonMesh& mesh,
                                                          const openvdb::Int32Grid& nearest,
                                                          double voxel_size, const TransferRequest& request,
                                                          RunContext& context) {
  const Stage stage(context, "values from the surface");
  std::vector<NamedLayer> layers;
  if (request.closest_point) layers.push_back(closest_point_layer(nearest));
  for (const MeshAttribute* attribute : request.attributes) {
    context.check();
    check(mesh, *attribute);
    add_layers(mesh, *attribute, nearest, layers);
  }
  std::vector<const openvdb::Int32Tree::LeafNodeType*> leaves;
  nearest.tree().getNodes(leaves);
  // Closest points once a leaf, for all grids.
  parallel_blocks(leaves.size(), context, [&](std::size_t i) {
    const Feet feet = find_feet(mesh, *leaves[i], voxel_size);
    for (const NamedLayer& layer : layers) {
      layer.layer->fill(i, feet.found);
      for (const std::uint32_t voxel : feet.missing) layer.layer->leave_out(i, voxel);
    }
  });
  std::vector<openvdb::GridBase::Ptr> grids;
  for (NamedLayer& layer : layers) grids.push_back(finish(layer));
  if (request.closest_point)
    grids.front()->insertMeta(kZeroOfPositions, openvdb::Vec3DMetadata(to_vec3d(mesh.origin)));
  return grids;
}

}  // namespace hermesh
