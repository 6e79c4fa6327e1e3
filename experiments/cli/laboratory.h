// The laboratory in Python (experiments/lab): commands that the program starts as git starts its subcommands.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace hermesh::cli {

struct Session;

/// Returns the directory with experiment files and the laboratory: $HERMESH_EXPERIMENTS, else that of the
/// source tree of the build. It may not exist.
std::filesystem::path experiments_directory();

/// Adds run, conform, report, claims, compare, accept, merge and benchmark. Their words are passed to the
/// laboratory unread, so that its help and its messages are those of the command.
void add_laboratory(CLI::App& app, Session& session);

/// Returns the output of a laboratory command, or std::nullopt if the laboratory is not installed. @throws
/// Error if the command fails.
std::optional<std::string> laboratory_output(const std::vector<std::string>& words);

}  // namespace hermesh::cli
