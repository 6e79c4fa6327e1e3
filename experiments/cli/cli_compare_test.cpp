// What `hermesh compare` and `hermesh accept` print and return.
#include <nlohmann/json.hpp>

#include "experiments/cli/process_for_tests.h"

namespace hermesh::cli {
namespace {

using Json = nlohmann::ordered_json;

class CompareTest : public ProgramTest {
 protected:
  static Json row_of(const std::string& label, double error) {
    return {{"experiment", "tried"},
            {"run", "1"},
            {"commit", "1234"},
            {"dirty", false},
            {"case", {{"name", "cube"}}},
            {"variant", {{"label", label}}},
            {"measurement", {{"name", "tried"}}},
            {"table", {{"columns", {{{"name", "max"}, {"header", "max [vx]"}, {"meaning", "an error"}}}}}},
            {"values", {{"max", error}}}};
  }
  void write_rows(const std::string& name, const std::vector<Json>& rows) {
    std::string text;
    for (const Json& row : rows) text += row.dump() + "\n";
    write(name, text);
  }
};

TEST_F(CompareTest, ExitCodesTellWhetherSomethingIsWorse) {
  write_rows("a.jsonl", {row_of("x", 1.0), row_of("y", 2.0)});
  write_rows("worse.jsonl", {row_of("x", 1.03), row_of("y", 2.0)});
  write_rows("fewer.jsonl", {row_of("x", 1.0)});
  EXPECT_EQ(run({"compare", "a.jsonl", "a.jsonl"}).exit_code, 0);
  const Outcome worse = run({"compare", "a.jsonl", "worse.jsonl"});
  EXPECT_EQ(worse.exit_code, 3);
  EXPECT_NE(worse.out.find("- tried: cube / x: max was 1, now 1.03 (+3.0 %)"), std::string::npos)
      << worse.out;
  EXPECT_EQ(run({"compare", "worse.jsonl", "a.jsonl"}).exit_code, 0) << "a smaller error is better";
  EXPECT_EQ(run({"compare", "a.jsonl", "worse.jsonl", "--tolerance", "4%"}).exit_code, 0);
  EXPECT_EQ(run({"compare", "a.jsonl", "worse.jsonl", "--tolerance", "0.02"}).exit_code, 3);
  EXPECT_EQ(run({"compare", "a.jsonl", "fewer.jsonl"}).exit_code, 3);
  EXPECT_EQ(run({"compare", "a.jsonl", "fewer.jsonl", "--allow-missing"}).exit_code, 0);
  EXPECT_EQ(run({"compare", "fewer.jsonl", "a.jsonl"}).exit_code, 0);
  EXPECT_EQ(Json::parse(run({"compare", "a.jsonl", "worse.jsonl", "--format", "json"}).out).at("regressions"),
            1);
  EXPECT_NE(run({"compare", "a.jsonl", "worse.jsonl", "--format", "junit"}).out.find("failures=\"1\""),
            std::string::npos);
}

TEST_F(CompareTest, RefusesWhatCannotBe) {
  write_rows("a.jsonl", {row_of("x", 1.0)});
  for (const char* tolerance : {"-1%", "much", "200%", "nan", "%"}) {
    const Outcome outcome = run({"compare", "a.jsonl", "a.jsonl", "--tolerance=" + std::string(tolerance)});
    EXPECT_EQ(outcome.exit_code, 2) << tolerance;
    EXPECT_NE(outcome.err.find("--tolerance"), std::string::npos) << outcome.err;
  }
  EXPECT_EQ(run({"compare", "a.jsonl", "nothing"}).exit_code, 1);
  EXPECT_EQ(run({"compare", "a.jsonl", "a.jsonl", "--format", "pdf"}).exit_code, 2);
}

TEST_F(CompareTest, AcceptedRowsAreTheBaseline) {
  write_rows("a.jsonl", {row_of("x", 1.0), row_of("y", 2.0)});
  EXPECT_EQ(run({"accept", "a.jsonl", "--baselines", "kept"}).exit_code, 2) << "without a reason";
  const Outcome first = run({"accept", "a.jsonl", "--baselines", "kept", "--reason", "the first"});
  ASSERT_EQ(first.exit_code, 0) << first.err;
  EXPECT_EQ(run({"compare", "kept/tried", "a.jsonl"}).exit_code, 0);
  write_rows("worse.jsonl", {row_of("x", 1.5), row_of("y", 2.0)});
  const Outcome second =
      run({"accept", "worse.jsonl", "--baselines", "kept", "--reason", "fewer triangles for it"});
  EXPECT_NE(second.out.find("max was 1, now 1.5"), std::string::npos) << second.out;
  EXPECT_EQ(run({"compare", "kept/tried", "worse.jsonl"}).exit_code, 0);
  Json dirty = row_of("x", 1.0);
  dirty["dirty"] = true;
  write_rows("dirty.jsonl", {dirty});
  EXPECT_EQ(run({"accept", "dirty.jsonl", "--baselines", "kept", "--reason", "hurry"}).exit_code, 1);
  EXPECT_NE(read("kept/tried/rows.jsonl").find("fewer triangles for it"), std::string::npos);
}

}  // namespace
}  // namespace hermesh::cli
