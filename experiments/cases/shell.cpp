#include "experiments/cases/shell.h"

#include <array>
#include <cstdio>

namespace hermesh {

std::string shell_quoted(const std::string& text) {
  std::string result = "'";
  for (const char c : text) result += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return result + "'";
}

ShellOutput shell_output(const std::string& command) {
  ShellOutput result;
  FILE* const pipe = popen(command.c_str(), "r");
  if (!pipe) return result;
  std::array<char, 4096> buffer;
  while (const std::size_t size = std::fread(buffer.data(), 1, buffer.size(), pipe))
    result.text.append(buffer.data(), size);
  result.status = pclose(pipe);
  while (result.text.ends_with('\n')) result.text.pop_back();
  return result;
}

}  // namespace hermesh
