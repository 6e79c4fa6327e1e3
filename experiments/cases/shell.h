// Commands of the system, run by its shell.
#pragma once

#include <string>

namespace hermesh {

/// A text as one word of a shell command, whatever characters it has.
std::string shell_quoted(const std::string& text);

struct ShellOutput {
  int status = -1;  ///< as wait() gives it: 0 when the command was done; −1 where no shell could be started
  std::string text;  ///< the standard output, without the line breaks that end it
};

/// Runs a command and waits for its end.
ShellOutput shell_output(const std::string& command);

}  // namespace hermesh
