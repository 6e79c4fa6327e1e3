// Files and streams around the program: it overwrites, follows and waits for nothing without a request.
#include <fcntl.h>
#include <pty.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <thread>

#include "experiments/cli/process_for_tests.h"
#include "experiments/cli/terminal_progress.h"

namespace hermesh::cli {
namespace cli_surroundings_test {

using Json = nlohmann::json;

class SurroundingsTest : public ProgramTest {
 protected:
  /// Expects that the command is wrong usage and changes no file.
  void expect_usage_error(const Words& arguments) {
    const std::set<std::string> before = files();
    const std::string sphere = read("sphere.off"), cube = read("cube.off");
    run_to(2, arguments);
    EXPECT_EQ(files(), before);
    EXPECT_TRUE(read("sphere.off") == sphere && read("cube.off") == cube);
  }
};

TEST_F(SurroundingsTest, ALimitThatAllowsNoThreadIsAMessage) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "the sanitizer reserves more than any limit";
#endif
  int refusals = 0;
  for (int kib = 60'000; kib <= 200'000; kib += 10'000) {
    const Outcome outcome = run_shell("ulimit -v " + std::to_string(kib) + "; $H list");
    // Under the least limits the system's loader fails.
    if (outcome.exit_code == 0 || outcome.exit_code == 127) continue;
    EXPECT_EQ(outcome.exit_code, 1) << kib << outcome.err;
    EXPECT_TRUE(outcome.err.starts_with("hermesh: ")) << kib << outcome.err;
    ++refusals;
  }
  EXPECT_GT(refusals, 0);
}

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
  run_to(0, "remesh sphere.off same.off --resolution 8");
  EXPECT_EQ(read("out.off"), read("same.off"));
  EXPECT_EQ(files(), (std::set<std::string>{"out.off", "same.off", "sphere.off"}));
}

TEST_F(SurroundingsTest, LogAndReportAreNoFilesOfTheCommand) {
  write_sphere();
  write_cube();
  std::filesystem::create_hard_link(path("sphere.off"), path("hard.off"));
  std::filesystem::create_symlink("sphere.off", path("soft.off"));
  const Words remesh = "remesh sphere.off out.off --resolution 8";
  for (const char* file : {"sphere.off", "./sphere.off", "hard.off", "soft.off", "out.off"}) {
    SCOPED_TRACE(file);
    expect_usage_error(remesh + Words{"--log", file});
    expect_usage_error(remesh + Words{"--json=" + std::string(file)});
  }
  expect_usage_error(remesh + "--log x.json --json=x.json");
  expect_usage_error("--log cube.off validate sphere.off --reference cube.off");
  expect_usage_error("validate sphere.off cube.off --log cube.off");
  expect_usage_error("fracture sphere.off pieces --resolution 8 --cutters mesh:cube.off --log cube.off");
  expect_usage_error("run sphere.off --log sphere.off");
  // A log of earlier runs is continued.
  for (int i = 0; i < 2; ++i) run_to(0, remesh + "--log log.txt --json x.json");
}

TEST_F(SurroundingsTest, InputsAreOverwrittenOnRequestOnly) {
  write_sphere();
  write_cube();
  std::filesystem::create_symlink("sphere.off", path("soft.off"));
  expect_usage_error("remesh sphere.off sphere.off --resolution 8");
  expect_usage_error("remesh soft.off sphere.off --resolution 8");
  expect_usage_error("remesh sphere.off ./soft.off --triangles 100");
  for (const char* out : {"sphere.off", "cube.off"})
    expect_usage_error({"combine", "union", "sphere.off", "cube.off", out, "--resolution", "8"});
  expect_usage_error("remesh sphere.off --out-dir . --pattern {name} --resolution 8");
  expect_usage_error("remesh sphere.off --out-dir out --resolution 8 --overwrite-input");
  run_to(0, "remesh sphere.off out.off --resolution 8");
  run_to(0, "remesh sphere.off sphere.off --resolution 8 --overwrite-input");
  EXPECT_EQ(read("sphere.off"), read("out.off"));
  run_to(0, "combine union sphere.off cube.off cube.off --resolution 8 --overwrite-input");
}

TEST_F(SurroundingsTest, JsonIsValidWhateverBytesAFileNameHas) {
  write_cube();
  const std::string name =
      "K\xe4"
      "fer\xff.off";
  std::filesystem::rename(path("cube.off"), path(name));
  for (const Words& arguments :
       {Words{"fracture", name, "out", "--resolution", "8", "--cutters", "mesh:" + name, "--no-picture"},
        {"fracture", name, "two", "--resolution", "8", "--cutters", "voronoi:2", "--no-picture", "--judge"},
        {"remesh", name, "out.ply", "--resolution", "8"},
        {"voxelize", name, "out.vdb", "--resolution", "8"},
        {"combine", "union", name, name, "out.ply", "--resolution", "8"},
        {"info", name},
        {"validate", name, "--reference", name},
        {"validate", "K\xe4"}}) {
    const Outcome outcome = run(arguments + "--json");
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
    for (const Words arguments :
         {"remesh box.off out.ply", "voxelize box.off out.vdb", "fracture box.off out --cutters voronoi:2",
          "combine union box.off box.off out.ply"})
      expect_refusal(1, arguments + "--units mm --voxel-size 200", {"box.off"}, true);
  }
  run_to(0, "remesh box.off out.ply --units mm --voxel-size 0.2");
}

/// The same box of 2 × 3 × 4 mm through all pairs of formats, the first of which may state a unit.
TEST_F(SurroundingsTest, TheSizeIsPreservedInAllFormats) {
  const std::vector<std::string> endings = {"ply", "obj", "off", "stl", "glb", "gltf", "3mf"};
  write("box.off", small_box(0.0));
  const auto volume = [&](const std::string& file) {
    return json_of("validate " + file + " --units mm --json").at("volume").get<double>();
  };
  for (const std::string& first : endings) {
    run_to(0, "remesh box.off a." + first + " --resolution 20 --units mm");
    EXPECT_NEAR(volume("a." + first), 24.0, 1e-3) << first;
    for (const std::string& second : endings) {
      run_to(0, "remesh a." + first + " b." + second + " --voxel-size 0.4 --units mm");
      EXPECT_NEAR(volume("b." + second), 24.0, 1e-3) << first << " to " << second;
    }
  }
  // A glTF file is in metres, whatever the units of the other files are.
  EXPECT_NEAR(json_of("validate a.glb --json").at("volume").get<double>(), 24e-9, 1e-12);
  run_to(0, "remesh a.glb c.3mf --resolution 20");
  EXPECT_NEAR(volume("c.3mf"), 24.0, 1e-3);
  EXPECT_NEAR(json_of("validate c.3mf --json").at("volume").get<double>(), 24e-9, 1e-12);
  // Without a known unit numbers are unchanged; 3MF is in millimetres.
  run_to(0, "remesh box.off d.3mf --resolution 20");
  EXPECT_NEAR(json_of("validate d.3mf --json").at("volume").get<double>(), 24.0, 1e-3);
}

TEST_F(SurroundingsTest, WholeNumbersHaveAnyNotation) {
  write_cube();
  run_to(0, "remesh cube.off digits.off --resolution 20");
  for (const char* number : {"2e1", "20.0", "0.2E2", "+20"}) {
    run_to(0, {"remesh", "cube.off", "out.off", "--resolution", number});
    EXPECT_EQ(read("out.off"), read("digits.off")) << number;
  }
  for (const char* number : {"2.05e1", "2e-1", "1e300", "inf", "2e1x"})
    run_to(2, {"remesh", "cube.off", "x.off", "--resolution", number});
  run_to(0, "remesh cube.off x.off --triangles 1e2");
}

TEST_F(SurroundingsTest, MorePlacesThanSamplesAreRefused) {
  write_cube();
  for (const char* cutters : {"voronoi:1000000", "chunks:1000000", "mesh:cube.off*1000000"}) {
    const Outcome outcome =
        run_to(1, {"fracture", "cube.off", "out", "--resolution", "20", "--cutters", cutters});
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

TEST(TerminalProgressTest, WritesLinesWhereNoTerminalIs) {
  testing::internal::CaptureStderr();
  {
    RunContext context;
    const TerminalProgress progress(context, true, {}, std::chrono::milliseconds(100));
    context.progress("work", 0.25);
    std::this_thread::sleep_for(std::chrono::milliseconds(1000));
  }
  const std::string sent = testing::internal::GetCapturedStderr();
  EXPECT_NE(sent.find("hermesh: working for 1 s, work  25 %\n"), std::string::npos) << sent;
  // After 100, 200, 400 and 800 ms, fewer on a loaded machine.
  const auto lines = std::count(sent.begin(), sent.end(), '\n');
  EXPECT_GE(lines, 2) << sent;
  EXPECT_LE(lines, 4) << sent;
}

}  // namespace cli_surroundings_test
}  // namespace hermesh::cli
