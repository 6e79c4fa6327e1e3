// Forest plots: a line for each effect, with its interval, over the range that was predicted.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iomanip>
#include <limits>
#include <ostream>
#include <sstream>
#include <vector>

#include "algorithms/core/error.h"
#include "experiments/ablations/effect_report.h"
#include "experiments/pictures/gnuplot.h"

namespace hermesh {
namespace {

namespace fs = std::filesystem;

/// One plot's effects have one scale.
struct Forest {
  std::string name, title, label;
  bool logarithmic = false;
  std::vector<const JudgedEffect*> effects;
};

std::vector<Forest> forests_of(const JudgedAblation& judged) {
  std::vector<Forest> forests;
  const std::string stem = judged.experiment + "-" + judged.tier + "-effects";
  for (const JudgedEffect& effect : judged.effects) {
    const bool ratio = effect.predicted.measure != EffectMeasure::kDifference;
    // A plot takes what has an interval; a ratio of 0 or infinity has no place on a logarithmic axis.
    const EffectSize& size = effect.size;
    if (size.models < 2 || !std::isfinite(size.interval.low) || !std::isfinite(size.interval.high) ||
        (ratio && size.interval.low <= 0.0))
      continue;
    const std::string name = ratio ? stem : stem + "-" + effect.predicted.column;
    auto found = std::ranges::find(forests, name, &Forest::name);
    if (found == forests.end()) {
      const std::string label = ratio ? "level ÷ baseline" : effect.predicted.column + ": level − baseline";
      found = forests.insert(
          found, {name, judged.ablation.factor + ", against " + judged.ablation.baseline, label, ratio, {}});
    }
    found->effects.push_back(&effect);
  }
  return forests;
}

std::string gnuplot_text(const std::string& text) {
  std::string result = "'";
  for (const char c : text) result += c == '\'' ? std::string("''") : std::string(1, c);
  return result + "'";
}

/// The ends of the axis: all intervals, the finite ends of what was predicted, and no effect.
std::array<double, 2> axis_of(const Forest& forest) {
  double low = forest.logarithmic ? 1.0 : 0.0, high = low;
  const auto hold = [&](double value) {
    if (!std::isfinite(value) || (forest.logarithmic && value <= 0.0)) return;
    low = std::min(low, value);
    high = std::max(high, value);
  };
  for (const JudgedEffect* effect : forest.effects)
    for (const double value : {effect->size.interval.low, effect->size.interval.high,
                               effect->predicted.at_least, effect->predicted.at_most})
      hold(value);
  if (forest.logarithmic) {
    const double margin = std::max(1.05, std::pow(high / low, 0.06));
    return {low / margin, high * margin};
  }
  const double margin = std::max(0.06 * (high - low), 1e-9);
  return {low - margin, high + margin};
}

std::string label_of_effect(const PredictedEffect& predicted) { return predicted.level + ": " + predicted.column; }

/// The share of the width that the longest name takes, of characters 0.009 wide.
double left_margin(const Forest& forest) {
  std::size_t longest = 0;
  for (const JudgedEffect* effect : forest.effects)
    longest = std::max(longest, label_of_effect(effect->predicted).size());
  return std::min(0.03 + 0.009 * double(longest), 0.6);
}

/// Marks of a logarithmic axis that spans less than two decades, where powers of ten alone would be one or
/// none.
std::string marks_of(double low, double high) {
  if (high / low >= 100.0) return "";
  const std::vector<double> steps = high / low < 6.0 ? std::vector<double>{1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8}
                                                     : std::vector<double>{1, 2, 5};
  std::ostringstream out;
  const char* separator = "set xtics (";
  for (int power = -9; power <= 9; ++power)
    for (const double step : steps) {
      const double mark = step * std::pow(10.0, power);
      if (mark < low || mark > high) continue;
      out << separator << mark;
      separator = ", ";
    }
  return out.str().empty() ? "" : out.str() + ")\n";
}

void write_forest(const fs::path& script, const Forest& forest) {
  constexpr std::array<const char*, 3> kColours = {"#009e73", "#d55e00",
                                                   "#666666"};  // of verdicts (Okabe and Ito 2008)
  const auto [low, high] = axis_of(forest);
  const std::size_t n = forest.effects.size();
  std::ofstream out(script);
  out << std::setprecision(10) << "# gnuplot " << script.filename().string() << "\n$effects << EOD\n";
  for (std::size_t i = 0; i < n; ++i) {
    const EffectSize& size = forest.effects[i]->size;
    out << size.estimate << ' ' << n - i << ' ' << size.interval.low << ' ' << size.interval.high << ' '
        << int(forest.effects[i]->verdict) << "\n";
  }
  out << "EOD\nset border 1 lw 1.2\nset tics nomirror\nset ytics scale 0\nset grid xtics lc rgb '#dddddd' lt "
         "1 lw 1\n"
      << "set key tmargin center horizontal Left reverse samplen 1\nset rmargin 3\n"
      << "set lmargin at screen " << left_margin(forest) << "\nset title " << gnuplot_text(forest.title)
      << " noenhanced\nset xlabel " << gnuplot_text(forest.label) << " noenhanced\n"
      << "set xrange [" << low << ':' << high << "]\nset yrange [0.4:" << double(n) + 0.6 << "]\n";
  if (forest.logarithmic) out << "set logscale x\n" << marks_of(low, high);
  out << "set ytics (";
  for (std::size_t i = 0; i < n; ++i)
    out << (i ? ", " : "") << gnuplot_text(label_of_effect(forest.effects[i]->predicted)) << ' ' << n - i;
  out << ") noenhanced\n";
  for (std::size_t i = 0; i < n; ++i) {
    const PredictedEffect& predicted = forest.effects[i]->predicted;
    const double from = std::clamp(predicted.at_least, low, high),
                 to = std::clamp(predicted.at_most, low, high);
    out << "set object rectangle from first " << from << ", first " << double(n - i) - 0.35 << " to first "
        << to << ", first " << double(n - i) + 0.35 << " fc rgb '#dce9f5' fs solid noborder behind\n";
  }
  const double none = forest.logarithmic ? 1.0 : 0.0;
  out << "set arrow from first " << none << ", graph 0 to first " << none
      << ", graph 1 nohead dt 2 lw 1.5 lc rgb '#000000'\n";
  const std::size_t height = 260 + 50 * n;
  for (const auto& [terminal, extension] :
       {std::pair("pngcairo size 1300," + std::to_string(height) + " font 'DejaVu Sans,17'", "png"),
        std::pair("svg size 870," + std::to_string(height * 2 / 3) +
                      " dynamic font 'DejaVu Sans,12' background '#ffffff'",
                  "svg"),
        std::pair("pdfcairo size 22cm," + std::to_string(double(height) * 22.0 / 1300.0) +
                      "cm font 'DejaVu Sans,8.5'",
                  "pdf")}) {
    out << "set terminal " << terminal << "\nset output '" << script.stem().string() << '.' << extension
        << "'\nplot ";
    for (const PredictionVerdict verdict :
         {PredictionVerdict::kHolds, PredictionVerdict::kFalsified, PredictionVerdict::kUndecided})
      out << "$effects using ($5 == " << int(verdict)
          << " ? $1 : NaN):2:3:4 with xerrorbars lw 3 pt 7 ps 1.4 lc rgb '" << kColours[std::size_t(verdict)]
          << "' title '" << name_of(verdict) << "', \\\n     ";
    out << "NaN with boxes fs solid fc rgb '#dce9f5' title 'predicted'\n";
  }
  if (!out.flush()) throw Error("cannot write " + script.string());
}

}  // namespace

void write_forest_plots(const std::vector<JudgedAblation>& ablations, const fs::path& folder,
                        std::ostream& out) {
  for (const JudgedAblation& judged : ablations)
    for (const Forest& forest : forests_of(judged)) {
      const fs::path stem = folder / forest.name;
      write_forest(stem.string() + ".gp", forest);
      draw_with_gnuplot(stem, out);
    }
}

}  // namespace hermesh
