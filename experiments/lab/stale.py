"""Rows that the present program no longer makes: the measurement `stale` and the command `report --stale`.

A sample of the cells behind the rows of results/ is run again, from what the rows state of themselves, and
the results are compared; dates and commits decide nothing. Of an extraction or voxelization the sample is the
cheapest groups of cells, all variants; of a measurement one row of each table. Digests are compared; if a row
has none, whole numbers and truth values (counts), never times or memory. Rows are skipped if their input is a
stand-in, or not available as the row's hash has it.
"""

import collections
import tempfile

from .child import work
from .compare import class_of, options_in
from .experiment import CASE, EXPERIMENT, OF_JOB, TIER, option_problems, variant
from .program import load_program
from .rows import ROOT, LabError, find, latest_groups, number_at, own_columns, read_rows, text_at, to_json

NOT_MADE = ("local", "stale", "reproductions")  # folders whose rows are not made by the program, but about it
CELL = ("/case/name", "/resolution", "/values/resolution", "/nominal_voxel_size", "/sweep/value",
        "/voxelization/label", "/variant/label")
# What jobs have in common, with the fewest checks.
JOB = {key: value for key, value in (EXPERIMENT | TIER | CASE).items() if key in OF_JOB} | {
    "require_data": False, "head": {}, "repetitions": 1, "seconds_per_variant": 0.0, "samples": 1000,
    "pixels": 0, "self_intersections": False, "files": "stale", "resolution": None, "voxel_size": None,
    "voxelizer": None, "published_seconds": None}


def measured_table(title, first_column, meanings):
    """Returns what rows of a measurement state of their table; `meanings` are by "name" or "name, header"."""
    columns = [(*key.split(", "), meaning) for key, meaning in meanings.items()]
    columns = [{"name": column[0], "header": column[-2], "meaning": column[-1]} for column in columns]
    return {"title": title, "first_column": first_column, "columns": columns, "printed": True}


def cell_name(row):
    return "/".join(filter(None, (text_at(row, part) for part in CELL)))


def outcome(row):
    """Returns {pointer: value} of what is compared of a row: the digests, or the counts if it has none."""
    digests = [pointer for pointer in ("/digest", "/values/digest") if find(row, pointer)]
    counts = [column.pointer for column in own_columns(row)
              if isinstance(find(row, column.pointer), int)  # or bool
              and class_of(column, find(row, column.pointer), row) == "exact"]
    pointers = digests if digests or "failed" in row else ["/voxelization/active_voxels", *counts]
    return {pointer: find(row, pointer) for pointer in pointers if find(row, pointer) is not None}


def difference(row, made):
    """Returns how a row and the one of the same cell that was made now differ, "" if they do not."""
    if "failed" in made and "failed" not in row:
        return f"fails: {text_at(made, '/failed')}"
    if "failed" in row and "failed" not in made:
        return "no longer fails"
    for place, value in sorted(outcome(row).items()):
        now = find(made, place)
        if now != value:
            return f"{place[1:]} was {to_json(value)}, now {'nothing' if now is None else to_json(now)}"
    return ""


class Check:
    """Runs a sample of the cells of a folder again; `values` are those of its row."""

    def __init__(self, program, scratch, rows):
        self.program, self.vocabulary = program, program.description
        self.job = JOB | {"out": scratch, "threads": self.vocabulary["threads"]}
        self.values = {"rows": rows, "tried": 0, "by_digest": 0, "differing": 0, "sample": "",
                       "difference": "", "skipped": ""}

    def _attempt(self, job):
        """Returns the rows of a job or its input, and why there are no more if it did not end well."""
        try:
            done = work(self.program.command, self.job | job)
        except LabError as error:
            return [], str(error)
        return done.input or done.rows, done.reason

    def _compare(self, name, old, made, error):
        """Compares old rows with those made now.

        If several of a measurement have one name (e.g. of a model at several angles), one equal row suffices.
        """
        values = self.values
        values["sample"] += (", " if values["sample"] else "") + name
        for row in old:
            found = [difference(row, other) for other in made if cell_name(other) == cell_name(row)]
            values["tried"] += 1
            values["by_digest"] += any(find(row, place) for place in ("/digest", "/values/digest"))
            values["differing"] += "" not in found
            if "" not in found and not values["difference"]:
                why = error or (found or ["is no longer made"])[0]
                values["difference"] = f"{cell_name(row)}: {why}"

    def group(self, rows):
        """Runs a group again; returns False if its input is not available."""
        first, kind, name = rows[0], rows[0].get("kind", "extraction"), text_at(rows[0], "/case/name")
        if text_at(first, "/case/origin").startswith("stand-in"):
            self.values["skipped"] = "stand-ins"
            return False
        source = {"case": name, "sweep": first.get("sweep")}
        found, error = self._attempt({"kind": "input"} | source)
        if not found or found["sha256"] != text_at(first, "/case/sha256"):
            self.values["skipped"] = f"{name}: {error or 'is not available as the rows have it'}"
            return False
        table = "voxelizers" if kind == "voxelization" else "extractors"
        job = source | {"kind": kind, "variants": [self._variant(row["variant"], table) for row in rows]}
        if kind == "extraction":
            job["voxelizer"] = self._variant(first["voxelization"], "voxelizers")
        else:
            job |= {f"{side}_band": float(width) for side, width in first["band"].items()}
        size = "resolution" if "resolution" in first else "voxel_size"
        made, error = self._attempt(job | {size: first[size]})
        names = {key: first.get(key) for key in ("resolution", "nominal_voxel_size", "sweep")}
        self._compare(cell_name(first | {"variant": {}}), rows, [row | names for row in made], error)
        return True

    def _variant(self, row, table):
        """Returns the variant of a row."""
        name, options = text_at(row, "/name"), options_in(text_at(row, "/options"))
        return variant(name, text_at(row, "/label"), self._accepted(name, table, "options", options))

    def _accepted(self, name, table, key, options):
        """Returns the options without those that are refused.

        A row has all options, also those without effect and those that existed once; the result shows if
        they matter.
        """
        declared = next((entry[key] for entry in self.vocabulary[table] if entry["name"] == name), [])
        while problem := next(option_problems(name, declared, options), None):
            options = {each: value for each, value in options.items() if each != problem[0]}
        return options

    def measured(self, row):
        """Has a row of a measurement made again."""
        name, stated = text_at(row, "/measurement/name"), text_at(row, "/measurement/parameters")
        made, error = self._attempt({
            "kind": "measurement", "measurement": name, "seed": int(number_at(row, "/measurement/seed")),
            "parameters": self._accepted(name, "measurements", "parameters", options_in(stated)), "done": [],
            "filter": f"{name}/{text_at(row, '/case/name')}/{text_at(row, '/variant/label')}"})
        if made and not _same_inputs(row, made[0]):
            self.values["skipped"] = f"{cell_name(row)}: its input is not available as the rows have it"
        elif not made and not error:
            # A row that is computed from others, or whose label has changed, is not made alone.
            self.values["skipped"] = f"{cell_name(row)}: not made when asked for alone"
        else:
            self._compare(cell_name(row), [row], made, error)


def check_folder(rows, groups, program):
    """Returns the values of the measurement for a folder of rows, of which `groups` groups are run again."""
    shown = [row for group in latest_groups(rows) for row in group.rows]
    with tempfile.TemporaryDirectory() as scratch:
        check = Check(program, scratch, len(shown))
        if "measurement" in shown[0]:
            for row in _sampled(shown):
                check.measured(row)
        else:
            for group in _groups_of(shown):
                groups -= check.group(group)
                if groups == 0:
                    break
    return check.values | ({"skipped": ""} if check.values["tried"] else {})


def _groups_of(rows):
    """Returns the rows in groups that are run together, the cheapest first by the times in the rows."""
    groups = collections.defaultdict(list)
    for row in rows:
        if not text_at(row, "/variant/name").startswith("command "):  # outside programs may have changed
            parts = ["/tier", "/case/name", "/resolution", "/voxel_size", "/sweep/value"]
            parts += [] if row.get("kind") == "voxelization" else ["/voxelization/label"]
            groups[tuple(text_at(row, part) for part in parts)].append(row)
    times = ("/seconds/median", "/voxelization/seconds/median", "/judge_seconds")
    return sorted((groups[key] for key in sorted(groups)),
                  key=lambda group: sum(number_at(row, place) for row in group for place in times))


def _sampled(rows):
    """Returns one row of each table, the first of those of least resolution."""
    chosen = {}
    for row in sorted(rows, key=lambda row: number_at(row, "/values/resolution")):
        if "failed" not in row:
            chosen.setdefault((text_at(row, "/tier"), text_at(row, "/case/name")), row)
    return [chosen[key] for key in sorted(chosen)]


def _same_inputs(row, made):
    before, now = find(row, "/inputs"), find(made, "/inputs")
    if before is None or now is None:  # rows of older programs do not name them
        return True
    sha256 = {source["name"]: source["sha256"] for source in before}
    return all(sha256.get(source["name"], source["sha256"]) == source["sha256"] for source in now)


# ---- The measurement and the command

def measure(parameters, wants, program, progress):
    """Yields (folder, values, broken) of each folder of results/ that wants() accepts."""
    for file in sorted((ROOT / "results").glob("*/rows.jsonl")):
        folder = file.parent.name
        if wants(folder) and folder not in NOT_MADE:
            progress(f"rows of {folder}")
            values = check_folder(read_rows(file), int(parameters["groups"]), program)
            yield folder, values, [f"stale: {values['difference']}"] if values["differing"] else []


MEASUREMENT = {
    "name": "stale", "measure": measure, "table": "folders",
    "parameters": [{"name": "groups", "default": "1", "minimum": 1, "maximum": 1000,
                    "help": "groups of cells that are run again of each folder, the cheapest first"}],
    "shown": measured_table("rows of results/ made again", "folder", {
        "rows": "rows that the folder shows", "tried": "of these, those that were made again",
        "by_digest, by digest": "of these, those compared by digest; the others by their counts",
        "differing, differ": "of these, those that came out otherwise, or can no longer be made",
        "sample": "which cells", "difference, first difference": "cell, value then, value now",
        "skipped, not tried": "why nothing was tried"})
    | {"additive": True}}


def run(arguments):
    """Runs `report --stale [DIR]`; returns 3 if a cell differs."""
    only = arguments.directory.name if arguments.directory else ""
    folders = tried = differing = 0
    checked = measure({"groups": "1"}, lambda folder: only in ("", folder), load_program(), lambda _: None)
    for name, values, _ in checked:
        folders, tried, differing = folders + 1, tried + values["tried"], differing + values["differing"]
        if values["differing"]:
            print(f"{name}: {values['differing']} of {values['tried']} cells differ; "
                  f"first {values['difference']}", flush=True)
        if values["skipped"]:
            print(f"{name}: not tried: {values['skipped']}", flush=True)
    if not folders:
        raise LabError(f'results/ has no folder "{only}" with rows')
    print(f"{folders} folders, {tried} cells made again, {differing} differ")
    return 3 if differing else 0
