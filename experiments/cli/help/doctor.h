// What a machine lacks for which feature.
#pragma once

#include <string>
#include <vector>

namespace hermesh::cli {

struct Check {
  std::string feature;  ///< what it is for
  std::string needs;    ///< program, folder or file
  std::string found;    ///< where; empty: it is missing
  std::string remedy;   ///< command or setting that mends it
};

/// Looks for all that features beyond reading and writing meshes and volumes need. Nothing is started.
std::vector<Check> all_checks();

/// The first file of that name that can be run in the folders of $PATH; empty if there is none.
std::string find_program(const std::string& name);

}  // namespace hermesh::cli
