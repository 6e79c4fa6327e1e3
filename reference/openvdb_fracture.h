// OpenVDB's own fracture: openvdb::tools::LevelSetFracture (Mihai Aldén; the production descendant of the
// thesis's chapter 7) on level sets, and openvdb::tools::VolumeToMesh with the whole object as its reference
// surface.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "algorithms/core/level_set.h"
#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"

namespace hermesh {

struct OpenvdbFragment {
  std::string name;
  PolygonMesh
      mesh;  ///< has the polygon attribute `surface`: 1 where OpenVDB does not flag the polygon as exterior
  double conversion_seconds = 0.0, csg_seconds = 0.0, extraction_seconds = 0.0;
  std::optional<std::size_t> cutter = {};  ///< the cutter that took the fragment; none for the remainder
};

/// A function that makes cutter k, with the object's origin and unit of length. It is called once for each
/// cutter, in order.
using OpenvdbCutter = std::function<PolygonMesh(std::size_t)>;

/// Breaks the object by one cutter after the other: each is voxelized by openvdb_mesh_to_volume() on the
/// object's lattice and takes its share of the remainder. Fragments are meshed at the end with `adaptivity` 0
/// to 1 and all have the object's origin. A cutter without polygons is skipped. @throws Error for a lattice
/// that is rotated or scaled unevenly; Cancelled.
void openvdb_fracture(const LevelSet& object, std::size_t cutters, const OpenvdbCutter& cutter,
                      double adaptivity, const std::function<void(OpenvdbFragment&&)>& hand_over,
                      RunContext& context);

}  // namespace hermesh
