#include "experiments/ledger/baseline.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "algorithms/core/error.h"
#include "experiments/harness/rows.h"

namespace hermesh {
namespace {

Json row_of(const std::string& label, const std::string& run = "1") {
  return {{"experiment", "digests"}, {"run", run},
          {"commit", "1234"},        {"dirty", false},
          {"case", {{"name", "a"}}}, {"variant", {{"label", label}}}};
}

std::string refusal(const std::vector<Json>& rows, const std::string& reason = "right",
                    bool with_failures = false) {
  try {
    accepted(rows, reason, with_failures);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(Accepted, TakesTheLastRunAndSaysWhy) {
  Json first = row_of("x", "1");
  first["failed"] = "earlier";
  const AcceptedRows rows =
      accepted({first, row_of("x", "2"), row_of("y", "2")}, "the code of normals is repaired", false);
  EXPECT_EQ(rows.experiment, "digests");
  ASSERT_EQ(rows.rows.size(), 2u);
  EXPECT_EQ(rows.rows[0]["run"], "2");
  EXPECT_EQ(rows.rows[0]["accepted"]["reason"], "the code of normals is repaired");
  EXPECT_EQ(rows.rows[0]["accepted"]["commit"], "1234");
  EXPECT_EQ(rows.rows[0]["accepted"]["date"].get<std::string>().size(), 20u);
}

TEST(Accepted, RefusesWhatProvesNothing) {
  const auto with = [](const char* key, const Json& value) {
    Json row = row_of("x");
    row[key] = value;
    return row;
  };
  EXPECT_EQ(refusal({row_of("x")}), "");
  EXPECT_NE(refusal({row_of("x")}, " ").find("--reason"), std::string::npos);
  EXPECT_NE(refusal({with("dirty", true)}).find("changes"), std::string::npos);
  EXPECT_NE(refusal({with("dirty", nullptr)}).find("changes"), std::string::npos);
  EXPECT_NE(refusal({with("commit", "unknown")}).find("changes"), std::string::npos);
  EXPECT_NE(refusal({with("failed", "out of luck")}).find("out of luck"), std::string::npos);
  EXPECT_NE(refusal({with("broken", {"closed"})}).find("promise"), std::string::npos);
  EXPECT_EQ(refusal({with("failed", "out of luck")}, "as printed", true), "");
  EXPECT_NE(refusal({row_of("x"), with("experiment", "other")}).find("experiment"), std::string::npos);
  EXPECT_NE(refusal({row_of("x"),
                     [&] {
                       Json row = row_of("y");
                       row["commit"] = "5";
                       return row;
                     }()})
                .find("commit"),
            std::string::npos);
  EXPECT_NE(refusal({with("experiment", "../x")}).find("experiment"), std::string::npos);
}

TEST(WriteBaseline, ReplacesTheOneBefore) {
  const auto folder =
      std::filesystem::temp_directory_path() / ("hermesh-baseline-" + std::to_string(getpid()));
  write_baseline(accepted({row_of("x"), row_of("y")}, "first", false), folder);
  const auto file = write_baseline(accepted({row_of("z")}, "second", false), folder);
  EXPECT_EQ(file, folder / "digests" / "rows.jsonl");
  const std::vector<Json> rows = read_rows(file);
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0]["accepted"]["reason"], "second");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(file.parent_path()), {}), 1);
  std::filesystem::remove_all(folder);
  EXPECT_THROW(write_baseline(accepted({row_of("z")}, "third", false), "/proc/nowhere"), Error);
}

}  // namespace
}  // namespace hermesh
