#include "experiments/cli/pipeline/json_report.h"

#include <sstream>

#include "experiments/cli/process_for_tests.h"

namespace hermesh::cli {
namespace {

using Json = nlohmann::json;

const std::vector<std::string> kKeys = {"command",   "program",   "input",   "inputs",        "output",
                                        "status",    "exit_code", "error",   "seconds",       "result",
                                        "triangles", "notes",     "figures", "stage_seconds", "peak_bytes"};

class JsonReportTest : public ProgramTest {
 protected:
  JsonReportTest() { write_sphere(); }
  Json object_of(std::vector<std::string> arguments, int exit_code = 0) {
    arguments.push_back("--json");
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, exit_code) << outcome.err;
    const Json json = Json::parse(outcome.out, nullptr, false);
    EXPECT_TRUE(json.is_object()) << arguments[0] << ": " << outcome.out;
    for (const std::string& key : kKeys) EXPECT_TRUE(json.contains(key)) << arguments[0] << " lacks " << key;
    EXPECT_EQ(json.at("command"), arguments[0]);
    EXPECT_EQ(json.at("exit_code"), exit_code);
    return json;
  }
};

TEST_F(JsonReportTest, AllCommandsThatWorkHaveTheSameKeys) {
  const Json remeshed =
      object_of({"remesh", "sphere.off", "out.ply", "--voxel-size", "0.1", "--extractor", "marching-cubes"});
  EXPECT_EQ(remeshed.at("status"), "done");
  EXPECT_EQ(remeshed.at("input"), "sphere.off");
  EXPECT_EQ(remeshed.at("output"), "out.ply");
  EXPECT_TRUE(remeshed.at("error").is_null());
  EXPECT_EQ(remeshed.at("result").at("voxel_size"), 0.1);
  EXPECT_GT(remeshed.at("peak_bytes"), 1 << 20);
  EXPECT_FALSE(remeshed.at("stage_seconds").empty());
  const Json voxelized =
      object_of({"voxelize", "sphere.off", "out.vdb", "--voxel-size", "0.1", "--grids", "sdf,fog"});
  EXPECT_EQ(voxelized.at("result").at("grids"), Json({"sdf", "fog"}));
  EXPECT_EQ(voxelized.at("result").at("voxels"), remeshed.at("result").at("voxels"));
  EXPECT_TRUE(voxelized.at("triangles").is_null());
  const Json extracted =
      object_of({"extract", "out.vdb", "out.obj", "--grid-name", "sdf", "--extractor", "marching-cubes"});
  EXPECT_EQ(extracted.at("triangles"), remeshed.at("triangles"));
  const Json info = object_of({"info", "out.ply"});
  EXPECT_EQ(info.at("triangles"), remeshed.at("triangles"));
  const Json grids = object_of({"info", "out.vdb"});
  EXPECT_EQ(grids.at("result").at("grids").size(), 2u);
  const Json combined =
      object_of({"combine", "union", "sphere.off", "out.ply", "both.ply", "--voxel-size", "0.2", "--judge"});
  EXPECT_EQ(combined.at("inputs"), Json({"sphere.off", "out.ply"}));
  EXPECT_EQ(combined.at("result").at("promises_kept"), true);
  const Json broken = object_of({"fracture", "sphere.off", "pieces", "--voxel-size", "0.2", "--cutters",
                                 "planes:1,0,0,0", "--no-picture", "--judge"});
  EXPECT_EQ(broken.at("result").at("pieces"), 2);
  EXPECT_EQ(broken.at("result").at("books_balance"), true);
  write("samples.raw", std::string(4 * 4 * 4, '\x01'));
  const Json imported = object_of(
      {"import", "samples.raw", "i.vdb", "--dims", "4,4,4", "--type", "uint8", "--spacing", "1,1,1"});
  EXPECT_EQ(imported.at("result").at("samples"), Json({4, 4, 4}));
  const Json judged = object_of({"validate", "out.ply"});
  EXPECT_EQ(judged.at("boundary_edges"), 0);
  EXPECT_EQ(judged.at("mesh"), "out.ply");
  object_of({"doctor"});
}

TEST_F(JsonReportTest, AFailureIsAnObjectToo) {
  const Json failed = object_of({"remesh", "none.off", "out.ply", "--voxel-size", "0.1"}, 1);
  EXPECT_EQ(failed.at("status"), "failed");
  EXPECT_NE(failed.at("error").get<std::string>().find("none.off"), std::string::npos);
  EXPECT_TRUE(failed.at("triangles").is_null());
  write("triangle.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
  EXPECT_EQ(object_of({"validate", "triangle.off", "--require", "closed"}, 3).at("status"), "not met");
}

TEST_F(JsonReportTest, GoesIntoAFileBesideTheSummaries) {
  const Outcome outcome =
      run({"remesh", "sphere.off", "out.ply", "--voxel-size", "0.1", "--json", "report.json"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("extracted"), std::string::npos) << outcome.out;
  EXPECT_EQ(Json::parse(read("report.json")).at("status"), "done");
  EXPECT_EQ(run({"remesh", "sphere.off", "-", "--voxel-size", "0.1", "--json=second.json", "--quiet"})
                .out.substr(0, 3),
            "ply");
  EXPECT_EQ(Json::parse(read("second.json")).at("output"), "-");
  EXPECT_EQ(
      run({"remesh", "sphere.off", "out.ply", "--voxel-size", "0.1", "--json", "none/report.json"}).exit_code,
      1);
}

TEST_F(JsonReportTest, AFileThatEndsOtherwiseIsToldHowToBeNamed) {
  write_cube();
  const Outcome outcome = run({"validate", "cube.off", "--json", "summary.txt"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_NE(outcome.err.find("write --json='summary.txt'"), std::string::npos) << outcome.err;
  EXPECT_EQ(run({"validate", "cube.off", "--json=summary.txt"}).exit_code, 0);
  EXPECT_EQ(Json::parse(read("summary.txt")).at("status"), "done");
  // What is an input stays one.
  EXPECT_EQ(run({"validate", "--json", "cube.off"}).exit_code, 0);
}

using OptionsTest = JsonReportTest;

TEST_F(OptionsTest, ScaleIsAFactorToWorldUnits) {
  // Halves are exact, so that the bytes of a file with halved numbers are those of the scaled one.
  write_cube();
  const std::string numbers[] = {"-1 -1 -1", "1 -1 -1", "1 1 -1", "-1 1 -1",
                                 "-1 -1 1",  "1 -1 1",  "1 1 1",  "-1 1 1"};
  std::string text = "OFF\n8 12 0\n";
  for (std::string line : numbers) {
    for (std::size_t at = 0; (at = line.find('1', at)) != std::string::npos; at += 3)
      line.replace(at, 1, "0.5");
    text += line + "\n";
  }
  write("half.off", text + read("cube.off").substr(read("cube.off").find("3 0 2 1")));
  ASSERT_EQ(run({"remesh", "half.off", "a.ply", "--voxel-size", "0.09"}).exit_code, 0);
  ASSERT_EQ(run({"remesh", "cube.off", "b.ply", "--voxel-size", "0.09", "--scale", "0.5"}).exit_code, 0);
  EXPECT_EQ(read("a.ply"), read("b.ply"));
  ASSERT_EQ(run({"voxelize", "cube.off", "mm.vdb", "--voxel-size", "0.0002", "--units", "mm"}).exit_code, 0);
  const Json grid = Json::parse(run({"info", "mm.vdb", "--json"}).out).at("result").at("grids").at(0);
  EXPECT_NEAR(grid.at("voxel_size").at(0), 0.0002, 1e-12);
  // A side of 2 mm is 10 voxels, and the band 3 more on both sides.
  EXPECT_NEAR(grid.at("upper").at(0).get<double>() - grid.at("lower").at(0).get<double>(), 15.0, 1.5);
  EXPECT_EQ(run({"remesh", "cube.off", "c.ply", "--voxel-size", "1", "--scale", "0"}).exit_code, 2);
  EXPECT_EQ(
      run({"remesh", "cube.off", "c.ply", "--voxel-size", "1", "--scale", "2", "--units", "mm"}).exit_code,
      2);
  EXPECT_EQ(run({"extract", "mm.vdb", "c.ply", "--scale", "2"}).exit_code, 2) << "a volume has its transform";
}

TEST_F(OptionsTest, MeshesAreWrittenGzipped) {
  ASSERT_EQ(run({"remesh", "sphere.off", "out.ply", "--voxel-size", "0.1"}).exit_code, 0);
  ASSERT_EQ(run({"remesh", "sphere.off", "out.ply.gz", "--voxel-size", "0.1"}).exit_code, 0);
  EXPECT_EQ(run_shell("gunzip -c out.ply.gz | cmp - out.ply").exit_code, 0);
  EXPECT_LT(read("out.ply.gz").size(), read("out.ply").size());
}

TEST_F(OptionsTest, AGridIsChosenByName) {
  ASSERT_EQ(run({"voxelize", "sphere.off", "two.vdb", "--voxel-size", "0.1", "--grids", "fog,udf"}).exit_code,
            0);
  const Outcome several = run({"extract", "two.vdb", "out.ply"});
  EXPECT_EQ(several.exit_code, 1);
  for (const char* word : {"fog", "udf", "--grid"})
    EXPECT_NE(several.err.find(word), std::string::npos) << several.err;
  const Outcome none = run({"extract", "two.vdb", "out.ply", "--grid-name", "surface"});
  EXPECT_EQ(none.exit_code, 1);
  for (const char* word : {"fog", "udf", "surface"})
    EXPECT_NE(none.err.find(word), std::string::npos) << none.err;
  EXPECT_EQ(run({"extract", "two.vdb", "out.ply", "--grid-name", "fog", "--isovalue", "0.5"}).exit_code, 0);
  EXPECT_EQ(run({"extract", "two.vdb", "same.ply", "--grid", "fog", "--isovalue", "0.5"}).exit_code, 0);
  EXPECT_EQ(read("same.ply"), read("out.ply"));
}

TEST_F(OptionsTest, ALogHasStagesNotesAndSummariesWithTimes) {
  write_open_cube();
  ASSERT_EQ(
      run({"remesh", "open.off", "out.stl", "--voxel-size", "0.13", "--log", "log", "--quiet"}).exit_code, 0);
  ASSERT_EQ(run({"validate", "none.off", "--log", "log"}).exit_code, 1);
  std::istringstream lines(read("log"));
  std::size_t count = 0;
  for (std::string line; std::getline(lines, line); ++count) {
    ASSERT_GT(line.size(), 26u);
    EXPECT_EQ(line.substr(0, 2) + line[10] + line[13] + line[23] + line[24], "20T:Z ") << line;
  }
  EXPECT_GT(count, 10u);
  for (const char* text :
       {"remesh open.off out.stl", "stage 'distances'", "end of stage 'distances'",
        "note: the polygons have holes", "extracted ", "ended with exit code 0", "failed: ", "none.off"})
    EXPECT_NE(read("log").find(text), std::string::npos) << text << '\n' << read("log");
  EXPECT_EQ(run({"remesh", "sphere.off", "out.stl", "--voxel-size", "0.1", "--log", "none/log"}).exit_code,
            1);
}

TEST_F(OptionsTest, ProgressIsOneFigureForAllStages) {
  const std::string sent = terminal_output({"remesh", "sphere.off", "out.ply", "--resolution", "150"});
  double before = -1.0;
  std::size_t figures = 0;
  for (std::size_t at = 0; (at = sent.find(" %", at)) != std::string::npos; ++at, ++figures) {
    const double percent = std::stod(sent.substr(at - 3, 3));
    EXPECT_GE(percent, before) << sent;
    before = percent;
  }
  EXPECT_GE(figures, 3u) << sent;
}

}  // namespace
}  // namespace hermesh::cli
