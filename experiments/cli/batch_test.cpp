#include "experiments/cli/batch.h"

#include <signal.h>

#include <algorithm>
#include <sstream>

#include "experiments/cli/process_for_tests.h"

namespace hermesh::cli {
namespace batch_test {

using Json = nlohmann::json;

TEST(OutputName, FillsThePattern) {
  EXPECT_EQ(output_name("{stem}.ply", "scans/a.b.stl.gz", 1, 9), "a.b.ply");
  EXPECT_EQ(output_name("{number}-{name}.obj", "scans/a.stl", 7, 120), "007-a.stl.obj");
  for (const char* pattern : {"{stam}.ply", "{stem", "x/{stem}.ply", "{}.ply"})
    EXPECT_THROW(output_name(pattern, "a.stl", 1, 1), UsageError) << pattern;
}

TEST(BatchItems, NeverWriteOverOneAnother) {
  const std::vector<BatchItem> items = batch_items({"x/a.stl", "x/b.obj"}, "out", "{stem}.ply");
  ASSERT_EQ(items.size(), 2u);
  EXPECT_EQ(items[1].input, "x/b.obj");
  EXPECT_EQ(items[1].output, "out/b.ply");
  EXPECT_THROW(batch_items({"x/a.stl", "y/a.obj"}, "out", "{stem}.ply"), UsageError) << "one name for two";
  EXPECT_NO_THROW(batch_items({"x/a.stl", "y/a.obj"}, "out", "{number}-{stem}.ply"));
  EXPECT_THROW(batch_items({"out/a.ply"}, "x/../out", "{stem}.ply"), UsageError) << "an input";
  EXPECT_THROW(batch_items({"a.stl", "./a.stl"}, "out", "{number}.ply"), UsageError) << "named twice";
  EXPECT_THROW(batch_items({"-", "a.stl"}, "out", "{stem}.ply"), UsageError);
}

class BatchTest : public ProgramTest {
 protected:
  /// Spheres s1.off and s2.off, a cube, and two invalid meshes.
  BatchTest() {
    write_sphere();
    write_cube();
    for (const char* copy : {"s1.off", "s2.off"}) std::filesystem::copy_file(path("sphere.off"), path(copy));
    write("bad1.ply", "ply\nformat ascii 1.0\n");
    write("bad2.stl", "");
  }
  std::vector<Json> lines(const std::string& file) const {
    std::vector<Json> all;
    std::istringstream stream(read(file));
    for (std::string line; std::getline(stream, line);) all.push_back(Json::parse(line));
    return all;
  }
};

TEST_F(BatchTest, GoesOnAfterFailuresAndTellsOfEachInASentence) {
  const Outcome outcome = run_to(1,
                                 "remesh s1.off bad1.ply s2.off bad2.stl cube.off missing.obj --out-dir "
                                 "clean --voxel-size 0.1 --json summary.jsonl --jobs 2");
  EXPECT_TRUE(outcome.out.ends_with("3 of 6 done, 3 failed\n")) << outcome.out;
  EXPECT_EQ(count(outcome.err, "hermesh: "), 3u) << outcome.err;
  for (const char* name : {"bad1.ply", "bad2.stl", "missing.obj"})
    EXPECT_EQ(count(outcome.err, name), 1u) << outcome.err;

  const std::vector<Json> all = lines("summary.jsonl");
  ASSERT_EQ(all.size(), 6u);
  std::size_t done = 0;
  for (const Json& line : all) {
    for (const char* key : {"input", "output", "status", "seconds", "triangles", "notes", "error"})
      EXPECT_TRUE(line.contains(key)) << key;
    const std::string input = line.at("input");
    if (line.at("status") == "done") {
      ++done;
      EXPECT_EQ(line.at("output"), "clean/" + input.substr(0, input.find('.')) + ".ply");
      EXPECT_GT(line.at("triangles"), 10);
      EXPECT_TRUE(line.at("error").is_null());
    } else {
      EXPECT_EQ(line.at("status"), "failed");
      EXPECT_PRED2(has, line.at("error").get<std::string>(), input) << line;
    }
  }
  EXPECT_EQ(done, 3u);
  // Each file is the one that the command makes alone.
  run_to(0, "remesh s1.off alone.ply --voxel-size 0.1");
  EXPECT_EQ(read("clean/s1.ply"), read("alone.ply"));
  EXPECT_EQ(read("clean/s2.ply"), read("alone.ply"));
  EXPECT_FALSE(files().contains("clean/bad1.ply"));
}

TEST_F(BatchTest, TakesOptionsPatternsAndOtherCommands) {
  run_to(0, "voxelize s1.off cube.off --out-dir volumes --voxel-size 0.21 --grids sdf");
  run_to(0,
         "extract volumes/s1.vdb volumes/cube.vdb --out-dir meshes --pattern {number}-{stem}.obj --extractor "
         "dual-contouring -o placement=average");
  run_to(0, "extract volumes/cube.vdb alone.obj --extractor dual-contouring -o placement=average");
  EXPECT_EQ(read("meshes/2-cube.obj"), read("alone.obj"));
  run_to(0, "validate meshes/1-s1.obj meshes/2-cube.obj --require closed");
}

TEST_F(BatchTest, ValidatesMany) {
  write("open.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
  const Outcome unmet = run_to(3, "validate cube.off open.off --require closed");
  EXPECT_PRED2(has, unmet.out, "1 of 2 done, 1 did not meet what was required");
  const Outcome failed = run_to(1, "validate cube.off open.off bad1.ply --require closed --json");
  std::istringstream stream(failed.out);
  Words statuses;
  for (std::string line; std::getline(stream, line);) statuses.push_back(Json::parse(line).at("status"));
  EXPECT_EQ(statuses, (Words{"done", "not met", "failed"}));
}

TEST_F(BatchTest, RefusesBeforeWorkBegins) {
  std::filesystem::create_directory(path("sub"));
  std::filesystem::copy_file(path("sphere.off"), path("sub/s1.off"));
  const auto expect = [&](const Words& arguments, const std::string& words) {
    expect_refusal(2, arguments + "--voxel-size 0.1", {words});
  };
  expect("remesh s1.off sub/s1.off --out-dir clean", "would both be written to");
  expect("remesh s1.off s2.off --out-dir . --pattern {name}", "would be overwritten");
  expect("remesh s1.off s2.off s3.off", "--out-dir");
  expect("remesh s1.off", "OUT is required");
  expect("remesh s1.off o.ply --jobs 2", "--jobs has no effect");
  expect("remesh s1.off o.ply --pattern {stem}.obj", "--pattern has no effect");
  // An error of the command line is reported once.
  const Outcome wrong = run_to(2, "remesh s1.off s2.off --out-dir clean --voxel-size 0.1 -o tolerance=many");
  EXPECT_EQ(count(wrong.err, "\n"), 1u) << wrong.err;
  EXPECT_TRUE(std::filesystem::is_empty(path("clean")));
}

TEST_F(BatchTest, CtrlCStopsAllAndLeavesNothingHalfWritten) {
  for (const int signal : {SIGINT, SIGTERM}) {
    std::filesystem::remove_all(path("clean"));
    const Outcome outcome = run("remesh s1.off s2.off sphere.off --out-dir clean --resolution 900 --jobs 2",
                                Interruption{signal, std::chrono::milliseconds(400)});
    EXPECT_EQ(outcome.exit_code, 128 + signal) << outcome.err;
    EXPECT_LT(outcome.seconds, 1.5);
    EXPECT_EQ(outcome.err, "");
    // Hidden names are those of unfinished files.
    EXPECT_TRUE(std::filesystem::is_empty(path("clean")));
  }
}

TEST_F(BatchTest, AProcessThatIsKilledIsOneFailure) {
  const Outcome outcome = run_shell(
      "$H remesh s1.off cube.off --out-dir clean --resolution 900 --json summary.jsonl & p=$!; "
      "kill_child() { until kill -KILL $(cat /proc/$p/task/$p/children) 2> /dev/null; do sleep 0.05; done; "
      "}; "
      "kill_child; sleep 0.3; kill_child; wait $p");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_PRED2(has, outcome.out, "0 of 2 done, 2 failed");
  EXPECT_EQ(count(outcome.err, "for lack of memory"), 2u) << outcome.err;
  const std::vector<Json> all = lines("summary.jsonl");
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all[0].at("status"), "failed");
  EXPECT_EQ(all[0].at("output"), "clean/s1.ply");
}

TEST_F(BatchTest, StatesTheCertifiedDistanceOfEachFile) {
  const Outcome outcome =
      run_to(0, "remesh cube.off s1.off --out-dir clean --error 0.1 --units mm --json near.jsonl");
  EXPECT_EQ(count(outcome.out, "; certified within "), 2u) << outcome.out;
  EXPECT_EQ(count(outcome.out, " mm\n"), 2u) << outcome.out;
  for (const Json& line : lines("near.jsonl"))
    EXPECT_LE(line.at("figures").at("certified_to_polygons"), 0.1) << line;
  EXPECT_EQ(count(run_to(0, "remesh cube.off --out-dir clean --voxel-size 0.1").out, "certified"), 0u);
}

TEST_F(BatchTest, IsQuietAndLogged) {
  const Outcome outcome = run("remesh s1.off bad1.ply --out-dir clean --voxel-size 0.2 --quiet --log log");
  EXPECT_EQ(outcome.out, "");
  EXPECT_EQ(count(outcome.err, "\n"), 1u) << outcome.err;
  EXPECT_PRED2(has, read("log"), "done: s1.off");
  EXPECT_PRED2(has, read("log"), "1 of 2 done, 1 failed");
}

}  // namespace batch_test
}  // namespace hermesh::cli
