#include "experiments/ledger/value_class.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <nlohmann/json.hpp>

namespace hermesh {
namespace {

using Words = std::initializer_list<const char*>;

bool has_any(const std::string& text, Words words) {
  return std::ranges::any_of(words, [&](const char* word) { return text.find(word) != std::string::npos; });
}

bool begins_with_any(const std::string& text, Words words) {
  return std::ranges::any_of(words, [&](const char* word) { return text.starts_with(word); });
}

/// What somebody else's text gives, beside ours.
bool is_printed(const Column& column) {
  return begins_with_any(column.name, {"printed", "published", "expected"});
}

bool has_unit_of_time(const Column& column) {
  return has_any(column.header, {"[s]", "[ms]", "[µs]", "[ns]"});
}

/// Rates, ratios and shares of times, which repeat what the times say, and what the machine decides.
bool is_derived(const Column& column) {
  return column.name == "ns" || column.name == "repetitions" || column.name == "ways" ||
         column.name == "bytes_per_voxel" ||
         has_any(column.name, {"speedup", "efficiency", "shortest", "_least", "gigabytes", "seconds_of",
                               "_over_", "cpu_", "judge_seconds", "seconds_min"}) ||
         begins_with_any(column.name, {"ns_per", "level_1", "level_2"}) ||
         has_any(column.header, {"times as fast", "÷ bandwidth", "GB/s", "ns/", "µs/"});
}

bool is_peak(const Column& column) { return has_any(column.name, {"peak", "resident"}); }

bool names_a_slope(const std::string& name) {
  return name == "slope" || name == "order" || name.ends_with("_slope") || name.ends_with("_order");
}

bool bounds_a_slope(const std::string& name) {
  for (const char* end : {"_low", "_high"})
    if (name.ends_with(end) && names_a_slope(name.substr(0, name.size() - std::string(end).size())))
      return true;
  return false;
}

bool has_interval(const Column& column, const Json& row) {
  const std::string folder = column.pointer.substr(0, column.pointer.size() - column.name.size());
  return find(row, folder + lower_bound_of(column.name)) && find(row, folder + upper_bound_of(column.name));
}

}  // namespace

const char* name(ValueClass value_class) {
  switch (value_class) {
    case ValueClass::kExact:
      return "exact";
    case ValueClass::kError:
      return "error";
    case ValueClass::kSlope:
      return "slope";
    case ValueClass::kTime:
      return "time";
    case ValueClass::kMemory:
      return "memory";
    case ValueClass::kDerived:
      break;
  }
  return "derived";
}

std::string lower_bound_of(const std::string& slope) { return slope + "_low"; }
std::string upper_bound_of(const std::string& slope) { return slope + "_high"; }

ValueClass class_of(const Column& column, const Json& value, const Json& row) {
  if (is_printed(column)) return ValueClass::kExact;
  if (is_derived(column)) return ValueClass::kDerived;
  if (has_unit_of_time(column)) return ValueClass::kTime;
  if (is_peak(column)) return ValueClass::kMemory;
  if (bounds_a_slope(column.name)) return ValueClass::kDerived;
  if (names_a_slope(column.name) && has_interval(column, row)) return ValueClass::kSlope;
  if (value.is_number_float() || value.is_null()) return ValueClass::kError;
  return ValueClass::kExact;
}

Worse worse_of(const Column& column) {
  if (has_any(column.name, {"smallest_angle", "precision", "recall", "held"})) return Worse::kSmaller;
  if (has_any(column.name, {"rms", "mean", "max", "error", "excess", "largest", "escape", "lost", "missed",
                            "wrong", "difference", "aspect", "length_off", "bytes", "mib"}) ||
      column.name == "median" || column.name == "p95" || column.name == "p99" ||
      has_any(column.header, {"MiB", "KiB", "[B]", "B/"}))
    return Worse::kLarger;
  return Worse::kEither;
}

bool is_count(const Column& column, double value) {
  return std::abs(value) >= 1.0 && value == std::round(value) &&
         !has_any(column.header, {"[", "%", "B/", "MiB"});
}

}  // namespace hermesh
