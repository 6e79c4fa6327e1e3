// A program that is run to its end beside others, with what it prints kept. Linux.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace hermesh::cli {

/// One run of a program. It reads nothing, and ends when this process does.
class ChildRun {
 public:
  /// @throws Error if the program cannot be started.
  ChildRun(const std::string& program, const std::vector<std::string>& arguments);
  /// Asks it to end, if it has not, and waits until it has; kills it after two seconds.
  ~ChildRun();
  ChildRun(const ChildRun&) = delete;
  ChildRun& operator=(const ChildRun&) = delete;

  /// Takes what it has printed, and returns whether it has ended.
  bool has_ended();
  /// Asks it to end, without waiting.
  void ask_to_end();

  int exit_code() const { return exit_code_; }  ///< −1 if a signal ended it
  int signal() const { return signal_; }        ///< that ended it; 0 without one
  const std::string& out() const { return out_; }
  const std::string& err() const { return err_; }

  /// Waits until one of the children prints something or ends, at most so many milliseconds.
  static void wait_for_any(const std::vector<ChildRun*>& children, int milliseconds);

 private:
  pid_t pid_ = -1;
  int out_end_ = -1, err_end_ = -1;
  int exit_code_ = -1;
  int signal_ = 0;
  std::string out_, err_;
};

}  // namespace hermesh::cli
