// Where a row comes from: sources, machine, compiler, libraries. A figure without these cannot be compared
// with another.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>

namespace hermesh {

/// {"commit", "dirty", "date", "machine": {"cpu", "cores", "memory_bytes", "system"}, "build": {"compiler",
/// "flags", "type"}, "libraries": {…}, "threads"}. The commit is that of the git checkout that
/// `source_folder` is in, "unknown" outside of one. `threads` is what TBB may use now.
nlohmann::ordered_json provenance(const std::filesystem::path& source_folder);

/// The load averages over 1, 5 and 15 minutes; null where the system does not say.
nlohmann::ordered_json load_averages();

}  // namespace hermesh
