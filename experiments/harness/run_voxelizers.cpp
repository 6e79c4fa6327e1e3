#include <array>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "algorithms/core/level_set_grid.h"
#include "experiments/harness/cell.h"
#include "experiments/harness/facts.h"
#include "experiments/pipeline.h"
#include "reference/level_set_judge.h"
#include "validation/report_json.h"

namespace hermesh {
namespace {

struct VoxelizerInput {
  const GroupJob& job;
  const LoadedCase &input, &solid;
  double voxel_size;
  const Tables& tables;
  const CellWatch& watch;
  Json head;  ///< the first keys of all rows
};

Json places_json(const std::vector<VoxelFinding>& places) {
  Json list = Json::array();
  for (const VoxelFinding& place : places)
    list.push_back({{"voxel", place.voxel},
                    {"truth", place.truth},
                    {"value", place.value},
                    {"active", place.active},
                    {"bounds_solid", place.bounds_solid}});
  return list;
}

Json to_json(const DistanceReport& report) {
  return {{"compared", report.compared},
          {"max", report.max},
          {"rms", report.rms},
          {"off_fine", report.fine},
          {"off_coarse", report.coarse},
          {"classified", report.classified},
          {"on_boundary", report.on_boundary},
          {"on_boundary_max", report.on_boundary_max},
          {"on_inner_sheet", report.on_inner_sheet},
          {"on_inner_sheet_max", report.on_inner_sheet_max},
          {"stray", report.stray},
          {"missing", report.missing},
          {"missing_inner_sheet", report.missing_inner_sheet},
          {"places", places_json(report.places)}};
}

Json to_json(const SignReport& report) {
  const auto share = [](std::int64_t part, std::int64_t all) {
    return all ? Json(double(part) / double(all)) : Json();
  };
  return {{"judged", report.inside + report.outside},
          {"inside", report.inside},
          {"outside", report.outside},
          {"wrong", report.wrong()},
          {"wrong_share", report.wrong_share()},
          {"wrong_inside_share", share(report.wrong_inside, report.inside)},
          {"wrong_outside_share", share(report.wrong_outside, report.outside)},
          {"undecided", report.undecided},
          {"places", places_json(report.places)}};
}

/// Returns the fields with which all rows of the group begin.
Json head_of(const GroupJob& job, const LoadedCase& input, double voxel_size) {
  Json head = job.head;
  head["case"] = case_json(input);
  if (job.resolution)
    head["resolution"] = *job.resolution;
  else
    head["nominal_voxel_size"] = *job.voxel_size;
  head["voxel_size"] = voxel_size;
  if (job.published_seconds) head["published_seconds"] = *job.published_seconds;
  if (job.sweep) head["sweep"] = {{"parameter", job.sweep->parameter}, {"value", job.sweep->value}};
  constexpr std::array kSigns = {"none", "parity", "unanimous parity", "winding number"};
  if (job.judged.signs != JudgedBy::Signs::kNone)
    head["judged_by"] = {{"signs", kSigns[std::size_t(job.judged.signs)]},
                         {"solid", job.judged.solid.empty() ? job.input : job.judged.solid}};
  return head;
}

/// The truths about an input, as far as the entry asks for them.
class Truths {
 public:
  Truths(const VoxelizerInput& in, RunContext& context) : in_(in) {
    const JudgedBy& judged = in.job.judged;
    if (!judged.distances && judged.signs == JudgedBy::Signs::kNone) return;
    const Stage stage(context, "truth");
    // The samples are those of the input's frame, whatever the solid's is.
    PolygonMesh solid = in.solid.mesh;
    const Eigen::Vector3d shift = solid.origin - in.input.mesh.origin;
    for (Eigen::Vector3f& point : solid.points) point = (point.cast<double>() + shift).cast<float>();
    solid_ = std::make_unique<DistanceOracle>(triangles_in_voxels(solid, in.voxel_size));
    winding_ = std::make_unique<WindingOracle>(*solid_);
    VoxelSelection selection;
    selection.band = std::max(in.job.exterior_band, in.job.interior_band);
    if (judged.distances) {
      // An input's triangles are split down to this where they dive into the solid, in voxels.
      constexpr double kFinest = 0.05;
      surface_ = std::make_unique<DistanceOracle>(judged.to_boundary
                                                      ? solid_boundary(*solid_, *winding_, kFinest, context)
                                                      : triangles_in_voxels(in.input.mesh, in.voxel_size));
      selection.samples = *judged.distances;
      distances_.emplace(*surface_, *winding_, selection, context);
    }
    if (judged.signs == JudgedBy::Signs::kNone) return;
    selection.samples = judged.sign_samples;
    const SignOracle oracle = judged.signs == JudgedBy::Signs::kParity ? SignOracle::kParity
                              : judged.signs == JudgedBy::Signs::kUnanimousParity
                                  ? SignOracle::kUnanimousParity
                                  : SignOracle::kWinding;
    signs_.emplace(*solid_, *winding_, oracle, selection, context);
  }

  void judge(const LevelSet& level_set, Json& row, RunContext& context) const {
    const Stage stage(context, "judge");
    if (distances_)
      row["accuracy"] = to_json(distances_->judge(level_set, in_.input.mesh.origin, in_.job.exterior_band,
                                                  in_.job.interior_band, context));
    if (signs_) row["signs"] = to_json(signs_->judge(level_set));
  }

 private:
  const VoxelizerInput in_;
  std::unique_ptr<DistanceOracle> surface_, solid_;
  std::unique_ptr<WindingOracle> winding_;
  std::optional<DistanceTruth> distances_;
  std::optional<SignTruth> signs_;
};

struct VoxelizerCell {
  VoxelizeRecipe recipe;
  Json row;
  std::uint64_t fingerprint = 0;
  std::optional<Timing> timing;  ///< absent when the voxelizer failed
};

class VoxelizerGroup {
 public:
  VoxelizerGroup(const VoxelizerInput& in, RunContext& context) : in_(in), context_(context) {}

  std::vector<Json> run() {
    for (const VariantEntry& variant : in_.job.variants) {
      cells_.push_back(make_cell(variant));
      in_.watch.plan(cells_.back().row);
    }
    std::optional<Truths> truths;
    // A mesh without any area has no truth; how the voxelizers take it is still worth a row.
    const auto no_truth = attempt([&] { truths.emplace(in_, context_); });
    for (VoxelizerCell& cell : cells_) {
      if (no_truth) cell.row["not_judged"] = *no_truth;
      in_.watch.step(cell.row);
      const auto failed = attempt([&] { first_run(cell, truths ? &*truths : nullptr); });
      if (!failed) continue;
      cell.row["failed"] = *failed;
      cell.timing.reset();
    }
    truths.reset();
    time_all();
    std::vector<Json> rows;
    for (VoxelizerCell& cell : cells_) rows.push_back(std::move(cell.row));
    return rows;
  }

 private:
  VoxelizerCell make_cell(const VariantEntry& variant) const {
    VoxelizerCell cell;
    cell.recipe = {.chosen = choose(in_.tables.voxelizers, variant.name, variant.options),
                   .voxel_size = in_.voxel_size,
                   .exterior_band = in_.job.exterior_band,
                   .interior_band = in_.job.interior_band};
    const Options& options = cell.recipe.chosen.options;
    cell.row = in_.head;
    cell.row["variant"] = variant_json(variant, options);
    const Options usual = choose(in_.tables.voxelizers, variant.name).options;
    cell.row["variant"]["default_options"] = options.canonical() == usual.canonical();
    return cell;
  }

  struct Once {
    LevelSet level_set;
    double seconds = 0.0, cpu_seconds = 0.0;
    StageSeconds stages;
    std::vector<std::string> notes;
  };
  Once once(const VoxelizerCell& cell, bool with_progress) const {
    context_.check();
    RunContext child = child_context(context_, with_progress);
    Once result;
    const double cpu = process_cpu_seconds();
    result.seconds = timed([&] { result.level_set = voxelize(in_.input.mesh, cell.recipe, child); });
    result.cpu_seconds = process_cpu_seconds() - cpu;
    result.stages = child.stage_seconds;
    result.notes = child.notes;
    return result;
  }

  void first_run(VoxelizerCell& cell, const Truths* truths) {
    // OpenVDB's registers belong to the process and must not be charged to the first method measured.
    initialize_openvdb();
    const PeakMemory memory;
    const Once first = once(cell, true);
    cell.row["peak_bytes"] = optional_json(memory.bytes());
    cell.timing.emplace(in_.job, first.seconds, first.stages);
    if (!cell.timing->warm) cell.timing->cpu_seconds = {first.cpu_seconds};
    cell.row["notes"] = first.notes;
    describe(cell, first.level_set);
    if (truths) {
      truths->judge(first.level_set, cell.row, context_);
      RunContext child = child_context(context_, true);
      if (const auto solid = compare_surface(first.level_set, in_.input.mesh, child))
        cell.row["report"]["solid"] = validation::to_json(*solid);
    }
    if (in_.job.components) {
      RunContext child = child_context(context_, true);
      cell.row["surface_components"] = count_surface_components(first.level_set, child);
    }
  }

  void describe(VoxelizerCell& cell, const LevelSet& level_set) const {
    const auto [x, y, z] = level_set.dimensions();
    cell.fingerprint = fingerprint(level_set);
    char text[20];
    std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(cell.fingerprint));
    cell.row["digest"] = digest(level_set);
    const std::size_t grid_bytes = level_set.memory_bytes();
    cell.row["voxelization"] = {
        {"active_voxels", level_set.active_voxels()},
        {"memory_bytes", grid_bytes},
        {"dimensions", {x, y, z}},
        {"dimensions_text", std::to_string(x) + " × " + std::to_string(y) + " × " + std::to_string(z)},
        {"fingerprint", text}};
    const double allowed = 1.5 * double(grid_bytes) + 8.0 * double(in_.input.mesh.triangle_count());
    if (find(cell.row, "/peak_bytes"))
      cell.row["peak_over_allowed"] = number_at(cell.row, "/peak_bytes") / allowed;
  }

  double repeat(VoxelizerCell& cell) const {
    in_.watch.step(cell.row);
    const Once again = once(cell, false);
    cell.timing->stages.push_back(again.stages);
    cell.timing->cpu_seconds.push_back(again.cpu_seconds);
    if (fingerprint(again.level_set) != cell.fingerprint) cell.row["repetitions_differ"] = true;
    return again.seconds;
  }

  void time_all() {
    const Stage stage(context_, "timing");
    std::vector<Racer> racers;
    for (VoxelizerCell& cell : cells_)
      if (cell.timing) racers.push_back({*cell.timing, cell.row, [this, &cell] { return repeat(cell); }});
    race_cells(racers);
    for (const Racer& racer : racers) {
      Json& row = racer.row;
      const double seconds = row["seconds"]["median"].get<double>(), cpu = median(racer.timing.cpu_seconds);
      const double triangles = double(in_.input.mesh.triangle_count());
      row["cpu_seconds"] = cpu;
      row["cpu_microseconds_per_triangle"] = 1e6 * cpu / triangles;
      row["nanoseconds_per_triangle"] = 1e9 * seconds / triangles;
      if (const double voxels = number_at(row, "/voxelization/active_voxels"); voxels > 0.0)
        row["nanoseconds_per_active_voxel"] = 1e9 * seconds / voxels;
    }
  }

  const VoxelizerInput in_;
  RunContext& context_;
  std::vector<VoxelizerCell> cells_;
};

}  // namespace

std::vector<Json> run_voxelizers(const GroupJob& job, const LoadedCase& input, const LoadedCase& solid,
                                 double voxel_size, const Tables& tables, const CellWatch& watch,
                                 RunContext& context) {
  return VoxelizerGroup({job, input, solid, voxel_size, tables, watch, head_of(job, input, voxel_size)},
                        context)
      .run();
}

}  // namespace hermesh
