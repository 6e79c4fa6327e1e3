#include "reference/openvdb_fracture.h"

#include <openvdb/tools/LevelSetFracture.h>

#include <chrono>
#include <list>
#include <utility>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/core/run_context.h"
#include "reference/meshing_frame.h"
#include "reference/openvdb_mesh_to_volume.h"
#include "reference/openvdb_mesher.h"

namespace hermesh {
namespace {

using openvdb::FloatGrid;

PolygonMesh mesh_of(const FloatGrid& fragment, const FloatGrid& reference, const MeshingFrame& frame,
                    double adaptivity) {
  // Both with the transform without the origin, so that points keep their precision.
  const auto moved = [&](const FloatGrid& grid) {
    openvdb::MetaMap meta(grid);
    return FloatGrid::ConstPtr(grid.copyReplacingMetadataAndTransform(meta, frame.transform));
  };
  const FloatGrid::ConstPtr piece = moved(fragment), whole = moved(reference);
  openvdb::tools::VolumeToMesh mesher(0.0, adaptivity);
  mesher.setRefGrid(whole, adaptivity);
  run_mesher(mesher, *piece);
  PolygonMesh mesh;
  mesh.origin = frame.origin;
  for (std::size_t i = 0; i < mesher.pointListSize(); ++i) {
    const openvdb::Vec3s& p = mesher.pointList()[i];
    mesh.points.emplace_back(p.x(), p.y(), p.z());
  }
  std::vector<std::int32_t> surface, of_quads;
  const auto cut = [](char flags) { return (flags & openvdb::tools::POLYFLAG_EXTERIOR) ? 0 : 1; };
  for (std::size_t i = 0; i < mesher.polygonPoolListSize(); ++i) {
    const openvdb::tools::PolygonPool& pool = mesher.polygonPoolList()[i];
    for (std::size_t j = 0; j < pool.numTriangles(); ++j) {
      const openvdb::Vec3I& t = pool.triangle(j);
      mesh.triangles.push_back({t[0], t[2], t[1]});
      surface.push_back(cut(pool.triangleFlags(j)));
    }
    for (std::size_t j = 0; j < pool.numQuads(); ++j) {
      const openvdb::Vec4I& q = pool.quad(j);
      mesh.quads.push_back({q[0], q[3], q[2], q[1]});
      of_quads.push_back(cut(pool.quadFlags(j)));
    }
  }
  surface.insert(surface.end(), of_quads.begin(), of_quads.end());
  mesh.attributes.push_back({"surface", AttributeDomain::polygon, 1, std::move(surface), {}});
  return mesh;
}

}  // namespace

void openvdb_fracture(const LevelSet& object, std::size_t cutters, const OpenvdbCutter& cutter,
                      double adaptivity, const std::function<void(OpenvdbFragment&&)>& hand_over,
                      RunContext& context) {
  const FloatGrid& whole = *object.grid().grid;
  if (!whole.transform().isLinear() || !whole.transform().hasUniformScale())
    throw Error("OpenVDB's fracture needs an object whose voxels are cubes");
  const MeshingFrame frame = meshing_frame(whole, 0.0);
  const openvdb::Vec3d corner = whole.transform().indexToWorld(openvdb::Vec3d(0.0));
  // Made aside, because a fragment takes its transform with it.
  std::list<FloatGrid::Ptr> rest{whole.deepCopy()};
  std::vector<std::pair<FloatGrid::Ptr, OpenvdbFragment>> fragments;
  for (std::size_t k = 0; k < cutters; ++k) {
    context.check();
    OpenvdbFragment fragment;
    PolygonMesh polygons = cutter(k);
    if (polygons.empty()) continue;
    Stopwatch watch;
    const Eigen::Vector3d shift = polygons.origin - Eigen::Vector3d(corner.x(), corner.y(), corner.z());
    for (auto& p : polygons.points) p = (p.cast<double>() + shift).cast<float>();
    polygons.origin = {corner.x(), corner.y(), corner.z()};
    const LevelSet volume = openvdb_mesh_to_volume(
        {.mesh = polygons, .voxel_size = whole.voxelSize()[0], .context = context, .options = {}});
    fragment.conversion_seconds = watch.seconds();
    const FloatGrid::Ptr cut = volume.grid().grid->deepCopy();
    cut->setTransform(whole.transform().copy());
    openvdb::tools::LevelSetFracture<FloatGrid> fracture;
    fracture.fracture(rest, *cut);
    fragment.csg_seconds = watch.seconds();
    fragment.name = "fragment " + std::to_string(k);
    fragment.cutter = k;
    for (const FloatGrid::Ptr& grid : fracture.fragments()) fragments.emplace_back(grid, fragment);
    context.progress("fracture", 0.5 * double(k + 1) / double(cutters));
  }
  for (const FloatGrid::Ptr& grid : rest)
    fragments.emplace_back(grid, OpenvdbFragment{.name = "rest", .mesh = {}});
  for (std::size_t i = 0; i < fragments.size(); ++i) {
    context.check();
    auto& [grid, fragment] = fragments[i];
    Stopwatch watch;
    fragment.mesh = mesh_of(*grid, whole, frame, adaptivity);
    fragment.extraction_seconds = watch.seconds();
    grid.reset();
    hand_over(std::move(fragment));
    context.progress("fracture", 0.5 + 0.5 * double(i + 1) / double(fragments.size()));
  }
}

}  // namespace hermesh
