// Completion of command lines by bash and zsh.
#pragma once

#include <string>
#include <vector>

#include "experiments/cli/help/command_table.h"

namespace hermesh::cli {

/// A script that bash reads: commands, options, and values that can be listed; files elsewhere.
std::string bash_completion(const std::vector<CommandEntry>& table);

/// A function file `_hermesh` for zsh, with the same and what each option says.
std::string zsh_completion(const std::vector<CommandEntry>& table);

}  // namespace hermesh::cli
