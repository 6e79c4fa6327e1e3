#include "experiments/pictures/plot.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

namespace hermesh {
namespace {

class PlotFiles : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("hermesh-plot's-" + std::to_string(getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  Json row(const std::string& label, double x, double share, const std::string& name = "ball") const {
    return {{"experiment", "toy"},
            {"run", "1"},
            {"case", {{"name", name}}},
            {"variant", {{"name", "v"}, {"label", label}}},
            {"sweep", {{"parameter", "hole"}, {"value", x}}},
            {"signs", {{"wrong_share", share}}},
            {"published_seconds", 10 * x},
            {"plots", Json::array({to_json(plot_)})}};
  }
  std::string draw(const std::vector<Json>& rows) {
    std::ostringstream said;
    write_plots(rows, folder_, said);
    return said.str();
  }
  std::string text(const std::string& name) const {
    std::ifstream stream(folder_ / name);
    return {std::istreambuf_iterator<char>(stream), {}};
  }

  std::filesystem::path folder_;
  Plot plot_{.name = "p",
             .title = "it's a title",
             .x = "swept",
             .y = {"wrong_share", "published_seconds"},
             .x_label = "hole [voxel]",
             .y_label = "wrong [%]",
             .percent = true};
};

TEST_F(PlotFiles, SurviveJson) { EXPECT_EQ(plot_from_json(to_json(plot_)), plot_); }

TEST_F(PlotFiles, HaveACurveForEveryLabelInTheOrderOfX) {
  plot_.y = {"wrong_share"};
  const std::string said = draw({row("a", 2, 0.5), row("b", 2, 0.1), row("a", 1, 0.25), row("b", 1, 0.0)});
  EXPECT_EQ(text("toy-p.dat"), "# a\n1 25\n2 50\n\n\n# b\n1 0\n2 10\n\n\n");
  EXPECT_NE(text("toy-p.gp").find("title 'b'"), std::string::npos);
  EXPECT_NE(text("toy-p.gp").find("set title 'it''s a title'"), std::string::npos);
  EXPECT_NE(said.find("toy-p"), std::string::npos);
  if (said.starts_with("Plot: ")) {  // else there is no gnuplot here
    EXPECT_GT(std::filesystem::file_size(folder_ / "toy-p.png"), 5000u);
    EXPECT_NE(text("toy-p.svg").find("<svg"), std::string::npos);
  }
}

TEST_F(PlotFiles, JoinTheLabelsOfAVariant) {
  plot_.y = {"wrong_share"};
  plot_.by_variant = true;
  EXPECT_EQ(plot_from_json(to_json(plot_)), plot_);
  draw({row("a", 2, 0.5), row("b", 1, 0.25)});
  EXPECT_EQ(text("toy-p.dat"), "# v\n1 25\n2 50\n\n\n");
}

TEST_F(PlotFiles, ColumnsBesidesTheFirstHaveOneCurve) {
  draw({row("a", 1, 0.25), row("b", 1, 0.0), row("a", 2, 0.5), row("b", 2, 0.1)});
  EXPECT_NE(text("toy-p.dat").find("# published [s]\n1 1000\n2 2000\n"), std::string::npos)
      << text("toy-p.dat");
}

TEST_F(PlotFiles, LogarithmsLeaveOutWhatHasNone) {
  plot_.y = {"wrong_share"};
  plot_.log_y = true;
  draw({row("a", 1, 0.0), row("a", 2, 0.5)});
  EXPECT_EQ(text("toy-p.dat"), "# a\n2 50\n\n\n");
}

TEST_F(PlotFiles, OfAnotherResolutionAreLeftOut) {
  plot_.resolution = 200;
  plot_.y = {"wrong_share"};
  Json kept = row("a", 1, 0.5), other = row("a", 2, 0.25);
  kept["resolution"] = 200, other["resolution"] = 400;
  draw({kept, other});
  EXPECT_EQ(text("toy-p.dat"), "# a\n1 50\n\n\n");
}

TEST_F(PlotFiles, OfAnotherCaseAreLeftOut) {
  plot_.case_name = "cube";
  EXPECT_EQ(draw({row("a", 1, 0.1)}), "");
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
}

}  // namespace
}  // namespace hermesh
