#include "algorithms/core/atomic_file.h"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <fstream>
#include <map>
#include <sstream>

#include "algorithms/core/error.h"

namespace hermesh {
namespace {

namespace fs = std::filesystem;

class CommitTogetherTest : public testing::Test {
 protected:
  CommitTogetherTest() {
    std::string pattern = (fs::temp_directory_path() / "hermesh-test-XXXXXX").string();
    folder = mkdtemp(pattern.data());
  }
  ~CommitTogetherTest() override { fs::remove_all(folder); }

  static void write(const fs::path& path, const std::string& text) { std::ofstream(path) << text; }
  /// All plain files, hidden ones too.
  std::map<std::string, std::string> files() const {
    std::map<std::string, std::string> all;
    for (const auto& entry : fs::directory_iterator(folder)) {
      if (!entry.is_regular_file()) continue;
      std::ostringstream text;
      text << std::ifstream(entry.path()).rdbuf();
      all[entry.path().filename().string()] = text.str();
    }
    return all;
  }
  /// A folder takes the second one's name before it is renamed.
  void fail_to_commit() {
    AtomicFile first(folder / "first"), second(folder / "second");
    write(first.path(), "new");
    write(second.path(), "new");
    fs::create_directory(folder / "second");
    EXPECT_THROW(commit_together(first, second), Error);
  }
  fs::path folder;
};

TEST_F(CommitTogetherTest, Both) {
  write(folder / "first", "older");
  {
    AtomicFile first(folder / "first"), second(folder / "second");
    write(first.path(), "new first");
    write(second.path(), "new second");
    commit_together(first, second);
  }
  EXPECT_EQ(files(), (std::map<std::string, std::string>{{"first", "new first"}, {"second", "new second"}}));
}

TEST_F(CommitTogetherTest, NeitherWhereThereWasNone) {
  fail_to_commit();
  EXPECT_TRUE(files().empty());
}

TEST_F(CommitTogetherTest, TheOlderFirstComesBack) {
  write(folder / "first", "older");
  fail_to_commit();
  EXPECT_EQ(files(), (std::map<std::string, std::string>{{"first", "older"}}));
}

}  // namespace
}  // namespace hermesh
