#include "experiments/harness/solid_columns.h"

#include "validation/solid_comparison.h"

namespace hermesh {

std::vector<MeasuredColumn> solid_columns() {
  return {
      {"solid", "solid",
       "whether the mesh bounds the solid of the input, within √3 voxels: same, differs, or unknown of the "
       "input"},
      {"solid_difference", "△ [%]",
       "volume of the symmetric difference of the two solids, of the input's volume, where both are known"},
      {"false_area", "false [%]", "area that follows what bounds no solid in the input, of the mesh's"}};
}

void set_solid(Json& values, const validation::SolidComparison& solid) {
  values["solid"] = validation::verdict_word(solid);
  if (solid.reference_volume.value > 0.0)
    values["solid_difference"] = 100.0 * solid.difference.value / solid.reference_volume.value;
  if (solid.mesh_area > 0.0) values["false_area"] = 100.0 * solid.false_area.value / solid.mesh_area;
}

validation::SolidComparison compare_pieces(const std::vector<MeshFile>& pieces, const MeshFile& whole,
                                           double voxel_size, RunContext& context) {
  MeshFile all;
  for (const MeshFile& piece : pieces) {
    const auto base = static_cast<std::uint32_t>(all.points.size());
    all.points.insert(all.points.end(), piece.points.begin(), piece.points.end());
    for (const Triangle& t : piece.triangles)
      all.triangles.push_back({base + t[0], base + t[1], base + t[2]});
    for (const Quad& q : piece.quads)
      all.quads.push_back({base + q[0], base + q[1], base + q[2], base + q[3]});
  }
  return validation::compare_solids(all, whole, {.voxel_size = voxel_size, .pieces = true}, context);
}

}  // namespace hermesh
