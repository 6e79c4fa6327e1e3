
#include <sstream>

#include "experiments/cli/process_for_tests.h"

namespace hermesh::cli {
namespace json_report_test {

using Json = nlohmann::json;

const Words kKeys =
    "command program input inputs output status exit_code error seconds result triangles notes figures "
    "stage_seconds peak_bytes";

class JsonReportTest : public ProgramTest {
 protected:
  JsonReportTest() { write_sphere(); }
  Json object_of(Words arguments, int exit_code = 0) {
    arguments.push_back("--json");
    const Outcome outcome = run_to(exit_code, arguments);
    const Json json = Json::parse(outcome.out, nullptr, false);
    EXPECT_TRUE(json.is_object()) << arguments[0] << ": " << outcome.out;
    for (const std::string& key : kKeys) EXPECT_TRUE(json.contains(key)) << arguments[0] << " lacks " << key;
    EXPECT_EQ(json.at("command"), arguments[0]);
    EXPECT_EQ(json.at("exit_code"), exit_code);
    return json;
  }
};

TEST_F(JsonReportTest, AllCommandsThatWorkHaveTheSameKeys) {
  const Json remeshed = object_of("remesh sphere.off out.ply --voxel-size 0.1 --extractor marching-cubes");
  EXPECT_EQ(remeshed.at("status"), "done");
  EXPECT_EQ(remeshed.at("input"), "sphere.off");
  EXPECT_EQ(remeshed.at("output"), "out.ply");
  EXPECT_TRUE(remeshed.at("error").is_null());
  EXPECT_EQ(remeshed.at("result").at("voxel_size"), 0.1);
  EXPECT_GT(remeshed.at("peak_bytes"), 1 << 20);
  EXPECT_FALSE(remeshed.at("stage_seconds").empty());
  const Json voxelized = object_of("voxelize sphere.off out.vdb --voxel-size 0.1 --grids sdf,fog");
  EXPECT_EQ(voxelized.at("result").at("grids"), Json({"sdf", "fog"}));
  EXPECT_EQ(voxelized.at("result").at("voxels"), remeshed.at("result").at("voxels"));
  EXPECT_TRUE(voxelized.at("triangles").is_null());
  const Json extracted = object_of("extract out.vdb out.obj --grid-name sdf --extractor marching-cubes");
  EXPECT_EQ(extracted.at("triangles"), remeshed.at("triangles"));
  const Json info = object_of("info out.ply");
  EXPECT_EQ(info.at("triangles"), remeshed.at("triangles"));
  const Json grids = object_of("info out.vdb");
  EXPECT_EQ(grids.at("result").at("grids").size(), 2u);
  const Json combined = object_of("combine union sphere.off out.ply both.ply --voxel-size 0.2 --judge");
  EXPECT_EQ(combined.at("inputs"), Json({"sphere.off", "out.ply"}));
  EXPECT_EQ(combined.at("result").at("promises_kept"), true);
  const Json broken =
      object_of("fracture sphere.off pieces --voxel-size 0.2 --cutters planes:1,0,0,0 --no-picture --judge");
  EXPECT_EQ(broken.at("result").at("pieces"), 2);
  EXPECT_EQ(broken.at("result").at("books_balance"), true);
  write("samples.raw", std::string(4 * 4 * 4, '\x01'));
  const Json imported = object_of("import samples.raw i.vdb --dims 4,4,4 --type uint8 --spacing 1,1,1");
  EXPECT_EQ(imported.at("result").at("samples"), Json({4, 4, 4}));
  const Json judged = object_of("validate out.ply");
  EXPECT_EQ(judged.at("boundary_edges"), 0);
  EXPECT_EQ(judged.at("mesh"), "out.ply");
  object_of({"doctor"});
}

TEST_F(JsonReportTest, AFailureIsAnObjectToo) {
  const Json failed = object_of("remesh none.off out.ply --voxel-size 0.1", 1);
  EXPECT_EQ(failed.at("status"), "failed");
  EXPECT_PRED2(has, failed.at("error").get<std::string>(), "none.off");
  EXPECT_TRUE(failed.at("triangles").is_null());
  write("triangle.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
  EXPECT_EQ(object_of("validate triangle.off --require closed", 3).at("status"), "not met");
}

TEST_F(JsonReportTest, GoesIntoAFileBesideTheSummaries) {
  const Outcome outcome = run_to(0, "remesh sphere.off out.ply --voxel-size 0.1 --json report.json");
  EXPECT_PRED2(has, outcome.out, "extracted");
  EXPECT_EQ(Json::parse(read("report.json")).at("status"), "done");
  EXPECT_EQ(run("remesh sphere.off - --voxel-size 0.1 --json=second.json --quiet").out.substr(0, 3), "ply");
  EXPECT_EQ(Json::parse(read("second.json")).at("output"), "-");
  run_to(1, "remesh sphere.off out.ply --voxel-size 0.1 --json none/report.json");
}

TEST_F(JsonReportTest, AFileThatEndsOtherwiseIsToldHowToBeNamed) {
  write_cube();
  const Outcome outcome = run_to(2, "validate cube.off --json summary.txt");
  EXPECT_PRED2(has, outcome.err, "write --json='summary.txt'");
  run_to(0, "validate cube.off --json=summary.txt");
  EXPECT_EQ(Json::parse(read("summary.txt")).at("status"), "done");
  // An input after --json remains an input.
  run_to(0, "validate --json cube.off");
}

using OptionsTest = JsonReportTest;

TEST_F(OptionsTest, ScaleIsAFactorToWorldUnits) {
  // Halves are exact, so the bytes of a file with halved numbers are those of the scaled one.
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
  run_to(0, "remesh half.off a.ply --voxel-size 0.09");
  run_to(0, "remesh cube.off b.ply --voxel-size 0.09 --scale 0.5");
  EXPECT_EQ(read("a.ply"), read("b.ply"));
  run_to(0, "voxelize cube.off mm.vdb --voxel-size 0.2 --units mm");
  const Json grid = json_of("info mm.vdb --json").at("result").at("grids").at(0);
  EXPECT_NEAR(grid.at("voxel_size").at(0), 0.2, 1e-12);
  // A side of 2 mm is 10 voxels, and the band 3 more on both sides.
  EXPECT_NEAR(grid.at("upper").at(0).get<double>() - grid.at("lower").at(0).get<double>(), 15.0, 1.5);
  run_to(2, "remesh cube.off c.ply --voxel-size 1 --scale 0");
  run_to(2, "extract mm.vdb c.ply --scale 2");  // a volume has its transform
}

TEST_F(OptionsTest, MeshesAreWrittenGzipped) {
  run_to(0, "remesh sphere.off out.ply --voxel-size 0.1");
  run_to(0, "remesh sphere.off out.ply.gz --voxel-size 0.1");
  EXPECT_EQ(run_shell("gunzip -c out.ply.gz | cmp - out.ply").exit_code, 0);
  EXPECT_LT(read("out.ply.gz").size(), read("out.ply").size());
}

TEST_F(OptionsTest, AGridIsChosenByName) {
  run_to(0, "voxelize sphere.off two.vdb --voxel-size 0.1 --grids fog,udf");
  const Outcome several = run_to(1, "extract two.vdb out.ply");
  for (const char* word : {"fog", "udf", "--grid"}) EXPECT_PRED2(has, several.err, word);
  const Outcome none = run_to(1, "extract two.vdb out.ply --grid-name surface");
  for (const char* word : {"fog", "udf", "surface"}) EXPECT_PRED2(has, none.err, word);
  run_to(0, "extract two.vdb out.ply --grid-name fog --isovalue 0.5");
  run_to(0, "extract two.vdb same.ply --grid fog --isovalue 0.5");
  EXPECT_EQ(read("same.ply"), read("out.ply"));
}

TEST_F(OptionsTest, ALogHasStagesNotesAndSummariesWithTimes) {
  write_open_cube();
  run_to(0, "remesh open.off out.stl --voxel-size 0.13 --log log --quiet");
  run_to(1, "validate none.off --log log");
  std::istringstream lines(read("log"));
  std::size_t count = 0;
  for (std::string line; std::getline(lines, line); ++count) {
    ASSERT_GT(line.size(), 26u);
    EXPECT_EQ(line.substr(0, 2) + line[10] + line[13] + line[23] + line[24], "20T:Z ") << line;
  }
  EXPECT_GT(count, 10u);
  for (const char* text : {"remesh open.off out.stl", "stage 'distances'", "end of stage 'distances'",
                           "note: ", "extracted ", "ended with exit code 0", "failed: ", "none.off"})
    EXPECT_PRED2(has, read("log"), text) << text << '\n' << read("log");
  run_to(1, "remesh sphere.off out.stl --voxel-size 0.1 --log none/log");
}

TEST_F(OptionsTest, ProgressIsOneFigureForAllStages) {
  const std::string sent = terminal_output("remesh sphere.off out.ply --resolution 150");
  double before = -1.0;
  std::size_t figures = 0;
  for (std::size_t at = 0; (at = sent.find(" %", at)) != std::string::npos; ++at, ++figures) {
    const double percent = std::stod(sent.substr(at - 3, 3));
    EXPECT_GE(percent, before) << sent;
    before = percent;
  }
  EXPECT_GE(figures, 3u) << sent;
}

}  // namespace json_report_test
}  // namespace hermesh::cli
