// The command line of the program: its commands, and the parsing of its words.
#pragma once

#include <string>
#include <vector>

#include "experiments/cli/session.h"

namespace hermesh::cli {

/// Adds all commands and options.
void add_commands(CLI::App& app, Session& session);

/// Parses the words after the program's name, sets session.command and the names of files, and checks that no
/// file is written that is also read. Returns the files of the command, null if it works on none.
/// @throws UsageError that states which word is wrong; CLI::Success if help or the version is requested
CommandFiles* parse_command_line(CLI::App& app, Session& session, const std::vector<std::string>& words);

}  // namespace hermesh::cli
