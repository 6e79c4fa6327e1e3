import io
import math
import pathlib
import tempfile
import unittest

from .. import experiment, plots
from ..rows import ROOT, LabError

PLOT = {"name": "p", "title": "it's a title", "x": "swept", "y": ["wrong_share"], "x_label": "hole [voxel]",
        "y_label": "wrong [%]", "percent": True}


def row_of(label, x, share, **changes):
    return {"experiment": "toy", "run": "1", "case": {"name": "ball"}, "published_seconds": 10 * x,
            "variant": {"name": "v", "label": label}, "sweep": {"parameter": "hole", "value": x},
            "signs": {"wrong_share": share}, "plots": [PLOT], **changes}


def measured(x, **values):
    names = ["swept", "cost", "cost_low", "cost_high"]
    columns = [{"name": name, "header": name, "meaning": name} for name in names]
    return row_of("a", x, 0, measurement={"name": "m"}, table={"columns": columns},
                  values={"swept": x, **values})


def curves(rows, **changes):
    """Returns {label: [(x, y, low, high)]}; ends that are missing are left out."""
    def values(point):
        return tuple(each for each in (point.x, point.y, point.low, point.high) if each is not None)

    return {curve.label: list(map(values, curve.points))
            for curve in plots.curves_of(experiment.PLOT | PLOT | changes, rows)}


class Curves(unittest.TestCase):
    def test_one_for_each_label_or_method_sorted_by_x(self):
        rows = [row_of("a", 2, 0.5), row_of("b", 2, 0.1), row_of("a", 1, 0.25), row_of("b", 1, 0)]
        self.assertEqual(curves(rows), {"a": [(1, 25), (2, 50)], "b": [(1, 0), (2, 10)]})
        self.assertEqual(curves(rows[:2], by_variant=True), {"v": [(2, 10), (2, 50)]})
        self.assertEqual(curves(rows[:1], by_variant=True), {"a": [(2, 50)]})

    def test_further_columns_have_one_curve_from_the_first_label(self):
        found = curves([row_of("a", 1, 0.25), row_of("b", 1, 0), row_of("a", 2, 0.5)],
                       y=["wrong_share", "published_seconds"])
        self.assertEqual(found["published [s]"], [(1, 1000), (2, 2000)])
        self.assertEqual(set(found), {"a", "b", "published [s]"})

    def test_other_cases_and_resolutions_and_zero_on_logarithmic_axes_are_left_out(self):
        rows = [row_of("a", 1, 0), row_of("a", 2, 0.5), row_of("a", 0, 0.5, resolution=200)]
        self.assertEqual(curves(rows, log_y=True, log_x=True), {"a": [(2, 50)]})
        self.assertEqual(curves(rows, resolution=200), {"a": [(0, 50)]})
        self.assertEqual(curves(rows, case="cube"), {})

    def test_intervals_are_columns_or_repetitions(self):
        rows = [measured(1, cost=5, cost_low=4.5, cost_high=7), measured(2, cost=6)]
        self.assertEqual(curves(rows, y=["cost"], percent=False), {"a": [(1, 5, 4.5, 7), (2, 6)]})
        timed = row_of("a", 1, 0, seconds={"median": 2.0, "all": [3.0, 1.5, 2.0]})
        once = row_of("b", 1, 0, seconds={"median": 4.0, "all": [4.0]})
        self.assertEqual(curves([timed, once], y=["seconds"], percent=False),
                         {"a": [(1, 2, 1.5, 3)], "b": [(1, 4)]})

    def test_categories_are_numbered_by_x(self):
        given = ("late", 9, 0.5), ("first", 1, 0.25), ("mid", 5, 0.75), ("late", 8, 1)
        rows = [row_of(*each) for each in given]
        found, = curves(rows, categories=True).values()
        self.assertEqual(found, [(0, 25), (1, 75), (2, 50), (2, 100)])

    def test_an_unknown_column_is_an_error(self):
        with self.assertRaises(LabError):
            curves([row_of("a", 1, 0.5)], x="no such column")


class Axes(unittest.TestCase):
    def ticks(self, values, log, **options):
        return plots.ticks_of(values, plots.limits_of(values, log), log, **options)

    def test_ticks_are_at_values_that_are_few_and_apart(self):
        self.assertEqual(self.ticks([50, 100, 200, 100], True, at_values=True), [50, 100, 200])
        self.assertEqual(self.ticks([0, 100, 101], False, at_values=True), [0, 20, 40, 60, 80, 100])

    def test_a_logarithmic_axis_ends_near_the_values(self):
        low, high = plots.limits_of([0.95, 55], True)
        self.assertTrue(0.7 < low < 0.95 and 55 < high < 80)
        for tick, expected in zip(self.ticks([0.95, 55], True), [1, 2, 5, 10, 20, 50], strict=True):
            self.assertAlmostEqual(tick, expected)
        self.assertLessEqual(len(self.ticks([1e-9, 1e9], True)), 7)
        self.assertGreater(len(self.ticks([6.1, 6.2], True)), 1)

    def test_a_linear_axis_includes_zero_and_all_values(self):
        for values in ([20, 260], [-3, 5], [-5, -1], [0, 0], [7]):
            low, high = plots.limits_of(values, False, from_zero=True)
            self.assertTrue(low < high and low <= min(0, *values) and max(0, *values) <= high, values)
        self.assertEqual(plots.limits_of([20, 260], False, from_zero=True)[0], 0)

    def test_thousands_have_letters(self):
        self.assertEqual([plots.tick_text(1500, 2e6), plots.tick_text(1500, 2000), plots.tick_text(0.02, 1)],
                         ["1.5 k", "1500", "0.02"])


class Figures(unittest.TestCase):
    """Draws into a directory whose name has a blank and a quote."""

    def written(self, rows):
        """Returns {name: bytes} of the files."""
        with tempfile.TemporaryDirectory(prefix="plots' ") as directory:
            plots.write_plots(rows, directory, io.StringIO())
            return {file.name: file.read_bytes() for file in pathlib.Path(directory).iterdir()}

    def drawn(self, rows, **changes):
        """Returns the axes and the legend's labels of a plot of the rows."""
        plot = experiment.PLOT | PLOT | changes
        found = plots.curves_of(plot, rows)
        with plots.style():
            made = plots.draw(plot, found, rows, {curve.label: i for i, curve in enumerate(found)})
            made.draw_without_rendering()
        return made.axes[0], [text.get_text() for legend in made.legends for text in legend.get_texts()]

    def test_are_the_same_bytes_again(self):
        rows = [row_of("a", 1, 0.5), row_of("$\\frac{$ %s _", 2, 0.25), row_of("a", 2, 0.75)]  # no formula
        files = self.written(rows)
        self.assertEqual(set(files), {"toy-p.png", "toy-p.pdf", "toy-p.svg"})
        self.assertTrue(files["toy-p.pdf"].startswith(b"%PDF-") and files["toy-p.png"].startswith(b"\x89PNG"))
        self.assertIn("it's a title", files["toy-p.svg"].decode())
        self.assertEqual(self.written(rows), files)

    def test_without_points_are_not_written(self):
        self.assertEqual(self.written([row_of("a", 1, 0.5, plots=[PLOT | {"case": "cube"}])]), {})

    def test_styles_are_distinct(self):
        self.assertEqual(math.gcd(len(plots.COLOURS), len(plots.MARKS)), 1)

    def test_emphasised_curves_are_thick_and_below_and_labels_are_in_the_legend_once(self):
        rows = [row_of(label, x, 0.5) for label in ("peer", "ours, fast", "ours2") for x in (1, 2)]
        axes, legend = self.drawn(rows, emphasised=["ours"])
        self.assertEqual(legend, ["ours, fast", "peer", "ours2"])
        ours, peer, other = (line.get_linewidth() for line in axes.lines)
        self.assertTrue(ours > peer == other)

    def test_times_that_were_not_measured_are_dashed(self):
        rows = [row_of("a", 1, 0.25), row_of("a", 2, 0.5)]
        axes, _ = self.drawn(rows, y=["wrong_share", "published_seconds"])
        self.assertEqual([line.get_linestyle() for line in axes.lines], ["-", "--"])

    def test_categories_are_ticks_in_their_order(self):
        axes, legend = self.drawn([row_of("b", 2, 0.25), row_of("a", 1, 0.5)], categories=True)
        self.assertEqual([text.get_text() for text in axes.get_xticklabels()], ["a", "b"])
        self.assertEqual((list(axes.lines[0].get_ydata()), legend), ([50, 25], []))

    def test_the_title_states_circumstances(self):
        row = row_of("a", 1, 0.5, resolution=200, tier="quick", machine={"cpu": "Abacus", "cores": 2},
                     seconds={"median": 2.0}, case={"name": "ball", "origin": "stand-in: a ball"})
        axes, _ = self.drawn([row], resolution=200, note="a note", y=["seconds"])
        self.assertIn("200", axes.get_title())
        self.assertEqual(axes.texts[0].get_text(),
                         "a note; with a stand-in for ball; measured on Abacus, 2 cores; quick tier")


class CurrentPlots(unittest.TestCase):
    def test_kept_rows_have_the_plots_of_the_file(self):
        row = row_of("a", 1, 0.5, experiment="pareto", plots=[])
        for directory, is_kept in ((ROOT / "results/pareto", True), (ROOT / "results/local/pareto", False),
                                   (pathlib.Path("/somewhere/results/pareto"), False)):
            names = [plot["name"] for plot in plots.as_asked_today([row], directory)[0]["plots"]]
            self.assertEqual("dragon" in names, is_kept, directory)
        own = row_of("a", 1, 0.5, experiment="no such experiment")
        self.assertEqual(plots.as_asked_today([own], ROOT / "results/pareto"), [own])


if __name__ == "__main__":
    unittest.main()
