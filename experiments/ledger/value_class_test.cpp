#include "experiments/ledger/value_class.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace hermesh {
namespace {

Column column(const std::string& name, const std::string& header) {
  return {name, header, "", "/values/" + name};
}

ValueClass class_alone(const std::string& name, const std::string& header, const Json& value) {
  return class_of(column(name, header), value, {{"values", {{name, value}}}});
}

TEST(ValueClassOf, CommonColumns) {
  std::map<std::string, ValueClass> expected = {{"points", ValueClass::kExact},
                                                {"to_rms", ValueClass::kError},
                                                {"seconds", ValueClass::kTime},
                                                {"voxelize_seconds", ValueClass::kTime},
                                                {"peak_mib", ValueClass::kMemory},
                                                {"voxelize_peak_mib", ValueClass::kMemory},
                                                {"time_over_openvdb", ValueClass::kDerived},
                                                {"ns_per_voxel", ValueClass::kDerived},
                                                {"cpu_seconds", ValueClass::kDerived},
                                                {"peak_over_openvdb", ValueClass::kDerived},
                                                {"repetitions", ValueClass::kDerived},
                                                {"judge_seconds", ValueClass::kDerived},
                                                {"published_seconds", ValueClass::kExact},
                                                {"smallest_angle", ValueClass::kError},
                                                {"bytes_per_voxel", ValueClass::kDerived},
                                                {"openvdb_over_time", ValueClass::kDerived},
                                                {"seconds_min", ValueClass::kDerived},
                                                {"peak_over_allowed", ValueClass::kDerived},
                                                {"ns_per_triangle", ValueClass::kDerived},
                                                {"cpu_us_per_triangle", ValueClass::kDerived},
                                                {"grid_mib", ValueClass::kError}};
  const std::vector<std::string> whole = {"points"};
  std::size_t seen = 0;
  for (const Column& each : all_columns()) {
    const auto found = expected.find(each.name);
    if (found == expected.end()) continue;
    ++seen;
    const Json value = each.name == "points" ? Json(3) : Json(0.5);
    EXPECT_EQ(class_of(each, value, {}), found->second)
        << each.name << " is " << name(class_of(each, value, {}));
  }
  EXPECT_EQ(seen, expected.size());
}

TEST(ValueClassOf, ColumnsOfMeasurements) {
  EXPECT_EQ(class_alone("mean", "mean [°]", 1.3), ValueClass::kError);
  EXPECT_EQ(class_alone("codes", "codes", 64008), ValueClass::kExact);
  EXPECT_EQ(class_alone("closed", "closed", true), ValueClass::kExact);
  EXPECT_EQ(class_alone("digest", "digest", "9af1"), ValueClass::kExact);
  EXPECT_EQ(class_alone("pack", "pack [ns]", 1.2), ValueClass::kTime);
  EXPECT_EQ(class_alone("csg", "CSG [ms]", "3 and 4"), ValueClass::kTime);
  EXPECT_EQ(class_alone("speedup", "speedup", 1.7), ValueClass::kDerived);
  EXPECT_EQ(class_alone("gigabytes", "GB/s", 9.0), ValueClass::kDerived);
  EXPECT_EQ(class_alone("ratio", "times as fast", 9.0), ValueClass::kDerived);
  EXPECT_EQ(class_alone("labelled_least", "least", 9.0), ValueClass::kDerived);
  EXPECT_EQ(class_alone("resident", "resident [MiB]", 3.5), ValueClass::kMemory);
  EXPECT_EQ(class_alone("leaf", "B/leaf", 3.5), ValueClass::kError);
  EXPECT_EQ(class_alone("printed_seconds", "printed [s]", 2.3), ValueClass::kExact);
  EXPECT_EQ(class_alone("expected_max", "expected max [°]", 2.56), ValueClass::kExact);
}

TEST(ValueClassOf, ASlopeNeedsItsInterval) {
  const Json with = {{"values", {{"slope", 2.0}, {"slope_low", 1.9}, {"slope_high", 2.1}}}};
  const Json without = {{"values", {{"slope", 2.0}, {"slope_low", 1.9}}}};
  EXPECT_EQ(class_of(column("slope", "slope"), 2.0, with), ValueClass::kSlope);
  EXPECT_EQ(class_of(column("slope_low", "from"), 1.9, with), ValueClass::kDerived);
  EXPECT_EQ(class_of(column("slope", "slope"), 2.0, without), ValueClass::kError);
  EXPECT_EQ(class_alone("order", "order", 1.0), ValueClass::kError);
}

TEST(ValueClassOf, ErrorsAreWorseIfLarger) {
  EXPECT_EQ(worse_of(column("to_rms", "to rms [vx]")), Worse::kLarger);
  EXPECT_EQ(worse_of(column("p99", "99 % [°]")), Worse::kLarger);
  EXPECT_EQ(worse_of(column("wrong_share", "wrong share")), Worse::kLarger);
  EXPECT_EQ(worse_of(column("leaf", "B/leaf")), Worse::kLarger);
  EXPECT_EQ(worse_of(column("smallest_angle", "angle [°]")), Worse::kSmaller);
  EXPECT_EQ(worse_of(column("held_percent", "held [%]")), Worse::kSmaller);
  EXPECT_EQ(worse_of(column("volume", "volume [vx³]")), Worse::kEither);
}

TEST(ValueClassOf, CountsAreWholeAndHaveNoUnit) {
  EXPECT_TRUE(is_count(column("escaped", "escaped"), 12.0));
  EXPECT_FALSE(is_count(column("escaped", "escaped"), 12.5));
  EXPECT_FALSE(is_count(column("escaped", "escaped"), 0.0));
  EXPECT_FALSE(is_count(column("max", "max [vx]"), 12.0));
}

}  // namespace
}  // namespace hermesh
