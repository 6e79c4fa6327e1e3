import contextlib
import io
import pathlib
import subprocess
import tempfile
import types
import unittest
from unittest import mock

from .. import mutants
from ..rows import ROOT

SOURCE = """// a < b in a comment
#include <vector>
bool near(const Point& p, std::vector<int>& list) {
  if (p.x() < 2.5) return true;
  const std::lock_guard lock(mutex);
  for (std::size_t i = 0; i + 1 < list.size(); ++i) context.check();
  context.check();
  say("a < b", std::min(p[1], kMost));  // one + two
  return false;
}
"""


def changes(source=SOURCE):
    return {(mutant["line"], mutant["operator"], mutant["after"])
            for mutant in mutants.mutants_of("validation/near.cpp", source)}


class Mutants(unittest.TestCase):
    def test_changes_of_a_source(self):
        self.assertEqual(changes(), {
            (4, "axis", "if (p.y() < 2.5) return true;"), (4, "comparison", "if (p.x() <= 2.5) return true;"),
            (4, "logic", "if (p.x() < 2.5) return false;"), (4, "threshold", "if (p.x() < 5.0) return true;"),
            (5, "dropped step", ";"),
            (6, "number", "for (std::size_t i = 1; i + 1 < list.size(); ++i) context.check();"),
            (6, "number", "for (std::size_t i = 0; i + 2 < list.size(); ++i) context.check();"),
            (6, "comparison", "for (std::size_t i = 0; i + 1 <= list.size(); ++i) context.check();"),
            (6, "arithmetic", "for (std::size_t i = 0; i - 1 < list.size(); ++i) context.check();"),
            (7, "dropped step", ";"),
            (8, "axis", 'say("a < b", std::min(p[0], kMost));  // one + two'),
            (8, "extreme", 'say("a < b", std::max(p[1], kMost));  // one + two'),
            (9, "logic", "return true;")})

    def test_of_the_project(self):
        found = mutants.all_mutants(ROOT, ["validation"])
        self.assertGreater(len(found), 2000)
        self.assertFalse([mutant for mutant in found if "test" in mutant["file"]])
        chosen = mutants.sample(found, 90)
        self.assertEqual(mutants.sample(found, 45), chosen[:45])
        self.assertGreater(len({mutant["operator"] for mutant in chosen}), 7)
        for mutant in chosen:
            lines = (ROOT / mutant["file"]).read_text().split("\n")
            self.assertEqual(lines[mutant["line"] - 1].strip(), mutant["before"])
            self.assertNotEqual(mutant["before"], mutant["after"])


class Run(unittest.TestCase):
    """Tries the mutants of one source with tests that notice nothing but comparisons."""

    def setUp(self):
        self.root = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.tree = self.root / "bench/tree"
        self.source = self.tree / "validation/near.cpp"
        self.source.parent.mkdir(parents=True)
        self.source.write_text(SOURCE)
        program = self.tree / "build/release/validation/validation_test"
        program.parent.mkdir(parents=True)
        self.tried, self.interrupted = [], False

        def run(_, *command, **__):
            code, out, text = 0, "", self.source.read_text()
            if command[0] == "ninja":
                code = int("std::max" in text)  # a mutant that does not compile
                program.write_text(text.replace(";;", ";").replace("  ;\n  ;", ""))
            if command[0] in ("ctest", program):
                if self.interrupted and text != SOURCE:
                    raise KeyboardInterrupt
                self.tried.append((text, command))
                if command[0] == "ctest" and "y()" in text:
                    code, out = 8, "The following tests FAILED:\n\t  3 - Near.Point (Failed)\n"
                if command[0] == program and "<= " in text:
                    code, out = 1, "[  FAILED  ] Near.Point (3 ms)\n"
            return subprocess.CompletedProcess(command, code, out or "commit\n", "")

        self.enterContext(mock.patch.object(mutants.Bench, "run", run))

    def command(self, **changes):
        arguments = {"out": self.root / "rows", "keep": self.root / "bench", "directory": "validation",
                     "count": 100, "shard": (1, 1), "tier": "default", "jobs": 1, "only_list": False,
                     "headers": False}
        with contextlib.redirect_stdout(io.StringIO()) as out, contextlib.redirect_stderr(io.StringIO()):
            code = mutants.run(types.SimpleNamespace(**arguments | changes))
        return code, out.getvalue()

    def test_outcomes(self):
        code, out = self.command()
        self.assertEqual(code, 3)
        rows = mutants.read_rows(self.root / "rows")
        self.assertEqual(len(rows), len(changes()))
        found = {row["after"]: (row["outcome"], row["by"]) for row in rows.values()}
        self.assertEqual(found["if (p.x() <= 2.5) return true;"], ("noticed", "Near.Point"))
        self.assertEqual(found["if (p.y() < 2.5) return true;"], ("noticed", "Near.Point"))
        self.assertEqual(found["return true;"], ("survived", ""))
        self.assertIn(("not compiled", ""), found.values())
        self.assertIn("| all | all | 3 |", out)
        self.assertEqual(self.source.read_text(), SOURCE)

    def test_the_tests_of_its_folder_come_first(self):
        (self.source.parent / "near_test.cpp").write_text("TEST(Near, Point) {}\nTEST_P(All, Point) {}\n")
        self.command()
        first = next(command for text, command in self.tried if "<= " in text)
        self.assertIn("--gtest_filter=All.*:*/All.*:Near.*:*/Near.*-Slow.*", first)

    def test_resumes_and_is_sharded(self):
        self.interrupted = True
        with self.assertRaises(KeyboardInterrupt):
            self.command()
        self.interrupted = False
        self.assertEqual(self.source.read_text(), SOURCE)
        for shard in ((1, 2), (2, 2)):
            self.command(shard=shard)
        once = len(self.tried)
        self.assertEqual(len(mutants.read_rows(self.root / "rows")), len(changes()))
        self.command()
        self.assertEqual(len(self.tried), once)

    def test_survivors_of_their_directory_are_tried_again(self):
        self.assertEqual(self.command(tier="directory")[0], 0)
        outcomes = [row["outcome"] for row in mutants.read_rows(self.root / "rows").values()]
        self.assertIn("survived its directory", outcomes)
        self.assertNotIn("survived", outcomes)
        self.command()
        outcomes = [row["outcome"] for row in mutants.read_rows(self.root / "rows").values()]
        self.assertNotIn("survived its directory", outcomes)

    def test_argued_mutants_are_equivalent(self):
        self.command()
        survivors = [key for key, row in mutants.read_rows(self.root / "rows").items()
                     if row["outcome"] == "survived"]
        table = self.root / "equivalent.tsv"
        table.write_text("# head\n" + "".join(f"{key}\tno caller passes it\n" for key in survivors))
        with mock.patch.object(mutants, "EQUIVALENT", table):
            code, out = self.command()
        self.assertEqual(code, 0)
        self.assertIn(f"| all | all | 3 | 0 | {len(survivors)} |", out)
