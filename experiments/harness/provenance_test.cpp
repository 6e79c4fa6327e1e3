#include "experiments/harness/provenance.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

#include "algorithms/core/error.h"
#include "experiments/harness/shell.h"

namespace hermesh {
namespace {

/// A git checkout of one commit, in a folder of its own.
class Checkout : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("hermesh-checkout-" + std::to_string(getpid()));
    std::filesystem::create_directories(folder_ / "results" / "headline");
    write("code.cpp", "int one;");
    git("init -q");
    git("add .");
    git("-c user.name=x -c user.email=x@y -c commit.gpgsign=false commit -q -m one");
  }
  void TearDown() override {
    set_source_state({});
    std::filesystem::remove_all(folder_);
  }
  void write(const std::string& name, const std::string& text) const { std::ofstream(folder_ / name) << text; }
  void git(const std::string& arguments) const {
    ASSERT_EQ(std::system(("git -C '" + folder_.string() + "' " + arguments).c_str()), 0) << arguments;
  }
  std::string complaint(const std::string& out, const SourceState& built) const {
    try {
      check_may_be_kept(folder_ / out, folder_, built);
      return "";
    } catch (const Error& error) {
      return error.what();
    }
  }
  std::filesystem::path folder_;
};

TEST_F(Checkout, PagesAndResultsAreNoChanges) {
  const SourceState clean = checked_out(folder_);
  EXPECT_EQ(clean.commit.size(), 40u);
  EXPECT_EQ(clean.dirty, false);
  write("results/headline/rows.jsonl", "{}");
  write("README.md", "text");
  EXPECT_EQ(checked_out(folder_).dirty, false);
  write("code.cpp", "int two;");
  EXPECT_EQ(checked_out(folder_).dirty, true);
  EXPECT_EQ(checked_out(std::filesystem::temp_directory_path()).commit, "unknown");
}

TEST_F(Checkout, RowsThatAreKeptNameTheirCommit) {
  const SourceState clean = checked_out(folder_);
  EXPECT_EQ(complaint("results/headline", clean), "");
  SourceState changed = clean, other = clean;
  changed.dirty = true;
  other.commit = std::string(40, 'a');
  EXPECT_NE(complaint("results/headline", changed).find("differ from its commit"), std::string::npos);
  EXPECT_NE(complaint("results/headline", other).find("was built from commit aaaaaaaaaaaa"), std::string::npos);
  EXPECT_NE(complaint("results/headline", {}).find("was built from commit unknown"), std::string::npos);
  EXPECT_EQ(complaint("results/local/headline", changed), "");
  EXPECT_EQ(complaint("elsewhere", changed), "");
  EXPECT_EQ(complaint("results/../elsewhere", changed), "");
  write("code.cpp", "int two;");
  EXPECT_NE(complaint("results/headline", clean).find("files differ from the commit"), std::string::npos);
}

TEST_F(Checkout, ARowIsSignedByWhatTheProgramWasBuiltFrom) {
  const SourceState clean = checked_out(folder_);
  set_source_state(clean);
  EXPECT_EQ(provenance(folder_)["commit"], clean.commit);
  EXPECT_EQ(provenance(folder_)["dirty"], false);
  write("new.toml", "");
  EXPECT_EQ(provenance(folder_)["dirty"], true);
  git("add .");
  git("-c user.name=x -c user.email=x@y -c commit.gpgsign=false commit -q -m two");
  EXPECT_EQ(provenance(folder_)["commit"], clean.commit) << "an old program must not sign with a new commit";
  EXPECT_EQ(provenance(folder_)["dirty"], true);
  set_source_state({});
  EXPECT_EQ(provenance(folder_)["commit"], "unknown");
  EXPECT_TRUE(provenance(folder_)["dirty"].is_null());
  const std::string flags = provenance(folder_)["build"]["flags"];
  EXPECT_NE(flags.find("-march=x86-64-v2"), std::string::npos) << flags;
  EXPECT_EQ(flags.find("-Wall"), std::string::npos) << flags;
}

TEST(Shell, TakesAnyTextAsOneWordAndSaysHowACommandEnded) {
  for (const std::string text : {"plain", "two words", "it's", "$HOME `id` \\ \"x\"", "a\nb", "*"})
    EXPECT_EQ(shell_output("printf %s " + shell_quoted(text)).text, text);
  EXPECT_EQ(shell_output("true").status, 0);
  EXPECT_NE(shell_output("false").status, 0);
  EXPECT_EQ(shell_output("printf 'a\n\n'").text, "a");
}

}  // namespace
}  // namespace hermesh
