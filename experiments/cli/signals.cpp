#include "experiments/cli/signals.h"

#include <fcntl.h>
#include <sched.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <system_error>
#include <thread>

#include "algorithms/io/atomic_file.h"
#include "experiments/cli/terminal_progress.h"

namespace hermesh::cli {
namespace {

using namespace std::chrono_literals;

// Long enough for code that polls the flag to unwind, short enough to feel immediate.
constexpr auto kGrace = 50ms;

enum class State { working, finished, ending };

std::atomic<bool> cancel_flag{false};
std::atomic<int> signal_number{0};
std::atomic<State> state{State::working};
std::atomic<bool> end_is_held{false};
int wake_pipe[2] = {-1, -1};

static_assert(std::atomic<bool>::is_always_lock_free && std::atomic<int>::is_always_lock_free,
              "a signal handler may touch lock-free atomics only");

extern "C" void on_signal(int number) {
  const int saved_errno = errno;
  int none = 0;
  signal_number.compare_exchange_strong(none, number);
  cancel_flag.store(true);
  const char byte = 0;
  [[maybe_unused]] const ssize_t written = write(wake_pipe[1], &byte, 1);
  errno = saved_errno;
}

/// Starts a process that shares this one's memory and files and outlives it. The system needs a few tenths of
/// a second to free gigabytes, and a large file that was removed while it was open; it now does so after the
/// end of this process, for which the user waits. (Pipes stay open until then.)
void leave_memory_to_another_process() {
  constexpr std::size_t kStack = 16384;
  alignas(16) static char stack[kStack];
  static std::atomic_flag done;
  if (done.test_and_set()) return;
  sigset_t all;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, nullptr);  // its stack is too small for handlers
  static const pid_t parent = getpid();
  const auto outlive = [](void*) -> int {
    while (getppid() == parent) usleep(1000);
    _exit(0);
  };
  clone(outlive, stack + kStack, CLONE_VM | CLONE_FILES, nullptr);
}

void watch() {
  char byte;
  while (read(wake_pipe[0], &byte, 1) < 0 && errno == EINTR) {
  }
  std::this_thread::sleep_for(kGrace);
  State working = State::working;
  if (state.compare_exchange_strong(working, State::ending)) end_process(signal_exit_code());
}

}  // namespace

const std::atomic<bool>& handle_signals() {
  if (pipe2(wake_pipe, O_CLOEXEC | O_NONBLOCK) != 0 || fcntl(wake_pipe[0], F_SETFL, 0) != 0)
    throw std::system_error(errno, std::generic_category(), "cannot make a pipe");
  std::thread(watch).detach();
  struct sigaction action = {};
  action.sa_handler = on_signal;
  action.sa_flags = SA_RESTART;
  sigemptyset(&action.sa_mask);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  for (const int number : {SIGHUP, SIGPIPE, SIGXCPU}) {
    struct sigaction before = {};
    sigaction(number, nullptr, &before);
    if (before.sa_handler != SIG_IGN) sigaction(number, &action, nullptr);
  }
  // A write beyond the limit of the file size then fails like a write to a full disk.
  std::signal(SIGXFSZ, SIG_IGN);
  return cancel_flag;
}

void hold_the_end(bool held) noexcept { end_is_held.store(held); }

void work_is_finished() noexcept {
  if (end_is_held.load()) return;
  State working = State::working;
  if (state.compare_exchange_strong(working, State::finished)) return;
  while (working == State::ending) pause();
}

int signal_exit_code() noexcept {
  const int number = signal_number.load();
  return number == 0 ? 0 : 128 + number;
}

void end_process(int exit_code) noexcept {
  remove_unfinished_files();
  erase_progress_line();
  leave_memory_to_another_process();
  _exit(exit_code);
}

}  // namespace hermesh::cli
