#include <nlohmann/json.hpp>
#include <sstream>

#include "experiments/cli/help/command_table.h"
#include "experiments/cli/help/doctor.h"
#include "experiments/cli/help/suggestions.h"
#include "experiments/cli/process_for_tests.h"

namespace hermesh::cli {
namespace {

using Json = nlohmann::json;

TEST(EditDistance, CountsLettersAndSwaps) {
  EXPECT_EQ(edit_distance("", "abc"), 3u);
  EXPECT_EQ(edit_distance("remesh", "remesh"), 0u);
  EXPECT_EQ(edit_distance("remseh", "remesh"), 1u) << "a swap";
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3u);
  EXPECT_EQ(edit_distance("resolution", "resoluton"), 1u);
}

TEST(DidYouMean, NamesTheNearestOrNothing) {
  const std::vector<std::string> words = {"voxelize", "validate", "remesh"};
  EXPECT_EQ(did_you_mean("validat", words), "; did you mean 'validate'?");
  EXPECT_EQ(did_you_mean("vox", words), "; did you mean 'voxelize'?") << "a beginning";
  EXPECT_EQ(did_you_mean("fracture", words), "");
  EXPECT_EQ(did_you_mean("", words), "");
}

class HelpTest : public ProgramTest {
 protected:
  void expect_suggestion(const std::vector<std::string>& arguments, const std::string& meant) {
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
    EXPECT_NE(outcome.err.find("did you mean '" + meant + "'?"), std::string::npos) << outcome.err;
  }
  std::vector<std::string> commands() {
    std::vector<std::string> names;
    std::istringstream help(run({"--help"}).out.substr(run({"--help"}).out.find("Subcommands:")));
    std::string line;
    std::getline(help, line);
    while (std::getline(help, line) && line.starts_with("  "))
      if (line[2] != ' ') names.push_back(line.substr(2, line.find(' ', 2) - 2));
    return names;
  }
};

TEST_F(HelpTest, MistypedWordsGetASuggestion) {
  write_cube();
  expect_suggestion({"remseh", "cube.off", "out.ply"}, "remesh");
  expect_suggestion({"remesh", "cube.off", "out.ply", "--resolutoin", "10"}, "--resolution");
  expect_suggestion(
      {"remesh", "cube.off", "out.ply", "--resolution", "10", "--extractor", "dual-countouring"},
      "dual-contouring");
  expect_suggestion({"remesh", "cube.off", "out.ply", "--resolution", "10", "--voxelizer", "hermsh"},
                    "hermesh");
  expect_suggestion({"remesh", "cube.off", "out.ply", "--resolution", "10", "-o", "tolerence=0.2"},
                    "tolerance");
  expect_suggestion({"--qiet", "list"}, "--quiet");
  // What is near to nothing is named as it is.
  const Outcome far = run({"remesh", "cube.off", "out.ply", "--resolution", "10", "--zzzzzz", "1"});
  EXPECT_NE(far.err.find("hermesh remesh has no option --zzzzzz;"), std::string::npos) << far.err;
  EXPECT_EQ(far.err.find("did you mean"), std::string::npos) << far.err;
}

TEST_F(HelpTest, BashCompletesCommandsOptionsAndValues) {
  const auto complete = [&](const std::string& words, int index) {
    const Outcome outcome =
        run_shell("source <($H completion bash); compopt() { :; }; COMP_WORDS=(" + words +
                  "); COMP_CWORD=" + std::to_string(index) + "; _hermesh; echo \"${COMPREPLY[@]}\"");
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_EQ(outcome.err, "");
    return outcome.out;
  };
  EXPECT_EQ(complete("hermesh vox", 1), "voxelize\n");
  EXPECT_EQ(complete("hermesh remesh --resol", 2), "--resolution\n");
  EXPECT_EQ(complete("hermesh remesh a b --extractor manifold-dual", 5), "manifold-dual-contouring\n");
  EXPECT_EQ(complete("hermesh remesh a b --extractor = manifold-dual", 6), "manifold-dual-contouring\n");
  EXPECT_EQ(complete("hermesh run --tier f", 3), "full\n");
  EXPECT_EQ(complete("hermesh remesh sc", 2), "\n") << "files are the shell's own matter";
  const std::string all = complete("hermesh ''", 1);
  for (const std::string& command : commands()) EXPECT_NE(all.find(command), std::string::npos) << command;
  EXPECT_EQ(all.find("cell"), std::string::npos) << "what users do not see";
}

TEST_F(HelpTest, ZshHasEveryCommandAndBalancedQuotes) {
  const Outcome outcome = run({"completion", "zsh"});
  EXPECT_TRUE(outcome.out.starts_with("#compdef hermesh\n"));
  for (const std::string& command : commands())
    EXPECT_NE(outcome.out.find("    " + command + ")\n"), std::string::npos) << command;
  // Quotes mean the same to both shells, so that bash tells whether they and the blocks are closed.
  const Outcome parsed = run_shell("$H completion zsh | sed 's/words\\[2\\]/words/' | bash -n");
  EXPECT_EQ(parsed.err, "");
  EXPECT_EQ(run({"completion", "fish"}).exit_code, 2);
}

TEST_F(HelpTest, TheManualHasAllCommandsAndOptions) {
  const Outcome outcome = run({"man"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::vector<std::string> all = commands();
  EXPECT_GE(all.size(), 15u);
  for (const std::string& command : all)
    EXPECT_NE(outcome.out.find(".SS hermesh " + command), std::string::npos) << command;
  for (const char* option :
       {"\\-\\-resolution", "\\-\\-out\\-dir", "\\-\\-units", "\\-\\-cutters", "\\-\\-tier"})
    EXPECT_NE(outcome.out.find(option), std::string::npos) << option;
  // A line of text must not look like a request.
  std::istringstream lines(outcome.out);
  const std::string requests = " .TH .SH .SS .TP .B .I .BR .RI .nf .fi ";
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with(".")) continue;
    EXPECT_NE(requests.find(" " + line.substr(0, line.find(' ')) + " "), std::string::npos) << line;
  }
}

TEST_F(HelpTest, TheDoctorNamesWhatIsMissingAndItsRemedy) {
  std::filesystem::create_directory(path("bin"));
  const Outcome bare = run_shell("PATH=$PWD/bin HERMESH_DATA=$PWD/none $H doctor");
  EXPECT_EQ(bare.exit_code, 0);
  EXPECT_NE(bare.out.find("missing  pdflatex, for ./reproduce --paper: apt-get install texlive-latex-base"),
            std::string::npos)
      << bare.out;
  EXPECT_NE(bare.out.find("which is no folder"), std::string::npos) << bare.out;
  write("bin/pdflatex", "#!/bin/sh\n");
  std::filesystem::permissions(path("bin/pdflatex"), std::filesystem::perms::owner_all);
  const Outcome with = run_shell("PATH=$PWD/bin HERMESH_DATA=$PWD $H doctor");
  EXPECT_NE(with.out.find("ok       pdflatex, for ./reproduce --paper: "), std::string::npos) << with.out;
  EXPECT_NE(with.out.find("ok       the folder $HERMESH_DATA"), std::string::npos) << with.out;
  const Json json = Json::parse(run({"doctor", "--json"}).out).at("result");
  std::size_t missing = 0;
  for (const Json& check : json.at("checks")) {
    missing += check.at("found").is_null();
    EXPECT_NE(check.at("found").is_null(), check.at("remedy").is_null());
  }
  EXPECT_EQ(json.at("missing"), missing);
}

}  // namespace
}  // namespace hermesh::cli
