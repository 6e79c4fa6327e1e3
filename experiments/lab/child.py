"""Programs that run as child processes under limits of time and memory, and end when the laboratory does.

run() starts any program. work() starts one that works on a job: it reads the job, a line of JSON, from its
standard input and writes its answers, lines of JSON, to file descriptor 3 (experiments/cells/serve.h lists
them). Its standard output is our standard error.
"""

import contextlib
import ctypes
import dataclasses
import json
import os
import pathlib
import re
import resource
import select
import signal
import subprocess
import tempfile
import time

from .rows import LabError, text_at

MIB = 2**20
ANSWERS = 3  # file descriptor of the child's answers
POLL_SECONDS = 0.03  # between two looks at the limits
GRACE_SECONDS = 0.3  # for a child to remove unfinished files
PR_SET_PDEATHSIG = 1  # of linux/prctl.h
_libc = ctypes.CDLL(None)


class DataMissing(LabError):
    """Data that --require-data asks for are missing."""


class InputUnreadable(LabError):
    """The input of a group cannot be read; the other groups are not affected."""


@dataclasses.dataclass(frozen=True)
class Limits:
    """0 is no limit for work()."""
    seconds: float  # of wall time: of run() in total, of work() from one answer to the next
    memory_mib: int  # of run(): address space; of work(): resident memory of child and descendants


@dataclasses.dataclass(frozen=True)
class Ended:
    """How a process ended: done, refused (exit code other than 0), crash, time limit or memory limit."""
    status: str
    exit_code: int
    cpu_seconds: float
    peak_mib: float
    output: str
    errors: str
    wall_seconds: float


@dataclasses.dataclass
class Outcome:
    """What a child did of a job. If it was not done: why it ended, and the label of the cell it worked on."""
    rows: list = dataclasses.field(default_factory=list)
    planned: dict = dataclasses.field(default_factory=dict)  # by label
    input: dict = None
    distances: list = dataclasses.field(default_factory=list)
    reason: str = ""
    culprit: str = ""
    crashed: bool = False
    done: bool = False


def _start(command, prepare, number, **options):
    """Starts a program in a process group of its own, which gets a signal when this process ends."""
    parent = os.getpid()

    def prepare_child():  # between fork and exec
        _libc.prctl(PR_SET_PDEATHSIG, number)
        if os.getppid() != parent:
            os._exit(127)
        prepare()

    return subprocess.Popen(command, preexec_fn=prepare_child, process_group=0, **options)


def run(command, limits, directory=None, environment=None):
    """Runs a program and its children to the end or to a limit. Raises OSError if it cannot be started."""
    def prepare():
        resource.setrlimit(resource.RLIMIT_AS, (limits.memory_mib * MIB, limits.memory_mib * MIB))

    start, is_late, pid, sampled = time.monotonic(), False, 0, 0
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        process = _start(command, prepare, signal.SIGKILL, stdin=subprocess.DEVNULL, stdout=out, stderr=err,
                         cwd=directory, env=environment)
        while not pid:
            time.sleep(0.002)
            sampled = max(sampled, _peak_kib(process.pid))
            pid, status, usage = os.wait4(process.pid, os.WNOHANG)
            if not pid and time.monotonic() - start > limits.seconds:
                is_late = True
                _kill_group(process.pid)
        process.returncode, wall = (code := os.waitstatus_to_exitcode(status)), time.monotonic() - start
        out.seek(0)
        err.seek(0)
        output, errors = (file.read().decode(errors="replace") for file in (out, err))
    # The peak of a process includes that of this one, from which it was forked; smaller peaks are sampled.
    own = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    peak = sampled if sampled and usage.ru_maxrss <= own else usage.ru_maxrss
    if is_late:
        word = "time limit"
    elif code == 0:
        word = "done"
    elif any(text in errors for text in ("bad_alloc", "not enough memory", "MemoryError")):
        word = "memory limit"
    else:
        word = "crash" if code < 0 else "refused"
    return Ended(word, code, usage.ru_utime + usage.ru_stime, peak / 1024, output, errors, wall)


def ignore(_):
    pass


def work(command, job, limits=Limits(0, 0), keep=ignore, note=ignore, progress=ignore):
    """Has a program work on a job; returns the Outcome.

    Passes each row to keep(), each message to note() and each stage to progress() at once. Lines that are not
    JSON objects are ignored. Raises DataMissing, InputUnreadable or LabError if the program reports an error,
    and OSError if it cannot be started. If anything is raised, also by Ctrl-C, the program and its
    descendants are killed. A reason is e.g. "crashed (Segmentation fault)" or "took longer than 10 s".
    """
    outcome = Outcome()

    def take(answer):
        if "error" in answer:
            kinds = {"missing": DataMissing, "unreadable": InputUnreadable}
            raise next((kind for key, kind in kinds.items() if key in answer), LabError)(answer["error"])
        if "planned" in answer:
            outcome.planned[text_at(answer["planned"], "/variant/label")] = answer["planned"]
        if "stage" in answer:
            progress(f"{answer['stage']} {answer.get('fraction', 0):.0%}")
        if "note" in answer:
            note(answer["note"])
        if "row" in answer:
            outcome.rows.append(answer["row"])
            keep(answer["row"])
        if "distances" in answer:
            outcome.distances.append(answer["distances"])
        outcome.culprit = answer.get("at", outcome.culprit)
        outcome.input = answer.get("input", outcome.input)
        outcome.done = outcome.done or "done" in answer

    ours, theirs = os.pipe()
    with open(ours, "rb", buffering=0) as answers, tempfile.TemporaryFile() as request:
        request.write(json.dumps(job).encode() + b"\n")
        request.seek(0)
        try:
            # Descriptor 3 is in use, at least by our pipe, so Popen does not put its own pipe there.
            process = _start(command, lambda: os.dup2(theirs, ANSWERS), signal.SIGTERM, stdin=request,
                             stdout=2, close_fds=False)
        finally:
            os.close(theirs)
        try:
            outcome.reason = _listen(process, answers, limits, take)
        finally:
            _end(process)
    code = process.returncode
    if not outcome.reason and code < 0:
        outcome.reason, outcome.crashed = f"crashed ({signal.strsignal(-code)})", True
    elif not outcome.reason and not outcome.done:
        outcome.reason = f"ended with exit code {code}" if code else "ended before it was done"
    return outcome


def _listen(process, answers, limits, take):
    """Passes answers to take() until the process ends, or until it exceeds a limit; returns which, or ""."""
    buffer, step = b"", time.monotonic()
    while True:
        has_ended = _has_ended(process)
        is_ready = select.select([answers], [], [], 0 if has_ended else POLL_SECONDS)[0]
        if is_ready and (data := answers.read(1 << 16)):
            *lines, buffer = (buffer + data).split(b"\n")
            for answer in filter(None, map(parsed, lines)):
                if "stage" not in answer:  # progress does not show that a step will end
                    step = time.monotonic()
                take(answer)
        elif has_ended:
            return ""
        elif is_ready:  # it has closed the descriptor
            time.sleep(0.001)
        if limits.seconds and time.monotonic() - step > limits.seconds:
            return f"took longer than {limits.seconds:g} s"
        if limits.memory_mib and resident_bytes(process.pid) > limits.memory_mib * MIB:
            return f"took more than {limits.memory_mib:.0f} MiB of memory"


def _has_ended(process):
    """Unlike Popen.poll(), leaves no lock behind if a signal raises an exception within it."""
    return os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOHANG | os.WNOWAIT) is not None


def parsed(line):
    """Returns the object in a line of JSON; None if there is none."""
    with contextlib.suppress(ValueError, RecursionError):  # the latter for deep nesting
        answer = json.loads(line)
        return answer if isinstance(answer, dict) else None


def _peak_kib(pid):
    """Returns the largest peak of resident memory of a process and its descendants, 0 if it has ended."""
    folder = pathlib.Path("/proc", str(pid))
    try:
        peak = re.search(r"VmHWM:\s+(\d+)", (folder / "status").read_text())
        children = (folder / "task" / str(pid) / "children").read_text().split()
    except OSError:
        return 0
    return max([int(peak[1]) if peak else 0, *map(_peak_kib, children)])


def resident_bytes(pid):
    """Returns the resident memory of a process and all of its descendants, 0 if there is no such process."""
    folder = pathlib.Path("/proc", str(pid))
    try:
        resident = int((folder / "statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
        children = (folder / "task" / str(pid) / "children").read_text().split()
    except (OSError, IndexError):
        return 0
    return resident + sum(map(resident_bytes, children))


def _end(process):
    """Ends the process, and kills what it started and left behind."""
    if not _has_ended(process):
        os.killpg(process.pid, signal.SIGTERM)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(GRACE_SECONDS)
    _kill_group(process.pid)
    process.wait()


def _kill_group(pid):
    with contextlib.suppress(ProcessLookupError):  # it has just ended
        os.killpg(pid, signal.SIGKILL)
