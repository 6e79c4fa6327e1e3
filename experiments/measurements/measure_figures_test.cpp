// The measurements behind figures and small claims of the thesis, on inputs whose figures are known.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "experiments/cells/serve.h"

namespace hermesh {
namespace {

/// The rows that a measurement gives with some parameters, as far as the filter leaves them.
std::vector<Json> rows_of(const std::string& measurement,
                          const std::map<std::string, std::string>& parameters, const std::string& filter) {
  RunContext context;
  return run_measurement({.name = measurement, .parameters = parameters, .filter = filter}, all_tables(),
                         context);
}

double value(const Json& row, const std::string& column) { return number_at(row, "/values/" + column); }

void expect_unbroken(const std::vector<Json>& rows) {
  for (const Json& row : rows) EXPECT_FALSE(row.contains("broken") || row.contains("failed")) << row.dump();
}

TEST(ArithmeticMeasurement, CountsTheOperationsOfTheCodeThatIsInUse) {
  const std::vector<Json> rows = rows_of("arithmetic", {}, "operations/");
  ASSERT_EQ(rows.size(), 4u);
  expect_unbroken(rows);
  // Additions, multiplications, divisions, roots, look-ups.
  constexpr double kCounts[4][5] = {{2, 2, 2, 0, 0}, {2, 2, 1, 0, 0}, {2, 3, 0, 0, 1}, {4, 6, 1, 1, 0}};
  for (std::size_t i = 0; i < 4; ++i) {
    const char* const columns[] = {"additions", "multiplications", "divisions", "roots", "lookups"};
    for (std::size_t j = 0; j < 5; ++j)
      EXPECT_EQ(value(rows[i], columns[j]), kCounts[i][j]) << i << columns[j];
  }
  EXPECT_EQ(value(rows[1], "differing"), 0.0);
  EXPECT_EQ(value(rows[2], "tried"), 65'536.0);
}

TEST(ArithmeticMeasurement, AllStoragesFindTheSameNeighbours) {
  const std::vector<Json> rows =
      rows_of("arithmetic", {{"case", "torus"}, {"resolution", "24"}, {"repetitions", "3"}}, "blocks/");
  ASSERT_EQ(rows.size(), 6u);
  expect_unbroken(rows);  // a sum that is not that of the first row breaks it
}

/// §2.4 indexes a grid of 200 × 400 samples by x + 200 y, and says that it has 160 000 elements.
TEST(UniformGrid, TwoHundredTimesFourHundredSamplesAreEightyThousand) {
  std::vector<int> used(160'000, 0);
  for (int y = 0; y < 400; ++y)
    for (int x = 0; x < 200; ++x) ++used.at(std::size_t(x + y * 200));
  EXPECT_TRUE(std::all_of(used.begin(), used.begin() + 80'000, [](int times) { return times == 1; }));
  EXPECT_TRUE(std::all_of(used.begin() + 80'000, used.end(), [](int times) { return times == 0; }));
}

/// The spectrum that the heights were made with is the one that is found in them.
TEST(SurfaceNoiseMeasurement, ThePolygonsHaveTheNoiseThatWasAskedFor) {
  const std::vector<Json> rows = rows_of("surface-noise", {{"width", "64"}, {"pixels", "0"}}, ": polygons");
  ASSERT_EQ(rows.size(), 3u);
  expect_unbroken(rows);
  for (const Json& row : rows) {
    const double noise = value(row, "noise");
    EXPECT_NEAR(value(row, "rms"), noise, 1e-4 * noise);
    EXPECT_NEAR(std::hypot(value(row, "rms_from_4"), value(row, "rms_from_8")), noise, 1e-4 * noise);
    for (const char* band : {"rms_from_2", "rms_from_16", "rms_from_32"})
      EXPECT_LT(value(row, band), 1e-5) << band;
    EXPECT_DOUBLE_EQ(value(row, "noise_kept"), 1.0);
    EXPECT_EQ(value(row, "holes"), 0.0);
  }
}

TEST(SamplingMeasurement, ACubesFacesLoseVoxelsEverywhere) {
  const std::vector<Json> rows =
      rows_of("sampling", {{"resolution", "30"}, {"samples", "500"}}, "turned-cube");
  expect_unbroken(rows);
  ASSERT_FALSE(rows.empty());
  ASSERT_EQ(text_at(rows[0], "/case/name"), "missed");
  EXPECT_EQ(value(rows[0], "creases"), 12.0);
  EXPECT_EQ(value(rows[0], "invented"), 0.0);
  double boundary = 0.0, missed = 0.0;
  std::size_t angles = 0;
  for (const Json& row : rows) {
    if (text_at(row, "/case/name") == "sign-angle") ++angles;
    if (text_at(row, "/case/name") != "where") continue;
    boundary += value(row, "voxels");
    missed += value(row, "missed");
  }
  EXPECT_EQ(boundary, value(rows[0], "boundary")) << "each voxel is in one class of distances";
  EXPECT_EQ(missed, value(rows[0], "missed"));
  EXPECT_GT(missed, 0.0);
  EXPECT_EQ(angles, 12u);
}

TEST(FogMeasurement, DensitiesAreThoseOfTheRamp) {
  const std::vector<Json> rows =
      rows_of("figure-9-3", {{"resolution", "30"}, {"puffs", "2"}, {"spread", "1"}, {"pixels", "0"}}, "");
  ASSERT_EQ(rows.size(), 4u);
  expect_unbroken(rows);
  for (const Json& row : rows) EXPECT_EQ(value(row, "wrong"), 0.0);
  // A ramp inside takes mass away, the more the wider it is; one over both sides about keeps it.
  EXPECT_LT(value(rows[2], "mass"), value(rows[1], "mass"));
  EXPECT_LT(value(rows[1], "mass"), value(rows[0], "mass"));
  EXPECT_LT(value(rows[0], "mass"), value(rows[0], "solid"));
}

TEST(ThreadsMeasurement, ComparesWithOneThread) {
  const std::vector<Json> rows =
      rows_of("threads", {{"case", "torus"}, {"resolution", "30"}, {"repetitions", "1"}},
              "extractors/marching-cubes");
  expect_unbroken(rows);
  ASSERT_FALSE(rows.empty());
  EXPECT_EQ(value(rows.front(), "threads"), 1.0);
  EXPECT_DOUBLE_EQ(value(rows.front(), "speedup"), 1.0);
  EXPECT_EQ(value(rows.back(), "threads"),
            double(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism)));
}

TEST(Slow, TheOracleOfFigure91AgreesWithItself) {
  const std::vector<Json> rows =
      rows_of("figure-9-1", {{"resolution", "20"}, {"pixels", "0"}}, "clean-up/openscad, exact");
  ASSERT_EQ(rows.size(), 1u);
  for (const char* column : {"buried", "missing", "wrong_signs"})
    EXPECT_EQ(value(rows[0], column), 0.0) << column;
  EXPECT_EQ(value(rows[0], "active"), value(rows[0], "active_inside") + value(rows[0], "active_outside"));
}

}  // namespace
}  // namespace hermesh
