"""Rows as tables of SQL, so that a claim or a number of the text is a query that anyone can read and repeat.
"""

import pathlib
import re
import sqlite3
import statistics

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
    is the aggregate median().
    """

    def __init__(self):
        self.connection = sqlite3.connect(":memory:", isolation_level=None)
        self.connection.create_aggregate("median", 1, _Median)
        if hasattr(self.connection, "setconfig"):  # Python 3.12: a misspelt column must not pass for a text
            self.connection.setconfig(sqlite3.SQLITE_DBCONFIG_DQS_DML, False)
        self.tables = []
        self.rows_of = {}  # all rows of each table, earlier runs included

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
        columns = ", ".join('"' + column.replace('"', '""') + '"' for column in names.values())
        self.connection.execute(f'CREATE TABLE "{name}" ({columns})')
        marks = ", ".join("?" * len(names))
        self.connection.executemany(f'INSERT INTO "{name}" VALUES ({marks})',
                                    ([_bound(found.get(name)) for name in names]
                                     for found in map(values, shown)))
        self.tables.append(name)
        self.rows_of[name] = rows

    def add_directories(self, results):
        """Adds each directory directly below `results` that has a rows.jsonl, except "local"."""
        if not pathlib.Path(results).is_dir():
            raise LabError(f"there is no directory {results}")
        self.connection.execute("BEGIN")
        for file in sorted(pathlib.Path(results).glob("*/rows.jsonl")):
            if file.parent.name != "local":
                self.add(file.parent.name, read_rows(file))
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

    def tables_in(self, query):
        """Returns the sorted names of the tables that occur in a query."""
        return sorted(set(re.findall(r"\w+", query)) & set(self.tables))


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
