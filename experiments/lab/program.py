"""The program that runs cells as a child process: its description, and its identity in rows."""

import dataclasses
import datetime
import functools
import hashlib
import json
import os
import pathlib
import re
import subprocess

from .rows import LabError, ROOT


@dataclasses.dataclass(frozen=True)
class Program:
    """A program that takes jobs (child.py), and what it states of itself.

    `description` has the vocabulary of experiment files (experiment.py), and commit, dirty, build, libraries
    and threads.
    """

    command: list
    file: pathlib.Path
    description: dict

    @functools.cached_property
    def hash(self):
        """The first 16 digits of the file's SHA-256, which identify the program in rows."""
        return sha256_of(self.file)[:16]


def program_file():
    """Returns hermesh-lab, next to the program that $HERMESH names, or that of the build."""
    return pathlib.Path(os.environ.get("HERMESH", ROOT / "build/release/hermesh")).with_name("hermesh-lab")


def load_program():
    """Returns the Program of program_file()."""
    file = program_file()
    if not file.is_file():
        raise LabError(f"there is no program {file}; build it with: "
                       "cmake --build --preset release --target hermesh-lab")
    described = subprocess.run([file, "describe"], capture_output=True, text=True)
    if described.returncode:
        raise LabError(f"{file} describe failed: {described.stderr.strip()}")
    return Program([str(file), "cell"], file, json.loads(described.stdout))


def sha256_of(file):
    """Returns the SHA-256 of a file in hexadecimal digits."""
    return hashlib.sha256(pathlib.Path(file).read_bytes()).hexdigest()


# ---- Provenance

def _git(*arguments):
    try:
        ended = subprocess.run(["git", "-C", str(ROOT), *arguments], capture_output=True, text=True)
    except OSError:
        return None
    return ended.stdout.rstrip("\n") if ended.returncode == 0 else None


@functools.cache
def checked_out():
    """Returns the commit of the checkout, and True if files other than results, paper and pages differ."""
    commit = _git("rev-parse", "--verify", "HEAD")
    changes = _git("status", "--porcelain", "--", ":(top)", ":(top,exclude)results", ":(top,exclude)paper",
                   ":(top,exclude,glob)**/*.md")
    return commit or "unknown", None if commit is None or changes is None else bool(changes)


def check_may_be_kept(out, built):
    """Raises LabError if rows in `out` would be the project's and the program is not of a clean checkout."""
    results, path = (ROOT / "results").resolve(), pathlib.Path(out).resolve()
    if not path.is_relative_to(results) or path.relative_to(results).parts[:1] == ("local",):
        return
    commit, dirty = checked_out()
    if commit == "unknown" or dirty is None:
        why = "there is no git checkout to compare the program with"
    elif built["commit"] != commit:
        why = (f"this program was built from commit {built['commit'][:12]} while {commit[:12]} is checked "
               "out: build it again")
    elif built["dirty"] is not False:
        why = "this program was built from files that differ from its commit: commit and build it again"
    elif dirty:
        why = "files differ from the commit: commit them"
    else:
        return
    raise LabError(f"{out} takes only rows of a clean commit, and {why}; or pass another directory, such as "
                   f"results/local/{path.name}")


def provenance(built, threads):
    """Returns what identifies the program and the machine of a row, and the date."""
    commit, changed = checked_out()
    dirty = built["dirty"]
    if dirty is False:
        dirty = bool(changed) or commit not in ("unknown", built["commit"])
    cpu = re.search(r"^model name\s*: (.*)$", pathlib.Path("/proc/cpuinfo").read_text(), re.MULTILINE)
    system = os.uname()
    return {"commit": built["commit"], "dirty": dirty,
            "date": datetime.datetime.now(datetime.timezone.utc).strftime("%Y-%m-%dT%H:%M:%SZ"),
            "machine": {"cpu": cpu[1] if cpu else "unknown", "cores": os.sysconf("SC_NPROCESSORS_ONLN"),
                        "memory_bytes": os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"),
                        "system": f"{system.sysname} {system.release} {system.machine}"},
            "build": built["build"], "libraries": built["libraries"], "threads": threads}
