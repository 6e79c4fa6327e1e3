#include "experiments/measurements/guarantee_columns.h"

#include <algorithm>
#include <iterator>

#include "experiments/harness/solid_columns.h"

namespace hermesh {

std::vector<MeasuredColumn> guarantee_mesh_columns() {
  std::vector<MeasuredColumn> columns = {
      {"resolution", "res.", "voxels along the longest side"},
      {"extractor", "extractor",
       "adaptive-dual-contouring with threshold 0.1 on float data, openvdb with adaptivity 0.1"},
      {"tolerance", "tol. [vx]", "0 gives the uniform mesh"},
      {"triangles", "triangles", "a quad counting as two"},
      {"seconds", "time [s]", "one run, Hermite data included"},
      {"boundary", "open", "boundary edges"},
      {"non_manifold_edges", "nm e", "non-manifold edges"},
      {"non_manifold_vertices", "nm v", "non-manifold vertices"},
      {"inconsistent", "flipped", "inconsistently oriented edges"},
      {"degenerate", "degen.", "degenerate polygons"},
      {"self_intersections", "crossing", "self-intersecting pairs of triangles"},
      {"components", "comp.", "connected components"},
      {"euler", "V−E+F", "Euler characteristic"},
      {"same_topology", "same", "components and Euler characteristic are those of the uniform mesh"},
      {"from_upper", "from ≤ [vx]", "certified bound of the distance from the uniform mesh to this"},
      {"to_upper", "to ≤ [vx]", "certified bound of the distance from this mesh to the uniform"},
      {"lower", "≥ [vx]",
       "certified bound from below of the larger of both; beyond the tolerance a disproof"},
      {"cells", "cells", "cells that the surface passes through"},
      {"several_sheets", "sheets", "of these, with several sheets"},
      {"held_cells", "held", "cells in which the last resort was taken"},
      {"fanned_edges", "fanned", "crossing edges that became four triangles or more"},
      {"escaped", "escaped", "points outside their cells"},
      {"digest", "digest", "of the mesh's arrays: the first 16 digits of their SHA-256"}};
  std::ranges::copy(solid_columns(), std::back_inserter(columns));
  return columns;
}

std::vector<MeasuredColumn> guarantee_overview_columns() {
  const std::string defects =
      ": edges and vertices that are open, not manifold or inconsistent; and self-intersecting pairs of "
      "triangles";
  return {
      {"resolution", "res.", "voxels along the longest side; of patterns, how many along a side"},
      {"meshes", "meshes", "one a tolerance, 0 among them"},
      {"violations", "broken", "promises that they break"},
      {"uniform", "uniform", "triangles at tolerance 0, a quad counting as two"},
      {"adaptive", "at 1", "triangles at a tolerance of 1 voxel"},
      {"excess", "excess [vx]",
       "the largest certified bound of the distance between uniform and adaptive mesh, either way, less the "
       "tolerance"},
      {"held_percent", "held [%]",
       "cells in which the last resort was taken, of those that the surface passes through"},
      {"seconds", "time [s]", "of all, one run each, Hermite data included"},
      {"digest", "digest",
       "of the digests of these meshes: where two commits have the same, so are the bytes of the meshes, and "
       "what was judged of one holds for the other, as long as files are written alike"},
      {"adaptive-dual-contouring", "adaptive d. c.",
       "adaptive-dual-contouring with threshold 0.1 on float data" + defects},
      {"dual-contouring", "dual contouring", "the same of dual-contouring"},
      {"marching-cubes", "marching cubes", "the same of marching-cubes"},
      {"openvdb", "openvdb 0.1", "the same of openvdb with adaptivity 0.1"}};
}

std::vector<MeasuredColumn> guarantee_summary_columns() {
  return {
      {"tolerance", "tol. [vx]", "0 gives the uniform mesh"},
      {"meshes", "meshes", "made"},
      {"triangles", "triangles", "of all"},
      {"seconds", "time [s]", "of all"},
      {"self_intersections", "crossing", "self-intersecting pairs of all"},
      {"largest_share", "bound", "the largest certified distance over the tolerance"},
      {"beyond", "disproved", "meshes whose bound from below lies beyond the tolerance, by however little"},
      {"violations", "violations",
       "meshes that have a defect, another topology, or lie beyond the tolerance"}};
}

}  // namespace hermesh
