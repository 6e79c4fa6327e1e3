// All variants: the project's own, followed by the reference methods of other people.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <span>
#include <vector>

#include "algorithms/core/variant.h"

namespace hermesh {

std::vector<Extractor> all_extractors();
std::vector<Voxelizer> all_voxelizers();

bool is_ours(const Extractor& extractor);
bool is_ours(const Voxelizer& voxelizer);

/// Describes variants and options: {"name", "summary", "ours", "promises", "options": […]} and {"name",
/// "default", "help", "choices" or "minimum" and "maximum", "only_with"}.
nlohmann::ordered_json to_json(std::span<const Extractor> extractors);
nlohmann::ordered_json to_json(std::span<const Voxelizer> voxelizers);
nlohmann::ordered_json to_json(std::span<const OptionSpec> options);

}  // namespace hermesh
