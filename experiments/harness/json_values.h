// Values in rows, which are JSON.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace hermesh {

using Json = nlohmann::ordered_json;  ///< keys stay in the order in which they were added

/// Returns the value at a JSON pointer (RFC 6901), nullptr if there is none or if it is null.
const Json* find(const Json& row, const std::string& pointer);

/// Returns the number at a pointer, 0 if there is none.
double number_at(const Json& row, const std::string& pointer);

/// Returns a text unchanged, any other value as JSON, and "" if there is none.
std::string text_at(const Json& row, const std::string& pointer);

/// Formats a number: 1234567 → "1,234,567"; numbers that are not whole get three significant digits.
std::string readable(double value);

}  // namespace hermesh
