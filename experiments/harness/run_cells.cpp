#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>

#include "algorithms/io/mesh_file.h"
#include "algorithms/voxelization/outputs/lost_surface.h"
#include "experiments/harness/cell.h"
#include "experiments/harness/command_extractor.h"
#include "experiments/harness/facts.h"
#include "experiments/pipeline.h"
#include "validation/geometry/distance.h"
#include "validation/report_json.h"

namespace hermesh {
namespace {

struct Cell {
  ExtractRecipe recipe;
  Json row;
  std::string uniform;              ///< as in VariantEntry
  std::filesystem::path mesh_file;  ///< empty when there is no mesh to look at
  std::optional<Timing> timing;     ///< absent when the variant failed
};

/// Returns the verdict on guarantees in the words of the tables, e.g. "guarantees closed, oriented:
/// verified".
std::string caption_of(std::string verdict) {
  constexpr std::string_view kBefore = "promises ", kAfter = ": kept";
  if (verdict.starts_with(kBefore)) verdict.replace(0, kBefore.size(), "guarantees ");
  if (verdict.ends_with(kAfter)) verdict.replace(verdict.size() - kAfter.size(), kAfter.size(), ": verified");
  return verdict;
}

std::optional<double> figure(const RunContext& child, std::string_view name) {
  for (const auto& [key, value] : child.figures)
    if (key == name) return value;
  return std::nullopt;
}
/// An outside program's own time; writing its input and reading its mesh is ours.
double own_seconds(double seconds, const RunContext& child) {
  return figure(child, kCommandSeconds).value_or(seconds);
}
std::optional<std::int64_t> peak_of_command(const RunContext& child) {
  const auto bytes = figure(child, kCommandPeakBytes);
  return bytes ? std::optional(static_cast<std::int64_t>(*bytes)) : std::nullopt;
}

class Group {
 public:
  Group(const GroupJob& job, const LoadedCase& input, const Tables& tables, const CellWatch& watch,
        RunContext& context)
      : job_(job),
        input_(input),
        tables_(tables),
        watch_(watch),
        context_(context),
        recipe_{.chosen = choose(tables.voxelizers, job.voxelizer.name, job.voxelizer.options),
                .resolution = double(job.resolution.value())},
        voxel_size_(voxel_size_of(recipe_, input.mesh)) {}

  std::vector<Json> run() {
    for (const VariantEntry& variant : job_.variants) {
      cells_.push_back(make_cell(variant));
      watch_.plan(cells_.back().row);
    }
    const auto failed = attempt([&] { voxelize(); });
    source_ = to_mesh_file(input_.mesh);
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      cells_[i].row["voxelization"] = voxelization_;
      watch_.step(cells_[i].row);
      const auto sentence = failed ? failed : attempt([&] {
        try {
          extract_and_judge(cells_[i], i);
        } catch (const ProgramAbsent& absent) {
          mark_absent(cells_[i].row, absent.what());
          cells_[i].timing.reset();
        }
      });
      if (sentence) fail(cells_[i], *sentence);
    }
    time_all();
    std::vector<Json> rows;
    for (Cell& cell : cells_) rows.push_back(cell.row);
    if (job_.pixels > 0) picture(rows);
    return rows;
  }

 private:
  Cell make_cell(const VariantEntry& variant) const {
    Cell cell;
    cell.recipe.chosen = choose(tables_.extractors, variant.name, variant.options);
    cell.row = job_.head;
    cell.row["case"] = case_json(input_);
    cell.row["resolution"] = *job_.resolution;
    cell.row["voxel_size"] = voxel_size_;
    cell.row["samples"] = job_.samples;
    cell.row["variant"] = variant_json(variant, cell.recipe.chosen.options);
    cell.uniform = variant.uniform;
    cell.row["variant"]["promises"] = promise_words(cell.recipe.chosen.extractor.promises);
    return cell;
  }

  static void fail(Cell& cell, const std::string& sentence) {
    mark_failed(cell.row, sentence);
    cell.timing.reset();
  }

  void voxelize() {
    voxelization_ = variant_json(job_.voxelizer, recipe_.chosen.options);
    const auto once = [&](bool with_progress, std::optional<StageSeconds>* stages) {
      RunContext child = child_context(context_, with_progress);
      const double seconds = timed([&] { level_set_ = hermesh::voxelize(input_.mesh, recipe_, child); });
      if (stages) *stages = child.stage_seconds;
      return seconds;
    };
    const PeakMemory memory;
    std::optional<StageSeconds> stages;
    const double first = once(true, &stages);
    voxelization_["peak_bytes"] = optional_json(memory.bytes());
    if (!level_set_ || level_set_.active_voxels() == 0)
      throw Error("the voxelizer " + job_.voxelizer.label + " gave a level set without active voxels");
    Timing timing(job_, first, *stages);
    timing.contender.run = [&] {
      const double seconds = once(false, &stages);
      timing.stages.push_back(*stages);
      return seconds;
    };
    race(std::span(&timing.contender, 1));
    voxelization_["seconds"] = seconds_json(timing.contender.seconds, timing.warm);
    voxelization_["stage_seconds"] = stages_json(timing.stages);
    voxelization_["digest"] = digest(level_set_);
    voxelization_["active_voxels"] = level_set_.active_voxels();
    voxelization_["memory_bytes"] = level_set_.memory_bytes();
    const LostSurface lost = find_lost_surface(input_.mesh, level_set_,
                                               leaves_out_inner_polygons(recipe_.chosen.voxelizer), context_);
    voxelization_["lost_surface"] = {{"share", lost.share()}, {"thickness", lost.thickness}};
  }

  PolygonMesh extract(const Cell& cell, RunContext& child) const {
    return hermesh::extract(level_set_, &input_.mesh, cell.recipe, child).mesh;
  }

  void extract_and_judge(Cell& cell, std::size_t number) {
    context_.check();
    RunContext child = child_context(context_, true);
    PolygonMesh mesh;
    {
      const PeakMemory memory;
      const double seconds = own_seconds(timed([&] { mesh = extract(cell, child); }), child);
      const auto peak = peak_of_command(child) ? peak_of_command(child) : memory.bytes();
      cell.row["peak_bytes"] = optional_json(peak);
      if (peak) cell.row["bytes_per_active_voxel"] = static_cast<double>(*peak) / level_set_.active_voxels();
      cell.timing.emplace(job_, seconds, child.stage_seconds);
    }
    cell.row["triangle_count"] = mesh.triangle_count();
    cell.row["digest"] = digest(mesh);
    if (mesh.empty()) throw Error("the mesh is empty");
    const std::filesystem::path folder =
        job_.out / "meshes" / (job_.head.value("experiment", "") + "-" + job_.files);
    std::filesystem::create_directories(folder);
    cell.mesh_file =
        folder / (std::to_string(number + 1) + "-" + file_name(cell.row["variant"]["label"]) + ".ply");
    write_mesh(cell.mesh_file, mesh, child);
    cell.row["notes"] = child.notes;
    for (const auto& [name, value] : child.figures) cell.row["figures"][name] = value;
    mesh = {};
    judge_file(cell);
  }

  /// Validates the mesh as stored in its file, so that the writer and the reader are validated with it.
  void judge_file(Cell& cell) {
    RunContext child = child_context(context_, true);
    validation::CheckOptions options;
    options.self_intersections = job_.self_intersections;
    options.reference = &source_;
    options.samples = job_.samples;
    options.voxel_size = voxel_size_;
    if (job_.features) {
      options.features = &source_;
      options.dihedral_degrees = *job_.features;
    }
    const Promises& promises = cell.recipe.chosen.extractor.promises;
    MeshFile mesh;
    Judgement judgement;
    cell.row["judge_seconds"] = timed([&] {
      mesh = read_mesh_file(cell.mesh_file, child);
      judgement = judge(mesh, promises, options, child);
    });
    const auto& [report, check] = judgement;
    if (!cell.uniform.empty()) compare_with_uniform(mesh, cell, child);
    cell.row["report"] = validation::to_json(report);
    cell.row["broken"] = check.broken;
    cell.row["unchecked"] = check.unchecked;
    cell.row["promise_letters"] = promise_letters(promises, check);
    cell.row["promise_verdict"] = promise_verdict(promises, check);
    Json disagreements = Json::array();
    for (const validation::LibraryCounts& library : report.libraries)
      for (const std::string& sentence : library.disagreements)
        disagreements.push_back(library.library + ": " + sentence);
    cell.row["disagreements"] = std::move(disagreements);
  }

  /// In both directions; nothing if that mesh failed or was not requested.
  void compare_with_uniform(const MeshFile& mesh, Cell& cell, RunContext& child) const {
    const auto other = std::ranges::find_if(
        cells_, [&](const Cell& each) { return each.row["variant"]["label"] == cell.uniform; });
    if (other == cells_.end() || other->mesh_file.empty()) return;
    const MeshFile uniform = read_mesh_file(other->mesh_file, child);
    const validation::TriangleSoup ours(mesh), theirs(uniform);
    const auto add = [&](const char* key, const validation::TriangleSoup& from,
                         const validation::TriangleSoup& to) {
      const auto found =
          validation::sampled_distances(from, validation::TriangleTree(to), job_.samples, child);
      cell.row[key] = {{"rms", found.rms}, {"max", found.max}};
    };
    add("to_uniform", ours, theirs);
    add("from_uniform", theirs, ours);
  }

  double repeat(Cell& cell) {
    context_.check();
    watch_.step(cell.row);
    RunContext child = child_context(context_, false);
    std::optional<PolygonMesh> mesh;
    const double seconds = own_seconds(timed([&] { mesh.emplace(extract(cell, child)); }), child);
    cell.timing->stages.push_back(child.stage_seconds);
    if (digest(*mesh) != cell.row["digest"]) cell.row["repetitions_differ"] = true;
    return seconds;
  }

  void time_all() {
    const Stage stage(context_, "timing");
    std::vector<Racer> racers;
    for (Cell& cell : cells_)
      if (cell.timing) racers.push_back({*cell.timing, cell.row, [this, &cell] { return repeat(cell); }});
    race_cells(racers);
    for (const Racer& racer : racers)
      racer.row["nanoseconds_per_active_voxel"] = 1e9 * racer.row["seconds"]["median"].get<double>() /
                                                  static_cast<double>(level_set_.active_voxels());
  }

  void picture(const std::vector<Json>& rows) {
    Sheet sheet;
    sheet.title = input_.name + " at resolution " + std::to_string(*job_.resolution);
    sheet.subtitle =
        input_.origin + ", sha256 " + input_.sha256.substr(0, 12) + "; voxelizer " + job_.voxelizer.label;
    sheet.frame = bounds(input_.mesh);
    sheet.close_up = job_.close_up;
    sheet.viewpoint = job_.viewpoint;
    sheet.cell_pixels = job_.pixels;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      std::string size = readable(rows[i].value("triangle_count", 0.0)) + " triangles";
      if (rows[i].contains("seconds"))
        size += " · " + readable(rows[i]["seconds"]["median"].get<double>()) + " s";
      std::vector<std::string> captions = {size};
      if (rows[i].contains("report") && rows[i]["report"].contains("from_reference"))
        captions.push_back("rms from input " +
                           readable(rows[i]["report"]["from_reference"]["rms"].get<double>() / voxel_size_) +
                           " voxel");
      captions.push_back(caption_of(rows[i]["promise_verdict"]));
      sheet.pictures.push_back({rows[i]["variant"]["label"], captions, [this, i] {
                                  RunContext child = child_context(context_, false);
                                  const auto& file = cells_[i].mesh_file;
                                  return file.empty() ? PolygonMesh{} : read_mesh(file, child);
                                }});
    }
    render_sheet(job_.out / (job_.files + ".png"), std::move(sheet), context_);
  }

  const GroupJob& job_;
  const LoadedCase& input_;
  const Tables& tables_;
  const CellWatch& watch_;
  RunContext& context_;
  VoxelizeRecipe recipe_;
  double voxel_size_;
  LevelSet level_set_;
  MeshFile source_;
  Json voxelization_;
  std::vector<Cell> cells_;
};

}  // namespace

std::vector<Json> run_group(const GroupJob& job, const LoadedCase& input, const Tables& tables,
                            const CellWatch& watch, RunContext& context) {
  return Group(job, input, tables, watch, context).run();
}

}  // namespace hermesh
