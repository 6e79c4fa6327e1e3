// Numbers and points as text in messages.
#pragma once

#include <Eigen/Core>
#include <cstdio>
#include <string>

namespace hermesh {

/// Returns the number with six significant digits.
inline std::string text(double value) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.6g", value);
  return buffer;
}

/// Returns the number with enough digits to distinguish it from all others of single precision.
inline std::string exact_text(float value) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.9g", double(value));
  return buffer;
}

/// Returns the point's coordinates with six significant digits, in parentheses.
inline std::string text(const Eigen::Vector3d& point) {
  char buffer[96];
  std::snprintf(buffer, sizeof buffer, "(%.6g, %.6g, %.6g)", point.x(), point.y(), point.z());
  return buffer;
}

}  // namespace hermesh
