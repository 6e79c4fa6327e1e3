// Where a row comes from: sources, machine, compiler, libraries. A figure without these cannot be compared
// with another.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

namespace hermesh {

/// What a program was built from, or what a checkout holds now.
struct SourceState {
  std::string commit = "unknown";  ///< 40 hex digits, or "unknown" outside of a git checkout
  std::optional<bool> dirty = {};  ///< whether files other than pages, paper/ and results/ differ from it; none if unknown
};

/// What this program was built from, as build_stamp.cmake wrote it when it was built; defined in the program alone, which
/// hands it to set_source_state().
SourceState built_from();
/// Tells provenance() what the program was built from. Until then that is unknown.
void set_source_state(SourceState state);
const SourceState& source_state();

/// The state of the git checkout that a folder is in.
SourceState checked_out(const std::filesystem::path& folder);

/// Whether rows in the folder are the project's own: it is below `checkout`/results, and not below results/local.
bool is_kept(const std::filesystem::path& folder, const std::filesystem::path& checkout);

/// Rows of folders that are kept in the project must name what made them. Does nothing for a folder that is not.
/// @throws Error unless the program was built from the commit that is checked out, and neither had changes.
void check_may_be_kept(const std::filesystem::path& out, const std::filesystem::path& checkout, const SourceState& built);

/// {"commit", "dirty", "date", "machine": {"cpu", "cores", "memory_bytes", "system"}, "build": {"compiler", "flags",
/// "type", "simd"}, "libraries": {…}, "threads"}. The commit is the one that the program was built from; `dirty` is true
/// if that had changes, or if the checkout that `source_folder` is in, from which experiments are read, has some now or is
/// at another commit. `threads` is what TBB may use now.
nlohmann::ordered_json provenance(const std::filesystem::path& source_folder);

/// "commit …, built with … for …, with …": the program's origin for a reader, a line each.
std::string provenance_text();

/// The load averages over 1, 5 and 15 minutes; null where the system does not say.
nlohmann::ordered_json load_averages();

}  // namespace hermesh
