"""Tests of the effects of ablations: statistics by tables and by hand, verdicts, files, commits, reports."""

import copy
import io
import math
import pathlib
import random
import tempfile
import tomllib
import unittest

from .. import ablations
from ..rows import LabError, ROOT, all_columns
from .test_claims import Directory

COLUMNS = [column.name for column in all_columns()]


class StatisticsTest(unittest.TestCase):
    def test_student_interval_by_hand(self):
        # The mean of 1 to 5 is 3, its standard error √(2.5 / 5); t of 4 degrees is 2.77645, of 1 12.7062.
        for values, middle, half in (([1, 2, 3, 4, 5], 3, 2.77645 * math.sqrt(0.5)), ([0, 2], 1, 12.7062)):
            low, high = ablations.student_interval(values)
            self.assertAlmostEqual((high + low) / 2, middle)
            self.assertAlmostEqual((high - low) / 2, half, 4)

    def test_random_words_are_those_of_the_standard(self):
        # C++20, [rand.predef]: the 10,000th number of mt19937_64 with its default seed.
        self.assertEqual(int(ablations.random_words(5489, 10_000)[-1]), 9981545732273789042)

    def test_bootstrap_follows_the_skew(self):
        values = [0.3, 1.2, -0.4, 2.2, 0.9, 1.1, 0.2, 5.0]
        low, high = ablations.bootstrap_interval(values)
        self.assertGreater(high - 1.3125, 1.3125 - low)

    def test_a_ratio_is_the_geometric_mean_over_models(self):
        # Model a has the ratios 2 and 8, whose geometric mean is 4; b has 1. Each model counts once.
        size = ablations.effect_size([("a", 1, 2), ("a", 0.5, 4), ("b", 3, 3)], "ratio")
        self.assertAlmostEqual(size.estimate, 2)
        self.assertEqual((size.models, size.pairs, size.left_out), (2, 3, 0))
        # Logarithms ln 4 and 0: mean ln 2, standard error ln 2, t of one degree 12.7062.
        self.assertAlmostEqual(math.log(size.high), math.log(2) * (1 + 12.7062), 3)
        self.assertAlmostEqual(math.log(size.low), math.log(2) * (1 - 12.7062), 3)

    def test_differences_and_counts_by_hand(self):
        pairs = [("a", 1, 4), ("b", 0, 1), ("c", 7, 0)]
        self.assertAlmostEqual(ablations.effect_size(pairs, "difference").estimate, (3 + 1 - 7) / 3)
        # (4 + 1) / (1 + 1), (1 + 1) / (0 + 1), (0 + 1) / (7 + 1)
        self.assertAlmostEqual(ablations.effect_size(pairs, "count-ratio").estimate, (2.5 * 2 / 8) ** (1 / 3))

    def test_pairs_without_an_effect_are_counted(self):
        pairs = [("a", 0, 1), ("a", 1, 0), ("b", None, 1), ("b", math.nan, 1), ("c", 2, 4)]
        size = ablations.effect_size(pairs, "ratio")
        self.assertEqual((size.left_out, size.pairs, size.models), (4, 1, 1))
        self.assertAlmostEqual(size.estimate, 2)
        self.assertEqual((size.low, size.high), (0, math.inf))  # one model does not bound the others
        self.assertEqual(ablations.effect_size(pairs, "difference").left_out, 2)
        self.assertTrue(math.isnan(ablations.effect_size([], "ratio").estimate))
        equal = ablations.effect_size([(model, 2, 3) for model in "abcde"], "difference")
        self.assertEqual((equal.low, equal.high), (1, 1))

    def test_interval_covers_the_truth(self):
        # 500 trials determine a share of 95 % to 2 percentage points (two standard errors).
        draws = random.Random(1)
        for draw, least in ((lambda: draws.gauss(1, 2), 0.93), (lambda: draws.expovariate(1), 0.87)):
            sizes = [ablations.effect_size([(model, 0, draw()) for model in "abcdefgh"], "difference")
                     for _ in range(500)]
            held = sum(size.low <= 1 <= size.high for size in sizes)
            self.assertGreaterEqual(held / 500, least)
            self.assertLessEqual(held / 500, 0.98)


class VerdictTest(unittest.TestCase):
    def test_each_verdict(self):
        from_1_2 = {"at_least": 1.2, "at_most": None, "falsified_if": "high < 1.2"}
        for low, high, models, left_out, at_most, expected in (
                (1.3, 2.0, 8, 0, None, "holds"), (1.0, 2.0, 8, 0, None, "undecided"),
                (0.9, 1.1, 8, 0, None, "falsified"), (1.3, 2.0, 8, 0, 1.8, "undecided"),
                (1.3, 1.7, 8, 0, 1.8, "holds"), (0.9, 1.1, ablations.FEWEST_MODELS - 1, 0, None, "undecided"),
                # More pairs are left out than compared.
                (1.3, 1.7, 8, 24, None, "holds"), (1.3, 1.7, 8, 25, None, "undecided")):
            size = ablations.EffectSize((low + high) / 2, low, high, models, 24, left_out)
            self.assertEqual(ablations.judge_prediction({**from_1_2, "at_most": at_most}, size), expected)

    def test_and_binds_more_tightly_than_or(self):
        rule = ablations.falsifier("low > 3 or high < 1 and estimate <= 0.5")
        for interval, expected in (((3.1, 4, 5), True), ((0.2, 0.8, 0.9), False), ((0.2, 0.5, 0.9), True),
                                   ((0.2, 0.5, 1.0), False)):
            self.assertEqual(rule(*interval), expected, interval)

    def test_invalid_falsifiers(self):
        for rule in ("", "high", "high <", "high < x", "mean < 1", "high = 1", "high < 1 and", "high < 1_0",
                     "high < 1 but low > 2", "high < 01", "low > 3 or high", "high < 1 low > 2"):
            with self.assertRaises(LabError, msg=rule):
                ablations.falsifier(rule)

    def test_a_falsifier_must_fit_the_prediction(self):
        for rule, at_least, at_most, fits in (
                ("high < 1.2", 1.2, math.inf, True), ("high <= 1.2", 1.2, math.inf, False),
                ("low < 1.3", 1.2, math.inf, False), ("low > 1 and high < 1.2", 1.3, math.inf, True),
                ("high < 1 and low > 2", 1.2, math.inf, False),  # no interval ends before it begins
                ("high < -1 or low > 1", -1, 1, True)):
            self.assertEqual(ablations.misfit(rule, at_least, at_most) == "", fits, rule)


TEXT = """
question = "Why?"
factor = "truncation"
levels = "variants"
baseline = "a"
voxelizers = ["hermesh"]
columns = ["triangles"]
variants = [{ name = "x", label = "a" }, { name = "x", label = "b" }, { name = "c" }]
[[effects]]
levels = ["b", "c"]
column = "triangles"
measure = "ratio"
better = "lower"
at_least = 0.9
at_most = 1
falsified_if = "high < 0.9 or low > 1.1"
prediction = "The triangles stay."
[quick]
cases = [{ name = "torus", resolutions = [12, 24] }, { name = "cube", resolutions = [24] }]
"""


def read(text, columns=COLUMNS):
    return ablations.read_ablation(tomllib.loads(text), columns, "toy.toml")


class FileTest(unittest.TestCase):
    def test_each_level_gives_an_effect(self):
        ablation = read(TEXT)
        self.assertEqual([effect["level"] for effect in ablation["effects"]], ["b", "c"])
        self.assertEqual(ablation["effects"][1]["at_most"], 1.0)
        at_most_only = TEXT.replace("at_least = 0.9\n", "").replace("high < 0.9 or ", "")
        self.assertIsNone(read(at_most_only)["effects"][0]["at_least"])
        self.assertIsNone(read('question = "Why?"'))

    def test_levels_of_other_kinds(self):
        resolutions = TEXT.replace('"variants"', '"resolutions"').replace('"a"\nv', '"12"\nv')
        self.assertEqual(read(resolutions.replace('["b", "c"]', '["24"]'))["effects"][0]["level"], "24")
        # In an experiment on voxelization the voxelizers are the variants.
        voxelizers = 'kind = "voxelization"\n' + TEXT.replace('["hermesh"]', '["a", "b", "c"]')
        self.assertEqual(read(voxelizers)["baseline"], "a")
        measured = 'kind = "measurement"\n' + TEXT.replace('"variants"', '["a", "b", "c"]')
        self.assertEqual(read(measured, ["triangles"])["levels"], "measured")
        with self.assertRaises(LabError):
            read(measured, ["another column"])

    def test_wrong_files(self):
        read(TEXT)
        for old, new in (('prediction = "The triangles stay."', ""),
                         ('falsified_if = "high < 0.9 or low > 1.1"', ""),
                         ("at_least = 0.9\nat_most = 1\n", ""),
                         ("at_most = 1", "at_most = 0.1"),
                         ("at_most = 1", "most = 1"),
                         ("low > 1.1", "low > 0.95"),  # can be true within the range
                         ('["b", "c"]', '["a"]'),  # the baseline
                         ('["b", "c"]', '["b", "b"]'),
                         ('baseline = "a"', 'baseline = "d"'),
                         ('column = "triangles"', 'column = "trianglez"'),
                         ('levels = "variants"', 'levels = "voxelizers"'),  # one level only
                         ('factor = "truncation"', "")):
            self.assertEqual(TEXT.count(old), 1, old)
            with self.assertRaisesRegex(LabError, "^toy.toml", msg=f"{old} -> {new}"):
                read(TEXT.replace(old, new))
        with self.assertRaises(LabError):
            read(TEXT[:TEXT.index("[[effects]]")] + TEXT[TEXT.index("[quick]"):])

    def test_shipped_ablations_have_enough_models(self):
        files = sorted((ROOT / "experiments/ablations/predictions").glob("ablation_*.toml"))
        self.assertGreaterEqual(len(files), 16)
        for document in (tomllib.loads(file.read_text()) for file in files):
            if document.get("kind") != "measurement":
                models = {case["name"] for case in document["full"]["cases"]}
                self.assertGreaterEqual(len(models), 8, document["factor"])


class CommitTest(Directory):
    def setUp(self):
        super().setUp()
        self.root = self.root.resolve()
        self.file = self.root / "predictions" / "toy.toml"
        self.write("predictions/toy.toml", TEXT)

    def commit(self):
        self.git("add", ".")
        self.git("commit", "-q", "-m", "text")
        return self.git("rev-parse", "HEAD")

    def test_the_commit_is_the_last_one_that_changed_the_file(self):
        self.assertIn("note", ablations.prediction_of(self.file))  # not in a checkout
        self.git("init", "-q")
        self.git("add", ".")
        self.assertIn("note", ablations.prediction_of(self.file))  # added, but not committed
        first = self.commit()
        prediction = ablations.prediction_of(self.file)
        self.assertEqual((prediction["commit"], prediction["file"]), (first, "predictions/toy.toml"))
        self.assertNotIn("note", prediction)
        (self.root / "other").write_text("text")
        self.commit()
        self.assertEqual(ablations.prediction_of(self.file)["commit"], first)
        self.file.write_text(TEXT + "# changed\n")
        self.assertIn("note", ablations.prediction_of(self.file))
        self.assertEqual(self.commit(), ablations.prediction_of(self.file)["commit"])

    def test_a_prediction_is_older_than_its_row(self):
        self.git("init", "-q")
        first = self.commit()
        row = {"commit": first, "date": "2999-01-01T00:00:00Z",
               "ablation": {"prediction": ablations.prediction_of(self.file)}}
        problem = lambda **changes: ablations.prediction_problem({**row, **changes}, self.root)
        self.assertEqual(problem(), "")
        self.assertIn("younger", problem(date="2001-01-01T00:00:00Z"))
        self.file.write_text(TEXT + "# changed\n")
        second, prediction = self.commit(), ablations.prediction_of(self.file)
        changed = {"ablation": {"prediction": prediction}}
        self.assertIn("not before", problem(**changed))  # the row is of the first commit
        self.assertEqual(problem(commit=second, **changed), "")
        prediction["sha256"] = "0" * 64
        self.assertIn("is not the file", problem(commit=second, **changed))
        self.assertEqual(problem(commit="f" * 40, **changed), "")  # this checkout cannot decide it
        self.assertEqual(problem(ablation={"prediction": {"note": "not committed"}}), "not committed")
        self.assertEqual(ablations.prediction_problem({"commit": first}, self.root), "")
        wrong = {**row, "commit": second, **changed}
        self.assertEqual(len(ablations.prediction_problems([row, wrong, wrong], self.root)), 1)

    def test_only_committed_predictions_are_kept(self):
        with_note = ablations.prediction_of(self.file)
        for out in ("results/toy", "results"):
            with self.assertRaises(LabError, msg=out):
                ablations.check_prediction(with_note, self.root / out, self.root)
        for out in ("results/local/toy", "toy"):
            ablations.check_prediction(with_note, self.root / out, self.root)
        ablations.check_prediction({"commit": "1"}, self.root / "results/toy", self.root)


def rows_by_hand(factor):
    """Returns rows of eight models at three resolutions; b has about `factor` times the triangles of a."""
    effect = {"level": "b", "column": "triangles", "measure": "ratio", "better": "lower", "at_least": 0.4,
              "at_most": 0.6, "falsified_if": "low > 0.6 or high < 0.4", "prediction": "Half."}
    prediction = {"file": "x.toml", "commit": "abcdef1234567890", "date": "2026-01-01T00:00:00Z"}
    ablation = {"factor": "truncation", "levels": "variants", "baseline": "a", "effects": [effect],
                "prediction": prediction}
    return [{"experiment": "ablation_toy", "tier": "full", "run": "1", "commit": "1234567890abcdef",
             "case": {"name": f"model {model}"}, "resolution": resolution,
             "variant": {"name": "toy", "label": label},
             "triangle_count": 1000.0 * resolution * (factor + 0.001 * model if label == "b" else 1),
             "ablation": copy.deepcopy(ablation)}
            for model in range(8) for resolution in (48, 96, 192) for label in "ab"]


class ReportTest(unittest.TestCase):
    def test_models_are_paired_and_evaluated(self):
        judged, = ablations.judge_ablations(rows_by_hand(0.5))
        effect, = judged.effects
        self.assertEqual((judged.experiment, judged.tier, judged.subjects), ("ablation_toy", "full", 24))
        self.assertEqual((effect.size.models, effect.size.pairs, effect.verdict), (8, 24, "holds"))
        self.assertAlmostEqual(effect.size.estimate, 0.5035, 4)
        falsified = ablations.judge_ablations(rows_by_hand(0.9))
        self.assertEqual(falsified[0].effects[0].verdict, "falsified")
        out = io.StringIO()
        ablations.write_effects(judged, out)
        self.assertIn("| b | a | triangles | ratio | lower | 8 | 24 | 0 | 0.503 |", out.getvalue())
        self.assertIn("0.4 to 0.6 | low > 0.6 or high < 0.4 | holds |", out.getvalue())
        summary = ablations.summary_of([judged, *falsified])
        self.assertIn("Of 2 ablations 1 predictions hold, 1 are falsified, and 0 are undecided", summary)
        others = [{**row, "ablation": None} for row in rows_by_hand(0.5)]
        self.assertEqual(ablations.judge_ablations(others), [])

    def test_failed_cells_and_older_predictions_are_left_out(self):
        rows = rows_by_hand(0.5)
        rows[1]["failed"] = "it crashed"
        rows[2]["ablation"]["baseline"] = "z"
        size = ablations.judge_ablations(rows)[0].effects[0].size
        self.assertEqual((size.left_out, size.pairs), (1, 22))

    def test_a_later_prediction_is_marked(self):
        rows = rows_by_hand(0.5)
        for row in rows:
            row["ablation"]["prediction"] = {"note": "the prediction in x.toml is not committed"}
            row["ablation"]["effects"].append({**row["ablation"]["effects"][0], "column": "seconds"})
        out = io.StringIO()
        ablations.write_effects(ablations.judge_ablations(rows)[0], out)
        self.assertEqual(out.getvalue().count("- predicted of"), 1)  # effects may share a prediction
        cells, _ = ablations.effects_of_paper(rows)
        self.assertEqual(cells["verdict"], "holds, not predicted beforehand")
        self.assertEqual(cells["factor"], "truncation")

    def test_one_model_has_no_interval(self):
        cells, = ablations.effects_of_paper(rows_by_hand(0.5)[:6])
        self.assertEqual([cells[head] for head in ("effect", "95 % interval", "verdict")],
                         ["0.5", "–", "undecided"])

    def test_forest_plots(self):
        rows = rows_by_hand(0.5)
        for row in rows:
            effects = row["ablation"]["effects"]
            effects += [{**effects[0], "measure": "difference"}, {**effects[0], "column": "seconds"},
                        {**effects[0], "column": "seconds", "measure": "difference"}]
        with tempfile.TemporaryDirectory() as directory:
            ablations.write_forest_plots(ablations.judge_ablations(rows), directory, io.StringIO())
            written = {file.name for file in pathlib.Path(directory).iterdir()}
        # One plot of ratios and one of differences; seconds have no values, so no interval and no position.
        self.assertEqual(written, {f"ablation_toy-full-effects{which}.{end}" for which in ("", "-triangles")
                                   for end in ("pdf", "png", "svg")})


if __name__ == "__main__":
    unittest.main()
