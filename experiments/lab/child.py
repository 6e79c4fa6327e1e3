"""Programs that run as child processes under limits of time and memory."""

import dataclasses
import os
import resource
import signal
import subprocess
import tempfile
import threading

MIB = 2**20


@dataclasses.dataclass(frozen=True)
class Limits:
    seconds: float  # of wall time
    memory_mib: int  # of address space


@dataclasses.dataclass(frozen=True)
class Ended:
    """How a process ended: status is done, refused (exit code other than 0), crash, time limit or memory limit."""
    status: str
    exit_code: int
    cpu_seconds: float
    peak_mib: float
    output: str
    errors: str


def run(command, limits, directory=None):
    """Runs a program and its children to the end or to a limit. Raises OSError if it cannot be started."""
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        def limit_memory():
            resource.setrlimit(resource.RLIMIT_AS, (limits.memory_mib * MIB, limits.memory_mib * MIB))

        process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=out, stderr=err, cwd=directory,
                                   preexec_fn=limit_memory, start_new_session=True)
        late = threading.Event()

        def stop():
            late.set()
            try:
                os.killpg(process.pid, signal.SIGKILL)
            except ProcessLookupError:
                pass  # It has just ended.

        timer = threading.Timer(limits.seconds, stop)
        timer.start()
        try:
            _, status, usage = os.wait4(process.pid, 0)
        finally:
            timer.cancel()
        process.returncode = os.waitstatus_to_exitcode(status)
        out.seek(0)
        err.seek(0)
        output, errors = (f.read().decode(errors="replace") for f in (out, err))
    code = process.returncode
    peak = usage.ru_maxrss / 1024.0
    if late.is_set():
        word = "time limit"
    elif code == 0:
        word = "done"
    elif "bad_alloc" in errors or "not enough memory" in errors or "MemoryError" in errors:
        word = "memory limit"
    else:
        word = "crash" if code < 0 else "refused"
    return Ended(word, code, usage.ru_utime + usage.ru_stime, peak, output, errors)
