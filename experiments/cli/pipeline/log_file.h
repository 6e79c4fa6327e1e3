// A file of what a run says, line by line with times.
#pragma once

#include <chrono>
#include <string>

#include "experiments/cli/session.h"

namespace hermesh::cli {

/// Keeps a log in a file, behind what is there, while it lives: the command line, the beginning and the end
/// of each stage, notes and summaries, and how the run ended. Each line begins with the time in UTC and is
/// written at once, so that what a killed run said is there.
class LogFile {
 public:
  /// Opens the file, and listens to the session. @throws Error if it cannot be written.
  LogFile(Session& session, const std::string& path, const std::string& command_line);
  ~LogFile();
  LogFile(const LogFile&) = delete;
  LogFile& operator=(const LogFile&) = delete;

  /// Adds the notes that are new, and a line.
  void line(const std::string& text);

 private:
  void write_line(const std::string& text);
  void add_notes();

  Session& session_;
  int file_ = -1;
  std::size_t notes_ = 0;  ///< that are in the file
  std::string stage_;
};

}  // namespace hermesh::cli
