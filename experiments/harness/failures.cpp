#include "experiments/harness/failures.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <ostream>
#include <string>

#include "algorithms/core/shown.h"

namespace hermesh {

void write_failures(const std::vector<Json>& rows, std::ostream& out) {
  // A variant that is not installed is a note.
  const auto failed = [](const Json& row) { return row.contains("failed") && !row.contains("absent"); };
  const auto first = std::ranges::find_if(rows, failed);
  if (first == rows.end()) return;
  std::string cell = text_at(*first, "/case/name");
  for (const char* part : {"/sweep/value", "/resolution", "/nominal_voxel_size", "/variant/label"})
    if (const std::string text = text_at(*first, part); !text.empty()) cell += "/" + text;
  constexpr std::size_t kLongest = 400;  // bytes of the reason
  out << "FAILED: " << std::ranges::count_if(rows, failed) << " of " << rows.size() << " cells; the first is " << cell << ": "
      << shown(text_at(*first, "/failed"), kLongest, true) << "\n";
}

}  // namespace hermesh
