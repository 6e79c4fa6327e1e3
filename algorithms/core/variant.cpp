#include "algorithms/core/variant.h"

#include <algorithm>

namespace hermesh {
namespace {

// One function for both kinds of table, so that both complain in the same words. A table has a dozen entries:
// a search from front to back keeps their order, in which the complaint lists them.
template <class Variant>
const Variant& find(std::span<const Variant> table, const std::string& name, const std::string& kind) {
  const auto found =
      std::find_if(table.begin(), table.end(), [&](const Variant& v) { return v.name == name; });
  if (found != table.end()) return *found;
  std::string names;
  for (const Variant& variant : table) names += (names.empty() ? "" : ", ") + variant.name;
  throw Error("there is no " + kind + " '" + name + "'; there are " + names);
}

}  // namespace

const Extractor& find_variant(std::span<const Extractor> table, const std::string& name) {
  return find(table, name, "extractor");
}

const Voxelizer& find_variant(std::span<const Voxelizer> table, const std::string& name) {
  return find(table, name, "voxelizer");
}

}  // namespace hermesh
