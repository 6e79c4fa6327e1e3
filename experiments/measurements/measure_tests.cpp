// Claims that tests decide: runs the tests that paper/claims.toml names, so that a claim's verdict rests on a row, too.
#include <fnmatch.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <set>
#include <sstream>

#include "experiments/cases/cases.h"
#include "experiments/harness/shell.h"
#include "experiments/ledger/claims.h"
#include "experiments/measurements/measurements.h"

namespace hermesh {
namespace {

namespace fs = std::filesystem;

/// The test programs of the build that this program belongs to, in the order of their names.
std::vector<fs::path> test_programs() {
  const fs::path folder = fs::read_symlink("/proc/self/exe").parent_path();
  std::vector<fs::path> programs;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    const bool runs = entry.is_regular_file() && (entry.status().permissions() & fs::perms::owner_exec) != fs::perms::none;
    if (runs && entry.path().filename().string().ends_with("_test")) programs.push_back(entry.path());
  }
  std::ranges::sort(programs, {}, [](const fs::path& program) { return program.filename(); });
  if (programs.empty()) throw Error("there are no test programs beside " + folder.string() + "; build all targets");
  return programs;
}

/// All tests of a program as "Suite.Test".
std::vector<std::string> tests_of(const fs::path& program) {
  const ShellOutput list = shell_output(shell_quoted(program.string()) + " --gtest_list_tests 2>/dev/null");
  if (list.status != 0) throw Error(program.string() + " does not list its tests; build all targets again");
  std::istringstream lines(list.text);
  std::vector<std::string> tests;
  std::string suite;
  for (std::string line; std::getline(lines, line);) {
    line = line.substr(0, line.find("  #"));
    if (line.ends_with('.') && !line.starts_with(' ')) suite = line;
    else if (line.starts_with("  ")) tests.push_back(suite + line.substr(2));
  }
  return tests;
}

bool matches(const std::string& pattern, const std::string& test) { return fnmatch(pattern.c_str(), test.c_str(), 0) == 0; }

/// How many of the tests ran, and how many of these failed; a skipped one did not run.
std::pair<int, int> run_tests(const fs::path& program, const std::string& pattern, const fs::path& report) {
  const int status = shell_output(shell_quoted(program.string()) + " --gtest_filter=" + shell_quoted(pattern) +
                                  " --gtest_output=json:" + shell_quoted(report.string()) + " 2>&1")
                         .status;
  std::ifstream file(report);
  const Json json = Json::parse(file, nullptr, false);
  if (json.is_discarded()) return {1, 1};  // the program ended before it could say
  int ran = 0;
  for (const Json& suite : json.at("testsuites"))
    for (const Json& test : suite.at("testsuite")) ran += test.value("result", "") == "COMPLETED" ? 1 : 0;
  const int failed = json.at("failures").get<int>();
  return {ran, failed == 0 && status != 0 ? 1 : failed};
}

std::vector<MeasuredRow> measure(const MeasurementInput& input) {
  std::set<std::string> wanted;
  for (const Claim& claim : read_claims(experiments_folder().parent_path() / "paper" / "claims.toml"))
    for (const std::string& test : claim.tests)
      if (input.wants("tests", test)) wanted.insert(test);
  std::map<fs::path, std::vector<std::string>> known;
  for (const fs::path& program : test_programs()) known[program] = tests_of(program);
  std::vector<MeasuredRow> rows;
  for (const std::string& pattern : wanted) {
    input.context.check();
    input.context.progress("test " + pattern, double(rows.size()) / double(wanted.size()));
    MeasuredRow row{"tests", pattern};
    int ran = 0, failed = 0;
    for (const auto& [program, tests] : known) {
      if (std::ranges::none_of(tests, [&](const std::string& test) { return matches(pattern, test); })) continue;
      const auto [more, wrong] = run_tests(program, pattern, input.out / "tests.json");
      ran += more;
      failed += wrong;
      row.values["program"] = program.filename().string();
    }
    fs::remove(input.out / "tests.json");
    row.values["ran"] = ran;
    row.values["failures"] = failed;
    row.values["passed"] = ran > 0 && failed == 0 ? 1 : 0;
    if (ran == 0) row.broken.push_back("no test of this name ran");
    if (failed > 0) row.broken.push_back("a test failed");
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace

Measurement tests_measurement() {
  return {"tests",
          "the tests that decide claims of the thesis",
          {},
          {{"tests",
            "tests that decide claims",
            "test",
            {{"program", "program", "the test program that has it"},
             {"ran", "ran", "tests of that name that ran"},
             {"failures", "failed", "of these, those that failed"},
             {"passed", "passed", "1 if some ran and none failed"}}}},
          measure};
}

}  // namespace hermesh
