"""Cases of experiments/cases.toml: which of them have a public source, and their download before a run."""

import csv
import functools
import os
import pathlib
import subprocess
import tomllib

from . import corpus
from .rows import ROOT

EXPERIMENTS = ROOT / "experiments"


@functools.cache
def catalogue():
    """Returns the cases by name, as cases.toml states them."""
    document = tomllib.loads((EXPERIMENTS / "cases.toml").read_text())
    return {case["name"]: case for case in document["case"]}


@functools.cache
def package_sizes():
    """Returns the bytes to download by kind and name of the package."""
    with open(EXPERIMENTS / "data/packages.tsv", newline="") as file:
        rows = csv.DictReader(file, delimiter="\t")
        return {(row["kind"], row["package"]): int(row["bytes"]) for row in rows}


def kind_of(case):
    return "volume" if "volume" in case else "file" if "files" in case else "generated"


def _base(name):
    """Returns the case, or the case that it is made from, as in cases.toml; {} for the path of a file."""
    case = catalogue().get(name, {})
    return catalogue().get(case.get("close_holes_of") or case.get("agree_faces_of"), case)


def _files(name):
    return _base(name).get("files", [])


def _stand_in(name):
    return _base(name).get("stand_in", "")


def is_private(name):
    """Returns True for a case whose files have no public source: only $HERMESH_DATA can provide them."""
    return bool(_files(name)) and not any("from" in file for file in _files(name))


def _package(file):
    """Returns the kind and the name of the package that has a file, e.g. ("npm", "bunny@1.0.1")."""
    return tuple(file["from"].split()[:2])


def _is_available(name):
    directories = filter(None, [os.environ.get("HERMESH_DATA"), corpus.cache_root()])
    return any(pathlib.Path(directory, file["file"]).exists()
               for directory in directories for file in _files(name))


def fetch(names, say):
    """Downloads the packages that hold the named cases, unless their files are available; calls `say` with
    the size first and with the cases that stand-ins will replace.

    Returns why packages could not be downloaded, or "".
    """
    missing = [name for name in dict.fromkeys(names) if _files(name) and not _is_available(name)]
    private = [name for name in missing if is_private(name)]
    if private:
        say("no public source, replaced by stand-ins: "
            + ", ".join(f"{name} ({_stand_in(name)})" for name in private)
            + "; put their files into the directory $HERMESH_DATA to use them")
    missing = [name for name in missing if name not in private]
    missing += [other for other in dict.fromkeys(map(_stand_in, private))
                if other not in missing and _files(other) and not _is_available(other)]
    wanted = {}
    for name in missing:
        for file in [file for file in _files(name) if "from" in file][:1]:
            wanted.setdefault(_package(file), file["file"])
    if not wanted:
        return ""
    if os.environ.get("HERMESH_OFFLINE"):
        reason = "HERMESH_OFFLINE is set"
    else:
        sizes = {package: package_sizes().get(package, 0) / 2**20 for package in wanted}
        say(f"downloading {sum(sizes.values()):.0f} MiB to {corpus.cache_root()}: "
            + ", ".join(f"{package[1]} ({size:.0f} MiB)" for package, size in sizes.items()))
        reason = "; ".join(filter(None, map(_fetch_file, wanted.values())))
    if absent := [name for name in missing if not _is_available(name)]:
        say(f"{reason}; replaced by stand-ins: {', '.join(absent)}")
    return reason


def _fetch_file(name):
    """Returns why a file, and all others of its package, could not be downloaded, or ""."""
    got = subprocess.run(["bash", EXPERIMENTS / "fetch_data.sh", name, corpus.cache_root()],
                         stdin=subprocess.DEVNULL, capture_output=True, text=True)
    if got.returncode == 0:
        return ""
    return (got.stderr.strip().splitlines() or [f"{name} could not be downloaded"])[-1]
