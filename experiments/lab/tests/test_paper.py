import hashlib
import re
import tempfile
import unittest

from .. import paper
from ..paper import Paper, orphans
from ..rows import ROOT, LabError, read_rows
from .test_claims import Directory

SETTINGS = '''sections = ["one"]
plain = ["ten 10"]
[numbers]
dragon = "SELECT triangles FROM headline WHERE subject = 'dragon' AND label = 'marching-cubes'"
nobody = "SELECT triangles FROM headline WHERE subject = 'nobody'"
lacking = "SELECT max(triangles) AS most FROM headline WHERE subject = 'nobody'"
constant = "SELECT 4.2"
[tables.dragons]
query = "SELECT label AS 'a|b', triangles FROM headline WHERE subject = 'dragon' ORDER BY rowid LIMIT 2"
[tables.none]
query = "SELECT label FROM headline WHERE subject = 'nobody'"
'''


class Case(Directory):
    """A copy of the paper's sources with only the rows of `headline`, and a text with one number and one
    table.
    """

    def setUp(self):
        super().setUp()
        self.out = self.root / "build"
        for name in ("numbers.toml", "claims.toml"):
            self.write(f"paper/{name}", (ROOT / "paper" / name).read_text())
        self.write("results/headline/rows.jsonl", (ROOT / "results/headline/rows.jsonl").read_text())
        self.seal()
        self.write("paper/hermesh.tex", "\\begin{document}\\input{sections}\\end{document}\n")
        self.write("paper/sections/one.tex", "There are \\N{dragon} triangles.\n\\T{dragons}\n")
        self.write("paper/paper.toml", SETTINGS)

    def replace(self, path, old, new):
        path = self.root / path
        text = path.read_text()
        self.assertIn(old, text)
        path.write_text(text.replace(old, new, 1))

    def seal(self):
        """Accepts the rows, as `hermesh report --fill` does."""
        self.write("results/SHA256SUMS", "".join(
            f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.parent.name}/rows.jsonl\n"
            for path in self.root.glob("results/*/rows.jsonl")))

    def refused(self, *words):
        """The paper is refused with one sentence that has these words."""
        with self.assertRaises(LabError) as caught:
            Paper(self.root).write(self.out)
        for word in words:
            self.assertIn(word, str(caught.exception))
        self.assertNotIn("\n", str(caught.exception))

    def change_rows(self, change, directory="headline"):
        rows = read_rows(self.root / "results" / directory)
        for row in rows:
            change(row)
        self.put(directory, *rows)


class Refusals(Case):
    def test_an_unchanged_paper_is_written_and_verified(self):
        Paper(self.root).write(self.out)
        self.assertEqual(Paper(self.root).verify(self.out), [])
        wanted = next(row["triangle_count"] for row in read_rows(ROOT / "results/headline")
                      if row["case"]["name"] == "dragon" and row["variant"]["label"] == "marching-cubes")
        self.assertIn(f"\\papernumber{{dragon}}{{{wanted:,}}}", (self.out / "numbers.tex").read_text())
        self.assertIn("\\shortstack[l]{a\\\\{}b} & triangles", (self.out / "tables/dragons.tex").read_text())

    def test_edited_files(self):
        for file, old in (("numbers.tex", "81"), ("tables/dragons.tex", "81")):
            Paper(self.root).write(self.out)
            self.replace(self.out / file, old, "18")
            self.assertEqual(len(Paper(self.root).verify(self.out)), 1)
            self.refused(file, "edited")
            (self.out / file).unlink()

    def test_rows_that_were_not_accepted(self):
        self.change_rows(lambda row: row.update(triangle_count=row["triangle_count"] + 1))
        self.refused("one.tex:1", "dragon", "headline/rows.jsonl differs", "SHA256SUMS")
        self.write("results/SHA256SUMS", "")
        self.refused("dragon", "SHA256SUMS")

    def test_rows_of_a_tree_with_changes(self):
        for change in (lambda row: row.update(dirty=True), lambda row: row.pop("dirty")):
            self.change_rows(change)
            self.seal()
            self.refused("dragon", "a tree with changes")

    def test_stale_rows(self):
        self.write("results/stale/rows.jsonl", (ROOT / "results/stale/rows.jsonl").read_text())
        self.change_rows(lambda row: row["values"].update(differing=0), "stale")
        self.seal()
        Paper(self.root).write(self.out)
        self.change_rows(lambda row: row["values"].update(differing=1, difference="points was 1, now 2"),
                         "stale")
        self.seal()
        self.refused("dragon", "headline is stale", "points was 1, now 2")

    def test_numbers_and_tables_without_rows(self):
        for text, *words in (("\\N{nobody}", "one.tex:1", "nobody", "no row"),
                             ("\\N{lacking}", "one.tex:1", "lacking", "most"),
                             ("\\N{constant}", "constant", "no directory of results/"),
                             ("A\n\\N{unheard}", "one.tex:2", "unheard"),
                             ("\n\\T{unheard}", "one.tex:2", "unheard"),
                             ("\\T{none}", "the table none", "no row"),
                             ("It takes 4.32 s.", "one.tex:1", "4.32"), ("\\N{count_maybe}", "count_maybe"),
                             ("\\N{ablations}", "no directory")):
            self.write("paper/sections/one.tex", text)
            self.refused(*words)

    def test_a_number_that_is_defined_twice(self):
        self.replace("paper/numbers.toml", "\n[numbers]\n", '\n[numbers]\ndragon = "SELECT 1"\n')
        self.refused("dragon", "numbers.toml")

    def test_a_section_that_is_not_listed_needs_no_rows(self):
        self.write("paper/sections/two.tex", "\\N{nobody} 17\n")
        Paper(self.root).write(self.out)
        self.replace("paper/paper.toml", '["one"]', '["one", "two"]')
        self.refused("two.tex:1", "17 is typed")

    def test_an_experiment_that_was_changed_after_its_rows(self):
        file = next((ROOT / "experiments/questions").glob("**/headline.toml")).relative_to(ROOT)
        self.write(file, (ROOT / file).read_text())
        self.git("init", "-q")
        self.git("add", "experiments")
        self.git("commit", "-q", "-m", "rows")
        commit = self.git("rev-parse", "HEAD")
        self.change_rows(lambda row: row.update(commit=commit))
        self.seal()
        Paper(self.root).write(self.out)
        self.replace(file, "tolerance = 7,", "tolerance = 8,")
        self.refused("headline is stale", "manifold by regions", commit[:12])
        changed = '[changed]\nheadline = { labels = ["manifold by regions"], why = "Test." }\n'
        self.write("paper/paper.toml", SETTINGS + changed)
        Paper(self.root).write(self.out)


class Text(unittest.TestCase):
    def test_numbers_that_are_typed(self):
        for text, expected in (
                ("a 3.5 times, $1.9$ and \\emph{7} of 1,234 (12)", ["3.5", "1.9", "7", "1,234", "12"]),
                ("\\caption{Over 400 voxels}", ["400"]), ("$3.1\\cdot10^{-6}$", ["3.1", "10", "6"]),
                ("\\N{speed_octree_1} \\T{table_9_2} \\ref{tab:9} \\cite{ju2002} in 2011", []),
                ("Table~9.2, tables 9.3 and 9.4, chapters 5, 4 and 6, section~4.2, equation~4.9", []),
                ("$h^2$, ten 10", []), ("ten 10 and 10", ["10"]), ("% 17\nA 5\\% share", ["5"]),
                ("\\includegraphics[width=0.92\\textwidth]{a/b-400} \\begin{tabular}", [])):
            self.assertEqual([number for _, number in orphans(text, ["ten 10"])], expected)
        self.assertEqual(orphans("1\n\nb 3\n", [], 2), [(3, "3")])

    def test_values_are_written_for_latex(self):
        self.assertEqual(paper.escaped("a_b 5 % ∪ Δ ∅"), "a\\_b 5 \\% $\\cup$ $\\Delta$ $\\emptyset$")
        self.assertEqual(paper.escaped("--thin, 2–3"), "-{}-thin, 2--3")
        self.assertRaises(LabError, paper.escaped, "\u4e00")
        self.assertEqual(paper.formatted(1.9e-6), "$1.9\\cdot10^{-6}$")
        self.assertEqual(paper.formatted(-5.8), "$-$5.8")
        self.assertEqual(paper.formatted(2, "%.2f"), "2.00")

    def test_the_log_is_read(self):
        self.assertEqual(paper.problems_of_log("Overfull \\hbox (0.9pt too wide) in paragraph"), [])
        self.assertEqual(len(paper.problems_of_log("Overfull \\hbox (1.1pt too wide) in paragraph")), 1)
        self.assertEqual(len(paper.problems_of_log("LaTeX Warning: Citation `x' on page 1 undefined on line "
                                                   "3.")), 1)
        self.assertEqual(paper.problems_of_log("", "Warning--empty year in x\n"), ["empty year in x"])


class ThePaper(unittest.TestCase):
    def test_is_made_and_nothing_in_paper_toml_is_unused(self):
        made = Paper(ROOT)
        with tempfile.TemporaryDirectory() as out:
            made.write(out)
            self.assertEqual(made.verify(out), [])
        text = "".join(path.read_text() for path in (ROOT / "paper").glob("**/*.tex"))
        asked = set(re.findall(r"\\[NT]\{([^{}]*)\}", text))
        self.assertEqual(set(made.settings["numbers"]) - asked, set())
        self.assertEqual(set(made.tables) - asked, set())
        self.assertEqual([phrase for phrase in made.settings["plain"] if phrase not in text], [])


if __name__ == "__main__":
    unittest.main()
