// What was probably meant by a mistyped word.
#pragma once

#include <string>
#include <vector>

#include "experiments/cli/session.h"

namespace hermesh::cli {

/// Number of letters that have to be put in, left out, changed, or swapped with their neighbour, to make one
/// word the other (optimal string alignment).
std::size_t edit_distance(const std::string& a, const std::string& b);

/// "; did you mean 'remesh'?" with the nearest of the words, or nothing where none is near: at most a third
/// of the letters may differ, or the word begins the other. Of equally near ones the first is taken.
std::string did_you_mean(const std::string& given, const std::vector<std::string>& words);

/// Refuses the name of a variant that is not in the table, if one that is near to it is.
/// @throws Error with the suggestion.
template <class Table>
void check_variant_name(const Table& table, const std::string& kind, const std::string& given) {
  std::vector<std::string> names;
  for (const auto& variant : table) {
    if (variant.name == given) return;
    names.push_back(variant.name);
  }
  if (const std::string meant = did_you_mean(given, names); !meant.empty())
    throw Error("there is no " + kind + " '" + given + "'" + meant);
}

/// A sentence about the first command or option of a command line that there is not, with a suggestion; empty
/// if all are known.
std::string unknown_word(const CLI::App& app, const std::vector<std::string>& arguments);

/// All long and short options of a command, those in its groups too, as they are typed; "--help" is one.
std::vector<std::string> option_names(const CLI::App& command);

}  // namespace hermesh::cli
