#include <Eigen/LU>
#include <algorithm>

#include "algorithms/core/variant.h"
#include "algorithms/fracture/cutters.h"
#include "algorithms/hermite/samplers.h"
#include "algorithms/voxelization/hermesh_voxelizer.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// The first sample of a block near the placement's base: index coordinates relative to it are small, and
/// blocks stay blocks.
std::array<std::int32_t, 3> block_near(const IndexToWorld& placement) {
  return {placement.base[0] & ~7, placement.base[1] & ~7, placement.base[2] & ~7};
}

/// The mesh in index coordinates relative to block_near(), where a voxel is 1 along every axis, however the
/// lattice lies in the world.
PolygonMesh in_index_space(const PolygonMesh& mesh, const IndexToWorld& placement) {
  // Points are rounded to single precision about a block near the base, not about the world's zero.
  const Eigen::Matrix3d to_index = placement.linear.inverse();
  const std::array<std::int32_t, 3> corner = block_near(placement);
  Vector3d base;
  for (int a = 0; a < 3; ++a) base[a] = double(placement.base[a]) - double(corner[a]);
  PolygonMesh result;
  result.triangles = triangulated(mesh);
  result.points.reserve(mesh.points.size());
  for (std::size_t i = 0; i < mesh.points.size(); ++i)
    result.points.push_back(
        Vector3d(to_index * (mesh.world(i) - placement.origin - placement.offset) + base).cast<float>());
  // A mirrored lattice turns triangles inside out; flip them so that their normals point outwards in index
  // space.
  if (placement.mirrors())
    for (Triangle& t : result.triangles) std::swap(t[1], t[2]);
  return result;
}

/// Stores the Hermite data of all cutting solids on the object's lattice. The thesis (§7.1) subtracts each
/// cutter from the object before applying the next one; here the codes define the order of the cutters.
class MeshCutters : public Cutters {
 public:
  MeshCutters(const std::vector<CuttingMesh>& meshes, const IndexToWorld& placement, RunContext& context) {
    for (const CuttingMesh& cutter : meshes) {
      const Stage stage(context, "Hermite data of " + cutter.name);
      names_.push_back(cutter.name);
      solids_.push_back(hermite_on_lattice(cutter.mesh, placement, context));
    }
  }

  void codes(const At& lower, std::span<CutCode, 512> codes) const override {
    std::fill(codes.begin(), codes.end(), solids_.size());
    // From the last to the first, so that of several that hold a sample the first overwrites the others.
    for (std::size_t k = solids_.size(); k-- > 0;) {
      for_each_bit(inside(k, lower), [&](int i) { codes[static_cast<std::size_t>(i)] = k; });
    }
  }

  std::optional<CutCrossing> crossing(const At& at, int axis, CutCode first, CutCode second) const override {
    // The interface is the surface of the earlier cutter, because the later one receives only samples that
    // the earlier one does not contain.
    const std::size_t k = std::min(first, second);
    if (k >= solids_.size() || !solids_[k]) return std::nullopt;
    // An edge belongs to its first sample's leaf; without a leaf no edge that starts there is crossed.
    const SignLeaf* leaf = solids_[k]->find({at[0] & ~7, at[1] & ~7, at[2] & ~7});
    if (!leaf) return std::nullopt;
    const int sample = sample_index(at[0] & 7, at[1] & 7, at[2] & 7);
    const std::array<BlockMask, 3> edges = crossing_edges(*leaf);
    if (!test(edges[axis], sample)) return std::nullopt;
    // Crossings are sorted by axis and then by sample: the index of one is its rank among the leaf's set
    // bits.
    std::size_t rank = leaf->first;
    for (int a = 0; a < axis; ++a) rank += static_cast<std::size_t>(hermesh::count(edges[a]));
    rank += rank_in(edges[axis], sample);
    return CutCrossing{solids_[k]->crossings[rank], static_cast<std::int32_t>(k)};
  }

  std::size_t count() const override { return solids_.size(); }
  std::string name(std::size_t cutter) const override { return names_[cutter]; }
  std::optional<Vector3d> plane_between(CutCode, CutCode) const override { return std::nullopt; }
  bool is_empty(std::size_t cutter) const override { return !solids_[cutter]; }
  std::optional<BlockMask> signs(std::size_t cutter, const At& lower) const override {
    return inside(cutter, lower);
  }
  const FloatHermite* solid(std::size_t cutter) const override {
    return solids_[cutter] ? &*solids_[cutter] : nullptr;
  }
  std::string name_of(CutCode code) const override {
    return code < names_.size() ? "taken by " + names_[code] : "what no cutter takes";
  }

 private:
  /// The samples of a block within cutter k, even those that other cutters also contain.
  BlockMask inside(std::size_t k, const At& lower) const {
    BlockMask mask{};
    if (!solids_[k]) return mask;
    if (const SignLeaf* leaf = solids_[k]->find(lower)) return leaf->inside;
    if (solids_[k]->sign_without_leaf(lower)) mask.fill(~std::uint64_t{0});
    return mask;
  }

  std::vector<std::string> names_;
  std::vector<std::optional<FloatHermite>> solids_;
};

}  // namespace

std::optional<FloatHermite> hermite_on_lattice(const PolygonMesh& mesh, const IndexToWorld& placement,
                                               RunContext& context) {
  if (mesh.empty()) return std::nullopt;
  const PolygonMesh turned = in_index_space(mesh, placement);
  // A band of one voxel is enough: the level set gives the signs and the edges to test, the polygons give the
  // hits.
  const LevelSet level_set =
      hermesh_voxelizer({.mesh = turned,
                         .voxel_size = 1.0,
                         .exterior_band = 1.0,
                         .interior_band = 1.0,
                         .context = context,
                         .options = Options("hermesh", hermesh_voxelizer_options(), {})});
  FloatHermite hermite = sample_polygons(level_set, 0.0, turned, context);
  if (hermite.leaves.empty()) return std::nullopt;
  const std::array<std::int32_t, 3> corner = block_near(placement);
  // Back to the object's index coordinates, by multiples of 8, so that leaves stay leaves. Offsets and
  // normals are those of index space already.
  for (SignLeaf& leaf : hermite.leaves)
    for (int a = 0; a < 3; ++a) leaf.lower[a] += corner[a];
  hermite.placement = placement;
  return hermite;
}

PolygonMesh placed(const PolygonMesh& mesh, const Eigen::Matrix3d& rotation, double scale,
                   const Vector3d& centre, const Vector3d& place) {
  PolygonMesh result = mesh;
  // Single precision is relative to the new position, so the copy is as exact there as the mesh was.
  result.origin = place;
  for (std::size_t i = 0; i < mesh.points.size(); ++i)
    result.points[i] = Vector3d(scale * (rotation * (mesh.world(i) - centre))).cast<float>();
  return result;
}

std::unique_ptr<Cutters> mesh_cutters(const std::vector<CuttingMesh>& meshes, const IndexToWorld& placement,
                                      RunContext& context) {
  return std::make_unique<MeshCutters>(meshes, placement, context);
}

}  // namespace hermesh
