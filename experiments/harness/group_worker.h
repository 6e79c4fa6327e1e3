// The way of an experiment from its file to rows: the plan, its groups of cells, and who works on them.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "experiments/harness/experiment_file.h"
#include "experiments/harness/harness.h"
#include "experiments/harness/run_cells.h"

namespace hermesh {

/// An experiment as it is to be run: that of the file, with the overrides, and its commands in the tables.
struct Plan {
  Experiment experiment;
  Tier tier;
  Tables tables;

  /// @throws Error for a mistake in the file, a tier that it lacks, or an override of what there is not.
  Plan(const RunSettings& settings, const Tables& given);
};

/// What is worked on together: an input at one voxel size, through one voxelizer where extractors compete. A measurement is
/// one group.
struct GroupId {
  std::size_t entry = 0, sweep = 0, size = 0, voxelizer = 0;
};
Json to_json(const GroupId& id);
GroupId group_id(const Json& json);

/// Works on groups of cells in this process.
class GroupWorker {
 public:
  /// `plan` stays where it is; rows whose "case/resolution/variant" lacks `filter` are left out; meshes and pictures go to
  /// `out`.
  GroupWorker(const Plan& plan, std::filesystem::path out, std::string filter, RunContext& context);

  std::vector<GroupId> groups() const;
  /// Who competes in a group, as far as the filter leaves them.
  std::vector<VariantEntry> contenders(const GroupId& id) const;
  /// "dragon/400/".
  std::string name_of(const GroupId& id) const;
  /// An estimate of the group's work that depends on the file alone, for partition(): its cells times the square of its
  /// resolution. Voxel sizes in world units tell of no resolution; the largest of the entry then counts as 100.
  double weight_of(const GroupId& id) const;
  /// The input of a group; the last one is kept, since the next group mostly has it, too. @throws Cancelled; DataMissing;
  /// CaseUnreadable, with the reason.
  const LoadedCase& input(const GroupId& id);

  /// The rows of a group, without the contenders whose labels are `left_out`. @throws as run_group().
  std::vector<Json> rows(const GroupId& id, const std::set<std::string>& left_out, const Json& head, const CellWatch& watch);
  /// The rows of a measurement that are not `done`, each as soon as it is ready. @throws as run_measurement().
  void measure(const std::set<std::string>& done, const Json& head, const std::function<void(const Json&)>& keep);

 private:
  struct Loaded {
    std::string name;
    std::optional<LoadedCase> input;
  };
  const LoadedCase& loaded(const std::string& name, const GroupId& id, Loaded& kept);
  Json cell_head(const GroupId& id, const LoadedCase& made, double voxel_size, Json head) const;

  const Plan& plan_;
  std::filesystem::path out_;
  std::string filter_;
  RunContext& context_;
  Loaded input_, solid_;
};

}  // namespace hermesh
