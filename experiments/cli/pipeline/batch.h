// One command on many inputs, each in a process of its own.
#pragma once

#include <string>
#include <vector>

#include "experiments/cli/session.h"

namespace hermesh::cli {

/// One input of a batch, and the file that is made of it; empty where the command makes none.
struct BatchItem {
  std::string input, output;
};

/// The name of the output of an input: `pattern` with {stem}, the input's name without its ending, {name},
/// all of its name, and {number}, its place among the inputs from 1, with as many digits as their count has.
/// @throws UsageError for other words in braces, or a name that is none.
std::string output_name(const std::string& pattern, const std::string& input, std::size_t number,
                        std::size_t count);

/// Inputs with their outputs. @throws UsageError where two outputs have one name, or an input would be
/// overwritten.
std::vector<BatchItem> batch_items(const std::vector<std::string>& inputs, const std::string& folder,
                                   const std::string& pattern);

/// Whether the command line asks for a batch. @throws UsageError where it cannot be told.
bool is_batch(const CLI::App& command, const CommandFiles& files);

/// A sentence if the command was told an input, and no output; empty otherwise. For a command line that lacks
/// other things, too, of which the reader would first see those.
std::string missing_output(const CLI::App& app, const Session& session);

/// The files of the command that was asked for; null where it works on none, and where it is a batch, which
/// session.command is then. Notes the name of the command, and what the user calls its files.
/// @throws UsageError for words that are neither one file nor many.
CommandFiles* files_of_command(const CLI::App& app, Session& session);

/// The absolute path of a file, which need not exist, without links and dots.
std::string place_of(const std::string& file);

/// Checks that nothing the command writes would replace or damage a file that it reads: the log and the JSON
/// never, the output only with --overwrite-input. `files` are those of files_of_command(); a batch checks its
/// outputs itself.
/// @throws UsageError
void check_written_files(const CLI::App& app, const CommandFiles* files, const Session& session);

/// Runs the command on each of its inputs with the options that were given, --jobs at a time, and goes on
/// after a failure, of which it prints the sentence. Each gives a line of JSON (pipeline/json_report.h) where
/// --json asks for it, when it is done. What the files hold does not depend on --jobs, for each process is
/// one that could have been run alone.
/// @returns 1 if any failed, else 3 if any did not meet a requirement. @throws UsageError, also for what each
/// process would refuse as such; Cancelled, when all have ended and removed what they had begun.
int run_batch(const CLI::App& command, CommandFiles& files, Session& session);

}  // namespace hermesh::cli
