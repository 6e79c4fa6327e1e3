"""Planted drifts must be reported as regressions, and harmless changes must pass."""

import argparse
import contextlib
import copy
import io
import json
import pathlib
import random
import tempfile
import unittest
import xml.etree.ElementTree

from .. import compare
from ..compare import class_of, compare_rows, options_in, rank_test, text, worse_of
from ..rows import Column, append_rows, find

MESH, SHARP, FAILED, VOXELS, MEASURED, MORE_THREADS, BROKEN = range(7)  # rows of baseline()


def seconds_about(median, seed):
    """Ten times with a standard deviation of a hundredth, as on a quiet machine."""
    noise = random.Random(seed)
    return {"median": median, "minimum": median, "repetitions": 10, "warm": True,
            "all": [median * noise.gauss(1, 0.01) for _ in range(10)]}


def head(experiment):
    return {"experiment": experiment, "tier": "quick", "run": "2026-01-01-1", "commit": 40 * "1",
            "dirty": False, "date": "2026-01-01", "machine": {"cpu": "Some CPU", "cores": 2}, "threads": 2,
            "load": [0.5, 0.5, 0.5]}


def mesh_row(label, options, seed):
    return head("headline") | {
        "case": {"name": "torus", "origin": "generated", "sha256": "aa00"},
        "resolution": 100, "voxel_size": 0.01, "samples": 1000,
        "variant": {"name": "contouring", "label": label, "options": options,
                    "promises": ["closed", "manifold"]},
        "voxelization": {"name": "hermesh", "label": "hermesh", "options": "signs=auto", "digest": "beef",
                         "peak_bytes": 50 << 20, "seconds": seconds_about(0.5, seed + 50),
                         "active_voxels": 30000, "memory_bytes": 2 << 20},
        "peak_bytes": 20 << 20, "digest": "digest of " + label, "triangle_count": 2000,
        "report": {"points": 1000, "quads": 900, "boundary_edges": 0, "closed": True, "genus": 1,
                   "self_intersecting_pairs": 0, "smallest_angle": 20.0, "euler_characteristic": 0,
                   "to_reference": {"max": 0.004, "mean": 0.001, "rms": 0.002, "samples": 2000},
                   "solid": {"verdict": "same", "difference_percent": 0.25}},
        "broken": [], "unchecked": [], "promise_letters": "cm kept", "seconds": seconds_about(1.0, seed),
        "nanoseconds_per_active_voxel": 33.0}


def voxel_row():
    return head("headline") | {
        "kind": "voxelization", "band": {"exterior": 3.0, "interior": 3.0},
        "case": {"name": "plate", "sha256": "bb00"},
        "nominal_voxel_size": 0.5, "voxel_size": 0.5, "sweep": {"parameter": "gap", "value": 1.5},
        "variant": {"name": "hermesh", "label": "hermesh", "options": "signs=auto"},
        "voxelization": {"active_voxels": 7000, "fingerprint": "f00d", "memory_bytes": 1 << 20},
        "accuracy": {"max": 0.02, "rms": 0.003, "stray": 0},
        "signs": {"judged": 6000, "wrong": 4, "wrong_share": 4 / 6000}, "seconds": seconds_about(0.2, 4)}


def measured_row(label, threads):
    values = {"threads": threads, "mean": 1.25, "held": 96.0, "growth": 1.7, "escaped": 1000.0, "slope": 2.0,
              "slope_low": 1.95, "slope_high": 2.05, "verdict": "met", "pack": 1.5, "speedup": 1.9}
    headers = {"mean": "mean [°]", "held": "held [%]", "pack": "pack [ns]"}
    return head("codes") | {
        "measurement": {"name": "codes", "parameters": "points=1000 step=2", "seed": 1},
        "case": {"name": "errors"}, "inputs": [{"name": "bunny", "sha256": "cc00"}],
        "variant": {"name": label, "label": label}, "values": values,
        "table": {"columns": [{"name": n, "header": headers.get(n, n), "meaning": ""} for n in values]}}


def baseline():
    failed = mesh_row("failing", "a=9", 9) | {"failed": "there is no path", "promise_letters": "FAILED"}
    for key in ("digest", "report", "seconds", "triangle_count"):
        del failed[key]
    broken = mesh_row("broken", "a=5", 7)
    broken |= {"broken": ["manifold: 3 edges are not"], "promise_letters": "cm BROKEN"}
    broken["case"]["name"] = "knot"
    return [mesh_row("smooth", "a=1 b=2", 1), mesh_row("sharp", "a=3", 2), failed, voxel_row(),
            measured_row("thesis", 1), measured_row("thesis", 2), broken]


# ---- Changes: functions that modify a list of rows.

def put(at, changes):
    """Sets {pointer: value} in a row, or in all if `at` is None; a function is called with the old value."""
    def change(rows):
        for row in rows if at is None else [rows[at]]:
            for pointer, value in changes.items():
                parent, _, key = pointer.rpartition("/")
                place = find(row, parent)
                key = int(key) if isinstance(place, list) else key
                place[key] = value(place[key]) if callable(value) else value
    return change


def times(factor):
    return lambda value: value * factor


def about(median):
    """Other repetitions than the baseline's, so that their noise is other noise."""
    return seconds_about(median, 99)


def remove(*numbers):
    def change(rows):
        rows[:] = [row for number, row in enumerate(rows) if number not in numbers]
    return change


def added(row):
    return lambda rows: rows.append(row)


def with_run(run, first, digest_of):
    """Adds a run before or after the rows, and changes a digest in the rows of index digest_of."""
    def change(rows):
        other = copy.deepcopy(rows)
        put(None, {"/run": run})(other)
        rows[:] = other + rows if first else rows + other
        put(digest_of, {"/digest": "other"})(rows)
    return change


def new_column(rows):
    rows[MEASURED]["table"]["columns"].append({"name": "more", "header": "more", "meaning": ""})
    rows[MEASURED]["values"]["more"] = 5


def turn_keys(rows):
    rows[MESH] = dict(reversed(rows[MESH].items()))


def swap_rows(rows):
    rows[MEASURED], rows[MORE_THREADS] = rows[MORE_THREADS], rows[MEASURED]


DRIFTS = {
    "one vertex more": put(MESH, {"/report/points": 1001}),
    "one triangle less": put(MESH, {"/triangle_count": 1999}),
    "another mesh": put(MESH, {"/digest": "other"}),
    "another grid": put(MESH, {"/voxelization/digest": "other"}),
    "another tree of voxels": put(VOXELS, {"/voxelization/fingerprint": "other"}),
    "an error larger by 3 %": put(MESH, {"/report/to_reference/rms": times(1.03)}),
    "an angle smaller by 3 %": put(MESH, {"/report/smallest_angle": times(0.97)}),
    "a measured error larger by 3 %": put(MEASURED, {"/values/mean": times(1.03)}),
    "a smaller share of hits": put(MEASURED, {"/values/held": 94.5}),
    "a value of unknown direction smaller by 3 %": put(MEASURED, {"/values/growth": times(0.97)}),
    "a count stored as floating point": put(MEASURED, {"/values/escaped": 1001.0}),
    "a slope beyond its interval": put(MEASURED, {"/values/slope": 1.8, "/values/slope_low": 1.75,
                                                  "/values/slope_high": 1.85}),
    "a text of a measurement": put(MEASURED, {"/values/verdict": "not met"}),
    "a missing row": remove(MESH),
    "a missing row among those of one label": remove(MORE_THREADS),
    "a missing experiment": remove(MEASURED, MORE_THREADS),
    "a renamed variant": put(SHARP, {"/variant/label": "pointed"}),
    "times of 1.3": put(MESH, {"/seconds": about(1.3)}),
    "times of 1.3 of a voxelizer": put(VOXELS, {"/seconds": about(0.26)}),
    "times of 1.15, the median only": put(MESH, {"/voxelization/seconds": about(0.575)}),
    "a peak of 1.5": put(MESH, {"/peak_bytes": times(1.5)}),
    "larger trees": put(VOXELS, {"/voxelization/memory_bytes": times(1.03)}),
    "a broken guarantee": put(MESH, {"/broken": ["closed: 4 edges"], "/promise_letters": "cm BROKEN"}),
    "another broken guarantee": put(BROKEN, {"/broken": lambda broken: broken + ["closed: 1 edge is open"]}),
    "a guarantee less": put(MESH, {"/variant/promises": ["closed"], "/promise_letters": "c kept"}),
    "a guarantee that is no longer checked": put(MESH, {"/unchecked": ["manifold"]}),
    "a failure": put(MESH, {"/failed": "out of luck"}),
    "another option": put(MESH, {"/variant/options": "a=1 b=3"}),
    "another parameter of a measurement": put(MEASURED, {"/measurement/parameters": "points=900 step=2"}),
    "another seed": put(MEASURED, {"/measurement/seed": 2}),
    "another input": put(MESH, {"/case/sha256": "ffff"}),
    "another input of a measurement": put(MEASURED, {"/inputs/0/sha256": "ffff"}),
    "an error that is not finite": put(MESH, {"/report/to_reference/max": None}),
    "a genus that is now unknown": put(MESH, {"/report/genus": None}),
    "a truth value of the report": put(MESH, {"/report/closed": False}),
    "a count of the report that is no column": put(MESH, {"/report/euler_characteristic": 2}),
    "the solid": put(MESH, {"/report/solid/verdict": "differs"}),
    "wrong signs": put(VOXELS, {"/signs/wrong": 5}),
    "an error where there was none": put(VOXELS, {"/accuracy/stray": 1}),
    "repetitions that differ": put(MESH, {"/repetitions_differ": True}),
    "fewer samples for the distances": put(MESH, {"/samples": 500}),
    "a narrower band": put(VOXELS, {"/band/exterior": 2.0}),
    "another voxel size at the same resolution": put(MESH, {"/voxel_size": 0.0101}),
    "a later run that is worse": with_run("2026-01-02-1", first=False, digest_of=len(baseline()) + MESH),
}

HARMLESS = {
    "nothing": lambda rows: None,
    "order of rows": lambda rows: rows.reverse(),
    "order of rows of one label": swap_rows,
    "order of keys": turn_keys,
    "noise of times": put(MESH, {"/seconds": about(1.0)}),
    "times of 1.05": put(MESH, {"/seconds": about(1.05)}),
    "faster": put(MESH, {"/seconds": about(0.7)}),
    "one slow repetition": put(MESH, {"/seconds/all/3": 5.0}),
    "four repetitions, however slow": put(MESH, {"/seconds": {"median": 9.0, "all": [9.0, 9.1, 9.2, 9.3]}}),
    "a slower machine": lambda rows: (put(None, {"/machine/cpu": "Some old CPU"})(rows),
                                      put(MESH, {"/seconds": about(3.0), "/peak_bytes": times(3)})(rows)),
    "fewer threads": put(MESH, {"/threads": 1, "/seconds": about(2.0)}),
    "a machine of more cores": put(MESH, {"/machine/cores": 64, "/seconds": about(2.0)}),
    "another commit": put(None, {"/commit": "2222", "/dirty": True}),
    "another date and run": put(None, {"/date": "2027-01-01", "/run": "2027"}),
    "load": put(None, {"/load": [9.0, 9.0, 9.0]}),
    "another compiler": put(None, {"/build": {"compiler": "other"}}),
    "a new row": added(mesh_row("new", "a=7", 77)),
    "a new experiment": added(mesh_row("new", "a=7", 77) | {"experiment": "more"}),
    "a new column of the report": put(MESH, {"/report/normals_to_reference": {"mean": 3.0}}),
    "a new column of a measurement": new_column,
    "one column less": lambda rows: rows[MESH]["report"]["solid"].pop("difference_percent"),
    "one option more, at its default": put(MESH, {"/variant/options": "a=1 b=2 c=off"}),
    "options in another order": put(MESH, {"/variant/options": "b=2 a=1"}),
    "a better error": put(MESH, {"/report/to_reference/rms": times(0.8)}),
    "an error larger by half a percent": put(MESH, {"/report/to_reference/rms": times(1.005)}),
    "an error of nothing": put(MESH, {"/report/to_reference/mean": 0.001 + 1e-9}),
    "a larger angle": put(MESH, {"/report/smallest_angle": times(1.2)}),
    "a slope within its interval": put(MEASURED, {"/values/slope": 1.93, "/values/slope_low": 1.88,
                                                  "/values/slope_high": 1.98}),
    "a guarantee that now holds": put(BROKEN, {"/broken": [], "/promise_letters": "cm kept"}),
    "a failure that is gone": lambda rows: rows.__setitem__(FAILED, mesh_row("failing", "a=9", 9)),
    "another message of a failure": put(FAILED, {"/failed": "there is still no path"}),
    "single times of a measurement": put(MEASURED, {"/values/pack": times(3)}),
    "ratios of times": lambda rows: (put(MESH, {"/nanoseconds_per_active_voxel": times(3)})(rows),
                                     put(MEASURED, {"/values/speedup": times(0.3)})(rows)),
    "a peak of 1.1": put(MESH, {"/peak_bytes": times(1.1)}),
    "a peak of half a MiB more": put(MESH, {"/voxelization/peak_bytes": (50 << 20) + (1 << 19)}),
    "another sentence of the report": put(MESH, {"/report/sentences": ["The mesh is fine."]}),
    "notes": put(MESH, {"/notes": ["a note"]}),
    "an earlier run that was worse": with_run("2025-12-31-1", first=True, digest_of=MESH),
    "the reason why rows were accepted": put(MESH, {"/accepted": {"reason": "they are right"}}),
}


def number(comparison, what="regressions"):
    return comparison.counts()[what]


def compared_with(change, **settings):
    rows = baseline()
    change(rows)
    return compare_rows(baseline(), rows, **settings)


class Changes(unittest.TestCase):
    def test_drifts_are_caught(self):
        self.assertEqual(len(DRIFTS), 44)
        for name, change in DRIFTS.items():
            with self.subTest(name):
                comparison = compared_with(change)
                self.assertFalse(comparison.fine())
                self.assertLessEqual(number(comparison), 2, "reported for other cells, too")

    def test_harmless_changes_pass(self):
        self.assertEqual(len(HARMLESS), 39)
        for name, change in HARMLESS.items():
            with self.subTest(name):
                self.assertTrue(compared_with(change).fine(), text(compared_with(change), "md"))

    def test_improvements_are_reported(self):
        for name in ("faster", "a better error", "a larger angle", "a guarantee that now holds",
                     "a failure that is gone"):
            with self.subTest(name):
                self.assertEqual(number(compared_with(HARMLESS[name]), "better"), 1)
        less_memory = compared_with(put(MESH, {"/peak_bytes": 1 << 20}))
        self.assertEqual((number(less_memory), number(less_memory, "better")), (0, 1))

    def test_settings_let_changes_pass(self):
        for name, settings in (("an error larger by 3 %", {"tolerance": 0.05}),
                               ("times of 1.3", {"costs": False}), ("a peak of 1.5", {"costs": False}),
                               ("a missing row", {"allow_missing": True}),
                               ("a renamed variant", {"allow_missing": True})):
            with self.subTest(name):
                self.assertTrue(compared_with(DRIFTS[name], **settings).fine())
        lenient = {"tolerance": 1.0, "costs": False, "allow_missing": True}
        self.assertFalse(compared_with(DRIFTS["another mesh"], **lenient).fine())

    def test_changes_of_both_sides(self):
        def compared(at, *changes):
            sides = baseline(), baseline()
            for rows, change in zip(sides, changes):
                put(at, change)(rows)
            return compare_rows(*sides)

        chance = [{"/seconds/all": [value] * 4 + [1.0] * 3 + [1.3] * 3} for value in (1.0, 1.3)]
        mean, options, libraries = "/report/to_reference/mean", "/variant/options", "/report/libraries"
        for name, at, before, after in (
                ("below the floor", MESH, {mean: 0.0}, {mean: 5e-9}), ("times by chance", MESH, *chance),
                ("repetitions", MESH, {options: "repetitions=3"}, {options: "repetitions=5"}),
                ("another cost of a grid that another row reports", SHARP, {},
                 {"/voxelization/seconds": about(5), "/voxelization/peak_bytes": 1 << 40}),
                ("an option of the baseline only", MESH, {options: "a=1 b=2 c=off"}, {}),
                ("half a MiB", MESH, {"/peak_bytes": 1 << 20}, {"/peak_bytes": 3 << 19}),
                ("other libraries", MESH, {libraries: {"edges": 1}}, {libraries: {"edges": 2}}),
                ("number of samples", MESH, {}, {"/report/to_reference/samples": 1999}),
                ("whole before", MESH, {"/report/smallest_angle": 20}, {"/report/smallest_angle": 20.05}),
                ("whole after", MESH, {"/report/smallest_angle": 20.05}, {"/report/smallest_angle": 20}),
                ("a failure", MEASURED, {"/values/verdict": "failed: a"}, {"/values/verdict": "failed: b"}),
                ("another input of another name", MEASURED, {},
                 {"/inputs": [{"name": "bunny", "sha256": "cc00"}, {"name": "knot", "sha256": "dd"}]})):
            with self.subTest(name):
                comparison = compared(at, before, after)
                self.assertTrue(comparison.fine(), text(comparison, "md"))
                self.assertEqual(number(comparison, "better"), 0)
        for name, before, after in (
                ("promises only", {}, {"/variant/promises": ["closed"]}),
                ("a nested count", {"/report/solid/pieces": 1}, {"/report/solid/pieces": 2}),
                ("a truth value that becomes a number", {}, {"/report/genus": True})):
            with self.subTest(name):
                self.assertEqual(number(compared(MESH, before, after)), 1)


class Cells(unittest.TestCase):
    def test_nothing_else_is_compared_of_other_inputs(self):
        self.assertEqual(compared_with(DRIFTS["another input"]).cells[MESH].compared, 0)
        self.assertGreater(compared_with(DRIFTS["another option"]).cells[MESH].compared, 0)

    def test_uncompared_values_are_noted_once(self):
        def notes(changes, **settings):
            rows = baseline()
            put(None, changes)([row for row in rows if "seconds" in row])
            return compare_rows(baseline(), rows, **settings).notes
        pack = "pack not compared: no repetitions (2 cells)"
        self.assertIn("seconds not compared: other machine (4 cells)", notes({"/machine/cpu": "other"}))
        self.assertEqual(notes({"/seconds/all": [1.0]}),
                         ["seconds not compared: too few repetitions (4 cells)", pack])
        self.assertEqual(notes({"/seconds/all": [1.0], "/machine/cpu": "other"}, costs=False), [])
        self.assertIn("the candidate alone has more (1 cell)", compared_with(new_column).notes)

    def test_a_renamed_cell_is_compared(self):
        def states(changes):
            comparison = compared_with(put(SHARP, {"/variant/label": "pointed"} | changes),
                                       allow_missing=True)
            return [number(comparison, state) for state in ("renamed", "missing", "new", "regressions")]
        self.assertEqual(states({"/report/points": 1}), [1, 0, 0, 1])
        self.assertEqual(states({"/digest": "other"}), [1, 0, 0, 1])
        # With other options the digest matches cells; without either, nothing does.
        self.assertEqual(states({"/variant/options": "a=4"}), [1, 0, 0, 1])
        self.assertEqual(states({"/variant/options": "a=4", "/digest": "other"}), [0, 1, 1, 0])
        rows = baseline()  # measurements without digests have neither
        put(None, {"/variant/label": "other"})(rows[MEASURED:MORE_THREADS + 1])
        self.assertEqual(number(compare_rows(baseline(), rows), "renamed"), 0)

    def test_nothing_compared_is_not_fine(self):
        comparison = compared_with(put(None, {"/experiment": "another"}), allow_missing=True)
        self.assertFalse(comparison.fine())
        self.assertEqual(number(comparison), 0)
        suite = xml.etree.ElementTree.fromstring(text(comparison, "junit").encode())[0]
        self.assertEqual((int(suite.get("tests")), suite.get("failures")), (2 * len(baseline()) + 1, "1"))
        self.assertEqual(len(suite.findall("testcase")), 2 * len(baseline()) + 1)

    def test_pooled_runs(self):
        def runs(*all_seconds):
            return [mesh_row("smooth", "a=1", 1) |
                    {"run": f"run {run}", "seconds": {"median": 1, "all": seconds}}
                    for run, seconds in enumerate(all_seconds)]

        def about(*medians):
            return runs(*(seconds_about(median, seed)["all"] for seed, median in enumerate(medians)))
        few, slower_few = ([row | {"seconds": row["seconds"] | {"all": row["seconds"]["all"][:2]}}
                            for row in rows]
                           for rows in (about(1.0, 1.0, 1.0), about(1.3, 1.3, 1.3)))
        self.assertTrue(compare_rows(few, slower_few).fine(), "two repetitions are too few")
        unpooled = copy.deepcopy(few)
        self.assertFalse(compare_rows(few, slower_few, pool=True).fine())
        self.assertTrue(compare_rows(few, few, pool=True).fine())
        self.assertEqual(few, unpooled)
        # Two of three runs were disturbed: the test of all repetitions finds a change.
        disturbed = compare_rows(about(1.0, 1.0, 1.0), about(1.0, 1.5, 1.5), pool=True)
        self.assertTrue(disturbed.fine())
        self.assertTrue(any(note.startswith("seconds not told") for note in disturbed.notes))
        self.assertFalse(compare_rows(about(1.0, 1.1, 1.0), about(1.3, 1.25, 1.5), pool=True).fine())
        # Runs of another machine are not pooled.
        other = runs([1.3] * 9, [1.3] * 9, [1.0] * 9)
        put(None, {"/machine/cpu": "Some old CPU"})(other[:2])
        self.assertEqual(compare_rows(runs([1.0] * 9), other, pool=True).notes, [])

    def test_formats_agree(self):
        rows = baseline()
        rows[MESH]["report"]["points"] = 1001
        rows[SHARP]["failed"] = 'a < b & "c"\x01'
        rows.append(mesh_row("new", "a=7", 77))
        del rows[VOXELS]
        comparison = compare_rows(baseline(), rows)
        result = json.loads(text(comparison, "json"))
        self.assertEqual([result[key] for key in ("fine", "regressions", "missing", "new")], [False, 3, 1, 1])
        self.assertEqual(len(result["cells"]), 8)
        self.assertEqual(result["cells"][0]["regressions"], ["points was 1000, now 1001"])
        suite = xml.etree.ElementTree.fromstring(text(comparison, "junit").encode())[0]
        self.assertEqual((suite.get("tests"), suite.get("failures")), ("8", "3"))
        self.assertEqual((suite[0].get("classname"), suite[0].get("name")),
                         ("headline, quick", "torus / 100 / hermesh / smooth"))
        self.assertEqual(suite[1][0].get("message"), 'fails: a < b & "c"?')
        self.assertTrue(text(comparison, "md").startswith("6 cells were compared"))

    def test_values_of_options_may_have_spaces(self):
        self.assertEqual(options_in("threads=1 2 7 cases=few"), {"threads": "1 2 7", "cases": "few"})


def column(name, header=""):
    return Column(name, header, "", "/values/" + name)


class ValueClasses(unittest.TestCase):
    def test_classes(self):
        for name, header, value, expected in (
                ("mean", "mean [°]", 1.3, "error"), ("codes", "codes", 64008, "exact"),
                ("closed", "", True, "exact"), ("digest", "", "9af1", "exact"),
                ("pack", "pack [ns]", 1.2, "time"), ("csg", "CSG [ms]", "3 and 4", "time"),
                ("ns", "", 1.5, "derived"), ("ns_per_point", "", 1.5, "derived"),
                ("speedup", "", 1.7, "derived"), ("gigabytes", "GB/s", 9.0, "derived"),
                ("ratio", "times as fast", 9.0, "derived"), ("labelled_least", "least", 9.0, "derived"),
                ("resident", "resident [MiB]", 3.5, "memory"), ("leaf", "B/leaf", 3.5, "error"),
                ("printed_seconds", "printed [s]", 2.3, "exact"), ("expected_max", "max [°]", 2.56, "exact"),
                ("nsa", "", 1.5, "error"), ("order", "", 1.5, "error"), ("unknown", "", None, "error")):
            self.assertEqual(class_of(column(name, header), value, {}), expected, name)

    def test_directions_of_errors(self):
        for name, header, expected in (
                ("to_rms", "to rms [vx]", "larger"), ("p99", "99 % [°]", "larger"),
                ("wrong_share", "", "larger"), ("leaf", "B/leaf", "larger"),
                ("smallest_angle", "angle [°]", "smaller"), ("held_percent", "held [%]", "smaller"),
                ("volume", "volume [vx³]", "either"), ("p999", "", "either")):
            self.assertEqual(worse_of(column(name, header)), expected, name)


class RankTest(unittest.TestCase):
    def test_exact_values_by_hand(self):
        for a, b, p in (([1, 2, 3], [4, 5, 6], 2 / 20), ([4, 5, 6], [1, 2, 3], 2 / 20),
                        ([1, 2, 3, 4, 5], [6, 7, 8, 9, 10], 2 / 252), ([1], [2], 1),
                        # Sums of two of the ranks 1 to 4: 3, 4, 5, 5, 6, 7; four are as far from 5 as 4.
                        ([1, 3], [2, 4], 4 / 6),
                        # Ties: ranks 2, 2, 2, 4, whose sums are 4 or 6; ranks 1.5, 1.5, 3.5, 3.5.
                        ([1, 1], [1, 2], 1), ([1, 1], [2, 2], 2 / 6),
                        ([7, 7, 7], [7, 7], 1)):
            self.assertAlmostEqual(rank_test(a, b), p, places=15)

    def test_is_normal_beyond_twenty(self):
        # U = 0, mean 220.5, variance 21·21·43/12 = 1580.25; the tails beyond 220 / 39.752 have 3.124e-8.
        self.assertAlmostEqual(rank_test(list(range(21)), list(range(100, 121))), 3.124e-8, delta=2e-11)
        self.assertEqual(rank_test([1.0] * 30, [1.0] * 30), 1)


class Command(unittest.TestCase):
    def run_command(self, *words):
        """Returns the exit code and the standard output."""
        parser = argparse.ArgumentParser()
        compare.add_command(parser.add_subparsers())
        with contextlib.redirect_stdout(io.StringIO()) as out:
            arguments = parser.parse_args(["compare", *map(str, words)])
            return arguments.function(arguments), out.getvalue()

    def test_exit_codes(self):
        with tempfile.TemporaryDirectory() as directory:
            same, worse, fewer = (pathlib.Path(directory) / name
                                  for name in ("a.jsonl", "b.jsonl", "c.jsonl"))
            append_rows(same, baseline())
            DRIFTS["a measured error larger by 3 %"](rows := baseline())
            append_rows(worse, rows)
            append_rows(fewer, baseline()[1:])
            for code, *arguments in (
                    (0, same, same), (3, same, worse), (0, worse, same),
                    (0, same, worse, "--tolerance", "4%"),
                    (3, same, worse, "--tolerance", "0.02"), (3, same, fewer),
                    (0, same, fewer, "--allow-missing"), (0, fewer, same)):
                self.assertEqual(self.run_command(*arguments)[0], code, arguments)
            self.assertIn("mean was 1.25, now 1.2875 (+3.0 %)", self.run_command(same, worse)[1])
            result = self.run_command(same, worse, "--format", "json")[1]
            self.assertEqual(json.loads(result)["regressions"], 1)

    def test_invalid_tolerances(self):
        for tolerance in ("-1%", "much", "200%", "nan", "%"):
            with self.assertRaises(argparse.ArgumentTypeError, msg=tolerance):
                compare.tolerance_of(tolerance)


if __name__ == "__main__":
    unittest.main()
