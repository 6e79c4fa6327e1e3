// Exceptions.
#pragma once

#include <exception>
#include <stdexcept>
#include <string>

namespace hermesh {

/// Bad input, or a failure that the user can fix. what() names the file or the option and what to do; the
/// command line prints it and exits with 1.
class Error : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Thrown by RunContext::check() after a request to stop. The command line exits with 130.
class Cancelled : public std::exception {
 public:
  const char* what() const noexcept override { return "cancelled"; }
};

/// Returns work(). An Error thrown by it that does not name `file` is rethrown with the name prepended.
template <class Work>
auto about_file(const std::string& file, Work&& work) {
  try {
    return work();
  } catch (const Error& error) {
    const std::string sentence = error.what();
    if (sentence.find(file) != std::string::npos) throw;
    throw Error("'" + file + "': " + sentence);
  }
}

}  // namespace hermesh
