"""Experiment files: reading, checking, and the cells that they ask for.

experiments/questions/meshes/headline.toml explains the keys of an experiment on extraction,
speed/voxelization_speed.toml those on voxelization, thesis/normal_codes.toml those of a measurement. Files
are read strictly, because a misspelt key that is ignored becomes a wrong number in a paper.

The vocabulary of the files is what the program states of itself (Program.description in program.py):
"extractors" and "voxelizers" with their options, "cases", "measurements" with their parameters and tables.
"""

import difflib
import itertools
import os
import pathlib
import re
import tomllib

from . import ablations
from .rows import LabError, ROOT, all_columns, readable, shown

ALL = 0  # as a number of samples
KINDS = ("extraction", "voxelization", "measurement")
SIGNS = ("none", "parity", "unanimous-parity", "winding-number")
TIERS = ("quick", "full")
# Values of the keys that a file, a tier, a case or a plot may leave out.
EXPERIMENT = {"shows": [], "voxelizers": [], "variants": [], "columns": [], "features": None,
              "exterior_band": 3.0, "interior_band": 3.0, "measurement": "", "seed": 1, "plots": []}
TIER = {"cases": [], "repetitions": 5, "seconds_per_variant": 5.0, "timeout": None, "memory": None,
        "samples": 100_000, "pixels": 400, "self_intersections": True, "components": False, "parameters": {}}
CASE = {"resolutions": [], "closeup": None, "view": None, "voxel_sizes": [], "length": None,
        "published_seconds": [], "sweep": [None], "distances": None, "to_boundary": False, "signs": "none",
        "sign_samples": 10_000, "solid": ""}
PLOT = {"case": "", "resolution": 0, "log_x": False, "log_y": False, "percent": False, "by_variant": False,
        "categories": False, "emphasised": [], "note": ""}
# The keys of its file, tier, case and itself that the job of a group has (groups_of).
OF_JOB = ("features exterior_band interior_band repetitions seconds_per_variant samples pixels "
          "self_intersections components length closeup view distances to_boundary signs sign_samples solid "
          "resolution voxel_size published_seconds sweep voxelizer").split()
_MESH_FILE = re.compile(r"\.(ply|obj|off|stl|glb|gltf|3mf)(\.gz)?$", re.IGNORECASE)
_NUMBER = re.compile(r"-?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?", re.IGNORECASE)


def joined(names, like=""):
    """Returns names with commas between them, at most eight, the most similar to `like` first."""
    names = sorted(names, key=lambda name: -difflib.SequenceMatcher(None, name, like).ratio())
    more = f" and {len(names) - 8} more" if len(names) > 8 else ""
    return ", ".join(map(shown, names[:8])) + more


def file_name(text):
    """Returns a text as part of the name of a file, as the program writes it."""
    return re.sub(rb"[^A-Za-z0-9.-]", b"-", text.encode()).decode()


# ---- Checkers take a value and its place in the file, and return the value to use or raise LabError.

def text(value, where):
    if not isinstance(value, str) or not value or re.search("[\x00-\x08\x0b-\x1f\x7f]", value):
        raise LabError(f"{where} must be a text that is not empty and has no control characters")
    return value


def flag(value, where):
    if not isinstance(value, bool):
        raise LabError(f"{where} must be true or false")
    return value


def number(low, high, kind=float):
    def check(value, where):
        if isinstance(value, bool) or not isinstance(value, (int, kind)) or not low <= value <= high:
            what = "number" if kind is float else "whole number"
            raise LabError(f"{where} must be a {what} from {low:g} to {high:g}")
        return kind(value)
    return check


def choice(kind, known):
    """Returns a checker of names; None knows all."""
    def check(value, where):
        if text(value, where) and known is not None and value not in known:
            everything = "experiments/lab/columns.toml" if kind == "column" else "`hermesh list`"
            more = f"; {everything} lists all" if len(known) > 8 else ""
            raise LabError(f'{where}: there is no {kind} "{shown(value)}"; expected one of '
                           f"{joined(known, value)}{more}")
        return value
    return check


def list_of(check, distinct=False):
    def check_list(value, where):
        if not isinstance(value, list) or not value:
            raise LabError(f"{where} must be a list that is not empty")
        items = [check(item, f"{where}[{at}]") for at, item in enumerate(value)]
        if twice := [item for item in items if distinct and items.count(item) > 1]:
            raise LabError(f'{where} has "{shown(twice[0])}" twice')
        return items
    return check_list


def list_like(*checks):
    def check_list(value, where):
        if not isinstance(value, list) or len(value) != len(checks):
            raise LabError(f"{where} must be a list of {len(checks)} numbers")
        return [check(item, f"{where}[{at}]") for at, (check, item) in enumerate(zip(checks, value))]
    return check_list


def unchecked(value, where):
    return value


def read_table(value, where, required, optional={}):
    """Returns the keys that a table has, checked. `required` and `optional` have a checker for each key."""
    if not isinstance(value, dict):
        raise LabError(f"{where} must be a table")
    keys = required | optional
    for key in value:
        if key not in keys:
            raise LabError(f'{where}: unknown key "{shown(key)}"; expected one of {joined(keys, key)}')
    for key in required:
        if key not in value:
            raise LabError(f'{where} needs the key "{key}"')
    start = where + ("." if ": " in where else ": ")
    return {key: check(value[key], start + key) for key, check in keys.items() if key in value}


# ---- Options

def option_text(value, where):
    """Returns an option as the text that the program takes; numbers keep their value."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return f"{value:g}" if float(f"{value:g}") == value else f"{value:.17g}"
    if isinstance(value, (int, str)):
        return str(value)
    raise LabError(f"{where} must be a text or a number")


def option_problems(name, declared, given):
    """Yields (option, why) of the options of `given` that are unknown, invalid, or have no effect."""
    known = {option["name"]: option for option in declared}
    for key, value in given.items():
        if key not in known:
            yield key, f"{name} has no option '{shown(key)}'; it takes {joined(known, key) or 'none'}"
        elif wanted := _mismatch(known[key], value):
            yield key, f"option '{key}' of {name} cannot be '{shown(value)}'; it takes {wanted}"
    values = {key: given.get(key, option["default"]) for key, option in known.items()}
    for key in known.keys() & given.keys():
        for condition in known[key].get("only_with", []):
            other, _, wanted = condition.partition("=")
            if not any(_same(values.get(other), each) for each in wanted.split("|")):
                needed = condition.replace("|", " or ")
                yield key, f"option '{key}' of {name} has no effect without {needed}"


def check_options(name, declared, given):
    """Raises LabError for the first problem."""
    for _, why in option_problems(name, declared, given):
        raise LabError(why)


def _mismatch(option, value):
    """Returns what an option takes if the value is none of that, else None."""
    if "choices" in option:
        return None if value in option["choices"] else "one of " + joined(option["choices"])
    low, high = option["minimum"], option["maximum"]
    is_valid = _NUMBER.fullmatch(value) and low <= float(value) <= high
    return None if is_valid else f"a number from {low:g} to {high:g}"


def _same(a, b):
    numbers = a is not None and _NUMBER.fullmatch(a) and _NUMBER.fullmatch(b)
    return float(a) == float(b) if numbers else a == b


def _options(name, declared):
    keys = {option["name"]: option_text for option in declared}

    def check(value, where):
        options = dict(sorted(read_table(value, where, {}, keys).items()))
        try:
            check_options(name, declared, options)
        except LabError as error:
            raise LabError(f"{where}: {error}") from None
        return options
    return check


# ---- Parts of a file

def variant(name, label="", options=None):
    """Returns an entry of a list of variants."""
    return {"name": name, "label": label or name, "options": options or {}, "uniform": "", "command": ""}


def _variants(kind, table):
    """Checks a list of variants (extractors) or voxelizers of the vocabulary's table, names or tables."""
    declared = {entry["name"]: entry["options"] for entry in table}
    of_variants = {"uniform": text} if kind == "variant" else {}

    def check_entry(value, where):
        if isinstance(value, str):
            return variant(choice(kind, declared)(value, where))
        if of_variants and isinstance(value, dict) and "command" in value:
            entry = read_table(value, where, {"command": text, "label": text}, of_variants)
            return variant("command " + entry["label"]) | entry
        optional = {"label": text, "options": unchecked} | of_variants
        entry = read_table(value, where, {"name": choice(kind, declared)}, optional)
        check_own = _options(entry["name"], declared[entry["name"]])
        options = check_own(entry.get("options", {}), f"{where}.options")
        return variant(entry["name"]) | entry | {"options": options}

    def check(value, where):
        entries, labels = list_of(check_entry)(value, where), []
        for at, entry in enumerate(entries):
            if entry["uniform"]:
                choice(f"{kind} above", labels)(entry["uniform"], f"{where}[{at}].uniform")
            if entry["label"] in labels:
                raise LabError(f'{where}[{at}]: two rows would have the label "{shown(entry["label"])}"; '
                               "change one")
            labels.append(entry["label"])
        return entries
    return check


def _amount(value, where):
    return ALL if value == "all" else number(1, 100_000_000, int)(value, where)


def _sweep(value, where):
    if not isinstance(value, dict) or len(value) != 1:
        raise LabError(f"{where} must be {{ parameter = [values] }} of the case's recipe")
    (parameter, values), = value.items()
    values = list_of(number(-1e9, 1e9))(values, f"{where}.{shown(parameter)}")
    return [{"parameter": parameter, "value": value} for value in values]


def _case_name(known):
    def check(value, where):
        # A missing mesh file is not an error of the experiment file; its rows state it.
        is_file = _MESH_FILE.search(text(value, where)) or os.path.isfile(value)
        return value if is_file else choice("case or mesh file", known)(value, where)
    return check


def case(name, resolutions=()):
    """Returns an entry of a tier's list of cases."""
    return CASE | {"name": name, "resolutions": list(resolutions)}


def _case(kind, known):
    fraction, sizes = number(0, 1), list_of(number(1e-9, 1e9))
    optional = {"resolutions": list_of(number(2, 100_000, int))}
    optional |= {"closeup": list_like(fraction, fraction, fraction, number(1e-6, 2)),
                 "view": list_like(number(-360, 360), number(-89, 89))} if kind == "extraction" else {
        "voxel_sizes": sizes, "length": number(1e-9, 1e9), "published_seconds": list_of(number(0, 1e9)),
        "sweep": _sweep, "distances": _amount, "to_boundary": flag, "signs": choice("rule", SIGNS),
        "sign_samples": _amount, "solid": choice("case", known)}

    def check(value, where):
        read = read_table(value, where, {"name": _case_name(known)}, optional)
        entry = CASE | ({"sign_samples": ALL} if read.get("signs") == "parity" else {}) | read
        if bool(entry["resolutions"]) == bool(entry["voxel_sizes"]):
            raise LabError(f'{where} needs either "resolutions" or "voxel_sizes"')
        if len(entry["published_seconds"]) not in (0, len(entry["voxel_sizes"])):
            raise LabError(f"{where}.published_seconds must have a value for every voxel size")
        if entry["length"] and not entry["voxel_sizes"]:
            raise LabError(f"{where}.length has no effect without voxel_sizes")
        if entry["sign_samples"] == ALL and entry["signs"] != "parity":
            raise LabError(f"{where}.sign_samples: only parity can check the signs of all voxels")
        return entry
    return check


def _tier(kind, known):
    optional = {"repetitions": number(1, 1000, int), "seconds_per_variant": number(0, 1e5),
                "timeout": number(0.01, 1e7), "memory": number(16, 1e9)}
    optional |= {"samples": number(1, 1_000_000_000, int), "pixels": number(0, 4000, int),
                 "self_intersections": flag} if kind == "extraction" else {"components": flag}
    required = {"cases": list_of(_case(kind, known))}
    return lambda value, where: TIER | read_table(value, where, required, optional)


def _parameters(measurement):
    read = _options(measurement["name"], measurement["parameters"])
    return lambda value, where: TIER | {"parameters": read(value, where)}


def plot(cases, columns):
    """Checks a plot of rows with these cases and columns; None allows all."""
    required = {"name": text, "title": text, "x": choice("column", columns), "x_label": text, "y_label": text,
                "y": list_of(choice("column", columns), distinct=True)}
    optional = {"case": choice("case", cases), "resolution": number(0, 1 << 20, int), "note": text,
                "emphasised": list_of(text)}
    optional |= dict.fromkeys(("log_x", "log_y", "percent", "by_variant", "categories"), flag)
    return lambda value, where: read_table(value, where, required, optional)


def _shows(value, where):
    if not re.fullmatch(r"(table|figure)_\d+_\d+", str(value)):
        raise LabError(f'{where} must be a table or figure such as "figure_9_8"')
    return value


# ---- Files

def parse(path):
    """Returns the table in a TOML file. Raises LabError for a missing file and for a syntax error."""
    path = pathlib.Path(path)
    if not os.path.isfile(path):
        raise LabError(f"there is no experiment file {shown(path, 1000)}; `hermesh list` lists the project's")
    try:
        return tomllib.loads(path.read_text())
    except ValueError as error:
        raise LabError(f"{path.name}: {shown(error, 200)}") from None
    except RecursionError:
        raise LabError(f"{path.name}: it is nested too deeply to be read") from None


def read_experiment(path, vocabulary):
    """Returns an experiment as a dict: the keys of the file or their defaults, name, "tiers", and "ablation".

    Raises LabError that names the file and the key for a syntax error, an unknown or missing key, a wrong
    type, a value out of range, a name or option that is not in the vocabulary, a label that is used twice.
    """
    path = pathlib.Path(path)
    document, where = parse(path), path.name
    kind = choice("kind", KINDS)(document.get("kind", "extraction"), f"{where}: kind")
    cases, columns = vocabulary["cases"], [column.name for column in all_columns()]
    required, optional = {"question": text}, {"kind": text, "shows": list_of(_shows)}
    if kind == "measurement":
        known = {entry["name"]: entry for entry in vocabulary["measurements"]}
        required["measurement"] = choice("measurement", known)
        own = known[required["measurement"](document.get("measurement"), f"{where}: measurement")]
        cases = [table["name"] for table in own["tables"]]
        columns = [column for table in own["tables"] for column in table["columns"]]
        optional["seed"], tier = number(0, 1_000_000_000, int), _parameters(own)
    else:
        required["voxelizers"] = _variants("voxelizer", vocabulary["voxelizers"])
        required["columns"], tier = list_of(choice("column", columns), distinct=True), _tier(kind, cases)
    if kind == "extraction":
        required["variants"] = _variants("variant", vocabulary["extractors"])
        optional["features"] = number(0, 180)
    if kind == "voxelization":
        optional |= dict.fromkeys(("exterior_band", "interior_band"), number(1, 1e4))
    optional |= {"plots": list_of(plot(cases, columns))} | dict.fromkeys(TIERS, tier)
    optional |= dict.fromkeys(("factor", "levels", "baseline", "effects"), unchecked)
    experiment = EXPERIMENT | read_table(document, where, required, optional)
    experiment |= {"name": path.stem, "kind": kind}
    experiment["tiers"] = {name: experiment[name] for name in TIERS if name in experiment}
    if not experiment["tiers"]:
        raise LabError(f"{where} needs a table [quick] or [full]")
    return experiment | {"ablation": ablations.read_ablation(document, columns, where)}


def list_experiments():
    """Returns name, question, file and shows of the project's experiments, in the order of their names."""
    folders = [ROOT / "experiments/questions", ROOT / "experiments/ablations/predictions"]
    files = [file for folder in folders for file in folder.rglob("*.toml")]
    experiments = []
    for file in sorted(files, key=lambda file: file.name):
        head = {key: value for key, value in parse(file).items() if key in ("question", "shows")}
        head = read_table(head, file.name, {"question": text}, {"shows": list_of(_shows)})
        experiments.append({"name": file.stem, "file": file, "shows": []} | head)
    return experiments


def find_experiment(name):
    """Returns the file of an experiment: its path, its name, or a table or figure that it makes."""
    if name.endswith(".toml") or "/" in name:
        return pathlib.Path(name)
    known = {}
    for experiment in list_experiments():
        known |= dict.fromkeys([experiment["name"], *experiment["shows"]], experiment["file"])
    return known[choice("experiment", known)(name, "EXPERIMENT")]


# ---- The cells that a file asks for

def with_overrides(experiment, arguments, vocabulary):
    """Returns (experiment, tier) with what the command's tier, variant, case, resolution, repetitions and set
    replace; empty ones leave what the file has. Raises LabError for unknown names."""
    name, kind = experiment["name"], experiment["kind"]
    if arguments.tier not in experiment["tiers"]:
        raise LabError(f'the experiment {name} has no tier "{arguments.tier}"')
    tier = dict(experiment["tiers"][arguments.tier])
    if kind == "measurement":
        if arguments.variant or arguments.case or arguments.resolution or arguments.repetitions:
            raise LabError(f"{name} is a measurement, which --variant, --case, --resolution and "
                           "--repetitions do not change; use --filter, or --set for its parameters")
        tier["parameters"] = dict(sorted((tier["parameters"] | dict(arguments.set)).items()))
        declared = {each["name"]: each["parameters"] for each in vocabulary["measurements"]}
        check_options(experiment["measurement"], declared[experiment["measurement"]], tier["parameters"])
        return experiment, tier
    if arguments.set:
        raise LabError(f"{name} is no measurement, and --set changes the parameters of one; use --variant, "
                       "--case, --resolution or --repetitions")
    key, table = ("voxelizers", "voxelizers") if kind == "voxelization" else ("variants", "extractors")
    check_variant = choice("variant", [each["name"] for each in vocabulary[table]])
    experiment = experiment | {key: _chosen(
        experiment[key], arguments.variant, lambda name: variant(check_variant(name, "--variant")))}
    check_case, resolutions = _case_name(vocabulary["cases"]), tier["cases"][0]["resolutions"] or [100]
    tier["cases"] = _chosen(tier["cases"], arguments.case,
                            lambda name: case(check_case(name, "--case"), resolutions))
    if arguments.resolution:
        changed = {"resolutions": arguments.resolution, "voxel_sizes": [], "published_seconds": []}
        tier["cases"] = [entry | changed for entry in tier["cases"]]
    tier["repetitions"] = arguments.repetitions or tier["repetitions"]
    return experiment, tier


def _chosen(entries, names, make):
    """Returns the entries of these names or labels; makes those that the file lacks."""
    own = ([each for each in entries if name in (each["name"], each.get("label"))] or [make(name)]
           for name in names)
    return list(itertools.chain.from_iterable(own)) or entries


def groups_of(experiment, tier, text_filter=""):
    """Returns the groups of cells that are run together: an input at one voxel size, through one voxelizer.

    A group has name, case, resolution or voxel_size (the other is None), published_seconds, sweep {parameter,
    value} or None, voxelizer (None if voxelizers compete), variants (those whose "case/resolution/variant"
    contains the filter), and weight, an estimate of its work that depends only on the file: its cells times
    the square of its resolution.
    """
    is_extraction = experiment["kind"] == "extraction"
    contenders = experiment["variants" if is_extraction else "voxelizers"]
    voxelizers = experiment["voxelizers"] if is_extraction else [None]
    groups = []
    for entry in tier["cases"]:
        for sweep, (resolution, voxel_size, seconds) in itertools.product(entry["sweep"], _sizes(entry)):
            parts = [entry["name"], readable(sweep["value"]) if sweep else None,
                     str(resolution) if resolution else readable(voxel_size), ""]
            name = "/".join(part for part in parts if part is not None)
            variants = [each for each in contenders
                        if text_filter in name + each["label"] or text_filter in name + each["name"]]
            longest = resolution or (entry["length"] or 100 * max(entry["voxel_sizes"])) / voxel_size
            group = {"case": entry, "resolution": resolution, "voxel_size": voxel_size, "sweep": sweep,
                     "published_seconds": seconds, "variants": variants, "weight": len(variants) * longest**2}
            groups += [group | {"name": name + (voxelizer["label"] + "/" if voxelizer else ""),
                                "voxelizer": voxelizer} for voxelizer in voxelizers if variants]
    return groups


def _sizes(entry):
    """Returns (resolution, voxel size, published seconds) of the groups of a case."""
    published = entry["published_seconds"] or itertools.repeat(None)
    return [*((resolution, None, None) for resolution in entry["resolutions"]),
            *((None, size, seconds) for size, seconds in zip(entry["voxel_sizes"], published))]
