#include "experiments/harness/job.h"

#include <cmath>

#include "experiments/harness/cell.h"
#include "experiments/harness/command_extractor.h"

namespace hermesh {
LoadedCase load_input(const std::string& name, const std::optional<ChangedParameter>& sweep,
                      const Tables& tables, RunContext& context) {
  LoadedCase input;
  const auto message = attempt([&] {
    input = sweep ? tables.load_changed(name, {{sweep->parameter, sweep->value}}, context)
                  : tables.load(name, context);
    // A resolution counts the voxels along the longest side, so an input without one has no voxel size.
    if (input.mesh.triangle_count() == 0) throw Error("it holds no polygons");
    if (const double longest = bounds(input.mesh).size().maxCoeff();
        !(longest > 0.0) || !std::isfinite(longest))
      throw Error("its bounding box has no finite extent");
  });
  if (message) throw CaseUnreadable("the case " + name + " cannot be read: " + *message);
  return input;
}

std::vector<Json> run_job(const GroupJob& job, Tables tables, const CellWatch& watch, RunContext& context) {
  for (const VariantEntry& variant : job.variants)
    if (!variant.command.empty())
      tables.extractors.push_back(command_extractor(variant.name, variant.command));
  const LoadedCase input = load_input(job.input, job.sweep, tables, context);
  if (job.extraction) return run_group(job, input, tables, watch, context);
  const double longest = bounds(input.mesh).size().maxCoeff();
  const double voxel_size = job.resolution
                                ? longest / *job.resolution
                                : job.voxel_size.value() * (job.length ? longest / *job.length : 1.0);
  if (job.judged.solid.empty()) return run_voxelizers(job, input, input, voxel_size, tables, watch, context);
  const LoadedCase solid = load_input(job.judged.solid, job.sweep, tables, context);
  return run_voxelizers(job, input, solid, voxel_size, tables, watch, context);
}

}  // namespace hermesh
