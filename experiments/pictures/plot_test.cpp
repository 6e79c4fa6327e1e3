#include "experiments/pictures/plot.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "algorithms/core/error.h"
#include "experiments/pictures/plot_style.h"

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
  EXPECT_NE(text("toy-p.gp").find("set label 1 'it''s a title'"), std::string::npos);
  EXPECT_NE(said.find("toy-p"), std::string::npos);
  ASSERT_TRUE(said.starts_with("Plot: ")) << "experiments/install_packages.sh installs gnuplot";
  EXPECT_GT(std::filesystem::file_size(folder_ / "toy-p.png"), 5000u);
  EXPECT_NE(text("toy-p.svg").find("<svg"), std::string::npos);
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

TEST_F(PlotFiles, HaveErrorBarsFromTheColumnsOfAnInterval) {
  plot_.y = {"cost"};
  plot_.percent = false;
  Json measured = row("a", 1, 0.0), bare = row("a", 2, 0.0);
  const auto column = [](const char* name) { return Json{{"name", name}, {"header", name}, {"meaning", name}}; };
  for (Json* one : {&measured, &bare}) {
    (*one)["measurement"] = {{"name", "m"}};
    (*one)["table"] = {{"columns", {column("swept"), column("cost"), column("cost_low"), column("cost_high")}}};
  }
  measured["values"] = {{"swept", 1}, {"cost", 5}, {"cost_low", 4.5}, {"cost_high", 7}};
  bare["values"] = {{"swept", 2}, {"cost", 6}};
  draw({measured, bare});
  EXPECT_EQ(text("toy-p.dat"), "# a\n1 5 4.5 7\n2 6 6 6\n\n\n");
  EXPECT_NE(text("toy-p.gp").find("using 1:2:3:4 with yerrorbars"), std::string::npos);
}

TEST_F(PlotFiles, HaveErrorBarsFromTheShortestToTheLongestRepetition) {
  plot_.y = {"seconds"};
  plot_.percent = false;
  Json timed = row("a", 1, 0.0), once = row("b", 1, 0.0);
  timed["seconds"] = {{"median", 2.0}, {"all", {3.0, 1.5, 2.0}}};
  once["seconds"] = {{"median", 4.0}, {"all", {4.0}}};
  timed["machine"] = {{"cpu", "Abacus"}, {"cores", 2}};
  draw({timed, once});
  EXPECT_EQ(text("toy-p.dat"), "# a\n1 2 1.5 3\n\n\n# b\n1 4\n\n\n");
  EXPECT_NE(text("toy-p.gp").find("measured on Abacus, 2 cores"), std::string::npos);
}

TEST_F(PlotFiles, PutCategoriesOnAnAxisInTheOrderOfX) {
  plot_.y = {"wrong_share"};
  plot_.categories = true;
  EXPECT_EQ(plot_from_json(to_json(plot_)), plot_);
  draw({row("late", 9, 0.5), row("first", 1, 0.25), row("mid", 5, 0.75)});
  const std::string data = text("toy-p.dat"), script = text("toy-p.gp");
  EXPECT_EQ(data.substr(data.find('\n') + 1), "0 25\n1 75\n2 50\n\n\n");
  EXPECT_NE(script.find("set xtics noenhanced ('first' 0, 'mid' 1, 'late' 2)"), std::string::npos) << script;
  EXPECT_NE(script.find("unset key"), std::string::npos);
}

TEST_F(PlotFiles, LetLongCategoriesLie) {
  plot_.y = {"wrong_share"};
  plot_.categories = true;
  draw({row("a name that is long", 1, 0.5), row("b", 2, 0.25)});
  const std::string script = text("toy-p.gp");
  EXPECT_NE(script.find("set ytics noenhanced ('a name that is long' 0, 'b' 1)"), std::string::npos) << script;
  EXPECT_NE(script.find("using 2:1"), std::string::npos);
}

TEST_F(PlotFiles, EmphasiseThickAndBelowTheOthers) {
  plot_.y = {"wrong_share"};
  plot_.emphasised = {"ours"};
  plot_.note = "of two machines";
  EXPECT_EQ(plot_from_json(to_json(plot_)), plot_);
  draw({row("peer", 1, 0.5), row("ours, fast", 1, 0.25), row("ours2", 1, 0.2)});
  EXPECT_TRUE(text("toy-p.dat").starts_with("# ours, fast\n1 25\n")) << text("toy-p.dat");
  const std::string script = text("toy-p.gp");
  // "ours2" is another name, and has the thin line of "peer".
  const std::size_t ours = script.find("title 'ours, fast'");
  ASSERT_NE(ours, std::string::npos);
  EXPECT_LT(script.find("lw 5.5"), ours);
  EXPECT_GT(script.find("lw 5.5", ours), script.find("set terminal", ours));
  EXPECT_NE(script.find("of two machines"), std::string::npos);
}

TEST_F(PlotFiles, SayInTheTitleAtWhichResolution) {
  plot_.y = {"wrong_share"};
  plot_.resolution = 200;
  Json kept = row("a", 1, 0.5);
  kept["resolution"] = 200;
  kept["case"]["origin"] = "stand-in: a ball";
  draw({kept});
  EXPECT_NE(text("toy-p.gp").find("'it''s a title at 200 voxels'"), std::string::npos);
  EXPECT_NE(text("toy-p.gp").find("with a stand-in for ball"), std::string::npos);
}

TEST_F(PlotFiles, AreTheSameBytesAgain) {
  plot_.y = {"wrong_share"};
  const std::vector<Json> rows = {row("a", 1, 0.5), row("b", 2, 0.25)};
  ASSERT_TRUE(draw(rows).starts_with("Plot: ")) << "experiments/install_packages.sh installs gnuplot";
  const std::string pdf = text("toy-p.pdf"), png = text("toy-p.png");
  EXPECT_TRUE(pdf.starts_with("%PDF-"));
  EXPECT_NE(pdf.find("/CreationDate (D:20110401000000"), std::string::npos);
  draw(rows);
  EXPECT_TRUE(pdf == text("toy-p.pdf"));
  EXPECT_TRUE(png == text("toy-p.png"));
}

TEST_F(PlotFiles, SayWhenThereAreMoreCurvesThanStyles) {
  plot_.y = {"wrong_share"};
  std::vector<Json> rows;
  for (std::size_t i = 0; i <= kPlotStyles; ++i) rows.push_back(row("label " + std::to_string(i), 1, 0.5));
  const std::string said = draw(rows);
  EXPECT_NE(said.find("has 121 curves, and a plot tells 120 apart"), std::string::npos) << said;
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
}

TEST(PlotStyle, NoTwoCurvesShareColourAndMark) {
  std::set<std::pair<std::string, int>> seen;
  for (std::size_t i = 0; i < kPlotStyles; ++i) {
    const CurveStyle style = curve_style(i);
    EXPECT_TRUE(seen.emplace(style.colour, style.mark).second) << i;
  }
  EXPECT_THROW(curve_style(kPlotStyles), Error);
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
