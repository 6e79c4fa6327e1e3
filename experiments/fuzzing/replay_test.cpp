// Reads the files of corpus/ and findings/ like the fuzzing programs.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "experiments/fuzzing/targets.h"

namespace hermesh::fuzzing {

/// Names the target in the names of tests.
void PrintTo(const Target& target, std::ostream* out) { *out << target.name; }

namespace replay_test {

namespace fs = std::filesystem;

std::vector<Target> all_targets() {
  std::vector<Target> all(file_targets().begin(), file_targets().end());
  all.insert(all.end(), program_targets().begin(), program_targets().end());
  return all;
}

class Replay : public testing::TestWithParam<Target> {
 protected:
  /// Reads all files of a directory. Returns the number that have a value.
  static int read_all(const fs::path& directory) {
    int values = 0;
    if (!fs::exists(directory)) return values;
    for (const auto& entry : fs::directory_iterator(directory)) {
      std::ifstream file(entry.path(), std::ios::binary);
      const std::string bytes{std::istreambuf_iterator<char>(file), {}};
      EXPECT_NO_THROW(values += expect_value_or_error(GetParam(), bytes).empty()) << entry.path();
    }
    return values;
  }
};

TEST_P(Replay, CorpusHasValues) {
  EXPECT_GT(read_all(fs::path(HERMESH_FUZZING) / "corpus" / GetParam().name), 0);
}

TEST_P(Replay, FindingsAreReadOrRefused) {
  read_all(fs::path(HERMESH_FUZZING) / "findings" / GetParam().name);
}

INSTANTIATE_TEST_SUITE_P(Targets, Replay, testing::ValuesIn(all_targets()),
                         [](const auto& test) { return std::string(test.param.name); });

}  // namespace replay_test
}  // namespace hermesh::fuzzing
