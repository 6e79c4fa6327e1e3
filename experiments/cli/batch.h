// One command on many inputs, each in a process of its own.
#pragma once

#include <string>
#include <vector>

#include "experiments/cli/session.h"

namespace hermesh::cli {

/// An input of a batch, and its output file; empty if the command writes none.
struct BatchItem {
  std::string input, output;
};

/// Returns the name of the output of an input: `pattern`, in which {stem} is replaced by the input's name
/// without its extension, {name} by the whole name, and {number} by the index from 1 with as many digits as
/// `count`.
/// @throws UsageError for other words in braces, or an invalid name.
std::string output_name(const std::string& pattern, const std::string& input, std::size_t number,
                        std::size_t count);

/// Returns the inputs with their outputs. @throws UsageError if two outputs have the same name or an input
/// would be overwritten.
std::vector<BatchItem> batch_items(const std::vector<std::string>& inputs, const std::string& directory,
                                   const std::string& pattern);

/// Returns true if the command line requests a batch. @throws UsageError if that is ambiguous.
bool is_batch(const CLI::App& command, const CommandFiles& files);

/// Runs the command on each of its inputs with the given options, --jobs at a time. Prints the message of a
/// failure and continues. Writes a line of JSON for each finished input if --json is given. The outputs do
/// not depend on --jobs, because each process is the same as a run of its own.
/// @returns 1 if any failed, else 3 if any did not meet a requirement. @throws UsageError, also if the
/// processes report one; Cancelled, after all processes have ended and removed their partial files.
int run_batch(const CLI::App& command, CommandFiles& files, Session& session);

}  // namespace hermesh::cli
