"""Faults of the machine: the measurement `trial_faults`.

Commands are killed at random moments, and run with too little memory, on a full disk, in a read-only
directory, into a closed pipe and while the clock jumps. Afterwards each file under a final name must be
that of an undisturbed run or absent; leftovers have other names. Then the command must succeed, and its files
be those of an undisturbed run; of rows, all values except times and memory.
"""

import contextlib
import dataclasses
import hashlib
import json
import os
import pathlib
import random
import re
import resource
import shutil
import signal
import subprocess
import tempfile
import time

from . import solids
from .child import MIB
from .damage import write_mesh
from .stale import measured_table

COMMANDS = ("remesh", "fracture", "combine", "run", "merge")
EXPERIMENT = """question = "Do interrupted runs resume?"
voxelizers = ["hermesh"]
columns = ["triangles"]
variants = [{ name = "marching-cubes" }, { name = "dual-contouring" }]
[quick]
repetitions = 1
samples = 1000
pixels = 40
cases = [{ name = "turned-cube", resolutions = [8, 10] }, { name = "torus", resolutions = [8] }]
"""
# Values of rows that differ between runs: times, memory, and what depends on them.
UNSTEADY = re.compile("seconds|bytes|date$|^run$|^shard_run$|^load$|^distances_load$|ratio|slower|faster")
LEAST_MIB, MOST_MIB = 48, 4096  # memory limits
TIMEOUT = 900  # seconds
PICTURE_END = b"IEND\xaeB`\x82"
# Makes the clock jump by up to a day, to and fro, every tenth of a second. (libfaketime also changes sleeps.)
CLOCK = """
#define _GNU_SOURCE
#include <sys/syscall.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>
static long jump(void) {
  struct timespec t;
  syscall(SYS_clock_gettime, CLOCK_MONOTONIC, &t);
  unsigned long tenth = t.tv_sec * 10ul + t.tv_nsec / 100000000;
  return (long)(tenth * 6364136223846793005ul >> 33) % 172800 - 86400;
}
int clock_gettime(clockid_t clock, struct timespec* t) {
  int result = syscall(SYS_clock_gettime, clock, t);
  if (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE) t->tv_sec += jump();
  return result;
}
int gettimeofday(struct timeval* t, void* zone) {
  int result = syscall(SYS_gettimeofday, t, zone);
  t->tv_sec += jump();
  return result;
}
time_t time(time_t* t) {
  struct timespec now;
  clock_gettime(CLOCK_REALTIME, &now);
  return t ? *t = now.tv_sec : now.tv_sec;
}
"""


def _steady(value):
    """Returns a row without times and memory."""
    if isinstance(value, dict):
        return {key: _steady(each) for key, each in value.items() if not UNSTEADY.search(key)}
    return [_steady(each) for each in value] if isinstance(value, list) else value


def contents(directory):
    """Returns {path: content} of all files: a digest, or the steady parts of each row and "torn" for half a
    row.
    """
    found = {}
    for path in sorted(pathlib.Path(directory).rglob("*")):
        if not path.is_file():
            continue
        name, data = str(path.relative_to(directory)), path.read_bytes()
        if path.suffix == ".jsonl":
            lines = data.split(b"\n")
            found[name] = [json.dumps(_steady(json.loads(line)), sort_keys=True) for line in lines[:-1]]
            found[name] += ["torn"] if lines[-1] else []
        elif data.endswith(PICTURE_END):
            found[name] = "a whole picture"  # of a run: with times in it
        else:
            found[name] = hashlib.sha256(data).hexdigest()
    return found


def half_written(found, whole):
    """Returns the names of files under a final name that are neither absent nor as in `whole`.

    Rows may be fewer; of each cell there may be only one.
    """
    wrong = []
    for name in found.keys() & whole.keys():
        rows = found[name]
        if isinstance(rows, list):
            right = len(set(rows)) == len(rows) and set(rows) <= set(whole[name])
        else:
            right = rows == whole[name]
        wrong += [] if right else [name]
    return wrong


def is_whole(found, whole):
    """Returns True if all files are as in `whole`, rows in any order; others may exist.

    Pictures may be missing: a command that cannot draw them adds a note and succeeds.
    """
    required = {name: content for name, content in whole.items() if not name.endswith(".png")}
    return required.keys() <= found.keys() and not half_written(found, whole) and all(
        len(found[name]) == len(rows) for name, rows in required.items() if isinstance(rows, list))


@dataclasses.dataclass
class Attempt:
    exit_code: int  # negative: a signal
    errors: str
    seconds: float


class Bench:
    """Runs commands in a scratch directory."""

    def __init__(self, program, scratch):
        self.scratch = pathlib.Path(scratch)
        self.program = program.resolve()
        self.environment = os.environ | {"HERMESH": str(self.program)}
        self.out = self.scratch / "out"
        meshes = dict(solids._closed_form())
        points, triangles = solids.on_lattice(*meshes["sphere"])
        for name, offset in (("a", 0), ("b", 40_000)):
            write_mesh(self.scratch / f"{name}.off", points + [offset, 0, 0], triangles, 2.0**-17)
        (self.scratch / "trial.toml").write_text(EXPERIMENT)
        self.whole, self.seconds, self.bytes = {}, {}, {}

    def words(self, command):
        scratch, out = self.scratch, self.out
        run = ["run", scratch / "trial.toml", "--quiet", "--out"]
        words = {"remesh": ["remesh", scratch / "a.off", out / "a.ply", "--resolution", "60", "--quiet"],
                 "fracture": ["fracture", scratch / "a.off", out / "pieces", "--cutters", "voronoi:3",
                              "--resolution", "24", "--quiet"],
                 "combine": ["combine", "union", scratch / "a.off", scratch / "b.off", out / "c.ply",
                             "--resolution", "40", "--quiet"],
                 "run": [*run, out],
                 "merge": ["merge", out, scratch / "shard1", scratch / "shard2", "--quiet"],
                 "shard1": [*run, scratch / "shard1", "--shard", "1/2"],
                 "shard2": [*run, scratch / "shard2", "--shard", "2/2"]}
        return [str(word) for word in [self.program, *words[command]]]

    def clean(self):
        shutil.rmtree(self.out, ignore_errors=True)
        self.out.mkdir()

    def attempt(self, command, around=(), during=None, prepare=None, environment=None, stdout=None):
        """Runs a command. `during(process)` may disturb it; `around` are words in front of it."""
        start = time.monotonic()
        with tempfile.TemporaryFile() as errors:
            process = subprocess.Popen([*around, *self.words(command)], stdin=subprocess.DEVNULL,
                                       stdout=stdout or subprocess.DEVNULL, stderr=errors, process_group=0,
                                       preexec_fn=prepare, env=self.environment | (environment or {}))
            if during:
                during(process)
            code = process.wait(TIMEOUT)
            self._wait_for_group(process.pid)
            errors.seek(0)
            return Attempt(code, errors.read().decode(errors="replace"), time.monotonic() - start)

    @staticmethod
    def _wait_for_group(group):
        """Waits until descendants, which get a signal when their parent ends, have ended, too."""
        with contextlib.suppress(ProcessLookupError):
            for _ in range(1000):
                os.killpg(group, 0)
                time.sleep(0.01)
            os.killpg(group, signal.SIGKILL)

    def prepare(self, command):
        """Runs a command undisturbed, the first time, for its files and its time."""
        if command == "merge" and not (self.scratch / "shard1").exists():
            for shard in ("shard1", "shard2"):
                self._must_succeed(self.attempt(shard))
        if command not in self.whole:
            self.clean()
            done = self.attempt(command)
            self._must_succeed(done)
            self.whole[command], self.seconds[command] = contents(self.out), done.seconds
            self.bytes[command] = sum(path.stat().st_size for path in self.out.rglob("*") if path.is_file())

    @staticmethod
    def _must_succeed(done):
        if done.exit_code:
            raise RuntimeError(f"an undisturbed command failed: {done.errors}")

    def judge(self, command, done, values, fault=""):
        """Adds the outcome of a disturbed command to the values; returns what is wrong."""
        found, whole = contents(self.out), self.whole[command]
        wrong = [f"{name} is half written" for name in half_written(found, whole)]
        complete = is_whole(found, whole)
        if done.exit_code == 0 and not complete:
            wrong.append("success without all files")
        if done.exit_code < 0 and done.exit_code != -signal.SIGKILL:
            wrong.append(f"ended by {signal.Signals(-done.exit_code).name}: {done.errors.strip()[-200:]}")
        if done.exit_code > 0 and not done.errors.strip() and fault != "closed pipe":  # whose reader left
            wrong.append(f"exit code {done.exit_code} without a message")
        if done.exit_code and fault == "clock":
            wrong.append(f"failed: {done.errors.strip()[-300:]}")
        values["faults"] += 1
        values["done"] += complete
        values["nothing"] += not found.keys() & whole.keys()
        values["partly"] += not complete and bool(found.keys() & whole.keys())
        values["leftovers"] += bool(found.keys() - whole.keys())
        values["half_written"] += any("half" in each for each in wrong)
        if found and not complete:
            values["resumed"] += 1
            again = self.attempt(command)
            if again.exit_code:
                values["blocked"] += 1
                wrong.append(f"blocked afterwards: {again.errors.strip()[-300:]}")
            elif not is_whole(contents(self.out), whole):
                values["differing"] += 1
                wrong.append("the resumed files differ from those of an undisturbed run")
        return wrong


# ---- Faults. Each yields (description, attempt) of a command; the directory is clean at each.

def _kills(bench, command, count, chance):
    """Kills the process or its group, at any moment or, every other time, soon after it starts to write."""
    for number in range(count):
        writes, group = number % 2, chance.random() < 0.5
        delay = chance.uniform(0, 0.05 if writes else bench.seconds[command])

        def kill(process):
            while writes and process.poll() is None and not os.listdir(bench.out):
                time.sleep(0.0005)
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(delay)
            if process.returncode is None:
                (os.killpg if group else os.kill)(process.pid, signal.SIGKILL)

        yield f"killed after {delay:.3f} s{' of writing' * writes}", bench.attempt(command, during=kill)


def _memory_limits(bench, command, count, chance):
    for level in range(count):
        limit = round(LEAST_MIB * (MOST_MIB / LEAST_MIB) ** (level / max(1, count - 1))) * MIB
        yield f"{limit // MIB} MiB", bench.attempt(
            command, prepare=lambda: resource.setrlimit(resource.RLIMIT_AS, (limit, limit)))


def _mounted(bench, command, options):
    """Runs a command with a file system in place of its output directory; its files are copied out of it."""
    copy = bench.scratch / "copy"
    shutil.rmtree(copy, ignore_errors=True)
    script = ('mount -t tmpfs -o "$1" none "$2" && copy=$3 out=$2 && shift 3 && '
              '"$@"; code=$?; cp -r "$out" "$copy"; exit $code')
    done = bench.attempt(command, ["unshare", "-rm", "sh", "-c", script, "sh", options, bench.out, copy])
    if copy.exists():
        shutil.rmtree(bench.out)
        copy.rename(bench.out)
    return done


def _full_disks(bench, command, count, chance):
    for _ in range(count):
        pages = max(1, round(chance.uniform(0, 1) * bench.bytes[command] / 4096))  # tmpfs counts pages
        yield f"disk of {pages * 4} KiB", _mounted(bench, command, f"size={pages * 4}k")


def _read_only(bench, command, count, chance):
    for _ in range(count):
        yield "read-only directory", _mounted(bench, command, "ro")


def _closed_pipes(bench, command, count, chance):
    for _ in range(count):
        reading, writing = os.pipe()
        os.close(reading)
        done = bench.attempt(command, stdout=writing)
        os.close(writing)
        yield "closed pipe", done


def _clock_jumps(bench, command, count, chance):
    library = bench.scratch / "clock.so"
    subprocess.run(["cc", "-shared", "-fPIC", "-x", "c", "-", "-o", library], input=CLOCK, text=True,
                   check=True)
    for _ in range(count):
        yield "clock jumps", bench.attempt(command, environment={"LD_PRELOAD": str(library)})


FAULTS = {"kill": (_kills, "kills"), "memory": (_memory_limits, "levels"),
          "full disk": (_full_disks, "others"), "read-only": (_read_only, "others"),
          "closed pipe": (_closed_pipes, "others"), "clock": (_clock_jumps, "others")}


def measure(parameters, wants, program, progress):
    """Yields a row for each fault and command."""
    with tempfile.TemporaryDirectory() as scratch:
        bench = Bench(program.file.with_name("hermesh"), scratch)
        for fault, (disturb, amount) in FAULTS.items():
            for command in COMMANDS:
                label = f"{fault}, {command}"
                if not wants(label) or fault == "clock" and command != "run":
                    continue
                progress(label)
                bench.prepare(command)
                bench.clean()
                values = dict.fromkeys(("faults", "done", "nothing", "partly", "leftovers", "resumed",
                                        "half_written", "blocked", "differing"), 0)
                broken = []
                for what, done in disturb(bench, command, int(parameters[amount]), random.Random(label)):
                    broken += [f"{what}: {wrong}" for wrong in bench.judge(command, done, values, fault)]
                    bench.clean()
                yield label, values | {"first_mistake": broken[0] if broken else ""}, broken


MEASUREMENT = {
    "name": "trial_faults", "measure": measure, "table": "faults",
    "parameters": [{"name": name, "default": default, "minimum": 1, "maximum": 1000, "help": text}
                   for name, default, text in (("kills", 2, "kills of each command"),
                                               ("levels", 2, "memory limits of each command"),
                                               ("others", 1, "of each other fault and command"))],
    "shown": measured_table("faults of the machine and their effects", "fault", {
        "faults": "disturbed commands",
        "done": "of these, those that wrote all files before the fault or in spite of it",
        "nothing": "without any file under a final name", "partly": "with some of the files",
        "leftovers": "with files under other names, such as those that a killed process cannot remove",
        "resumed": "commands run again where there were files",
        "half_written, half written": "with a file under a final name that is not that of an undisturbed run",
        "blocked": "that failed when run again", "differing": "with other files or values when run again",
        "first_mistake, first mistake": "what was wrong"})}
