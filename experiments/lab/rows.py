"""Rows of results: one JSON object per cell of an experiment, and the columns that are read from them
(columns.toml).
"""

import dataclasses
import functools
import json
import math
import os
import pathlib
import re
import tomllib

ROOT = pathlib.Path(__file__).resolve().parents[2]


class LabError(Exception):
    """An error that the user can mend; its text states what is wrong, where, and what to do."""


def shown(value, limit=60):
    """Returns a value from a file as part of a message: short, and without control characters."""
    text = re.sub(r"[\x00-\x1f\x7f-\x9f\ud800-\udfff]+", "?", str(value))
    return text if len(text) <= limit else text[:limit] + "..."


@dataclasses.dataclass(frozen=True)
class Column:
    name: str
    header: str
    meaning: str
    pointer: str
    unit: str = ""  # "voxel", "mebibyte", "guarantees" or ""


@functools.cache
def _schema():
    schema = tomllib.loads((pathlib.Path(__file__).parent / "columns.toml").read_text())
    return schema["common"], [Column(**column) for column in schema["column"]]


def common_columns():
    """Returns {name: pointer} of the columns that every table of SQL has."""
    return _schema()[0]


def all_columns():
    """Returns the columns that an experiment file may name, in the order of the CSV report."""
    return _schema()[1]


def own_columns(row):
    """Returns the columns that a row of a measurement brings along; none for other rows."""
    columns = find(row, "/table/columns") or []
    return [Column(c["name"], c["header"], c["meaning"], "/values/" + c["name"]) for c in columns]


def find(row, pointer):
    """Returns the value that a JSON pointer leads to; None if there is none, or if it is null."""
    for part in pointer.split("/")[1:]:
        if isinstance(row, list):
            row = row[int(part)] if part.isdigit() and int(part) < len(row) else None
        elif isinstance(row, dict):
            row = row.get(part)
        else:
            return None
    return row


def number_at(row, pointer):
    """Returns the number at a pointer, 0 if there is none."""
    value = find(row, pointer)
    return value if isinstance(value, (int, float)) and not isinstance(value, bool) else 0.0


def text_at(row, pointer):
    """Returns a text unchanged, any other value as JSON, and "" if there is none."""
    value = find(row, pointer)
    return "" if value is None else value if isinstance(value, str) else to_json(value)


def to_json(value):
    """Returns JSON on one line without spaces, as rows are stored."""
    return json.dumps(value, separators=(",", ":"), ensure_ascii=False)


def value_of(column, row):
    """Returns the column's value in its unit, None if the row has none."""
    value = find(row, column.pointer)
    if value is None or column.unit not in ("voxel", "mebibyte"):
        return value
    return value / (find(row, "/voxel_size") if column.unit == "voxel" else 2**20)


def cell_text(column, row):
    """Returns the column's value for a reader, "–" if the row has none."""
    value = value_of(column, row)
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return readable(value)
    if column.unit == "guarantees":
        return guarantees_text(value)
    return value if isinstance(value, str) else "–"


def guarantees_text(letters):
    """Returns the words of "cmoi kept": closed, manifold, oriented, no self-intersection: verified."""
    names = {"c": "closed", "m": "manifold", "o": "oriented", "i": "no self-intersection"}
    verdicts = {"kept": "verified", "BROKEN": "VIOLATED", "unchecked": "not checked"}
    found, _, verdict = (letters or "–").partition(" ")
    if verdict not in verdicts or set(found) - set(names):
        return letters or "–"
    return f"{', '.join(names[letter] for letter in found)}: {verdicts[verdict]}"


def readable(value):
    """1234567 -> "1,234,567"; numbers that are not whole get three significant digits."""
    if not math.isfinite(value):
        return "nan" if math.isnan(value) else "inf" if value > 0 else "-inf"
    if abs(value) < 999.5 and value != round(value):
        return "%.3g" % value
    return f"{value:,.0f}"


def is_stand_in(row):
    """Returns True if an input of the row is a generated stand-in for a model that was not available."""
    origins = [text_at(row, "/case/origin")] + [i.get("origin", "") for i in find(row, "/inputs") or []]
    return any(origin.startswith("stand-in") for origin in origins)


def read_rows(path):
    """Returns all rows of the .jsonl files below a directory, in the order of their paths, or of one file.

    Raises LabError if there are none, or if a line is not a row.
    """
    path = pathlib.Path(path)
    files = [path] if path.is_file() else sorted(path.rglob("*.jsonl"), key=lambda p: p.parts)
    rows = []
    for file in files:
        for number, line in enumerate(file.read_text(errors="replace").split("\n"), 1):
            if line:
                rows.append(_row(line, f"{file}:{number}"))
    if not rows:
        raise LabError(f"there are no rows of results (*.jsonl) under {path}; `hermesh run` writes them")
    return rows


def _row(line, where):
    try:
        row = json.loads(line)
    except ValueError:
        row = None
    if not isinstance(row, dict) or "variant" not in row or "case" not in row:
        raise LabError(f"{where}: this line is not a row of results")
    return row


def append_rows(file, rows):
    """Appends rows with one system call, so that concurrent runs do not tear each other's lines."""
    data = "".join(to_json(row) + "\n" for row in rows).encode(errors="replace")
    descriptor = os.open(file, os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_CLOEXEC, 0o644)
    try:
        if (written := os.write(descriptor, data)) != len(data):
            # No half of a row stays behind, unless another run has appended to it.
            end = os.lseek(descriptor, 0, os.SEEK_CUR)
            if os.fstat(descriptor).st_size == end:
                os.ftruncate(descriptor, end - written)
            raise LabError(f"cannot append rows to {file}: the disk is full")
    finally:
        os.close(descriptor)


def drop_torn_row(file):
    """Removes an unfinished last line, which a killed program leaves; returns True if there was one."""
    data = pathlib.Path(file).read_bytes()
    if not data or data.endswith(b"\n"):
        return False
    os.truncate(file, data.rfind(b"\n") + 1)
    return True


@dataclasses.dataclass
class RowGroup:
    """The rows of one table: same experiment, tier, run, case, resolution and voxelizer, in the variants'
    order.
    """

    rows: list
    # number of groups that differ from this one only in the run, and are not part of it
    earlier_runs: int = 0


def latest_groups(rows):
    """Returns the groups in the order in which they first appear; of several runs of a group, the last.

    In an additive table (/table/additive), rows replace those of earlier runs that have the same label and
    resolution, and are added to all others; rows with the same label are moved next to each other.
    """
    runs = {}
    parts = ["/experiment", "/tier", "/case/name", "/resolution", "/voxelization/label", "/sweep/parameter"]
    for row in rows:
        groups = runs.setdefault(tuple(text_at(row, part) for part in parts), {})
        run = text_at(row, "/run")
        of = "" if find(row, "/table/additive") is not None else run
        group = groups.setdefault(of, RowGroup([], len(groups)))
        same = (text_at(row, "/variant/label"), find(row, "/values/resolution"))
        group.rows = [old for old in group.rows if text_at(old, "/run") == run
                      or (text_at(old, "/variant/label"), find(old, "/values/resolution")) != same]
        group.rows.append(row)
    result = []
    for groups in runs.values():
        last = list(groups.values())[-1]
        if find(last.rows[0], "/table/additive") is not None:
            first = {}
            for at, row in enumerate(last.rows):
                first.setdefault(text_at(row, "/variant/label"), at)
            last.rows.sort(key=lambda row: first[text_at(row, "/variant/label")])
        result.append(last)
    return result
