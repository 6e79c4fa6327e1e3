#include "experiments/cli/pipeline/overall_progress.h"

#include <algorithm>
#include <cmath>

namespace hermesh::cli {
namespace {

using Plan = std::vector<PlannedStage>;

void append(Plan& plan, const Plan& more) { plan.insert(plan.end(), more.begin(), more.end()); }

const Plan kVoxelize = {{"triangles to blocks", 0.02}, {"distances", 0.1}, {"signs", 0.45}, {"tree", 0.001}};
const Plan kSample = {{"ends of the data", 0.002},
                      {"Hermite data from the level set", 0.004},
                      {"Hermite data from the polygons", 0.15}};
const Plan kCollapse = {{"find cells", 0.002}, {"place points", 0.07}, {"let points leave", 0.03},
                        {"connect", 0.01},     {"try sheets", 0.001},  {"connect", 0.003},
                        {"move points", 0.02}, {"decimate", 0.06},     {"decimate", 0.04},
                        {"decimate", 0.2},     {"certify", 0.67},      {"decimate", 0.48},
                        {"certify", 0.57}};

}  // namespace

Plan plan_of(std::string_view command) {
  Plan plan;
  if (command == "remesh" || command == "voxelize") {
    append(plan, {{"read", 0.04}});
    append(plan, kVoxelize);
  }
  if (command == "voxelize") append(plan, {{"write volumes", 0.03}});
  if (command == "remesh") {
    append(plan, kSample);
    append(plan, kCollapse);
    append(plan, {{"write", 0.01}});
  }
  if (command == "remesh --error") {
    append(plan, {{"read", 0.04}, {"try larger voxels", 0.4}});
    // A rough mesh tells how large the voxels of the next one have to be.
    for (int pass = 0; pass < 2; ++pass) {
      append(plan, kVoxelize);
      append(plan, kSample);
      plan.insert(plan.end(), kCollapse.begin(), kCollapse.begin() + 7);
      append(plan, {{"compare", 0.2}});
    }
    plan.insert(plan.end(), kCollapse.begin() + 7, kCollapse.end());
    append(plan, {{"decimate", 0.2}, {"certify", 0.3}, {"prove", 0.5}, {"write", 0.01}});
  }
  if (command == "combine") {
    append(plan, {{"read", 0.03}, {"read", 0.03}});
    for (int operand = 0; operand < 2; ++operand) {
      append(plan, kVoxelize);
      append(plan, kSample);
    }
    append(plan, {{"combine level sets", 0.01}, {"combine Hermite data", 0.01}});
    append(plan, kCollapse);
    append(plan, {{"write", 0.01}});
  }
  if (command == "extract")
    append(plan, {{"read volume", 0.3},
                  {"ends of the data", 0.05},
                  {"place points", 0.3},
                  {"connect", 0.1},
                  {"write", 0.25}});
  return plan;
}

OverallProgress::OverallProgress(Plan plan) : plan_(std::move(plan)) {
  for (const PlannedStage& stage : plan_) total_ += stage.weight;
}

void OverallProgress::begin(std::string_view stage) {
  stage_ = stage;
  ended_ = false;
  base_ = done_;
  const auto planned = std::find_if(plan_.begin() + std::ptrdiff_t(next_), plan_.end(),
                                    [&](const PlannedStage& one) { return one.name == stage; });
  if (planned != plan_.end()) {
    double before = 0.0;
    for (auto one = plan_.begin(); one != planned; ++one) before += one->weight;
    next_ = std::size_t(planned - plan_.begin()) + 1;
    base_ = std::max(done_, before / total_);
    span_ = std::max(0.0, (before + planned->weight) / total_ - base_);
    return;
  }
  // Nobody knows how many more will come: so each gets a part of the rest, and all together never get to the
  // last stage. It is a small one while stages that are planned are still to come.
  const double last = plan_.empty() ? 0.0 : plan_.back().weight / total_;
  const double part = next_ + 1 < plan_.size() ? 0.1 : 0.5;
  span_ = std::max(0.0, (1.0 - last - base_) * part);
}

double OverallProgress::update(std::string_view stage, double fraction) {
  fraction = std::clamp(std::isfinite(fraction) ? fraction : 0.0, 0.0, 1.0);
  if (plan_.size() == 1 && plan_[0].name.empty()) return done_ = std::max(done_, fraction);
  if (ended_ || stage != stage_) begin(stage);
  if (fraction >= 1.0) ended_ = true;
  return done_ = std::max(done_, base_ + span_ * fraction);
}

std::optional<double> OverallProgress::left(double done, double elapsed) {
  if (done < 0.02 || elapsed < 1.0) return std::nullopt;
  return elapsed * (1.0 - done) / done;
}

std::string duration_text(double seconds) {
  const auto whole = static_cast<long>(std::ceil(std::max(0.0, seconds)));
  if (whole < 100) return std::to_string(whole) + " s";
  const long minutes = (whole + 59) / 60;
  if (minutes < 100) return std::to_string(minutes) + " min";
  return std::to_string(minutes / 60) + " h " + std::to_string(minutes % 60) + " min";
}

}  // namespace hermesh::cli
