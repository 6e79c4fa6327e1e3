import argparse
import contextlib
import csv
import io
import pathlib
import tempfile
import types
import unittest
from unittest import mock

from .. import ablations, pages, tables
from ..rows import LabError, RowGroup, all_columns, append_rows, latest_groups


def row_of(run="1", label="a", seconds=1.0, **changes):
    """Returns a row with voxel size 0.5, a distance of a quarter of a voxel, and a peak of 1.5 MiB."""
    return {
        "experiment": "headline", "tier": "quick", "question": "why?", "run": run, "dirty": True,
        "columns": ["triangles", "seconds", "to_max", "peak_mib", "promises"], "commit": "0123456789abcdef",
        "case": {"name": "ball", "origin": "data folder", "sha256": "abcdef0123456789", "triangles": 1280},
        "resolution": 40, "voxel_size": 0.5, "variant": {"name": "toy", "label": label, "options": "size=1"},
        "voxelization": {"name": "openvdb"}, "triangle_count": 1234567,
        "report": {"points": 12, "to_reference": {"max": 0.125}}, "peak_bytes": 1572864,
        "seconds": {"median": seconds, "minimum": seconds}, "promise_letters": "c kept", "broken": [],
        **changes}


def markdown(*rows):
    return "".join(map(tables.markdown_table, latest_groups(list(rows))))


def lines_with(text, part):
    return [line for line in text.splitlines() if part in line]


class Markdown(unittest.TestCase):
    def test_shows_the_named_columns_in_their_units(self):
        table = markdown(row_of(seconds=0.25), row_of(label="b | é", seconds=2.5))
        self.assertIn("| variant | triangles | time [s] | to max [vx] | peak [MiB] | guarantees       |\n"
                      "| ------- | --------: | -------: | ----------: | ---------: | ---------------- |\n"
                      "| a       | 1,234,567 |     0.25 |        0.25 |        1.5 | closed: verified |\n"
                      "| b \\| é  | 1,234,567 |      2.5 |        0.25 |        1.5 | closed: verified |\n", table)
        self.assertTrue(table.startswith("### ball at resolution 40\n"))
        self.assertEqual(len(lines_with(table, "data folder, sha256 abcdef012345, 1,280 triangles")), 1)
        self.assertEqual(len(lines_with(table, "commit 0123456789ab with changes")), 1)

    def test_failures_are_sentences_below_the_table_and_missing_values_dashes(self):
        failed = row_of(label="bad", failed="out\nof luck")
        del failed["seconds"], failed["report"]
        broken = row_of(label="liar", broken=["closed (5 boundary edges)"], disagreements=["CGAL: counts 6"],
                        unchecked=["no self-intersection"], repetitions_differ=True, not_judged="too large")
        table = markdown(failed, broken, row_of(label="gone", failed="not installed", absent=True))
        for sentence in ["FAILED: bad on ball at resolution 40: out of luck", "BROKEN: liar on ball",
                         "UNCHECKED: liar", "DISAGREEMENT of the judges: liar", "NOT DETERMINISTIC: liar",
                         "NOT JUDGED: liar", "NOTE: gone"]:
            self.assertEqual(len(lines_with(table, f"- **{sentence}")), 1, sentence)
        self.assertEqual(lines_with(table, "| bad ")[0].replace(" ", "").split("|")[3:5], ["–", "–"])
        self.assertEqual(tables.alarms(row_of()), [])

    def test_guarantees_are_words(self):
        for letters, words in (("cmoi kept", "closed, manifold, oriented, no self-intersection: verified"),
                               ("cm BROKEN", "closed, manifold: VIOLATED"), ("i unchecked", "no self-"
                               "intersection: not checked"), ("none", "none"), ("FAILED", "FAILED")):
            self.assertIn(f"| {words} |\n", markdown(row_of(promise_letters=letters)).replace("  ", ""))

    def test_long_texts_are_footnotes(self):
        columns = [{"name": "outcome", "header": "outcome", "meaning": "what happened"}]
        reason = "the error is not kept at (1, 2, 3); the surfaces are farther apart: raise the error, or more"
        rows = [row_of(label=label, measurement={"parameters": "n=1", "seed": 7}, values={"outcome": outcome},
                       table={"title": "t", "columns": columns})
                for label, outcome in (("a", f"refused: {reason}"), ("b", "certified"),
                                       ("c", f"refused: {reason}"), ("d", "refused: a hole"))]
        table = markdown(*rows)
        self.assertEqual(table.count("| refused [1] "), 2)
        self.assertIn(f"- [1] {reason}\n", table)
        self.assertIn("| d       | refused: a hole |\n", table)

    def test_stand_ins_are_marked(self):
        stand_in = row_of(case={"name": "ball", "origin": "stand-in: no network"})
        for row, count in ((stand_in, 1), (row_of(), 0)):
            self.assertEqual(len(lines_with(markdown(row), "- STAND-IN DATA")), count)

    def test_names_the_commits_of_further_rows_and_counts_earlier_runs(self):
        first = row_of(label="a", table={"additive": True})
        others = [row_of("2", label, table={"additive": True}, commit="fedcba9876543210") for label in "bc"]
        self.assertEqual(len(lines_with(markdown(first, *others), "; 2 rows of commit fedcba987654")), 1)
        self.assertEqual(lines_with(markdown(first), "rows of commit"), [])
        self.assertIn("not shown: 1\n", markdown(row_of("1"), row_of("2")))

    def test_rows_of_plots_are_hidden(self):
        hidden = row_of(table={"printed": False})
        self.assertEqual(tables.markdown_table(RowGroup([hidden])) + tables.legend([hidden]), "")

    def test_stages_get_their_share_of_the_time(self):
        row = row_of(label="v", seconds=2.0, stage_seconds={"band": 1.0, "signs": 0.5},
                     nominal_voxel_size=0.1, band={"exterior": 3, "interior": 3})
        self.assertEqual(tables.stage_sentences(RowGroup([row])),
                         ["time of v at voxel 0.1: band 1 s (50 %), signs 0.5 s (25 %), rest 0.5 s (25 %)"])
        row["stage_seconds"]["signs"] = 0.99  # within 2 % of the whole
        self.assertNotIn("rest", tables.stage_sentences(RowGroup([row]))[0])

    def test_sweeps_and_measurements(self):
        swept = row_of(sweep={"parameter": "angle", "value": 3}, nominal_voxel_size=0.1, resolution=None)
        self.assertEqual(tables.group_title(swept), "ball by angle at voxel size 0.1")
        own = [{"name": "bins", "header": "bins", "meaning": "number of bins"}]
        row = row_of(measurement={"parameters": "n=1", "seed": 7}, values={"bins": 4},
                     table={"title": "its volume", "columns": own})
        self.assertEqual(tables.legend([row]), "Columns: *bins* number of bins.\n")
        self.assertTrue(markdown(row).startswith("### ball: its volume\n"))
        self.assertIn("| a       |    4 |\n", markdown(row))


class OtherFormats(unittest.TestCase):
    def test_latex_escapes(self):
        text = tables.latex_table(RowGroup([row_of(label="50 % of a_b & {c}\\")]))
        label = "50 \\% of a\\_b \\& \\{c\\}\\textbackslash{}"
        self.assertIn(f"\n{label} & 1,234,567 & 1 & 0.25 & 1.5 & closed: verified \\\\\n", text)
        self.assertIn("\\begin{tabular}{lrrrrr}", text)

    def test_csv_has_all_rows_all_columns_and_full_numbers(self):
        rows = [row_of(label='a, "b"', seconds=0.123456789), row_of("2", "c\rd", failed="x\ny")]
        head, first, second = csv.reader(io.StringIO(tables.csv_text(rows), newline=""))
        self.assertLessEqual({column.name for column in all_columns()}, set(head))
        first, second = dict(zip(head, first, strict=True)), dict(zip(head, second, strict=True))
        self.assertEqual([first["label"], second["label"], second["failed"]], ['a, "b"', "c\rd", "x\ny"])
        expected = {"seconds": "0.123456789", "triangles": "1234567", "to_max": "0.25", "dirty": "true",
                    "case": "ball", "quads": ""}
        self.assertEqual({name: first[name] for name in expected}, expected)

    def test_csv_of_measurements_has_only_their_columns(self):
        own = {"columns": [{"name": "bins", "header": "bins", "meaning": "number of bins"}]}
        row = row_of(measurement={"seed": 7}, values={"bins": 4}, table=own)
        self.assertTrue(tables.csv_text([row]).splitlines()[0].endswith(",failed,bins"))
        self.assertTrue(tables.csv_text([row, row_of()]).splitlines()[0].endswith(",options,bins"))


class Ratios(unittest.TestCase):
    def test_times_relative_to_the_first_openvdb(self):
        rows = [row_of(seconds=seconds) for seconds in (1.0, 4.0, 8.0)]
        tables.add_ratios(rows)
        self.assertNotIn("time_over_openvdb", rows[0])
        for row in rows[1:]:
            row["variant"]["name"] = "openvdb"
        failed = {"variant": {"name": "toy"}, "failed": "it did"}
        tables.add_ratios([*rows, failed])
        self.assertEqual([row["time_over_openvdb"] for row in rows], [0.25, 1.0, 2.0])
        self.assertNotIn("time_over_openvdb", failed)

    def test_voxelizers_relative_to_openvdb_with_default_options(self):
        toy, changed, base = rows = [row_of(seconds=seconds, band={}) for seconds in (0.5, 8.0, 2.0)]
        changed["variant"] |= {"name": "openvdb", "default_options": False}
        base |= {"variant": {"name": "openvdb", "default_options": True}, "peak_bytes": 2**20}
        tables.add_ratios(rows)
        self.assertEqual([row["openvdb_over_time"] for row in rows], [4.0, 0.25, 1.0])
        self.assertEqual(toy["peak_over_openvdb"], 1.5)


class Failures(unittest.TestCase):
    def test_are_counted_and_the_first_is_named_without_control_characters(self):
        absent, out = row_of(failed="not installed", absent=True), io.StringIO()
        tables.write_failures([row_of(), absent], out)
        self.assertEqual(out.getvalue(), "")
        failed = row_of(label="b", failed="x\n\x1b[2J" + "é" * 500 + "y")
        tables.write_failures([absent, failed, row_of(failed="z")], out)
        self.assertRegex(out.getvalue(), "^FAILED: 2 of 3 cells; the first is ball/40/b: "
                         r"x \?\[2Jé+\.\.\.é+y\n$")
        self.assertLess(len(out.getvalue()), 460)


class Report(unittest.TestCase):
    def setUp(self):
        self.directory = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.parser = argparse.ArgumentParser()
        tables.add_command(self.parser.add_subparsers())

    def report(self, *words, code=0):
        out = io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(io.StringIO()):
            arguments = self.parser.parse_args(["report", *map(str, words)])
            self.assertEqual(arguments.function(arguments), code)
        return out.getvalue()

    def test_formats(self):
        with self.assertRaises(LabError):
            self.report(self.directory)
        append_rows(self.directory / "rows.jsonl", [row_of(), row_of(resolution=80), row_of(tier="full")])
        for form in ("md", "csv", "tex"):
            self.assertIn("ball", self.report(self.directory, "--format", form))

    def test_effects_are_below_their_question(self):
        rows = [row_of(), row_of(resolution=80), row_of(tier="full")]
        effect = lambda judged, out: out.write(f"effect of {judged.tier}\n")
        judged = [types.SimpleNamespace(experiment=row["experiment"], tier=row["tier"]) for row in rows[1:]]
        with mock.patch.multiple(ablations, write_effects=effect, judge_ablations=lambda rows: judged):
            lines = tables.markdown_report(rows).splitlines()
        found = [line for line in lines if line.startswith(("## ", "effect", "###"))]
        self.assertEqual(found, ["## headline (quick): why?", "effect of quick", "### ball at resolution 40",
                                 "### ball at resolution 80", "## headline (full): why?", "effect of full",
                                 "### ball at resolution 40"])

    def test_check_fails_if_a_page_has_problems(self):
        for problems, code in ([], 0), (["page.md:1: wrong"], 3):
            with mock.patch.object(pages, "check", lambda root: problems):
                self.assertIn((problems or ["all numbers"])[0], self.report("--check", code=code))

    def test_impossible_options_are_errors_of_usage(self):
        for words in ([], [self.directory, "--fill"], [self.directory, "--meshes", "all"],
                      [self.directory, "--format", "html", "--meshes", "few"]):
            with self.assertRaises(SystemExit) as ended:
                self.report(*words)
            self.assertEqual(ended.exception.code, 2)

    def test_query(self):
        (self.directory / "results/balls").mkdir(parents=True)
        append_rows(self.directory / "results/balls/rows.jsonl", [row_of()])
        with mock.patch.object(tables, "ROOT", self.directory):
            self.assertEqual(self.report("--query", "SELECT triangles, label, failed FROM balls"),
                             "| triangles | label | failed |\n| --- | --- | --- |\n| 1234567 | a | null |\n")
            self.assertEqual(self.report("--query", "SELECT * FROM balls WHERE 0"), "no rows\n")


if __name__ == "__main__":
    unittest.main()
