#include "experiments/harness/harness.h"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "experiments/ablations/effect_report.h"
#include "experiments/ablations/prediction.h"
#include "experiments/ablations/read_ablation.h"
#include "experiments/cases/cases.h"
#include "experiments/harness/cell.h"
#include "experiments/harness/digest.h"
#include "experiments/harness/failures.h"
#include "experiments/harness/group_worker.h"
#include "experiments/harness/provenance.h"
#include "experiments/harness/run_cells.h"
#include "experiments/harness/sha256.h"
#include "experiments/sweep/shards.h"
#include "experiments/harness/table.h"
#include "experiments/harness/toml_section.h"

namespace hermesh {
namespace {

Json run_head(const Experiment& experiment, const std::optional<Ablation>& ablation, const RunSettings& settings) {
  Json head = {{"experiment", experiment.name}, {"tier", settings.tier}, {"question", experiment.question}};
  const Json origin = provenance(experiments_folder());
  head["run"] = origin.at("date").get<std::string>() + "-" + std::to_string(getpid());
  head.update(origin);
  if (!experiment.columns.empty()) head["columns"] = experiment.columns;
  if (!experiment.plots.empty()) head["plots"] = Json::array();
  for (const Plot& plot : experiment.plots) head["plots"].push_back(to_json(plot));
  if (ablation) {
    head["ablation"] = to_json(*ablation);
    head["ablation"]["prediction"] = prediction_of(settings.experiment);
    check_prediction(head.at("ablation").at("prediction"), settings.out);
  }
  if (experiment.kind == ExperimentKind::kExtraction) return head;
  const bool voxelization = experiment.kind == ExperimentKind::kVoxelization;
  head["kind"] = voxelization ? "voxelization" : "measurement";
  if (voxelization)
    head["band"] = {{"exterior", experiment.exterior_band}, {"interior", experiment.interior_band}};
  return head;
}

/// What the file predicts, if it is an ablation.
std::optional<Ablation> ablation_of(const Experiment& experiment, const RunSettings& settings, const Tables& tables) {
  return read_ablation(settings.experiment, experiment,
                       {tables.extractors, tables.voxelizers, tables.cases, column_names(), tables.measurements});
}

/// 3 for a broken promise, for judges that contradict one another or for data that are required and missing, 1 for a cell
/// that failed; a variant that is not installed is no failure.
int exit_code(const std::vector<Json>& rows) {
  int code = 0;
  for (const Json& row : rows) {
    const auto any = [&](const char* key) { return row.contains(key) && !row.at(key).empty(); };
    if (any("broken") || any("disagreements")) return 3;
    if (row.contains("data_missing")) return 3;
    if (row.contains("failed") && !row.contains("absent")) code = 1;
  }
  return code;
}

/// A folder for results. If nothing came into it, the destructor removes it again with those above that were made for it.
class ResultFolder {
 public:
  explicit ResultFolder(std::filesystem::path folder) : folder_(std::move(folder)) {
    std::error_code error;
    for (std::filesystem::path at = std::filesystem::absolute(folder_).lexically_normal(); !at.empty() && !exists(at, error);
         at = at.parent_path())
      if (at.has_filename()) made_.push_back(at);
    std::filesystem::create_directories(folder_, error);
    if (!error) return;
    remove_empty();
    throw Error("cannot make the folder " + folder_.string() + ": " + error.message());
  }
  ~ResultFolder() { remove_empty(); }
  ResultFolder(const ResultFolder&) = delete;
  ResultFolder& operator=(const ResultFolder&) = delete;
  const std::filesystem::path& path() const { return folder_; }

 private:
  void remove_empty() const {
    std::error_code not_empty;
    for (const std::filesystem::path& made : made_) std::filesystem::remove(made, not_empty);
  }
  std::filesystem::path folder_;
  std::vector<std::filesystem::path> made_;  ///< the innermost first
};

/// The folder, if rows may go there.
std::filesystem::path kept_folder(const std::filesystem::path& out) {
  check_may_be_kept(out, experiments_folder().parent_path(), source_state());
  return out;
}

/// Puts something before the stages that are announced, until it goes.
class ProgressPrefix {
 public:
  ProgressPrefix(RunContext& context, std::string prefix) : context_(context), shown_(context.on_progress) {
    if (shown_)
      context.on_progress = [this, prefix = std::move(prefix)](std::string_view stage, double fraction) {
        shown_(prefix + std::string(stage), fraction);
      };
  }
  ~ProgressPrefix() { context_.on_progress = shown_; }
  ProgressPrefix(const ProgressPrefix&) = delete;
  ProgressPrefix& operator=(const ProgressPrefix&) = delete;

 private:
  RunContext& context_;
  std::function<void(std::string_view, double)> shown_;
};

/// The hash of this program's file, 16 digits of it.
const std::string& program_hash() {
  static const std::string hash = sha256_of_file("/proc/self/exe").substr(0, 16);
  return hash;
}

/// Runs the cells of a tier, one group after the other; every group's rows are on disk before the next one starts.
class Run {
 public:
  Run(const RunSettings& settings, std::optional<Shard> shard, const Tables& tables, RunContext& context, std::ostream& table)
      : settings_(settings),
        shard_(shard),
        context_(context),
        table_(table),
        plan_(settings, tables),
        folder_(kept_folder(settings.out)),
        file_(folder_.path() / "rows.jsonl"),
        head_(run_head(plan_.experiment, ablation_of(plan_.experiment, settings, tables), settings)),
        quiet_(child_context(context, false)),
        worker_(plan_, folder_.path(), settings.filter, settings.apart ? quiet_ : context),
        start_(std::chrono::steady_clock::now()) {
    head_["binary"] = program_hash();
    own_run_ = text_at(head_, "/run");
    if (settings.apart) apart_ = *settings.apart;
    if (apart_.limits.seconds == 0) apart_.limits.seconds = plan_.tier.timeout.value_or(0.0);
    if (apart_.limits.bytes == 0) apart_.limits.bytes = std::int64_t(plan_.tier.memory_mib.value_or(0.0) * (1 << 20));
    constexpr double kTimeout = 3600, kShareOfMemory = 0.8;
    // A measurement may take hours for a row, as long as nobody asks for less.
    if (apart_.limits.seconds == 0 && !is_measurement()) apart_.limits.seconds = kTimeout;
    if (apart_.limits.bytes == 0)
      apart_.limits.bytes = std::int64_t(kShareOfMemory * double(sysconf(_SC_PHYS_PAGES)) * double(sysconf(_SC_PAGE_SIZE)));
  }

  int run() {
    const std::vector<GroupId> groups = shard_ ? own_groups(worker_.groups()) : worker_.groups();
    read_what_is_there();
    table_ << "## " << plan_.experiment.name << " (" << settings_.tier << "): " << plan_.experiment.question << "\n\n";
    for (std::size_t i = 0; i < groups.size(); ++i) {
      const ProgressPrefix prefix(context_, overall(i, groups.size()));
      is_measurement() ? measure() : run_group(groups[i]);
      if (is_measurement() || i + 1 == groups.size() || !share_a_table(groups[i], groups[i + 1])) print_tables();
      say_done(i, groups);
    }
    if (shard_) {
      manifest_.finished = true;
      write_manifest(manifest_, folder_.path());
      table_ << "Shard " << name_of(*shard_) << ": " << rows_.size() << " of " << manifest_.cells.size() << " cells\n\n";
    }
    if (shard_ && rows_.empty()) return 0;
    if (rows_.empty())
      throw Error("no cell of " + plan_.experiment.name + " contains \"" + settings_.filter +
                  "\" in its case/resolution/variant");
    if (there_ > 0)
      context_.note(std::to_string(there_) + " of " + std::to_string(rows_.size()) + " cells were in " + file_.string() +
                    " already, made by this program of the same data; --again makes them anew");
    if (!is_measurement()) write_legend(rows_, table_);
    table_ << "\nRows: " << file_.string() << "; pictures: " << (folder_.path() / "*.png").string() << "\n";
    // Of all rows in the folder: earlier runs with another filter belong to the same picture.
    if (!shard_) {
      const std::vector<Json> all = read_rows(file_);
      write_plots(all, folder_.path(), table_);
      const std::vector<JudgedAblation> ablations = judge_ablations(all);
      for (const JudgedAblation& judged : ablations)
        if (judged.experiment == plan_.experiment.name && judged.tier == settings_.tier) {
          table_ << '\n';
          write_effects(judged, table_);
        }
      write_forest_plots(ablations, folder_.path(), table_);
    }
    write_failures(rows_, table_);
    return exit_code(rows_);
  }

 private:
  bool is_measurement() const { return plan_.experiment.kind == ExperimentKind::kMeasurement; }
  bool is_extraction() const { return plan_.experiment.kind == ExperimentKind::kExtraction; }

  // ---- What is there already.

  /// What decides whether a row is of this cell: all that the file says about it.
  std::string fingerprint(const GroupId& id, const VariantEntry& variant) const {
    const Tier& tier = plan_.tier;
    const CaseEntry& entry = tier.cases[id.entry];
    const auto named = [](const VariantEntry& each) { return Json{each.name, each.label, each.options, each.uniform, each.command}; };
    Json cell = {int(plan_.experiment.kind), worker_.name_of(id), named(variant), tier.repetitions, tier.seconds_per_variant,
                 tier.samples, tier.pixels, tier.self_intersections, tier.components, plan_.experiment.exterior_band,
                 plan_.experiment.interior_band, head_.at("threads")};
    if (is_extraction()) cell.push_back(named(plan_.experiment.voxelizers[id.voxelizer]));
    if (plan_.experiment.features) cell.push_back(*plan_.experiment.features);
    // A row is of the prediction that was made before it.
    if (head_.contains("ablation")) cell.push_back(head_.at("ablation"));
    const JudgedBy& judged = entry.judged;
    cell.push_back({judged.distances.value_or(-1), judged.to_boundary, int(judged.signs), judged.sign_samples, judged.solid,
                    entry.length.value_or(0.0), entry.sweep ? entry.sweep->parameter : ""});
    return digest_of_text(cell.dump());
  }
  std::string fingerprint_of_measurement() const {
    Json cell{plan_.experiment.measurement, plan_.experiment.seed, plan_.tier.parameters, head_.at("threads")};
    if (head_.contains("ablation")) cell.push_back(head_.at("ablation"));
    return digest_of_text(cell.dump());
  }

  // ---- Shards.

  static std::string name_of(const Shard& shard) { return std::to_string(shard.number) + "/" + std::to_string(shard.of); }

  /// Returns the groups of the shard, and writes its manifest.
  std::vector<GroupId> own_groups(const std::vector<GroupId>& all) {
    const Overrides& changed = settings_.overrides;
    if (is_measurement())
      throw Error(plan_.experiment.name + " is a measurement, one function that makes all of its rows, and has no shards");
    if (!settings_.filter.empty() || !changed.variants.empty() || !changed.cases.empty() || !changed.resolutions.empty() ||
        changed.repetitions)
      throw Error("a shard is a part of the whole file, of which nothing can be left out or changed");
    std::vector<double> weights;
    for (const GroupId& id : all) weights.push_back(worker_.weight_of(id));
    const std::vector<int> parts = partition(weights, shard_->of);
    std::vector<GroupId> own;
    std::set<std::string> cells;
    manifest_ = {.experiment = plan_.experiment.name, .tier = settings_.tier, .file_sha256 = sha256_of_file(settings_.experiment),
                 .shard = *shard_, .commit = text_at(head_, "/commit"), .binary = program_hash(),
                 .threads = head_.at("threads").get<int>()};
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (parts[i] == shard_->number) own.push_back(all[i]);
      const std::string voxelizer = is_extraction() ? plan_.experiment.voxelizers[all[i].voxelizer].label + "/" : "";
      for (const VariantEntry& variant : worker_.contenders(all[i])) {
        manifest_.cells.push_back({fingerprint(all[i], variant), worker_.name_of(all[i]) + voxelizer + variant.label, parts[i]});
        if (!cells.insert(manifest_.cells.back().cell).second)
          throw Error(plan_.experiment.name + " names the cell " + manifest_.cells.back().name + " twice, and so has no shards");
      }
    }
    if (std::filesystem::exists(manifest_path(folder_.path()))) {
      const ShardManifest there = read_manifest(folder_.path());
      if (there.experiment != manifest_.experiment || there.tier != manifest_.tier || there.file_sha256 != manifest_.file_sha256 ||
          there.shard != manifest_.shard)
        throw Error(folder_.path().string() + " holds shard " + name_of(there.shard) + " of " + there.experiment + " (" +
                    there.tier + ") as its file was then; take another folder for this one");
    } else if (std::filesystem::exists(file_)) {
      throw Error(folder_.path().string() + " holds rows that are of no shard; take another folder for this one");
    }
    write_manifest(manifest_, folder_.path());
    return own;
  }

  void read_what_is_there() {
    if (!std::filesystem::exists(file_)) return;
    if (drop_torn_row(file_)) context_.note("the last line of " + file_.string() + " was half a row, and is gone");
    if (!settings_.resume || std::filesystem::file_size(file_) == 0) return;
    for (const Json& row : read_rows(file_))
      if (text_at(row, "/binary") == program_hash() && text_at(row, "/tier") == settings_.tier &&
          text_at(row, "/experiment") == plan_.experiment.name && row.contains("cell")) {
        there_by_cell_[text_at(row, "/cell") + (is_measurement() ? key_of(row) : "")] = row;
        earlier_run_ = text_at(row, "/run");
      }
  }
  static std::string key_of(const Json& row) { return text_at(row, "/case/name") + "/" + text_at(row, "/variant/label"); }

  /// The rows of the group, if all of them are there and of the data at hand.
  std::vector<Json> rows_there(const GroupId& id) {
    std::vector<Json> rows;
    for (const VariantEntry& variant : worker_.contenders(id)) {
      // Nobody knows whether an outside program is still the one that made the row.
      if (!variant.command.empty()) return {};
      const auto found = there_by_cell_.find(fingerprint(id, variant));
      if (found == there_by_cell_.end()) return {};  // of a group that is there in part none counts: its cells race each other
      rows.push_back(found->second);
    }
    // Rows of an input that cannot be read are of the data at hand as long as the reason stays the same.
    std::string place = "/case/sha256", now;
    try {
      now = worker_.input(id).sha256;
    } catch (const DataMissing& error) {
      place = "/failed", now = error.what();
    } catch (const CaseUnreadable& error) {
      place = "/failed", now = error.what();
    }
    if (std::ranges::any_of(rows, [&](const Json& row) { return text_at(row, place) != now; })) return {};
    return rows;
  }

  /// Whether the inputs of a measured row are at hand as it has them. Generated ones are the program's.
  bool has_inputs_of(const Json& row) {
    const Json* const inputs = find(row, "/inputs");
    if (!inputs) return true;
    return std::ranges::all_of(*inputs, [&](const Json& input) {
      const std::string name = input.value("name", ""), hash = input.value("sha256", "");
      if (input.value("origin", "") == "generated") return true;
      if (!hashes_.contains(name)) hashes_[name] = plan_.tables.load(name, quiet_).sha256;
      return hashes_[name] == hash;
    });
  }

  // ---- Groups.

  void run_group(const GroupId& id) {
    std::vector<Json> rows = rows_there(id);
    if (!rows.empty()) {
      there_ += rows.size();
    } else {
      // What joins an interrupted run is of that run, for tables are of one; what replaces rows of other data is not.
      const std::vector<VariantEntry> variants = worker_.contenders(id);
      const bool joins = !earlier_run_.empty() && std::ranges::none_of(variants, [&](const VariantEntry& variant) {
        return there_by_cell_.contains(fingerprint(id, variant));
      });
      head_["run"] = joins ? earlier_run_ : own_run_;
      try {
        rows = settings_.apart ? rows_apart(id) : worker_.rows(id, {}, head_, {});
      } catch (const DataMissing& error) {
        rows = failed_rows(id, error.what());
        for (Json& row : rows) row["data_missing"] = true;
      } catch (const CaseUnreadable& error) {
        rows = failed_rows(id, error.what());
      }
      for (Json& row : rows)
        for (const VariantEntry& variant : variants)
          if (variant.label == text_at(row, "/variant/label")) row["cell"] = fingerprint(id, variant);
      append_rows(file_, rows);
    }
    keep(std::move(rows));
  }

  void keep(std::vector<Json> rows) {
    std::ranges::copy(rows, std::back_inserter(rows_));
    std::ranges::move(rows, std::back_inserter(unprinted_));
  }

  Json job(const GroupId& id, const std::set<std::string>& left_out) const {
    const Overrides& overrides = settings_.overrides;
    Json json = {{"experiment", std::filesystem::absolute(settings_.experiment).string()},
                 {"tier", settings_.tier},
                 {"out", std::filesystem::absolute(settings_.out).string()},
                 {"filter", settings_.filter},
                 {"variants", overrides.variants},
                 {"cases", overrides.cases},
                 {"resolutions", overrides.resolutions},
                 {"repetitions", overrides.repetitions.value_or(0)},
                 {"parameters", overrides.parameters},
                 {"require_data", data_are_required()},
                 {"threads", head_.at("threads")},
                 {"head", head_},
                 {"group", to_json(id)},
                 {"left_out", left_out}};
    return json;
  }

  /// A row of a cell of which nothing more is known.
  Json bare_row(const GroupId& id, const VariantEntry& variant) const {
    const CaseEntry& entry = plan_.tier.cases[id.entry];
    Json row = head_;
    row["case"] = {{"name", entry.name}};
    if (entry.voxel_sizes.empty())
      row["resolution"] = entry.resolutions[id.size];
    else
      row["nominal_voxel_size"] = entry.voxel_sizes[id.size];
    if (entry.sweep) row["sweep"] = {{"parameter", entry.sweep->parameter}, {"value", entry.sweep->values[id.sweep]}};
    row["variant"] = {{"name", variant.name}, {"label", variant.label}, {"options", ""}};
    if (is_extraction()) row["voxelization"] = {{"label", plan_.experiment.voxelizers[id.voxelizer].label}};
    return row;
  }

  Json failed_row(Json row, const std::string& reason) const {
    is_extraction() ? mark_failed(row, reason) : void(row["failed"] = reason);
    return row;
  }

  /// The rows of a group that has no input.
  std::vector<Json> failed_rows(const GroupId& id, const std::string& reason) const {
    std::vector<Json> rows;
    for (const VariantEntry& variant : worker_.contenders(id)) rows.push_back(failed_row(bare_row(id, variant), reason));
    return rows;
  }

  std::vector<Json> rows_apart(const GroupId& id) {
    const std::vector<VariantEntry> variants = worker_.contenders(id);
    std::map<std::string, Json> found;
    std::set<std::string> left_out, crashed;
    const auto fail = [&](const VariantEntry& variant, const std::vector<Json>& planned, const std::string& reason) {
      Json row = bare_row(id, variant);
      for (const Json& each : planned)
        if (text_at(each, "/variant/label") == variant.label) {
          row = each;
          if (is_extraction()) row["voxelization"] = {{"label", plan_.experiment.voxelizers[id.voxelizer].label}};
        }
      found[variant.label] = failed_row(std::move(row), reason);
      left_out.insert(variant.label);
    };
    while (left_out.size() < variants.size()) {
      const ApartOutcome outcome = run_apart(apart_, job(id, left_out), {}, context_);
      if (outcome.reason.empty()) {
        for (const Json& row : outcome.rows) found[text_at(row, "/variant/label")] = row;
        break;
      }
      for (const VariantEntry& variant : variants)
        if (!left_out.contains(variant.label) && (outcome.culprit.empty() || outcome.culprit == variant.label)) {
          fail(variant, outcome.planned, outcome.culprit.empty() ? outcome.reason + " before a variant was at work" : outcome.reason);
          if (outcome.crashed && !outcome.culprit.empty()) crashed.insert(variant.label);
        }
    }
    // A crash may have its cause in a cell before it: whoever crashed gets a process for itself.
    if (variants.size() > 1)
      for (const std::string& label : crashed) {
        std::set<std::string> others;
        for (const VariantEntry& variant : variants)
          if (variant.label != label) others.insert(variant.label);
        const ApartOutcome alone = run_apart(apart_, job(id, others), {}, context_);
        if (!alone.reason.empty() || alone.rows.size() != 1) continue;
        found[label] = alone.rows[0];
        found[label]["notes"].push_back("this cell crashed beside others and not alone: its time is not interleaved with theirs");
      }
    std::vector<Json> rows;
    for (const VariantEntry& variant : variants)
      if (found.contains(variant.label)) rows.push_back(std::move(found.at(variant.label)));
    return rows;
  }

  /// Every table of a measurement has columns of its own.
  void measure() {
    std::set<std::string> done;
    std::vector<Json> rows;
    for (const auto& [key, row] : there_by_cell_)
      if (text_at(row, "/cell") == fingerprint_of_measurement() && !row.contains("failed") && has_inputs_of(row)) {
        done.insert(key_of(row));
        rows.push_back(row);
        ++there_;
      }
    if (!done.empty()) head_["run"] = earlier_run_;
    const auto take = [&](const Json& given) {
      Json row = given;
      row["cell"] = fingerprint_of_measurement();
      append_row(file_, row);
      rows.push_back(std::move(row));
    };
    if (!settings_.apart) {
      worker_.measure(done, head_, take);
    } else {
      const ApartOutcome outcome = run_apart(apart_, job({}, done), take, context_);
      if (!outcome.reason.empty()) {
        Json row = head_;
        row["measurement"] = {{"name", plan_.experiment.measurement}};
        row["case"] = {{"name", plan_.experiment.measurement}};
        row["variant"] = {{"name", plan_.experiment.measurement}, {"label", plan_.experiment.measurement}};
        row["failed"] = outcome.reason;
        take(row);
      }
    }
    keep(std::move(rows));
  }

  // ---- What is said.

  /// The values of a sweep, and voxel sizes, share a table.
  bool share_a_table(const GroupId& a, const GroupId& b) const {
    return !is_extraction() && a.entry == b.entry;
  }

  void print_tables() {
    // Rows that were there keep the run that made them, and so may stand in a table of their own.
    for (const RowGroup& group : latest_groups(unprinted_)) {
      write_markdown(group, table_);
      if (is_measurement()) {
        write_legend(group.rows, table_);
        table_ << '\n';
      }
    }
    table_.flush();
    unprinted_.clear();
  }

  double seconds_left(std::size_t done, std::size_t all) const {
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start_;
    return done == 0 ? 0.0 : elapsed.count() / double(done) * double(all - done);
  }
  std::string overall(std::size_t done, std::size_t all) const {
    if (all == 1) return "";
    std::string text = "[" + std::to_string(done + 1) + "/" + std::to_string(all);
    if (const double left = seconds_left(done, all); left >= 60)
      text += ", " + std::to_string(int(left / 60 + 0.5)) + " min left";
    return text + "] ";
  }
  void say_done(std::size_t i, const std::vector<GroupId>& groups) const {
    if (!settings_.log) return;
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start_;
    std::string line = "[" + std::to_string(i + 1) + "/" + std::to_string(groups.size()) + "] " + worker_.name_of(groups[i]);
    line.pop_back();
    if (is_extraction() && plan_.experiment.voxelizers.size() > 1)
      line += " by " + plan_.experiment.voxelizers[groups[i].voxelizer].label;
    line += ", " + readable(elapsed.count()) + " s since the start";
    if (i + 1 < groups.size()) line += ", about " + readable(seconds_left(i + 1, groups.size())) + " s left";
    settings_.log(line);
  }

  const RunSettings& settings_;
  std::optional<Shard> shard_;  ///< none: all cells
  RunContext& context_;
  std::ostream& table_;
  Plan plan_;
  ResultFolder folder_;
  std::filesystem::path file_;
  Json head_;
  RunContext quiet_;  ///< of loading a case to compare its hash, which the child does once more
  GroupWorker worker_;
  Apart apart_;
  std::chrono::steady_clock::time_point start_;
  std::map<std::string, Json> there_by_cell_;
  std::map<std::string, std::string> hashes_;
  std::string own_run_, earlier_run_;
  std::size_t there_ = 0;
  std::vector<Json> rows_, unprinted_;
  ShardManifest manifest_;  ///< of the shard, if there is one
};

}  // namespace

std::vector<ExperimentInfo> list_experiments() {
  std::vector<std::filesystem::path> files;
  for (const std::filesystem::path& folder : {experiments_folder() / "questions", experiments_folder() / "ablations" / "predictions"})
    if (std::filesystem::is_directory(folder))
      for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
        if (entry.path().extension() == ".toml") files.push_back(entry.path());
  std::ranges::sort(files, {}, [](const std::filesystem::path& file) { return file.filename(); });
  std::vector<ExperimentInfo> experiments;
  for (const auto& file : files) {
    ExperimentHead head = read_head(file);
    experiments.push_back({file.stem().string(), std::move(head.question), file, std::move(head.shows)});
  }
  return experiments;
}

std::filesystem::path experiment_file(const std::string& name) {
  const std::filesystem::path path = name;
  const bool is_path = path.extension() == ".toml" || path.has_parent_path();
  std::error_code error;
  if (is_path && std::filesystem::exists(path, error)) return path;
  std::vector<std::string> known;
  for (const ExperimentInfo& experiment : list_experiments()) {
    if (is_path && experiment.name == path.stem())
      throw Error("there is no file " + shown(name) + "; the project's experiment of that name is run by it: hermesh run " +
                  experiment.name);
    if (experiment.name == name || std::ranges::find(experiment.shows, name) != experiment.shows.end())
      return experiment.file;
    known.push_back(experiment.name);
    known.insert(known.end(), experiment.shows.begin(), experiment.shows.end());
  }
  if (is_path) return path;
  throw Error("there is no experiment \"" + shown(name) + "\"; there are " + joined(likest_first(known, name)));
}

int run_experiment(const RunSettings& settings, const Tables& tables, RunContext& context,
                   std::ostream& table) {
  return Run(settings, std::nullopt, tables, context, table).run();
}

int run_shard(const Shard& shard, const RunSettings& settings, const Tables& tables, RunContext& context, std::ostream& table) {
  return Run(settings, shard, tables, context, table).run();
}

Tables all_tables() {
  Tables tables{all_extractors(), all_voxelizers(), {}, load_case, load_changed_case};
  for (const CaseInfo& info : list_cases())
    if (info.kind != "volume") tables.cases.push_back(info.name);
  tables.measurements = {all_measurements().begin(), all_measurements().end()};
  return tables;
}

int run_experiment(const RunSettings& settings, RunContext& context, std::ostream& table) {
  return run_experiment(settings, all_tables(), context, table);
}

int run_shard(const Shard& shard, const RunSettings& settings, RunContext& context, std::ostream& table) {
  return run_shard(shard, settings, all_tables(), context, table);
}

int serve_cells(RunContext& context) { return serve_cells(all_tables(), context); }

}  // namespace hermesh
