#include "reference/openvdb_volume_to_mesh.h"

#include "algorithms/core/level_set_grid.h"
#include "reference/meshing_frame.h"
#include "reference/openvdb_mesher.h"

namespace hermesh {

PolygonMesh openvdb_volume_to_mesh(const ExtractionInput& input) {
  const Stage stage(input.context, "extraction");
  const openvdb::FloatGrid& grid = *input.level_set.grid().grid;
  const MeshingFrame frame = meshing_frame(grid, input.isovalue);

  // OpenVDB takes the inside of a level set to be below the isovalue and that of any other grid to be above
  // it, so the grid class of the copy, which shares the tree with the original, selects the inside.
  openvdb::MetaMap meta;
  meta.insertMeta(openvdb::GridBase::META_GRID_CLASS,
                  openvdb::StringMetadata(openvdb::GridBase::gridClassToString(
                      frame.inside_is_above ? openvdb::GRID_FOG_VOLUME : openvdb::GRID_LEVEL_SET)));
  const openvdb::FloatGrid::ConstPtr centred = grid.copyReplacingMetadataAndTransform(meta, frame.transform);

  openvdb::tools::VolumeToMesh mesher(input.isovalue, input.options.number("adaptivity"));
  run_mesher(mesher, *centred);
  input.context.check();

  PolygonMesh mesh;
  mesh.origin = frame.origin;
  mesh.points.reserve(mesher.pointListSize());
  for (std::size_t i = 0; i < mesher.pointListSize(); ++i) {
    const openvdb::Vec3s& p = mesher.pointList()[i];
    mesh.points.emplace_back(p.x(), p.y(), p.z());
  }
  std::size_t triangles = 0, quads = 0;
  for (std::size_t i = 0; i < mesher.polygonPoolListSize(); ++i) {
    triangles += mesher.polygonPoolList()[i].numTriangles();
    quads += mesher.polygonPoolList()[i].numQuads();
  }
  mesh.triangles.reserve(triangles);
  mesh.quads.reserve(quads);
  // OpenVDB winds its polygons clockwise seen from outside, whatever the transform: they are read backwards,
  // from the first corner on, which keeps the diagonal, unless the transform mirrors.
  const bool mirrors = grid.transform().baseMap()->determinant() < 0.0;
  for (std::size_t i = 0; i < mesher.polygonPoolListSize(); ++i) {
    const openvdb::tools::PolygonPool& pool = mesher.polygonPoolList()[i];
    for (std::size_t j = 0; j < pool.numTriangles(); ++j) {
      const openvdb::Vec3I& t = pool.triangle(j);
      mesh.triangles.push_back(mirrors ? Triangle{t[0], t[1], t[2]} : Triangle{t[0], t[2], t[1]});
    }
    for (std::size_t j = 0; j < pool.numQuads(); ++j) {
      const openvdb::Vec4I& q = pool.quad(j);
      mesh.quads.push_back(mirrors ? Quad{q[0], q[1], q[2], q[3]} : Quad{q[0], q[3], q[2], q[1]});
    }
  }
  return mesh;
}

}  // namespace hermesh
