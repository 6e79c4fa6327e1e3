// A mesh report for people and for programs.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "validation/mesh_report.h"

namespace hermesh::cli {

/// The report as text: counts, places of the first offenders, distances and the verdict; `unmet` are the
/// requirements that are not met.
std::string report_text(const validation::MeshReport& report, const std::string& file,
                        const std::vector<std::string>& unmet);

/// The report as JSON: the object of validation::to_json(), with `mesh`, the file, and `unmet_requirements`,
/// a list.
nlohmann::json report_json(const validation::MeshReport& report, const std::string& file,
                           const std::vector<std::string>& unmet);

}  // namespace hermesh::cli
