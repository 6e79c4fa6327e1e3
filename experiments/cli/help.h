// Suggestions for mistyped words.
#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace hermesh::cli {

/// Returns "; did you mean 'remesh'?" with the closest of the words, the first of equally close ones, or
/// nothing if none is close: at most a third of the letters may differ, or the word begins with `given`.
std::string did_you_mean(const std::string& given, const std::vector<std::string>& words);

/// Returns a message about the first unknown command or option of a command line, with a suggestion; empty if
/// all are known.
std::string unknown_word(const CLI::App& app, const std::vector<std::string>& arguments);

}  // namespace hermesh::cli
