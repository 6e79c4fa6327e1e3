// What the program does to the files and streams around it: nothing is overwritten, followed or waited for
// that the user did not ask for.
#include <fcntl.h>
#include <pty.h>
#include <unistd.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <thread>

#include "experiments/cli/process_for_tests.h"
#include "experiments/cli/terminal_progress.h"

namespace hermesh::cli {
namespace {

using Json = nlohmann::json;
using Arguments = std::vector<std::string>;

class SurroundingsTest : public ProgramTest {
 protected:
  /// Expects that the command is wrong usage and changes no file.
  void expect_usage_error(const Arguments& arguments) {
    const std::set<std::string> before = files();
    const std::string sphere = read("sphere.off"), cube = read("cube.off");
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, 2) << outcome.out << outcome.err;
    EXPECT_EQ(files(), before);
    EXPECT_TRUE(read("sphere.off") == sphere && read("cube.off") == cube);
  }
};

TEST_F(SurroundingsTest, ClosedStreamsAreErrors) {
  write_sphere();
  for (const char* script : {"$H remesh - out.off --resolution 8 <&-", "$H validate - <&-",
                             "$H remesh sphere.off - --resolution 8 >&-", "$H info sphere.off >&-",
                             "$H remesh - - --resolution 8 <&- >&-"}) {
    const Outcome outcome = run_shell(std::string("timeout 20 ") + script);
    EXPECT_EQ(outcome.exit_code, 1) << script << outcome.err;
    EXPECT_NE(outcome.err, "") << script;
  }
  // Files of the command do not get the number of a stream, so that messages do not go into them.
  EXPECT_EQ(run_shell("$H remesh sphere.off out.off --resolution 8 <&- >&- 2>&-").exit_code, 1);
  EXPECT_EQ(run({"remesh", "sphere.off", "same.off", "--resolution", "8"}).exit_code, 0);
  EXPECT_EQ(read("out.off"), read("same.off"));
  EXPECT_EQ(files(), (std::set<std::string>{"out.off", "same.off", "sphere.off"}));
}

TEST_F(SurroundingsTest, LogAndReportAreNoFilesOfTheCommand) {
  write_sphere();
  write_cube();
  std::filesystem::create_hard_link(path("sphere.off"), path("hard.off"));
  std::filesystem::create_symlink("sphere.off", path("soft.off"));
  const Arguments remesh = {"remesh", "sphere.off", "out.off", "--resolution", "8"};
  const auto with = [](Arguments arguments, const Arguments& more) {
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  };
  for (const char* file : {"sphere.off", "./sphere.off", "hard.off", "soft.off", "out.off"}) {
    SCOPED_TRACE(file);
    expect_usage_error(with(remesh, {"--log", file}));
    expect_usage_error(with(remesh, {"--json=" + std::string(file)}));
  }
  expect_usage_error(with(remesh, {"--log", "x.json", "--json=x.json"}));
  expect_usage_error({"--log", "cube.off", "validate", "sphere.off", "--reference", "cube.off"});
  expect_usage_error({"validate", "sphere.off", "cube.off", "--log", "cube.off"});
  expect_usage_error({"fracture", "sphere.off", "pieces", "--resolution", "8", "--cutters", "mesh:cube.off",
                      "--log", "cube.off"});
  expect_usage_error({"run", "sphere.off", "--log", "sphere.off"});
  // A log of earlier runs is continued.
  for (int i = 0; i < 2; ++i)
    EXPECT_EQ(run(with(remesh, {"--log", "log.txt", "--json", "x.json"})).exit_code, 0);
}

TEST_F(SurroundingsTest, InputsAreOverwrittenOnRequestOnly) {
  write_sphere();
  write_cube();
  std::filesystem::create_symlink("sphere.off", path("soft.off"));
  expect_usage_error({"remesh", "sphere.off", "sphere.off", "--resolution", "8"});
  expect_usage_error({"remesh", "soft.off", "sphere.off", "--resolution", "8"});
  expect_usage_error({"remesh", "sphere.off", "./soft.off", "--triangles", "100"});
  for (const char* out : {"sphere.off", "cube.off"})
    expect_usage_error({"combine", "union", "sphere.off", "cube.off", out, "--resolution", "8"});
  expect_usage_error({"remesh", "sphere.off", "--out-dir", ".", "--pattern", "{name}", "--resolution", "8"});
  expect_usage_error({"remesh", "sphere.off", "--out-dir", "out", "--resolution", "8", "--overwrite-input"});
  ASSERT_EQ(run({"remesh", "sphere.off", "out.off", "--resolution", "8"}).exit_code, 0);
  EXPECT_EQ(run({"remesh", "sphere.off", "sphere.off", "--resolution", "8", "--overwrite-input"}).exit_code,
            0);
  EXPECT_EQ(read("sphere.off"), read("out.off"));
  EXPECT_EQ(run({"combine", "union", "sphere.off", "cube.off", "cube.off", "--resolution", "8",
                 "--overwrite-input"})
                .exit_code,
            0);
}

TEST_F(SurroundingsTest, JsonIsValidWhateverBytesAFileNameHas) {
  write_cube();
  const std::string name =
      "K\xe4"
      "fer\xff.off";
  std::filesystem::rename(path("cube.off"), path(name));
  for (const Arguments& arguments :
       {Arguments{"fracture", name, "out", "--resolution", "8", "--cutters", "mesh:" + name, "--no-picture"},
        {"fracture", name, "two", "--resolution", "8", "--cutters", "voronoi:2", "--no-picture", "--judge"},
        {"remesh", name, "out.ply", "--resolution", "8"},
        {"voxelize", name, "out.vdb", "--resolution", "8"},
        {"combine", "union", name, name, "out.ply", "--resolution", "8"},
        {"info", name},
        {"validate", name, "--reference", name},
        {"validate", "K\xe4"}}) {
    Arguments with_json = arguments;
    with_json.push_back("--json");
    const Outcome outcome = run(with_json);
    EXPECT_TRUE(outcome.exit_code == 0 || arguments[1] == "K\xe4") << arguments[0] << outcome.err;
    EXPECT_TRUE(Json::accept(outcome.out)) << arguments[0] << outcome.out << outcome.err;
  }
  for (const char* folder : {"out", "two"})
    EXPECT_TRUE(Json::accept(read(std::string(folder) + "/pieces.json")));
}

/// Box of 2 × 3 × 4 millimetres, `shift` from the origin.
std::string small_box(double shift) {
  std::string text = "OFF\n8 6 0\n";
  for (int corner = 0; corner < 8; ++corner)
    text += std::to_string(shift + (corner & 1 ? 2 : 0)) + " " +
            std::to_string(shift + (corner & 2 ? 3 : 0)) + " " +
            std::to_string(shift + (corner & 4 ? 4 : 0)) + "\n";
  return text + "4 0 4 6 2\n4 1 3 7 5\n4 0 1 5 4\n4 2 6 7 3\n4 0 2 3 1\n4 4 5 7 6\n";
}

TEST_F(SurroundingsTest, AnObjectSmallerThanAVoxelIsRefusedWhereverItLies) {
  for (const double shift : {-1.0, 0.0, 17.0, 90.0, 198.0}) {
    SCOPED_TRACE(shift);
    write("box.off", small_box(shift));
    for (const Arguments& arguments :
         {Arguments{"remesh", "box.off", "out.ply", "--units", "mm", "--voxel-size", "0.2"},
          {"voxelize", "box.off", "out.vdb", "--units", "mm", "--voxel-size", "0.2"},
          {"fracture", "box.off", "out", "--cutters", "voronoi:2", "--units", "mm", "--voxel-size", "0.2"},
          {"combine", "union", "box.off", "box.off", "out.ply", "--units", "mm", "--voxel-size", "0.2"}}) {
      const Outcome outcome = run(arguments);
      EXPECT_EQ(outcome.exit_code, 1) << outcome.out << outcome.err;
      EXPECT_NE(outcome.err.find("box.off"), std::string::npos) << outcome.err;
    }
    EXPECT_EQ(files(), std::set<std::string>{"box.off"});
  }
  EXPECT_EQ(run({"remesh", "box.off", "out.ply", "--units", "mm", "--voxel-size", "0.0002"}).exit_code, 0);
}

TEST_F(SurroundingsTest, UnitsAreStatedWhereTheFormatHasThem) {
  write("box.off", small_box(0.0));
  for (const Arguments& command :
       {Arguments{"remesh", "box.off"}, {"combine", "union", "box.off", "box.off"}}) {
    Arguments arguments = command;
    arguments.insert(arguments.end(), {"out.3mf", "--resolution", "20", "--units", "mm"});
    ASSERT_EQ(run(arguments).exit_code, 0);
    const Outcome outcome = run({"validate", "out.3mf", "--json"});
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    const Json report = Json::parse(outcome.out);
    // The reader takes the numbers as they are, and notes a unit other than the millimetre.
    EXPECT_NEAR(report.at("volume").get<double>(), 24e-9, 1e-11);
    EXPECT_NE(report.at("notes").dump().find("'meter'"), std::string::npos) << report.at("notes");
  }
  ASSERT_EQ(run({"remesh", "box.off", "out.3mf", "--resolution", "20"}).exit_code, 0);
  const Json report = Json::parse(run({"validate", "out.3mf", "--json"}).out);
  EXPECT_NEAR(report.at("volume").get<double>(), 24.0, 0.01);
  EXPECT_TRUE(report.at("notes").empty()) << report.at("notes");
}

TEST_F(SurroundingsTest, WholeNumbersHaveAnyNotation) {
  write_cube();
  ASSERT_EQ(run({"remesh", "cube.off", "digits.off", "--resolution", "20"}).exit_code, 0);
  for (const char* number : {"2e1", "20.0", "0.2E2", "+20"}) {
    EXPECT_EQ(run({"remesh", "cube.off", "out.off", "--resolution", number}).exit_code, 0) << number;
    EXPECT_EQ(read("out.off"), read("digits.off")) << number;
  }
  for (const char* number : {"2.05e1", "2e-1", "1e300", "inf", "2e1x"})
    EXPECT_EQ(run({"remesh", "cube.off", "x.off", "--resolution", number}).exit_code, 2) << number;
  EXPECT_EQ(run({"remesh", "cube.off", "x.off", "--triangles", "1e2"}).exit_code, 0);
}

TEST_F(SurroundingsTest, MorePlacesThanSamplesAreRefused) {
  write_cube();
  for (const char* cutters : {"voronoi:1000000", "chunks:1000000", "mesh:cube.off*1000000"}) {
    const Outcome outcome = run({"fracture", "cube.off", "out", "--resolution", "20", "--cutters", cutters});
    EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
    EXPECT_LT(outcome.seconds, 5.0);
  }
  EXPECT_EQ(files(), std::set<std::string>{"cube.off"});
}

/// A stage that reports nothing is shown with its time all the same.
TEST(TerminalProgressTest, IsNeverSilent) {
  int terminal = -1, other_end = -1;
  ASSERT_EQ(openpty(&terminal, &other_end, nullptr, nullptr, nullptr), 0);
  const int before = dup(STDERR_FILENO);
  dup2(other_end, STDERR_FILENO);
  {
    RunContext context;
    const TerminalProgress progress(context, true);
    context.progress("work", 0.25);
    std::this_thread::sleep_for(std::chrono::milliseconds(1600));
  }
  dup2(before, STDERR_FILENO);
  close(before), close(other_end);
  fcntl(terminal, F_SETFL, O_NONBLOCK);
  std::string sent;
  char buffer[4096];
  for (ssize_t size; (size = ::read(terminal, buffer, sizeof buffer)) > 0;)
    sent.append(buffer, std::size_t(size));
  close(terminal);
  int lines = 0;
  for (std::size_t at = 0; (at = sent.find("work  25 %", at)) != std::string::npos; ++at) ++lines;
  EXPECT_GE(lines, 2) << sent;
}

}  // namespace
}  // namespace hermesh::cli
