"""Baselines: rows that were accepted as correct, with the reason; `compare` compares other rows with them."""

import datetime
import pathlib

from .compare import compare_rows, text
from .rows import LabError, ROOT, find, latest_groups, read_rows, text_at, to_json


def accepted(rows, reason, with_failures=False):
    """Returns (experiment, rows): the last run of each cell, with {"accepted": {"reason", "date", "commit"}}.

    Raises LabError without a reason; for rows of several experiments or commits, or of changed or unknown
    sources; and, unless with_failures, for rows that failed or broke a guarantee.
    """
    if not reason.strip():
        raise LabError("--reason is empty; state why these rows are correct and those before them were not")
    rows = [row for group in latest_groups(rows) for row in group.rows]
    experiment, commit = _common(rows, "experiment"), _common(rows, "commit")
    if not experiment or "/" in experiment or "." in experiment:
        raise LabError(f"the rows' experiment '{experiment}' cannot name a directory; rename it")
    for row in rows:
        _check(row, with_failures)
    now = datetime.datetime.now(datetime.timezone.utc).strftime("%Y-%m-%dT%H:%M:%SZ")
    return experiment, [row | {"accepted": {"reason": reason, "date": now, "commit": commit}} for row in rows]


def _common(rows, key):
    first, *others = dict.fromkeys(text_at(row, "/" + key) for row in rows)
    if others:
        raise LabError(f"the rows have more than one {key}: {first} and {others[0]}; accept each alone")
    return first


def _check(row, with_failures):
    if find(row, "/dirty") is not False or text_at(row, "/commit") in ("", "unknown"):
        raise LabError("the rows are of sources with uncommitted changes; commit them, build and run again")
    failed, broken = text_at(row, "/failed"), find(row, "/broken")
    if (failed or broken) and not with_failures:
        cell = text_at(row, "/case/name") + " / " + text_at(row, "/variant/label")
        problem = "failed: " + failed if failed else "broke a guarantee: " + broken[0]
        raise LabError(f"{cell} {problem}; repair it, or pass --with-failures to accept it")


def write_baseline(experiment, rows, directory):
    """Replaces directory/EXPERIMENT/rows.jsonl, completely or not at all, and returns its path."""
    file = pathlib.Path(directory) / experiment / "rows.jsonl"
    draft = file.with_name("rows.jsonl.draft")
    file.parent.mkdir(parents=True, exist_ok=True)
    draft.write_text("".join(to_json(row) + "\n" for row in rows), encoding="utf-8", errors="replace")
    return draft.replace(file)


def add_command(subparsers):
    description = "Makes the rows of a directory the baseline of their experiment, and prints the changes."
    parser = subparsers.add_parser("accept", help=description, description=description)
    parser.add_argument("directory", metavar="DIR", type=pathlib.Path,
                        help="directory with rows.jsonl, made by a commit")
    parser.add_argument("--reason", required=True, help="why these rows are correct")
    parser.add_argument("--with-failures", action="store_true",
                        help="also accept rows that failed or broke a guarantee")
    parser.add_argument("--baselines", type=pathlib.Path, default=ROOT / "results/baselines",
                        help="directory of the baselines (default: results/baselines)")
    parser.set_defaults(function=run)


def run(arguments):
    experiment, rows = accepted(read_rows(arguments.directory), arguments.reason, arguments.with_failures)
    before = arguments.baselines / experiment / "rows.jsonl"
    if before.exists():
        print("Beside the baseline before: " + text(compare_rows(read_rows(before), rows), "md"))
    print(f"accepted {len(rows)} rows as {write_baseline(experiment, rows, arguments.baselines)}")
    return 0
