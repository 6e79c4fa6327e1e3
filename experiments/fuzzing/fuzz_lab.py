"""Fuzzing of the readers in Python, guided by coverage: an input that executes a new line is mutated further.

    python3 -m experiments.fuzzing.fuzz_lab TARGET --seconds N [--seed N] [--findings DIR]

Targets: experiment (experiment files), benchmark (those of `hermesh benchmark`) and result (results of
programs, answers of hermesh-lab). Prints the
number of executions and the executed lines of each source. Exits with 1 at the first finding, which is
written to a file: an exception of another type than the reader documents, or more than ten seconds.
"""

import argparse
import contextlib
import hashlib
import pathlib
import random
import re
import signal
import sys
import tempfile
import time
import traceback

from ..lab import ablations, benchmark, child, experiment, protocol, rows
from ..lab.tests.test_experiment import VOCABULARY

HERE = pathlib.Path(__file__).parent
SECONDS = 10  # that one input may take
WORD = re.compile(rb'"[^"\n]*"|[\w.+-]+|\s+|.', re.DOTALL)
JUNK = [b"", b"-1", b"1e300", b"1e999", b"nan", b"0x" + b"f" * 40, b"9" * 400, b'""', b"[]", b"{}", b"[[",
        b"true", b"null", b"1979-05-27", b"\x07", b"\xff", b'"""', b"\\ud800", b'"' + b"a" * 5000 + b'"',
        b"[" * 3000, b","]


class Late(BaseException):
    """An input took too long. Not an Exception, so that a reader does not catch it."""


def read_experiment(file):
    found = experiment.read_experiment(file, VOCABULARY)
    for tier in found["tiers"].values():
        if found["kind"] != "measurement":
            experiment.groups_of(found, tier)


def read_benchmark(file):
    benchmark.read_experiment(file)


def read_result(file):
    for line in file.read_bytes().split(b"\n"):
        child.parsed(line)
    protocol.read_result(file)


# Reader, the exceptions that it documents, the modules that it is a part of.
TARGETS = {"experiment": (read_experiment, rows.LabError, (experiment, ablations)),
           "benchmark": (read_benchmark, rows.LabError, (benchmark,)),
           "result": (read_result, ValueError, (protocol, child))}


def attempt(target, data):
    """Reads bytes. Returns True if they have a value. Raises Late, or any exception that is a finding."""
    read, documented, _ = TARGETS[target]

    def end(*_):
        raise Late(f"more than {SECONDS} seconds")

    before = signal.signal(signal.SIGALRM, end)
    try:
        with tempfile.TemporaryDirectory() as directory:
            file = pathlib.Path(directory, "input.toml")
            file.write_bytes(data)
            signal.alarm(SECONDS)
            read(file)
        return True
    except documented as error:
        # A subclass such as UnicodeError is not documented; a message is one short line.
        if type(error) is not documented or not str(error) or str(error) != rows.shown(error, 1500):
            raise
        return False
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def mutated(data, others, generator):
    """Returns the bytes with one to four changes of words, bytes or parts."""
    for _ in range(generator.randint(1, 4)):
        at, kind = generator.randrange(len(data) + 1), generator.randrange(6)
        if kind < 3:
            words = WORD.findall(data) or [b""]
            junk = generator.choice([JUNK, words, WORD.findall(generator.choice(others)) or JUNK])
            place = generator.randrange(len(words))
            words[place] = generator.choice(junk) if kind else words[place] + generator.choice(junk)
            data = b"".join(words)
        elif kind == 3:
            data = data[:at] + data[at + generator.randrange(1, 40):]
        elif kind == 4:
            data = data[:at] + bytes([generator.randrange(256)]) + data[at + generator.randrange(2):]
        else:
            other = generator.choice(others)
            start = generator.randrange(len(other) + 1)
            data = data[:at] + other[start:start + generator.randrange(200)] + data[at:]
    return data[:1 << 16]


class Lines:
    """Counts the executed lines of modules."""

    def __init__(self, modules):
        self.files = {module.__file__: set() for module in modules}
        self.new = False

    def trace(self, frame, event, _):
        executed = self.files.get(frame.f_code.co_filename)
        if executed is None:
            return None
        if event == "line" and frame.f_lineno not in executed:
            executed.add(frame.f_lineno)
            self.new = True
        return self.trace

    @contextlib.contextmanager
    def traced(self):
        self.new = False
        sys.settrace(self.trace)
        try:
            yield
        finally:
            sys.settrace(None)

    def report(self):
        for file, executed in self.files.items():
            every = lines_of_functions(compile(pathlib.Path(file).read_text(), file, "exec"))
            share = len(executed & every) / len(every)
            print(f"{pathlib.Path(file).name}: {share:.0%} of {len(every)} lines in functions")


def lines_of_functions(code):
    """Returns the numbers of the lines of the functions in a module's code."""
    inner = [each for each in code.co_consts if hasattr(each, "co_lines")]
    own = {line for _, _, line in code.co_lines() if line and line != code.co_firstlineno}
    return set().union(*map(lines_of_functions, inner), own if code.co_name != "<module>" else ())


def fuzz(target, seconds, seed, corpus, findings):
    """Returns the exit code."""
    lines, generator = Lines(TARGETS[target][2]), random.Random(seed)
    pool = [file.read_bytes() for file in sorted(corpus.iterdir())] if corpus.is_dir() else [b""]
    start, executions = time.monotonic(), 0
    while time.monotonic() < start + seconds or executions < len(pool):
        data = pool[executions] if executions < len(pool) else \
            mutated(generator.choice(pool), pool, generator)
        executions += 1
        try:
            with lines.traced():
                attempt(target, data)
        except (Exception, Late):
            findings.mkdir(parents=True, exist_ok=True)
            file = findings / hashlib.sha1(data).hexdigest()[:12]
            file.write_bytes(data)
            traceback.print_exc(limit=-3)
            print(f"{target}: finding after {executions} executions: {file}")
            return 1
        if lines.new:
            pool.append(data)
    print(f"{target}: {executions} executions in {time.monotonic() - start:.0f} s, no finding")
    lines.report()
    return 0


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("target", choices=TARGETS)
    parser.add_argument("--seconds", type=float, default=60)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--findings", type=pathlib.Path)
    arguments = parser.parse_args()
    findings = arguments.findings or HERE / "findings" / arguments.target
    return fuzz(arguments.target, arguments.seconds, arguments.seed, HERE / "corpus" / arguments.target,
                findings)


if __name__ == "__main__":
    sys.exit(main())
