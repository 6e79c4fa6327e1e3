// Checks of options that several commands share.
#pragma once

#include <cmath>
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
