// CLI11 without its functions that write help and read option files, which cli11.cpp compiles once; and
// checks of options.
#pragma once

#include <CLI/App.hpp>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>

#include "experiments/cli/session.h"

namespace hermesh::cli {

/// Makes `work`, which returns an ExitCode, the command of the session if `command` is on the command line.
template <class Work>
void set_work(CLI::App& command, Session& session, Work work) {
  command.callback([&session, work] { session.command = work; });
}

/// Accepts a finite number of at least `minimum`; `words` describes such a number.
inline CLI::Validator finite_number(double minimum = std::numeric_limits<double>::lowest(),
                                    const std::string& words = "a finite number") {
  return CLI::Validator(
      [minimum, words](const std::string& given) {
        double value = 0.0;
        const bool good = CLI::detail::lexical_cast(given, value) && std::isfinite(value) && value >= minimum;
        return good ? std::string() : "must be " + words + ", not '" + given + "'";
      },
      "");
}

/// Accepts an integer from `least` to `most` in any notation, such as 1000, 1e3 or 1000.0, and replaces it by
/// its digits. For CLI::Option::transform(), because an integer option reads digits only.
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

}  // namespace hermesh::cli
