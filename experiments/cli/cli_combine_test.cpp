#include <nlohmann/json.hpp>

#include "experiments/cli/process_for_tests.h"

namespace hermesh::cli {
namespace {

class CombineTest : public ProgramTest {
 protected:
  /// A box as an OFF file.
  void write_box(const std::string& name, double x0, double x1) {
    const auto corner = [&](int i) {
      return std::to_string(i & 1 ? x1 : x0) + (i & 2 ? " 1" : " -1") + (i & 4 ? " 1\n" : " -1\n");
    };
    std::string text = "OFF\n8 6 0\n";
    for (int i = 0; i < 8; ++i) text += corner(i);
    write(name, text + "4 0 2 3 1\n4 4 5 7 6\n4 0 1 5 4\n4 2 6 7 3\n4 0 4 6 2\n4 1 3 7 5\n");
  }
  Outcome combine(const std::string& operation) {
    return run({"combine", operation, "a.off", "b.off", "out.ply", "--voxel-size", "0.05"});
  }
  /// Of the mesh that was written, as the judges have it.
  double volume() {
    const Outcome judged = run({"validate", "out.ply", "--json", "--require", "closed,oriented"});
    EXPECT_EQ(judged.exit_code, 0);
    return nlohmann::json::parse(judged.out).at("volume").get<double>();
  }
};

TEST_F(CombineTest, VolumesOfTwoBoxesAreThoseOfTheirParts) {
  write_box("a.off", -1.0, 1.0);
  write_box("b.off", 0.21, 2.0);  // the lattice of a, not of b: the origins differ
  const struct {
    const char* operation;
    double volume;
  } expected[] = {{"union", 12.0}, {"intersection", 4 * 0.79}, {"difference", 4 * 1.21}};
  for (const auto& [operation, exact] : expected) {
    const Outcome outcome = combine(operation);
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_NEAR(volume(), exact, 0.002 * exact) << operation;
  }
}

TEST_F(CombineTest, AnEmptyResultIsSaidAndNotWritten) {
  write_box("a.off", -1.0, 1.0);
  write_box("b.off", 3.0, 4.0);
  const Outcome outcome = combine("intersection");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_NE(outcome.err.find("is empty, nothing was written"), std::string::npos) << outcome.err;
  EXPECT_FALSE(files().contains("out.ply"));
}

TEST_F(CombineTest, AWrongOperationOrOptionIsAUsageError) {
  write_box("a.off", -1.0, 1.0);
  write_box("b.off", 0.0, 2.0);
  EXPECT_EQ(combine("xor").exit_code, 2);
  EXPECT_EQ(run({"combine", "union", "a.off", "b.off", "out.ply", "--voxel-size", "0.1", "-o", "placement=best"})
                .exit_code,
            2);
  EXPECT_EQ(run({"combine", "union", "a.off", "missing.off", "out.ply", "--voxel-size", "0.1"}).exit_code, 1);
  EXPECT_FALSE(files().contains("out.ply"));
}

}  // namespace
}  // namespace hermesh::cli
