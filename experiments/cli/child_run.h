// A program that runs next to others, with its output captured. Linux.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace hermesh::cli {

/// One run of a program. It has no input, and ends when this process ends.
class ChildRun {
 public:
  /// @throws Error if the program cannot be started.
  ChildRun(const std::string& program, const std::vector<std::string>& arguments);
  /// Asks it to end, if it has not, and waits until it has; kills it after two seconds.
  ~ChildRun();
  ChildRun(const ChildRun&) = delete;
  ChildRun& operator=(const ChildRun&) = delete;

  /// Reads the program's output so far; returns true if the program has ended.
  bool has_ended();
  /// Asks it to end, without waiting.
  void ask_to_end();

  int exit_code() const { return exit_code_; }  ///< −1 if a signal ended it
  int signal() const { return signal_; }        ///< number of the signal that ended it; 0: none
  const std::string& out() const { return out_; }
  const std::string& err() const { return err_; }

  /// Waits until one of the children prints something or ends, at most `milliseconds`.
  static void wait_for_any(const std::vector<ChildRun*>& children, int milliseconds);

 private:
  pid_t pid_ = -1;
  int out_end_ = -1, err_end_ = -1;
  int exit_code_ = -1;
  int signal_ = 0;
  std::string out_, err_;
};

}  // namespace hermesh::cli
