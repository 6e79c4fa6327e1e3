"""Joins the shards of an experiment (`hermesh run --shard`) to the rows of the whole; the command `merge`."""

import json
import os
import pathlib
import shutil
import sys

from . import tables
from .compare import compare_rows
from .program import check_may_be_kept, load_program
from .rows import LabError, append_rows, read_rows, text_at

_SAME = {  # keys of a manifest that all shards of a whole have in common
    "experiment": "different experiments", "tier": "different tiers",
    "file_sha256": "different states of the experiment file", "of": "different numbers of shards",
    "cells": "different cells", "commit": "different commits", "binary": "different programs",
    "threads": "runs with different numbers of threads"}


def read_manifest(directory):
    """Returns shard.json: the identity of the shard, and the cells (hash, name, shard) of the whole.

    Raises LabError if the directory has no valid one.
    """
    file = pathlib.Path(directory) / "shard.json"
    if not file.is_file():
        raise LabError(f"{directory} is no shard of an experiment: it has no shard.json, which "
                       "`hermesh run --shard` writes")
    try:
        manifest = json.loads(file.read_text())
        cells = [(cell, name, shard) for cell, name, shard in manifest["cells"]]
        return {key: manifest[key] for key in [*_SAME, "shard", "finished"]} | {"cells": cells}
    except (ValueError, TypeError, KeyError):
        raise LabError(f"{file} is torn or no manifest of a shard; run the shard again") from None


def merged_rows(shards):
    """Returns one row for each cell of the experiment, in the order of the experiment file.

    They are those of one run without shards, except for times and the like. All get the `run` of the first,
    so that they share tables; their own is stored as `shard_run`. Of several rows of a cell in one directory,
    the last counts. A shard may be given twice. Raises LabError for directories that are not shards of one
    whole, for missing shards and cells, and for a cell or an input that differs between two directories.
    """
    manifests = {shard: read_manifest(shard) for shard in shards}
    first = manifests[shards[0]]
    for shard, manifest in manifests.items():
        for key, what in _SAME.items():
            if manifest[key] != first[key]:
                raise LabError(f"{shards[0]} and {shard} are of {what} and cannot be merged")
    given = {manifest["shard"] for manifest in manifests.values()}
    if missing := [str(number) for number in range(1, first["of"] + 1) if number not in given]:
        raise LabError(f"missing of {first['of']} shards: {', '.join(missing)}; give the directories of all")
    rows = _found_rows(manifests)
    if missing := [f"{name} of shard {shard}" for cell, name, shard in first["cells"] if cell not in rows]:
        raise LabError(f"{len(missing)} of {len(first['cells'])} cells are missing, the first is "
                       f"{missing[0]}: run that shard again, to its end")
    merged = [rows[cell] for cell, _, _ in first["cells"]]
    runs = {"run": text_at(merged[0], "/run")} if merged else {}
    return [row if text_at(row, "/run") == runs["run"] else row | runs | {"shard_run": text_at(row, "/run")}
            for row in merged]


def _found_rows(manifests):
    """Returns {cell: row}; raises LabError if two shards disagree on a cell or on an input."""
    found, inputs = {}, {}
    for shard, manifest in manifests.items():
        own = _last_rows(pathlib.Path(shard) / "rows.jsonl", manifest["binary"])
        for cell, name, _ in manifest["cells"]:
            if cell not in own:
                continue
            row, other = found.setdefault(cell, (own[cell], shard))
            if other != shard and not _same_values(row, own[cell]):
                raise LabError(f"the cell {name} has other values in {shard} than in {other}")
            case, sha256 = text_at(own[cell], "/case/name"), text_at(own[cell], "/case/sha256")
            source = case, text_at(own[cell], "/sweep/value")
            if sha256 and inputs.setdefault(source, sha256) != sha256:
                raise LabError(f"the case {case} is another input in {shard} than in a shard before it")
    return {cell: row for cell, (row, _) in found.items()}


def _last_rows(file, binary):
    """Returns {cell: its last row} of the rows that the shard's program made; a shard may have no cells."""
    if not file.exists() or file.stat().st_size == 0:
        return {}
    return {text_at(row, "/cell"): row for row in read_rows(file) if text_at(row, "/binary") == binary}


def _same_values(a, b):
    """Returns True if the rows agree in all but times and memory, as those of one program and input do."""
    return (all(text_at(a, pointer) == text_at(b, pointer) for pointer in ("/failed", "/case/sha256"))
            and all(compare_rows([x], [y], tolerance=0, costs=False).fine() for x, y in ((a, b), (b, a))))


def _copy_in_one_step(source, target):
    """Copies a file under another name and renames it, so that a killed process leaves no half of it."""
    half = f"{target}.half"
    shutil.copy2(source, half)
    os.replace(half, target)


def merge_shards(out, shards, text):
    """Writes the merged rows to out/rows.jsonl, after all meshes and pictures, and draws the plots.

    Writes a summary to `text`. Raises LabError as merged_rows() does, and if `out` has rows below it or is in
    a shard.
    """
    for shard in shards:
        if out.resolve().is_relative_to(shard.resolve()):
            raise LabError(f"{out} is in the shard {shard}; pass another directory for the whole")
    for file in out.rglob("*.jsonl"):
        raise LabError(f"{out} has rows already: {file}")
    rows, half = merged_rows(shards), out / "rows.half"
    own_files = shutil.ignore_patterns("*.jsonl", "shard.json*")
    for shard in shards:
        shutil.copytree(shard, out, ignore=own_files, dirs_exist_ok=True, copy_function=_copy_in_one_step)
    half.unlink(missing_ok=True)
    append_rows(half, rows)
    half.rename(out / "rows.jsonl")
    tables.write_plots(read_rows(out), out, text)
    print(f"Rows: {out / 'rows.jsonl'}, {len(rows)} cells of {len(shards)} shards", file=text)
    tables.write_failures(rows, text)


def add_command(subparsers):
    parser = subparsers.add_parser(
        "merge", help="join the shards of an experiment (hermesh run --shard) to the rows of the whole; exit "
        "code 1 if a shard or a cell is missing, or if they are not of one program and file")
    parser.add_argument("out", metavar="OUT", type=pathlib.Path,
                        help="directory for the rows, meshes and pictures of all shards")
    parser.add_argument("shards", metavar="DIR", nargs="+", type=pathlib.Path,
                        help="directories of the shards, in any order")
    parser.set_defaults(function=run)


def run(arguments):
    check_may_be_kept(arguments.out, load_program().description)
    merge_shards(arguments.out, arguments.shards, sys.stdout)
    return 0
