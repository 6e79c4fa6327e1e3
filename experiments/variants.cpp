#include "experiments/variants.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "algorithms/variants.h"
#include "reference/variants.h"

namespace hermesh {
namespace {

using Json = nlohmann::ordered_json;

template <class Variant>
std::vector<Variant> joined(std::span<const Variant> ours, std::span<const Variant> others) {
  std::vector<Variant> all(ours.begin(), ours.end());
  all.insert(all.end(), others.begin(), others.end());
  return all;
}

template <class Variant>
bool contains(std::span<const Variant> variants, const std::string& name) {
  return std::ranges::find(variants, name, &Variant::name) != variants.end();
}

}  // namespace

std::vector<Extractor> all_extractors() { return joined(our_extractors(), reference_extractors()); }
std::vector<Voxelizer> all_voxelizers() { return joined(our_voxelizers(), reference_voxelizers()); }

bool is_ours(const Extractor& extractor) { return contains(our_extractors(), extractor.name); }
bool is_ours(const Voxelizer& voxelizer) { return contains(our_voxelizers(), voxelizer.name); }

Json to_json(std::span<const OptionSpec> options) {
  Json all = Json::array();
  for (const OptionSpec& option : options) {
    Json json = {{"name", option.name}, {"default", option.fallback}, {"help", option.help}};
    if (option.choices.empty()) {
      json["minimum"] = option.minimum;
      json["maximum"] = option.maximum;
    } else {
      json["choices"] = option.choices;
    }
    if (!option.only_with.empty()) json["only_with"] = option.only_with;
    all.push_back(std::move(json));
  }
  return all;
}

Json to_json(std::span<const Extractor> extractors) {
  Json all = Json::array();
  for (const Extractor& each : extractors)
    all.push_back({{"name", each.name},
                   {"summary", each.summary},
                   {"ours", is_ours(each)},
                   {"promises",
                    {{"closed", each.promises.closed},
                     {"manifold", each.promises.manifold},
                     {"oriented", each.promises.oriented},
                     {"no_self_intersection", each.promises.no_self_intersection}}},
                   {"options", to_json(each.options)}});
  return all;
}

Json to_json(std::span<const Voxelizer> voxelizers) {
  Json all = Json::array();
  for (const Voxelizer& each : voxelizers)
    all.push_back({{"name", each.name},
                   {"summary", each.summary},
                   {"ours", is_ours(each)},
                   {"options", to_json(each.options)}});
  return all;
}

}  // namespace hermesh
