// A program that works for this one in a process of its own, line by line, and that may crash, hang or eat memory without
// harm to this one. Linux.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "algorithms/core/run_context.h"

namespace hermesh {

/// What a child may take; 0 is no limit.
struct ChildLimits {
  double seconds = 0.0;    ///< from one answer to the next
  std::int64_t bytes = 0;  ///< resident, of the child and of all programs that it started
};

class ChildProcess {
 public:
  /// The file descriptor on which a child answers. Its standard output goes where the standard error does.
  static constexpr int kAnswers = 3;

  /// Starts the program, in a process group of its own that ends when this process does. @throws Error if that fails.
  ChildProcess(const std::filesystem::path& program, const std::vector<std::string>& arguments);
  /// Kills the child and what it started.
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  /// Writes a line to the child's standard input; what a child that has ended does not take is lost.
  void send(const std::string& line);

  /// Waits for the next answer. Nothing comes when the child has ended, by itself or because it went over a limit.
  /// @throws Cancelled.
  std::optional<std::string> receive(const ChildLimits& limits, const RunContext& context);

  /// How the child ended, once receive() gave nothing: "" if it ended with exit code 0, else "crashed (Segmentation
  /// fault)", "took longer than 10 s", "took more than 512 MiB of memory" or "ended with exit code 7".
  const std::string& end() const { return end_; }
  /// Whether that was a signal that nobody here sent.
  bool crashed() const { return crashed_; }

 private:
  void kill_all();
  void reap();

  pid_t pid_ = -1;
  int to_ = -1, from_ = -1;
  std::string buffer_, end_;
  bool crashed_ = false;
};

/// Resident memory of a process and of all that descend from it, in bytes; 0 for one that is gone.
std::int64_t resident_bytes(pid_t pid);

}  // namespace hermesh
