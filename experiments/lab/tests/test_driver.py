import argparse
import dataclasses
import io
import itertools
import os
import pathlib
import random
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from unittest import mock

from .. import child, driver, merge, program, stale
from ..rows import LabError, append_rows, latest_groups, read_rows, text_at

TOY = pathlib.Path(__file__).parent / "toy_cell.py"
NAMES = ("good good2 crashing hanging talking hungry forking leaving refusing garbled slow poisonous fragile "
         "broken unsteady").split()
DESCRIPTION = {
    "extractors": [{"name": name, "options": []} for name in NAMES],
    "voxelizers": [{"name": name, "options": []} for name in ("plain", "crashing")],
    "cases": ["box", "beam", "brick"], "commit": "0" * 40, "dirty": False, "build": {}, "libraries": {},
    "threads": 2, "measurements": [{"name": "letters", "parameters": [],
                                    "tables": [{"name": "letters", "columns": ["value"]}]}]}
PROGRAM = program.Program([sys.executable, "-S", str(TOY)], TOY, DESCRIPTION)
LETTERS = 'kind = "measurement"\nmeasurement = "letters"\nquestion = "why?"\n[quick]\n'
TWO_CASES = '{ name = "box", resolutions = [8, 9] }, { name = "beam", resolutions = [8] }'


def outcome(row):
    return text_at(row, "/failed") or text_at(row, "/digest")


def is_running(pid):
    """Returns True for a process that is not a zombie."""
    try:
        return pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


def children_of(pid):
    try:
        return [int(each) for each in pathlib.Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]
    except OSError:
        return []


def wait_until(condition):
    for _ in range(500):
        if condition():
            return True
        time.sleep(0.01)
    return False


class Runs(unittest.TestCase):
    """Runs toys. The plots are not drawn."""

    def setUp(self):
        self.root = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.enterContext(mock.patch("experiments.lab.tables.write_plots"))
        self.enterContext(mock.patch("experiments.lab.program.checked_out", return_value=("0" * 40, False)))
        dates = itertools.count()  # each run has another date
        self.enterContext(mock.patch("experiments.lab.driver.provenance", lambda *given: (
            program.provenance(*given) | {"date": f"date {next(dates)}"})))
        self.out, self.file, self.said = self.root / "out", self.root / "toy.toml", ""

    def write(self, variants, cases='{ name = "box", resolutions = [8] }', voxelizers='"plain"'):
        names = ", ".join(f'{{ name = "{name}" }}' for name in variants.split())
        self.file.write_text(
            f'question = "why?"\nvoxelizers = [{voxelizers}]\ncolumns = ["triangles"]\nvariants = [{names}]\n'
            f"[quick]\npixels = 0\ncases = [{cases}]\n")

    def run_toys(self, *words, out=None):
        """Runs the experiment with these words of the command line; returns the exit code."""
        usual = ["--out", out or self.out, "--timeout", "20", "--quiet"]
        run = driver.Run(driver.arguments_of(self.file, *usual, *words), PROGRAM)
        code, self.said = run.execute()
        self.notes = list(run.notes)
        return code

    def rows(self):
        return read_rows(self.out)

    def outcomes(self):
        return [(row["case"]["name"], row["resolution"], outcome(row)) for row in self.rows()]


class Children(Runs):
    def test_each_misbehaviour_is_a_row_and_the_others_go_on(self):
        self.write("good crashing hanging talking leaving refusing garbled good2")
        self.assertEqual(self.run_toys("--timeout", 1), 1)
        good, *failed, garbled, good2 = map(outcome, self.rows())
        self.assertEqual(failed, ["crashed (Segmentation fault)", *["took longer than 1 s"] * 2,
                                  "ended before it was done", "ended with exit code 7"])
        for digest in (good, garbled, good2):
            self.assertRegex(digest, "^[0-9a-f]{16}$")
        self.assertIn("FAILED: 5 of 8 cells; the first is box/8/crashing: crashed", self.said)

    def test_memory_of_the_process_is_limited(self):
        self.write("good hungry")
        self.assertEqual(self.run_toys("--memory", 200), 1)
        self.assertEqual(outcome(self.rows()[1]), "took more than 200 MiB of memory")

    def test_children_of_a_run_without_network_do_not_download(self):
        self.write("good")
        seen = []
        run_group = driver.Run._run_group
        for before in None, "", "1":
            with mock.patch.dict(os.environ, HERMESH_OFFLINE=before or ""), \
                    mock.patch("experiments.lab.models.fetch", return_value="no network"), \
                    mock.patch.object(driver.Run, "_run_group", lambda run, group: (
                        seen.append(os.environ["HERMESH_OFFLINE"]), run_group(run, group))[1]):
                if before is None:
                    del os.environ["HERMESH_OFFLINE"]
                self.run_toys("--again")
                self.assertEqual(os.environ.get("HERMESH_OFFLINE"), before)
        self.assertEqual(seen, ["no network", "no network", "1"])

    def test_descendants_are_ended_with_the_child(self):
        self.write("forking")
        with mock.patch.dict(os.environ, TOY_PID=str(self.root / "pid")):
            self.run_toys("--timeout", 0.7)
        pid = int((self.root / "pid").read_text())
        self.assertTrue(wait_until(lambda: not is_running(pid)))

    def test_a_crash_that_another_cell_caused_is_none_alone(self):
        self.write("poisonous fragile")
        self.assertEqual(self.run_toys(), 0)
        self.assertEqual([bool(row.get("notes")) for row in self.rows()], [False, True])

    def test_a_crash_before_any_variant_fails_all(self):
        self.write("good good2", voxelizers='"crashing", "plain"')
        self.assertEqual(self.run_toys(), 1)
        self.assertEqual(["failed" in row for row in self.rows()], [True, True, False, False])
        self.assertEqual(self.rows()[0]["voxelization"], {"label": "crashing"})

    def test_in_process_a_crash_ends_the_run(self):
        self.write("good crashing")
        with self.assertRaises(LabError):
            self.run_toys("--in-process")

    def test_exceptions_of_the_caller_end_the_child(self):
        pids = []

        def progress(stage):
            pids.extend(children_of(os.getpid()))
            raise KeyboardInterrupt

        job = {"kind": "extraction", "case": "box", "require_data": False, "resolution": 8, "head": {},
               "voxelizer": None, "threads": 1, "variants": [{"name": "talking", "label": "talking"}]}
        with self.assertRaises(KeyboardInterrupt):
            child.work(PROGRAM.command, job, progress=progress)
        self.assertEqual([is_running(pid) for pid in pids], [False])


class Codes(Runs):
    def test_a_broken_guarantee_outweighs_a_failure(self):
        self.write("crashing broken")
        self.assertEqual(self.run_toys(), 3)
        self.assertIn("BROKEN: broken on box", self.said)
        self.assertEqual(driver.exit_code([{"failed": "x"}, {"disagreements": ["y"]}]), 3)
        self.assertEqual(driver.exit_code([{"failed": "not installed", "absent": True}]), 0)

    def test_required_data_fail_only_their_cells(self):
        self.write("good", '{ name = "brick", resolutions = [8] }, { name = "box", resolutions = [8] }')
        self.assertEqual(self.run_toys("--require-data"), 3)
        self.assertEqual([row.get("data_missing", False) for row in self.rows()], [True, False])

    def test_a_filter_without_cells_is_an_error_and_leaves_no_directory(self):
        self.write("good")
        with self.assertRaises(LabError):
            self.run_toys("--filter", "nothing like it")
        self.assertFalse(self.out.exists())


class Resume(Runs):
    def test_continues_where_it_stopped(self):
        self.write("good", '{ name = "box", resolutions = [8, 10] }')
        self.assertEqual(self.run_toys("--filter", "/8/"), 0)
        self.assertEqual(self.run_toys(), 0)
        first, second = self.rows()
        self.assertEqual((first["resolution"], second["resolution"]), (8, 10))
        self.assertEqual(first["run"], second["run"])
        rows = self.out / "rows.jsonl"
        os.truncate(rows, rows.stat().st_size - 7)  # a torn row is made again
        for words, count in (([], 2), ([], 2), (["--again"], 4)):
            self.run_toys(*words)
            self.assertEqual(len(self.rows()), count)

    def test_rows_of_another_program_or_setting_do_not_count(self):
        self.write("good")
        for words, count in (([], 1), (["--repetitions", 2], 2), (["--threads", 1], 3)):
            self.run_toys(*words)
            self.assertEqual(len(self.rows()), count)
        rows = [row | {"binary": "another"} for row in self.rows()]
        (self.out / "rows.jsonl").unlink()
        append_rows(self.out / "rows.jsonl", rows)
        self.run_toys()
        self.assertEqual(len(self.rows()), 4)

    def test_rows_of_an_edited_file_replace_those_before(self):
        self.write("good good2", TWO_CASES)
        self.run_toys()
        for before, after in (("pixels = 0", "pixels = 0\nsamples = 7"), ("good2", "slow")):
            text = self.file.read_text()
            self.assertIn(before, text)
            self.file.write_text(text.replace(before, after))
            self.run_toys()
            groups = latest_groups(self.rows())
            self.assertEqual([len(group.rows) for group in groups], [2, 2, 2], after)
        self.assertEqual([text_at(row, "/variant/label") for row in groups[0].rows], ["good", "slow"])

    def test_cells_of_an_unchanged_outside_program_are_not_run_again(self):
        tool = self.root / "tool"
        tool.write_text("#!/bin/sh\n")
        self.write("good")
        mine = f'{{ label = "mine", command = "sh {tool} {{in}} {{out}}" }}'
        self.file.write_text(self.file.read_text().replace('{ name = "good" }', '{ name = "good" }, ' + mine))
        self.run_toys()
        count = len(self.rows())
        self.run_toys()
        self.assertEqual(len(self.rows()), count)
        self.assertIn("2 cells were in", " ".join(self.notes))
        tool.write_text("#!/bin/sh\nexit 1\n")
        self.run_toys()
        self.assertEqual(len(self.rows()), 2 * count)
        self.assertEqual(driver.outside_hash(""), "")
        self.assertNotEqual(driver.outside_hash("sh {in}"), driver.outside_hash("sh {out}"))

    def test_unreadable_cases_fail_alone_and_are_run_again_when_they_can_be_read(self):
        mesh = self.root / "mesh.off"
        self.write("good good2", TWO_CASES.replace("beam", str(mesh)).replace(", 9", ""))
        for content, code, count in ((None, 1, 4), (None, 1, 4), ("OFF", 0, 6), ("other data", 0, 8)):
            if content:
                mesh.write_text(content)
            self.assertEqual(self.run_toys(), code)
            self.assertEqual(len(self.rows()), count)
        self.assertEqual(["failed" in row for row in self.rows()], [False] * 2 + [True] * 2 + [False] * 4)
        self.assertNotEqual(self.rows()[-1]["run"], self.rows()[-3]["run"])

    def test_a_measurement_keeps_the_rows_before_its_crash(self):
        self.file.write_text(LETTERS)
        trap = self.root / "trap"
        trap.touch()
        with mock.patch.dict(os.environ, TOY_TRAP=str(trap)):
            self.assertEqual(self.run_toys(), 1)
            self.assertEqual([text_at(row, "/failed") for row in self.rows()], ["", "", "crashed (Aborted)"])
            trap.unlink()
            self.assertEqual(self.run_toys(), 0)
        labels = [row["variant"]["label"] for row in self.rows() if "failed" not in row]
        self.assertEqual(labels, list("abcde"))

    def test_killed_runs_leave_no_child_and_lose_no_row(self):
        """Kills runs at random moments, with fixed seeds."""
        self.write("good slow crashing", TWO_CASES)
        self.run_toys()
        undisturbed = self.outcomes()
        (self.out / "rows.jsonl").unlink()
        command = [sys.executable, "-m", __name__, str(self.file), "--out", str(self.out)]
        generator = random.Random(20110701)
        for number, code in ((signal.SIGKILL, -9), (signal.SIGTERM, 143), (signal.SIGINT, 130)):
            process = subprocess.Popen(command, stderr=subprocess.DEVNULL)
            self.assertTrue(wait_until(lambda: children_of(process.pid)))
            time.sleep(generator.uniform(0, 0.3))
            below = children_of(process.pid)
            process.send_signal(number)
            self.assertIn(process.wait(60), (0, 1, code, -number))  # the last if it was ending already
            for pid in below:
                self.assertTrue(wait_until(lambda: not is_running(pid)), number)
        self.run_toys()
        self.assertEqual(self.outcomes(), undisturbed)


class Overrides(Runs):
    def test_unknown_names_and_idle_parameters_are_errors(self):
        self.write("good")
        for words in (["--variant", "goood"], ["--case", "bricks"], ["--set", "seed=2"], ["--tier", "full"]):
            with self.assertRaises(LabError):
                self.run_toys(*words)
        self.file.write_text(LETTERS)
        for words in (["--variant", "good"], ["--set", "size=2"], ["--shard", "1/2"]):
            with self.assertRaises(LabError):
                self.run_toys(*words)

    def test_words_that_do_not_go_together_are_errors_of_usage(self):
        for words in (["--shard", "1/2"], ["--shard", "1/2", "--out", "x", "--filter", "y"],
                      ["--in-process", "--memory", 99], ["--set", "a=1", "a=2"], ["--set", "a"],
                      ["--resolution", 1], ["--shard", "2"], ["--shard", "0/3"], ["--shard", "4/3"],
                      ["--shard", "2/3/4"], ["--shard", "1/10001"]):
            with mock.patch("sys.stderr", io.StringIO()), self.assertRaises(SystemExit) as caught:
                driver.run(driver.arguments_of("toy", *words))
            self.assertEqual(caught.exception.code, 2)


class Shards(Runs):
    def test_partition_deals_the_heaviest_first_to_the_lightest(self):
        # 9, 7 and 6 go to one each; 5 joins 6 (11), 4 joins 7 (11), 3 joins 9 (12), 1 joins the first 11.
        self.assertEqual(driver.partition([1, 3, 4, 5, 6, 7, 9], 3), [2, 1, 2, 3, 3, 2, 1])
        self.assertEqual(driver.partition([], 2), [])

    def test_partition_is_balanced(self):
        """Graham's bound, with the mean and the largest weight as lower bounds of the optimum."""
        generator = random.Random(20110702)
        for _ in range(200):
            weights = [generator.randint(1, 1000) for _ in range(generator.randint(1, 60))]
            shards = generator.randint(1, 8)
            sums = [0] * shards
            for weight, shard in zip(weights, driver.partition(weights, shards)):
                sums[shard - 1] += weight
            self.assertLessEqual(max(sums), sum(weights) / shards + (1 - 1 / shards) * max(weights))

    def test_merged_shards_are_the_rows_of_an_undivided_run(self):
        self.write("good crashing good2", TWO_CASES)
        self.assertEqual(self.run_toys(), 1)
        folders = [self.root / str(number) for number in (1, 2, 3, 4)]
        codes = [self.run_toys("--shard", f"{folder.name}/4", out=folder) for folder in folders]
        self.assertEqual(codes, [1, 1, 1, 0])  # three groups leave nothing for the last
        self.assertEqual([(row["cell"], outcome(row)) for row in merge.merged_rows(folders)],
                         [(row["cell"], outcome(row)) for row in self.rows()])
        for taken in (folders[0], self.out):
            with self.assertRaises(LabError):
                self.run_toys("--shard", "2/4", out=taken)


class Conform(Runs):
    def test_bytes_must_not_depend_on_threads(self):
        self.write("good")
        self.enterContext(mock.patch.object(driver, "load_program", return_value=PROGRAM))
        self.enterContext(mock.patch("experiments.lab.experiment.find_experiment", return_value=self.file))
        for name, code in (("good", 0), ("unsteady", 3), ("crashing", 1)):
            arguments = argparse.Namespace(variant=name, out=self.out, quiet=True)
            with mock.patch("sys.stdout", io.StringIO()):
                self.assertEqual(driver.conform(arguments), code, name)
            self.assertEqual([row["threads"] for row in self.rows()], [1, 2, 7])


class AppendedRows(unittest.TestCase):
    def test_a_full_disk_leaves_no_half_of_a_row(self):
        write = os.write
        with tempfile.TemporaryDirectory() as directory:
            file = pathlib.Path(directory, "rows.jsonl")
            append_rows(file, [{"case": 1}])
            before = file.read_bytes()
            with mock.patch("os.write", lambda to, data: write(to, data[:5])):
                with self.assertRaisesRegex(LabError, "full"):
                    append_rows(file, [{"case": 2}])
            self.assertEqual(file.read_bytes(), before)

            def interrupted(to, data):  # by a row of another run
                written = write(to, data[:5])
                with open(file, "ab") as other:
                    other.write(b"{}\n")
                return written

            with mock.patch("os.write", interrupted), self.assertRaises(LabError):
                append_rows(file, [{"case": 2}])
            self.assertTrue(file.read_bytes().endswith(b"{}\n"))


class Provenance(unittest.TestCase):
    def test_kept_rows_need_a_clean_commit(self):
        for state, dirty, is_fine in ((("a", False), False, True), (("a", True), False, False),
                                      (("b", False), False, False), (("a", False), True, False),
                                      (("a", False), None, False), (("unknown", None), False, False)):
            for folder, may_be_kept in (("results/local/x", True), ("results/x", is_fine)):
                with mock.patch("experiments.lab.program.checked_out", return_value=state):
                    try:
                        program.check_may_be_kept(program.ROOT / folder, {"commit": "a", "dirty": dirty})
                        self.assertTrue(may_be_kept)
                    except LabError:
                        self.assertFalse(may_be_kept)

    def test_dirty_if_program_or_checkout_changed(self):
        for state, built, dirty in ((("a", False), False, False), (("a", True), False, True),
                                    (("b", False), False, True), (("unknown", None), False, False),
                                    (("a", False), True, True), (("a", True), None, None)):
            with mock.patch("experiments.lab.program.checked_out", return_value=state):
                row = program.provenance({"commit": "a", "dirty": built, "build": {}, "libraries": {}}, 2)
            self.assertIs(row["dirty"], dirty)


class Stale(Runs):
    def check(self, change=lambda row: row):
        rows = self.rows()
        for row in rows:
            change(row)
        return stale.check_folder(rows, 1, PROGRAM)

    def test_cells_that_differ_are_named(self):
        self.write("good good2", '{ name = "box", resolutions = [8, 10] }')
        self.run_toys()
        self.assertEqual(self.check(), {"rows": 4, "tried": 2, "by_digest": 2, "differing": 0,
                                        "difference": "", "sample": "box/10/plain", "skipped": ""})
        values = self.check(lambda row: row.update(digest="0" * 16))
        self.assertEqual(values["differing"], 2)
        self.assertIn("box/10/plain/good: digest was", values["difference"])
        values = self.check(lambda row: row.pop("digest"))
        self.assertEqual((values["by_digest"], values["differing"]), (0, 0))
        values = self.check(lambda row: row["case"].update(sha256="another"))
        self.assertEqual((values["tried"], bool(values["skipped"])), (0, True))
        for change in (lambda row: row.update(digest=None, voxelization={"active_voxels": 7}),
                       lambda row: row["variant"].update(name="crashing")):
            self.assertEqual(self.check(change)["differing"], 2)

    def test_measurements_give_a_row_of_each_table(self):
        self.file.write_text(LETTERS)
        self.run_toys()
        self.assertEqual([self.check()[key] for key in ("rows", "tried", "differing")], [5, 1, 0])
        self.assertEqual(self.check(lambda row: row["values"].update(digest="0"))["differing"], 1)
        self.assertTrue(self.check(lambda row: row["inputs"][0].update(sha256="0"))["skipped"])


GTEST = """#!/usr/bin/python3 -S
import json, sys
tests = {"A1": "COMPLETED", "A2": "SKIPPED", "B": "COMPLETED"}
words = dict(word.split("=") for word in sys.argv[1:] if "=" in word)
pattern = words.get("--gtest_filter", "*").removeprefix("Suite.").rstrip("*")
own = [{"name": name, "result": result} for name, result in tests.items() if name.startswith(pattern)]
json.dump({"testsuites": [{"name": "Suite", "testsuite": own}], "failures": int(pattern == "B")},
          open(words["--gtest_output"].removeprefix("json:"), "w"))
"""


class OwnMeasurements(Runs):
    """Runs a measurement of the laboratory instead of one of the program."""

    def test_the_tests_of_claims_are_run(self):
        (self.root / "toy_test").write_text(GTEST)
        (self.root / "toy_test").chmod(0o755)
        self.file.write_text(LETTERS.replace("letters", "tests"))
        (self.root / "program").touch()
        toy = dataclasses.replace(PROGRAM, file=self.root / "program")
        named = [mock.Mock(tests=("Suite.A*", "Suite.B")), mock.Mock(tests=("Suite.C",))]
        with mock.patch.object(sys.modules[__name__], "PROGRAM", toy), mock.patch(
                "experiments.lab.claims.read_claims", return_value=named):
            self.assertEqual(self.run_toys("--filter", "Suite.A"), 0)
            self.assertEqual(self.run_toys(), 3)
        values = [(row["variant"]["label"], *(row["values"][key] for key in ("ran", "failures", "passed")))
                  for row in self.rows()]
        self.assertEqual(values, [("Suite.A*", 1, 0, 1), ("Suite.B", 1, 1, 0), ("Suite.C", 0, 0, 0)])
        self.assertEqual(self.rows()[0]["run"], self.rows()[2]["run"])


def main():
    """Runs an experiment as the command does; test_killed_runs_leave_no_child_and_lose_no_row starts it."""
    driver.end_on_signals()
    with mock.patch("experiments.lab.tables.write_plots"):
        try:
            sys.exit(driver.Run(driver.arguments_of(*sys.argv[1:]), PROGRAM).execute()[0])
        except KeyboardInterrupt:
            sys.exit(130)


if __name__ == "__main__":
    main()
