// OpenVDB's own dual extraction: openvdb::tools::VolumeToMesh (Mihai Aldén; the production descendant of the
// thesis). One vertex per surface sheet and cell at the mean of the edge crossings; with adaptivity, cells of
// a leaf that are nearly flat share a vertex.
#pragma once

#include "algorithms/core/variant.h"

namespace hermesh {

/// Extracts by VolumeToMesh. Option: `adaptivity`, 0 to 1. The inside is that of MeshingFrame, regardless of
/// OpenVDB's interpretation of the grid's class. Points are relative to choose_origin() of the box of active
/// voxels. The work cannot be interrupted while it runs; cancellation is checked before and after. @throws
/// Cancelled; Error for a volume with values that are not finite.
PolygonMesh openvdb_volume_to_mesh(const ExtractionInput& input);

}  // namespace hermesh
