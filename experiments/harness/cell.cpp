#include "experiments/harness/cell.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>
#include <nlohmann/json.hpp>

namespace hermesh {

RunContext child_context(const RunContext& context, bool with_progress) {
  RunContext child;
  child.cancel = context.cancel;
  if (with_progress) child.on_progress = context.on_progress;
  return child;
}

std::optional<std::string> attempt(const std::function<void()>& work) {
  try {
    work();
    return std::nullopt;
  } catch (const Cancelled&) {
    throw;
  } catch (const DataMissing&) {
    throw;
  } catch (const std::bad_alloc&) {
    return "there is not enough memory";
  } catch (const std::exception& error) {
    return error.what();
  }
}

void mark_failed(Json& row, const std::string& sentence) {
  row["failed"] = sentence;
  row["promise_letters"] = "FAILED";
  row["promise_verdict"] = "FAILED: " + sentence;
}

void mark_absent(Json& row, const std::string& reason) {
  mark_failed(row, "absent: " + reason);
  row["absent"] = true;
  row["promise_letters"] = "absent";
  row["promise_verdict"] = "absent: " + reason;
}

Timing::Timing(const GroupJob& job, double first_seconds, StageSeconds first_stages) {
  contender.budget_seconds = job.seconds_per_variant;
  contender.repetitions = job.repetitions;
  warm = first_seconds < job.seconds_per_variant;
  if (warm) return;
  contender.seconds = {first_seconds};
  stages = {std::move(first_stages)};
}

Json load_averages() {
  std::array<double, 3> load{};
  if (getloadavg(load.data(), 3) != 3) return nullptr;
  return {load[0], load[1], load[2]};
}

void race_cells(std::vector<Racer> racers) {
  const Json load = load_averages();
  std::vector<Contender> contenders;
  for (const Racer& racer : racers) {
    contenders.push_back(racer.timing.contender);
    contenders.back().run = racer.repeat;
  }
  race(contenders);
  for (std::size_t i = 0; i < racers.size(); ++i) {
    Json& row = racers[i].row;
    row["seconds"] = seconds_json(contenders[i].seconds, racers[i].timing.warm);
    row["stage_seconds"] = stages_json(racers[i].timing.stages);
    row["load"] = load;
  }
}

Json seconds_json(const std::vector<double>& seconds, bool warm) {
  return {{"median", median(seconds)},
          {"minimum", *std::min_element(seconds.begin(), seconds.end())},
          {"repetitions", seconds.size()},
          {"warm", warm},
          {"all", seconds}};
}

Json stages_json(const std::vector<StageSeconds>& repetitions) {
  Json json = Json::object();
  for (const auto& [name, seconds] : median_stages(repetitions)) json[name] = seconds;
  return json;
}

Json optional_json(const std::optional<std::int64_t>& value) { return value ? Json(*value) : Json(nullptr); }

Json case_json(const LoadedCase& input) {
  Json json = {{"name", input.name},
               {"origin", input.origin},
               {"sha256", input.sha256},
               {"points", input.mesh.points.size()},
               {"triangles", input.mesh.triangle_count()}};
  if (input.seed) json["seed"] = *input.seed;
  return json;
}

Json variant_json(const VariantEntry& variant, const Options& options) {
  return {{"name", variant.name}, {"label", variant.label}, {"options", options.canonical()}};
}

std::string file_name(std::string label) {
  for (char& c : label)
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '.' && c != '-') c = '-';
  return label;
}

}  // namespace hermesh
