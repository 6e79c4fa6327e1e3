// One progress for all of a command, of the progress of its stages, and how long the rest will take.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace hermesh::cli {

/// A stage that is expected, and its share of the command's time, in any unit.
struct PlannedStage {
  std::string name;  ///< as RunContext::progress() has it; empty: the only one, whatever it is called
  double weight;
};

/// The stages that a command usually has, in their order, some more than once. Weights are those of a scan of
/// 70,000 triangles at 150 voxels. Empty for commands that have no such order. "remesh --error" is a command
/// of its own here.
std::vector<PlannedStage> plan_of(std::string_view command);

/// Tells how much of a plan is done. The figure never falls, whatever stages come: one that is not planned,
/// or comes once more than planned, takes a tenth of what is left before the last stage, or half if only that
/// is still to come.
class OverallProgress {
 public:
  explicit OverallProgress(std::vector<PlannedStage> plan);

  /// Takes the progress of a stage and returns that of all, 0 to 1. A stage begins with the fraction 0.
  double update(std::string_view stage, double fraction);

  /// Seconds until the end, once there is enough to go by: at least a second and a fiftieth of the work.
  /// `elapsed` is seconds from the start.
  static std::optional<double> left(double done, double elapsed);

 private:
  void begin(std::string_view stage);

  std::vector<PlannedStage> plan_;
  double total_ = 0.0;
  std::size_t next_ = 0;  ///< the first stage of the plan that has not begun
  std::string stage_;
  double base_ = 0.0, span_ = 0.0, done_ = 0.0;
  bool ended_ = true;  ///< whether the stage has ended, so that one of its name is another
};

/// "2 s", "3 min", "1 h 20 min".
std::string duration_text(double seconds);

}  // namespace hermesh::cli
