#include "experiments/harness/compare.h"

#include <map>
#include <nlohmann/json.hpp>

namespace hermesh {
namespace {

std::string first_text(const Json& row, std::initializer_list<const char*> places) {
  for (const char* place : places)
    if (const Json* value = find(row, place))
      return value->is_string() ? value->get<std::string>() : value->dump();
  return {};
}

std::string cell_of(const Json& row) {
  std::string cell = first_text(row, {"/experiment"}) + ": " + first_text(row, {"/case/name"});
  for (const char* place : {"/resolution", "/values/resolution", "/voxelization/label", "/variant/label"})
    if (const std::string part = first_text(row, {place}); !part.empty()) cell += " / " + part;
  return cell;
}

/// What was made, or why nothing was; empty where a row does not say.
std::string outcome_of(const Json& row) {
  const std::string failure = first_text(row, {"/failed"});
  if (!failure.empty()) return "failed: " + failure;
  return first_text(row, {"/digest", "/values/digest"});
}

std::map<std::string, std::string> outcomes(const std::vector<Json>& rows) {
  std::map<std::string, std::string> result;
  for (const Json& row : rows) result[cell_of(row)] = outcome_of(row);
  return result;
}

}  // namespace

RunComparison compare_runs(const std::vector<Json>& before, const std::vector<Json>& after) {
  const std::map<std::string, std::string> first = outcomes(before), second = outcomes(after);
  RunComparison result;
  for (const auto& [cell, outcome] : first) {
    const auto other = second.find(cell);
    if (other == second.end())
      result.missing.push_back(cell);
    else if (outcome.empty() && other->second.empty())
      ++result.without_digest;
    else if (outcome == other->second)
      ++result.equal;
    else
      result.different.push_back({cell, outcome, other->second});
  }
  for (const auto& [cell, outcome] : second)
    if (!first.contains(cell)) result.added.push_back(cell);
  return result;
}

std::string text(const RunComparison& comparison) {
  std::string result = std::to_string(comparison.equal) + " cells are equal, " +
                       std::to_string(comparison.different.size()) + " differ, " +
                       std::to_string(comparison.missing.size()) + " are missing, " +
                       std::to_string(comparison.added.size()) + " are new";
  if (comparison.without_digest > 0)
    result += ", " + std::to_string(comparison.without_digest) + " have no digest";
  result += ".\n";
  for (const auto& [cell, before, after] : comparison.different)
    result += "- differs: " + cell + ": " + (before.empty() ? "no digest" : before) + ", now " +
              (after.empty() ? "no digest" : after) + "\n";
  for (const std::string& cell : comparison.missing) result += "- missing: " + cell + "\n";
  for (const std::string& cell : comparison.added) result += "- new: " + cell + "\n";
  return result;
}

}  // namespace hermesh
