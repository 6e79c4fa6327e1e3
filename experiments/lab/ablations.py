"""Ablations: experiments that change one factor and predict its effects, as intervals with verdicts.

An experiment file with the key `factor` is an ablation (the keys are explained in
experiments/ablations/predictions/ablation_truncation.toml). Every row contains the ablation, so reports need
only rows. A subject, e.g. a model at a resolution, has one pair of values: at a level of the factor and at
the baseline. Resolutions of one model are not independent draws, so each model counts once, with the mean of
its pairs; ratios are averaged as logarithms. The interval is the hull of two 95 % intervals of the mean over
models: Student's t, which assumes a normal distribution, and the bias-corrected and accelerated bootstrap
(BCa; Efron & Tibshirani 1993, chapter 14), which does not, but is too narrow for few models.
"""

import collections
import dataclasses
import functools
import hashlib
import itertools
import math
import operator
import os
import pathlib
import re
import subprocess

import numpy
from scipy import special

from . import experiment, plots
from .rows import LabError, ROOT, all_columns, find, latest_groups, own_columns, readable, text_at, value_of

# level / baseline, level - baseline, (level + 1) / (baseline + 1)
MEASURES = ["ratio", "difference", "count-ratio"]
VERDICTS = ["holds", "falsified", "undecided"]
FEWEST_MODELS = 5  # needed for a verdict
RESAMPLES = 10_000
TAIL = 0.025  # of a two-sided 95 % interval

# ---- Effects


@dataclasses.dataclass
class EffectSize:
    """A mean effect over models with its 95 % interval, which is unbounded for fewer than two models."""

    estimate: float
    low: float
    high: float
    models: int
    pairs: int
    left_out: int  # pairs without an effect, e.g. a ratio to 0


@dataclasses.dataclass
class JudgedEffect:
    predicted: dict  # one of the row's /ablation/effects
    size: EffectSize
    verdict: str  # one of VERDICTS


@dataclasses.dataclass
class JudgedAblation:
    """An ablation with its effects over the latest rows of one experiment and tier."""

    experiment: str
    tier: str
    commit: str
    ablation: dict  # /ablation of the rows
    subjects: int
    effects: list  # in the order of the experiment file

    @property
    def prediction(self):
        """Returns where the prediction is committed, as prediction_of() does."""
        return self.ablation.get("prediction", {})


def student_interval(values):
    """Returns the ends of Student's 95 % interval of the mean."""
    error = numpy.std(values, ddof=1) / math.sqrt(len(values))
    half = special.stdtrit(len(values) - 1, 1 - TAIL) * error
    return numpy.mean(values) - half, numpy.mean(values) + half


def random_words(seed, count):
    """Returns numbers of the 64-bit Mersenne twister (mt19937_64 of C++; numpy has only that of 32 bits)."""
    state = [seed]
    for i in range(1, 312):
        state.append((6364136223846793005 * (state[-1] ^ state[-1] >> 62) + i) % 2**64)
    word = numpy.uint64
    state, blocks = numpy.array(state, word), []
    for _ in range(0, count, 312):
        for half in (slice(0, 156), slice(156, 312)):
            mixed = state[half] & word(2**64 - 2**31) | numpy.roll(state, -1)[half] & word(2**31 - 1)
            twisted = (mixed & word(1)) * word(0xB5026F5AA96619E9)
            state[half] = numpy.roll(state, -156)[half] ^ mixed >> word(1) ^ twisted
        blocks.append(state.copy())
    words = numpy.concatenate(blocks)[:count]
    words ^= words >> word(29) & word(0x5555555555555555)
    words ^= words << word(17) & word(0x71D67FFFEDA60000)
    words ^= words << word(37) & word(0xFFF7EEE000000000)
    return words ^ words >> word(43)


@functools.cache
def _resamples(n):
    """Returns RESAMPLES rows of n indices below n, always the same ones."""
    high = random_words(1, RESAMPLES * n) >> numpy.uint64(32)
    return (high * numpy.uint64(n) >> numpy.uint64(32)).reshape(RESAMPLES, n)


def bootstrap_interval(values):
    """Returns the ends of the 95 % BCa interval of the mean of values that are not all equal."""
    n, mean, array = len(values), sum(values) / len(values), numpy.array(values, float)
    means = numpy.sort(sum(array[column] for column in _resamples(n).T) / n)
    # Bias by equation 14.14, where a tie counts one half, and acceleration by the jackknife (14.15).
    below = sum(numpy.searchsorted(means, mean, side) for side in ("left", "right")) / 2
    bias = special.ndtri(min(max(below, 0.5), RESAMPLES - 0.5) / RESAMPLES)
    moved = (array - mean) / (n - 1)  # by leaving out each value, up to the sign
    acceleration = (moved**3).sum() / (6 * (moved**2).sum() ** 1.5)

    def end(tail):
        z = bias + special.ndtri(tail)
        share = special.ndtr(bias + z / (1 - acceleration * z))
        return float(means[min(RESAMPLES - 1, int(share * RESAMPLES))])

    return end(TAIL), end(1 - TAIL)


def _effect_of(baseline, level, measure):
    """Returns the effect of one pair on the scale that is averaged, None if it has none."""
    if baseline is None or level is None or not (math.isfinite(baseline) and math.isfinite(level)):
        return None
    if measure == "difference":
        return level - baseline
    plus = 1 if measure == "count-ratio" else 0
    return math.log((level + plus) / (baseline + plus)) if min(level, baseline) + plus > 0 else None


def effect_size(pairs, measure):
    """Returns the EffectSize of pairs (model, value at the baseline, value at the level)."""
    by_model = collections.defaultdict(list)
    for model, baseline, level in sorted(pairs, key=operator.itemgetter(0)):
        effect = _effect_of(baseline, level, measure)
        if effect is not None:
            by_model[model].append(effect)
    means = [sum(effects) / len(effects) for effects in by_model.values()]
    numbers = [sum(means) / len(means) if means else math.nan, -math.inf, math.inf]
    if len(means) >= 2:
        numbers[1:] = means[0], means[0]
        if min(means) < max(means):
            lows, highs = zip(student_interval(means), bootstrap_interval(means))
            numbers[1:] = min(lows), max(highs)
    if measure != "difference":
        with numpy.errstate(over="ignore"):
            numbers = numpy.exp(numbers)
    compared = sum(map(len, by_model.values()))
    return EffectSize(*map(float, numbers), len(means), compared, len(pairs) - compared)


def judge_prediction(predicted, size):
    """Returns the verdict on a prediction.

    It is falsified if the file's rule is true of the interval; otherwise it holds if the whole interval is in
    the predicted range. It is undecided with fewer than FEWEST_MODELS models, and if more than half of the
    pairs have no effect.
    """
    if size.models < FEWEST_MODELS or size.left_out > size.pairs:
        return "undecided"
    if falsifier(predicted["falsified_if"])(size.low, size.estimate, size.high):
        return "falsified"
    at_least, at_most = _range(predicted)
    return "holds" if at_least <= size.low and size.high <= at_most else "undecided"


def _range(predicted):
    """Returns the predicted range; rows have null for a missing end, since JSON has no infinity."""
    at_least, at_most = predicted["at_least"], predicted["at_most"]
    return -math.inf if at_least is None else at_least, math.inf if at_most is None else at_most


# ---- Falsifiers: "high < 1.2 or low > 3 and estimate > 4", where `and` binds more tightly than `or`

_NUMBER = "-?(?:0|[1-9][0-9]*)(?:[.][0-9]+)?(?:[eE][+-]?[0-9]+)?"
_COMPARISON = f"(?:low|high|estimate) [<>]=? {_NUMBER}"


@functools.cache
def falsifier(rule):
    """Returns a rule as a function of low, estimate and high. Raises LabError if it is invalid."""
    if not re.fullmatch(f"{_COMPARISON}( (and|or) {_COMPARISON})*", rule):
        raise LabError(f'the falsifier "{rule}" is invalid; compare low, high or estimate with a number by '
                       '<, <=, > or >=, and join comparisons by "and" and "or"')
    return eval(f"lambda low, estimate, high: {rule}")  # a valid rule is an expression of Python, too


def misfit(rule, at_least, at_most):
    """Returns why a rule does not fit a predicted range, "" if it does.

    It must be false of every interval within the range, and true of some interval. Its truth changes only at
    its numbers, so it suffices to try numbers at, below and above these.
    """
    ends = [*map(float, re.findall(_NUMBER, rule)), at_least, at_most]
    ends = [end for end in ends if math.isfinite(end)]
    tried = sorted({-1e300, 1e300}.union(*({end - step, end, end + step} for end in ends
                                           for step in [1e-9 * max(1.0, abs(end))])))
    true_of = [interval for interval in itertools.combinations_with_replacement(tried, 3)
               if falsifier(rule)(*interval)]
    if any(low >= at_least and high <= at_most for low, _, high in true_of):
        return "it can be true of an interval within the predicted range"
    return "" if true_of else "it is true of no interval"


# ---- Experiment files


def read_ablation(document, columns, where):
    """Returns the ablation of an experiment file as its rows keep it, None if the file has no key `factor`.

    `document` is the parsed file, `columns` are the valid names of columns (for a measurement its own ones),
    `where` is the file's name. Raises LabError for a missing or wrong key, and for a falsifier that does not
    fit its prediction.
    """
    own = {key: document[key] for key in ("factor", "levels", "baseline", "effects") if key in document}
    if not own:
        return None
    keys, levels = {"factor": experiment.text}, own.get("levels")
    if document.get("kind") == "measurement":
        keys["levels"] = experiment.list_of(experiment.text, distinct=True)
    else:
        keys["levels"] = experiment.choice("kind of levels", ["variants", "voxelizers", "resolutions"])
        levels = _labels(document, levels)
    if not isinstance(levels, list) or len(levels) < 2:
        raise LabError(f'{where}: an ablation needs two levels of its factor; "levels" must give them')
    keys["baseline"] = experiment.choice("level", levels)
    others = [level for level in levels if level != own.get("baseline")]
    keys["effects"] = experiment.list_of(_effects(others, columns), distinct=True)
    read = experiment.read_table(own, where, keys)
    kind = read["levels"] if isinstance(read["levels"], str) else "measured"
    return read | {"levels": kind, "effects": list(itertools.chain.from_iterable(read["effects"]))}


def _labels(document, kind):
    """Returns the levels that an experiment on extraction or voxelization has of a kind."""
    if kind == "resolutions":
        cases = [case for tier in ("quick", "full") for case in document.get(tier, {}).get("cases", [])]
        return list(dict.fromkeys(str(number) for case in cases for number in case.get("resolutions", [])))
    if document.get("kind") == "voxelization":  # the voxelizers compete
        kind = {"variants": "voxelizers"}.get(kind)
    entries = document.get(kind, [])
    return [entry if isinstance(entry, str) else entry.get("label", entry.get("name")) for entry in entries]


def _effects(levels, columns):
    """Returns a checker of an [[effects]] table, which gives one effect for each of its levels."""
    keys = {"levels": experiment.list_of(experiment.choice("level", levels), distinct=True),
            "column": experiment.choice("column", columns),
            "measure": experiment.choice("measure", MEASURES),
            "better": experiment.choice("direction", ["lower", "higher"]),
            "prediction": experiment.text, "falsified_if": experiment.text}
    ends = dict.fromkeys(["at_least", "at_most"], experiment.number(-1e12, 1e12))

    def check(value, where):
        effect = {"at_least": None, "at_most": None} | experiment.read_table(value, where, keys, ends)
        if not ends.keys() & value.keys():
            raise LabError(f'{where}: a prediction needs its size: "at_least", "at_most", or both')
        if operator.gt(*_range(effect)):
            raise LabError(f'{where}: "at_most" is below "at_least"')
        try:
            wrong = misfit(effect["falsified_if"], *_range(effect))
        except LabError as error:
            raise LabError(f"{where}: {error}") from None
        if wrong:
            raise LabError(f'{where}: "falsified_if" does not fit the prediction: {wrong}')
        return [{"level": level, **effect} for level in effect.pop("levels")]
    return check


# ---- The commit of a prediction


def _git(directory, *arguments):
    """Returns git's output, with dates in UTC like those of rows; None if it fails or is not installed."""
    try:
        ended = subprocess.run(["git", "-C", str(directory), *arguments], capture_output=True,
                               env={**os.environ, "TZ": "UTC"})
    except OSError:
        return None
    return ended.stdout if ended.returncode == 0 else None


def prediction_of(file):
    """Returns {"file", "sha256", "commit", "date"}: the last commit that changed an ablation's file.

    If the file is not committed, or was changed since, a "note" replaces the last two: the prediction may
    have been written after the run.
    """
    file = pathlib.Path(file).resolve()
    prediction = {"file": file.name, "sha256": hashlib.sha256(file.read_bytes()).hexdigest()}
    path = _git(file.parent, "ls-files", "--full-name", "--", file.name)
    date = "--date=format-local:%Y-%m-%dT%H:%M:%SZ"
    last = _git(file.parent, "log", "-1", date, "--format=%H %cd", "--", file.name)
    if not path or not last:
        return {**prediction, "note": f"the prediction in {file.name} is not committed"}
    if _git(file.parent, "status", "--porcelain", "--", file.name) != b"":
        return {**prediction, "note": f"the prediction in {file.name} was changed since it was committed"}
    commit, date = last.decode().split()
    return {**prediction, "file": path.decode().rstrip("\n"), "commit": commit, "date": date}


def check_prediction(prediction, out, checkout=ROOT):
    """Raises LabError if a prediction is not committed and `out` is in results/, except results/local/."""
    results, out = (pathlib.Path(checkout) / "results").resolve(), pathlib.Path(out).resolve()
    is_kept = out.is_relative_to(results) and not out.is_relative_to(results / "local")
    if is_kept and prediction.get("note"):
        raise LabError(f"{out} takes only rows with a committed prediction, and {prediction['note']}: commit "
                       f"it before the run, or pass another directory such as results/local/{out.name}")


def prediction_problem(row, checkout=ROOT):
    """Returns a problem of the prediction of an ablation's row, "" if there is none, and for any other row.

    Its commit must be the row's or an ancestor, be older than the row, and contain the file with the row's
    hash. Only the row is checked if the checkout does not have both commits, e.g. without git.
    """
    if find(row, "/ablation") is None:
        return ""
    prediction, own = row["ablation"].get("prediction", {}), text_at(row, "/commit")
    commit, file = text_at(prediction, "/commit"), text_at(prediction, "/file")
    if not commit:
        return text_at(prediction, "/note")
    if text_at(prediction, "/date") > text_at(row, "/date"):  # both like 2026-11-27T11:00:00Z
        return f"the prediction in {file} is younger than the row"
    if any(_git(checkout, "cat-file", "-e", name + "^{commit}") is None for name in (commit, own)):
        return ""
    if _git(checkout, "merge-base", "--is-ancestor", commit, own) is None:
        return f"the prediction's commit {commit[:12]} is not before the row's {own[:12]}"
    content = _git(checkout, "show", f"{commit}:{file}")
    if content is None or hashlib.sha256(content).hexdigest() != text_at(prediction, "/sha256"):
        return f"{file} of commit {commit[:12]} is not the file that the row names"
    return ""


def prediction_problems(rows, checkout=ROOT):
    """Returns the sorted problems of the rows' predictions; checks one row of each prediction and commit."""
    first = {}
    for row in rows:
        first.setdefault((text_at(row, "/ablation/prediction"), text_at(row, "/commit")), row)
    return sorted({prediction_problem(row, checkout) for row in first.values()} - {""})


# ---- Reports from rows


def _position(row, levels):
    """Returns (model, subject, level) of a row; `levels` is what the levels of the factor are."""
    if levels == "measured":
        model = text_at(row, "/values/model")
        return model, model + "/" + text_at(row, "/values/resolution"), text_at(row, "/values/level")
    model = text_at(row, "/case/name")
    parts = {"resolutions": text_at(row, "/resolution"), "variants": text_at(row, "/variant/label"),
             "voxelizers": text_at(row, "/voxelization/label")}
    level = parts.pop(levels)
    return model, "/".join([model, *parts.values()]), level


def _number_in(row, name):
    """Returns the number in a column, None if the cell failed or has no such number."""
    column = next((c for c in [*own_columns(row), *all_columns()] if c.name == name), None)
    return plots.as_number(value_of(column, row)) if column and find(row, "/failed") is None else None


def judge_ablations(rows):
    """Returns each ablation of the rows, tier by tier; none if the rows are of other experiments.

    Rows of an older wording of the experiment file than that of the last row are left out.
    """
    own = collections.defaultdict(list)
    for group in latest_groups(rows):
        for row in group.rows:
            if find(row, "/ablation") is not None:
                own[text_at(row, "/experiment"), text_at(row, "/tier")].append(row)
    return [_judge(*key, found) for key, found in own.items()]


def _judge(name, tier, rows):
    ablation, subjects = rows[-1]["ablation"], {}
    for row in rows:
        if row["ablation"] == ablation:
            model, subject, level = _position(row, ablation["levels"])
            subjects.setdefault(subject, (model, {}))[1][level] = row
    effects = []
    for predicted in ablation["effects"]:
        levels = ablation["baseline"], predicted["level"]
        pairs = [(model, *(_number_in(by_level[level], predicted["column"]) for level in levels))
                 for _, (model, by_level) in sorted(subjects.items()) if all(map(by_level.get, levels))]
        size = effect_size(pairs, predicted["measure"])
        effects.append(JudgedEffect(predicted, size, judge_prediction(predicted, size)))
    return JudgedAblation(name, tier, text_at(rows[-1], "/commit"), ablation, len(subjects), effects)


def effect_cells(judged, effect):
    """Returns {head: cell} of an effect's line in a table, all of it text."""
    predicted, size, (at_least, at_most) = effect.predicted, effect.size, _range(effect.predicted)
    beforehand = "" if judged.prediction.get("commit") else ", not predicted beforehand"
    return {"level": predicted["level"], "against": judged.ablation["baseline"],
            **{head: predicted[head] for head in ("column", "measure", "better")}, "models": str(size.models),
            "pairs": str(size.pairs), "left out": str(size.left_out),
            "effect": readable(size.estimate) if size.models else "–",
            "95 % interval": f"{readable(size.low)} to {readable(size.high)}" if size.models > 1 else "–",
            "predicted": f"≤ {readable(at_most)}" if math.isinf(at_least) else
                         f"≥ {readable(at_least)}" if math.isinf(at_most) else
                         f"{readable(at_least)} to {readable(at_most)}",
            "falsified if": predicted["falsified_if"],
            "verdict": effect.verdict + beforehand}


def effects_of_paper(rows):
    """Returns factor and cells of each effect of the full tier, or of the quick one if it is the only one."""
    by_tier = {judged.tier: judged for judged in judge_ablations(rows)}
    judged = by_tier.get("full") or by_tier["quick"]
    factor = judged.ablation["factor"]
    return [{"factor": factor, **effect_cells(judged, effect)} for effect in judged.effects]


_TO_THE_RIGHT = {"models", "pairs", "left out", "effect"}


def _table(lines):
    """Returns a table of Markdown of lines {head: cell}."""
    rule = ["--:" if head in _TO_THE_RIGHT else "---" for head in lines[0]]
    cells = [lines[0], rule, *(line.values() for line in lines)]
    return "".join("| " + " | ".join(line) + " |\n" for line in cells)


def _counts(ablations):
    counts = collections.Counter(effect.verdict for judged in ablations for effect in judged.effects)
    holds, falsified, undecided = (counts[verdict] for verdict in VERDICTS)
    return f"{holds} predictions hold, {falsified} are falsified, and {undecided} are undecided"


def write_effects(judged, out):
    """Writes a section of Markdown: the prediction's commit, a table of the effects, and the predictions."""
    prediction, ablation = judged.prediction, judged.ablation
    source = prediction.get("note", "")
    if prediction.get("commit"):
        source = (f"{prediction['file']} as commit {prediction['commit'][:12]} of {prediction['date']} "
                  f"left it; the rows are of commit {judged.commit[:12]}")
    out.write(f"### effects of {ablation['factor']}\n\n"
              f"- subjects: {judged.subjects}; baseline: {ablation['baseline']}\n- prediction: {source}\n"
              "- interval: hull of Student's t and of the BCa bootstrap (Efron & Tibshirani 1993) over "
              f"models, a model's resolutions averaged\n- verdicts: {_counts([judged])}\n\n")
    out.write(_table([effect_cells(judged, effect) for effect in judged.effects]) + "\n")
    sentences = [(effect.predicted["column"], effect.predicted["prediction"]) for effect in judged.effects]
    for _, same in itertools.groupby(sentences, operator.itemgetter(1)):  # several levels may share one
        out.write("- predicted of {}: {}\n".format(*next(same)))
    out.write("\n")


def summary_of(ablations):
    """Returns the effects of all ablations in one table of Markdown, with counts of the verdicts."""
    if not ablations:
        return "\nNo ablation has rows yet.\n"
    lines = [{"ablation": judged.experiment, "factor": judged.ablation["factor"],
              **effect_cells(judged, effect)} for judged in ablations for effect in judged.effects]
    return f"\nOf {len(ablations)} ablations {_counts(ablations)}.\n\n{_table(lines)}"


# ---- Forest plots: a line with its interval for each effect, over the predicted range

_COLOURS = {"holds": "#009e73", "falsified": "#d55e00", "undecided": "#666666"}
_PREDICTED = "#dce9f5"


def write_forest_plots(judged, directory, out):
    """Draws the effects of each ablation as PNG, PDF and SVG and names the files in `out`.

    Ratios are in one plot, differences in one for each column. Effects without an interval are left out.
    """
    for ablation in judged:
        forests = {}
        for effect in ablation.effects:
            is_ratio, column = effect.predicted["measure"] != "difference", effect.predicted["column"]
            if math.isfinite(effect.size.high - effect.size.low):
                name = f"{ablation.experiment}-{ablation.tier}-effects" + ("" if is_ratio else "-" + column)
                label = "level ÷ baseline" if is_ratio else f"{column}: level − baseline"
                forests.setdefault((name, label, is_ratio), []).append(effect)
        for (name, label, is_ratio), effects in forests.items():
            with plots.style():
                drawn = _forest(effects, is_ratio)
                drawn.suptitle("{factor}, against {baseline}".format(**ablation.ablation))
                drawn.axes[0].set_xlabel(label)
                plots.save(drawn, pathlib.Path(directory) / name, out)


def _forest(effects, is_ratio):
    ends = [float(is_ratio)]  # no effect
    for effect in effects:
        ends += [end for end in (effect.size.low, effect.size.high, *_range(effect.predicted))
                 if math.isfinite(end) and (end > 0 or not is_ratio)]
    low, high = plots.limits_of(ends, is_ratio)
    drawn = plots.figure(22, 4.3 + 0.85 * len(effects))
    axes = drawn.add_subplot(xscale="log" if is_ratio else "linear")
    for y, effect in enumerate(effects):
        start, stop = (min(max(end, low), high) for end in _range(effect.predicted))
        axes.barh(y, stop - start, 0.7, start, color=_PREDICTED)
        colour = _COLOURS[effect.verdict]
        axes.plot([effect.size.low, effect.size.high], [y, y], "|-", color=colour, linewidth=2, mew=2)
        axes.plot(effect.size.estimate, y, "o", color=colour)
    axes.axvline(ends[0], color="black", linewidth=1, linestyle="--", zorder=1.5)
    ticks = plots.ticks_of(ends, (low, high), is_ratio)
    axes.set_xticks(ticks, [f"{tick:.6g}" for tick in ticks])
    axes.set_xticks([], minor=True)
    labels = ["{level}: {column}".format(**effect.predicted) for effect in effects]
    axes.set_yticks(range(len(effects)), labels)
    axes.set(xlim=(low, high), ylim=(len(effects) - 0.4, -0.6))
    axes.tick_params(axis="y", length=0)
    axes.grid(False, axis="y")
    axes.spines["left"].set_visible(False)
    keys = [axes.plot([], [], "o-", color=colour, label=verdict)[0] for verdict, colour in _COLOURS.items()]
    keys.append(axes.bar(low, 0, color=_PREDICTED, label="predicted"))
    axes.legend(handles=keys, loc="lower center", bbox_to_anchor=(0.5, 1), ncol=4)
    return drawn
