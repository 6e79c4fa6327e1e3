"""A benchmark of programs on a corpus of models: one row per model and program.

An experiment file (TOML) has these keys:

base        another file with some of these keys, which this one replaces; its methods follow (optional)
without     names of methods of the base that are left out (optional)
question    one sentence
task        "remesh" (default), "simplify", which requires an error, "combine", or "fracture"
corpus      table of files in experiments/data
classes     classes of models to take; all if absent
models      number of files, "all", or numbers by tier: {quick = 60, full = 500}; for "combine", of random
            pairs, each with three operations
sample      "random" with the seed (default), or "listed": the first of the column `order` of the corpus
seed        of the sample, and of the programs
resolution  voxels along the longest side of a model: the scale at which losses are measured
error       share of the bounding box's diagonal; if given, programs get this bound instead of a voxel size
threads     that a program may use (default: 1)
seconds     limit of wall time per run
memory_mib  limit of address space per run
[[method]]  name, and one of:
            adapter  a program that follows the protocol (PROTOCOL.md) and its first arguments; words with a
                     slash are paths in the checkout
            request  a program without an adapter and its arguments, in which {hermesh}, {input}, {output},
                     {second} and {operation} (of "combine"), {planes} (of "fracture"),
                     {resolution}, {voxel} (or {error}, in the units of the file), {seed} and {threads} are
                     replaced; `claims` has what it claims of each mesh, e.g.
                     {watertight = true, distance_to_input = "{error}"}
            `tier = "full"` leaves the method out of the tier quick, unless --method names it

Each run is a process of its own. Its row is on disk when it ends, and the same command continues after an
interruption. Meshes are validated with `hermesh validate`, which shares no code with the methods.
"""

import contextlib
import datetime
import functools
import json
import math
import multiprocessing
import os
import pathlib
import signal
import sys
import tempfile

import numpy

from . import child, corpus, polygons, protocol, rates
from .experiment import choice, flag, list_of, number, parse, read_table, text
from .rows import ROOT, LabError, append_rows, drop_torn_row, shown

FEW_HOLES = 0.02  # share of boundary edges among all edges
FLAT = 1e-6  # thickness over length
THIN = 0.02  # share of the area that is thinner than a voxel
THIN_RESOLUTION = 100
VALIDATION = child.Limits(seconds=600, memory_mib=16_384)
PLANES = 3  # that cut a solid to fracture
DEFECTS = ("boundary_edges", "non_manifold_edges", "non_manifold_vertices", "inconsistent_edges",
           "inside_out_components", "self_intersecting_pairs")
PLACEHOLDERS = ("hermesh input output second operation planes resolution voxel voxel_size error seed threads "
                "version task result seconds memory_mib").split()  # in the words of a method


def _words(value, where):
    """Checks the words of a command, in which names in braces are replaced."""
    words = list_of(text)(value, where)
    for word in words:
        try:
            word.format(**dict.fromkeys(PLACEHOLDERS, 1.0))
        except (LookupError, ValueError, AttributeError, TypeError):
            raise LabError(f"{where}: '{shown(word)}' has unknown words in braces; expected {{hermesh}}, "
                           "{input}, {output}, {second}, {operation}, {planes}, {resolution}, {voxel}, "
                           "{error}, {seed} or {threads}") from None
    return words


def _claims(value, where):
    checks = dict.fromkeys(protocol.CLAIMS, flag) | dict.fromkeys(protocol.DISTANCES, _distance)
    return read_table(value, where, {}, checks)


def _distance(value, where):
    return _words([value], where)[0] if isinstance(value, str) else number(0, 1e300)(value, where)


def _method(value, where):
    entry = read_table(value, where, {"name": text}, {"adapter": _words, "request": _words, "claims": _claims,
                                                      "tier": choice("tier", ["full"])})
    if ("adapter" in entry) == ("request" in entry) or ("claims" in entry and "adapter" in entry):
        raise LabError(f"{where}: a method has an adapter or a request with optional claims")
    return entry


def _models(value, where):
    if isinstance(value, dict):
        return read_table(value, where, dict.fromkeys(("quick", "full"), _models_of_tier))
    return _models_of_tier(value, where)


def _models_of_tier(value, where):
    return value if value == "all" else number(1, 1e9, int)(value, where)


REQUIRED = {"question": text, "corpus": text, "models": _models, "seed": number(0, 4294967295, int),
            "resolution": number(1, 100_000, int), "seconds": number(0.01, 1e7),
            "memory_mib": number(1, 1e9, int), "method": list_of(_method)}
OPTIONAL = {"sample": choice("sample", ["random", "listed"]), "error": number(1e-9, 1),
            "threads": number(1, 1024, int), "task": choice("task", protocol.TASKS), "classes": list_of(text),
            "base": text, "without": list_of(text)}


def _read_with_base(path, above=()):
    if path.resolve() in above:
        raise LabError(f"{path.name}: the file is a base of itself; change the key base")
    own = read_table(parse(path), path.name, {}, REQUIRED | OPTIONAL)
    if "base" not in own:
        return own
    base = _read_with_base(path.parent / own.pop("base"), (*above, path.resolve()))
    methods = own.get("method", [])
    without = {method["name"] for method in methods} | set(own.pop("without", []))
    methods = methods + [method for method in base.get("method", []) if method["name"] not in without]
    return {**base, **own, "method": methods}


def read_experiment(path):
    """Returns the keys of an experiment file and of its bases. Raises LabError that names file and key."""
    path = pathlib.Path(path)
    experiment = _read_with_base(path)
    if missing := REQUIRED.keys() - experiment.keys():
        raise LabError(f"{path}: missing keys: {', '.join(sorted(missing))}")
    if not experiment["method"]:
        raise LabError(f"{path}: it needs a [[method]]")
    if experiment.get("task") == "simplify" and "error" not in experiment:
        raise LabError(f"{path}: the task simplify requires an error")
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


def facts(ask, path):
    """Returns what is computed of a model; ask(*arguments) returns the JSON document of a command."""
    info, report = ask("info", str(path)), ask("validate", str(path))
    info = info["result"] if info and "lower" in info["result"] else None
    report = report if info and report and "boundary_edges" in report else None
    lower, upper = (info["lower"], info["upper"]) if info else ([0.0] * 3, [0.0] * 3)
    size, kind, tags = max(h - l for l, h in zip(lower, upper)), classify(report, info), []
    if report and report["components"] > 1:
        tags.append("several bodies")
    if kind not in ("no mesh", "flat"):
        try:
            if polygons.thin_share(polygons.read(path)[0], size / THIN_RESOLUTION) > THIN:
                tags.append("thinner than a voxel")
        except ValueError:
            tags.append("thickness unknown")
    return {"class": kind, "tags": ", ".join(tags), "size": size, "diagonal": math.dist(lower, upper),
            "largest_coordinate": max(map(abs, lower + upper)), "box": [lower, upper],
            "triangles": report["triangles"] + 2 * report["quads"] if report else 0}


def write_pair(pair, cache, files):
    """Writes the two solids of a pair as OBJ files."""
    solids = polygons.place(*(polygons.read(corpus.location(e, cache))[0] for e in (pair.first, pair.second)),
                            int(pair.key[:8], 16))
    for file, solid in zip(files, solids):
        polygons.write_obj(file, solid)


def pair_facts(ask, pair, files):
    """Returns what is computed of the solids of a pair."""
    found = [facts(ask, file) for file in files]
    lower, upper = (side([f["box"][i] for f in found], axis=0).tolist()
                    for i, side in enumerate((numpy.min, numpy.max)))
    tags = {tag for f in found for tag in f["tags"].split(", ") if tag}
    tags |= {"input not clean"} if any(f["class"] != "clean solid" for f in found) else set()
    return {"class": pair.operation, "tags": ", ".join(sorted(tags)), "box": [lower, upper],
            "diagonal": math.dist(lower, upper), "triangles": sum(f["triangles"] for f in found),
            **{key: max(f[key] for f in found) for key in ("size", "largest_coordinate")},
            "pair": pair.key, "volumes": [polygons.volume(polygons.read(file)[0]) for file in files]}


def solid_facts(ask, key, file):
    """Returns what is computed of a solid to fracture, with the planes that cut it."""
    solid = polygons.read(file)[0]
    planes = polygons.random_planes(solid, PLANES, int(key[:8], 16))
    return {**facts(ask, file), "volumes": [polygons.volume(solid)],
            "planes": ";".join(",".join(map(repr, plane)) for plane in planes.tolist())}


def _pool(jobs):
    """Returns worker processes with separate cores, since a program may use the first of those allowed."""
    cores, shares = sorted(os.sched_getaffinity(0)), multiprocessing.SimpleQueue()
    for number in range(jobs):
        shares.put(cores[number::jobs] or cores)
    return multiprocessing.Pool(jobs, _take_cores, (shares,))


def _take_cores(shares):
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent ends the workers
    os.sched_setaffinity(0, shares.get())


class Benchmark:
    def __init__(self, experiment, hermesh, out, say, shard=""):
        self.experiment, self.hermesh, self.out = experiment, hermesh, pathlib.Path(out)
        self.shard, self._say = shard, say
        self.task, self.build = experiment.get("task", "remesh"), build_of(hermesh)
        self.out.mkdir(parents=True, exist_ok=True)
        self.limits = child.Limits(experiment["seconds"], experiment["memory_mib"])

    def __getstate__(self):
        return {**self.__dict__, "_say": None}  # worker processes print nothing

    def run(self, entries, cache, jobs=1):
        """Runs all methods on all models that have no row yet, and returns the rows.

        Programs that are not installed are found with the first model and left out.
        """
        for name in ("models", "rows"):
            if self._file(name).exists():
                drop_torn_row(self._file(name))
        done = {(row["sha256"], row["method"]) for row in rates.read(self.out, "rows")}
        numbers = {entry.sha256: number for number, entry in enumerate(entries, 1)}
        methods = self.experiment["method"]
        work = functools.partial(self._run_model, cache=cache)

        def tasks(methods):
            for entry in entries:
                if todo := [m for m in methods if (entry.sha256, m["name"]) not in done]:
                    yield entry, todo

        first = next(tasks(methods), None)
        if first:
            rows = work(first, is_first=True)
            self._report(first[0], rows, numbers, len(entries))
            missing = {row["method"] for row in rows if row["status"] == "not installed"}
            found = [m for m in methods if m["name"] not in missing]
            rest = [task for task in tasks(found) if task[0] is not first[0]]
            with _pool(jobs) if jobs > 1 else contextlib.nullcontext() as pool:
                for (entry, _), rows in zip(rest, pool.imap(work, rest) if pool else map(work, rest)):
                    self._report(entry, rows, numbers, len(entries))
        return [row for row in rates.read_with_models(self.out) if row["sha256"] in numbers]

    def _report(self, entry, rows, numbers, total):
        for row in rows:
            text = f" ({row['message']}); it is left out" if row["status"] == "not installed" else ""
            where = f"{numbers[entry.sha256]} of {total}: {entry.name}"
            self._say(f"{where}, {row['method']}: {row['status']}{text}")

    def _file(self, name):
        return self.out / f"{name}{self.shard}.ndjson"

    def _ask(self, *arguments, reason=None):
        """Returns the JSON document of a command. If it failed, returns None and appends to `reason`."""
        ended = child.run([self.hermesh, *arguments, "--json"], VALIDATION)
        try:
            return json.loads(ended.output)
        except ValueError:
            if reason is not None:
                reason.append(ended.status)
            return None

    def _run_model(self, task, cache, is_first=False):
        """Runs methods on a model or a pair, and appends their rows."""
        entry, methods = task
        path = corpus.location(entry, cache)
        if self.task not in ("combine", "fracture"):
            return self._run_methods(entry, methods, is_first, path, lambda: facts(self._ask, path))
        with tempfile.TemporaryDirectory() as folder:
            files = [pathlib.Path(folder) / "first.obj", pathlib.Path(folder) / "second.obj"]
            if self.task == "fracture":
                polygons.write_obj(files[0], polygons.solid(polygons.read(path)[0]))
                return self._run_methods(entry, methods, is_first, files[0],
                                         lambda: solid_facts(self._ask, entry.sha256, files[0]))
            write_pair(entry, cache, files)
            return self._run_methods(entry, methods, is_first, files[0],
                                     lambda: pair_facts(self._ask, entry, files))

    def _run_methods(self, entry, methods, is_first, path, compute_facts):
        model = next((row for row in rates.read(self.out, "models") if row["sha256"] == entry.sha256), None)
        if model is None:
            model = {"sha256": entry.sha256, "package": entry.package, "path": entry.path, "name": entry.name,
                     **compute_facts()}
            append_rows(self._file("models"), [model])
        rows = []
        for method in methods:
            row = self._run_method(model, path, method)
            rows.append(row)
            if row["status"] == "not installed" and not is_first:  # it was with the first model
                row["status"] = "refused"
            if row["status"] != "not installed":
                append_rows(self._file("rows"), [row])
        return rows

    def _run_method(self, model, path, method):
        with tempfile.TemporaryDirectory() as work:
            row, outputs = self._measure(model, path, method, work)
            row = {"sha256": model["sha256"], "method": method["name"], "commit": self.build["commit"], **row}
            if "message" in row:  # must not depend on directories of this machine
                for folder in (work, path.parent, ROOT):
                    row["message"] = row["message"].replace(f"{folder}/", "")
                row["message"] = row["message"][:500]
            if row["status"] != "not installed" and rates.trouble(row):
                self._draw(model, path, row, outputs)
        return row

    def _measure(self, model, path, method, work):
        experiment = self.experiment
        voxel = (model["size"] or experiment["resolution"]) / experiment["resolution"]
        goal = {"voxel_size": voxel, "resolution": experiment["resolution"]}
        if "error" in experiment:
            goal = {"error": experiment["error"] * model["diagonal"], "resolution": None}
        if self.task == "combine":
            goal |= {"second": str(path.with_name("second.obj")), "operation": model["class"]}
        elif self.task == "fracture":
            goal |= {"planes": model["planes"]}
        file, request, environment = protocol.write_request(
            work, task=self.task, input=str(path), **goal, seed=experiment["seed"],
            threads=experiment.get("threads", 1), seconds=experiment["seconds"],
            memory_mib=experiment["memory_mib"])
        words = {"hermesh": self.hermesh, "voxel": voxel, **request, "resolution": experiment["resolution"]}
        command = [word.format(**words) for word in method.get("request") or method["adapter"]]
        if "adapter" in method:
            environment["HERMESH"] = self.hermesh
            command = [str(ROOT / word) if "/" in word else word for word in command] + [file]
            if absent := [word for word in command if "/" in word and not os.path.exists(word)]:
                return {"status": "not installed", "message": f"{absent[0]} does not exist"}, None
        if command[0] == "python3":
            command[0] = sys.executable
        try:
            ended = child.run(command, self.limits, work, environment if "adapter" in method else None)
        except OSError as error:
            return {"status": "not installed", "message": str(error)}, None
        row = {"status": ended.status, "exit_code": ended.exit_code, "cpu_seconds": ended.cpu_seconds,
               "wall_seconds": ended.wall_seconds, "peak_mib": ended.peak_mib}
        last_line = (ended.errors.strip().splitlines() or [""])[-1]
        if ended.status != "done":
            if ended.exit_code == protocol.NOT_INSTALLED and "adapter" in method:
                row["status"] = "not installed"
            return {**row, "message": last_line}, None
        claims, seconds = method.get("claims", {}), None
        if "adapter" in method:
            try:
                result = protocol.read_result(request["result"])
            except ValueError as error:
                return {**row, "status": "wrong output", "message": str(error)}, None
            if result["status"] == "refused":
                return {**row, "status": "refused", "message": str(result.get("message", ""))}, None
            claims, seconds = result["claims"], result.get("seconds")
        else:
            claims = {name: float(value.format(**words)) if isinstance(value, str) else value
                      for name, value in claims.items()}
        return self._validate(row, model, path, request, voxel, claims, seconds, ended)

    def _validate(self, row, model, path, request, voxel, claims, seconds, ended):
        output = request["output"]
        files = sorted(file for end in ("ply", "obj") for file in pathlib.Path(output).glob(f"*.{end}")) \
            if self.task == "fracture" else [output]
        reason = []
        reference = [] if self.task in ("combine", "fracture") else [
            "--reference", str(path), "--voxel-size", repr(voxel), "--samples", "20000",
            "--solid-samples", "0"]
        reports = [self._ask("validate", str(file), *reference, reason=reason) for file in files]
        if not reports or any(not r or not r.get("visible_loss" if reference else "area") for r in reports):
            what = f"the validation ended with: {reason[0]}" if reason and reason[0].endswith("limit") \
                else "the output is missing or not a mesh"
            return {**row, "status": "wrong output", "message": what}, None
        report = reports[0] if len(reports) == 1 else {
            key: sum(r[key] or 0 for r in reports) for key in (*DEFECTS, "triangles", "quads", "components")}

        def ask(reference, *options):
            found = self._ask("validate", output, "--reference", reference, "--samples", "20000",
                              "--solid-samples", "0", *options)
            if not found or "from_reference" not in found:
                raise LabError(f"the output cannot be validated with the reference {reference} {options}")
            return found

        defects = {key: report[key] for key in DEFECTS if report[key]}
        row.update(triangles=report["triangles"] + 2 * report["quads"], components=report["components"],
                   watertight=not defects, defects=defects, claims=claims, failed_claims=[])
        if self.task == "simplify":
            try:
                row["distance"] = protocol.share_of_error(report, request["error"],
                                                          model["largest_coordinate"], ask, path)
            except LabError as error:
                return {**row, "status": "wrong output", "message": str(error)}, None
        elif self.task in ("combine", "fracture"):
            try:
                made = [polygons.read(file)[0] for file in files]
            except ValueError as error:
                return {**row, "status": "wrong output", "message": str(error)}, None
            solid = polygons.read(path)[0]
            if self.task == "combine":
                second = polygons.read(request["second"])[0]
                row |= {"wrong": polygons.wrong_share(solid, second, *made, request["operation"]),
                        "volume": report["volume"]}
            else:
                planes = numpy.array([p.split(",") for p in request["planes"].split(";")], float)
                (whole,), total = model["volumes"], sum(map(polygons.volume, made))
                row |= {"pieces": len(made), "volume": total, "volume_error": abs(total - whole) / whole,
                        "wrong": polygons.misplaced_share(solid, made, planes)}
        else:  # without visible surface, the shares are undefined and nothing is lost
            row |= {share: report["visible_loss"][f"{share}_share"]["value"] or 0.0
                    for share in ("lost", "vanished", "filled", "invented")}
        if seconds is not None:
            row["seconds"] = seconds
        mib = sum(map(os.path.getsize, [path, *files])) / child.MIB
        try:
            row["failed_claims"] = protocol.failed_claims(
                claims, seconds, ended, mib, report, model["largest_coordinate"], ask, path, output)
        except LabError as error:
            row["message"] = f"claims are not checked: {error}"
        return row, files

    def _draw(self, model, path, row, outputs):
        """Writes pictures of a model and of an output for the gallery, unless they cannot be read."""
        folder = self.out / "pictures"
        folder.mkdir(exist_ok=True)
        for sources, name in (([path], rates.picture_name(row["sha256"])),
                              (outputs, rates.picture_name(row["sha256"], row["method"]))):
            if sources and not (folder / name).exists():
                with contextlib.suppress(ValueError):
                    corners = numpy.concatenate([polygons.read(source)[0] for source in sources])
                    (folder / name).write_bytes(polygons.picture(corners, model["box"]))


def classify_corpus(path, hermesh, cache, seed, say):
    """Adds the columns class, tags, triangles and order to a corpus. Existing classes are preserved."""
    entries = corpus.read_corpus(path)
    corpus.fetch([e for e in entries if not e.kind], cache, say)

    def ask(*arguments):
        ended = child.run([hermesh, *arguments, "--json"], child.Limits(60, VALIDATION.memory_mib))
        if ended.status == "time limit":
            say(f"{arguments[1]}: hermesh {arguments[0]} took more than 60 s")
        try:
            return json.loads(ended.output)
        except ValueError:
            return None

    for number, entry in enumerate(entries, 1):
        if not entry.kind:
            found = facts(ask, corpus.location(entry, cache))
            entry.kind, entry.tags, entry.triangles = found["class"], found["tags"], found["triangles"]
            corpus.write_corpus(path, entries)
            say(f"{number} of {len(entries)}: {entry.name}: {entry.kind}; {entry.tags}; {entry.triangles}")
    corpus.set_order(entries, seed)
    corpus.write_corpus(path, entries)


def add_command(subparsers):
    parser = subparsers.add_parser("benchmark",
                                   help="run programs on a corpus of models and print their success rates")
    parser.add_argument("experiment", nargs="?", help="name in experiments/lab/questions, or a TOML file")
    parser.add_argument("--out", type=pathlib.Path,
                        help="directory of the rows (default: results/local/EXPERIMENT)")
    parser.add_argument("--hermesh", default=str(ROOT / "build/release/hermesh"),
                        help="the program that validates")
    parser.add_argument("--program", action="append", default=[], metavar="NAME=FILE",
                        help="also run this program with the first method's arguments, e.g. another version")
    parser.add_argument("--method", action="append", help="run only this method; may be repeated")
    parser.add_argument("--tier", choices=["quick", "full"], default="quick",
                        help="models and methods that the experiment has for this tier (default: quick)")
    parser.add_argument("--models", type=int, help="number of models instead of the experiment's")
    parser.add_argument("--sample", choices=["random", "listed"],
                        help="kind of sample instead of the experiment's")
    parser.add_argument("--shard", metavar="I/N",
                        help="run only every N-th model, from the I-th; rows go to files of their own")
    parser.add_argument("--jobs", type=int, default=min(2, os.cpu_count() or 1),
                        help="models at a time (default: 2, on one core 1)")
    parser.add_argument("--compare", nargs=2, type=pathlib.Path, metavar=("A", "B"),
                        help="compare two directories of rows except for times and memory; "
                        "exit with 3 if they differ")
    parser.add_argument("--classify", type=pathlib.Path, metavar="CORPUS",
                        help="compute the columns class, tags, triangles and order of a corpus")
    parser.set_defaults(function=run)


def build_of(hermesh):
    """Returns the version and the commit of a program, which it prints on two lines."""
    version, commit, *_ = child.run([hermesh, "--version"], VALIDATION).output.splitlines() + ["", ""]
    return {"version": version, "commit": commit.removeprefix("commit ")}


def _provenance(build):
    """Returns the date, the build of the program that validates, and the processor, as text."""
    with open("/proc/cpuinfo") as file:
        names = [line.partition(":")[2].strip() for line in file if line.startswith("model name")]
    return ", ".join([f"{datetime.date.today()}", build["version"], f"commit {build['commit']}", *names[:1],
                      f"{len(names)} cores"])


def _parse_shard(text):
    try:
        number, count = map(int, text.split("/"))
    except ValueError:
        number = count = 0
    if not 1 <= number <= count:
        raise LabError(f"--shard {text}: expected I/N with I from 1 to N, e.g. 3/10")
    return number, count


def select_methods(methods, tier, names=None):
    """Returns the methods with these names or, without names, those of a tier."""
    if unknown := set(names or []) - {method["name"] for method in methods}:
        raise LabError(f"unknown method {', '.join(sorted(unknown))}; expected "
                       f"{', '.join(method['name'] for method in methods)}")
    return [m for m in methods if (m["name"] in names if names else tier in ("full", m.get("tier", "quick")))]


def run(arguments):
    say, cache = functools.partial(print, file=sys.stderr, flush=True), corpus.cache_directory()
    if arguments.compare:
        differences = rates.differences(*arguments.compare)
        print("\n".join(differences) or "The rows are equal except for times and memory.")
        return 3 if differences else 0
    if arguments.classify:
        classify_corpus(arguments.classify, arguments.hermesh, cache, 1, say)
        return 0
    if not arguments.experiment:
        raise LabError("benchmark: name an experiment, or pass --compare or --classify")
    file = pathlib.Path(arguments.experiment)
    if not file.suffix:
        file = ROOT / "experiments/lab/questions" / f"{arguments.experiment}.toml"
    experiment = read_experiment(file)
    for program in arguments.program:
        name, _, path = program.partition("=")
        first = experiment["method"][0]
        if "request" not in first:
            raise LabError(f"--program needs the arguments of {first['name']}, which has an adapter; state a "
                           "method with a request first")
        request = [path if word == "{hermesh}" else word for word in first["request"]]
        experiment["method"].append({**first, "name": name, "request": request})
    experiment["method"] = select_methods(experiment["method"], arguments.tier, arguments.method)
    models = experiment["models"]
    models = arguments.models or (models[arguments.tier] if isinstance(models, dict) else models)
    classes = experiment.get("classes", rates.CLASSES)
    entries = [e for e in corpus.read_corpus(ROOT / "experiments/data" / experiment["corpus"])
               if not e.kind or e.kind in classes]
    if experiment.get("task") == "fracture":
        entries = corpus.single_meshes(entries)
    kind = arguments.sample or experiment.get("sample")
    choose = corpus.pairs if experiment.get("task") == "combine" else \
        corpus.listed if kind == "listed" else corpus.sample
    entries, shard = choose(entries, models, experiment["seed"]), ""
    if arguments.shard:
        number, count = _parse_shard(arguments.shard)
        entries, shard = entries[number - 1::count], f"-{number}-of-{count}"
    pairs = [e for e in entries if isinstance(e, corpus.Pair)]
    corpus.fetch([e for p in pairs for e in (p.first, p.second)] if pairs else entries, cache, say)
    out = arguments.out or ROOT / "results/local" / file.stem
    hermesh = os.path.abspath(arguments.hermesh)
    benchmark = Benchmark(experiment, hermesh, out, say, shard)
    rows = benchmark.run(entries, cache, arguments.jobs)
    ours = {m["name"] for m in experiment["method"] if m["name"].startswith("hermesh")}
    rates.write_report(rows, [m["name"] for m in experiment["method"]], ours, experiment["question"], out,
                       benchmark.task, _provenance(benchmark.build))
    print((out / "table.md").read_text())
    say(f"Table, profiles and worst cases: {out}/table.md, profiles.svg, gallery.html")
    return 0
