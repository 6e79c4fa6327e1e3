import argparse
import contextlib
import io
import json
import pathlib
import subprocess
import tempfile
import unittest

from .. import claims
from ..database import RowDatabase
from ..rows import ROOT, LabError

COMMIT = "a" * 40
# Of 1000 and 240 points the quotient is 4.17.
RULE = """printed = 4
ours = "SELECT a.points * 1.0 / b.points AS reduction FROM count a, count b WHERE a.label = '0' AND b.label = '50'"
reproduced = "abs(reduction / printed - 1) < 0.01"
shape = "abs(reduction / printed - 1) < 0.1"
doctored = "UPDATE count SET points = 100 WHERE label = '50'"
"""
SECONDS = """ours = "SELECT seconds FROM race"
reproduced = "seconds = 2"
doctored = "UPDATE race SET seconds = 1"
"""


def extraction_row(label, seconds, distance, **changes):
    """Returns a row with distances in world units, where a voxel is half a unit."""
    return {"experiment": "race", "tier": "quick", "run": "first", "commit": COMMIT, "dirty": False,
            "case": {"name": "ball", "origin": "data folder", "sha256": "abc"}, "resolution": 40,
            "voxel_size": 0.5,
            "columns": ["seconds", "to_max"], "variant": {"name": "toy", "label": label, "options": "size=1"},
            "report": {"to_reference": {"max": distance}}, "broken": ["one", "two"],
            "seconds": {"median": seconds}, **changes}


def measured_row(label, **values):
    columns = [{"name": name, "header": name, "meaning": "m"} for name in values]
    return {"experiment": "count", "tier": "quick", "run": "first", "commit": COMMIT, "dirty": False,
            "measurement": {"name": "count"}, "case": {"name": "thesis"},
            "variant": {"name": label, "label": label},
            "table": {"title": "t", "first_column": "threshold", "columns": columns}, "threads": 2,
            "values": values}


def claim_text(rule, name="one", kind="measured"):
    return f'[[claim]]\nid = "{name}"\nplace = "table 1"\nsays = "It says."\nkind = "{kind}"\n{rule}\n'


class Directory(unittest.TestCase):
    """A temporary directory for a checkout."""

    def setUp(self):
        directory = tempfile.TemporaryDirectory()
        self.addCleanup(directory.cleanup)
        self.root = pathlib.Path(directory.name)

    def write(self, name, text):
        (self.root / name).parent.mkdir(parents=True, exist_ok=True)
        (self.root / name).write_text(text)

    def read(self, name):
        return (self.root / name).read_text()

    def put(self, directory, *rows):
        self.write(f"results/{directory}/rows.jsonl", "".join(json.dumps(row) + "\n" for row in rows))

    def git(self, *words):
        git = ["git", "-C", self.root, "-c", "user.name=n", "-c", "user.email=e"]
        return subprocess.run([*git, *words], check=True, capture_output=True, text=True).stdout.strip()


class Checkout(Directory):
    """A checkout with one claim, and results of two experiments and two tests."""

    def setUp(self):
        super().setUp()
        self.put("race", extraction_row("slow", 2.0, 0.25), extraction_row("fast", 0.5, 0.5))
        self.put("count", measured_row("0", points=1000), measured_row("50", points=240))
        self.put("tests", measured_row("Suite.Passes", passed=1), measured_row("Suite.Fails", passed=0))
        self.write("paper/claims.toml", claim_text(RULE))

    def only_claim(self, rule, **keys):
        self.write("paper/claims.toml", claim_text(rule, **keys))
        rows = RowDatabase()
        rows.add_directories(self.root / "results")
        return claims.read_claims(self.root / "paper/claims.toml")[0], rows

    def judged(self, rule, **keys):
        return claims.judge(*self.only_claim(rule, **keys))


class Verdicts(Checkout):
    def test_the_rows_decide(self):
        shape = self.judged(RULE)
        self.assertEqual(shape.verdict, "shape reproduced")
        self.assertEqual(shape.values, {"reduction": 1000 / 240})
        self.assertEqual(self.judged(RULE.replace("printed = 4", "printed = 4.15")).verdict, "reproduced")
        wrong = RULE.replace("printed = 4", "printed = 5")
        self.assertEqual(self.judged(wrong).verdict, "missing")
        self.assertIn("why", self.judged(wrong).reason)
        self.assertEqual(self.judged(wrong + 'why = ["One.", "Two."]').verdict, "contradicted")
        self.assertEqual(self.judged('untestable = "no host"', kind="untestable").verdict, "untestable")
        named = RULE.replace("printed = 4", "printed = { low = 4, high = 5 }")
        named = named.replace("abs(reduction / printed - 1) < 0.01",
                              "reduction BETWEEN printed_low AND printed_high")
        self.assertEqual(self.judged(named).verdict, "reproduced")

    def test_missing_rows(self):
        for rule, reason in ((RULE.replace("b.label = '50'", "b.label = '60'"), "no such row of count"),
                             (RULE.replace("count b", "nowhere b"), "nowhere"),
                             (RULE.replace("a.points * 1.0 / b.points", "nullif(1, 1)"), "reduction: count"),
                             ('tests = ["Suite.Passes", "Suite.Fails"]', "Suite.Fails"),
                             ('tests = "Suite.Never"', "Suite.Never"),
                             (RULE + 'tests = "Suite.Fails"', "Suite.Fails")):
            judged = self.judged(rule)
            self.assertEqual(judged.verdict, "missing")
            self.assertIn(reason, judged.reason)
        with self.assertRaisesRegex(LabError, "claim one: .*b.pints"):
            self.judged(RULE.replace("b.points", "b.pints"))

    def test_tests_decide(self):
        passes = 'tests = "Suite.Passes"'
        self.assertEqual(self.judged(passes).verdict, "reproduced")
        self.assertEqual(self.judged(passes + '\npassed = "shape reproduced"').verdict, "shape reproduced")

    def test_rows_that_cannot_be_trusted_are_a_warning(self):
        self.put("stale", measured_row("race", differing=2), measured_row("count", differing=0))
        self.assertEqual(len(self.judged(SECONDS).warnings), 1)
        self.assertEqual(self.judged(RULE).warnings, [])
        self.put("race", extraction_row("slow", 2.0, 0.25, dirty=True,
                                        case={"name": "ball", "origin": "stand-in: ball", "sha256": "abc"}))
        judged = self.judged(SECONDS)
        self.assertEqual(judged.verdict, "reproduced")
        self.assertEqual(len(judged.warnings), 3)


class Doctor(Checkout):
    def test_finds_rules_that_cannot_fail(self):
        for old, new, problem in (("points = 100 WHERE", "points = 241 WHERE", "verdict"),
                                  ("WHERE label = '50'\"\n", "WHERE label = '60'\"\n", "no row"),
                                  ("abs(reduction / printed - 1) < 0.01", "1 = 1", "verdict"),
                                  ("UPDATE count", "UPDATE nowhere", "no such table")):
            wrong, = claims.rules_that_cannot_fail(*self.only_claim(RULE.replace(old, new)))
            self.assertIn(problem, wrong)

    def test_restores_the_rows(self):
        for rule in (RULE, 'tests = "Suite.Passes"'):
            claim, rows = self.only_claim(rule)
            before = claims.judge(claim, rows)
            self.assertEqual(claims.rules_that_cannot_fail(claim, rows), [])
            self.assertEqual(claims.judge(claim, rows), before)

    def test_every_rule_of_the_project_can_fail(self):
        rows = RowDatabase()
        rows.add_directories(ROOT / "results")
        all_claims = claims.read_claims(ROOT / "paper/claims.toml")
        self.assertGreaterEqual(len(all_claims), 130)
        self.assertEqual([wrong for claim in all_claims
                          for wrong in claims.rules_that_cannot_fail(claim, rows)], [])


class File(Checkout):
    def test_mistakes_are_named(self):
        for text, word in ((claim_text(""), "rule"), (claim_text('tests = "A.B"', kind="guessed"), "kind"),
                           (claim_text('tests = "A.B"\nverdict = "reproduced"'), "verdict"),
                           (claim_text("tests = 1"), "tests"),
                           (claim_text('tests = "A.B"\npassed = "maybe"'), "passed"),
                           (claim_text('tests = "A.B"\nuntestable = "No."', kind="untestable"), "untestable"),
                           (claim_text('ours = "SELECT 1 AS a"\nreproduced = "a = 1"'), "doctored"),
                           (claim_text('ours = "SELECT 1 AS a"\ndoctored = "x"'), "condition"),
                           (claim_text(RULE) * 2, "two claims one"),
                           ("[[claim]]\nid = \"one\"", "one.*place"),
                           ("", "claim"), ("claim = [1]", "claim"), ("[[claim", "claims.toml")):
            self.write("paper/claims.toml", text)
            with self.assertRaisesRegex(LabError, word, msg=text):
                claims.read_claims(self.root / "paper/claims.toml")
        with self.assertRaises(LabError):
            claims.read_claims(self.root / "paper/other.toml")

    def test_a_place_names_tables_and_figures(self):
        for place, number, expected in (
                ("figures 9.8 to 9.10", "figure_9_9", True), ("figures 9.8 to 9.10", "figure_9_11", False),
                ("figures 9.8 to 9.10", "table_9_9", False), ("tables 9.1 and 9.4", "table_9_4", True),
                ("tables 9.1 and 9.4", "table_9_3", False), ("table 9.1, implied", "table_9_1", True),
                ("figure 9.15", "figure_9_1", False), ("section 9.1", "table_9_1", False),
                ("table 9.2", "Table 9.2", True), ("table 9.2", "9.2", False)):
            claim = claims.Claim("x", place, "It says.", "exact", tests=("A.B",))
            self.assertEqual(claims.is_of(claim, number), expected, (place, number))


class Command(Checkout):
    def run_claims(self, text, *words):
        self.write("paper/claims.toml", text)
        parser = argparse.ArgumentParser()
        claims.add_command(parser.add_subparsers())
        arguments = parser.parse_args(["claims", "--file", str(self.root / "paper/claims.toml"),
                                       "--results", str(self.root / "results"), *words])
        with contextlib.redirect_stdout(io.StringIO()) as out:
            code = arguments.function(arguments)
        return code, out.getvalue()

    def test_exit_codes_and_output(self):
        both = claim_text(RULE) + claim_text('tests = "Suite.Passes"', "two", "exact")
        code, text = self.run_claims(both)
        self.assertEqual(code, 0)
        self.assertIn("| one | table 1 | It says. | 4 | 4.17 | shape reproduced |", text)
        self.assertTrue(text.endswith("\n2 claims: 1 reproduced, 1 shape reproduced, 0 contradicted, 0 "
                                      "untestable, "
                                      "0 missing.\n"))
        code, text = self.run_claims(both, "--format", "json", "--id", "tw")
        self.assertEqual([(each["id"], each["verdict"]) for each in json.loads(text)],
                         [("two", "reproduced")])
        self.assertEqual(self.run_claims(both, "--doctor"), (0, ""))
        cannot_fail = claim_text(RULE.replace("points = 100 WHERE", "points = 241 WHERE"))
        self.assertEqual(self.run_claims(cannot_fail, "--doctor")[0], 3)
        self.assertEqual(self.run_claims(claim_text('tests = "Suite.Fails"'))[0], 3)
        for words in (("--id", "three"), ("--of", "table_9_2")):
            with self.assertRaises(LabError):
                self.run_claims(both, *words)


if __name__ == "__main__":
    unittest.main()
