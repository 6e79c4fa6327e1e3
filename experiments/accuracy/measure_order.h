// Orders of accuracy of extractors, voxelizers and codes of normals on shapes whose truth is known.
#pragma once

#include "experiments/harness/measurement.h"

namespace hermesh {

/// The measurement "order".
Measurement order_measurement();

}  // namespace hermesh
