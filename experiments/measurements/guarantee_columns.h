// What the columns of the measurement `guarantee` mean.
#pragma once

#include <vector>

#include "experiments/measurements/measurements.h"

namespace hermesh {

std::vector<MeasuredColumn> guarantee_mesh_columns();
std::vector<MeasuredColumn> guarantee_overview_columns();
std::vector<MeasuredColumn> guarantee_summary_columns();

}  // namespace hermesh
