#include "experiments/harness/json_values.h"

#include <array>
#include <cmath>
#include <cstdio>

namespace hermesh {

const Json* find(const Json& row, const std::string& pointer) {
  const Json::json_pointer at(pointer);
  return row.contains(at) && !row.at(at).is_null() ? &row.at(at) : nullptr;
}

double number_at(const Json& row, const std::string& pointer) {
  const Json* value = find(row, pointer);
  return value && value->is_number() ? value->get<double>() : 0.0;
}

std::string text_at(const Json& row, const std::string& pointer) {
  const Json* value = find(row, pointer);
  return !value ? "" : value->is_string() ? value->get<std::string>() : value->dump();
}

std::string readable(double value) {
  if (!std::isfinite(value)) return std::isnan(value) ? "nan" : value > 0 ? "inf" : "-inf";
  std::array<char, 64> text{};
  if (std::abs(value) < 999.5 && value != std::round(value)) {
    std::snprintf(text.data(), text.size(), "%.3g", value);
    return text.data();
  }
  std::snprintf(text.data(), text.size(), "%.0f", value);
  std::string digits = text.data();
  for (int at = static_cast<int>(digits.size()) - 3; at > (digits[0] == '-' ? 1 : 0); at -= 3)
    digits.insert(static_cast<std::size_t>(at), 1, ',');
  return digits;
}

}  // namespace hermesh
