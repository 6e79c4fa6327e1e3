"""Plots of rows as their experiment's [[plots]] ask for them: PNG to look at, PDF and SVG to print."""

import collections
import dataclasses
import functools
import math
import pathlib
import textwrap
import tomllib

from . import experiment
from .rows import ROOT, LabError, all_columns, find, latest_groups, own_columns, text_at, value_of

# Colours that the colour-blind distinguish (Okabe and Ito 2008, with grey and black in place of yellow, which
# is invisible on white). page.css has the same ones in the same order. Marks are filled, hollow, and strokes;
# their number and that of the colours have no common divisor, so 120 labels differ.
COLOURS = ("#0072b2", "#e69f00", "#009e73", "#d55e00", "#56b4e9", "#cc79a7", "#666666", "#000000")
MARKS = ("o", "s", "^", "v", "D", "p", "o", "s", "^", "v", "D", "p", "+", "x", (8, 2, 0))


@dataclasses.dataclass
class Point:
    x: float
    y: float
    row: int  # index into the given rows
    low: float | None = None  # ends of y's interval, both or none
    high: float | None = None


@dataclasses.dataclass
class Curve:
    label: str
    column: str  # the column of y
    points: list = dataclasses.field(default_factory=list)  # sorted by x, then by y


# ---- What the plots are


@functools.cache
def _current(name):
    """Returns the plots and columns of the project's experiment of this name, {} if there is none."""
    for found in experiment.list_experiments():
        if found["name"] == name:
            read = tomllib.loads(found["file"].read_text())
            plots = [experiment.plot(None, None)(plot, found["file"].name) for plot in read.get("plots", [])]
            return {"plots": plots} | ({"columns": read["columns"]} if "columns" in read else {})
    return {}


def as_asked_today(rows, directory):
    """Returns the rows with the plots and columns that their experiment's file asks for today.

    Rows of a directory outside of results/, or in results/local, keep their own, since another experiment may
    have the name of one of the project's. So do rows of experiments that no longer exist. Rows of baselines
    keep their columns, which are those that are compared.
    """
    directory, results = pathlib.Path(directory).resolve(), ROOT / "results"
    if not directory.is_relative_to(results) or directory.is_relative_to(results / "local"):
        return rows
    keys = ("plots",) if directory.is_relative_to(results / "baselines") else ("plots", "columns")
    found = ((row, _current(text_at(row, "/experiment"))) for row in rows)
    return [row | {key: current[key] for key in keys if key in current and (key == "plots" or key in row)}
            for row, current in found]


def plotted_rows(rows):
    """Returns (experiment, latest rows, plots of the last of them) for each experiment, sorted by name."""
    latest = collections.defaultdict(list)
    for group in latest_groups(rows):
        for row in group.rows:
            latest[text_at(row, "/experiment")].append(row)
    return [(name, own, [experiment.PLOT | plot for plot in find(own[-1], "/plots") or []])
            for name, own in sorted(latest.items())]


# ---- Curves


def _column(row, name):
    for column in (*own_columns(row), *all_columns()):
        if column.name == name:
            return column
    raise LabError(f"there is no column \"{name}\" to plot; see experiments/lab/columns.toml")


def as_number(value):
    """Returns the value if it is a number, else None."""
    return value if isinstance(value, (int, float)) and not isinstance(value, bool) else None


def number_in(name, row):
    """Returns a row's number in a column, None if it has none. Raises LabError for an unknown column."""
    return as_number(value_of(_column(row, name), row))


def interval_of(name, row):
    """Returns the ends of the interval of a column, (None, None) if it has none.

    They are the columns NAME_low and NAME_high of a measurement, or the shortest and the longest repetition.
    """
    times = find(row, "/seconds/all") or []
    if name == "seconds" and find(row, "/measurement") is None and len(times) > 1:
        return min(times), max(times)
    values = {column.name: as_number(value_of(column, row)) for column in own_columns(row)}
    ends = values.get(name + "_low"), values.get(name + "_high")
    return (None, None) if None in ends else ends


def curves_of(plot, rows):
    """Returns the curves of a plot, one for each label or, with by_variant, for each method, which has the
    name of its label if it has only one.

    Columns of y after the first do not depend on the method, e.g. times that the thesis prints: they are
    taken from the rows of the first label and are called by their header. With categories, each column of y
    is one curve, and x numbers the labels from 0, sorted by their least value of plot["x"].
    """
    who, scale, curves, labels = label_pointer(plot), 100 if plot["percent"] else 1, {}, {}
    chosen = [(i, row, number_in(plot["x"], row)) for i, row in enumerate(rows)
              if plot["case"] in ("", text_at(row, "/case/name"))
              and plot["resolution"] in (0, row.get("resolution", 0))]
    if plot["categories"]:
        least = {}
        for _, row, x in sorted(chosen, key=lambda each: each[2] or 0):
            least.setdefault(text_at(row, who), len(least))
        chosen = [(i, row, least[text_at(row, who)]) for i, row, _ in chosen]
    for _, row, _ in chosen:
        labels.setdefault(text_at(row, who), {})[text_at(row, "/variant/label")] = True
    for i, row, x in chosen:
        label = text_at(row, who)
        if x is None or (plot["log_x"] and not plot["categories"] and x <= 0):
            continue
        for number, column in enumerate(plot["y"]):
            y = number_in(column, row)
            is_further = number > 0 and label != text_at(rows[0], who) and not plot["categories"]
            if y is None or (plot["log_y"] and y <= 0) or is_further:
                continue
            own = list(labels[label])[0] if len(labels[label]) == 1 else label
            name = _column(row, column).header if number > 0 or plot["categories"] else own
            ends = [None if end is None else scale * end for end in interval_of(column, row)]
            curves.setdefault(name, Curve(name, column)).points.append(Point(x, scale * y, i, *ends))
    for curve in curves.values():
        curve.points.sort(key=lambda point: (point.x, point.y, point.row))
    return list(curves.values())


def label_pointer(plot):
    """Returns where rows have the name of their curve."""
    return "/variant/name" if plot["by_variant"] else "/variant/label"


# ---- Axes


def tick_text(value, greatest):
    """Returns "250", "1.5 M" or "0.02"; thousands get a letter if the axis reaches 10,000."""
    for factor, letter in ((1e9, "G"), (1e6, "M"), (1e3, "k")):
        if greatest >= 1e4 and abs(value) >= factor:
            return f"{value / factor:.4g} {letter}"
    return f"{value:.6g}"


def limits_of(values, log, from_zero=False):
    """Returns the ends of an axis, a little beyond the values. A linear axis includes 0 if `from_zero`."""
    least, most = min(values), max(values)
    if log:
        # At least a fifth of a decade, so that numbers that hardly differ do not look far apart.
        decades = math.log10(most / least)
        room = 10 ** max(0.05 * decades, 0.5 * (0.2 - decades), 0.02)
        return least / room, most * room
    if from_zero:
        least, most = min(least, 0), max(most, 0)
    span = most - least or max(abs(most), 1)
    return (0 if from_zero and least == 0 else least - 0.04 * span,
            0 if from_zero and most == 0 > least else most + 0.05 * span)


def ticks_of(values, limits, log, at_values=False):
    """Returns about seven positions; if `at_values`, those of values that are few and far enough apart."""
    distinct, scale = sorted(set(values)), math.log if log else float
    places = [scale(value) / (scale(limits[1]) - scale(limits[0])) for value in distinct]
    apart = all(b - a >= 0.045 for a, b in zip(places, places[1:]))  # so that texts do not touch
    if at_values and 1 < len(distinct) <= 9 and apart:
        return distinct
    if log and len(ticks := _log_ticks(*limits)) > 1:
        return ticks
    from matplotlib.ticker import MaxNLocator
    whole = not log and all(value == round(value) for value in values)
    ticks = MaxNLocator(6, steps=[1, 2, 5, 10], integer=whole).tick_values(*limits)
    return [tick for tick in map(float, ticks) if limits[0] <= tick <= limits[1]]


def _multiples(low, high, digits):
    decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    values = (digit * 10.0**decade for decade in decades for digit in digits)
    return [value for value in values if low <= value <= high]


def _log_ticks(low, high, most=7):
    """Returns multiples of the densest set of digits that is not crowded, or every n-th power of ten."""
    for digits in (range(1, 10), (1, 2, 3, 5, 7), (1, 2, 5), (1, 3), (1,)):
        if len(ticks := _multiples(low, high, digits)) <= most:
            return ticks
    return ticks[::-(-len(ticks) // most)]


# ---- Drawing


def style():
    """Returns a context in which figures are drawn and saved with the style of the project's plots."""
    import matplotlib
    return matplotlib.rc_context({
        "font.size": 9.5, "axes.titlesize": 9.5, "axes.linewidth": 0.6,
        "axes.spines.top": False, "axes.spines.right": False, "axes.axisbelow": True, "axes.grid": True,
        "grid.color": "#dddddd", "grid.linewidth": 0.4, "xtick.minor.width": 0.4, "ytick.minor.width": 0.4,
        "legend.frameon": False, "text.parse_math": False, "pdf.fonttype": 42, "svg.fonttype": "none",
        "svg.hashsalt": "hermesh"})


def figure(width, height):
    """Returns an empty figure of this size in centimetres, whose axes leave room for all of their texts."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    made = Figure(figsize=(width / 2.54, height / 2.54), layout="constrained")
    FigureCanvasAgg(made)
    return made


def save(made, stem, out):
    """Writes STEM.png, STEM.pdf and STEM.svg, the same bytes for the same figure, and names them in `out`."""
    made.draw_without_rendering()
    made.set_layout_engine("none")  # one layout for all of them
    unset = {"png": ["Software"], "pdf": ["CreationDate", "Producer"], "svg": ["Date", "Creator"]}
    for extension, keys in unset.items():
        made.savefig(f"{stem}.{extension}", dpi=1200 / 16.8 * 2.54, metadata=dict.fromkeys(keys))
    print(f"Plot: {stem}.png, .pdf, .svg", file=out)


def write_plots(rows, directory, out):
    """Draws the plots of the latest rows into the directory and names the files in `out`.

    Plots without a point are left out. Rows in results/ are drawn as their experiment's file asks today.
    """
    with style():
        for name, own, plots in plotted_rows(as_asked_today(rows, directory)):
            numbers = {}  # a label has the same style in all plots of an experiment
            for plot in plots:
                curves = curves_of(plot, own)
                stem = pathlib.Path(directory) / f"{name}-{plot['name']}"
                if curves:
                    for curve in curves:
                        numbers.setdefault(curve.label, len(numbers))
                    save(draw(plot, curves, own, numbers), stem, out)


def draw(plot, curves, rows, numbers):
    """Returns the figure of a plot; `numbers` gives each label its style."""
    points = [point for curve in curves for point in curve.points]
    categories = {point.x: text_at(rows[point.row], label_pointer(plot)) for point in points}
    columns = min(max(80 // (max(len(curve.label) for curve in curves) + 8), 1), 5)
    is_right = len(curves) > 3 * columns  # a legend below would take too many lines
    made = figure(16.8 * (1.3 if is_right else 1), 11.76)
    axes = made.add_subplot()
    curves = sorted(curves, key=lambda curve: not _is_emphasised(plot, curve.label))  # below the others
    for i, curve in enumerate(curves):
        _draw_curve(axes, plot, curve, numbers[curve.label], 1 - i / max(len(curves) - 1, 1))
    y = [end for point in points for end in (point.y, point.low, point.high)
         if end is not None and (end > 0 or not plot["log_y"])]
    if plot["categories"]:
        are_long = len(categories) > 16 or any(len(label) > 6 for label in categories.values())
        axes.set_xlim(-0.5, max(categories) + 0.5)
        axes.set_xticks(list(categories), categories.values(), rotation=90 if are_long else 0)
    else:
        _set_axis(axes, "x", [point.x for point in points], plot["log_x"], at_values=True)
    _set_axis(axes, "y", y, plot["log_y"], from_zero=True)
    axes.set(xlabel=plot["x_label"], ylabel=plot["y_label"])
    _set_title(axes, plot, _circumstances(plot, [rows[i] for i in sorted({point.row for point in points})]))
    if not plot["categories"] or len(curves) > 1:
        _set_legend(made, axes, columns, is_right)
    return made


def _is_emphasised(plot, label):
    """A name stands for itself and for what begins with it, as "openvdb" does for "openvdb, 1 thread"."""
    return any(label.startswith(name) and label[len(name):len(name) + 1] in ("", " ", ",")
               for name in plot["emphasised"])


def _draw_curve(axes, plot, curve, number, above):
    """Draws a curve. Marks of curves below others are larger, since curves that coincide are common."""
    colour, emphasised = COLOURS[number % len(COLOURS)], _is_emphasised(plot, curve.label)
    x, y = [point.x for point in curve.points], [point.y for point in curve.points]
    if any(point.low is not None for point in curve.points):
        ends = [(at, at) if point.low is None else (point.low, point.high)
                for at, point in zip(y, curve.points)]
        lengths = [(max(0, at - low), max(0, high - at)) for at, (low, high) in zip(y, ends)]
        axes.errorbar(x, y, list(zip(*lengths)), fmt="none", ecolor=colour, elinewidth=0.7, capsize=2)
    is_joined = len(x) > 1 and not plot["categories"]
    is_further = curve.column != plot["y"][0] and not plot["categories"]  # not measured here
    mark = MARKS[number % len(MARKS)]
    axes.plot(x, y, label=curve.label, color=colour, zorder=3, clip_on=False,
              linestyle=("--" if is_further else "-") if is_joined else "",
              linewidth=2.2 if emphasised else 0.9, marker=mark,
              markersize=(3.6 + 2.2 * above + 1.6 * emphasised) * (0.8 if mark == "D" else 1),
              markerfacecolor="white" if 6 <= number % len(MARKS) < 12 else colour)


def _set_axis(axes, name, values, log, from_zero=False, at_values=False):
    low, high = limits_of(values, log, from_zero)
    ticks = ticks_of(values, (low, high), log, at_values)
    axes.set(**{f"{name}scale": "log" if log else "linear"})
    axes.set(**{f"{name}lim": (low, high)})
    axis = getattr(axes, f"{name}axis")
    axis.set_ticks(ticks, [tick_text(tick, max(map(abs, ticks))) for tick in ticks])
    minor = [tick for tick in _multiples(low, high, range(1, 10)) if tick not in ticks] if log else []
    axis.set_ticks(minor, [""] * len(minor), minor=True)


def _set_title(axes, plot, circumstances):
    title = plot["title"]
    if plot["resolution"] and str(plot["resolution"]) not in title:
        title += f" at {plot['resolution']} voxels"
    lines = textwrap.wrap(circumstances, 105)
    axes.set_title(title, pad=8 + 11 * len(lines))
    axes.annotate("\n".join(lines), (0.5, 1), (0, 5), "axes fraction", textcoords="offset points",
                  ha="center", va="bottom", size=7.2, color="#555555", linespacing=1.4)


def _circumstances(plot, shown):
    """Returns the plot's note, the stand-ins among the inputs, the machines of times, and the quick tier."""
    sources = (source for row in shown for source in [row["case"], *row.get("inputs", [])])
    stand_ins = {source["name"] for source in sources if source.get("origin", "").startswith("stand-in")}
    machines = {f"{text_at(row, '/machine/cpu')}, {text_at(row, '/machine/cores')} cores"
                for row in shown if find(row, "/machine/cpu")}
    parts = [plot["note"]]
    if stand_ins:
        parts.append("with a stand-in for " + " and ".join(sorted(stand_ins)))
    if machines and any(word in plot["y"][0] for word in ("second", "speed")):
        parts.append("measured on " + " and ".join(sorted(machines)))
    if any(row.get("tier") == "quick" for row in shown):
        parts.append("quick tier")
    return "; ".join(filter(None, parts))


def _set_legend(made, axes, columns, is_right):
    """Adds the legend below the axes or to the right of them, never over the curves."""
    count = len(axes.get_legend_handles_labels()[0])
    legend = made.legend(loc="center right" if is_right else "lower center",
                         ncol=-(-count // 22) if is_right else min(columns, count))
    size = legend.get_window_extent(made.canvas.get_renderer())
    width, bottom = size.width / made.bbox.width, size.height / made.bbox.height + 0.01
    made.get_layout_engine().set(rect=(0, 0, 1 - width, 1) if is_right else (0, bottom, 1, 1 - bottom))
