// Checks of options that several commands share.
#pragma once

#include <CLI/CLI.hpp>
#include <cmath>
#include <string>

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

}  // namespace hermesh::cli
