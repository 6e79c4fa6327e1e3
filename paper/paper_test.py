#!/usr/bin/env python3
"""What the paper's build refuses: a number that was changed, in the file of macros, in the rows or in the text. Needs
Python alone. Run it by itself, or as `ctest -R paper_numbers`."""

import json
import hashlib
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import check_log
import claims as ledger
import paper_numbers
from paper_numbers import Paper, PaperError, orphans
from row_database import RowDatabase, readable

ROOT = pathlib.Path(__file__).resolve().parent.parent


def project(folder, results=("headline",)):
    """A copy of what the paper is made of, whose results have these folders alone, and a text with one number and one
    table of them."""
    for name in ("experiments", "algorithms"):
        (folder / name).symlink_to(ROOT / name)
    (folder / "paper/sections").mkdir(parents=True)
    for name in ("numbers.toml", "claims.toml"):
        shutil.copy(ROOT / "paper" / name, folder / "paper")
    (folder / "results").mkdir()
    for name in results:
        (folder / "results" / name).mkdir()
        shutil.copy(ROOT / "results" / name / "rows.jsonl", folder / "results" / name)
    seal(folder)
    (folder / "paper/hermesh.tex").write_text("\\begin{document}\\input{sections}\\end{document}\n")
    (folder / "paper/sections/one.tex").write_text("There are \\N{dragon} triangles.\n\\T{dragons}\n")
    (folder / "paper/paper.toml").write_text('''sections = ["one"]
plain = ["ten 10"]
[numbers]
dragon = "SELECT triangles FROM headline WHERE subject = 'dragon' AND label = 'marching-cubes'"
nobody = "SELECT triangles FROM headline WHERE subject = 'nobody'"
lacking = "SELECT max(triangles) AS most FROM headline WHERE subject = 'nobody'"
[tables.dragons]
query = "SELECT label AS 'a|b', triangles FROM headline WHERE subject = 'dragon' ORDER BY rowid LIMIT 2"
''')


def seal(folder):
    """Accepts the rows as they are, as `hermesh report --fill` does."""
    sums = [f"{hashlib.sha256(p.read_bytes()).hexdigest()}  {p.parent.name}/{p.name}\n"
            for p in sorted((folder / "results").glob("*/rows.jsonl"))]
    (folder / "results/SHA256SUMS").write_text("".join(sums))


class Case(unittest.TestCase):
    def setUp(self):
        self.scratch = tempfile.TemporaryDirectory()
        self.root = pathlib.Path(self.scratch.name) / "project"
        self.root.mkdir()
        self.out = self.root / "build"
        project(self.root)

    def tearDown(self):
        self.scratch.cleanup()

    def refused(self, *words):
        """The paper is refused with one sentence that has these words."""
        with self.assertRaises(PaperError) as caught:
            Paper(self.root).write(self.out)
        for word in words:
            self.assertIn(word, str(caught.exception))
        self.assertNotIn("\n", str(caught.exception))

    def change_rows(self, change, folder="headline"):
        path = self.root / "results" / folder / "rows.jsonl"
        rows = [json.loads(line) for line in path.read_text().splitlines()]
        for row in rows:
            change(row)
        path.write_text("".join(json.dumps(row) + "\n" for row in rows))


class Doctored(Case):
    def test_as_it_is_it_is_made_and_verified(self):
        Paper(self.root).write(self.out)
        self.assertEqual(Paper(self.root).verify(self.out), [])
        triangles = [json.loads(line) for line in (ROOT / "results/headline/rows.jsonl").read_text().splitlines()]
        wanted = next(r["triangle_count"] for r in triangles
                      if r["case"]["name"] == "dragon" and r["variant"]["label"] == "marching-cubes")
        self.assertIn(f"\\papernumber{{dragon}}{{{wanted:,}}}", (self.out / "numbers.tex").read_text())

    def test_a_changed_file_of_macros(self):
        Paper(self.root).write(self.out)
        path = self.out / "numbers.tex"
        text = path.read_text()
        path.write_text(re.sub(r"\{dragon\}\{\d", "{dragon}{7", text))
        self.assertNotEqual(path.read_text(), text)
        found = Paper(self.root).verify(self.out)
        self.assertEqual(len(found), 1)
        self.assertIn("\\papernumber{dragon}{7", found[0])
        self.refused("numbers.tex was changed by hand")

    def test_a_changed_table(self):
        Paper(self.root).write(self.out)
        path = self.out / "tables/dragons.tex"
        path.write_text(path.read_text().replace("81", "18", 1))
        self.assertEqual(len(Paper(self.root).verify(self.out)), 1)
        self.refused("dragons.tex was changed by hand")

    def test_a_changed_row(self):
        self.change_rows(lambda row: row.update(triangle_count=row["triangle_count"] + 1))
        self.refused("one.tex:1", "dragon", "headline/rows.jsonl differs from the hash")

    def test_rows_that_nobody_accepted(self):
        (self.root / "results/SHA256SUMS").write_text("")
        self.refused("dragon", "SHA256SUMS does not name headline/rows.jsonl")

    def test_a_row_of_a_tree_with_changes(self):
        self.change_rows(lambda row: row.update(dirty=True))
        seal(self.root)
        self.refused("dragon", "rows of a tree with changes")

    def test_a_row_that_does_not_say_of_what_tree_it_is(self):
        self.change_rows(lambda row: row.pop("dirty"))
        seal(self.root)
        self.refused("dragon", "rows of a tree with changes")

    def test_a_stale_row(self):
        shutil.rmtree(self.root / "results")
        (self.root / "results").mkdir()
        for name in ("headline", "stale"):
            (self.root / "results" / name).mkdir()
            shutil.copy(ROOT / "results" / name / "rows.jsonl", self.root / "results" / name)

        def differ(row):
            if row["variant"]["label"] == "headline":
                row["values"].update(differing=1, difference="dragon: points was 1, now 2")

        self.change_rows(differ, "stale")
        seal(self.root)
        self.refused("dragon", "headline is stale", "points was 1, now 2")

    def test_a_number_without_a_row(self):
        (self.root / "paper/sections/one.tex").write_text("There are \\N{nobody}.\n")
        self.refused("one.tex:1", "the number nobody has no row")

    def test_a_number_whose_row_lacks_it(self):
        (self.root / "paper/sections/one.tex").write_text("There are \\N{lacking}.\n")
        self.refused("one.tex:1", "the number lacking: the rows give no most")

    def test_a_number_that_is_not_defined(self):
        (self.root / "paper/sections/one.tex").write_text("A\n\\N{unheard}\n")
        self.refused("one.tex:2", "there is no number unheard")

    @unittest.skipUnless(shutil.which("git"), "needs git")
    def test_an_experiment_that_was_changed_after_its_rows(self):
        (self.root / "experiments").unlink()
        for file in ("harness/columns.cpp", "ledger/row_database.cpp", "questions/meshes/headline.toml"):
            (self.root / "experiments" / file).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / "experiments" / file, self.root / "experiments" / file)

        def git(*words):
            return subprocess.run(["git", "-C", str(self.root), "-c", "user.name=n", "-c", "user.email=e", *words], check=True,
                                  capture_output=True, text=True).stdout.strip()

        git("init", "-q")
        git("add", "experiments")
        git("commit", "-q", "-m", "rows")
        commit = git("rev-parse", "HEAD")
        self.change_rows(lambda row: row.update(commit=commit))
        seal(self.root)
        Paper(self.root).write(self.out)
        path = self.root / "experiments/questions/meshes/headline.toml"
        text = path.read_text()
        path.write_text(text.replace("tolerance = 7,", "tolerance = 8,"))
        self.assertNotEqual(path.read_text(), text)
        self.refused("headline is stale", "headline.toml has changed manifold by regions since commit " + commit[:12])
        settings = self.root / "paper/paper.toml"
        settings.write_text('[changed]\nheadline = { labels = ["manifold by regions"], why = "It is a test." }\n' +
                            settings.read_text().replace('sections', '#', 1).replace('plain', '#', 1))
        settings.write_text('sections = ["one"]\n' + settings.read_text())
        Paper(self.root).write(self.out)

    def test_a_query_that_reads_no_rows(self):
        path = self.root / "paper/paper.toml"
        path.write_text(re.sub("dragon = .*", 'dragon = "SELECT 4.2"', path.read_text()))
        self.refused("one.tex:1", "the number dragon reads no folder of results/")

    def test_rows_that_are_not_there(self):
        shutil.rmtree(self.root / "results/headline")
        self.refused("one.tex:1", "the number dragon reads no folder of results/", "headline")

    def test_a_table_without_rows(self):
        path = self.root / "paper/paper.toml"
        path.write_text(path.read_text().replace("subject = 'dragon' ORDER", "subject = 'nobody' ORDER"))
        self.refused("one.tex:2", "the table dragons has no row")

    def test_a_typed_number(self):
        path = self.root / "paper/sections/one.tex"
        path.write_text(path.read_text() + "It takes 4.32 s.\n")
        self.refused("one.tex:3", "4.32 is typed")

    def test_a_section_that_waits_asks_for_nothing(self):
        (self.root / "paper/sections/two.tex").write_text("\\N{nobody} 17\n")
        Paper(self.root).write(self.out)
        path = self.root / "paper/paper.toml"
        path.write_text(path.read_text().replace('["one"]', '["one", "two"]'))
        self.refused("two.tex:1", "17 is typed")


class Waiting(Case):
    """The sections that wait for their rows, with rows made up."""

    def setUp(self):
        super().setUp()
        self.measured()
        for name in ("ablations", "order", "peers"):
            shutil.copy(ROOT / "paper/sections" / f"{name}.tex", self.root / "paper/sections")

    def put(self, folder, rows, table=""):
        (self.root / "results" / folder).mkdir()
        (self.root / "results" / folder / "rows.jsonl").write_text("".join(json.dumps(row) + "\n" for row in rows))
        (self.root / "results" / folder / "table.md").write_text(table)

    def measured(self):
        head = {"commit": "c", "dirty": False, "run": "r", "date": "d", "tier": "full", "threads": 2}
        # Two models at two resolutions: the ratios are 2 and 8, and 4 and 4, so that each model's mean is 4.
        effect = {"level": "b", "column": "triangles", "measure": "ratio", "better": "lower", "prediction": "It grows.",
                  "at_least": 3, "at_most": None, "falsified_if": "high < 2"}
        ablation = {"factor": "made up", "levels": "variants", "baseline": "a", "effects": [effect]}
        rows = [{**head, "experiment": "ablation_made_up", "case": {"name": model}, "resolution": resolution,
                 "variant": {"name": "x", "label": level}, "triangle_count": count, "ablation": ablation}
                for model, resolution, a, b in [("m", 50, 10, 20), ("m", 100, 10, 80), ("n", 50, 5, 20), ("n", 100, 5, 20)]
                for level, count in (("a", a), ("b", b))]
        self.line = "| b | a | triangles | ratio | lower | 2 | 4 | 0 | 4 | 4 to 4 | ≥ 3 | high < 2 | undecided |"
        self.put("ablation_made_up", rows, "## ablation_made_up (full): ?\n\n| level | against | column | measure | better | models "
                 "| pairs | left out | effect | 95 % interval | predicted | falsified if | verdict |\n| --- |\n" + self.line + "\n")
        values = {"order": 1.97, "order_within": 1, "size": 48, "triangles": 100, "error_max": 0.1, "times_optimum": 2.2, "error_fine": 0.001}
        columns = [{"name": name, "header": name, "meaning": name} for name in values]
        self.put("order_sphere", [{**head, "experiment": "order", "case": {"name": subject}, "variant": {"name": label, "label": label},
                            "table": {"columns": columns}, "values": values}
                           for subject, label in [("sphere", "dual optimal, level set: rms"), ("sphere", "dual optimal, level set: max"),
                                                  ("sphere", "dual optimal, level set: volume"), ("sphere", "dual, level set: rms"),
                                                  ("sphere", "dual, level set: volume"),
                                                  ("optimum", "sphere, manifold 0.1, 48")]])
        # The table is of some of the models alone.
        peers = [{**row, "case": {**row["case"], "name": "nefertiti"}} for row in
                 map(json.loads, (ROOT / "results/headline/rows.jsonl").read_text().splitlines())]
        self.put("peers", peers + [{**peers[0], "variant": {"name": "none", "label": "absent"}, "failed": "absent"}])
        seal(self.root)

    def enabled(self):
        text = (ROOT / "paper/paper.toml").read_text()
        text, count = re.subn(r"(?m)^sections = \[[^\]]*\]", 'sections = ["ablations", "order", "peers"]', text)
        self.assertEqual(count, 1)
        (self.root / "paper/paper.toml").write_text(text)

    def test_they_are_made_when_they_are_listed(self):
        self.enabled()
        Paper(self.root).write(self.out)
        self.assertIn("1.97", (self.out / "tables/order.tex").read_text())
        self.assertIn("2.2", (self.out / "tables/optimum.tex").read_text())
        self.assertNotIn("absent", (self.out / "tables/peers.tex").read_text())
        self.assertIn("\\papernumber{ablations_undecided}{1}", (self.out / "numbers.tex").read_text())
        self.assertIn("4 (4 to 4)", (self.out / "tables/ablations.tex").read_text())

    def test_they_fail_without_their_rows(self):
        self.enabled()
        shutil.rmtree(self.root / "results/ablation_made_up")
        self.refused("ablations.tex", "the number ablations has no row")

    def test_an_effect_that_is_not_that_of_the_rows(self):
        self.enabled()
        path = self.root / "results/ablation_made_up/table.md"
        path.write_text(path.read_text().replace(self.line, self.line.replace("| 0 | 4 |", "| 0 | 3 |")))
        self.refused("ablation_made_up/table.md has no line for the effect of b on triangles", "(4 over 2 models)")


class Text(unittest.TestCase):
    def numbers(self, text, plain=()):
        return [number for _, number in orphans(text, list(plain))]

    def test_typed_numbers_are_found_wherever_they_stand(self):
        self.assertEqual(self.numbers("a 3.5 times, $1.9$ and \\emph{7} of 1,234 (12)"), ["3.5", "1.9", "7", "1,234", "12"])
        self.assertEqual(self.numbers("\\caption{Over 400 voxels}"), ["400"])
        self.assertEqual(self.numbers("$3.1\\cdot10^{-6}$"), ["3.1", "10", "6"])

    def test_macros_places_and_years_are_none(self):
        self.assertEqual(self.numbers("\\N{speed_octree_1} \\T{table_9_2} \\ref{tab:9} \\cite{ju2002} in 2011"), [])
        self.assertEqual(self.numbers("Table~9.2, tables 9.3 and 9.4, chapters 5, 4 and 6, section~4.2, equation~4.9"), [])
        self.assertEqual(self.numbers("$h^2$, 2D", ["2D"]), [])
        self.assertEqual(self.numbers("% 17\nA 5\\% share"), ["5"])
        self.assertEqual(self.numbers("\\includegraphics[width=0.92\\textwidth]{a/b-400} \\begin{tabular}"), [])

    def test_a_phrase_hides_its_own_digits_alone(self):
        self.assertEqual(self.numbers("ten 10 and 10", ["ten 10"]), ["10"])

    def test_the_lines_are_those_of_the_file(self):
        self.assertEqual(orphans("a\n\nb 3\n", []), [(3, "3")])

    def test_signs_of_rows_are_escaped(self):
        self.assertEqual(paper_numbers.escaped("a_b 5 % ∪ Δ ∅"), "a\\_b 5 \\% $\\cup$ $\\Delta$ $\\emptyset$")
        self.assertRaises(PaperError, paper_numbers.escaped, "\u4e00")
        self.assertEqual(paper_numbers.scientific("1.9e-06"), "$1.9\\cdot10^{-6}$")
        self.assertEqual(paper_numbers.scientific("-5.8"), "$-$5.8")

    def test_the_log_is_read(self):
        self.assertEqual(check_log.problems("Overfull \\hbox (0.9pt too wide) in paragraph"), [])
        self.assertEqual(len(check_log.problems("Overfull \\hbox (1.1pt too wide) in paragraph")), 1)
        self.assertEqual(len(check_log.problems("LaTeX Warning: Citation `x' on page 1 undefined on input line 3.")), 1)


class SameAsTheProgram(unittest.TestCase):
    """The rows are read as the program reads them: what it filled into the pages is what comes out here."""

    @classmethod
    def setUpClass(cls):
        cls.paper = Paper(ROOT)

    def test_every_number_of_every_page(self):
        compared = 0
        for page in ["README.md", "paper/readings.md", "paper/claims.md", *map(str, ROOT.glob("algorithms/*/README.md"))]:
            for name, text in re.findall(r"<!--=(\w+)-->([^\n|<]*)<!--/-->", (ROOT / page).read_text()):
                if name not in self.paper.numbers:
                    continue
                entry = self.paper.numbers[name]
                query = entry if isinstance(entry, str) else entry["query"]
                names, rows = self.paper.rows.query(query)
                form = "" if isinstance(entry, str) else entry.get("format", "")
                parts = [v if isinstance(v, str) else form % v if form else readable(float(v)) for v in rows[0]]
                self.assertEqual(" to ".join(dict.fromkeys(parts)), text, f"{page}: {name}")
                compared += 1
        self.assertGreater(compared, 100)

    def test_the_verdicts(self):
        page = (ROOT / "paper/claims.md").read_text()
        verdicts = [ledger.judge(claim, self.paper.rows)[0] for claim in self.paper.claims]
        self.assertIn(f"{len(verdicts)} claims: " + ", ".join(f"{verdicts.count(v)} {v}" for v in ledger.VERDICTS), page)

    def test_nothing_in_paper_toml_is_idle(self):
        text = "".join(path.read_text() for path in [ROOT / "paper/hermesh.tex", *(ROOT / "paper/sections").glob("*.tex")])
        asked = set(re.findall(r"\\[NT]\{([^{}]*)\}", text))
        self.assertEqual(set(self.paper.settings["numbers"]) - asked, set())
        self.assertEqual(set(self.paper.tables) - asked, set())
        self.assertEqual([phrase for phrase in self.paper.settings["plain"] if phrase not in text], [])

    def test_the_paper_itself(self):
        with tempfile.TemporaryDirectory() as out:
            self.paper.write(out)
            self.assertEqual(self.paper.verify(out), [])


if __name__ == "__main__":
    unittest.main()
