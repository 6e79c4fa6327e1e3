#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>

#include "experiments/cases/cases.h"
#include "experiments/harness/current_plots.h"
#include "experiments/harness/harness.h"
#include "experiments/harness/table.h"

namespace hermesh {
namespace {

/// A row by hand: voxel size 0.5, distances in world units, half a mebibyte and a bit.
Json row_of(const std::string& run, const std::string& label, double seconds) {
  return {
      {"experiment", "headline"},
      {"tier", "quick"},
      {"question", "why?"},
      {"run", run},
      {"commit", "0123456789abcdef"},
      {"dirty", true},
      {"columns", {"triangles", "seconds", "to_max", "peak_mib", "promises"}},
      {"case",
       {{"name", "ball"}, {"origin", "data folder"}, {"sha256", "abcdef0123456789"}, {"triangles", 1280}}},
      {"resolution", 40},
      {"voxel_size", 0.5},
      {"variant", {{"name", "toy"}, {"label", label}, {"options", "size=1"}}},
      {"voxelization", {{"name", "openvdb"}}},
      {"triangle_count", 1234567},
      {"report", {{"points", 12}, {"to_reference", {{"max", 0.125}}}}},
      {"peak_bytes", 1572864},
      {"seconds", {{"median", seconds}, {"minimum", seconds}}},
      {"promise_letters", "c kept"},
      {"broken", Json::array()}};
}

std::string markdown(const std::vector<Json>& rows) {
  std::ostringstream out;
  for (const RowGroup& group : latest_groups(rows)) write_markdown(group, out);
  return out.str();
}

std::vector<std::string> lines_with(const std::string& text, const std::string& part) {
  std::vector<std::string> found;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);)
    if (line.find(part) != std::string::npos) found.push_back(line);
  return found;
}

TEST(Readable, ThreeDigitsAndThousands) {
  EXPECT_EQ(readable(0), "0");
  EXPECT_EQ(readable(999), "999");
  EXPECT_EQ(readable(1000), "1,000");
  EXPECT_EQ(readable(-1234567), "-1,234,567");
  EXPECT_EQ(readable(-999), "-999");
  EXPECT_EQ(readable(0.123456), "0.123");
  EXPECT_EQ(readable(12.3456), "12.3");
  EXPECT_EQ(readable(999.7), "1,000");
  EXPECT_EQ(readable(1e-9), "1e-09");
  EXPECT_EQ(readable(std::numeric_limits<double>::infinity()), "inf");
}

TEST(Markdown, ShowsTheColumnsThatTheRowNamesInTheirUnits) {
  const std::string table = markdown({row_of("1", "a", 0.25), row_of("1", "b | c", 2.5)});
  ASSERT_EQ(lines_with(table, "| variant").size(), 1u);
  EXPECT_EQ(lines_with(table, "| variant")[0],
            "| variant | triangles | time [s] | to max [vx] | peak [MiB] | promises |");
  EXPECT_EQ(lines_with(table, "| a ")[0],
            "| a       | 1,234,567 |     0.25 |        0.25 |        1.5 | c kept   |");
  EXPECT_EQ(lines_with(table, "b \\| c").size(), 1u);
  EXPECT_EQ(lines_with(table, "data folder, sha256 abcdef012345, 1,280 triangles").size(), 1u);
  EXPECT_EQ(lines_with(table, "commit 0123456789ab with changes").size(), 1u);
}

TEST(Markdown, AlignsLettersThatAreSeveralBytes) {
  const std::string table = markdown({row_of("1", "Aldén", 1.0), row_of("1", "Alden", 1.0)});
  EXPECT_EQ(lines_with(table, "Aldén")[0].size(), lines_with(table, "Alden")[0].size() + 1);
}

TEST(Markdown, AbsentValuesAreDashesAndTroubleIsLoud) {
  Json failed = row_of("1", "bad", 1.0);
  failed.erase("report");
  failed.erase("seconds");
  failed["failed"] = "it ran out of luck";
  Json broken = row_of("1", "liar", 1.0);
  broken["broken"] = {"closed (5 boundary edges)"};
  broken["disagreements"] = {"CGAL: counts 6"};
  broken["unchecked"] = {"no self-intersection"};
  broken["repetitions_differ"] = true;
  const std::string table = markdown({failed, broken});
  EXPECT_EQ(lines_with(table, "| bad ")[0].find("0.25"), std::string::npos);
  EXPECT_NE(lines_with(table, "| bad ")[0].find("–"), std::string::npos);
  EXPECT_EQ(lines_with(table, "FAILED: bad on ball at resolution 40: it ran out of luck").size(), 1u);
  EXPECT_EQ(lines_with(table, "BROKEN: liar on ball at resolution 40: closed (5 boundary edges)").size(), 1u);
  EXPECT_EQ(
      lines_with(table, "DISAGREEMENT of the judges: liar on ball at resolution 40: CGAL: counts 6").size(),
      1u);
  EXPECT_EQ(lines_with(table, "UNCHECKED: liar").size(), 1u);
  EXPECT_EQ(lines_with(table, "NOT DETERMINISTIC: liar").size(), 1u);
}

TEST(Markdown, StandInsAreLoud) {
  Json row = row_of("1", "a", 1.0);
  row["case"]["origin"] = "stand-in: the registry was out of reach";
  EXPECT_EQ(lines_with(markdown({row}), "STAND-IN DATA").size(), 1u);
}

TEST(Markdown, RowsOfOtherProgramsAreNamed) {
  const auto row = [](const char* run, const char* label, const char* commit) {
    Json result = row_of(run, label, 1.0);
    result["table"]["additive"] = true;
    result["commit"] = commit;
    return result;
  };
  const std::vector<Json> pieces = {row("1", "a", "0123456789abcdef"), row("2", "b", "fedcba9876543210"),
                                    row("2", "c", "fedcba9876543210")};
  EXPECT_EQ(lines_with(markdown(pieces), "; 2 rows of commit fedcba987654").size(), 1u);
  EXPECT_TRUE(lines_with(markdown({pieces[0]}), "rows of commit").empty());
}

TEST(Groups, TheLatestRunIsShownAndTheOthersAreCounted) {
  Json other_size = row_of("1", "a", 1.0);
  other_size["resolution"] = 80;
  const std::vector<RowGroup> groups =
      latest_groups({row_of("1", "a", 1.0), row_of("1", "b", 1.0), other_size, row_of("2", "a", 3.0)});
  ASSERT_EQ(groups.size(), 2u);
  ASSERT_EQ(groups[0].rows.size(), 1u);
  EXPECT_EQ(groups[0].rows[0]["run"], "2");
  EXPECT_EQ(groups[0].earlier_runs, 1);
  EXPECT_EQ(groups[1].earlier_runs, 0);
}

TEST(Groups, RunsOfAnAdditiveTableAddUp) {
  const auto row = [](const char* run, const char* label) {
    Json result = row_of(run, label, 1.0);
    result["table"]["additive"] = true;
    return result;
  };
  const std::vector<RowGroup> groups =
      latest_groups({row("1", "a"), row("1", "b"), row("2", "b"), row("3", "c")});
  ASSERT_EQ(groups.size(), 1u);
  ASSERT_EQ(groups[0].rows.size(), 3u);
  EXPECT_EQ(groups[0].rows[0]["run"], "1");
  EXPECT_EQ(groups[0].rows[1]["run"], "2");
  EXPECT_EQ(groups[0].rows[2]["run"], "3");
  EXPECT_EQ(groups[0].earlier_runs, 0);

  // Rows of two runs that stand among each other, as when files were joined by hand, are all there.
  const std::vector<RowGroup> mixed =
      latest_groups({row("1", "a"), row("2", "b"), row("1", "c"), row("2", "d"), row("1", "e")});
  ASSERT_EQ(mixed.size(), 1u);
  EXPECT_EQ(mixed[0].rows.size(), 5u);

  Json coarse = row("1", "a"), fine = row("2", "a");
  coarse["values"]["resolution"] = 50;
  fine["values"]["resolution"] = 400;
  const std::vector<RowGroup> sorted = latest_groups({coarse, row("1", "b"), fine});
  ASSERT_EQ(sorted[0].rows.size(), 3u);
  EXPECT_EQ(sorted[0].rows[1], fine);
}

TEST(Latex, EscapesWhatLatexWouldRead) {
  std::ostringstream out;
  write_latex({{row_of("1", "50 % of a_b & {c}", 1.0)}, 0}, out);
  EXPECT_EQ(
      lines_with(out.str(), "50 \\% of a\\_b \\& \\{c\\} & 1,234,567 & 1 & 0.25 & 1.5 & c kept \\\\").size(),
      1u);
  EXPECT_EQ(lines_with(out.str(), "\\begin{tabular}{lrrrrr}").size(), 1u);
}

TEST(Csv, HasEveryRowEveryColumnAndNumbersInFull) {
  std::ostringstream out;
  write_csv({row_of("1", "a, \"b\"", 0.123456789), row_of("2", "c", 1.0)}, out);
  std::istringstream lines(out.str());
  std::string head, first, second, none;
  std::getline(lines, head);
  std::getline(lines, first);
  std::getline(lines, second);
  EXPECT_FALSE(std::getline(lines, none));
  for (const std::string& name : column_names())
    EXPECT_NE(("," + head + ",").find("," + name + ","), std::string::npos);
  EXPECT_NE(first.find("\"a, \"\"b\"\"\""), std::string::npos);
  EXPECT_NE(first.find(",0.123456789,"), std::string::npos);
  EXPECT_NE(first.find(",1234567,"), std::string::npos);
  EXPECT_EQ(std::count(second.begin(), second.end(), ','), std::count(head.begin(), head.end(), ','));
}

TEST(Report, UnknownFormatsAndEmptyFoldersAreErrors) {
  const auto folder = std::filesystem::temp_directory_path() / ("hermesh-report-" + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  std::ostringstream out;
  EXPECT_THROW(write_report(folder, "md", out), Error);
  append_row(folder / "rows.jsonl", row_of("1", "a", 1.0));
  EXPECT_THROW(write_report(folder, "html", out), Error);
  EXPECT_EQ(out.str(), "");
  for (const std::string format : {"md", "csv", "tex"}) {
    std::ostringstream text;
    write_report(folder, format, text);
    EXPECT_NE(text.str().find("ball"), std::string::npos) << format;
  }
  std::filesystem::remove_all(folder);
}

/// A row of somebody's own experiment that has the name of one of the project's is drawn as it asks itself.
TEST(Report, RowsOfOnesOwnKeepTheirPlots) {
  Json row = row_of("1", "mine", 1.0);
  row["plots"] = Json::array();
  const auto folder = std::filesystem::temp_directory_path() / ("hermesh-own-" + std::to_string(getpid()));
  EXPECT_EQ(with_current_plots({row}, folder)[0].at("plots").size(), 0U);
  const std::filesystem::path results = experiments_folder().parent_path() / "results";
  EXPECT_EQ(with_current_plots({row}, results / "local" / "headline")[0].at("plots").size(), 0U);
  row["experiment"] = "pareto";
  EXPECT_GT(with_current_plots({row}, results / "pareto")[0].at("plots").size(), 0U);
}

}  // namespace
}  // namespace hermesh
