// The failures of a benchmark, for the program's exit code.
#pragma once

namespace hermesh {

inline int failures = 0;  ///< SkipWithError leaves Google Benchmark's own exit code at 0

}  // namespace hermesh
