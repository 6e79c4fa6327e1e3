#include "experiments/harness/job.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "experiments/harness/cell.h"
#include "experiments/harness/command_extractor.h"

namespace hermesh {
namespace {

/// Returns the value of a key, nothing if it is missing or null.
template <class T>
std::optional<T> optional_at(const Json& json, const std::string& key) {
  const auto found = json.find(key);
  return found == json.end() || found->is_null() ? std::nullopt : std::optional<T>(found->get<T>());
}

VariantEntry read_variant(const Json& json) {
  return {.name = json.at("name"),
          .label = json.at("label"),
          .options = json.at("options"),
          .uniform = json.value("uniform", ""),
          .command = json.value("command", "")};
}

JudgedBy::Signs read_signs(const std::string& name) {
  constexpr std::array kNames = {"none", "parity", "unanimous-parity", "winding-number"};
  const auto at = std::ranges::find(kNames, name);
  if (at == kNames.end()) throw Error("a job has the unknown signs '" + name + "'");
  return JudgedBy::Signs(at - kNames.begin());
}

}  // namespace

std::optional<ChangedParameter> read_change(const Json& job) {
  const Json& change = job.at("sweep");
  if (change.is_null()) return std::nullopt;
  return ChangedParameter{change.at("parameter"), change.at("value")};
}

GroupJob read_group_job(const Json& job) {
  GroupJob result;
  result.extraction = job.at("kind") == "extraction";
  result.head = job.at("head");
  result.input = job.at("case");
  result.sweep = read_change(job);
  result.resolution = optional_at<int>(job, "resolution");
  result.voxel_size = optional_at<double>(job, "voxel_size");
  result.length = optional_at<double>(job, "length");
  result.published_seconds = optional_at<double>(job, "published_seconds");
  for (const Json& variant : job.at("variants")) result.variants.push_back(read_variant(variant));
  if (result.extraction) result.voxelizer = read_variant(job.at("voxelizer"));
  result.exterior_band = job.at("exterior_band");
  result.interior_band = job.at("interior_band");
  result.judged = {.distances = optional_at<std::int64_t>(job, "distances"),
                   .to_boundary = job.at("to_boundary"),
                   .signs = read_signs(job.at("signs")),
                   .sign_samples = job.at("sign_samples"),
                   .solid = job.at("solid")};
  result.features = optional_at<double>(job, "features");
  if (const auto closeup = optional_at<std::vector<double>>(job, "closeup"))
    result.close_up = {.centre = {closeup->at(0), closeup->at(1), closeup->at(2)}, .size = closeup->at(3)};
  if (const auto view = optional_at<std::vector<double>>(job, "view"))
    result.viewpoint = {view->at(0), view->at(1)};
  result.repetitions = job.at("repetitions");
  result.seconds_per_variant = job.at("seconds_per_variant");
  result.samples = job.at("samples");
  result.pixels = job.at("pixels");
  result.self_intersections = job.at("self_intersections");
  result.components = job.at("components");
  result.out = job.at("out").get<std::string>();
  result.files = job.at("files");
  return result;
}

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
