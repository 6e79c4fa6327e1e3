#include "experiments/fuzzing/targets.h"

#include <algorithm>
#include <stdexcept>

#include "algorithms/core/error.h"

namespace hermesh::fuzzing {

void check_message(const std::string& message, bool names_file) {
  const auto controls = [](unsigned char c) { return c < 0x20 || c == 0x7f; };
  if (message.empty()) throw std::logic_error("an Error without a message");
  if (message.size() > 1500) throw std::logic_error("an Error with a long message: " + message);
  if (std::ranges::any_of(message, controls))
    throw std::logic_error("an Error with control characters in its message: " + message);
  if (names_file && message.find("input.") == std::string::npos)
    throw std::logic_error("an Error that does not name the file: " + message);
}

std::string expect_value_or_error(const Target& target, std::string_view bytes) {
  try {
    target.read(bytes);
    return "";
  } catch (const Error& error) {
    check_message(error.what(), target.reads_file);
    return error.what();
  }
}

}  // namespace hermesh::fuzzing
