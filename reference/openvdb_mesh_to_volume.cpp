#include "reference/openvdb_mesh_to_volume.h"

#include <openvdb/tools/MeshToVolume.h>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/lattice/grid_placement.h"
#include "algorithms/lattice/memory_estimate.h"

namespace hermesh {
namespace {

/// The polygons as meshToVolume asks for them: points in voxel coordinates, relative to the mesh's origin.
class Polygons {
 public:
  Polygons(const PolygonMesh& mesh, double voxel_size) : mesh_(mesh), voxel_size_(voxel_size) {}

  std::size_t polygonCount() const { return mesh_.triangles.size() + mesh_.quads.size(); }
  std::size_t pointCount() const { return mesh_.points.size(); }
  std::size_t vertexCount(std::size_t polygon) const { return polygon < mesh_.triangles.size() ? 3 : 4; }
  void getIndexSpacePoint(std::size_t polygon, std::size_t corner, openvdb::Vec3d& position) const {
    const std::size_t triangles = mesh_.triangles.size();
    const std::uint32_t point =
        polygon < triangles ? mesh_.triangles[polygon][corner] : mesh_.quads[polygon - triangles][corner];
    for (int axis = 0; axis < 3; ++axis) position[axis] = double(mesh_.points[point][axis]) / voxel_size_;
  }

 private:
  const PolygonMesh& mesh_;
  double voxel_size_;
};

/// The interrupter that OpenVDB polls from any thread.
struct Interrupter {
  const RunContext& context;
  void start(const char* = nullptr) {}
  void end() {}
  bool wasInterrupted(int = -1) const { return context.cancelled(); }
};

/// Returns true if more than 1 % of the active voxels are negative. A few negative voxels do not count as an
/// inside: an open mesh leaves some where it passes exactly through samples.
bool has_inside(const openvdb::FloatGrid& grid) {
  std::size_t active = 0, negative = 0;
  for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf)
    for (auto value = leaf->cbeginValueOn(); value; ++value) {
      ++active;
      negative += *value < 0.0f ? 1 : 0;
    }
  return 100 * negative > active;
}

}  // namespace

LevelSet openvdb_mesh_to_volume(const VoxelizationInput& input) {
  check_voxelization_fits(input.mesh, input.voxel_size, input.exterior_band, input.interior_band);
  const Stage stage(input.context, "voxelization");
  initialize_openvdb();
  const auto transform = transform_at(input.mesh.origin, input.voxel_size);

  Interrupter interrupter{input.context};
  const bool raw = input.options.is("renormalize", "no");
  const openvdb::FloatGrid::Ptr grid = openvdb::tools::meshToVolume<openvdb::FloatGrid>(
      interrupter, Polygons(input.mesh, input.voxel_size), *transform, float(input.exterior_band),
      float(input.interior_band), raw ? openvdb::tools::DISABLE_RENORMALIZATION : 0);
  input.context.check();
  grid->setName("sdf");
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  if (!has_inside(*grid))
    input.context.note(
        "The level set has next to no inside: OpenVDB's voxelizer needs a closed mesh, thicker than a "
        "voxel.");
  return make_level_set(grid);
}

}  // namespace hermesh
