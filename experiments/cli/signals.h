// Signals that end a program (SIGINT, SIGTERM, SIGHUP, SIGPIPE, SIGXCPU): they stop the work and end the
// process.
#pragma once

#include <atomic>

namespace hermesh::cli {

/// Handles these signals from now on: the returned flag is set, and a watchdog thread removes unfinished
/// files and ends the process 50 ms later, because a library's loop may never read the flag. Call once,
/// before the work starts. SIGINT and SIGTERM are handled even if the caller ignored them; the others stay
/// ignored then, for nohup. Files that become too large (SIGXFSZ) are errors.
const std::atomic<bool>& handle_signals();

/// Declares the work done and its output in place: later signals have no effect. Does not return if the
/// watchdog is ending the process.
void work_is_finished() noexcept;

/// While such an object exists, work_is_finished() does nothing, because the output has yet to be delivered.
void hold_the_end(bool held) noexcept;

/// Returns the exit code for the received signal, 128 plus its number; 0 without one.
int signal_exit_code() noexcept;

/// Removes unfinished files and ends the process without running destructors, to save the user's time.
[[noreturn]] void end_process(int exit_code) noexcept;

}  // namespace hermesh::cli
