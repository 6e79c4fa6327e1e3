// Numbers and points as text for the screen.
#pragma once

#include <cstdio>
#include <string>

#include "algorithms/core/number_text.h"

namespace hermesh::cli {

using hermesh::exact_text;
using hermesh::text;

inline std::string seconds_text(double seconds) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.3f s", seconds);
  return buffer;
}

}  // namespace hermesh::cli
