"""Comparison of two sets of rows, a baseline and a candidate: which cells changed, and which became worse."""

import argparse
import collections
import copy
import dataclasses
import functools
import json
import pathlib
import re
import statistics
import sys
from xml.sax import saxutils

from .rows import (Column, all_columns, find, latest_groups, number_at, own_columns, read_rows, text_at,
                   to_json, value_of)

# A floating-point value cannot become worse by less than this, in the unit of its column: single precision
# stores a position to about a millionth of a voxel.
FLOOR = 1e-6
# Times differ if p of the rank test is below LARGEST_P and one median is more than SLOWER times the other.
LARGEST_P, SLOWER, FEWEST_REPETITIONS = 0.01, 1.1, 5
# Memory is counted in pages, and allocators request more than the program does.
MORE_MEMORY, LEAST_MEBIBYTES = 1.2, 1.0
COSTS = ("time", "memory")
# The largest number of values per side for which the rank test counts the distribution.
COUNTED = 20

# A column is of the first class whose pattern its name begins with, or whose pattern is in its header.
_NEVER = "(?!)"
_CLASSES = (
    ("exact", "printed|published|expected", _NEVER),
    ("derived", "(ns|repetitions|ways|bytes_per_voxel)$|ns_per|level_1|level_2|.*(speedup|efficiency|shortest"
     "|_least|gigabytes|seconds_of|_over_|cpu_|judge_seconds|seconds_min)",
     "times as fast|÷ bandwidth|GB/s|ns/|µs/"),
    ("time", _NEVER, r"\[(s|ms|µs|ns)\]"),
    ("memory", ".*(peak|resident)", _NEVER),
    ("derived", "(.*_)?(slope|order)_(low|high)$", _NEVER),
    ("slope", "(.*_)?(slope|order)$", _NEVER))
_SMALLER_IS_WORSE = re.compile(".*(smallest_angle|precision|recall|held)")
_LARGER_IS_WORSE = re.compile("(median|p95|p99)$|.*(rms|mean|max|error|excess|largest|escape|lost|missed"
                              "|wrong|difference|aspect|length_off|bytes|mib)")


# ---- Classes of values.

def class_of(column, value, row):
    """Returns the class of a column's value, which determines how two values are compared.

    "exact" (counts, texts, truth values, printed values), "error" (floating point, and None), "slope" (of a
    fit, with an interval), "time" (of repetitions), "memory" (peaks of resident memory), or "derived" (of
    times or of the machine, without new information). The unit in the column's header, its name, and the type
    of the value determine the class.
    """
    named = _class_by_name(column)
    if named == "slope" and None in (find(row, column.pointer + end) for end in ("_low", "_high")):
        named = ""
    return named or ("error" if value is None or isinstance(value, float) else "exact")


@functools.cache
def _class_by_name(column):
    return next((named for named, name, header in _CLASSES
                 if re.match(name, column.name) or re.search(header, column.header)), "")


def worse_of(column):
    """Returns "larger" for errors and losses, "smaller" for angles and hits, otherwise "either"."""
    if _SMALLER_IS_WORSE.match(column.name):
        return "smaller"
    is_size = re.search(r"MiB|KiB|\[B\]|B/", column.header)
    return "larger" if is_size or _LARGER_IS_WORSE.match(column.name) else "either"


def is_count(column, value):
    """Returns True if a number is whole, not 0, and has no unit: a count that is stored as floating point."""
    return abs(value) >= 1 and float(value).is_integer() and not re.search(r"\[|%|B/|MiB", column.header)


# ---- The test of times.

def rank_test(a, b):
    """Returns p of the two-sided U test of Mann and Whitney (1947).

    Up to 20 values per side, p is exact, also with ties: scipy's exact method assumes that there are none,
    and its permutation test would list up to 10^11 choices. Beyond that, p is of the normal distribution.
    """
    import numpy  # here because the import takes longer than most commands
    from scipy import stats
    if max(len(a), len(b)) > COUNTED:
        with numpy.errstate(divide="ignore"):  # all values are equal
            return float(stats.mannwhitneyu(a, b, method="asymptotic").pvalue)
    ranks = (2 * stats.rankdata([*a, *b])).astype(int)  # doubled, because ties share the mean of their ranks
    # ways[k, s]: number of choices of k of the ranks so far that have the sum s.
    ways = numpy.zeros((len(a) + 1, ranks.sum() + 1), dtype=int)
    ways[0, 0] = 1
    for rank in ranks:
        ways[1:, rank:] += ways[:-1, :-rank]
    deviations = abs(numpy.arange(ways.shape[1]) - len(a) * (len(ranks) + 1))
    as_far = deviations >= deviations[ranks[:len(a)].sum()]
    return float(ways[-1, as_far].sum() / ways[-1].sum())


# ---- Cells.

@dataclasses.dataclass
class Cell:
    place: str  # everything but the labels
    labels: str  # of the voxelizer and the variant
    row: dict
    which: str = ""  # distinguishes rows that agree in both

    @property
    def name(self):
        return self.place + self.labels + self.which


def _cell_of(row):
    size = "/nominal_voxel_size" if find(row, "/resolution") is None else "/resolution"
    tier, case, *numbers, parameter, swept, voxelizer, variant = (text_at(row, part) for part in (
        "/tier", "/case/name", size, "/values/resolution", "/sweep/parameter", "/sweep/value",
        "/voxelization/label", "/variant/label"))
    place = text_at(row, "/experiment") + (tier and ", " + tier) + ": " + case
    place += _joined(*numbers, swept and parameter + " " + swept)
    return Cell(place, _joined(voxelizer, variant), row)


def _joined(*parts):
    return "".join(" / " + part for part in parts if part)


def _cells_of(rows, pooled):
    cells = [_cell_of(row) for group in latest_groups(rows) for row in group.rows]
    return _pooled(cells, rows) if pooled else cells


def _pooled(cells, rows):
    """Returns the cells with the repetitions of all rows of their name that are from the same machine."""
    runs = collections.defaultdict(list)
    for row in rows:
        runs[_cell_of(row).name].append(row)
    result = []
    for cell in cells:
        row = copy.deepcopy(cell.row)
        for place in ("/seconds", "/voxelization/seconds"):
            repetitions = [_repetitions(run, place) for run in runs[cell.name] if _same_machine(run, row)]
            if any(repetitions) and _repetitions(row, place):
                medians = [statistics.median(run) for run in repetitions if run]
                find(row, place).update({"all": sum(repetitions, []), "medians_of_runs": medians})
        result.append(dataclasses.replace(cell, row=row))
    return result


def _repetitions(row, place):
    return find(row, place + "/all") or []


def _same(a, b, pointer):
    return text_at(a, pointer) == text_at(b, pointer)


def _same_machine(a, b):
    return find(a, "/machine/cpu") is not None and all(
        _same(a, b, part) for part in ("/machine/cpu", "/machine/cores", "/threads"))


def _distinguish(before, after):
    """Sets Cell.which where several cells of a side have one name."""
    named = collections.defaultdict(lambda: ([], []))
    for side, cells in enumerate((before, after)):
        for cell in cells:
            named[cell.name][side].append(cell)
    for sides in named.values():
        if max(map(len, sides)) > 1:
            axis = _axis(sides)
            for cells in sides:
                for at, cell in enumerate(cells, 1):
                    cell.which = f" / {axis.name} {text_at(cell.row, axis.pointer)}" if axis else f" #{at}"


def _axis(sides):
    """Returns the column that matches most cells of both sides by distinct values, None if no column does."""
    def matched(column):
        values = [{text_at(cell.row, column.pointer) for cell in cells} - {""} for cells in sides]
        are_distinct = all(len(found) == len(cells) for found, cells in zip(values, sides))
        return len(values[0] & values[1]) if are_distinct else 0

    columns = [column for column in own_columns((sides[0] + sides[1])[0].row)
               if _class_by_name(column) not in (*COSTS, "derived")]
    best = max(columns, key=matched, default=None)
    return best if best and matched(best) else None


# ---- Verdicts.

@dataclasses.dataclass
class CellVerdict:
    cell: str  # name, "headline, quick: dragon / 400 / hermesh / openvdb"
    state: str = "both"  # or "missing", "new", "renamed"
    label: str = ""  # labels of a renamed cell in the candidate
    compared: int = 0  # number of values
    regressions: list = dataclasses.field(default_factory=list)  # messages
    better: list = dataclasses.field(default_factory=list)


@dataclasses.dataclass
class Comparison:
    tolerance: float
    allow_missing: bool
    cells: list  # of CellVerdict, in the baseline's order, new cells at the end
    notes: list  # what was not compared and why, each once with the number of cells

    def reason(self, cell):
        """Returns in one line why a cell is a regression, "" if it is not."""
        gone = {"missing": ["the candidate has no row of it"], "renamed": ["it is called " + cell.label]}
        is_regression = cell.regressions or (cell.state in gone and not self.allow_missing)
        return "; ".join(gone.get(cell.state, []) + cell.regressions) if is_regression else ""

    def counts(self):
        """Returns {what: number}, in the order in which they are written."""
        states = collections.Counter(cell.state for cell in self.cells)
        return {"cells_compared": states["both"] + states["renamed"],
                "values_compared": sum(cell.compared for cell in self.cells),
                "regressions": sum(bool(self.reason(cell)) for cell in self.cells),
                "better": sum(bool(cell.better) for cell in self.cells),
                **{state: states[state] for state in ("missing", "renamed", "new")}}

    def fine(self):
        """Returns True if values were compared and none became worse."""
        return self.counts()["regressions"] == 0 and self.counts()["values_compared"] > 0


def compare_rows(baseline, candidate, tolerance=0.01, costs=True, pool=False, allow_missing=False):
    """Returns the Comparison of two lists of rows.

    `tolerance` is of errors, relative to the baseline's; `costs` compares times and memory; `pool` uses the
    repetitions of all runs of a cell, not only of the last run. With `allow_missing`, missing and renamed
    cells are no regression.

    Of several runs of a cell, the last counts (latest_groups). Cells are matched by experiment, tier, case or
    table, resolution or voxel size, swept value, voxelizer and label; if a measurement has several rows of
    one label, also by the column that distinguishes them (threads, bins). A missing and a new cell are one
    renamed cell if they differ only in the label, and agree in variant and options, or in the digest. If the
    inputs differ, that is a regression and nothing else is compared. Values are compared by class_of:

    - exact: also options, guarantees and failures. Options and columns of one side only are noted.
    - error: a change for the worse by more than the tolerance and FLOOR is a regression.
    - slope: a regression if the intervals do not overlap.
    - time: a regression by LARGEST_P and SLOWER, only on one machine (CPU, cores, threads). All pooled runs
      of one side must also be slower than all of the other: repetitions of a run are disturbed together.
    - memory: a regression by MORE_MEMORY and LEAST_MEBIBYTES, only on one machine.
    """
    before, after = _cells_of(baseline, pool), _cells_of(candidate, pool)
    _distinguish(before, after)
    added = {cell.name: cell for cell in sorted(after, key=lambda cell: cell.name)}
    partners = [added.pop(cell.name, None) for cell in before]
    verdicts, notes, grids = [], collections.Counter(), set()
    for cell, partner in zip(before, partners):
        verdict = CellVerdict(cell.name, "both" if partner else "missing")
        if not partner and (partner := _renamed(cell, added)):
            verdict.state, verdict.label = "renamed", partner.labels.removeprefix(" / ")
            del added[partner.name]
        if partner:
            grid = cell.place + text_at(cell.row, "/voxelization/label")
            _Judge((cell.row, partner.row), tolerance, costs, grid not in grids, verdict, notes).judge()
            grids.add(grid)
        verdicts.append(verdict)
    verdicts += [CellVerdict(cell.name, "new") for cell in after if cell.name in added]
    return Comparison(tolerance, allow_missing, verdicts,
                      [f"{note} ({_some(count, 'cell')})" for note, count in notes.items()])


def _some(count, word):
    return f"{count} {word}{'s' * (count != 1)}"


def _renamed(missing, added):
    """Returns the new cell that is a missing one under another label, None if there is none."""
    near = [cell for cell in added.values() if (cell.place, cell.which) == (missing.place, missing.which)]
    return next((cell for key in (_made_by, _digest) for cell in near
                 if key(missing.row) == key(cell.row) != ""), None)


def _made_by(row):
    """Returns names and options of the variant and the voxelizer, "" for measurements."""
    parts = ("/variant/name", "/variant/options", "/voxelization/name", "/voxelization/options")
    is_measured = find(row, "/measurement") is not None
    return "" if is_measured else "".join(text_at(row, part) + "\n" for part in parts)


def _digest(row):
    return text_at(row, "/digest") or text_at(row, "/values/digest")


# ---- Comparison of two rows.

def options_in(canonical):
    """Returns {option: value} of "a=1 b=2 3": words without "=" belong to the value before them."""
    options, key = {}, None
    for word in canonical.split():
        name, equals, value = word.partition("=")
        if equals:
            key = name
            options[key] = value
        elif key is not None:
            options[key] += " " + word
    return dict(sorted(options.items()))


def _shown(value):
    return f"{value:.6g}" if isinstance(value, float) else value if isinstance(value, str) else to_json(value)


def _column_at(pointer):
    """Returns a column for a value that is not in columns.toml."""
    return Column(pointer[1:], "", "", pointer)


def _messages_at(row, pointer):
    found = find(row, pointer) or []
    return set(found) if isinstance(found, list) else {found if isinstance(found, str) else ""}


@dataclasses.dataclass
class _Judge:
    """Compares the two rows of a cell, and records the result in its verdict."""

    rows: tuple  # of the baseline and the candidate
    tolerance: float
    costs: bool
    first_of_grid: bool
    verdict: CellVerdict
    notes: collections.Counter  # of cells by note

    def judge(self):
        before, after = self.rows
        if other := self.other_input():
            return self.verdict.regressions.append(other)
        self.compare_options()
        if not self.both_succeeded():
            return
        self.compare_guarantees()
        columns = [_column_at("/digest"), _column_at("/voxelization/digest")]
        if find(before, "/measurement") is None:
            columns += [column for column in all_columns() if column.name not in ("options", "promises")]
        else:
            columns += own_columns(before)
            names = {column.name for column in columns}
            columns += [column for column in own_columns(after) if column.name not in names]
        for column in columns:
            self.compare_column(column)
        if find(before, "/measurement") is None:
            self.compare_counts("/report")

    def both(self, pointer):
        return all(find(row, pointer) is not None for row in self.rows)

    def changed(self, worse, message):
        (self.verdict.regressions if worse else self.verdict.better).append(message)

    def changed_number(self, worse, name, was, now, unit="", more=""):
        percent = f" ({100 * (now - was) / abs(was):+.1f} %)" if was else ""
        self.changed(worse, f"{name} was {was:.6g}{unit}, now {now:.6g}{unit}{percent}{more}")

    def differs(self, what, was, now):
        self.changed(True, f"{what} was {was or 'nothing'}, now {now or 'nothing'}")

    def note_alone(self, what, is_of_baseline):
        self.notes[f"the {'baseline' if is_of_baseline else 'candidate'} alone has {what}"] += 1

    def other_input(self):
        """Returns which input differs, "" if none does."""
        if self.both("/case/sha256") and not _same(*self.rows, "/case/sha256"):
            return "the input is another: " + ", now ".join(
                text_at(row, "/case/origin") + " " + text_at(row, "/case/sha256")[:12] for row in self.rows)
        ours, theirs = ([[text_at(entry, part) for part in ("/name", "/sha256")]
                         for entry in find(row, "/inputs") or []] for row in self.rows)
        others = [name for name, was in ours for other, now in theirs if name == other and was != now]
        return f"the input {others[0]} is another" if others else ""

    def compare_options(self):
        """Compares the options, and what the validation depends on."""
        for pointer in ("/variant/name", "/voxelization/name", "/voxel_size", "/samples", "/band/exterior",
                        "/band/interior", "/judged_by/signs", "/judged_by/solid", "/measurement/name",
                        "/measurement/seed"):
            if self.both(pointer) and not _same(*self.rows, pointer):
                self.differs(pointer[1:], *(text_at(row, pointer) for row in self.rows))
        for pointer in ("/variant/options", "/voxelization/options", "/measurement/parameters"):
            ours, theirs = (options_in(text_at(row, pointer)) for row in self.rows)
            for option in ours | theirs:
                if option in ("repetitions", "pixels"):  # of times and pictures
                    continue
                if option not in ours or option not in theirs:
                    self.note_alone(f"the option {option}", option in ours)
                elif ours[option] != theirs[option]:
                    self.differs(f"the option {option}", ours[option], theirs[option])

    def both_succeeded(self):
        failed, fails = (text_at(row, "/failed") for row in self.rows)
        self.verdict.compared += 1
        if fails and not failed:
            self.changed(True, "fails: " + fails)
        elif failed and not fails:
            self.changed(False, "no longer fails; it did with: " + failed)
        elif failed != fails:
            self.notes["fails as before, with another sentence"] += 1
        return not failed and not fails

    def compare_guarantees(self):
        """Messages on what a row lacks may become fewer, but not more, and may not change."""
        for pointer, what in (("/broken", "broken: "), ("/unchecked", "no longer checked: the promise of "),
                              ("/disagreements", "disagreement of the judges: "),
                              ("/not_judged", "not judged: "),
                              ("/repetitions_differ", "repetitions differ from each other")):
            ours, theirs = (_messages_at(row, pointer) for row in self.rows)
            self.verdict.compared += 1
            self.verdict.regressions += [what + message for message in sorted(theirs - ours)]
            self.verdict.better += ["no longer " + (f"{pointer[1:]}: {message}" if message else what)
                                    for message in sorted(ours - theirs)]
        if self.both("/variant/promises"):
            self.compare_column(_column_at("/variant/promises"))
        # The letters repeat what is broken, which the messages above cover if something was broken before.
        if not any(_messages_at(self.rows[0], pointer) for pointer in ("/broken", "/unchecked")):
            self.compare_column(_column_at("/promise_letters"))

    def compare_counts(self, pointer):
        """Compares the whole numbers and truth values of a report that are not columns."""
        ours, theirs = (find(row, pointer) for row in self.rows)
        if isinstance(ours, dict) and isinstance(theirs, dict):
            for key in ours:
                # Samples follow from the vertices. Libraries repeat counts; their disagreements are compared.
                if key not in ("libraries", "samples"):
                    self.compare_counts(f"{pointer}/{key}")
        elif isinstance(ours, int) and all(column.pointer != pointer for column in all_columns()):
            self.compare_column(_column_at(pointer))

    def compare_column(self, column):
        """Compares a column's values by their class."""
        known = [value for row in self.rows if (value := find(row, column.pointer)) is not None]
        if not known:
            return
        # A number that is whole on one side only is an error, not a count.
        classes = {class_of(column, value, row) for value, row in zip((known[0], known[-1]), self.rows)}
        value_class = classes.pop() if len(classes) == 1 else "error"
        if value_class == "derived" or (value_class in COSTS and not self.is_compared(column, value_class)):
            return
        if value_class == "time" or self.both_have(column):
            getattr(self, value_class)(column)

    def is_compared(self, column, value_class):
        """Returns True if a time or memory can be compared, and notes why if not."""
        if not self.costs or (column.pointer.startswith("/voxelization/") and not self.first_of_grid):
            return False  # costs of a grid are reported with the first mesh that was made from it
        why = "" if _same_machine(*self.rows) else "other machine"
        if value_class == "time" and not column.pointer.endswith("seconds/median"):
            why = "no repetitions"
        if why:
            self.notes[f"{column.name} not compared: {why}"] += 1
        return not why

    def both_have(self, column):
        """Returns True if both sides have a value. One that became null is a change, an absent one a note."""
        was, now = (find(row, column.pointer) for row in self.rows)
        parent, _, key = column.pointer.rpartition("/")
        if now is None and key in (find(self.rows[1], parent) or {}):
            self.differs(column.name, _shown(value_of(column, self.rows[0])), "")
        elif was is None or now is None:
            self.note_alone(column.name, now is None)
        return was is not None and now is not None

    def exact(self, column):
        self.verdict.compared += 1
        ours, theirs = (find(row, column.pointer) for row in self.rows)
        if ours == theirs and isinstance(ours, bool) == isinstance(theirs, bool):
            return
        failed, fails = (str(value).startswith("failed") for value in (ours, theirs))
        if failed and fails:
            self.notes["fails as before, with another sentence"] += 1
        elif failed:
            self.changed(False, f"{column.name} is no longer: {ours}")
        else:
            self.differs(column.name, *(_shown(value_of(column, row)) for row in self.rows))

    def error(self, column):
        was, now = (value_of(column, row) for row in self.rows)
        are_numbers = all(isinstance(value, (int, float)) for value in (was, now))
        if not are_numbers or (is_count(column, was) and is_count(column, now)):
            return self.exact(column)
        self.verdict.compared += 1
        worse_by = {"larger": now - was, "smaller": was - now, "either": abs(now - was)}[worse_of(column)]
        if abs(worse_by) > max(FLOOR, self.tolerance * abs(was)):
            self.changed_number(worse_by > 0, column.name, was, now)

    def slope(self, column):
        was, now = ([number_at(row, column.pointer + end) for end in ("", "_low", "_high")]
                    for row in self.rows)
        self.verdict.compared += 1
        if was[1] > now[2] or now[1] > was[2]:
            self.differs(column.name, *("%.6g (%.6g to %.6g)" % tuple(slope) for slope in (was, now)))

    def time(self, column):
        place = column.pointer.removesuffix("/median")
        ours, theirs = (_repetitions(row, place) for row in self.rows)
        if min(len(ours), len(theirs)) < FEWEST_REPETITIONS:
            self.notes[column.name + " not compared: too few repetitions"] += 1
            return
        self.verdict.compared += 1
        was, now, p = statistics.median(ours), statistics.median(theirs), rank_test(theirs, ours)
        if p >= LARGEST_P or min(was, now) <= 0 or max(was, now) <= SLOWER * min(was, now):
            return
        runs = [find(row, place + "/medians_of_runs") for row in self.rows]
        if all(runs) and max(runs[0]) >= min(runs[1]) and max(runs[1]) >= min(runs[0]):
            self.notes[column.name + " not told: the runs of a side differ more than the sides"] += 1
            return
        self.changed_number(now > was, column.name, was, now, " s",
                            f", p = {p:.6g} over {len(ours)} and {len(theirs)} repetitions")

    def memory(self, column):
        was, now = (value_of(column, row) for row in self.rows)
        self.verdict.compared += 1
        if max(was, now) > MORE_MEMORY * min(was, now) and abs(now - was) > LEAST_MEBIBYTES:
            self.changed_number(now > was, column.name, was, now, " MiB")


# ---- Formats.

def text(comparison, format):
    """Returns a comparison as "md" (counts, then each cell that changed), "json" or "junit"."""
    return {"md": _markdown, "json": _json, "junit": _junit}[format](comparison)


def _markdown(comparison):
    compared, values, regressions, *others = comparison.counts().values()
    result = (f"{_some(compared, 'cell')} {'was' if compared == 1 else 'were'} compared in "
              f"{_some(values, 'value')}: {_some(regressions, 'regression')}, "
              "%d better, %d missing, %d renamed, %d new.\n" % tuple(others))
    if not values:
        result += ("\nNothing was compared, which proves nothing: do the rows belong together? Cells are "
                   "matched by the experiment, which is its file's name, by tier, case, resolution and "
                   "variant.\n")
    cells = [(cell, comparison.reason(cell)) for cell in comparison.cells]
    allowed = [cell for cell, reason in cells if not reason]
    for title, lines in (
            ("Regressions", [f"{cell.cell}: {reason}" for cell, reason in cells if reason]),
            ("Better", [f"{cell.cell}: {'; '.join(cell.better)}" for cell, _ in cells if cell.better]),
            ("Missing, as allowed", [cell.cell for cell in allowed if cell.state == "missing"]),
            ("Renamed, as allowed", [f"{cell.cell}: now {cell.label}" for cell in allowed if cell.label]),
            ("New", [cell.cell for cell in allowed if cell.state == "new"]),
            ("Notes", comparison.notes)):
        if lines:
            result += f"\n### {title}\n" + "".join(f"- {line}\n" for line in lines)
    return result


def _json(comparison):
    cells = [{"cell": c.cell, "state": c.state, "regression": bool(comparison.reason(c)),
              "compared": c.compared, "regressions": c.regressions, "better": c.better}
             | ({"label": c.label} if c.state == "renamed" else {}) for c in comparison.cells]
    result = {"fine": comparison.fine(), "tolerance": comparison.tolerance, **comparison.counts(),
              "notes": comparison.notes, "cells": cells}
    return json.dumps(result, indent=1, ensure_ascii=False) + "\n"


def _xml(text):
    """Returns text as XML; characters that XML 1.0 cannot represent become a question mark."""
    return saxutils.escape(re.sub(r"[\x00-\x08\x0b-\x1f]", "?", text), {'"': "&quot;"})


def _junit(comparison):
    failures, values = (comparison.counts()[key] for key in ("regressions", "values_compared"))
    nothing = values == 0  # a comparison of nothing must not pass
    result = ('<?xml version="1.0" encoding="UTF-8"?>\n<testsuites>\n<testsuite name="hermesh compare" '
              f'tests="{len(comparison.cells) + nothing}" failures="{failures + nothing}">\n')
    if nothing:
        result += ('<testcase classname="compare" name="anything"><failure message="nothing was compared"/>'
                   '</testcase>\n')
    for cell in comparison.cells:
        experiment, _, name = cell.cell.partition(": ")
        result += f'<testcase classname="{_xml(experiment)}" name="{_xml(name)}">'
        if reason := comparison.reason(cell):
            result += f'<failure message="{_xml(reason)}"/>'
        elif cell.state == "missing":
            result += '<skipped message="the candidate has no row of it"/>'
        if cell.state == "new":
            result += "<system-out>new: the baseline has no row of it</system-out>"
        elif cell.better:
            result += f"<system-out>{_xml('better: ' + '; '.join(cell.better))}</system-out>"
        result += "</testcase>\n"
    if comparison.notes:
        result += f"<system-out>{_xml('; '.join(comparison.notes))}</system-out>\n"
    return result + "</testsuite>\n</testsuites>\n"


# ---- The command.

def tolerance_of(given):
    """Returns the number of "1%" or "0.01"."""
    percent = given.endswith("%")
    try:
        value = float(given.removesuffix("%")) / (100 if percent else 1)
    except ValueError:
        value = -1
    if not 0 <= value <= 1:
        raise argparse.ArgumentTypeError(f"must be a share such as 1% or 0.01, at most 100%, not '{given}'")
    return value


def add_command(subparsers):
    description = "Compares rows with a baseline; the exit code is 3 if something became worse or is missing."
    parser = subparsers.add_parser("compare", help=description, description=description)
    for name in ("baseline", "candidate"):
        parser.add_argument(name, metavar=name.upper(), type=pathlib.Path,
                            help="directory with rows.jsonl, or such a file")
    parser.add_argument("--tolerance", type=tolerance_of, default=0.01,
                        help="share of the baseline's value by which an error may grow (default: 1%%)")
    parser.add_argument("--times", choices=("yes", "no"), default="yes",
                        help="compare times and memory if both are from the same machine (default: yes)")
    parser.add_argument("--pool", action="store_true",
                        help="use the repetitions of all runs of a cell together, not those of the last run")
    parser.add_argument("--allow-missing", action="store_true",
                        help="cells that the candidate lacks, or has under another label, are no regression")
    parser.add_argument("--format", choices=("md", "json", "junit"), default="md", help="default: md")
    parser.set_defaults(function=run)


def run(arguments):
    comparison = compare_rows(read_rows(arguments.baseline), read_rows(arguments.candidate),
                              tolerance=arguments.tolerance, costs=arguments.times == "yes",
                              pool=arguments.pool, allow_missing=arguments.allow_missing)
    sys.stdout.write(text(comparison, arguments.format))
    return 0 if comparison.fine() else 3
