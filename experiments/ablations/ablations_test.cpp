#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <random>
#include <set>
#include <sstream>

#include "algorithms/core/error.h"
#include "experiments/ablations/effect_report.h"
#include "experiments/ablations/falsifier.h"
#include "experiments/ablations/paired_effect.h"
#include "experiments/ablations/prediction.h"
#include "experiments/ablations/read_ablation.h"
#include "experiments/cases/cases.h"
#include "experiments/harness/experiment_file.h"
#include "experiments/harness/harness.h"
#include "experiments/harness/provenance.h"
#include "experiments/harness/run_cells.h"

namespace hermesh {
namespace {

namespace fs = std::filesystem;

constexpr double kInfinite = std::numeric_limits<double>::infinity();

// ---- Statistics, by tables and by hand.

TEST(StudentQuantile, IsThatOfPrintedTables) {
  EXPECT_NEAR(student_quantile(0.975, 1), 12.706, 1e-3);
  EXPECT_NEAR(student_quantile(0.975, 2), 4.3027, 1e-4);
  EXPECT_NEAR(student_quantile(0.975, 3), 3.1824, 1e-4);
  EXPECT_NEAR(student_quantile(0.975, 7), 2.3646, 1e-4);
  EXPECT_NEAR(student_quantile(0.975, 10), 2.2281, 1e-4);
  EXPECT_NEAR(student_quantile(0.975, 120), 1.9799, 1e-4);
  EXPECT_NEAR(student_quantile(0.025, 7), -2.3646, 1e-4);
  EXPECT_NEAR(student_quantile(0.5, 4), 0.0, 1e-9);
}

TEST(StudentInterval, ByHand) {
  // The mean of 1, 2, 3, 4, 5 is 3, and its standard error √(2.5 / 5) = 0.70711; t of 4 degrees is 2.77645.
  const std::vector<double> values = {1, 2, 3, 4, 5};
  const Interval interval = student_interval(values);
  EXPECT_NEAR(interval.low, 3.0 - 2.77645 * 0.70711, 1e-4);
  EXPECT_NEAR(interval.high, 3.0 + 2.77645 * 0.70711, 1e-4);
}

TEST(EffectSize, ARatioIsTheGeometricMeanOverModels) {
  // The model a has the ratios 2 and 8, whose geometric mean is 4; b has 1. A model counts once: √(4 · 1)
  // = 2.
  const std::vector<PairedValues> pairs = {{"a", 1, 2}, {"a", 0.5, 4}, {"b", 3, 3}};
  const EffectSize size = effect_size(pairs, EffectMeasure::kRatio);
  EXPECT_NEAR(size.estimate, 2.0, 1e-12);
  EXPECT_EQ(size.models, 2u);
  EXPECT_EQ(size.pairs, 3u);
  // Logarithms ln 4 and 0: mean ln 2, standard error ln 2, t of one degree 12.7062.
  EXPECT_NEAR(std::log(size.student.high), std::log(2.0) * (1.0 + 12.7062), 1e-3);
  EXPECT_LE(size.interval.low, std::min(size.student.low, size.bootstrap.low));
  EXPECT_GE(size.interval.high, std::max(size.student.high, size.bootstrap.high));
}

TEST(EffectSize, DifferencesAndCountsByHand) {
  const std::vector<PairedValues> pairs = {{"a", 1, 4}, {"b", 0, 1}, {"c", 7, 0}};
  EXPECT_NEAR(effect_size(pairs, EffectMeasure::kDifference).estimate, (3.0 + 1.0 - 7.0) / 3.0, 1e-12);
  // (4 + 1) / (1 + 1), (1 + 1) / (0 + 1), (0 + 1) / (7 + 1).
  EXPECT_NEAR(effect_size(pairs, EffectMeasure::kCountRatio).estimate, std::cbrt(2.5 * 2.0 * 0.125), 1e-12);
}

TEST(EffectSize, CountsPairsThatHaveNoEffect) {
  const double none = std::numeric_limits<double>::quiet_NaN();
  const std::vector<PairedValues> pairs = {{"a", 0, 1}, {"a", 1, 0}, {"b", none, 1}, {"c", 2, 4}};
  const EffectSize size = effect_size(pairs, EffectMeasure::kRatio);
  EXPECT_EQ(size.left_out, 3u);
  EXPECT_EQ(size.pairs, 1u);
  EXPECT_NEAR(size.estimate, 2.0, 1e-12);
  EXPECT_EQ(size.interval.high, kInfinite) << "one model says nothing about others";
  EXPECT_EQ(effect_size(pairs, EffectMeasure::kDifference).left_out, 1u);
}

TEST(EffectSize, EqualValuesAreAPoint) {
  std::vector<PairedValues> pairs;
  for (const char* model : {"a", "b", "c", "d", "e"}) pairs.push_back({model, 2, 3});
  const EffectSize size = effect_size(pairs, EffectMeasure::kDifference);
  EXPECT_EQ(size.interval.low, 1.0);
  EXPECT_EQ(size.interval.high, 1.0);
}

TEST(BootstrapInterval, SeedDecidesAlone) {
  const std::vector<double> values = {0.3, 1.2, -0.4, 2.2, 0.9, 1.1, 0.2, 5.0};
  const Interval once = bootstrap_interval(values, 7), again = bootstrap_interval(values, 7),
                 other = bootstrap_interval(values, 8);
  EXPECT_EQ(once.low, again.low);
  EXPECT_EQ(once.high, again.high);
  EXPECT_NEAR(once.low, other.low, 0.1);
  // Skewed to the right, so that BCa reaches farther to the right of the mean 1.3125 than to its left.
  EXPECT_GT(once.high - 1.3125, 1.3125 - once.low);
  EXPECT_GE(once.low, -0.4);
  EXPECT_LE(once.high, 5.0);
}

/// How often the hull holds the true mean of draws from a distribution.
template <class Draw>
double coverage(std::size_t models, double truth, Draw&& draw) {
  constexpr int kTrials = 200;
  std::mt19937_64 random(20);
  int held = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::vector<PairedValues> pairs;
    for (std::size_t model = 0; model < models; ++model)
      pairs.push_back({std::to_string(model), 0.0, draw(random)});
    const Interval interval = effect_size(pairs, EffectMeasure::kDifference).interval;
    held += interval.low <= truth && truth <= interval.high;
  }
  return double(held) / kTrials;
}

// 200 trials tell a share of 95 % to 3 percentage points (two standard errors).
TEST(EffectSize, IntervalCoversTheTruthOfSyntheticData) {
  const double normal = coverage(
      8, 1.0, [](std::mt19937_64& random) { return std::normal_distribution<double>(1.0, 2.0)(random); });
  EXPECT_GE(normal, 0.92);
  EXPECT_LE(normal, 0.99);
  // Student's t alone falls to some 90 % for skewed data of eight models.
  const double skewed = coverage(
      8, 1.0, [](std::mt19937_64& random) { return std::exponential_distribution<double>(1.0)(random); });
  EXPECT_GE(skewed, 0.87);
}

// ---- Verdicts.

EffectSize sized(double low, double estimate, double high, std::size_t models = 8) {
  EffectSize size;
  size.estimate = estimate;
  size.interval = {low, high};
  size.models = models;
  size.pairs = 3 * models;
  return size;
}

TEST(Verdict, EachIsReached) {
  PredictedEffect predicted;
  predicted.at_least = 1.2;
  predicted.falsified_if = "high < 1.2";
  EXPECT_EQ(judge_prediction(predicted, sized(1.3, 1.5, 2.0)), PredictionVerdict::kHolds);
  EXPECT_EQ(judge_prediction(predicted, sized(1.0, 1.5, 2.0)), PredictionVerdict::kUndecided);
  EXPECT_EQ(judge_prediction(predicted, sized(0.9, 1.0, 1.1)), PredictionVerdict::kFalsified);
  predicted.at_most = 1.8;
  EXPECT_EQ(judge_prediction(predicted, sized(1.3, 1.5, 2.0)), PredictionVerdict::kUndecided);
  EXPECT_EQ(judge_prediction(predicted, sized(1.3, 1.5, 1.7)), PredictionVerdict::kHolds);
  EXPECT_EQ(judge_prediction(predicted, sized(0.9, 1.0, 1.1, kFewestModels - 1)),
            PredictionVerdict::kUndecided)
      << "too few models";
  EffectSize holes = sized(1.3, 1.5, 1.7);
  holes.left_out = holes.pairs + 1;
  EXPECT_EQ(judge_prediction(predicted, holes), PredictionVerdict::kUndecided)
      << "more pairs left out than compared";
}

TEST(FalsifierRule, BindsAndTighterThanOr) {
  const Falsifier rule("low > 3 or high < 1 and estimate <= 0.5");
  EXPECT_TRUE(rule.is_true_of(3.1, 4, 5));
  EXPECT_FALSE(rule.is_true_of(0.2, 0.8, 0.9));
  EXPECT_TRUE(rule.is_true_of(0.2, 0.5, 0.9));
  EXPECT_FALSE(rule.is_true_of(0.2, 0.5, 1.0));
}

TEST(FalsifierRule, NamesTheWordThatItDoesNotUnderstand) {
  for (const std::string wrong : {"", "high", "high <", "high < x", "mean < 1", "high = 1", "high < 1 and",
                                  "high < 1 but low > 2", "high < 1e999", "low > 3 or high"})
    EXPECT_THROW(Falsifier{wrong}, Error) << wrong;
  try {
    Falsifier("mean < 1");
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("\"mean\""), std::string::npos);
  }
}

TEST(FalsifierRule, MustFitThePrediction) {
  EXPECT_EQ(Falsifier("high < 1.2").misfit(1.2, kInfinite), "");
  EXPECT_NE(Falsifier("low < 1.3").misfit(1.2, kInfinite), "");
  EXPECT_NE(Falsifier("high < 1 and low > 2").misfit(1.2, kInfinite), "")
      << "no interval has its high end below its low one";
  EXPECT_EQ(Falsifier("high < -1 or low > 1").misfit(-1, 1), "");
}

// ---- Files.

/// What a file says, and what it predicts.
std::pair<Experiment, std::optional<Ablation>> read_both(const fs::path& file) {
  const Tables tables = all_tables();
  const Vocabulary vocabulary{tables.extractors, tables.voxelizers, tables.cases, column_names(),
                              tables.measurements};
  Experiment experiment = read_experiment(file, vocabulary);
  std::optional<Ablation> ablation = read_ablation(file, experiment, vocabulary);
  return {std::move(experiment), std::move(ablation)};
}

class AblationFile : public testing::Test {
 protected:
  void SetUp() override {
    root_ = fs::temp_directory_path() / ("hermesh-ablation-" + std::to_string(getpid()));
    fs::remove_all(root_);
    fs::create_directories(root_);
  }
  void TearDown() override { fs::remove_all(root_); }

  static std::string text(const std::string& effect = kEffect) {
    return R"(question = "Why?"
factor = "truncation"
levels = "variants"
baseline = "a"
voxelizers = ["hermesh"]
columns = ["triangles"]
variants = [{ name = "marching-cubes", label = "a" }, { name = "marching-cubes", label = "b", options = { crossings = "exact" } }]
)" + effect +
           R"(
[quick]
repetitions = 1
seconds_per_variant = 0
samples = 1000
pixels = 0
self_intersections = false
cases = [{ name = "torus", resolutions = [12] }]
)";
  }
  static std::string replaced(std::string text, const std::string& from, const std::string& to) {
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
  }
  fs::path write(const std::string& content) const {
    std::ofstream(root_ / "ablation_toy.toml") << content;
    return root_ / "ablation_toy.toml";
  }
  static std::optional<Ablation> read(const fs::path& file) { return read_both(file).second; }
  std::string complaint(const std::string& content) const {
    try {
      read(write(content));
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  }
  void git(const std::string& arguments) const {
    const std::string command = "git -C '" + root_.string() +
                                "' -c user.name=x -c user.email=x@y -c commit.gpgsign=false " + arguments +
                                " >/dev/null 2>&1";
    ASSERT_EQ(std::system(command.c_str()), 0) << command;
  }

  static constexpr const char* kEffect = R"(
[[effects]]
levels = ["b"]
column = "triangles"
measure = "ratio"
better = "lower"
at_least = 0.9
at_most = 1.1
falsified_if = "high < 0.9 or low > 1.1"
prediction = "The table does not see where points go: the triangles stay."
)";
  fs::path root_;
};

TEST_F(AblationFile, IsReadAndSurvivesARow) {
  const std::optional<Ablation> ablation = read(write(text()));
  ASSERT_TRUE(ablation);
  const Ablation again = ablation_from_json(Json::parse(to_json(*ablation).dump()));
  EXPECT_EQ(again.factor, "truncation");
  EXPECT_EQ(again.levels, LevelKind::kVariants);
  ASSERT_EQ(again.effects.size(), 1u);
  EXPECT_EQ(again.effects[0].level, "b");
  EXPECT_EQ(again.effects[0].at_most, 1.1);
  EXPECT_EQ(again.effects[0].measure, EffectMeasure::kRatio);
  EXPECT_TRUE(again.effects[0].lower_is_better);
  EXPECT_EQ(to_json(again), to_json(*ablation));
}

TEST_F(AblationFile, WithoutAPredictionIsRefusedInASentence) {
  const std::string whole = text();
  EXPECT_EQ(complaint(whole), "");
  EXPECT_EQ(complaint(text("")), "ablation_toy.toml:1: an experiment needs the key \"effects\"");
  EXPECT_EQ(complaint(replaced(
                whole, "prediction = \"The table does not see where points go: the triangles stay.\"", "")),
            "ablation_toy.toml:9: an effect needs the key \"prediction\"");
  EXPECT_EQ(complaint(replaced(replaced(whole, "at_least = 0.9", ""), "at_most = 1.1", "")),
            "ablation_toy.toml:9: a prediction needs its size: \"at_least\", \"at_most\", or both");
  EXPECT_NE(complaint(replaced(whole, "falsified_if = \"high < 0.9 or low > 1.1\"", ""))
                .find("needs the key \"falsified_if\""),
            std::string::npos);
}

TEST_F(AblationFile, WithWhatDoesNotFitIsRefused) {
  const std::string whole = text();
  const auto says = [&](const std::string& from, const std::string& to, const std::string& sentence) {
    EXPECT_NE(complaint(replaced(whole, from, to)).find(sentence), std::string::npos)
        << complaint(replaced(whole, from, to));
  };
  says("low > 1.1", "low > 1", "does not fit the prediction: it can be true of an interval within the range");
  says("low > 1.1", "middle > 1", "\"middle\" should not stand there");
  says("levels = [\"b\"]", "levels = [\"a\"]", "is the baseline itself");
  says("levels = [\"b\"]", "levels = [\"c\"]", "there is no level \"c\"");
  says("baseline = \"a\"", "baseline = \"c\"", "there is no level \"c\"");
  says("column = \"triangles\"", "column = \"trianglez\"", "there is no column \"trianglez\"");
  says("at_most = 1.1", "at_most = 0.1", "\"at_most\" is below \"at_least\"");
  says("levels = \"variants\"", "levels = \"voxelizers\"", "needs two levels");
  says("factor = \"truncation\"", "", "makes the file an ablation");
}

// ---- The prediction's commit.

TEST_F(AblationFile, ThePredictionIsOfTheLastCommitThatTouchedIt) {
  const fs::path file = write(text());
  EXPECT_NE(text_at(prediction_of(file), "/note").find("is not committed"), std::string::npos)
      << "no checkout";
  git("init -q .");
  EXPECT_NE(text_at(prediction_of(file), "/note").find("is not committed"), std::string::npos);
  git("add ablation_toy.toml");
  EXPECT_NE(text_at(prediction_of(file), "/note").find("is not committed"), std::string::npos)
      << "added is not committed";
  git("commit -q -m one");
  const std::string first = checked_out(root_).commit;
  EXPECT_EQ(text_at(prediction_of(file), "/commit"), first);
  EXPECT_FALSE(find(prediction_of(file), "/note"));
  std::ofstream(root_ / "other") << "text";
  git("add other");
  git("commit -q -m two");
  EXPECT_EQ(text_at(prediction_of(file), "/commit"), first)
      << "the other file's commit is none of the prediction's";
  write(text() + "# changed\n");
  EXPECT_NE(text_at(prediction_of(file), "/note").find("was changed since it was committed"),
            std::string::npos);
  git("commit -q -a -m three");
  EXPECT_EQ(text_at(prediction_of(file), "/commit"), checked_out(root_).commit);
}

TEST_F(AblationFile, ARowNamesAPredictionThatIsOlder) {
  const fs::path file = write(text());
  git("init -q .");
  git("add .");
  git("commit -q -m one");
  const std::string first = checked_out(root_).commit;
  Json row = {{"commit", first},
              {"date", "2999-01-01T00:00:00Z"},
              {"ablation", {{"prediction", prediction_of(file)}}}};
  EXPECT_EQ(prediction_problem(row, root_), "");
  row["date"] = "2001-01-01T00:00:00Z";
  EXPECT_NE(prediction_problem(row, root_).find("younger than the row"), std::string::npos);
  row["date"] = "2999-01-01T00:00:00Z";
  write(text() + "# changed\n");
  git("commit -q -a -m two");
  row["ablation"]["prediction"] = prediction_of(file);
  EXPECT_NE(prediction_problem(row, root_).find("is not before the row's"), std::string::npos)
      << "the row is of the first commit";
  row["commit"] = checked_out(root_).commit;
  EXPECT_EQ(prediction_problem(row, root_), "");
  row["ablation"]["prediction"]["sha256"] = std::string(64, '0');
  EXPECT_NE(prediction_problem(row, root_).find("is not the file that the row names"), std::string::npos);
  row["ablation"]["prediction"] = {{"file", "x"}, {"note", "the prediction in x is not committed"}};
  EXPECT_EQ(prediction_problem(row, root_), "the prediction in x is not committed");
  EXPECT_EQ(prediction_problem({{"commit", first}}, root_), "") << "no ablation";
}

TEST_F(AblationFile, RowsToBeKeptAreRefusedWithoutACommittedPrediction) {
  const fs::path file = write(text());
  RunContext context;
  std::ostringstream table;
  const fs::path kept = experiments_folder().parent_path() / "results" / "ablation_that_must_not_be_kept";
  try {
    run_experiment(RunSettings{file, "quick", kept, ""}, context, table);
    ADD_FAILURE() << "a run without a committed prediction was not refused";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("commit"), std::string::npos);
  }
  EXPECT_FALSE(fs::exists(kept));
  EXPECT_THROW(check_prediction(prediction_of(file), kept), Error);
  EXPECT_NO_THROW(check_prediction(prediction_of(file), root_));
}

TEST_F(AblationFile, ARunElsewhereSaysInItsRowsThatNothingWasPredictedBeforehand) {
  RunContext context;
  std::ostringstream table;
  const fs::path out = root_ / "rows";
  EXPECT_EQ(run_experiment(RunSettings{write(text()), "quick", out, ""}, context, table), 0) << table.str();
  const std::vector<Json> rows = read_rows(out);
  ASSERT_EQ(rows.size(), 2u);
  for (const Json& row : rows)
    EXPECT_NE(text_at(row, "/ablation/prediction/note").find("not committed"), std::string::npos);
  const std::vector<JudgedAblation> judged = judge_ablations(rows);
  ASSERT_EQ(judged.size(), 1u);
  EXPECT_EQ(judged[0].subjects, 1u);
  EXPECT_EQ(judged[0].effects[0].size.estimate, 1.0)
      << "marching cubes has the same triangles wherever its points go";
  EXPECT_NE(table.str().find("### effects of truncation"), std::string::npos);
  std::ostringstream report;
  write_report(out, "md", report);
  EXPECT_NE(report.str().find("undecided, not predicted beforehand"), std::string::npos) << report.str();
}

// ---- Reports from rows by hand.

std::vector<Json> rows_by_hand(double factor) {
  Ablation ablation{"truncation", LevelKind::kVariants, "a", {}};
  ablation.effects.push_back({"b", "triangles", EffectMeasure::kRatio, true, "Half of them stay.", 0.4, 0.6,
                              "low > 0.6 or high < 0.4"});
  std::vector<Json> rows;
  for (int model = 0; model < 8; ++model)
    for (const int resolution : {48, 96, 192})
      for (const std::string label : {"a", "b"}) {
        Json row = {{"experiment", "ablation_toy"},
                    {"tier", "full"},
                    {"question", "Why?"},
                    {"run", "1"},
                    {"commit", "1234567890abcdef"},
                    {"columns", {"triangles"}},
                    {"case", {{"name", "model " + std::to_string(model)}}},
                    {"resolution", resolution},
                    {"variant", {{"name", "toy"}, {"label", label}}},
                    {"triangle_count", 1000.0 * resolution * (label == "b" ? factor + 0.001 * model : 1.0)}};
        row["ablation"] = to_json(ablation);
        row["ablation"]["prediction"] = {
            {"file", "x.toml"}, {"commit", "abcdef1234567890"}, {"date", "2026-01-01T00:00:00Z"}};
        rows.push_back(row);
      }
  return rows;
}

TEST(AblationReport, PairsModelsAndJudges) {
  const std::vector<JudgedAblation> judged = judge_ablations(rows_by_hand(0.5));
  ASSERT_EQ(judged.size(), 1u);
  EXPECT_EQ(judged[0].subjects, 24u);
  const JudgedEffect& effect = judged[0].effects[0];
  EXPECT_EQ(effect.size.models, 8u);
  EXPECT_EQ(effect.size.pairs, 24u);
  EXPECT_NEAR(effect.size.estimate, 0.5035, 1e-4);
  EXPECT_EQ(effect.verdict, PredictionVerdict::kHolds);
  EXPECT_EQ(judge_ablations(rows_by_hand(0.9))[0].effects[0].verdict, PredictionVerdict::kFalsified);
  std::ostringstream out;
  write_effects(judged[0], out);
  EXPECT_NE(out.str().find("| b | a | triangles | ratio | lower | 8 | 24 | 0 | 0.503 |"), std::string::npos)
      << out.str();
  EXPECT_NE(out.str().find("0.4 to 0.6 | low > 0.6 or high < 0.4 | holds |"), std::string::npos) << out.str();
  const std::string summary = summary_of(judged);
  EXPECT_NE(summary.find("Of 1 ablations 1 predictions hold, 0 are falsified, and 0 are undecided."),
            std::string::npos)
      << summary;
}

TEST(AblationReport, LeavesOutFailedCellsAndRowsOfAnOlderPrediction) {
  std::vector<Json> rows = rows_by_hand(0.5);
  rows[1]["failed"] = "it fell apart";
  rows[2]["ablation"]["baseline"] = "z";
  const JudgedEffect effect = judge_ablations(rows)[0].effects[0];
  EXPECT_EQ(effect.size.left_out, 1u);
  EXPECT_EQ(effect.size.pairs, 22u);
}

TEST(AblationReport, DrawsAForestPlot) {
  const fs::path folder = fs::temp_directory_path() / ("hermesh-forest-" + std::to_string(getpid()));
  fs::create_directories(folder);
  std::ostringstream out;
  write_forest_plots(judge_ablations(rows_by_hand(0.5)), folder, out);
  const fs::path script = folder / "ablation_toy-full-effects.gp";
  ASSERT_TRUE(fs::exists(script)) << out.str();
  std::ifstream file(script);
  std::stringstream text;
  text << file.rdbuf();
  EXPECT_NE(text.str().find("set logscale x"), std::string::npos);
  EXPECT_NE(text.str().find("'b: triangles' 1"), std::string::npos) << text.str();
  for (const char* extension : {".png", ".pdf", ".svg"}) {
    const fs::path drawn = fs::path(script).replace_extension(extension);
    ASSERT_TRUE(fs::exists(drawn)) << drawn << ": experiments/install_packages.sh installs gnuplot";
    EXPECT_GT(fs::file_size(drawn), 2000U) << drawn;
  }
  fs::remove_all(folder);
}

// ---- What comes with the project.

TEST(ShippedAblations, ParseAndHaveEightModelsByThreeInFull) {
  std::size_t ablations = 0;
  for (const ExperimentInfo& info : list_experiments()) {
    if (!info.name.starts_with("ablation_")) continue;
    SCOPED_TRACE(info.name);
    ++ablations;
    EXPECT_EQ(experiment_file(info.name), info.file);
    const auto [experiment, ablation] = read_both(info.file);
    ASSERT_TRUE(ablation);
    ASSERT_TRUE(experiment.tiers.contains("quick"));
    ASSERT_TRUE(experiment.tiers.contains("full"));
    if (experiment.kind == ExperimentKind::kMeasurement) continue;  // its function says what its subjects are
    std::set<std::string> models;
    for (const CaseEntry& entry : experiment.tiers.at("full").cases) {
      models.insert(entry.name);
      const std::size_t others =
          ablation->levels == LevelKind::kResolutions ? experiment.variants.size() : entry.resolutions.size();
      EXPECT_GE(others, 3u) << entry.name;
    }
    EXPECT_GE(models.size(), 8u);
  }
  EXPECT_GE(ablations, 16u);
}

}  // namespace
}  // namespace hermesh
