"""Results of a benchmark: success rates by class and program, profiles, worst cases and differences."""

import base64
import collections
import hashlib
import json
import math
import pathlib
import statistics

import numpy
from scipy.stats import binomtest

from . import plots
from .corpus import OPERATIONS, SIZES, size_group
from .rows import LabError

CLASSES = ["clean solid", "closed, self-intersecting", "closed, non-manifold or doubled", "few holes",
           "open sheets", "flat", "no mesh"]
TAGS = ["several bodies", "thinner than a voxel", "input not clean"]
LOSS = INVENTED = 0.01  # shares of the visible surface, and of the output, above which they count
NEAR = {"remesh": "valid and near %", "simplify": "valid and within the bound %",
        "combine": "valid and right %", "fracture": "valid and right %"}
WORST = 300  # cases in the gallery
VARYING = {"cpu_seconds", "wall_seconds", "seconds", "peak_mib", "commit"}  # from day to day


def read(directory, name):
    """Returns the "rows" or the "models" of all shards of a benchmark. A last line that is incomplete, since
    the run was interrupted while it was written, is left out.
    """
    return [json.loads(line) for file in sorted(pathlib.Path(directory).glob(f"{name}*.ndjson"))
            for line in file.read_text().splitlines(keepends=True) if line.endswith("\n")]


def read_with_models(directory):
    """Returns the rows of all shards of a benchmark with the class, tags and size of their models."""
    models = {row["sha256"]: row for row in read(directory, "models")}
    rows = {(row["sha256"], row["method"]): row for row in read(directory, "rows")}
    known = ("class", "tags", "name", "pair", "volumes")
    return [{**row, **{key: models[sha][key] for key in known if key in models[sha]},
             "model_triangles": models[sha]["triangles"]}
            for (sha, _), row in rows.items() if sha in models]


def rate(count, of):
    """Returns a percentage with its Wilson interval at 95 % as text."""
    if not of:
        return "–"
    interval = binomtest(int(count), int(of)).proportion_ci(method="wilson")
    return f"{100 * count / of:.1f} [{100 * interval.low:.1f}, {100 * interval.high:.1f}]"


def is_near(row):
    """Returns True if a mesh is near the model, within the bound of a simplification, or the right solid, or
    if pieces are right.
    """
    if "distance" in row:
        return row["distance"] <= 1
    if "wrong" in row:
        return max(row["wrong"], row.get("volume_error", 0)) <= LOSS
    return row["lost"] <= LOSS and row["invented"] <= INVENTED


def counted(rows):
    """Returns the rows with their successes, except those of programs that are not installed."""
    result = []
    for row in rows:
        done = row["status"] == "done"
        valid = done and row["watertight"]
        result.append({**row, "done": done, "valid": valid,
                       "near": valid and is_near(row),
                       "claims something": done and bool(row.get("claims") or "seconds" in row),
                       "fails a claim": bool(row.get("failed_claims"))})
    return [row for row in result if row["status"] != "not installed"]


def _groups(rows):
    """Yields the name and the rows of each class, tag and size that has some, and of all meshes."""
    meshes = [row for row in rows if row["class"] != "no mesh"]
    groups = {name: [row for row in rows if row["class"] == name] for name in [*CLASSES, *OPERATIONS]}
    groups |= {name: [row for row in meshes if name in row["tags"].split(", ")] for name in TAGS}
    groups |= {name: [row for row in meshes if size_group(row["model_triangles"]) == name]
               for name in SIZES.values()}
    yield from ((name, own) for name, own in {**groups, "all meshes": meshes}.items() if own)


def _median(values, form):
    return form % statistics.median(values) if values else "–"


def _share_above(key, limit):
    return lambda made: rate(sum(row[key] > limit for row in made), len(made))


def _median_percentage(key, form):
    return lambda made: _median([100 * row[key] for row in made], form)


def volume_errors(made):
    """Returns by how much |A| + |B| = |A ∪ B| + |A ∩ B| and |A| = |A ∖ B| + |A ∩ B| fail, as shares of
    |A| + |B|, of each pair for which a method made both meshes.
    """
    found, errors = collections.defaultdict(dict), []
    for row in made:
        found[row["pair"]][row["class"]] = row
    for rows in found.values():
        for operation in {"union", "difference"} & rows.keys() if "intersection" in rows else ():
            first, second = rows[operation]["volumes"]
            expected = first + second if operation == "union" else first
            error = rows[operation]["volume"] + rows["intersection"]["volume"] - expected
            errors.append(abs(error) / (first + second))
    return errors


# Columns of a task: values of the meshes of a method.
COLUMNS = {
    "remesh": {f"loss > {LOSS:.0%}": _share_above("lost", LOSS),
               f"vanished > {LOSS:.0%}": _share_above("vanished", LOSS),
               f"invented > {INVENTED:.0%}": _share_above("invented", INVENTED)},
    "simplify": {"over the bound %": _share_above("distance", 1),
                 "median % of the bound": _median_percentage("distance", "%.0f"),
                 "median % of the model's triangles": lambda made: _median(
                     [100 * row["triangles"] / row["model_triangles"] for row in made], "%.1f")},
    "combine": {f"wrong volume > {LOSS:.0%}": _share_above("wrong", LOSS),
                "median % of wrong volume": _median_percentage("wrong", "%.3f"),
                f"volumes differ > {LOSS:.0%}": lambda made: rate(
                    sum(error > LOSS for error in volume_errors(made)), len(volume_errors(made)))},
    "fracture": {f"wrong volume > {LOSS:.0%}": _share_above("wrong", LOSS),
                 "median % of wrong volume": _median_percentage("wrong", "%.3f"),
                 f"volumes differ > {LOSS:.0%}": _share_above("volume_error", LOSS),
                 "median files": lambda made: _median([row["pieces"] for row in made], "%.0f")}}


def table(rows, methods, task="remesh"):
    """Returns the success rates as a table in Markdown. Claims and losses are those of the meshes."""
    head = ["method", "class", "models", "done %", "valid %", NEAR[task], "failed claims %", *COLUMNS[task],
            "median CPU s", "of the first method's", "median MiB", "median triangles"]
    lines = ["| " + " | ".join(head) + " |", "| --- | --- |" + " --: |" * (len(head) - 2)]
    rows = counted(rows)
    first = {row["sha256"]: row["cpu_seconds"] for row in rows if row["method"] == methods[0] and row["done"]}
    for method in methods:
        for name, own in _groups([row for row in rows if row["method"] == method]):
            made = [row for row in own if row["done"]]
            claiming = [row for row in made if row["claims something"]]
            paired = [row for row in made if first.get(row["sha256"])]
            lines.append("| " + " | ".join([
                method, name, str(len(own)),
                *(rate(sum(row[key] for row in own), len(own)) for key in ("done", "valid", "near")),
                rate(sum(row["fails a claim"] for row in claiming), len(claiming)),
                *(column(made) for column in COLUMNS[task].values()),
                _median([row["cpu_seconds"] for row in made], "%.2f"),
                _median([row["cpu_seconds"] / first[row["sha256"]] for row in paired], "%.2f"),
                _median([row["peak_mib"] for row in made], "%.0f"),
                _median([row["triangles"] for row in made], "%.0f")]) + " |")
    return "\n".join(lines)


def profile(rows, column):
    """Returns the performance profile (Dolan and Moré, 2002) of each method: {method: (ratios, shares)}.

    The share at a ratio t is that of the models which the method solves (valid and near) with at most t times
    the least value of all methods that solve it. Models that no method solves count in the denominator.
    """
    models = {row["sha256"] for row in rows if row["class"] != "no mesh"}
    least, solved = {}, collections.defaultdict(list)
    for row in counted(rows):
        solved[row["method"]] += [row] if row["near"] and row["sha256"] in models else []
        if row["near"]:
            least[row["sha256"]] = min(row[column], least.get(row["sha256"], math.inf))
    return {method: (numpy.sort([row[column] / (least[row["sha256"]] or 1) for row in own]),
                     numpy.arange(1, len(own) + 1) / len(models)) for method, own in solved.items()}


def draw_profiles(rows, methods, file):
    """Writes the profiles of CPU time and of triangles as SVG."""
    with plots.style():
        figure = plots.figure(25, 9)
        for axes, (column, title) in zip(figure.subplots(1, 2, sharey=True), (
                ("cpu_seconds", "CPU time"), ("triangles", "triangles"))):
            found = profile(rows, column)
            largest = 1.1 * max([2.0, *(ratios[-1] for ratios, _ in found.values() if len(ratios))])
            for number, method in enumerate(m for m in methods if m in found):
                ratios, shares = found[method]
                x, y = [1, *ratios, largest], [0, *shares, max(shares, default=0)]
                axes.step(x, y, where="post", label=method, linestyle=("-", "--", ":")[number // 10 % 3])
            axes.set_xscale("log", base=2, subs=[])
            axes.set(xlim=(1, largest), ylim=(0, 1), xlabel=f"{title}, ratio to the least of all methods")
            axes.xaxis.set_major_formatter("{x:g}")
        figure.axes[0].set_ylabel("share of models, valid and near")
        figure.axes[1].legend(loc="upper left", bbox_to_anchor=(1, 1))
        figure.savefig(file, format="svg", metadata={"Date": None, "Creator": None})


# ---- Worst cases


def trouble(row):
    """Returns how bad a row is and why, None if the output is valid and near and all claims hold."""
    if row["status"] != "done":
        return 2.0, row["status"] + (f": {row['message']}" if row.get("message") else "")
    reasons, share = [], max(row.get("lost", 0), row.get("invented", 0))
    if row.get("failed_claims"):
        reasons.append((1.5, "failed claims: " + ", ".join(row["failed_claims"])))
    if not row["watertight"]:
        defects = ", ".join(f"{count} {name.replace('_', ' ')}" for name, count in row["defects"].items())
        reasons.append((1.2, f"not valid: {defects}"))
    if row.get("wrong", 0) > LOSS:
        reasons.append((row["wrong"], f"{row['wrong']:.1%} of the volume wrong"))
    if row.get("volume_error", 0) > LOSS:
        reasons.append((row["volume_error"], f"the volumes differ by {row['volume_error']:.1%}"))
    if row.get("distance", 0) > 1:
        reasons.append((1.1, f"{row['distance']:.2f} times the bound"))
    reasons += [(share, f"{row[key]:.1%} {text}") for key, text in (
        ("vanished", "of the visible surface vanished"), ("filled", "of the visible surface filled"),
        ("invented", "of the output invented")) if row.get(key, 0) > LOSS]
    if share > LOSS and not any(row[key] > LOSS for key in ("vanished", "filled", "invented")):
        reasons.append((share, f"{row['lost']:.1%} of the visible surface lost"))
    return (max(reasons)[0], "; ".join(text for _, text in reasons)) if reasons else None


def picture_name(sha256, method=""):
    return f"{sha256[:16]}{'-' + hashlib.sha256(method.encode()).hexdigest()[:8] if method else ''}.png"


def gallery(rows, ours, question, pictures):
    """Returns a page with the worst cases: failures of our own methods first, then by badness."""
    bad = [(row["method"] not in ours, -found[0], row["name"], found[1], row) for row in rows
           if row["class"] != "no mesh" and (found := trouble(row))]
    bad.sort(key=lambda case: case[:3])

    def image(*name):
        file = pictures / picture_name(*name)
        return base64.b64encode(file.read_bytes()).decode() if file.exists() else ""

    cases = [{**row, "why": why, "badness": -badness, "model": image(row["sha256"]),
              "picture": image(row["sha256"], row["method"])} for _, badness, _, why, row in bad[:WORST]]
    import jinja2  # the other commands do not need it
    template = (pathlib.Path(__file__).parent / "page/gallery.html").read_text()
    return jinja2.Environment(autoescape=True).from_string(template).render(
        question=question, cases=cases, total=len(bad), classes=sorted({case["class"] for case in cases}),
        methods=sorted({case["method"] for case in cases}))


def write_report(rows, methods, ours, question, out, task="remesh", provenance=""):
    """Writes table.md, profiles.svg and gallery.html."""
    if not rows:
        raise LabError(f"{out}: no method has a row; none of the programs is installed")
    out = pathlib.Path(out)
    text = [question, "", table(rows, methods, task)]
    if provenance:
        text += ["", f"Report of {provenance}."]
    if missing := [name for name in methods if not any(row["method"] == name for row in rows)]:
        text += ["", f"Not installed, and left out: {'; '.join(missing)}."]
    (out / "table.md").write_text("\n".join(text) + "\n")
    draw_profiles(rows, methods, out / "profiles.svg")
    (out / "gallery.html").write_text(gallery(rows, ours, question, out / "pictures"))


# ---- Differences


def _cells(directory):
    rows = read(directory, "rows")
    if not rows:
        raise LabError(f"{directory}: no rows of a benchmark were found (rows*.ndjson)")
    for row in rows:
        row["failed_claims"] = [name for name in row.get("failed_claims", []) if name not in VARYING]
    return {(row["sha256"], row["method"]): {key: value for key, value in row.items() if key not in VARYING}
            for row in rows}


def differences(first, second):
    """Returns lines about the cells in which two directories of rows differ, except for times and memory."""
    a, b = _cells(first), _cells(second)
    lines = []
    for cell in sorted(a.keys() | b.keys()):
        name = f"{cell[0][:16]}, {cell[1]}"
        if cell not in a or cell not in b:
            lines.append(f"{name}: only in {first if cell in a else second}")
        else:
            for key in sorted(a[cell].keys() | b[cell].keys()):
                if (one := a[cell].get(key)) != (other := b[cell].get(key)):
                    lines.append(f"{name}: {key}: {one} and {other}")
    return lines
