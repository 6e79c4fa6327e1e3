// The manual page hermesh(1).
#pragma once

#include <string>
#include <vector>

#include "experiments/cli/help/command_table.h"

namespace hermesh::cli {

/// The page in the language of man(7).
std::string man_page(const std::vector<CommandEntry>& table, const std::string& version);

}  // namespace hermesh::cli
