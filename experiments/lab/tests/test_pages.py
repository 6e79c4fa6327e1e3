import hashlib
import unittest

from .. import pages
from ..rows import LabError
from .test_claims import Checkout, extraction_row, measured_row

NUMBERS = """pages = ["page.md"]
[numbers]
speed = "SELECT max(seconds) / min(seconds) FROM race"
range = { query = "SELECT min(points), max(points) FROM count", format = "%.1f" }
alike = "SELECT 4, 4.0"
nobody = "SELECT points FROM count WHERE label = 'nobody'"
lacking = "SELECT max(points) FROM count WHERE label = 'nobody'"
[tables]
all = "SELECT label AS which, seconds AS 'time [s]' FROM race"
[plain]
all = ["Debian 12"]
"page.md" = ["no 7"]
"""


class PagesCase(Checkout):
    def setUp(self):
        super().setUp()
        self.write("paper/numbers.toml", NUMBERS)
        self.write("experiments/cases.toml",
                   '[[case]]\nname = "ball"\nfiles = [{ file = "x", sha256 = "abc" }]\n')
        self.write("page.md", "")

    def filled(self, text):
        self.write("page.md", text)
        pages.fill(self.root)
        return self.read("page.md")

    def problems(self):
        return pages.check(self.root)

    def assert_one_problem(self, word):
        found, = self.problems()
        self.assertIn(word, found)


class Filling(PagesCase):
    def test_fills_pages_tables_and_hashes_once(self):
        page = "It is <!--=speed-->?<!--/--> times as fast on Debian 12, see table 9.2 of 2011, no 7.\n"
        self.write("page.md", page)
        self.assertEqual(len(self.problems()), 1 + 3 + 1)  # a number, three tables, the hashes
        self.assertEqual(set(pages.fill(self.root)),
                         {"page.md", "results/SHA256SUMS", "results/race/table.md",
                                                      "results/count/table.md", "results/tests/table.md"})
        self.assertEqual(self.read("page.md"), page.replace("?", "4"))
        self.assertEqual(self.problems(), [])
        self.assertEqual(pages.fill(self.root), [])
        digest = hashlib.sha256((self.root / "results/race/rows.jsonl").read_bytes()).hexdigest()
        self.assertIn(f"{digest}  race/rows.jsonl\n", self.read("results/SHA256SUMS"))

    def test_markers(self):
        for marker, content in (
                ("range", "240.0 to 1000.0"), ("alike", "4"), ("count", "1"), ("count shape reproduced", "1"),
                ("count reproduced", "0"), ("ablations", "\nNo ablation has rows yet.\n"),
                ("all", "\n| which | time [s] |\n| --- | --: |\n| slow | 2 |\n| fast | 0.5 |\n")):
            self.assertEqual(self.filled(f"a <!--={marker}--><!--/--> b"),
                             f"a <!--={marker}-->{content}<!--/--> b")
        table = self.filled("<!--=table race ball 40--><!--/-->")
        self.assertIn("| slow    |        2 |         0.5 |\n", table)
        self.assertIn("**ball at resolution 40**", table)
        self.assertNotIn("###", table)
        self.assertIn("*time [s]*", self.filled("<!--=legend race--><!--/-->"))
        self.assertIn("| one | table 1 | It says. | 4 | 4.17 |", self.filled("<!--=claims--><!--/-->"))

    def test_a_number_does_not_begin_a_line(self):
        for text in ("<!--=speed-->4<!--/--> times\n", "It is\n  <!--=speed-->4<!--/--> times\n"):
            self.filled(text)
            self.assert_one_problem("speed begins a line")
        self.filled("It is <!--=speed-->4<!--/-->\n\n<!--=all--><!--/-->\n")
        self.assertEqual(self.problems(), [])

    def test_wrong_markers_are_named(self):
        for text, words in (("<!--=speed-->4\n", "page.md:1: .*no end"),
                            ("<!--=speed-->4 <!--=all--><!--/-->", "page.md:1: "),
                            ("\n<!--=sped-->4<!--/-->\n", "page.md:2: .*sped"),
                            ("<!--=nobody--><!--/-->", "no row"),
                            ("<!--=lacking--><!--/-->", "max"),
                            ("<!--=table race cube--><!--/-->", "no such table"),
                            ("<!--=legend absent--><!--/-->", "absent")):
            with self.assertRaisesRegex(LabError, words, msg=text):
                self.filled(text)

    def test_mistakes_in_the_file_of_numbers_are_named(self):
        for text, word in (("[numbers]\nx = { query = \"SELECT 1\", format = \"%s\" }", "x: .*format"),
                           ("[numbers]\nx = { query = \"SELECT 1\", format = \"%f %f\" }", "x: .*format"),
                           ("[numbers]\nx = { form = \"%f\" }", "x: "), ("[number]", "number"),
                           ("pages = 1", "pages"),
                           ("[tables]\nx = 1", "x "), ("[plain]\nall = 'x'", "all "),
                           ("pages = [\"absent.md\"]", "absent.md"), ("pages =", "numbers.toml")):
            self.write("paper/numbers.toml", text)
            with self.assertRaisesRegex(LabError, word, msg=text):
                pages.check(self.root)


class Checking(PagesCase):
    def setUp(self):
        super().setUp()
        self.filled("It is <!--=speed-->?<!--/-->\n<!--=table race ball 40-->\n<!--/-->\n")

    def test_every_digit_that_is_edited_is_found(self):
        self.assertEqual(self.problems(), [])
        for file in ("page.md", "results/race/table.md", "results/count/table.md", "results/race/rows.jsonl",
                     "results/count/rows.jsonl", "results/SHA256SUMS"):
            good = self.read(file)
            digits = [at for at, letter in enumerate(good) if letter.isdigit()]
            for at in digits[::1 + len(digits) // 5]:
                self.write(file, good[:at] + ("8" if good[at] == "7" else "7") + good[at + 1:])
                self.assertNotEqual(self.problems(), [], (file, at))
            self.write(file, good)

    def test_other_problems(self):
        (self.root / "results/race/table.md").unlink()
        self.assert_one_problem("results/race/table.md")
        pages.fill(self.root)
        for text, problem in (("<!--=sped-->four<!--/-->", "sped"), ("It takes 3.5 s.\n", "page.md:1: 3.5")):
            self.write("page.md", text)
            self.assert_one_problem(problem)

    def test_an_input_that_the_cases_do_not_list(self):
        self.write("experiments/cases.toml", self.read("experiments/cases.toml").replace("abc", "def"))
        self.assert_one_problem("results/race: the input ball has the SHA-256 abc")
        made = {"name": "ball", "origin": "generated", "sha256": "abc"}
        self.put("race", extraction_row("slow", 2.0, 0.25, case=made),
                 extraction_row("fast", 0.5, 0.5,
                                inputs=[{"name": "cube", "origin": "data folder", "sha256": "123"}]))
        pages.fill(self.root)
        self.assertEqual(len(self.problems()), 2)

    def test_a_prediction_that_is_younger_than_its_row(self):
        effect = {"level": "50", "column": "points", "measure": "ratio", "better": "lower", "at_least": 0,
                  "at_most": 1, "falsified_if": "low > 1", "prediction": "It shrinks."}
        prediction = {"file": "x.toml", "commit": "a", "date": "2026-01-02T00:00:00Z", "sha256": "b"}
        ablation = {"factor": "f", "levels": "variants", "baseline": "0", "effects": [effect],
                    "prediction": prediction}
        for day, count in ((3, 0), (1, 1)):
            self.put("count", {**measured_row("0", points=1000), "date": f"2026-01-0{day}T00:00:00Z",
                               "ablation": ablation}, measured_row("50", points=240))
            pages.fill(self.root)
            self.assertEqual(len(self.problems()), count)


class Orphans(unittest.TestCase):
    def test_numbers_without_a_marker(self):
        for text, expected in (
                ("It is 14.5 times\nas fast as 1,000 others.", [(1, "14.5"), (2, "1,000")]),
                ("`-o tolerance=0.1`, [x](page-2.md), <!--=a-->5.1 to 7<!--/-->, x86-64, C++20, Debian 12",
                 []),
                ("tables 9.1 to 9.4, (figures 9.15 and 9.16), §5.2, Chapter 6, in 2011", []),
                ("table 9.2 has 12 rows", [(1, "12")]), ("```\n12\n```\n13", [(4, "13")]),
                ("<!-- 4 --> -5 m-6", [(1, "5")]), ("on Debian\n12 and 13", [(2, "13")])):
            self.assertEqual(pages.orphans(text, ["Debian 12"]), expected)


if __name__ == "__main__":
    unittest.main()
