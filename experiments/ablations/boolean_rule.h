// The measurement of eq. 7.1 against the rule of signs, for the table of measurements.
#pragma once

#include "experiments/harness/measurement.h"

namespace hermesh {

Measurement boolean_rule_measurement();

}  // namespace hermesh
