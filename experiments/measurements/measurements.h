// Measurements: experiments that are no race of variants over cases, but tables of figures that one function
// makes (errors of a code, bytes of a data structure, the rate of an operation).
//
// To add one:
//   1. In experiments/measurements/measure_NAME.cpp write a function from MeasurementInput to rows, and below
//   it
//      `Measurement NAME_measurement()`: the name, the parameters with their defaults and ranges, the tables
//      with what their columns mean, and that function. Add the file to experiments/CMakeLists.txt.
//   2. Declare it at the end of this header, and enter it in the table in measurements.cpp.
//   3. Write experiments/questions/thesis/NAME.toml, or in the folder of another subject; normal_codes.toml
//   explains the keys.
// For that it gets rows with commit, machine, seed and parameters, `hermesh run`, `hermesh report` in all its
// formats, and the plots that its file asks for.
#pragma once

#include <span>

#include "experiments/harness/measurement.h"

namespace hermesh {

/// The table of measurements.
std::span<const Measurement> all_measurements();

// Those that there are, each in its measure_….cpp.

Measurement normal_codes_measurement();
Measurement lost_crossings_measurement();
Measurement bounded_measurement();
Measurement hermite_memory_measurement();
Measurement hermite_csg_measurement();
Measurement hermite_speed_measurement();
Measurement table_9_2_measurement();
Measurement tables_9_3_and_9_4_measurement();
Measurement volumes_measurement();
Measurement guarantee_measurement();
Measurement fracture_measurement();
Measurement fracture_speed_measurement();
Measurement fracture_guarantee_measurement();
Measurement digests_measurement();
Measurement figure_9_1_measurement();
Measurement figure_9_3_measurement();
Measurement figure_9_4_measurement();
Measurement figure_9_6_measurement();
Measurement threads_measurement();
Measurement sampling_measurement();
Measurement arithmetic_measurement();
Measurement surface_noise_measurement();

}  // namespace hermesh
