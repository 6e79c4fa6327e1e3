// Measurements: experiments that one function makes as tables of values (errors of a code, bytes of a data
// structure, the rate of an operation), without methods that compete over cases.
//
// To add one:
//   1. Write its function in experiments/measurements/measure_NAME.cpp, and add the file to
//      experiments/CMakeLists.txt.
//   2. Declare the function here and add it to the table in measurements.cpp.
//   3. Describe its parameters and tables in experiments/measurements.toml.
//   4. Write experiments/questions/thesis/NAME.toml, or in the directory of another subject;
//      normal_codes.toml explains the keys.
// Its rows then have commit, machine, seed and parameters, and `hermesh run` and `hermesh report` take it.
#pragma once

#include <span>

#include "algorithms/hermite/sparse_hermite.h"
#include "experiments/harness/cell.h"

namespace hermesh {

/// Returns the measurements of experiments/measurements.toml.
std::span<const Measurement> all_measurements();

using Measure = std::vector<MeasuredRow>(const MeasurementInput& input);

/// Returns the data moved by a tenth of their length along x, by whole leaves and so on the same lattice.
PackedHermite shifted(PackedHermite hermite);

Measure measure_normal_codes, measure_lost_crossings, measure_bounded, measure_hermite_memory,
    measure_hermite_csg, measure_hermite_speed, measure_table_9_2, measure_tables_9_3_and_9_4,
    measure_volumes, measure_guarantee, measure_fracture, measure_fracture_speed, measure_fracture_guarantee,
    measure_digests, measure_figure_9_1, measure_figure_9_3, measure_figure_9_4, measure_figure_9_6,
    measure_threads, measure_sampling, measure_surface_noise, measure_order, measure_arithmetic,
    measure_boolean_rule;

}  // namespace hermesh
