"""Runs experiments: the commands `run` and `conform`.

An experiment is cut into groups of cells: the variants at one input, resolution and voxelizer, which take
turns while they are timed. Each group is a job of a child process (child.py), and its rows are on disk before
the next group begins. A cell that crashes, hangs or exceeds a limit becomes a row with the reason, and the
others of its group are run again without it.

A shard is a part of the groups. The heaviest group goes first, each to the shard with the least weight so
far, so the heaviest shard has at most 4/3 - 1/(3 N) of the weight that the best partition into N gives
(Graham, "Bounds on multiprocessing timing anomalies", 1969). merge.py joins the rows of the shards.
"""

import argparse
import hashlib
import io
import json
import os
import pathlib
import re
import shutil
import signal
import sys
import time

from . import (ablations, certificates, child, compare, damage, experiment, faults, merge, metamorphic,
               models, stale, tables, upkeep)
from .child import DataMissing, InputUnreadable
from .program import check_may_be_kept, load_program, provenance, sha256_of
from .rows import ROOT, LabError, append_rows, drop_torn_row, find, read_rows, readable, text_at, to_json

USUAL_SECONDS, USUAL_SHARE_OF_MEMORY = 3600, 0.8  # limits of a cell if neither the user nor the file has any
MOST_SHARDS = 10_000
OWN_MEASUREMENTS = {each["name"]: each for each in (
    stale.MEASUREMENT, certificates.MEASUREMENT, damage.MEASUREMENT, faults.MEASUREMENT,
    metamorphic.MEASUREMENT, *upkeep.MEASUREMENTS)}


# ---- Shards

def shard_of(text):
    """Returns (2, 3) of "2/3", the second of three parts. Raises argparse.ArgumentTypeError."""
    match = re.fullmatch(r"(\d{1,5})/(\d{1,5})", text, re.ASCII)
    shard = tuple(map(int, match.groups())) if match else (0, 0)
    if not 1 <= shard[0] <= shard[1] <= MOST_SHARDS:
        raise argparse.ArgumentTypeError(f"expected the number of a part and of all parts, such as 2/3, with "
                                         f"at most {MOST_SHARDS} parts, not '{text}'")
    return shard


def partition(weights, shards):
    """Returns the shard, from 1, of each of the weights."""
    sums, parts = [0.0] * shards, [0] * len(weights)
    for at in sorted(range(len(weights)), key=lambda at: -weights[at]):
        lightest = sums.index(min(sums))
        sums[lightest] += weights[at]
        parts[at] = lightest + 1
    return parts


# ---- A run

class Run:
    """One run of an experiment, with the arguments of the command `run`. execute() is what a caller needs."""

    def __init__(self, arguments, program):
        self.arguments, self.program = arguments, program
        self.source = experiment.find_experiment(arguments.experiment)
        vocabulary = with_own_measurements(program.description)
        self.experiment, self.tier = experiment.with_overrides(
            experiment.read_experiment(self.source, vocabulary), arguments, vocabulary)
        self.name, self.kind = self.experiment["name"], self.experiment["kind"]
        self.shown = arguments.out or pathlib.Path("results/local", self.source.stem)
        check_may_be_kept(self.shown, program.description)
        if arguments.shard and self.kind == "measurement":
            raise LabError(f"{self.name} is a measurement, whose rows are made without shards")
        self.out = self.shown.absolute()
        self.file, self.manifest_file = self.out / "rows.jsonl", self.out / "shard.json"
        self.head = self._head()
        self.limits = self._limits()
        self.own_run, self.earlier_run = self.head["run"], ""
        self.start, self.position = time.monotonic(), ""
        self.existing = {}  # rows of earlier runs by cell, then by case/label
        self.tables_of_earlier_run = set()  # each a _table_of()
        self.notes = {}  # as keys, so that each is there once
        self.inputs, self.rows, self.reused = {}, [], 0

    def _head(self):
        """Returns what all rows of the run begin with."""
        own, described = self.experiment, self.program.description
        origin = provenance(described, self.arguments.threads or described["threads"])
        head = {"experiment": self.name, "tier": self.arguments.tier, "question": own["question"],
                "run": f"{origin['date']}-{os.getpid()}", **origin, "binary": self.program.hash}
        head |= {key: own[key] for key in ("columns", "plots") if own[key]}
        if own["ablation"]:
            prediction = ablations.prediction_of(self.source)
            ablations.check_prediction(prediction, self.shown)
            head["ablation"] = own["ablation"] | {"prediction": prediction}
        if self.kind != "extraction":
            head["kind"] = self.kind
        if self.kind == "voxelization":
            head["band"] = {"exterior": own["exterior_band"], "interior": own["interior_band"]}
        return head

    def _limits(self):
        if self.arguments.in_process:
            return child.Limits(0, 0)
        usual = 0 if self.kind == "measurement" else USUAL_SECONDS  # a measurement may need hours for a row
        memory = USUAL_SHARE_OF_MEMORY * self.head["machine"]["memory_bytes"] / child.MIB
        return child.Limits(self.arguments.timeout or self.tier["timeout"] or usual,
                            int(self.arguments.memory or self.tier["memory"] or memory))

    def _progress(self, stage):
        if not self.arguments.quiet and sys.stderr.isatty():
            line = f"{self.position} {stage}"[:100]
            print(f"\r\033[K{line}\r", end="", file=sys.stderr, flush=True)

    # ---- Jobs

    def _work(self, job, keep=child.ignore):
        """Has a child work on a job, passing each row to keep() at once; returns the Outcome.

        Raises DataMissing, InputUnreadable or LabError if the child reports an error.
        """
        common = {"kind": self.kind, "threads": self.head["threads"], "out": str(self.out),
                  "require_data": self.arguments.require_data}
        outcome = child.work(self.program.command, common | job, self.limits, keep, self.notes.setdefault,
                             self._progress)
        if outcome.reason and self.arguments.in_process:
            where = outcome.culprit or self.position
            raise LabError(f"the child {outcome.reason} while it worked on {where}")
        return outcome

    def _job(self, group, variants):
        """Returns what a child learns of a group of cells, except the head of their rows."""
        parts = [group["case"]["name"], group["resolution"] or group["voxel_size"]]
        if len(self.experiment["voxelizers"]) > 1 and group["voxelizer"]:
            parts.append(group["voxelizer"]["label"])
        stated = self.experiment | self.tier | group["case"] | group
        return {"case": group["case"]["name"], "variants": variants,
                "files": "-".join(experiment.file_name(str(part)) for part in parts).lstrip("-"),
                **{key: stated[key] for key in experiment.OF_JOB}}

    def _input_hash(self, name, sweep=None):
        """Returns the SHA-256 of an input as the program reads it now."""
        key = name, to_json(sweep)
        if key not in self.inputs:
            found = self._work({"kind": "input", "case": name, "sweep": sweep}).input
            self.inputs[key] = found["sha256"] if found else ""
        return self.inputs[key]

    # ---- Existing rows

    def _cell(self, job):
        """Returns a hash of everything that the file states of a job, by which its rows are found again."""
        cell = [self.kind, job, self.head["threads"], self.head.get("ablation")]
        return hashlib.sha256(to_json(cell).encode()).hexdigest()[:16]

    def _cells(self, group):
        """Returns {label: cell} of a group."""
        return {each["label"]: self._cell(self._job(group, [each])) for each in group["variants"]}

    def _read_existing(self):
        if not self.file.exists():
            return
        if drop_torn_row(self.file):
            self.notes.setdefault(f"the last line of {self.file} was half a row, and is gone")
        if self.arguments.again or self.file.stat().st_size == 0:
            return
        own = {key: self.head[key] for key in ("binary", "tier", "experiment")}
        for row in read_rows(self.file):
            if "cell" in row and row | own == row:
                self.existing.setdefault(row["cell"], {})[_key_of(row)] = row
                if self.earlier_run != text_at(row, "/run"):
                    self.earlier_run, self.tables_of_earlier_run = text_at(row, "/run"), set()
                self.tables_of_earlier_run.add(_table_of(row))

    def _existing_rows(self, group, cells):
        """Returns the rows of a group if all exist, of the present data and outside programs.

        Some of a group are of no use, because its cells take turns.
        """
        found = [[None, *self.existing.get(cell, {}).values()][-1] for cell in cells.values()]
        programs = [outside_hash(variant["command"]) for variant in group["variants"]]
        if None in found or any(row.get("outside", "") != now for row, now in zip(found, programs)):
            return []
        try:
            place, now = "/case/sha256", self._input_hash(group["case"]["name"], group["sweep"])
        except (DataMissing, InputUnreadable) as error:
            place, now = "/failed", str(error)
        return found if all(text_at(row, place) == now for row in found) else []

    def _has_inputs_of(self, row):
        """Returns True if the inputs of a measured row are available unchanged; generated ones always are."""
        return all(source["origin"] == "generated" or self._input_hash(source["name"]) == source["sha256"]
                   for source in find(row, "/inputs") or [])

    # ---- Groups

    def _run_group(self, group):
        cells = self._cells(group)
        rows = self._existing_rows(group, cells)
        self.reused += len(rows)
        if rows:
            return rows
        # Groups that an interrupted run did not reach join it. Where it has rows of the same table, which are
        # of other data or of the file before it was edited, the new rows replace them as those of a new run.
        shown = self._failed(group, group["variants"][0], "")
        joins = self.earlier_run and _table_of(shown) not in self.tables_of_earlier_run
        self.head["run"] = self.earlier_run if joins else self.own_run
        try:
            rows = self._rows_apart(group)
        except (DataMissing, InputUnreadable) as error:
            missing = {"data_missing": True} if isinstance(error, DataMissing) else {}
            rows = [self._failed(group, variant, str(error)) | missing for variant in group["variants"]]
        rows = [row | {"cell": cells[text_at(row, "/variant/label")]} for row in rows]
        outside = {each["label"]: outside_hash(each["command"]) for each in group["variants"]
                   if each["command"]}
        rows = [row | ({"outside": outside[text_at(row, "/variant/label")]}
                       if text_at(row, "/variant/label") in outside else {}) for row in rows]
        tables.add_ratios(rows)
        append_rows(self.file, rows)
        return rows

    def _rows_apart(self, group):
        """Returns a row for each variant of a group, whatever happens to the child."""
        found, crashed = {}, []
        while todo := [each for each in group["variants"] if each["label"] not in found]:
            outcome = self._work_on(group, todo)
            if not outcome.reason:
                found |= {text_at(row, "/variant/label"): row for row in outcome.rows}
                break
            culprits = [each for each in todo if each["label"] == outcome.culprit]
            reason = outcome.reason if culprits else f"{outcome.reason} before a variant was at work"
            for variant in culprits or todo:
                planned = outcome.planned.get(variant["label"])
                found[variant["label"]] = self._failed(group, variant, reason, planned)
            crashed += culprits if outcome.crashed else []
        # The cause of a crash may be an earlier cell: a variant that crashed gets a process of its own.
        for variant in crashed if len(group["variants"]) > 1 else []:
            outcome = self._work_on(group, [variant])
            if not outcome.reason:
                note = "this cell crashed among others and not alone; its time is not interleaved with theirs"
                row = outcome.rows[0]
                found[variant["label"]] = row | {"notes": [*row.get("notes", []), note]}
        return [found[each["label"]] for each in group["variants"] if each["label"] in found]

    def _work_on(self, group, variants):
        return self._work(self._job(group, variants) | {"head": self.head})

    def _failed(self, group, variant, reason, planned=None):
        """Returns the row of a cell that failed, of which little is known unless the program planned it."""
        size = {"resolution": group["resolution"]} if group["resolution"] else {
            "nominal_voxel_size": group["voxel_size"]}
        row = planned or self.head | size | {
            "case": {"name": group["case"]["name"]},
            "variant": {"name": variant["name"], "label": variant["label"], "options": ""}}
        row = row | ({"sweep": group["sweep"]} if group["sweep"] else {}) | {"failed": reason}
        if self.kind == "extraction":
            row |= {"voxelization": {"label": group["voxelizer"]["label"]}, "promise_letters": "FAILED",
                    "promise_verdict": f"FAILED: {reason}"}
        return row

    # ---- Measurements

    def _measure(self):
        """Returns the rows of a measurement, each of which is on disk as soon as the child sends it."""
        name, parameters = self.experiment["measurement"], self.tier["parameters"]
        job = {"measurement": name, "seed": self.experiment["seed"], "parameters": parameters}
        cell = self._cell(job)
        rows = [row for row in self.existing.get(cell, {}).values()
                if "failed" not in row and self._has_inputs_of(row)]
        self.reused, done = len(rows), [_key_of(row) for row in rows]
        if done:
            self.head["run"] = self.earlier_run

        def keep(row):
            rows.append(row | {"cell": cell})
            append_rows(self.file, rows[-1:])

        if name in OWN_MEASUREMENTS:
            self._measure_here(OWN_MEASUREMENTS[name], done, keep)
            return rows
        job |= {"head": self.head, "filter": self.arguments.filter, "done": done}
        outcome = self._work(job, keep)
        if outcome.reason:
            keep(self.head | {"measurement": {"name": name}, "case": {"name": name},
                              "variant": {"name": name, "label": name}, "failed": outcome.reason})
        return rows

    def _measure_here(self, own, done, keep):
        """Makes the rows of a measurement of the laboratory, as the program makes those of its own."""
        name, table, start, load = own["name"], own["table"], time.monotonic(), list(os.getloadavg())
        parameters = {option["name"]: option["default"] for option in own["parameters"]}
        parameters |= self.tier["parameters"]
        canonical = " ".join(f"{key}={value}" for key, value in sorted(parameters.items()))

        def wants(label):
            return self.arguments.filter in f"{name}/{table}/{label}" and f"{table}/{label}" not in done

        for label, values, broken in own["measure"](parameters, wants, self.program, self._progress):
            measurement = {"name": name, "parameters": canonical, "seed": self.experiment["seed"],
                           "seconds": time.monotonic() - start}
            keep(self.head | {"measurement": measurement, "load": load, "inputs": [], "case": {"name": table},
                              "variant": {"name": label, "label": label}, "table": own["shown"],
                              "values": values, "broken": broken})

    # ---- Shards

    def _own_groups(self, groups):
        """Returns the groups of the shard, and writes its manifest."""
        number, of = self.arguments.shard
        parts = partition([group["weight"] for group in groups], of)
        cells = [[cell, group["name"] + label, part] for group, part in zip(groups, parts)
                 for label, cell in self._cells(group).items()]
        identity = {"experiment": self.name, "tier": self.arguments.tier,
                    "file_sha256": sha256_of(self.source), "shard": number, "of": of}
        there = merge.read_manifest(self.out) if self.manifest_file.exists() else {}
        if (there or self.file.exists()) and any(there.get(key) != identity[key] for key in identity):
            raise LabError(f"{self.out} has rows that are not of shard {number}/{of} of {self.name} "
                           f"({self.arguments.tier}) as its file is now; pass another directory")
        self.manifest = identity | {
            "commit": self.head["commit"], "binary": self.program.hash, "threads": self.head["threads"],
            "finished": False, "cells": cells}
        self._write_manifest()
        return [group for group, part in zip(groups, parts) if part == number]

    def _write_manifest(self):
        """Writes shard.json in one step, so that a killed run leaves the old one or the new one."""
        half = self.out / f"shard.json.{os.getpid()}"
        half.write_text(json.dumps(self.manifest, indent=1, ensure_ascii=False) + "\n")
        half.rename(self.manifest_file)

    # ---- The whole

    def execute(self):
        """Runs the cells; returns the exit code and the tables.

        The code is 3 if a guarantee was broken, the libraries' counts differ from ours or required data are
        missing, else 1 if a cell failed. Raises LabError if there is no such cell, and for an error of the
        whole run.
        """
        offline = os.environ.get("HERMESH_OFFLINE")
        try:
            groups = [{"name": self.name + "/"}]
            if self.kind != "measurement":
                groups = experiment.groups_of(self.experiment, self.tier, self.arguments.filter)
            if groups or self.arguments.shard:
                self.out.mkdir(parents=True, exist_ok=True)
            if self.arguments.shard:
                groups = self._own_groups(groups)
            self._fetch_models(groups)
            self._read_existing()
            for done, group in enumerate(groups):
                self.position = f"[{done + 1}/{len(groups)}] {group['name'][:-1]}"
                self.rows += self._measure() if self.kind == "measurement" else self._run_group(group)
                self._say_done(done + 1, len(groups))
            if not self.rows and not self.arguments.shard:
                raise LabError(f"no cell of {self.name} has \"{self.arguments.filter}\" in its "
                               "case/resolution/variant")
            return exit_code(self.rows), self._summary()
        finally:
            os.environ.pop("HERMESH_OFFLINE", None)
            if offline is not None:
                os.environ["HERMESH_OFFLINE"] = offline
            if not self.arguments.quiet:
                sys.stderr.write("".join(f"note: {note}\n" for note in self.notes))

    def _fetch_models(self, groups):
        """Downloads the models of the groups in advance; if that fails, no child tries again."""
        def say(message):
            if not self.arguments.quiet:
                print(f"hermesh: {message}", file=sys.stderr, flush=True)

        reason = models.fetch([group["case"]["name"] for group in groups if "case" in group], say)
        if reason:
            os.environ["HERMESH_OFFLINE"] = os.environ.get("HERMESH_OFFLINE") or reason

    def _say_done(self, done, groups):
        """Prints a line for each finished group, unless a terminal shows the progress, and logs it."""
        elapsed = time.monotonic() - self.start
        line = f"{self.position}, {readable(elapsed)} s since the start"
        if done < groups:
            line += f", about {readable(elapsed / done * (groups - done))} s left"
        if not self.arguments.quiet and not sys.stderr.isatty():
            print(line, file=sys.stderr, flush=True)
        if self.arguments.log:
            with open(self.arguments.log, "a") as file:
                print(time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()), line, file=file)

    def _summary(self):
        """Draws the plots of all rows, those of earlier runs too; returns the report of this run's rows."""
        out, file = io.StringIO(), self.shown / "rows.jsonl"
        out.write(tables.markdown_report(self.rows))
        if self.arguments.shard:
            self.manifest["finished"] = True
            self._write_manifest()
            number, of = self.arguments.shard
            print(f"Shard {number}/{of}: {len(self.rows)} of {len(self.manifest['cells'])} cells", file=out)
        if self.reused:
            self.notes.setdefault(f"{self.reused} of {len(self.rows)} cells were in {file} already, made by "
                                  "this program of the same data, with the columns and plots of that run; "
                                  "--again makes them again, with those of the file")
        print(f"Rows: {file}; pictures: {self.shown / '*.png'}", file=out)
        if not self.arguments.shard:
            tables.write_plots(read_rows(self.file), self.out, out)
        tables.write_failures(self.rows, out)
        return out.getvalue()


def with_own_measurements(description):
    """Returns the program's vocabulary with the measurements of the laboratory."""
    own = [each | {"tables": [{"name": each["table"],
                               "columns": [column["name"] for column in each["shown"]["columns"]]}]}
           for each in OWN_MEASUREMENTS.values()]
    others = [each for each in description["measurements"] if each["name"] not in OWN_MEASUREMENTS]
    return description | {"measurements": own + others}


def _key_of(row):
    return f"{text_at(row, '/case/name')}/{text_at(row, '/variant/label')}"


def _table_of(row):
    """Returns what the rows of one table of a run agree in."""
    parts = "/case/name", "/resolution", "/voxelization/label", "/sweep/parameter"
    return tuple(text_at(row, part) for part in parts)


def outside_hash(command):
    """Returns a hash of a command, its program and the files that it names; "" if there is no command."""
    if not command:
        return ""
    words = re.split(r"\s+", command.replace("{source}", str(ROOT)))
    files = [os.path.realpath(word) if os.path.isfile(word) else shutil.which(word) or "" for word in words
             if word and "{" not in word]
    digests = [sha256_of(pathlib.Path(file)) if os.path.isfile(file) else "" for file in files]
    return hashlib.sha256(to_json([command, digests]).encode()).hexdigest()[:16]


def exit_code(rows):
    """Returns 3 for a broken guarantee, contradicting checks or missing data, 1 for a failure, else 0."""
    if any(row.get("broken") or row.get("disagreements") or "data_missing" in row for row in rows):
        return 3
    return int(any("failed" in row and "absent" not in row for row in rows))


# ---- Commands

def _ranged(kind, low, high):
    def check(value):
        if not low <= kind(value) <= high:
            raise argparse.ArgumentTypeError(f"must be from {low} to {high}, not {value}")
        return kind(value)
    return check


def _parameter(value):
    key, equals, text = value.partition("=")
    if not key or not equals:
        raise argparse.ArgumentTypeError(f"'{value}' is not NAME=VALUE")
    return key, text


def _add_options(parser):
    add, several = parser.add_argument, {"action": "extend", "nargs": "+", "default": []}
    add("experiment", metavar="EXPERIMENT", help="experiment file (.toml), the name of one of "
        "experiments/questions, or a table or figure of the thesis that it makes (figure_9_8)")
    add("--tier", choices=experiment.TIERS, default="quick", help="sizes to run (default: quick)")
    add("--out", type=pathlib.Path, help="directory for rows.jsonl, meshes and pictures (default: "
        "results/local/ and the file's name)")
    add("--filter", default="", help="only cells whose case/resolution/variant contains this text")
    add("--variant", **several, help="only these variants (labels or names in the file, else names from "
        "`hermesh list`)")
    add("--case", **several, help="only these cases (of the file, else from `hermesh list`, or mesh files)")
    add("--resolution", **several, type=_ranged(int, 2, 100_000), help="these resolutions for all cases")
    add("--repetitions", type=_ranged(int, 1, 1000), help="at most this number of timed runs of each variant")
    add("--set", **several, type=_parameter, metavar="NAME=VALUE", help="parameters of a measurement, which "
        "replace those of the file; every row states those that it was made with")
    add("--again", action="store_true", help="repeat cells of which the directory has rows by this program, "
        "of the same data (default: continue an earlier run)")
    add("--timeout", type=_ranged(float, 0.01, 1e7), help="seconds that a step of a cell may take, or a "
        "measurement from row to row (default: the file's, else 3600, and none for a measurement)")
    add("--memory", type=_ranged(float, 16, 1e9), help="MiB of memory that a cell may take (default: the "
        "file's, else 80 %% of the machine's)")
    add("--in-process", action="store_true", help="for a debugger: without limits, and a crash ends the run")
    add("--shard", type=shard_of, metavar="I/N", help="only part I of N of the file's groups of cells; "
        "`hermesh merge` joins the directories of all parts")
    add("--require-data", action="store_true", help="use no stand-in for a model that is not available: its "
        "cells fail, and the exit code is 3")
    add("--threads", type=_ranged(int, 1, 1024), help="number of threads (default: all of the machine)")
    add("--quiet", action="store_true", help="print only results and errors: no progress and no notes")
    add("--log", type=pathlib.Path, help="append a line with its time to this file for each finished group")
    parser.set_defaults(usage=parser.error)
    return parser


def arguments_of(*words):
    """Returns the arguments of a `run` command, e.g. for Run."""
    return _add_options(argparse.ArgumentParser()).parse_args(list(map(str, words)))


def add_command(subparsers):
    parser = subparsers.add_parser("run", help="run an experiment: validate, time, append rows, print tables")
    _add_options(parser).set_defaults(function=run)
    parser = subparsers.add_parser(
        "conform", help="check that a variant's guarantees hold on difficult shapes, with the same bytes for "
        "any number of threads; if not, exit code 3")
    parser.add_argument("variant", metavar="NAME", help="extractor from `hermesh list`")
    parser.add_argument("--out", type=pathlib.Path, help="directory for rows and meshes (default: "
                        "results/local/conform-NAME)")
    parser.add_argument("--quiet", action="store_true", help="print only results and errors")
    parser.set_defaults(function=conform)


def end_on_signals():
    """Makes SIGTERM and SIGHUP end the program as Ctrl-C does, so that no child is left."""
    for number in (signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, lambda received, frame: sys.exit(128 + received))


def run(arguments):
    if len(dict(arguments.set)) < len(arguments.set):
        arguments.usage("--set gives a parameter twice")
    reduced = ("filter", "variant", "case", "resolution", "repetitions", "set")
    if arguments.shard and any(getattr(arguments, key) for key in reduced):
        arguments.usage(f"--shard is a part of the whole file; --{', --'.join(reduced)} reduce or change it")
    if arguments.shard and not arguments.out:
        arguments.usage("--shard needs --out, a directory for each shard")
    if arguments.in_process and (arguments.timeout or arguments.memory):
        arguments.usage("--timeout and --memory have no effect with --in-process")
    end_on_signals()
    try:
        code, table = Run(arguments, load_program()).execute()
    except DataMissing as error:
        print(f"hermesh: {error}", file=sys.stderr)
        return 3
    sys.stdout.write(table)
    return code


def conform(arguments):
    """Runs one variant on the shapes of upkeep/conform.toml with 1, 2 and 7 threads."""
    end_on_signals()
    program, variant, codes, rows, printed = load_program(), arguments.variant, [], {}, {}
    for threads in (1, 2, 7):
        out = (arguments.out or pathlib.Path(f"results/local/conform-{variant}")) / f"{threads}-threads"
        shutil.rmtree(out, ignore_errors=True)
        own = arguments_of("conform", "--variant", variant, "--out", out, "--threads", threads,
                           *["--quiet"] * arguments.quiet)
        code, printed[threads] = Run(own, program).execute()
        codes.append(code)
        rows[threads] = read_rows(out)
    print(printed[1])
    for threads in (2, 7):
        comparison = compare.compare_rows(rows[1], rows[threads], costs=False)
        if not comparison.fine():
            codes.append(3)
            print(f"Not the same bytes with one thread and with {threads}:")
            sys.stdout.write(compare.text(comparison, "md"))
    print(f"{variant} conforms: its promises hold on all shapes, and its bytes do not depend on the number "
          "of threads" if max(codes) == 0 else
          f"{variant} does not conform: see what is in capitals, or differs, above")
    return max(codes)
