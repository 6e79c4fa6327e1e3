// hermesh remesh --error and --triangles from the outside.
#include <nlohmann/json.hpp>

#include "experiments/cli/process_for_tests.h"

namespace hermesh::cli {
namespace {

using Json = nlohmann::json;
using CliBoundedTest = ProgramTest;

TEST_F(CliBoundedTest, TheJudgeFindsTheErrorKept) {
  write_sphere();
  const Outcome outcome = run({"remesh", "sphere.off", "out.ply", "--error", "0.5%", "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const Json figures = Json::parse(outcome.out).at("figures");
  const double asked = figures.at("error_asked");
  EXPECT_NEAR(asked, 0.005 * 2.0 * std::sqrt(3.0), 1e-4);
  EXPECT_LE(figures.at("certified_to_polygons").get<double>(), asked);
  EXPECT_LE(figures.at("certified_from_polygons").get<double>(), asked);
  const Outcome judged = run({"validate", "out.ply", "--reference", "sphere.off", "--certify", "--require",
                              "watertight", "--json", "--samples", "20000"});
  ASSERT_EQ(judged.exit_code, 0) << judged.err;
  const Json report = Json::parse(judged.out);
  // The judge's brackets are 1e-4 of the diagonal wide.
  EXPECT_LE(report.at("certified_to_reference").at("lower").get<double>(),
            figures.at("certified_to_polygons").get<double>());
  EXPECT_LE(report.at("certified_from_reference").at("lower").get<double>(),
            figures.at("certified_from_polygons").get<double>());
  EXPECT_LE(report.at("certified_to_reference").at("upper").get<double>(), asked + 4e-4);
}

TEST_F(CliBoundedTest, UnitsSayWhatTheNumbersAre) {
  write_cube();
  // With units the world is in metres.
  const Outcome outcome =
      run({"remesh", "cube.off", "out.ply", "--error", "1mm", "--units", "inch", "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NEAR(Json::parse(outcome.out).at("figures").at("error_asked").get<double>(), 0.001, 1e-9);
}

TEST_F(CliBoundedTest, ABudgetIsKept) {
  write_sphere();
  const Outcome outcome = run({"remesh", "sphere.off", "out.ply", "--triangles", "200", "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const double triangles = Json::parse(outcome.out).at("figures").at("triangles");
  EXPECT_LE(triangles, 200);
  EXPECT_GE(triangles, 100);
}

TEST_F(CliBoundedTest, AHoleIsRefusedAndNothingIsWritten) {
  // A tetrahedron without one of its faces.
  write("open.off", "OFF\n4 3 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n");
  const Outcome outcome = run({"remesh", "open.off", "out.ply", "--error", "1%", "--thin", "drop"});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_NE(outcome.err.find("open.off"), std::string::npos);
  EXPECT_NE(outcome.err.find("hole"), std::string::npos) << outcome.err;
  EXPECT_EQ(files().count("out.ply"), 0u);
  const Outcome shell = run({"remesh", "open.off", "shell.ply", "--error", "1%"});
  EXPECT_EQ(shell.exit_code, 0) << shell.err;
  const Outcome closed = run({"remesh", "open.off", "out.ply", "--error", "1%", "--over-holes"});
  EXPECT_EQ(closed.exit_code, 0) << closed.err;
  EXPECT_NE(closed.err.find("holes"), std::string::npos) << closed.err;
}

TEST_F(CliBoundedTest, WrongUsageIsSaid) {
  write_cube();
  const std::vector<std::vector<std::string>> wrong = {
      {"--error", "0"},
      {"--error", "much"},
      {"--error", "1mm"},
      {"--error", "1parsec", "--units", "mm"},
      {"--error", "1%", "--resolution", "10"},
      {"--error", "1%", "--extractor", "openvdb"},
      {"--error", "1%", "--signs", "unsigned"},
      {"--resolution", "10", "--over-holes"},
  };
  for (const std::vector<std::string>& options : wrong) {
    std::vector<std::string> words = {"remesh", "cube.off", "out.ply"};
    words.insert(words.end(), options.begin(), options.end());
    SCOPED_TRACE(options[0] + " " + options[1]);
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
    EXPECT_EQ(files().count("out.ply"), 0u);
  }
}

}  // namespace
}  // namespace hermesh::cli
