#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <functional>
#include <sstream>

#include "algorithms/core/error.h"
#include "experiments/cases/cases.h"
#include "experiments/harness/unit_box_for_tests.h"
#include "experiments/harness/sha256.h"
#include "experiments/ledger/claims.h"
#include "experiments/ledger/pages.h"
#include "experiments/ledger/stale.h"
#include "experiments/measurements/measurements.h"
#include "reference/variants.h"

namespace hermesh {
namespace {

namespace fs = std::filesystem;

/// A row of an extraction: distances are in world units, and a voxel is half a unit.
Json extraction_row(const std::string& label, double seconds, double distance, const std::string& run = "first") {
  return {{"experiment", "race"},
          {"tier", "quick"},
          {"run", run},
          {"commit", std::string(40, 'a')},
          {"dirty", false},
          {"case", {{"name", "ball"}, {"origin", "data folder"}, {"sha256", "abc"}}},
          {"resolution", 40},
          {"voxel_size", 0.5},
          {"columns", {"seconds", "to_max"}},
          {"variant", {{"name", "toy"}, {"label", label}, {"options", "size=1"}}},
          {"report", {{"to_reference", {{"max", distance}}}}},
          {"broken", {"one", "two"}},
          {"seconds", {{"median", seconds}}}};
}

/// A row of a measurement with a column "points", and one that is named like a column that all tables have.
Json measured_row(const std::string& label, int points) {
  return {{"experiment", "count"},
          {"tier", "quick"},
          {"run", "first"},
          {"commit", std::string(40, 'a')},
          {"dirty", false},
          {"measurement", {{"name", "count"}}},
          {"case", {{"name", "thesis"}}},
          {"variant", {{"name", label}, {"label", label}}},
          {"table",
           {{"title", "t"},
            {"first_column", "threshold"},
            {"columns",
             {{{"name", "points"}, {"header", "points"}, {"meaning", "m"}},
              {{"name", "threads"}, {"header", "threads"}, {"meaning", "m"}}}}}},
          {"threads", 2},
          {"values", {{"points", points}, {"threads", 7}}}};
}

std::string error_in(const std::function<void()>& work) {
  try {
    work();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

Json value(const RowDatabase& rows, const std::string& query) { return rows.first_row(query).at(0).second; }

TEST(Claims, APlaceNamesTablesAndFigures) {
  const auto is = [](const std::string& place, const std::string& number) {
    Claim claim;
    claim.place = place;
    return is_of(claim, number);
  };
  EXPECT_TRUE(is("figures 9.8 to 9.10", "figure_9_9"));
  EXPECT_FALSE(is("figures 9.8 to 9.10", "figure_9_11"));
  EXPECT_FALSE(is("figures 9.8 to 9.10", "table_9_9"));
  EXPECT_TRUE(is("tables 9.1 and 9.4", "table_9_4"));
  EXPECT_FALSE(is("tables 9.1 and 9.4", "table_9_3"));
  EXPECT_TRUE(is("table 9.1, implied", "table_9_1"));
  EXPECT_FALSE(is("figure 9.15", "figure_9_1"));
  EXPECT_FALSE(is("section 9.1", "table_9_1"));
  EXPECT_TRUE(is("table 9.2", "Table 9.2"));
  EXPECT_FALSE(is("table 9.2", "9.2"));
}

TEST(RowDatabase, HasTheColumnsOfReportsInTheirUnits) {
  RowDatabase rows;
  rows.add("race", {extraction_row("slow", 2.0, 0.25), extraction_row("fast", 0.5, 0.5)});
  EXPECT_EQ(value(rows, "SELECT to_max FROM race WHERE label = 'slow'"), 0.5);
  EXPECT_EQ(value(rows, "SELECT max(seconds) / min(seconds) FROM race"), 4.0);
  EXPECT_EQ(value(rows, "SELECT median(seconds) FROM race"), 1.25);
  EXPECT_EQ(value(rows, "SELECT subject || ' ' || resolution || ' ' || input FROM race"), "ball 40 abc");
  EXPECT_EQ(value(rows, "SELECT broken FROM race"), 2);
  EXPECT_EQ(value(rows, "SELECT row ->> '$.report.to_reference.max' FROM race"), 0.25);
  EXPECT_TRUE(value(rows, "SELECT median(seconds) FROM race WHERE label = 'none'").is_null());
  EXPECT_EQ(rows.tables_in("SELECT 1 FROM race, racetrack"), std::vector<std::string>{"race"});
}

TEST(RowDatabase, AMeasurementsOwnColumnComesBeforeTheCommonOne) {
  RowDatabase rows;
  rows.add("count", {measured_row("0", 12)});
  EXPECT_EQ(value(rows, "SELECT points FROM count WHERE subject = 'thesis' AND label = '0'"), 12);
  EXPECT_EQ(value(rows, "SELECT threads FROM count"), 7);
}

TEST(RowDatabase, TakesTheLastRunOfACell) {
  RowDatabase rows;
  rows.add("race", {extraction_row("toy", 2.0, 1.0), extraction_row("toy", 3.0, 1.0, "second")});
  EXPECT_EQ(value(rows, "SELECT count(*) FROM race"), 1);
  EXPECT_EQ(value(rows, "SELECT seconds FROM race"), 3.0);
}

TEST(RowDatabase, ComplainsInSqlitesWords) {
  RowDatabase rows;
  rows.add("race", {extraction_row("toy", 2.0, 1.0)});
  EXPECT_NE(error_in([&] { rows.first_row("SELECT absent FROM race"); }).find("no such column: absent"), std::string::npos);
  EXPECT_NE(error_in([&] { rows.first_row("SELECT 1; DROP TABLE race"); }).find("more than one statement"), std::string::npos);
  EXPECT_NE(error_in([&] { rows.first_row("SELECT 1 FROM nowhere"); }).find("no such table: nowhere"), std::string::npos);
  EXPECT_NE(error_in([&] { rows.add("race", {}); }).find("there is a table race already"), std::string::npos);
}

/// A checkout by hand: claims, numbers, a page, and results of two experiments.
class Ledger : public testing::Test {
 protected:
  void SetUp() override {
    root_ = fs::temp_directory_path() / ("hermesh-ledger-" + std::to_string(getpid()));
    for (const char* folder : {"paper", "results/race", "results/count", "results/tests", "experiments"})
      fs::create_directories(root_ / folder);
    write("results/race/rows.jsonl",
          extraction_row("slow", 2.0, 0.25).dump() + "\n" + extraction_row("fast", 0.5, 0.5).dump() + "\n");
    write("results/count/rows.jsonl", measured_row("0", 1000).dump() + "\n" + measured_row("50", 240).dump() + "\n");
    Json passed = measured_row("Suite.Passes", 1), failed = measured_row("Suite.Fails", 1);
    for (Json* row : {&passed, &failed})
      (*row)["table"]["columns"].push_back({{"name", "passed"}, {"header", "p"}, {"meaning", "m"}});
    passed["values"]["passed"] = 1;
    failed["values"]["passed"] = 0;
    write("results/tests/rows.jsonl", passed.dump() + "\n" + failed.dump() + "\n");
    write("experiments/cases.toml",
          "[[case]]\nname = \"ball\"\nsummary = \"x\"\nfiles = [{ file = \"ball.obj\", sha256 = \"abc\", source = \"x\", "
          "licence = \"y\" }]\ntriangles = 20\nstand_in = \"noise-sphere\"\n");
    write("paper/claims.toml", claim("one", kRule));
    write("paper/numbers.toml", "pages = [\"page.md\"]\n[numbers]\nspeed = \"SELECT max(seconds) / min(seconds) FROM race\"\n"
                                "range = { query = \"SELECT min(points), max(points) FROM count\", format = \"%.1f\" }\n"
                                "[plain]\nall = [\"Debian 12\"]\n\"page.md\" = [\"no 7\"]\n");
    write("page.md", "It is <!--=speed-->?<!--/--> times as fast on Debian 12, see table 9.2 of 2011, no 7.\n");
  }
  void TearDown() override { fs::remove_all(root_); }

  static std::string claim(const std::string& id, const std::string& rule, const std::string& kind = "measured") {
    return "[[claim]]\nid = \"" + id + "\"\nplace = \"table 1\"\nsays = \"It says.\"\nkind = \"" + kind + "\"\n" + rule + "\n";
  }
  static constexpr const char* kRule =
      "printed = 4\nours = \"SELECT a.points * 1.0 / b.points AS reduction FROM count a, count b WHERE a.label = '0' AND "
      "b.label = '50'\"\nreproduced = \"abs(reduction / printed - 1) < 0.01\"\nshape = \"abs(reduction / printed - 1) < "
      "0.1\"\ndoctored = \"UPDATE count SET points = 100 WHERE label = '50'\"";
  void write(const std::string& name, const std::string& text) const { std::ofstream(root_ / name) << text; }
  std::string read(const std::string& name) const {
    std::ifstream file(root_ / name);
    std::ostringstream text;
    text << file.rdbuf();
    return text.str();
  }
  Judged judged(const std::string& rule, const std::string& kind = "measured") const {
    write("paper/claims.toml", claim("one", rule, kind));
    RowDatabase rows;
    rows.add_folders(root_ / "results");
    return judge(read_claims(root_ / "paper" / "claims.toml").at(0), rows);
  }
  std::string complaint(const std::string& rule, const std::string& kind = "measured") const {
    write("paper/claims.toml", claim("one", rule, kind));
    return error_in([&] { read_claims(root_ / "paper" / "claims.toml"); });
  }
  std::vector<std::string> cannot_fail(const std::string& rule) const {
    write("paper/claims.toml", claim("one", rule));
    RowDatabase rows;
    rows.add_folders(root_ / "results");
    return rules_that_cannot_fail(read_claims(root_ / "paper" / "claims.toml").at(0), rows);
  }
  fs::path root_;
};

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

TEST_F(Ledger, AVerdictFollowsFromTheRows) {
  const Judged shape = judged(kRule);  // 1000 / 240 = 4.17 beside 4
  EXPECT_EQ(shape.verdict, Verdict::shape);
  ASSERT_EQ(shape.figures.size(), 1u);
  EXPECT_EQ(shape.figures[0].first, "reduction");
  EXPECT_NEAR(shape.figures[0].second.get<double>(), 4.1667, 1e-4);
  EXPECT_EQ(judged(replaced(kRule, "printed = 4", "printed = 4.15")).verdict, Verdict::reproduced);
  const std::string wrong = replaced(kRule, "printed = 4", "printed = 5");
  EXPECT_EQ(judged(wrong).verdict, Verdict::missing);
  EXPECT_NE(judged(wrong).reason.find("does not explain"), std::string::npos);
  EXPECT_EQ(judged(wrong + "\nwhy = [\"One.\", \"Two.\"]").verdict, Verdict::contradicted);
  EXPECT_EQ(judged("untestable = \"no host\"", "untestable").verdict, Verdict::untestable);
}

TEST_F(Ledger, WhatIsNotThereIsMissing) {
  EXPECT_NE(judged(replaced(kRule, "b.label = '50'", "b.label = '60'")).reason.find("no such row of count"), std::string::npos);
  EXPECT_EQ(judged(replaced(kRule, "count b", "nowhere b")).reason, "there are no rows of nowhere");
  EXPECT_NE(judged(replaced(kRule, "a.points * 1.0 / b.points", "nullif(1, 1)")).reason.find("do not have reduction: count"),
            std::string::npos);
  EXPECT_NE(error_in([&] { judged(replaced(kRule, "b.points", "b.pints")); }).find("claim one: no such column"),
            std::string::npos);
}

TEST_F(Ledger, TestsDecide) {
  EXPECT_EQ(judged("tests = \"Suite.Passes\"", "exact").verdict, Verdict::reproduced);
  EXPECT_EQ(judged("tests = \"Suite.Passes\"\npassed = \"shape reproduced\"", "exact").verdict, Verdict::shape);
  EXPECT_EQ(judged("tests = [\"Suite.Passes\", \"Suite.Fails\"]", "exact").reason, "the test Suite.Fails failed");
  EXPECT_EQ(judged("tests = \"Suite.Never\"", "exact").reason, "there is no row of the test Suite.Never");
  EXPECT_EQ(judged(std::string(kRule) + "\ntests = \"Suite.Fails\"").verdict, Verdict::missing);
}

TEST_F(Ledger, ARuleThatCannotFailIsFound) {
  EXPECT_TRUE(cannot_fail(kRule).empty());
  EXPECT_TRUE(cannot_fail("tests = \"Suite.Passes\"").empty());
  const auto useless = cannot_fail(replaced(kRule, "points = 100 WHERE", "points = 241 WHERE"));
  ASSERT_EQ(useless.size(), 1u);
  EXPECT_NE(useless[0].find("does not change the verdict"), std::string::npos);
  const auto idle = cannot_fail(replaced(kRule, "WHERE label = '50'\"", "WHERE label = '60'\""));
  ASSERT_EQ(idle.size(), 1u);
  EXPECT_NE(idle[0].find("changes no row"), std::string::npos);
  EXPECT_EQ(cannot_fail(replaced(kRule, "\"abs(reduction / printed - 1) < 0.01\"", "\"1 = 1\"")).size(), 1u);
}

TEST_F(Ledger, MistakesInTheFileAreNamed) {
  EXPECT_NE(complaint("").find("needs a rule"), std::string::npos);
  EXPECT_NE(complaint("tests = \"A.B\"", "guessed").find("claims.toml:5: \"kind\" must be"), std::string::npos);
  EXPECT_NE(complaint("tests = \"A.B\"\nverdict = \"reproduced\"").find("unknown key \"verdict\""), std::string::npos);
  EXPECT_NE(complaint("ours = \"SELECT 1 AS a\"\nreproduced = \"a = 1\"").find("no \"doctored\" row"), std::string::npos);
  write("paper/claims.toml", claim("one", kRule) + claim("one", kRule));
  EXPECT_NE(error_in([&] { read_claims(root_ / "paper" / "claims.toml"); }).find("two claims one"), std::string::npos);
}

TEST_F(Ledger, RowsThatAreNoLongerMadeAreAWarning) {
  Json stale = measured_row("race", 1), fresh = measured_row("count", 1);
  for (Json* row : {&stale, &fresh})
    (*row)["table"]["columns"].push_back({{"name", "differing"}, {"header", "d"}, {"meaning", "m"}});
  stale["values"]["differing"] = 2;
  fresh["values"]["differing"] = 0;
  fs::create_directories(root_ / "results/stale");
  write("results/stale/rows.jsonl", stale.dump() + "\n" + fresh.dump() + "\n");
  const Judged warned = judged("ours = \"SELECT seconds FROM race\"\nreproduced = \"seconds = 2\"\ndoctored = \"UPDATE race SET seconds = 1\"");
  EXPECT_EQ(warned.warnings, std::vector<std::string>{"race has rows that the program no longer makes"});
  EXPECT_TRUE(judged(kRule).warnings.empty());
}

TEST_F(Ledger, RowsOfAChangedTreeAreAWarning) {
  Json dirty = extraction_row("slow", 2.0, 0.25);
  dirty["dirty"] = true;
  dirty["case"]["origin"] = "stand-in: ball";
  write("results/race/rows.jsonl", dirty.dump() + "\n");
  const Judged warned = judged("ours = \"SELECT seconds FROM race\"\nreproduced = \"seconds = 2\"\ndoctored = \"UPDATE race SET seconds = 1\"");
  EXPECT_EQ(warned.verdict, Verdict::reproduced);
  EXPECT_EQ(warned.warnings, (std::vector<std::string>{"race has rows of a tree with changes", "race has rows of stand-ins"}));
}

TEST_F(Ledger, PagesAreFilledAndStayAsTheyAre) {
  EXPECT_FALSE(Pages(root_).problems().empty());
  const auto changed = Pages(root_).fill();
  EXPECT_NE(std::find(changed.begin(), changed.end(), "page.md"), changed.end());
  EXPECT_EQ(read("page.md"), "It is <!--=speed-->4<!--/--> times as fast on Debian 12, see table 9.2 of 2011, no 7.\n");
  EXPECT_TRUE(Pages(root_).problems().empty()) << Pages(root_).problems().at(0);
  EXPECT_TRUE(Pages(root_).fill().empty());
  write("paper/numbers.toml", read("paper/numbers.toml") + "[tables]\nall = \"SELECT label AS which, seconds AS 'time [s]' FROM race\"\n");
  write("page.md", "<!--=all--><!--/-->\n");
  Pages(root_).fill();
  EXPECT_EQ(read("page.md"), "<!--=all-->\n| which | time [s] |\n| --- | --: |\n| slow | 2 |\n| fast | 0.5 |\n<!--/-->\n");
  write("page.md", "From <!--=range-->-<!--/-->, <!--=count reproduced-->-<!--/--> of <!--=count-->-<!--/-->.\n<!--=table race ball 40-->\n<!--/-->\n");
  Pages(root_).fill();
  EXPECT_TRUE(read("page.md").starts_with("From <!--=range-->240.0 to 1000.0<!--/-->, <!--=count reproduced-->0<!--/--> of <!--=count-->1<!--/-->.\n"))
      << read("page.md");
  EXPECT_NE(read("page.md").find("| slow    |        2 |         0.5 |"), std::string::npos) << read("page.md");
}

/// Whatever is changed by hand is found: a digit of a page, a digit of a table, a row, a hash.
TEST_F(Ledger, WhatIsChangedByHandIsFound) {
  write("page.md", "<!--=speed-->?<!--/-->\n<!--=table race ball 40-->\n<!--/-->\n");
  Pages(root_).fill();
  ASSERT_TRUE(Pages(root_).problems().empty());
  for (const std::string file : {"page.md", "results/race/table.md", "results/count/table.md", "results/race/rows.jsonl",
                                 "results/count/rows.jsonl", "results/SHA256SUMS", "experiments/cases.toml"}) {
    const std::string good = read(file);
    // Each digit of the results, and of the case's hash the letters.
    std::vector<std::size_t> places;
    for (std::size_t at = 0; at < good.size(); ++at)
      if (file == "experiments/cases.toml" ? good.compare(at, 3, "abc") == 0 : std::isdigit(static_cast<unsigned char>(good[at])) != 0)
        places.push_back(at);
    ASSERT_FALSE(places.empty()) << file;
    for (std::size_t i = 0; i < places.size(); i += 1 + places.size() / 20) {
      std::string bad = good;
      bad[places[i]] = bad[places[i]] == '7' ? '8' : '7';
      write(file, bad);
      bool found = false;
      try {
        found = !Pages(root_).problems().empty();
      } catch (const Error&) {
        found = true;
      }
      EXPECT_TRUE(found) << file << " at byte " << places[i];
    }
    write(file, good);
  }
}

// ---- Rows that the program no longer makes.

/// Voxelizes a ball with two toy variants, and keeps their rows.
class Stale : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("hermesh-stale-test-" + std::to_string(getpid()));
    fs::create_directories(folder_);
    const auto voxelizers = reference_voxelizers();
    tables_.voxelizers = {voxelizers.begin(), voxelizers.end()};
    tables_.extractors = {{"copier", "", {}, {{"size", "1", "", {}, 0, 9}}, [](const ExtractionInput& input) { return *input.source; }},
                          {"openvdb", "", {}, {}, [](const ExtractionInput& input) { return *input.source; }}};
    tables_.cases = {"box"};
    tables_.load = [this](const std::string& name, RunContext&) {
      return LoadedCase{name, unit_box(), "generated", sha256_};
    };
    tables_.measurements = {{"count", "", {{"up", "3", "", {}, 0, 9}}, {{"numbers", "numbers", "number", {{"value", "value", ""}, {"seconds", "time [s]", ""}}}},
                             [this](const MeasurementInput& input) {
                               std::vector<MeasuredRow> rows;
                               for (int i = 0; i < 3; ++i)
                                 rows.push_back({"numbers", std::to_string(i), {{"value", i + factor_ * int(input.parameters.number("up"))}, {"seconds", ++calls_}}});
                               return rows;
                             }}};
    write("cells.toml", "question = \"why?\"\nvoxelizers = [\"openvdb\"]\ncolumns = [\"points\"]\n"
                        "variants = [{ name = \"copier\", options = { size = 2 } }, { name = \"openvdb\" }]\n"
                        "[quick]\nrepetitions = 1\nsamples = 500\npixels = 0\ncases = [{ name = \"box\", resolutions = [12, 16] }]\n");
    write("numbers.toml", "kind = \"measurement\"\nmeasurement = \"count\"\nquestion = \"why?\"\n[quick]\nup = 5\n");
    for (const char* name : {"cells", "numbers"})
      run_experiment({folder_ / (std::string(name) + ".toml"), "quick", folder_ / name, ""}, tables_, context_, said_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  void write(const std::string& name, const std::string& text) const { std::ofstream(folder_ / name) << text; }
  FolderCheck check(const std::string& name, const std::function<void(Json&)>& change = {}) {
    std::vector<Json> rows = read_rows(folder_ / name / "rows.jsonl");
    if (change) std::ranges::for_each(rows, change);
    return check_folder(rows, 1, tables_, folder_ / "scratch", context_);
  }

  fs::path folder_;
  Tables tables_;
  RunContext context_;
  std::ostringstream said_;
  std::string sha256_ = "abc";
  int factor_ = 1, calls_ = 0;
};

TEST_F(Stale, WhatComesOutAsBeforeIsNot) {
  const FolderCheck cells = check("cells");
  EXPECT_EQ(cells.rows, 4U);
  EXPECT_EQ(cells.tried, 2U);  // of the cheaper resolution
  EXPECT_EQ(cells.by_digest, 2U);
  EXPECT_EQ(cells.differing, 0U) << cells.difference;
  EXPECT_EQ(cells.skipped, "");
  const FolderCheck numbers = check("numbers");
  EXPECT_EQ(numbers.tried, 1U);
  EXPECT_EQ(numbers.differing, 0U) << numbers.difference;  // though the time is another
}

TEST_F(Stale, WhatComesOutOtherwiseIsNamed) {
  tables_.extractors[0].extract = [](const ExtractionInput& input) {
    PolygonMesh mesh = *input.source;
    mesh.points[0].x() += 0.25f;
    return mesh;
  };
  const FolderCheck cells = check("cells");
  EXPECT_EQ(cells.differing, 1U);
  EXPECT_NE(cells.difference.find("/copier: digest was "), std::string::npos) << cells.difference;
  factor_ = 2;
  const FolderCheck numbers = check("numbers");
  EXPECT_EQ(numbers.differing, 1U);
  EXPECT_EQ(numbers.difference, "numbers/0: values/value was 5, now 10");
}

TEST_F(Stale, WhatCanNoLongerBeMadeIsStale) {
  tables_.extractors.erase(tables_.extractors.begin());
  const FolderCheck cells = check("cells");
  EXPECT_EQ(cells.differing, 2U);
  EXPECT_NE(cells.difference.find("copier"), std::string::npos) << cells.difference;
  tables_.measurements.clear();
  EXPECT_EQ(check("numbers").differing, 1U);
}

/// An option that is gone, or had no effect, is stale only if the mesh is another without it.
TEST_F(Stale, AnOptionThatIsGoneMattersByWhatComesOut) {
  tables_.extractors[0].options.clear();
  EXPECT_EQ(check("cells").differing, 0U) << check("cells").difference;
}

TEST_F(Stale, RowsWithoutDigestsAreComparedByCounts) {
  const auto forget = [](Json& row) { row.erase("digest"); };
  EXPECT_EQ(check("cells", forget).differing, 0U);
  EXPECT_EQ(check("cells", forget).by_digest, 0U);
  const auto miscount = [](Json& row) {
    row.erase("digest");
    row["triangle_count"] = 11;
  };
  EXPECT_EQ(check("cells", miscount).differing, 2U);
}

TEST_F(Stale, OtherInputsAndStandInsProveNothing) {
  sha256_ = "def";
  const FolderCheck other = check("cells");
  EXPECT_EQ(other.tried, 0U);
  EXPECT_EQ(other.skipped, "box is not at hand as the rows have it");
  sha256_ = "abc";
  EXPECT_EQ(check("cells", [](Json& row) { row["case"]["origin"] = "stand-in: no network"; }).tried, 0U);
}

TEST(Orphans, AreNumbersOutsideOfMarkersCodeAndPlaces) {
  const auto found = [](const std::string& text) { return orphans(text, {"Debian 12"}); };
  EXPECT_EQ(found("It is 14.5 times\nas fast as 1,000 others."), (std::vector<std::string>{"1: 14.5", "2: 1,000"}));
  EXPECT_TRUE(found("`-o tolerance=0.1`, [x](page-2.md), <!--=a-->5.1 to 7<!--/-->, x86-64, C++20, Debian 12").empty());
  EXPECT_TRUE(found("tables 9.1 to 9.4, figures 9.15 and 9.16, §5.2, chapter 6, in 2011").empty());
  EXPECT_EQ(found("table 9.2 has 12 rows"), std::vector<std::string>{"1: 12"});
  EXPECT_EQ(found("```\n12\n```\n13"), std::vector<std::string>{"4: 13"});
}

TEST_F(Ledger, AMarkerWithoutAnEndIsAMistake) {
  write("page.md", "<!--=speed-->4\n");
  EXPECT_NE(error_in([&] { Pages(root_).fill(); }).find("page.md:1: this marker has no end"), std::string::npos);
  write("page.md", "\n<!--=sped-->4<!--/-->\n");
  EXPECT_NE(error_in([&] { Pages(root_).fill(); }).find("page.md:2: paper/numbers.toml has no number sped"), std::string::npos);
  write("paper/numbers.toml", "pages = [\"page.md\"]\n[numbers]\nx = { query = \"SELECT 1\", format = \"%s\" }\n");
  EXPECT_NE(error_in([&] { Pages(root_).fill(); }).find("numbers.toml:3: \"format\" must hold one of"), std::string::npos);
}

/// The rules of the project can fail: each doctored row of paper/claims.toml changes the verdict of its claim.
TEST(ProjectClaims, EveryRuleCanFail) {
  const fs::path root = experiments_folder().parent_path();
  RowDatabase rows;
  rows.add_folders(root / "results");
  int tried = 0;
  for (const Claim& claim : read_claims(root / "paper" / "claims.toml")) {
    for (const std::string& wrong : rules_that_cannot_fail(claim, rows)) ADD_FAILURE() << claim.id << ": " << wrong;
    ++tried;
  }
  EXPECT_GE(tried, 130);
}

}  // namespace
}  // namespace hermesh
