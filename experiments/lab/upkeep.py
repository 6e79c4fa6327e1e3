"""Measurements of the project: the tests that decide claims, and the time to reproduce the thesis."""

import fnmatch
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time

from . import claims, experiment
from .rows import ROOT, LabError, read_rows
from .stale import measured_table


def _gtest(file, *options):
    """Returns the report of a test program, and 1 if it ended badly; {} if it crashed."""
    with tempfile.TemporaryDirectory() as directory:
        report = pathlib.Path(directory, "tests.json")
        ended = subprocess.run([file, f"--gtest_output=json:{report}", *options], capture_output=True)
        return json.loads(report.read_text()) if report.exists() else {}, int(ended.returncode != 0)


def _tests_of(report):
    """Returns [(name, result)] of a report."""
    return [(f"{suite['name']}.{test['name']}", test.get("result"))
            for suite in report.get("testsuites", []) for test in suite["testsuite"]]


def measure_tests(parameters, wants, program, progress):
    """Yields a row for each test, or pattern of tests, that a claim names; skipped tests did not run."""
    named = {test for claim in claims.read_claims(ROOT / "paper/claims.toml") for test in claim.tests}
    directory = program.file.resolve().parent
    files = [file for file in directory.rglob("*_test") if file.is_file() and os.access(file, os.X_OK)]
    if not files:
        raise LabError(f"there are no test programs in {directory}; build all targets")
    known = {file: [name for name, _ in _tests_of(_gtest(file, "--gtest_list_tests")[0])]
             for file in sorted(files, key=lambda file: file.name)}
    for pattern in sorted(filter(wants, named)):
        progress(f"test {pattern}")
        values = {"ran": 0, "failures": 0}
        for file in (file for file, tests in known.items() if fnmatch.filter(tests, pattern)):
            report, is_bad = _gtest(file, f"--gtest_filter={pattern}")
            values["ran"] += sum(result == "COMPLETED" for _, result in _tests_of(report))
            values["failures"] += report.get("failures") or is_bad
            values["program"] = file.name
        broken = ["no test of this name ran"] * (values["ran"] == 0)
        broken += ["a test failed"] * (values["failures"] > 0)
        yield pattern, values | {"passed": int(not broken)}, broken


def measure_reproductions(parameters, wants, program, progress):
    """Yields a row for each table and figure of the thesis; its experiment is run as a user would run it."""
    for each in experiment.list_experiments():
        numbers = [(number, number.replace("_", " ", 1).replace("_", ".")) for number in each["shows"]]
        if not any(wants(shown) for _, shown in numbers):
            continue
        progress(f"run {each['name']}")
        with tempfile.TemporaryDirectory() as scratch:
            start = time.monotonic()
            command = [sys.executable, "-m", "experiments.lab", "run", "--quiet", "--out", scratch, "--tier",
                       parameters["tier"], str(each["file"])]
            ended = subprocess.run(command, cwd=ROOT, capture_output=True)
            out = pathlib.Path(scratch)
            values = {"experiment": each["name"], "minutes": (time.monotonic() - start) / 60,
                      "rows": len(read_rows(out)) if (out / "rows.jsonl").exists() else 0,
                      "pictures": len(list(out.rglob("*.png"))), "exit_code": ended.returncode}
        # A broken guarantee is a finding of the experiment; without rows it did not run.
        failed = not values["rows"] or ended.returncode not in (0, 3)
        broken = ["the experiment gave no rows, or ended with another code than 0 or 3"] if failed else []
        for number, shown in numbers:
            yield shown, {"command": f"./reproduce {number}"} | values, broken


MEASUREMENTS = [
    {"name": "tests", "measure": measure_tests, "parameters": [], "table": "tests",
     "shown": measured_table("tests that decide claims", "test", {
         "program": "the test program that has it", "ran": "tests of that name that ran",
         "failures, failed": "of these, those that failed", "passed": "1 if some ran and none failed"})},
    {"name": "reproductions", "measure": measure_reproductions, "table": "numbers",
     "parameters": [{"name": "tier", "default": "quick", "choices": ["quick", "full"],
                     "help": "tier of the experiments"}],
     "shown": measured_table("tables and figures of the thesis", "number", {
         "command": "what reproduces it, once the program is built", "experiment": "that makes it",
         "minutes": "that the experiment took, all its tables and figures included", "rows": "that it gave",
         "pictures": "that it drew", "exit_code, exit code": "0, or 3 where a promise was found broken"})}]
