// Checks of options that several commands share.
#pragma once

#include <cmath>
#include <cstdint>
#include <string>

#include "experiments/cli/cli11.h"

namespace hermesh::cli {

inline CLI::Validator finite_number() {
  return CLI::Validator(
      [](const std::string& given) {
        double value = 0.0;
        return CLI::detail::lexical_cast(given, value) && std::isfinite(value)
                   ? std::string()
                   : "must be a finite number, not '" + given + "'";
      },
      "");
}

/// Accepts a whole number from `least` to `most` in any notation, such as 1000, 1e3 or 1000.0, and replaces
/// it by its digits. For CLI::Option::transform(), since an option of a whole number reads nothing but
/// digits.
inline CLI::Validator whole_number(std::int64_t least, std::int64_t most) {
  return CLI::Validator(
      [least, most](std::string& given) {
        double value = 0.0;
        const bool good = CLI::detail::lexical_cast(given, value) && value == std::floor(value) &&
                          value >= double(least) && value <= double(most);
        if (!good)
          return "must be a whole number from " + std::to_string(least) + " to " + std::to_string(most) +
                 ", not '" + given + "'";
        given = std::to_string(std::int64_t(value));
        return std::string();
      },
      "");
}

/// Accepts key=value, an option of a variant. Elsewhere -o is often the output, so a value without '=' is
/// taken for one that was meant so.
inline CLI::Validator key_value() {
  return CLI::Validator(
      [](const std::string& given) {
        return given.find('=') != std::string::npos ? std::string()
                                                    : "takes key=value, an option of a variant, not '" +
                                                          given + "'; the output is named without -o";
      },
      "");
}

}  // namespace hermesh::cli
