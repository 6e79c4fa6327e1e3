// Signals that end a program (SIGINT, SIGTERM, SIGHUP, SIGPIPE, SIGXCPU): ask the work to stop, and see to it
// that the process ends.
#pragma once

#include <atomic>

namespace hermesh::cli {

/// Handles these signals from now on: the returned flag is set, and a watchdog thread ends the process
/// 50 ms later, because a library's loop may never look at the flag. It removes unfinished files first. Call
/// once, before the work starts. A SIGINT or SIGTERM that the caller had ignored is handled, too: who sends
/// it wants the end. The others stay ignored then, as nohup has it. Files that become too large (SIGXFSZ) are
/// errors.
const std::atomic<bool>& handle_signals();

/// Says that the work is done and its output stands under its name: a signal from now on changes nothing.
/// Does not return if the watchdog is ending the process at this moment.
void work_is_finished() noexcept;

/// While held, work_is_finished() does nothing: the output is made, but has still to go to where it was asked
/// for.
void hold_the_end(bool held) noexcept;

/// The exit code for the signal that came, 128 plus its number; 0 if none came.
int signal_exit_code() noexcept;

/// Removes unfinished files and ends the process without running destructors, which a waiting user gains
/// nothing by.
[[noreturn]] void end_process(int exit_code) noexcept;

}  // namespace hermesh::cli
