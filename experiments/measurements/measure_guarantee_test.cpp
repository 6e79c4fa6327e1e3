#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>

#include "experiments/harness/job.h"
#include "experiments/measurements/measurements.h"
#include "experiments/variants.h"

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
  return run_measurement({.name = "guarantee", .parameters = parameters, .seed = 5, .filter = filter}, tables,
                         context, keep);
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
  const auto overviews = [](const std::map<std::string, std::string>& parameters) {
    std::map<std::string, Json> result;
    for (const Json& row : rows_of(parameters, "noise")) {
      const std::string kind = text_at(row, "/case/name");
      if (kind == "noise" || kind == "summary") result[text_at(row, "/variant/name")] = row["values"];
    }
    return result;
  };
  std::map<std::string, std::string> parameters = kSmall;
  std::map<std::string, Json> judged = overviews(parameters);
  parameters["judge"] = "no";
  std::map<std::string, Json> made = overviews(parameters);
  parameters["tolerances"] = "0.1";
  std::map<std::string, Json> fewer = overviews(parameters);
  for (const char* field : {"uniform 000", "whole 001", "uniform 002", "whole 003"}) {
    EXPECT_EQ(text_at(judged[field], "/digest").size(), 16u) << field;
    EXPECT_EQ(judged[field]["digest"], made[field]["digest"]) << field;
    EXPECT_NE(judged[field]["digest"], fewer[field]["digest"]) << "the mesh with tolerance 1 is missing";
    EXPECT_EQ(number_at(judged[field], "/violations"), 0);
  }
  for (const auto& [name, values] : made)
    EXPECT_FALSE(values.contains("violations")) << "nobody looked: " << name;
}

TEST(GuaranteeMeasurement, ARowIsMadeWhenItsWholeLabelIsAskedFor) {
  std::map<std::string, std::string> parameters = kSmall;
  parameters["extractor"] = "certified-octree";
  parameters["judge"] = "no";
  const std::vector<Json> rows = rows_of(parameters, "patterns/cells 000, octree");
  const bool made = std::ranges::any_of(rows, [](const Json& row) {
    return text_at(row, "/case/name") == "patterns" && text_at(row, "/variant/name") == "cells 000, octree";
  });
  EXPECT_TRUE(made);
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
