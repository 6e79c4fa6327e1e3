#include "experiments/measurements/measurements.h"

#include "experiments/ablations/boolean_rule.h"
#include "experiments/accuracy/measure_order.h"

namespace hermesh {

std::span<const Measurement> all_measurements() {
  static const std::vector<Measurement> table = {normal_codes_measurement(),
                                                 lost_crossings_measurement(),
                                                 bounded_measurement(),
                                                 hermite_memory_measurement(),
                                                 hermite_csg_measurement(),
                                                 hermite_speed_measurement(),
                                                 table_9_2_measurement(),
                                                 tables_9_3_and_9_4_measurement(),
                                                 volumes_measurement(),
                                                 guarantee_measurement(),
                                                 fracture_measurement(),
                                                 fracture_speed_measurement(),
                                                 fracture_guarantee_measurement(),
                                                 digests_measurement(),
                                                 figure_9_1_measurement(),
                                                 figure_9_3_measurement(),
                                                 figure_9_4_measurement(),
                                                 figure_9_6_measurement(),
                                                 threads_measurement(),
                                                 sampling_measurement(),
                                                 surface_noise_measurement(),
                                                 order_measurement(),
                                                 arithmetic_measurement(),
                                                 boolean_rule_measurement()};
  return table;
}

}  // namespace hermesh
