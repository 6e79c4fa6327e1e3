"""Rows of results/ as tables of SQL, as experiments/ledger/row_database.h describes them, with nothing but Python.

The columns are read from the sources of the program (columns.cpp, row_database.cpp), so that there is one list of them;
paper_test.py holds what comes out against the numbers that the program itself has filled into the project's pages.
"""

import hashlib
import json
import math
import pathlib
import re
import sqlite3
import statistics


class PaperError(Exception):
    """One clear sentence about what is wrong."""


def readable(value):
    """1234567 -> "1,234,567"; numbers that are not whole have three significant digits (columns.cpp)."""
    if not math.isfinite(value):
        return "nan" if math.isnan(value) else "inf" if value > 0 else "-inf"
    if abs(value) < 999.5 and value != round(value):
        return "%.3g" % value
    return f"{round(value):,}"


def find(row, pointer):
    """What a JSON pointer leads to; None where that is nothing, or null."""
    for part in pointer.split("/")[1:]:
        if isinstance(row, list):
            row = row[int(part)] if part.isdigit() and int(part) < len(row) else None
        elif isinstance(row, dict):
            row = row.get(part)
        else:
            return None
    return row


def text_at(row, pointer):
    value = find(row, pointer)
    return "" if value is None else value if isinstance(value, str) else json.dumps(value, sort_keys=True)


def read_columns(root):
    """[(name, pointer, unit)] of reports and [(name, pointer)] of every row, from the program's sources."""
    text = (root / "experiments/harness/columns.cpp").read_text()
    text = text[text.index("all_columns()"):text.index("column_names()")]
    string = r'"((?:[^"\\]|\\.)*)"'
    reports = [(m[1], m[4], m[5] or "") for m in re.finditer(
        r"\{" + string + r",\s*" + string + r",\s*((?:" + string.replace("(", "(?:", 1) + r"\s*)+),\s*" + '"(/[^"]*)"'
        + r"(?:,\s*Unit::k(\w+))?\}", text)]
    text = (root / "experiments/ledger/row_database.cpp").read_text()
    text = text[text.index("common_columns()"):text.index("quoted(")]
    common = re.findall(r'\{"(\w+)", "(/[\w/]+)"\}', text)
    if len(reports) != text_of_entries(root) or len(common) < 10:
        raise PaperError("paper/row_database.py does not understand the list of columns in experiments/harness/columns.cpp")
    return reports, common


def text_of_entries(root):
    """How many entries the list of columns has: lines that begin one."""
    text = (root / "experiments/harness/columns.cpp").read_text()
    return len(re.findall(r'^ {6}\{"', text[text.index("all_columns()"):text.index("column_names()")], re.M))


def latest_groups(rows):
    """The rows that `hermesh report` shows: of cells that ran several times the last run (table.cpp)."""
    runs = {}
    parts = ["/experiment", "/tier", "/case/name", "/resolution", "/voxelization/label", "/sweep/parameter"]
    for row in rows:
        groups = runs.setdefault(tuple(text_at(row, part) for part in parts), {})
        run = text_at(row, "/run")
        # The rows of an additive table are one group, in whatever order its runs stand in the file.
        of = "" if find(row, "/table/additive") is not None else run
        same = (text_at(row, "/variant/label"), find(row, "/values/resolution"))
        groups[of] = [old for old in groups.get(of, []) if text_at(old, "/run") == run or
                      (text_at(old, "/variant/label"), find(old, "/values/resolution")) != same]
        groups[of].append(row)
    shown = []
    for groups in runs.values():
        last = list(groups.values())[-1]
        if find(last[0], "/table/additive") is not None:
            labels = list(dict.fromkeys(text_at(row, "/variant/label") for row in last))
            last.sort(key=lambda row: labels.index(text_at(row, "/variant/label")))
        shown += last
    return shown


class Median:
    def __init__(self):
        self.numbers = []

    def step(self, value):
        if value is not None:
            self.numbers.append(float(value))

    def finalize(self):
        return statistics.median(self.numbers) if self.numbers else None


def is_stand_in(row):
    if text_at(row, "/case/origin").startswith("stand-in"):
        return 1
    return int(any(i.get("origin", "").startswith("stand-in") for i in find(row, "/inputs") or []))


def bound(value):
    if isinstance(value, bool):
        return int(value)
    return json.dumps(value, separators=(",", ":"), ensure_ascii=False) if isinstance(value, (dict, list)) else value


class RowDatabase:
    """A database in memory; each folder of results/ that has rows is a table of its name."""

    def __init__(self, root):
        self.root = pathlib.Path(root)
        self.connection = sqlite3.connect(":memory:")
        self.connection.create_aggregate("median", 1, Median)
        self.rows_of = {}
        self.reports, self.common = read_columns(self.root)
        for path in sorted((self.root / "results").glob("*/rows*.jsonl")):
            if path.parent.name != "local":
                rows = self.rows_of.setdefault(path.parent.name, [])
                rows += [json.loads(line) for line in path.read_text().splitlines() if line.strip()]
        for name, rows in self.rows_of.items():
            self._add(name, latest_groups(rows))

    def _value(self, row, own, name):
        low = name.lower()
        for column, pointer in own:
            if column.lower() == low and find(row, pointer) is not None:
                return find(row, pointer)
        if name == "row":
            return row
        if name == "stand_in":
            return is_stand_in(row)
        if name == "broken":
            return len(row.get("broken") or [])
        for column, pointer in self.common:
            if column == name and find(row, pointer) is not None:
                return find(row, pointer)
        for column, pointer, unit in self.reports:
            if column == name:
                value = find(row, pointer)
                if value is None:
                    return None
                return value / find(row, "/voxel_size") if unit == "Voxel" else value / 2**20 if unit == "Mebibyte" else value
        return None

    def value(self, row, name):
        """A column of one row, its own ones first; None where it has none."""
        own = [(c["name"], "/values/" + c["name"]) for c in find(row, "/table/columns") or []]
        return self._value(row, own, name)

    def _add(self, name, shown):
        names = {}
        for column, _ in self.common:
            names.setdefault(column.lower(), column)
        for column in ("stand_in", "broken", "row"):
            names.setdefault(column, column)
        for column, pointer, _ in self.reports:
            if any(find(row, pointer) is not None for row in shown):
                names.setdefault(column.lower(), column)
        for row in shown:
            for column in find(row, "/table/columns") or []:
                names.setdefault(column["name"].lower(), column["name"])
        columns = list(names.values())
        quoted = ", ".join('"' + c.replace('"', '""') + '"' for c in columns)
        self.connection.execute(f'CREATE TABLE "{name}" ({quoted})')
        for row in shown:
            own = [(c["name"], "/values/" + c["name"]) for c in find(row, "/table/columns") or []]
            self.connection.execute(f'INSERT INTO "{name}" VALUES ({", ".join("?" * len(columns))})',
                                    [bound(self._value(row, own, c)) for c in columns])

    def query(self, text, parameters=()):
        """(names of the columns, rows). Raises PaperError with SQLite's sentence."""
        try:
            cursor = self.connection.execute(text, parameters)
        except sqlite3.Error as error:
            raise PaperError(f"{error} in: {' '.join(text.split())}") from None
        return [d[0] for d in cursor.description], cursor.fetchall()

    def tables_in(self, query):
        return sorted(set(re.findall(r"\w+", query)) & set(self.rows_of))

    def untrusted(self, table):
        """Why the rows of a folder must not be cited, a sentence each; empty if they may."""
        path = self.root / "results" / "SHA256SUMS"
        sums = dict(reversed(line.split("  ", 1)) for line in path.read_text().splitlines()) if path.exists() else {}
        found = []
        for file in sorted((self.root / "results" / table).glob("rows*.jsonl")):
            name = f"{table}/{file.name}"
            if name not in sums:
                found.append(f"results/SHA256SUMS does not name {name}")
            elif hashlib.sha256(file.read_bytes()).hexdigest() != sums[name]:
                found.append(f"results/{name} differs from the hash in results/SHA256SUMS")
        dirty = sum(row.get("dirty") is not False for row in self.rows_of[table])
        if dirty:
            found.append(f"results/{table} has {dirty} rows of a tree with changes")
        if "stale" in self.rows_of:
            for difference, in self.query("SELECT difference FROM stale WHERE label = ? AND differing > 0", (table,))[1]:
                found.append(f"results/{table} is stale, the program no longer makes its rows ({difference})")
        return found
