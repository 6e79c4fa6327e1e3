#include "experiments/cli/help.h"

#include <sstream>

#include "experiments/cli/process_for_tests.h"

namespace hermesh::cli {
namespace help_test {

using Json = nlohmann::json;

TEST(DidYouMean, NamesTheNearestOrNothing) {
  const Words words = "voxelize validate remesh";
  EXPECT_EQ(did_you_mean("validat", words), "; did you mean 'validate'?");
  EXPECT_EQ(did_you_mean("remseh", {"remasters", "remesh"}), "; did you mean 'remesh'?")
      << "a swap is one change";
  EXPECT_EQ(did_you_mean("ab", {"ba"}), "; did you mean 'ba'?");
  EXPECT_EQ(did_you_mean("kitten", {"sitting"}), "") << "three changes of six letters";
  EXPECT_EQ(did_you_mean("vox", words), "; did you mean 'voxelize'?") << "a beginning";
  EXPECT_EQ(did_you_mean("fracture", words), "");
  EXPECT_EQ(did_you_mean("", words), "");
}

class HelpTest : public ProgramTest {
 protected:
  void expect_suggestion(const Words& arguments, const std::string& meant) {
    const Outcome outcome = run_to(2, arguments);
    EXPECT_PRED2(has, outcome.err, "did you mean '" + meant + "'?");
  }
  Words commands() {
    Words names;
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
  expect_suggestion("remseh cube.off out.ply", "remesh");
  expect_suggestion("remesh cube.off out.ply --resolutoin 10", "--resolution");
  expect_suggestion("remesh cube.off out.ply --resolution 10 --extractor dual-countouring",
                    "dual-contouring");
  expect_suggestion("remesh cube.off out.ply --resolution 10 --voxelizer hermsh", "hermesh");
  expect_suggestion("remesh cube.off out.ply --resolution 10 -o tolerence=0.2", "tolerance");
  expect_suggestion("--qiet list", "--quiet");
  // A word without a similar one has no suggestion.
  const Outcome far = run("remesh cube.off out.ply --resolution 10 --zzzzzz 1");
  EXPECT_PRED2(has, far.err, "hermesh remesh has no option --zzzzzz;");
  EXPECT_PRED2(lacks, far.err, "did you mean");
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
  for (const std::string& command : commands()) EXPECT_PRED2(has, all, command) << command;
  EXPECT_PRED2(lacks, all, "cell") << "what users do not see";
}

TEST_F(HelpTest, ZshHasEveryCommandAndBalancedQuotes) {
  const Outcome outcome = run("completion zsh");
  EXPECT_TRUE(outcome.out.starts_with("#compdef hermesh\n"));
  for (const std::string& command : commands())
    EXPECT_PRED2(has, outcome.out, "    " + command + ")\n") << command;
  // Both shells have the same quotes, so bash can check that quotes and blocks are closed.
  const Outcome parsed = run_shell("$H completion zsh | sed 's/words\\[2\\]/words/' | bash -n");
  EXPECT_EQ(parsed.err, "");
  run_to(2, "completion fish");
}

TEST_F(HelpTest, TheManualHasAllCommandsAndOptions) {
  const Outcome outcome = run_to(0, {"man"});
  const Words all = commands();
  EXPECT_GE(all.size(), 15u);
  for (const std::string& command : all) EXPECT_PRED2(has, outcome.out, ".SS hermesh " + command) << command;
  for (const char* option :
       {"\\-\\-resolution", "\\-\\-out\\-dir", "\\-\\-units", "\\-\\-cutters", "\\-\\-tier"})
    EXPECT_PRED2(has, outcome.out, option) << option;
  // A line of text must not look like a request.
  std::istringstream lines(outcome.out);
  const std::string requests = " .TH .SH .SS .TP .B .I .BR .RI .nf .fi ";
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with(".")) continue;
    EXPECT_PRED2(has, requests, " " + line.substr(0, line.find(' ')) + " ") << line;
  }
}

TEST_F(HelpTest, TheDoctorNamesWhatIsMissingAndItsRemedy) {
  std::filesystem::create_directory(path("bin"));
  const Outcome bare = run_shell("PATH=$PWD/bin HERMESH_DATA=$PWD/none $H doctor");
  EXPECT_EQ(bare.exit_code, 0);
  EXPECT_PRED2(has, bare.out,
               "missing  pdflatex, for ./reproduce --paper: apt-get install texlive-latex-base");
  EXPECT_PRED2(has, bare.out, "which is not a directory");
  write("bin/pdflatex", "#!/bin/sh\n");
  std::filesystem::permissions(path("bin/pdflatex"), std::filesystem::perms::owner_all);
  const Outcome with = run_shell("PATH=$PWD/bin HERMESH_DATA=$PWD $H doctor");
  EXPECT_PRED2(has, with.out, "ok       pdflatex, for ./reproduce --paper: ");
  EXPECT_PRED2(has, with.out, "ok       the folder $HERMESH_DATA");
  const Json json = json_of("doctor --json").at("result");
  std::size_t missing = 0;
  for (const Json& check : json.at("checks")) {
    missing += check.at("found").is_null();
    EXPECT_NE(check.at("found").is_null(), check.at("remedy").is_null());
  }
  EXPECT_EQ(json.at("missing"), missing);
}

}  // namespace help_test
}  // namespace hermesh::cli
