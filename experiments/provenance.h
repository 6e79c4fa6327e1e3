// The sources and tools that a program was built from and with. Rows contain them, since measurements without
// them cannot be compared.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

namespace hermesh {

struct SourceState {
  std::string commit = "unknown";  ///< 40 hex digits, or "unknown" outside a git checkout
  std::optional<bool> dirty =
      {};  ///< true if files other than pages, paper/ and results/ differed; none if unknown
};

/// Returns the sources that this program was built from, as recorded by build_stamp.cmake at build time.
SourceState built_from();

/// Returns {"commit", "dirty", "build": {"compiler", "flags", "type", "simd"}, "libraries": {…}, "threads"};
/// "threads" is the number that TBB may use now.
nlohmann::ordered_json build_facts();

/// Returns the same for a reader, several lines.
std::string build_text();

}  // namespace hermesh
