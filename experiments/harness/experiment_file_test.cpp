#include "experiments/harness/experiment_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

namespace hermesh {
namespace {

/// A vocabulary of one variant with two options, one voxelizer, two cases and three columns.
class ExperimentFile : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("hermesh-experiment-" + std::to_string(getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  Experiment read(const std::string& text) {
    std::ofstream(folder_ / "toy.toml") << text;
    return read_experiment(
        folder_ / "toy.toml",
        {extractors_, voxelizers_, {"ball", "cube"}, {"points", "seconds", "promises", "swept"}});
  }
  /// What read() complains of; empty when it does not.
  std::string complaint(const std::string& text) {
    try {
      read(text);
      return "";
    } catch (const Error& error) {
      return error.what();
    }
  }
  /// The valid file with one line replaced. The first line has the number 1.
  static std::string valid(int line = 0, const std::string& replacement = "") {
    std::vector<std::string> lines = {"question = \"why?\"",
                                      "voxelizers = [\"plain\"]",
                                      "columns = [\"points\", \"seconds\"]",
                                      "[[variants]]",
                                      "name = \"toy\"",
                                      "options = { size = 2.5, mode = \"fast\" }",
                                      "[quick]",
                                      "repetitions = 3",
                                      "seconds_per_variant = 0.5",
                                      "cases = [{ name = \"ball\", resolutions = [10, 20] }]"};
    if (line > 0) lines[static_cast<std::size_t>(line - 1)] = replacement;
    std::string text;
    for (const std::string& l : lines) text += l + "\n";
    return text;
  }

  std::filesystem::path folder_;
  const std::vector<OptionSpec> options_ = {{"size", "1", "", {}, 0.0, 10.0},
                                            {"mode", "slow", "", {"slow", "fast"}}};
  const std::vector<Extractor> extractors_ = {{"toy", "a toy", {}, options_, nullptr}};
  const std::vector<Voxelizer> voxelizers_ = {{"plain", "plain", options_, nullptr}};
};

TEST_F(ExperimentFile, ReadsEveryKey) {
  const Experiment e = read(
      "question = \"why?\"\nvoxelizers = [\"plain\"]\ncolumns = [\"seconds\", \"points\"]\nfeatures = 25\n"
      "[[variants]]\nname = \"toy\"\nlabel = \"toy, fast\"\noptions = { size = 2, mode = \"fast\" }\n"
      "[[variants]]\nname = \"toy\"\nuniform = \"toy, fast\"\n"
      "[full]\nrepetitions = 4\nseconds_per_variant = 2\nsamples = 77\npixels = 0\nself_intersections = "
      "false\n"
      "cases = [{ name = \"cube\", resolutions = [8, 16], closeup = [0.1, 0.2, 0.3, 0.5], view = [10, -20] "
      "}]\n");
  EXPECT_EQ(e.name, "toy");
  EXPECT_EQ(e.question, "why?");
  EXPECT_EQ(e.columns, (std::vector<std::string>{"seconds", "points"}));
  EXPECT_EQ(e.features, 25.0);
  ASSERT_EQ(e.variants.size(), 2u);
  EXPECT_EQ(e.variants[0].label, "toy, fast");
  EXPECT_EQ(e.variants[0].options, (std::map<std::string, std::string>{{"size", "2"}, {"mode", "fast"}}));
  EXPECT_EQ(e.variants[1].label, "toy");
  EXPECT_EQ(e.variants[0].uniform, "");
  EXPECT_EQ(e.variants[1].uniform, "toy, fast");
  ASSERT_EQ(e.tiers.size(), 1u);
  const Tier& tier = e.tiers.at("full");
  EXPECT_EQ(tier.repetitions, 4);
  EXPECT_EQ(tier.seconds_per_variant, 2.0);
  EXPECT_EQ(tier.samples, 77);
  EXPECT_EQ(tier.pixels, 0);
  EXPECT_FALSE(tier.self_intersections);
  ASSERT_EQ(tier.cases.size(), 1u);
  EXPECT_EQ(tier.cases[0].resolutions, (std::vector<int>{8, 16}));
  EXPECT_EQ(tier.cases[0].close_up.centre, (std::array<double, 3>{0.1, 0.2, 0.3}));
  EXPECT_EQ(tier.cases[0].close_up.size, 0.5);
  EXPECT_EQ(tier.cases[0].viewpoint.azimuth, 10.0);
  EXPECT_EQ(tier.cases[0].viewpoint.elevation, -20.0);
}

TEST_F(ExperimentFile, OptionNumbersKeepTheirValue) {
  EXPECT_EQ(read(valid()).variants[0].options.at("size"), "2.5");
  const std::string third =
      read(valid(6, "options = { size = 0.33333333333333331 }")).variants[0].options.at("size");
  EXPECT_EQ(std::stod(third), 0.33333333333333331);
}

TEST_F(ExperimentFile, TheUniformMeshIsThatOfAVariantAbove) {
  EXPECT_NE(complaint(valid(6, "uniform = \"fast\"")).find("no variant with the label \"fast\" above"), std::string::npos);
}

TEST_F(ExperimentFile, EveryMistakeNamesFileAndLine) {
  ASSERT_EQ(complaint(valid()), "");
  const std::vector<std::tuple<int, std::string, std::string>> mistakes = {
      {1, "question = 3", "question"},
      {1, "question = \"\"", "question"},
      {1, "qustion = \"why?\"", "unknown key \"qustion\""},
      {1, "question = \"why?", ""},  // a syntax error
      {2, "voxelizers = [\"plane\"]", "no voxelizer \"plane\""},
      {2, "voxelizers = \"plain\"", "must be a list"},
      {2, "voxelizers = []", "not empty"},
      {3, "columns = [\"points\", \"pionts\"]", "no column \"pionts\""},
      {3, "columns = [\"points\", \"points\"]", "named twice"},
      {5, "name = \"tpy\"", "no variant \"tpy\"; there are toy"},
      {5, "title = \"toy\"", "unknown key \"title\""},
      {6, "options = { siez = 2 }", "siez"},
      {6, "options = { size = 11 }", "size"},
      {6, "options = { mode = \"medium\" }", "medium"},
      {6, "options = { mode = [1] }", "mode"},
      {6, "options = 3", "must be a table"},
      {7, "[quik]", "unknown key \"quik\""},
      {8, "repetitions = 0", "repetitions"},
      {8, "repetitions = 2.5", "repetitions"},
      {8, "repetition = 3", "unknown key \"repetition\""},
      {9, "seconds_per_variant = -1", "seconds_per_variant"},
      {9, "samples = \"many\"", "samples"},
      {9, "self_intersections = 1", "self_intersections"},
      {10, "cases = [{ name = \"bell\", resolutions = [10] }]", "no case \"bell\", nor such a file; there are ball, cube"},
      {10, "cases = [{ name = \"ball\", resolutions = [1] }]", "resolutions"},
      {10, "cases = [{ name = \"ball\", resolutions = [] }]", "resolutions"},
      {10, "cases = [{ name = \"ball\", resolution = [10] }]", "unknown key \"resolution\""},
      {10, "cases = [{ name = \"ball\", resolutions = [10], closeup = [1, 2, 3] }]", "closeup"},
      {10, "cases = [{ name = \"ball\", resolutions = [10], view = [\"left\", 0] }]", "view"},
  };
  for (const auto& [line, replacement, expected] : mistakes) {
    const std::string sentence = complaint(valid(line, replacement));
    EXPECT_TRUE(sentence.starts_with("toy.toml:" + std::to_string(line) + ": "))
        << replacement << " -> " << sentence;
    EXPECT_NE(sentence.find(expected), std::string::npos) << replacement << " -> " << sentence;
  }
}

/// A valid experiment on voxelization with one line replaced.
std::string voxelization(int line = 0, const std::string& replacement = "") {
  std::vector<std::string> lines = {
      "kind = \"voxelization\"",
      "question = \"why?\"",
      "columns = [\"seconds\"]",
      "exterior_band = 2",
      "[[voxelizers]]",
      "name = \"plain\"",
      "[[voxelizers]]",
      "name = \"plain\"",
      "label = \"plain, fast\"",
      "options = { mode = \"fast\" }",
      "[[plots]]",
      "name = \"p\"",
      "title = \"t\"",
      "case = \"ball\"",
      "x = \"swept\"",
      "y = [\"seconds\"]",
      "x_label = \"x\"",
      "y_label = \"y\"",
      "log_x = true",
      "[quick]",
      "components = true",
      "cases = [{ name = \"ball\", resolutions = [10], distances = \"all\", signs = \"parity\", solid = "
      "\"cube\" },",
      "  { name = \"cube\", voxel_sizes = [2, 0.5], length = 7, published_seconds = [1, 3], distances = 99, "
      "to_boundary = true, "
      "signs = \"winding-number\" },",
      "  { name = \"cube\", voxel_sizes = [1], sweep = { side = [1, 2.5] }, signs = \"parity\", sign_samples "
      "= 50 }]"};
  if (line > 0) lines[static_cast<std::size_t>(line - 1)] = replacement;
  std::string text;
  for (const std::string& l : lines) text += l + "\n";
  return text;
}

TEST_F(ExperimentFile, ReadsEveryKeyOfVoxelization) {
  const Experiment e = read(voxelization());
  EXPECT_EQ(e.kind, ExperimentKind::kVoxelization);
  EXPECT_EQ(e.exterior_band, 2.0);
  EXPECT_EQ(e.interior_band, 3.0);
  ASSERT_EQ(e.contenders().size(), 2u);
  EXPECT_EQ(e.contenders()[1].label, "plain, fast");
  EXPECT_EQ(e.contenders()[1].options.at("mode"), "fast");
  EXPECT_EQ(e.plots, (std::vector<Plot>{{.name = "p",
                                         .title = "t",
                                         .case_name = "ball",
                                         .x = "swept",
                                         .y = {"seconds"},
                                         .x_label = "x",
                                         .y_label = "y",
                                         .log_x = true}}));
  const Tier& tier = e.tiers.at("quick");
  EXPECT_TRUE(tier.components);
  ASSERT_EQ(tier.cases.size(), 3u);
  const JudgedBy &first = tier.cases[0].judged, &second = tier.cases[1].judged, &third = tier.cases[2].judged;
  EXPECT_EQ(first.distances, JudgedBy::kAll);
  EXPECT_EQ(first.signs, JudgedBy::Signs::kParity);
  EXPECT_EQ(first.sign_samples, JudgedBy::kAll);
  EXPECT_EQ(first.solid, "cube");
  EXPECT_EQ(tier.cases[1].voxel_sizes, (std::vector<double>{2, 0.5}));
  EXPECT_EQ(tier.cases[1].length, 7.0);
  EXPECT_EQ(tier.cases[1].published_seconds, (std::vector<double>{1, 3}));
  EXPECT_EQ(second.distances, 99);
  EXPECT_TRUE(second.to_boundary);
  EXPECT_FALSE(first.to_boundary);
  EXPECT_EQ(second.signs, JudgedBy::Signs::kWinding);
  EXPECT_EQ(second.sign_samples, 10'000);
  ASSERT_TRUE(tier.cases[2].sweep);
  EXPECT_EQ(tier.cases[2].sweep->parameter, "side");
  EXPECT_EQ(tier.cases[2].sweep->values, (std::vector<double>{1, 2.5}));
  EXPECT_FALSE(third.distances);
  EXPECT_EQ(third.sign_samples, 50);
}

TEST_F(ExperimentFile, MistakesOfVoxelizationNameTheirLine) {
  ASSERT_EQ(complaint(voxelization()), "");
  const std::vector<std::tuple<int, std::string, std::string>> mistakes = {
      {1, "kind = \"voxels\"", "one of extraction, voxelization"},
      {2, "question = \"why?\"\nvariants = 3", ""},
      {4, "exterior_band = 0.5", "exterior_band"},
      {6, "name = \"plane\"", "no voxelizer \"plane\"; there are plain"},
      {9, "", ""},  // the label is used twice
      {10, "options = { mood = \"fast\" }", "mood"},
      {10, "uniform = \"plain\"", "unknown key \"uniform\""},
      {14, "case = \"bell\"", "no case"},
      {15, "x = \"sweep\"", "no column"},
      {19, "logarithm = true", "unknown key"},
      {21, "samples = 5", "unknown key \"samples\""},
      {22, "cases = [{ name = \"ball\" },", "resolutions"},
      {22, "cases = [{ name = \"ball\", resolutions = [10], view = [1, 2] },", "unknown key \"view\""},
      {22, "cases = [{ name = \"ball\", resolutions = [10], voxel_sizes = [1] },", "either"},
      {22, "cases = [{ name = \"ball\", resolutions = [10], distances = \"some\" },", "one of all"},
      {22, "cases = [{ name = \"ball\", resolutions = [10], distances = 0 },", "distances"},
      {22, "cases = [{ name = \"ball\", resolutions = [10], signs = \"guess\" },", "one of none, parity"},
      {22,
       "cases = [{ name = \"ball\", resolutions = [10], signs = \"winding-number\", sign_samples = \"all\" "
       "},",
       "only parity"},
      {22, "cases = [{ name = \"ball\", resolutions = [10], solid = \"bell\" },", "no case \"bell\""},
      {23, "  { name = \"cube\", voxel_sizes = [2], published_seconds = [1, 3] },", "for every voxel size"},
      {23, "  { name = \"cube\", voxel_sizes = [0] },", "voxel_sizes"},
      {24, "  { name = \"cube\", voxel_sizes = [1], sweep = { a = [1], b = [2] } }]", "sweep"},
      {24, "  { name = \"cube\", voxel_sizes = [1], sweep = { a = 1 } }]", "must be a list"},
  };
  for (const auto& [line, replacement, expected] : mistakes) {
    const std::string sentence = complaint(voxelization(line, replacement));
    EXPECT_TRUE(sentence.starts_with("toy.toml:")) << replacement << " -> " << sentence;
    if (!expected.empty()) {
      EXPECT_TRUE(sentence.starts_with("toy.toml:" + std::to_string(line) + ": "))
          << replacement << " -> " << sentence;
    }
    EXPECT_NE(sentence.find(expected), std::string::npos) << replacement << " -> " << sentence;
  }
}

TEST_F(ExperimentFile, ExtractionTakesVoxelizersWithOptionsAndNothingOfVoxelization) {
  const std::string tables = "voxelizers = [{ name = \"plain\", label = \"p\", options = { size = 2 } }]";
  const Experiment e = read(valid(2, tables));
  ASSERT_EQ(e.voxelizers.size(), 1u);
  EXPECT_EQ(e.voxelizers[0].label, "p");
  EXPECT_EQ(e.voxelizers[0].options.at("size"), "2");
  EXPECT_NE(complaint(valid(3, "columns = [\"points\"]\nexterior_band = 3")).find("needs kind"),
            std::string::npos);
}

TEST_F(ExperimentFile, MissingKeysAreNamed) {
  EXPECT_NE(complaint(valid(1)).find("needs the key \"question\""), std::string::npos);
  EXPECT_NE(complaint(valid(10)).find("needs the key \"cases\""), std::string::npos);
  EXPECT_NE(complaint(valid(5)).find("needs the key \"name\""), std::string::npos);
  EXPECT_NE(complaint("question = \"why?\"\nvoxelizers = [\"plain\"]\ncolumns = [\"points\"]\n"
                      "variants = [{ name = \"toy\" }]\n")
                .find("[quick] or [full]"),
            std::string::npos);
}

TEST_F(ExperimentFile, LabelsAreUnique) {
  const std::string sentence = complaint(
      "question = \"why?\"\nvoxelizers = [\"plain\"]\ncolumns = [\"points\"]\n"
      "variants = [\n  { name = \"toy\" },\n  { name = \"toy\", options = { size = 3 } },\n]\n");
  EXPECT_TRUE(sentence.starts_with("toy.toml:6: ")) << sentence;
  EXPECT_NE(sentence.find("used twice"), std::string::npos);
}

TEST_F(ExperimentFile, MissingFileIsAnError) {
  EXPECT_THROW(read_experiment(folder_ / "none.toml", {extractors_, voxelizers_, {}, {}}), Error);
  EXPECT_THROW(read_head(folder_ / "none.toml"), Error);
}

TEST_F(ExperimentFile, QuestionAlone) {
  read(valid());
  EXPECT_EQ(read_head(folder_ / "toy.toml").question, "why?");
}

}  // namespace
}  // namespace hermesh
