"""Acceptance of rows as a baseline."""

import argparse
import contextlib
import io
import pathlib
import tempfile
import unittest

from .. import baseline
from ..baseline import accepted
from ..rows import LabError, append_rows, read_rows


def row_of(label, **changes):
    return {"experiment": "digests", "run": "1", "commit": "1234", "dirty": False, "case": {"name": "a"},
            "variant": {"label": label}, "digest": "beef"} | changes


class Accepted(unittest.TestCase):
    def test_the_last_run_is_taken(self):
        rows = [row_of("x", failed="earlier"), row_of("x", run="2"), row_of("y", run="2")]
        experiment, taken = accepted(rows, "the normal code is repaired")
        self.assertEqual(experiment, "digests")
        self.assertEqual([row["run"] for row in taken], ["2", "2"])
        date = taken[0]["accepted"]["date"]
        self.assertRegex(date, r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ$")
        self.assertEqual(taken[0]["accepted"],
                         {"reason": "the normal code is repaired", "date": date, "commit": "1234"})

    def test_rows_that_prove_nothing_are_refused(self):
        accepted([row_of("x")], "right")
        accepted([row_of("x", failed="out of luck"), row_of("y", broken=["closed"])], "as printed", True)
        with self.assertRaises(LabError):
            accepted([row_of("x")], " ")
        for changes in ({"dirty": True}, {"dirty": None}, {"commit": "unknown"}, {"commit": ""},
                        {"failed": "out of luck"}, {"broken": ["closed"]}, {"experiment": "../x"}):
            with self.subTest(changes), self.assertRaises(LabError):
                accepted([row_of("x", **changes)], "right")
        for other in ({"experiment": "other"}, {"commit": "5"}):
            with self.subTest(other), self.assertRaises(LabError):
                accepted([row_of("x"), row_of("y", **other)], "right")

    def test_a_baseline_replaces_the_one_before(self):
        with tempfile.TemporaryDirectory() as directory:
            parser = argparse.ArgumentParser()
            baseline.add_command(parser.add_subparsers())
            kept = pathlib.Path(directory) / "kept/digests/rows.jsonl"
            printed = []
            for number, digest in enumerate(("beef", "cafe")):
                rows = pathlib.Path(directory) / f"{number}.jsonl"
                append_rows(rows, [row_of("x", digest=digest), row_of("y")])
                arguments = parser.parse_args(["accept", str(rows), "--reason", digest,
                                               "--baselines", str(kept.parents[1])])
                with contextlib.redirect_stdout(io.StringIO()) as out:
                    self.assertEqual(arguments.function(arguments), 0)
                printed.append(out.getvalue())
            self.assertEqual(printed[0], f"accepted 2 rows as {kept}\n")
            self.assertIn("digest was beef, now cafe", printed[1])
            self.assertEqual([(row["digest"], row["accepted"]["reason"]) for row in read_rows(kept)],
                             [("cafe", "cafe"), ("beef", "cafe")])
            self.assertEqual(list(kept.parent.iterdir()), [kept])  # no draft


if __name__ == "__main__":
    unittest.main()
