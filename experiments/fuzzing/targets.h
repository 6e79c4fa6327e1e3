// Targets of fuzzing: functions that read any bytes as the program reads a file, a command line or a job.
//
// A target returns if the bytes have a value, and throws Error with one clear message if they have none.
// Anything else is a finding: another exception, among them std::logic_error from the checks in the targets,
// a crash, a report of a sanitizer, more than 10 seconds, or more than 2 GiB of memory.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace hermesh::fuzzing {

struct Target {
  std::string_view name;  ///< of the program fuzz_NAME, and of the directories in corpus/ and findings/
  void (*read)(std::string_view bytes);
  bool reads_file;  ///< errors must name its path; those of raw samples may be about their layout
};

std::span<const Target> file_targets();     ///< mesh files, volumes of other programs, .vdb files
std::span<const Target> program_targets();  ///< the command line and jobs of the laboratory

/// @throws std::logic_error for a message of an Error that is empty, long, has control characters, or does
/// not name the file although it must.
void check_message(const std::string& message, bool names_file);

/// Calls a target. Returns the message of its Error; empty if the bytes have a value. @throws as
/// check_message().
std::string expect_value_or_error(const Target& target, std::string_view bytes);

}  // namespace hermesh::fuzzing
