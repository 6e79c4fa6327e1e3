// The visible surface of a model that a mesh of it lacks, and the surface that the mesh adds.
#pragma once

#include <cstdint>
#include <optional>

#include "validation/geometry/triangle_soup.h"
#include "validation/mesh_report.h"

namespace hermesh::validation {

/// Measures the loss of visible surface by stratified samples of both surfaces.
///
/// A point of the model is *visible* from a side if two of 16 rays from there leave the model without meeting
/// it. It is *shown* if the mesh has surface that faces the same side within half a voxel, or within a voxel
/// in front of it, as for a thickened thin part. Visible points that are not shown are *lost*: *filled*
/// within the mesh, as in a closed gap, and *vanished* elsewhere. Surface of the mesh with no polygon of the
/// model within a voxel is *invented*, such as the caps of holes.
/// @param model triangles with any defects
/// @param mesh closed and oriented outwards; may be empty
/// @param voxel_size world units, greater than 0
/// @param samples on each surface, at least 1
/// @throws Cancelled
VisibleLoss measure_visible_loss(const TriangleSoup& model, const TriangleSoup& mesh, double voxel_size,
                                 std::int64_t samples, RunContext& context);

}  // namespace hermesh::validation
