// The commands and options of the program as plain data, read off CLI11's tables: for completion and the
// manual.
#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace hermesh::cli {

struct OptionEntry {
  std::vector<std::string> names;  ///< "--threads", "-o"; empty for an argument without one
  std::string place;               ///< name of an argument without one, such as "IN"
  std::string help;
  bool takes_value = true;  ///< false: a flag
  bool required = false;
  std::vector<std::string> choices;  ///< all values that are allowed; empty: many
};

struct CommandEntry {
  std::string name, summary;
  std::vector<OptionEntry> options;
};

/// The commands that users see, in their order, each with the options of its groups. The first entry has no
/// name and holds the options of the program itself. Options whose values are names of variants have these as
/// choices.
std::vector<CommandEntry> command_table(const CLI::App& app);

}  // namespace hermesh::cli
