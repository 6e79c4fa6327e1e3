#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <type_traits>

#include "algorithms/core/shown.h"
#include "experiments/harness/job.h"

namespace hermesh {
namespace {

constexpr int kDeepest = 64;  ///< levels of nested JSON; copies and destructors recurse

[[noreturn]] void refuse(const std::string& key, const std::string& why) {
  throw Error("the job is malformed: \"" + shown(key) + "\" " + why + "; `hermesh run` writes valid jobs");
}

/// Returns the value of a key. @throws Error if there is none.
const Json& value_at(const Json& json, const std::string& key) {
  const auto found = json.find(key);
  if (found == json.end()) refuse(key, "is missing");
  return *found;
}

/// Returns a value of this type; `key` is its name in messages. A conversion by nlohmann's library would wrap
/// integers, and is undefined for real numbers out of range.
template <class T>
T as(const Json& value, const std::string& key) {
  if constexpr (std::is_same_v<T, std::string>) {
    if (!value.is_string()) refuse(key, "must be text");
    return value.get<std::string>();
  } else if constexpr (std::is_same_v<T, bool>) {
    if (!value.is_boolean()) refuse(key, "must be true or false");
    return value.get<bool>();
  } else if constexpr (std::is_same_v<T, double>) {
    if (!value.is_number() || !std::isfinite(value.get<double>())) refuse(key, "must be a number");
    return value.get<double>();
  } else if constexpr (std::is_integral_v<T>) {
    constexpr T kMost = std::numeric_limits<T>::max();
    const bool fits = value.is_number_unsigned() && value.get<std::uint64_t>() <= std::uint64_t(kMost);
    if (!fits) refuse(key, "must be a whole number from 0 to " + std::to_string(kMost));
    return value.get<T>();
  } else {
    if (!value.is_array()) refuse(key, "must be a list");
    T list;
    for (const Json& item : value) list.push_back(as<typename T::value_type>(item, key));
    return list;
  }
}

template <class T>
T get(const Json& json, const std::string& key) {
  return as<T>(value_at(json, key), key);
}

/// Returns the value of a key, nothing if it is missing or null.
template <class T>
std::optional<T> optional_at(const Json& json, const std::string& key) {
  const auto found = json.find(key);
  return found == json.end() || found->is_null() ? std::nullopt : std::optional<T>(as<T>(*found, key));
}

/// Returns a list of n numbers, nothing if it is missing or null.
template <std::size_t n>
std::optional<std::array<double, n>> numbers_at(const Json& json, const std::string& key) {
  const auto given = optional_at<std::vector<double>>(json, key);
  if (!given) return std::nullopt;
  if (given->size() != n) refuse(key, "must be a list of " + std::to_string(n) + " numbers");
  std::array<double, n> numbers;
  std::ranges::copy(*given, numbers.begin());
  return numbers;
}

VariantEntry read_variant(const Json& json, const std::string& key) {
  if (!json.is_object()) refuse(key, "must be an object");
  VariantEntry variant{.name = get<std::string>(json, "name"),
                       .label = get<std::string>(json, "label"),
                       .uniform = optional_at<std::string>(json, "uniform").value_or(""),
                       .command = optional_at<std::string>(json, "command").value_or("")};
  const Json& options = value_at(json, "options");
  if (!options.is_object()) refuse("options", "must be an object");
  for (const auto& [name, value] : options.items()) variant.options[name] = as<std::string>(value, name);
  return variant;
}

JudgedBy::Signs read_signs(const std::string& name) {
  constexpr std::array kNames = {"none", "parity", "unanimous-parity", "winding-number"};
  const auto at = std::ranges::find(kNames, name);
  if (at == kNames.end()) refuse("signs", "cannot be \"" + shown(name) + "\"");
  return JudgedBy::Signs(at - kNames.begin());
}

}  // namespace

AnyJob read_job(std::string_view line) {
  const auto check_depth = [](int depth, Json::parse_event_t, Json&) {
    if (depth > kDeepest)
      throw Error("the job is malformed: it is nested more than " + std::to_string(kDeepest) +
                  " levels deep");
    return true;
  };
  AnyJob job;
  job.json = Json::parse(line, check_depth, false);
  if (!job.json.is_object())
    throw Error("expected a job on the standard input; `hermesh run` starts this program");
  job.kind = get<std::string>(job.json, "kind");
  job.threads = get<std::size_t>(job.json, "threads");
  if (job.threads == 0) refuse("threads", "must be at least 1");
  job.require_data = get<bool>(job.json, "require_data");
  job.out = optional_at<std::string>(job.json, "out").value_or("");
  return job;
}

std::optional<ChangedParameter> read_change(const Json& job) {
  const Json& change = value_at(job, "sweep");
  if (change.is_null()) return std::nullopt;
  if (!change.is_object()) refuse("sweep", "must be an object");
  return ChangedParameter{get<std::string>(change, "parameter"), get<double>(change, "value")};
}

GroupJob read_group_job(const Json& job) {
  GroupJob result;
  result.extraction = get<std::string>(job, "kind") == "extraction";
  result.head = value_at(job, "head");
  result.input = get<std::string>(job, "case");
  result.sweep = read_change(job);
  result.resolution = optional_at<int>(job, "resolution");
  result.voxel_size = optional_at<double>(job, "voxel_size");
  if (!result.resolution && !result.voxel_size) refuse("resolution", "or \"voxel_size\" is missing");
  result.length = optional_at<double>(job, "length");
  result.published_seconds = optional_at<double>(job, "published_seconds");
  const Json& variants = value_at(job, "variants");
  if (!variants.is_array()) refuse("variants", "must be a list");
  for (const Json& variant : variants) result.variants.push_back(read_variant(variant, "variants"));
  if (result.extraction) result.voxelizer = read_variant(value_at(job, "voxelizer"), "voxelizer");
  result.exterior_band = get<double>(job, "exterior_band");
  result.interior_band = get<double>(job, "interior_band");
  result.judged = {.distances = optional_at<std::int64_t>(job, "distances"),
                   .to_boundary = get<bool>(job, "to_boundary"),
                   .signs = read_signs(get<std::string>(job, "signs")),
                   .sign_samples = get<std::int64_t>(job, "sign_samples"),
                   .solid = get<std::string>(job, "solid")};
  result.features = optional_at<double>(job, "features");
  if (const auto closeup = numbers_at<4>(job, "closeup"))
    result.close_up = {.centre = {(*closeup)[0], (*closeup)[1], (*closeup)[2]}, .size = (*closeup)[3]};
  if (const auto view = numbers_at<2>(job, "view")) result.viewpoint = {(*view)[0], (*view)[1]};
  result.repetitions = get<int>(job, "repetitions");
  result.seconds_per_variant = get<double>(job, "seconds_per_variant");
  result.samples = get<std::int64_t>(job, "samples");
  result.pixels = get<int>(job, "pixels");
  result.self_intersections = get<bool>(job, "self_intersections");
  result.components = get<bool>(job, "components");
  result.out = get<std::string>(job, "out");
  result.files = get<std::string>(job, "files");
  return result;
}

}  // namespace hermesh
