#include "experiments/harness/child_process.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <fstream>

#include "algorithms/core/error.h"

namespace hermesh {
namespace {

/// How long the reader sleeps before it looks at the limits again: memory grows by some hundred mebibytes meanwhile at most.
constexpr int kMilliseconds = 20;

/// How long a child that is asked to end may take to remove its unfinished files.
constexpr int kGraceMilliseconds = 300;

/// Two ends of a connection: sockets, since writing to one whose other end is closed need not raise a signal.
struct Connection {
  int ours = -1, theirs = -1;
  Connection() {
    int ends[2];
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0)
      throw Error(std::string("cannot make a connection: ") + std::strerror(errno));
    ours = ends[0];
    theirs = ends[1];
  }
};

std::string readable_seconds(double seconds) {
  char text[40];
  std::snprintf(text, sizeof text, "%g s", seconds);
  return text;
}

}  // namespace

std::int64_t resident_bytes(pid_t pid) {
  const std::string folder = "/proc/" + std::to_string(pid);
  std::ifstream statm(folder + "/statm");
  std::int64_t pages = 0, resident = 0;
  if (statm >> pages >> resident) resident *= sysconf(_SC_PAGE_SIZE);
  std::ifstream children(folder + "/task/" + std::to_string(pid) + "/children");
  for (pid_t child; children >> child;) resident += resident_bytes(child);
  return resident;
}

ChildProcess::ChildProcess(const std::filesystem::path& program, const std::vector<std::string>& arguments) {
  const Connection commands, answers;
  std::vector<char*> words;
  const std::string name = program.string();
  words.push_back(const_cast<char*>(name.c_str()));
  for (const std::string& argument : arguments) words.push_back(const_cast<char*>(argument.c_str()));
  words.push_back(nullptr);
  const pid_t parent = getpid();
  pid_ = fork();
  if (pid_ == 0) {
    // Between fork and exec of a program with threads only what a signal handler may do is allowed.
    setpgid(0, 0);
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (getppid() != parent) _exit(127);
    dup2(commands.theirs, STDIN_FILENO);
    dup2(STDERR_FILENO, STDOUT_FILENO);
    dup2(answers.theirs, kAnswers);
    if (answers.theirs == kAnswers) fcntl(kAnswers, F_SETFD, 0);
    execv(words[0], words.data());
    _exit(127);
  }
  const std::string reason = std::strerror(errno);
  close(commands.theirs);
  close(answers.theirs);
  to_ = commands.ours;
  from_ = answers.ours;
  if (pid_ < 0) throw Error("cannot start " + name + ": " + reason);
  setpgid(pid_, pid_);  // whichever of the two comes first
}

ChildProcess::~ChildProcess() {
  kill_all();
  reap();
  if (to_ >= 0) close(to_);
  if (from_ >= 0) close(from_);
}

void ChildProcess::kill_all() {
  if (pid_ <= 0) return;
  kill(-pid_, SIGTERM);
  siginfo_t info;
  for (int i = 0; i < kGraceMilliseconds; ++i) {
    info.si_pid = 0;
    if (waitid(P_PID, static_cast<id_t>(pid_), &info, WEXITED | WNOHANG | WNOWAIT) != 0 || info.si_pid == pid_) break;
    usleep(1000);
  }
  kill(-pid_, SIGKILL);
}

/// Waits for the end, and says how it came about unless that is known.
void ChildProcess::reap() {
  if (pid_ <= 0) return;
  int status = 0;
  while (waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
  }
  kill(-pid_, SIGKILL);  // what the child left behind
  pid_ = -1;
  if (!end_.empty()) return;
  if (WIFSIGNALED(status)) {
    crashed_ = true;
    end_ = std::string("crashed (") + strsignal(WTERMSIG(status)) + ")";
  } else if (WEXITSTATUS(status) != 0) {
    end_ = "ended with exit code " + std::to_string(WEXITSTATUS(status));
  }
}

void ChildProcess::send(const std::string& line) {
  const std::string text = line + "\n";
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t written = ::send(to_, text.data() + done, text.size() - done, MSG_NOSIGNAL);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return;
    done += static_cast<std::size_t>(written);
  }
}

std::optional<std::string> ChildProcess::receive(const ChildLimits& limits, const RunContext& context) {
  const auto start = std::chrono::steady_clock::now();
  while (true) {
    if (const std::size_t end = buffer_.find('\n'); end != std::string::npos) {
      std::string line = buffer_.substr(0, end);
      buffer_.erase(0, end + 1);
      return line;
    }
    if (pid_ <= 0) return std::nullopt;
    context.check();
    pollfd wait = {from_, POLLIN, 0};
    if (poll(&wait, 1, kMilliseconds) > 0) {
      char text[65536];
      const ssize_t count = read(from_, text, sizeof text);
      if (count > 0) {
        buffer_.append(text, static_cast<std::size_t>(count));
        continue;
      }
      if (count < 0 && errno == EINTR) continue;
      reap();
      continue;
    }
    const std::chrono::duration<double> waited = std::chrono::steady_clock::now() - start;
    if (limits.seconds > 0 && waited.count() > limits.seconds) end_ = "took longer than " + readable_seconds(limits.seconds);
    if (limits.bytes > 0 && resident_bytes(pid_) > limits.bytes)
      end_ = "took more than " + std::to_string(limits.bytes >> 20) + " MiB of memory";
    if (end_.empty()) continue;
    kill_all();
    reap();
  }
}

}  // namespace hermesh
