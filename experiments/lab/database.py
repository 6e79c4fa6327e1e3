"""Rows as tables of SQL, so that a claim or a number of the text is a query that anyone can read and repeat.
"""

import pathlib
import re
import sqlite3
import statistics

from . import rates
from .rows import (LabError, all_columns, common_columns, find, is_stand_in, latest_groups, own_columns,
                   read_rows, to_json, value_of)


class _Median:
    def __init__(self):
        self.numbers = []

    def step(self, value):
        if value is not None:
            self.numbers.append(float(value))

    def finalize(self):
        return statistics.median(self.numbers) if self.numbers else None


class RowDatabase:
    """An SQLite database in memory. Each directory of rows is a table with its name.

    Of cells that ran several times, a table has the last run (latest_groups). Its columns are the common ones
    of columns.toml, stand_in, broken (number of broken guarantees) and row (all of it as JSON), then the
    columns of reports that some row has, then those that measurements bring along; a measurement's column
    replaces one of the same name. Missing values are NULL, true is 1. In addition to SQLite's functions there
    are the aggregate median() and rate(count, of), a percentage with its Wilson interval at 95 % as text.

    Rows of a benchmark (rates.py) are a table as well, with the columns done, valid, near and fails_a_claim,
    and those of the models; the names of their other columns have _ for spaces.
    """

    def __init__(self):
        self.connection = sqlite3.connect(":memory:", isolation_level=None)
        self.connection.create_aggregate("median", 1, _Median)
        self.connection.create_function("rate", 2, rates.rate, deterministic=True)
        if hasattr(self.connection, "setconfig"):  # Python 3.12: a misspelt column must not pass for a text
            self.connection.setconfig(sqlite3.SQLITE_DBCONFIG_DQS_DML, False)
        self.tables = []
        self.rows_of = {}  # all rows of each table, earlier runs included
        self.benchmarks = []  # tables of benchmarks, which are not in `tables`

    def add(self, name, rows):
        """Adds the table `name`. Raises LabError if there is one of that name."""
        if name in self.tables:
            raise LabError(f"there is a table {name} already")
        shown = [row for group in latest_groups(rows) for row in group.rows]
        names = {}  # SQL does not distinguish upper and lower case
        for column in [*common_columns(), "stand_in", "broken", "row"]:
            names.setdefault(column.lower(), column)
        for column in all_columns():
            if any(find(row, column.pointer) is not None for row in shown):
                names.setdefault(column.name.lower(), column.name)
        for row in shown:
            for column in own_columns(row):
                names.setdefault(column.name.lower(), column.name)
        self._create(name, names, map(values, shown))
        self.tables.append(name)
        self.rows_of[name] = rows

    def _create(self, table, names, rows):
        """Creates a table; `names` maps the keys of the rows to the names of the columns."""
        columns = ", ".join('"' + column.replace('"', '""') + '"' for column in names.values())
        self.connection.execute(f'CREATE TABLE "{table}" ({columns})')
        marks = ", ".join("?" * len(names))
        self.connection.executemany(f'INSERT INTO "{table}" VALUES ({marks})',
                                    ([_bound(row.get(name)) for name in names] for row in rows))

    def add_benchmark(self, directory):
        """Adds the rows of a benchmark as a table with the name of the directory."""
        rows = rates.counted(rates.read_with_models(directory))
        names = {key: key.replace(" ", "_") for row in rows for key in row}
        self._create(directory.name, names, rows)
        self.benchmarks.append(directory.name)

    def add_directories(self, results):
        """Adds each directory directly below `results` that has rows, except "local"."""
        if not pathlib.Path(results).is_dir():
            raise LabError(f"there is no directory {results}")
        self.connection.execute("BEGIN")
        for file in sorted(pathlib.Path(results).glob("*/rows.jsonl")):
            if file.parent.name != "local":
                self.add(file.parent.name, read_rows(file))
        for directory in sorted({file.parent for file in pathlib.Path(results).glob("*/rows*.ndjson")}):
            self.add_benchmark(directory)
        self.connection.execute("COMMIT")

    def query(self, text, bound={}):
        """Returns (names of the columns, rows). Raises LabError with SQLite's message."""
        try:
            cursor = self.connection.execute(text, {name: _bound(v) for name, v in bound.items()})
        except (sqlite3.Error, sqlite3.Warning) as error:
            raise LabError(f"{error} in: {text}") from None
        return [d[0] for d in cursor.description or []], cursor.fetchall()

    def first_row(self, text, bound={}):
        """Returns the first row of a query as a dict, {} if it gives none."""
        names, rows = self.query(text, bound)
        return dict(zip(names, rows[0])) if rows else {}

    def execute(self, statement):
        """Runs a statement that changes rows; returns how many it changed."""
        try:
            return self.connection.execute(statement).rowcount
        except (sqlite3.Error, sqlite3.Warning) as error:
            raise LabError(f"{error} in: {statement}") from None

    def has_changed_tree(self, table):
        """Returns True if a row was made by a program whose commit had changes."""
        condition = "dirty IS NOT 0"
        if table in self.benchmarks:
            condition = "\"commit\" IS NULL OR \"commit\" LIKE '% %'"
        return bool(self.first_row(f'SELECT 1 FROM "{table}" WHERE {condition}'))

    def tables_in(self, query):
        """Returns the sorted names of the tables that occur in a query."""
        return sorted(set(re.findall(r"\w+", query)) & {*self.tables, *self.benchmarks})


def value(row, name):
    """Returns the value of a table's column for one row, None if it has none."""
    return values(row).get(name.lower())


def values(row):
    """Returns {column name in lower case: value} of all columns that a row has."""
    found = {column.name.lower(): value_of(column, row) for column in all_columns()}
    common = {name.lower(): find(row, pointer) for name, pointer in common_columns().items()}
    common |= {"stand_in": is_stand_in(row), "broken": len(row.get("broken", [])), "row": row}
    own = {column.name.lower(): value_of(column, row) for column in own_columns(row)}
    for more in (common, own):
        found |= {name: each for name, each in more.items() if each is not None}
    return found


def _bound(value):
    return (int(value) if isinstance(value, bool) else to_json(value) if isinstance(value, (dict, list))
            else value)
