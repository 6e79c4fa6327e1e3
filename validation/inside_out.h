// Whether the closed components of a mesh face outwards.
#pragma once

#include "algorithms/core/run_context.h"
#include "validation/geometry/triangle_soup.h"
#include "validation/geometry/triangle_tree.h"
#include "validation/mesh_report.h"

namespace hermesh::validation {

/// Counts the components of a closed, oriented mesh that have negative volume and do not lie within a
/// component that faces outwards, so that they are no cavities. Fills in `inside_out_components` and
/// `inside_out_places`; leaves them unchanged if the report's mesh is not closed or not oriented. @throws
/// Cancelled
void count_inside_out(const TriangleSoup& soup, const TriangleTree& tree, MeshReport& report,
                      const RunContext& context);

}  // namespace hermesh::validation
