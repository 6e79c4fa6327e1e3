#include "experiments/cli/child_run.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>

#include "algorithms/core/error.h"

namespace hermesh::cli {
namespace {

/// Reads the available bytes; returns false once the other end is closed.
bool drain(int& end, std::string& into) {
  if (end < 0) return false;
  std::array<char, 4096> chunk;
  while (true) {
    const ssize_t size = ::read(end, chunk.data(), chunk.size());
    if (size > 0) {
      into.append(chunk.data(), std::size_t(size));
      continue;
    }
    if (size < 0 && (errno == EAGAIN || errno == EINTR)) return true;
    close(end);
    end = -1;
    return false;
  }
}

}  // namespace

ChildRun::ChildRun(const std::string& program, const std::vector<std::string>& arguments) {
  std::vector<char*> words;
  words.push_back(const_cast<char*>(program.c_str()));
  for (const std::string& argument : arguments) words.push_back(const_cast<char*>(argument.c_str()));
  words.push_back(nullptr);
  int out[2], err[2];
  if (pipe2(out, O_CLOEXEC) != 0 || pipe2(err, O_CLOEXEC) != 0)
    throw Error(std::string("cannot make a pipe: ") + std::strerror(errno));
  const pid_t parent = getpid();
  pid_ = fork();
  if (pid_ == 0) {
    // Between fork and exec of a program with threads only async-signal-safe calls are allowed. A process
    // group of its own keeps Ctrl-C away from the child: its parent ends it and waits for it.
    setpgid(0, 0);
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (getppid() != parent) _exit(127);
    const int nothing = open("/dev/null", O_RDONLY);
    dup2(nothing, STDIN_FILENO);
    dup2(out[1], STDOUT_FILENO);
    dup2(err[1], STDERR_FILENO);
    execv(words[0], words.data());
    _exit(127);
  }
  const int reason = errno;
  close(out[1]);
  close(err[1]);
  out_end_ = out[0];
  err_end_ = err[0];
  fcntl(out_end_, F_SETFL, O_NONBLOCK);
  fcntl(err_end_, F_SETFL, O_NONBLOCK);
  if (pid_ < 0) throw Error("cannot start " + program + ": " + std::strerror(reason));
}

bool ChildRun::has_ended() {
  if (pid_ < 0) return true;
  const bool more_out = drain(out_end_, out_), more_err = drain(err_end_, err_);
  int status = 0;
  // A program that has closed both pipes is about to end, and one that has ended has closed both.
  if (waitpid(pid_, &status, more_out || more_err ? WNOHANG : 0) != pid_) return false;
  drain(out_end_, out_);
  drain(err_end_, err_);
  pid_ = -1;
  if (WIFSIGNALED(status)) signal_ = WTERMSIG(status);
  if (WIFEXITED(status)) exit_code_ = WEXITSTATUS(status);
  return true;
}

void ChildRun::ask_to_end() {
  if (pid_ > 0) kill(pid_, SIGTERM);
}

ChildRun::~ChildRun() {
  ask_to_end();
  for (int i = 0; i < 2000 && !has_ended(); ++i) usleep(1000);
  if (pid_ > 0) {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  if (out_end_ >= 0) close(out_end_);
  if (err_end_ >= 0) close(err_end_);
}

void ChildRun::wait_for_any(const std::vector<ChildRun*>& children, int milliseconds) {
  std::vector<pollfd> ends;
  for (const ChildRun* child : children)
    for (const int end : {child->out_end_, child->err_end_})
      if (end >= 0) ends.push_back({end, POLLIN, 0});
  poll(ends.data(), ends.size(), milliseconds);
}

}  // namespace hermesh::cli
