"""A benchmark of remeshing programs on a corpus of models: success rates by class, with confidence intervals.

An experiment file (TOML) has these keys:

question    one sentence
corpus      table of files in experiments/data
models      number of files in the random sample, or "all"
seed        of the sample
resolution  voxels along the longest side of a model: the scale at which losses are measured
seconds     limit of wall time per run
memory_mib  limit of address space per run
[[method]]  name, and request: the program and its arguments. {hermesh}, {input}, {output}, {resolution} and {voxel} (the
            voxel size in the units of the file) are replaced

Each run is a process of its own. Its row is on disk when it ends, and the same command continues after an
interruption. Meshes are validated with `hermesh validate`, which shares no code with the methods.
"""

import collections
import functools
import json
import pathlib
import statistics
import sys
import tempfile
import tomllib

from scipy.stats import binomtest

from . import child, corpus
from .rows import ROOT, LabError

CLASSES = ["clean solid", "closed, self-intersecting", "closed, non-manifold or doubled", "few holes", "open sheets",
           "flat", "no mesh"]
FEW_HOLES = 0.02  # share of boundary edges among all edges
FLAT = 1e-6  # thickness over length
LOSS = INVENTED = 0.01  # shares of the visible surface, and of the output, above which they count
VALIDATION = child.Limits(seconds=600, memory_mib=16_384)


def read_experiment(path):
    with open(path, "rb") as file:
        experiment = tomllib.load(file)
    required = {"question", "corpus", "models", "seed", "resolution", "seconds", "memory_mib", "method"}
    if difference := required ^ experiment.keys():
        raise LabError(f"{path}: unknown or missing keys: {', '.join(sorted(difference))}")
    for method in experiment["method"]:
        if method.keys() != {"name", "request"}:
            raise LabError(f"{path}: each [[method]] has a name and a request")
    return experiment


def classify(report, info):
    """Returns the class of a model from its validation report and its bounds."""
    if report is None or not report["triangles"] + report["quads"]:
        return "no mesh"
    extent = [high - low for low, high in zip(info["lower"], info["upper"])]
    if min(extent) <= FLAT * max(extent):
        return "flat"
    if report["boundary_edges"]:
        edges = (3 * report["triangles"] + 4 * report["quads"] + report["boundary_edges"]) / 2
        return "few holes" if report["boundary_edges"] < FEW_HOLES * edges else "open sheets"
    if report["non_manifold_edges"] or report["duplicate_polygons"] or report["inconsistent_edges"]:
        return "closed, non-manifold or doubled"
    return "closed, self-intersecting" if report["self_intersecting_pairs"] else "clean solid"


class Benchmark:
    def __init__(self, experiment, hermesh, out, say):
        self.experiment, self.hermesh, self.out, self.say = experiment, hermesh, pathlib.Path(out), say
        self.out.mkdir(parents=True, exist_ok=True)
        self.limits = child.Limits(experiment["seconds"], experiment["memory_mib"])

    def run(self, entries, cache):
        """Runs all methods on all models that have no row yet, and returns the rows."""
        models = {row["sha256"]: row for row in self._rows("models")}
        done = {(row["sha256"], row["method"]) for row in self._rows("rows")}
        for number, entry in enumerate(entries, 1):
            path = corpus.location(entry, cache)
            todo = [m for m in self.experiment["method"] if (entry.sha256, m["name"]) not in done]
            if entry.sha256 not in models:
                models[entry.sha256] = self._append("models", self._facts(entry, path))
            for method in todo:
                row = self._append("rows", self._run_method(entry, models[entry.sha256], path, method))
                self.say(f"{number} of {len(entries)}: {entry.name}, {method['name']}: {row['status']}")
        chosen = {entry.sha256 for entry in entries}
        rows = [row for row in self._rows("rows") if row["sha256"] in chosen]
        return [{**row, "class": models[row["sha256"]]["class"]} for row in rows]

    def _rows(self, name):
        file = self.out / f"{name}.jsonl"
        if not file.exists():
            return []
        # The last line is incomplete if the run was interrupted while it was written.
        return [json.loads(line) for line in file.read_text().splitlines(keepends=True) if line.endswith("\n")]

    def _append(self, name, row):
        file = self.out / f"{name}.jsonl"
        if file.exists() and not (old := file.read_bytes()).endswith(b"\n"):
            file.write_bytes(old[:old.rfind(b"\n") + 1])
        with open(file, "a") as out:
            out.write(json.dumps(row) + "\n")
        return row

    def _ask(self, *arguments):
        """Returns the JSON document of a hermesh command; None if it failed."""
        ended = child.run([self.hermesh, *arguments, "--json"], VALIDATION)
        try:
            return json.loads(ended.output)
        except ValueError:
            return None

    def _facts(self, entry, path):
        info, report = self._ask("info", str(path)), self._ask("validate", str(path))
        info = info["result"] if info and "lower" in info["result"] else None
        report = report if info and report and "boundary_edges" in report else None
        size = max(h - l for l, h in zip(info["lower"], info["upper"])) if info else 0.0
        return {"sha256": entry.sha256, "package": entry.package, "path": entry.path, "class": classify(report, info),
                "size": size, "triangles": report["triangles"] + 2 * report["quads"] if report else 0,
                "components": report["components"] if report else 0}

    def _run_method(self, entry, model, path, method):
        voxel = model["size"] / self.experiment["resolution"]
        with tempfile.TemporaryDirectory() as work:
            output = pathlib.Path(work) / "out.ply"
            words = {"hermesh": self.hermesh, "input": str(path), "output": str(output),
                     "resolution": self.experiment["resolution"], "voxel": voxel}
            ended = child.run([word.format(**words) for word in method["request"]], self.limits, work)
            row = {"sha256": entry.sha256, "method": method["name"], "status": ended.status,
                   "exit_code": ended.exit_code, "cpu_seconds": ended.cpu_seconds, "peak_mib": ended.peak_mib}
            if ended.status != "done":
                row["message"] = (ended.errors.strip().splitlines() or [""])[-1][:500]
                return row
            report = self._ask("validate", str(output), "--reference", str(path), "--voxel-size", repr(voxel),
                               "--samples", "20000", "--solid-samples", "0")
            if not report or not report.get("visible_loss"):
                return {**row, "status": "wrong output", "message": "the output is missing or not a mesh"}
            visible = report["visible_loss"]
            row.update(
                triangles=report["triangles"] + 2 * report["quads"], components=report["components"],
                watertight=not any(report[key] for key in (
                    "boundary_edges", "non_manifold_edges", "non_manifold_vertices", "inconsistent_edges",
                    "inside_out_components", "self_intersecting_pairs")),
                **{share: visible[f"{share}_share"]["value"] for share in ("lost", "vanished", "filled", "invented")})
            return row


def rate(count, of):
    """Returns a percentage with its Wilson interval at 95 % as text."""
    if not of:
        return "–"
    interval = binomtest(count, of).proportion_ci(method="wilson")
    return f"{100 * count / of:.1f} [{100 * interval.low:.1f}, {100 * interval.high:.1f}]"


def table(rows, methods):
    """Returns the success rates as a table in Markdown."""
    head = ["method", "class", "models", "remeshed %", "watertight %", f"loss > {LOSS:.0%}", f"vanished > {LOSS:.0%}",
            f"invented > {INVENTED:.0%}", "median CPU s", "of the first method's", "median MiB"]
    lines = ["| " + " | ".join(head) + " |", "| --- | --- |" + " --: |" * (len(head) - 2)]
    seconds = {(r["sha256"], r["method"]): r["cpu_seconds"] for r in rows if r["status"] == "done"}
    for method in methods:
        own = [r for r in rows if r["method"] == method]
        groups = collections.defaultdict(list)
        for row in own:
            groups[row["class"]].append(row)
        groups["all meshes"] = [r for r in own if r["class"] != "no mesh"]
        for name in [*CLASSES, "all meshes"]:
            if not groups[name]:
                continue
            made = [r for r in groups[name] if r["status"] == "done"]
            ratios = [r["cpu_seconds"] / seconds[r["sha256"], methods[0]] for r in made
                      if seconds.get((r["sha256"], methods[0]))]
            share = [rate(sum(r[key] > limit for r in made), len(made))
                     for key, limit in (("lost", LOSS), ("vanished", LOSS), ("invented", INVENTED))]
            lines.append("| " + " | ".join([
                method, name, str(len(groups[name])), rate(len(made), len(groups[name])),
                rate(sum(r["watertight"] for r in made), len(made)), *share,
                f"{statistics.median(r['cpu_seconds'] for r in made):.2f}" if made else "–",
                f"{statistics.median(ratios):.2f}" if ratios else "–",
                f"{statistics.median(r['peak_mib'] for r in made):.0f}" if made else "–"]) + " |")
    return "\n".join(lines)


def add_command(subparsers):
    parser = subparsers.add_parser("benchmark", help="run programs on a corpus of models and print their success rates")
    parser.add_argument("experiment", help="name in experiments/lab/questions, or a TOML file")
    parser.add_argument("--out", type=pathlib.Path, help="directory of the rows (default: results/local/EXPERIMENT)")
    parser.add_argument("--hermesh", default=str(ROOT / "build/release/hermesh"), help="the program that validates")
    parser.add_argument("--program", action="append", default=[], metavar="NAME=FILE",
                        help="also run this program with the first method's arguments, e.g. another version of it")
    parser.add_argument("--models", type=int, help="size of the sample instead of the experiment's")
    parser.set_defaults(function=run)


def run(arguments):
    file = pathlib.Path(arguments.experiment)
    if not file.suffix:
        file = ROOT / "experiments/lab/questions" / f"{arguments.experiment}.toml"
    experiment = read_experiment(file)
    for program in arguments.program:
        name, _, path = program.partition("=")
        request = [path if word == "{hermesh}" else word for word in experiment["method"][0]["request"]]
        experiment["method"].append({"name": name, "request": request})
    entries = corpus.read_corpus(ROOT / "experiments/data" / experiment["corpus"])
    entries = corpus.sample(entries, arguments.models or experiment["models"], experiment["seed"])
    cache = corpus.cache_directory()
    say = functools.partial(print, file=sys.stderr, flush=True)
    corpus.fetch(entries, cache, say)
    rows = Benchmark(experiment, arguments.hermesh, arguments.out or ROOT / "results/local" / file.stem, say).run(entries, cache)
    print(table(rows, [method["name"] for method in experiment["method"]]))
    return 0
