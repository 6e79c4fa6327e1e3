// Numbers and points as text within sentences.
#pragma once

#include <Eigen/Core>
#include <cstdio>
#include <string>

namespace hermesh {

/// The number with six significant digits.
inline std::string text(double value) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.6g", value);
  return buffer;
}

/// The number with as many digits as tell it from all others of single precision.
inline std::string exact_text(float value) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.9g", double(value));
  return buffer;
}

/// The point's coordinates with six significant digits, in brackets.
inline std::string text(const Eigen::Vector3d& point) {
  char buffer[96];
  std::snprintf(buffer, sizeof buffer, "(%.6g, %.6g, %.6g)", point.x(), point.y(), point.z());
  return buffer;
}

}  // namespace hermesh
