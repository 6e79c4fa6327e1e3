#include "algorithms/core/options.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "algorithms/core/error.h"
#include "algorithms/core/variant.h"

namespace hermesh {

namespace {

std::optional<double> parse_number(std::string_view text) {
  // std::from_chars() does not depend on the locale. NaN would pass both comparisons with the range.
  double value = 0.0;
  const char* const end = text.data() + text.size();
  const auto [stop, status] = std::from_chars(text.data(), end, value);
  if (status != std::errc() || stop != end || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::string shortest(double value) {
  char buffer[32];
  return std::string(buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr);
}

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

std::string range(const OptionSpec& spec) {
  // 1e300, the default of OptionSpec::maximum, means no limit.
  const bool open_below = spec.minimum <= -1e300, open_above = spec.maximum >= 1e300;
  if (open_below && open_above) return "any number";
  if (open_above) return "a number of at least " + shortest(spec.minimum);
  if (open_below) return "a number of at most " + shortest(spec.maximum);
  return "a number from " + shortest(spec.minimum) + " to " + shortest(spec.maximum);
}

/// Returns the value as Options stores it: numbers in their shortest form, so that 0.10 and 0.1 are the same
/// setting.
std::string checked(std::string_view variant, const OptionSpec& spec, const std::string& value) {
  const std::string complaint =
      "option '" + spec.name + "' of " + std::string(variant) + " cannot be '" + value + "'; it takes ";
  if (!spec.choices.empty()) {
    if (std::ranges::find(spec.choices, value) == spec.choices.end())
      throw Error(complaint + "one of: " + joined(spec.choices));
    return value;
  }
  const std::optional<double> number = parse_number(value);
  if (!number || *number < spec.minimum || *number > spec.maximum) throw Error(complaint + range(spec));
  return shortest(*number);
}

/// Returns true if a condition of OptionSpec::only_with holds: the option has one of the values after
/// "name=".
bool holds(const std::string& condition, const Options& options) {
  const auto [name, values] = parse_option(condition);
  for (std::size_t first = 0; first <= values.size();) {
    const std::size_t end = std::min(values.find('|', first), values.size());
    if (options.is(name, values.substr(first, end - first))) return true;
    first = end + 1;
  }
  return false;
}

/// Returns a condition for a message: "kind=packed or fixed".
std::string in_words(std::string condition) {
  for (std::size_t bar; (bar = condition.find('|')) != std::string::npos;) condition.replace(bar, 1, " or ");
  return condition;
}

}  // namespace

Options::Options(std::string_view variant, std::span<const OptionSpec> declared,
                 const std::map<std::string, std::string>& given) {
  // Unknown names first: a misspelled name must not pass for an omitted option.
  for (const auto& [name, value] : given) {
    if (std::ranges::find(declared, name, &OptionSpec::name) != declared.end()) continue;
    std::vector<std::string> names;
    for (const OptionSpec& spec : declared) names.push_back(spec.name);
    throw Error(std::string(variant) + " has no option '" + name + "'; it takes " +
                (names.empty() ? "none" : joined(names)));
  }
  for (const OptionSpec& spec : declared) {
    const auto entry = given.find(spec.name);
    values_[spec.name] = checked(variant, spec, entry == given.end() ? spec.fallback : entry->second);
  }
  for (const OptionSpec& spec : declared)
    // Only an option that the user gave can be without effect.
    for (const std::string& condition : spec.only_with)
      if (given.contains(spec.name) && !holds(condition, *this))
        throw Error("option '" + spec.name + "' of " + std::string(variant) + " has no effect without " +
                    in_words(condition));
}

// An undeclared name or a wrong type is a programming error: logic_error instead of Error.
double Options::number(std::string_view name) const {
  const std::optional<double> value = parse_number(text(name));
  if (!value) throw std::logic_error("option '" + std::string(name) + "' is not a number");
  return *value;
}

const std::string& Options::text(std::string_view name) const {
  const auto entry = values_.find(name);
  if (entry == values_.end()) throw std::logic_error("option '" + std::string(name) + "' was not declared");
  return entry->second;
}

bool Options::is(std::string_view name, std::string_view value) const {
  const auto entry = values_.find(name);
  return entry != values_.end() && entry->second == value;
}

std::string Options::canonical() const {
  std::string text;
  for (const auto& [name, value] : values_) text += (text.empty() ? "" : " ") + name + "=" + value;
  return text;
}

std::pair<std::string, std::string> parse_option(std::string_view text) {
  // At the first equals sign: values may contain others.
  const std::size_t equals = text.find('=');
  if (equals == std::string_view::npos || equals == 0)
    throw Error("'" + std::string(text) + "' is no option; write key=value");
  return {std::string(text.substr(0, equals)), std::string(text.substr(equals + 1))};
}

namespace {

template <class Variant>
const Variant& find_entry(std::span<const Variant> table, const std::string& name, const std::string& kind) {
  if (const auto found = std::ranges::find(table, name, &Variant::name); found != table.end()) return *found;
  std::string names;
  for (const Variant& variant : table) names += (names.empty() ? "" : ", ") + variant.name;
  throw Error("there is no " + kind + " '" + name + "'; there are " + names);
}

}  // namespace

const Extractor& find_variant(std::span<const Extractor> table, const std::string& name) {
  return find_entry(table, name, "extractor");
}

const Voxelizer& find_variant(std::span<const Voxelizer> table, const std::string& name) {
  return find_entry(table, name, "voxelizer");
}

}  // namespace hermesh
