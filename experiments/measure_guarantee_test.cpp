#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>

#include "experiments/experiment_file.h"
#include "experiments/harness.h"
#include "experiments/measurements.h"
#include "experiments/run_cells.h"

namespace hermesh {
namespace {

const std::map<std::string, std::string> kSmall = {
    {"cases", "turned-cube"}, {"resolutions", "30"}, {"noise_sizes", "8"}};

std::vector<Json> rows_of(const std::map<std::string, std::string>& parameters,
                          const std::string& filter = "", const std::atomic<bool>* cancel = nullptr,
                          const std::function<void(const Json&)>& keep = {}) {
  Tables tables;
  tables.extractors = all_extractors();
  tables.voxelizers = all_voxelizers();
  tables.load = load_case;
  tables.measurements = {guarantee_measurement()};
  RunContext context;
  context.cancel = cancel;
  Experiment experiment;
  experiment.measurement = "guarantee";
  experiment.seed = 5;
  Tier tier;
  tier.parameters = parameters;
  return run_measurement(experiment, tier, tables, {}, filter, Json::object(), context, keep);
}

TEST(GuaranteeMeasurement, FindsNoViolation) {
  const std::vector<Json> rows = rows_of(kSmall);
  // Two tolerances and the uniform mesh, and four others, and an overview, of a model, four fields of noise
  // and two of patterns; the sums of the three kinds; and the total.
  ASSERT_EQ(rows.size(), 8u * (1 + 4 + 2) + 7u * 3 + 1);
  std::size_t certified = 0;
  for (const Json& row : rows) {
    EXPECT_FALSE(row.contains("failed")) << row.dump();
    EXPECT_FALSE(row.contains("broken")) << row.dump();
    certified += row["values"].contains("from_upper") && row["values"].contains("to_upper");
  }
  EXPECT_EQ(certified, 2u * (1 + 4 + 2)) << "every adaptive mesh has its bounds";
  EXPECT_EQ(number_at(rows.back(), "/values/meshes"), 3 * (1 + 4 + 2));
  EXPECT_EQ(rows.back()["values"]["violations"], 0);
}

/// What makes a verdict of one commit hold for another: the digests of their meshes, made without the judges.
TEST(GuaranteeMeasurement, DigestsAreThoseOfTheMeshesThatAreJudged) {
  const std::vector<Json> judged = rows_of(kSmall, "noise");
  std::map<std::string, std::string> parameters = kSmall;
  parameters["judge"] = "no";
  const std::vector<Json> made = rows_of(parameters, "noise");
  parameters["tolerances"] = "0.1";
  const std::vector<Json> others = rows_of(parameters, "noise");
  const auto overviews = [](const std::vector<Json>& rows) {
    std::map<std::string, Json> result;
    for (const Json& row : rows)
      if (text_at(row, "/case/name") == "noise") result[text_at(row, "/variant/name")] = row["values"];
    return result;
  };
  ASSERT_EQ(overviews(judged).size(), 4u);
  for (const auto& [name, values] : overviews(judged)) {
    EXPECT_EQ(values["digest"].get<std::string>().size(), 16u);
    EXPECT_EQ(values["digest"], overviews(made)[name]["digest"]) << name;
    EXPECT_NE(values["digest"], overviews(others)[name]["digest"]) << "the mesh with tolerance 1 is missing";
    EXPECT_EQ(values["violations"], 0);
    EXPECT_FALSE(overviews(made)[name].contains("violations")) << "nobody looked";
  }
  EXPECT_FALSE(made.back()["values"].contains("violations"));
}

/// A run of hours that is cut short has kept what it had.
TEST(GuaranteeMeasurement, KeepsRowsThatWereReadyBeforeItWasCancelled) {
  const std::vector<Json> all = rows_of(kSmall, "noise");
  std::atomic<bool> cancel = false;
  std::vector<Json> kept;
  EXPECT_THROW(rows_of(kSmall, "noise", &cancel,
                       [&](const Json& row) {
                         kept.push_back(row);
                         cancel = true;
                       }),
               Cancelled);
  ASSERT_GE(kept.size(), 1u);
  ASSERT_LT(kept.size(), all.size());
  EXPECT_EQ(kept[0]["variant"], all[0]["variant"]);
}

TEST(GuaranteeMeasurement, SeesTheDefectsOfThoseThatPromiseLess) {
  std::int64_t defects = 0;
  for (const Json& row : rows_of(kSmall, "uniform"))
    if (text_at(row, "/values/extractor") == "dual-contouring")
      defects += std::int64_t(number_at(row, "/values/non_manifold_edges")) +
                 std::int64_t(number_at(row, "/values/self_intersections"));
  EXPECT_GT(defects, 0);
}

}  // namespace
}  // namespace hermesh
