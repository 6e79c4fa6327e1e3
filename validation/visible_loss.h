// How much of what can be seen of a model is missing from a mesh that stands for it, and how much the mesh
// adds.
#pragma once

#include <cstdint>
#include <optional>

#include "validation/geometry/triangle_soup.h"
#include "validation/mesh_report.h"

namespace hermesh::validation {

/// Measures the loss of visible surface by stratified samples of both surfaces.
///
/// A place of the model is *visible* from a side if two of 16 rays from there leave the model without meeting
/// it. It is *shown* if the mesh has surface that faces the same side within half a voxel, or within a voxel
/// in front of it, as where a thin part was thickened. What is visible and not shown is *lost*: *filled*
/// where the place lies within the mesh, as in a gap that was closed, and *vanished* elsewhere. Surface of
/// the mesh with no polygon of the model within a voxel is *invented*, such as the caps of holes.
/// @param model triangles with any defects
/// @param mesh closed and oriented outwards; may be empty
/// @param voxel_size world units, greater than 0
/// @param samples on each surface, at least 1
/// @throws Cancelled
VisibleLoss measure_visible_loss(const TriangleSoup& model, const TriangleSoup& mesh, double voxel_size,
                                 std::int64_t samples, RunContext& context);

}  // namespace hermesh::validation
