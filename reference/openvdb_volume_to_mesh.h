// OpenVDB's own dual extraction: openvdb::tools::VolumeToMesh (Mihai Aldén; the production descendant of the
// thesis). One vertex per surface sheet and cell at the mean of the edge crossings; with adaptivity, cells of
// a leaf that are nearly flat share a vertex.
#pragma once

#include "algorithms/core/variant.h"

namespace hermesh {

/// Option `adaptivity`, 0 to 1. Normals point to values above the isovalue, whatever class the grid says it
/// is of. Points are relative to choose_origin() of the box of active voxels. The work cannot be interrupted
/// while it runs; cancellation is seen before and after. @throws Cancelled
PolygonMesh openvdb_volume_to_mesh(const ExtractionInput& input);

}  // namespace hermesh
