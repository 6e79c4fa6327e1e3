"""Tables of rows in Markdown, LaTeX and CSV, and the command `report`."""

import collections
import functools
import io
import math
import pathlib
import re
import sys

from . import ablations, models, plots
from .database import RowDatabase
from .rows import (ROOT, Column, all_columns, cell_text, find, latest_groups, number_at, own_columns,
                   read_rows, readable, text_at, to_json, value_of)

_CSV_KEYS = {
    "experiment": "/experiment", "tier": "/tier", "run": "/run", "commit": "/commit", "dirty": "/dirty",
    "date": "/date", "cpu": "/machine/cpu", "threads": "/threads", "case": "/case/name",
    "origin": "/case/origin", "sha256": "/case/sha256", "resolution": "/resolution",
    "voxel_size": "/voxel_size", "nominal_voxel_size": "/nominal_voxel_size", "swept": "/sweep/parameter",
    "swept_value": "/sweep/value", "voxelizer": "/voxelization/label", "variant": "/variant/name",
    "label": "/variant/label", "failed": "/failed"}
_MARKDOWN = str.maketrans({"|": "\\|", "\n": " "})
_LATEX = str.maketrans({
    "\\": "\\textbackslash{}", "~": "\\textasciitilde{}", "^": "\\textasciicircum{}", "÷": "$\\div$",
    "×": "$\\times$", "°": "$^\\circ$", "–": "--", "·": "$\\cdot$", "→": "$\\to$",
    **{letter: "\\" + letter for letter in "&%$#_{}"}})


def has(row, pointer):
    """Returns True if the row has a value other than null at a pointer."""
    return find(row, pointer) is not None


def is_printed(rows):
    """Returns True if the rows make a table; some rows exist only for plots."""
    return bool(rows) and text_at(rows[0], "/table/printed") != "false"


def shown_columns(rows):
    """Returns the columns of the rows' table: those that the first row defines or names, else all."""
    if not rows:
        return []
    if has(rows[0], "/measurement"):
        return own_columns(rows[0])
    names = find(rows[0], "/columns")
    if names is None:
        return list(all_columns())
    return [column for name in names for column in all_columns() if column.name == name]


def _is_text(column, rows):
    """Returns True if a column has texts, which are aligned to the left."""
    return any(isinstance(value_of(column, row), str) for row in rows)


def first_column(row):
    """Returns the header of the column of labels."""
    return text_at(row, "/table/first_column") or "variant"


def group_title(row):
    """Returns the title of the row's table, e.g. "dragon at resolution 400"."""
    title = text_at(row, "/case/name")
    if has(row, "/measurement"):
        return f"{title}: {text_at(row, '/table/title')}" if has(row, "/table/title") else title
    if has(row, "/sweep"):
        title += f" by {text_at(row, '/sweep/parameter')}"
    if has(row, "/resolution"):
        return f"{title} at resolution {text_at(row, '/resolution')}"
    size = text_at(row, "/nominal_voxel_size")
    return f"{title} at voxel size {size}" if has(row, "/sweep") else f"{title} at several voxel sizes"


def group_facts(group):
    """Returns the input, grid, program, date and machine of a table."""
    row = group.rows[0]
    if has(row, "/measurement"):
        parameters = text_at(row, "/measurement/parameters")
        facts = [f"measured: {parameters} seed={text_at(row, '/measurement/seed')}", _run_fact(group)]
        private = dict.fromkeys(given["name"] for each in group.rows for given in find(each, "/inputs") or []
                                if models.is_private(given.get("name", "")))
        return facts + [f"private inputs, without a public source: {', '.join(private)}"] * bool(private)
    origin, sha256 = text_at(row, "/case/origin"), text_at(row, "/case/sha256")[:12]
    fact = f"input: {origin}, sha256 {sha256}, {readable(number_at(row, '/case/triangles'))} triangles"
    if models.is_private(text_at(row, "/case/name")):
        fact += "; private: without a public source"
    if origin.startswith("stand-in"):
        fact = "STAND-IN DATA, not the original; " + fact
    facts = [fact, _grid_fact(row), _run_fact(group)]
    if has(row, "/judged_by"):
        signs, solid = text_at(row, "/judged_by/signs"), text_at(row, "/judged_by/solid")
        facts.append(f"signs: judged by the {signs} of {solid}")
    return facts


def _run_fact(group):
    """Returns the commit, date and machine of the first row, and the number of rows of other commits."""
    row, commit = group.rows[0], text_at(group.rows[0], "/commit")
    fact = f"run: commit {commit[:12]}" + (" with changes" if find(row, "/dirty") is True else "")
    fact += f", {text_at(row, '/date')}, {text_at(row, '/machine/cpu')}, {text_at(row, '/threads')} threads"
    if has(row, "/load"):
        fact += f", load {readable(number_at(row, '/load/0'))}"
    others = collections.Counter(text_at(other, "/commit") for other in group.rows)
    del others[commit]
    return fact + "".join(f"; {count} rows of commit {of[:12]}" for of, count in sorted(others.items()))


def _grid_fact(row):
    def number(pointer, scale=1):
        return readable(number_at(row, pointer) / scale)

    if has(row, "/band"):
        fact = f"grid: band {number('/band/exterior')} voxels outside and {number('/band/interior')} inside"
    else:
        fact = f"grid: voxelizer {text_at(row, '/voxelization/label')}"
    if has(row, "/resolution"):
        fact += f", voxel {number('/voxel_size')}"
    if not has(row, "/band") and has(row, "/voxelization/active_voxels"):
        fact += f", {number('/voxelization/active_voxels')} active voxels, "
        fact += f"{number('/voxelization/memory_bytes', 2**20)} MiB, "
        fact += f"made in {number('/voxelization/seconds/median')} s"
    return fact


def stage_sentences(group):
    """Returns the share of each stage in a voxelizer's time: "time of hermesh: band 0.4 s (80 %), …"."""
    sentences = []
    for row in group.rows:
        stages, total = find(row, "/stage_seconds"), number_at(row, "/seconds/median")
        if not has(row, "/band") or has(row, "/sweep") or stages is None or len(stages) < 2 or total <= 0:
            continue
        rest = total - sum(stages.values())
        parts = stages | ({"rest": rest} if rest > 0.02 * total else {})
        share = {name: readable(math.floor(100 * seconds / total + 0.5)) for name, seconds in parts.items()}
        text = ", ".join(f"{name} {readable(seconds)} s ({share[name]} %)" for name, seconds in parts.items())
        sentences.append(f"time of {text_at(row, '/variant/label')}{_cell_of(row)}: {text}")
    return sentences


def _cell_of(row):
    """Returns the swept value or voxel size of a row, which distinguishes the rows of one label."""
    if has(row, "/sweep"):
        return f" at {text_at(row, '/sweep/parameter')} {text_at(row, '/sweep/value')}"
    return f" at voxel {text_at(row, '/nominal_voxel_size')}" if has(row, "/nominal_voxel_size") else ""


def alarms(row):
    """Returns a row's failures and broken guarantees, each with a word in capitals in front."""
    who = f"{text_at(row, '/variant/label')} on {group_title(row)}{_cell_of(row)}: "
    sentences = []
    if has(row, "/absent") or has(row, "/failed"):
        sentences.append(f"{'NOTE' if has(row, '/absent') else 'FAILED'}: {who}{text_at(row, '/failed')}")
    sentences += [f"BROKEN: {who}{broken}" for broken in find(row, "/broken") or []]
    sentences += [f"UNCHECKED: {who}the promise of {promise}" for promise in find(row, "/unchecked") or []]
    sentences += [f"DISAGREEMENT of the judges: {who}{text}" for text in find(row, "/disagreements") or []]
    if find(row, "/repetitions_differ") is True:
        what = "level sets" if has(row, "/band") else "meshes"
        sentences.append(f"NOT DETERMINISTIC: {who}repetitions gave different {what}")
    if has(row, "/not_judged"):
        sentences.append(f"NOT JUDGED: {who}{text_at(row, '/not_judged')}")
    return sentences


LONGEST_CELL = 64  # characters of a text; the rest of a longer one is a footnote


def _with_footnotes(body):
    """Returns the cells with long texts shortened to what precedes their first colon, and the footnotes."""
    notes = {}

    def short(cell):
        head, colon, rest = cell.partition(": ")
        if len(cell) <= LONGEST_CELL or not colon or len(head) > LONGEST_CELL:
            return cell
        return f"{head} [{notes.setdefault(rest, len(notes) + 1)}]"

    shown = [[line[0], *map(short, line[1:])] for line in body]
    return shown, [f"[{number}] {rest}" for rest, number in notes.items()]


def group_alarms(group):
    """Returns the alarms of all rows of a group."""
    return [sentence for row in group.rows for sentence in alarms(row)]


def _cells(group):
    """Returns the table's lines of texts, headers first."""
    columns = shown_columns(group.rows)
    lines = [[first_column(group.rows[0])] + [column.header for column in columns]]
    return lines + [[text_at(row, "/variant/label")] + [cell_text(column, row) for column in columns]
                    for row in group.rows]


def markdown_table(group):
    """Returns a table with its title and facts above and its alarms below, aligned for a terminal."""
    if not is_printed(group.rows):
        return ""
    facts = group_facts(group)
    if group.earlier_runs > 0:
        facts.append(f"earlier runs of these cells in the same folder, not shown: {group.earlier_runs}")
    head, *body = _cells(group)
    body, footnotes = _with_footnotes(body)
    body = [[cell.translate(_MARKDOWN) for cell in line] for line in body]
    widths = [max(3, *map(len, cells)) for cells in zip(head, *body)]
    left = [True] + [_is_text(column, group.rows) for column in shown_columns(group.rows)]
    aligned = [f" {{:{'<' if is_left else '>'}{width}}} |" for is_left, width in zip(left, widths)]
    rule = ["-" * width if is_left else "-" * (width - 1) + ":" for is_left, width in zip(left, widths)]
    table = "".join("|" + "".join(aligned).format(*line) + "\n" for line in [head, rule, *body])
    notes = [f"- {sentence.translate(_MARKDOWN)}\n" for sentence in [*footnotes, *stage_sentences(group)]]
    notes += [f"- **{sentence.translate(_MARKDOWN)}**\n" for sentence in group_alarms(group)]
    title = f"### {group_title(group.rows[0]).translate(_MARKDOWN)}\n\n"
    facts = "".join(f"- {fact}\n" for fact in facts)
    return title + facts + "\n" + table + ("\n" if notes else "") + "".join(notes) + "\n"


def legend(rows):
    """Returns a line that explains the headers of the rows' table."""
    if not is_printed(rows):
        return ""
    meanings = (f" *{column.header}* {column.meaning}" for column in shown_columns(rows))
    return "Columns:" + ";".join(meanings) + ".\n"


def latex_table(group):
    """Returns a table environment; it needs the package booktabs."""
    if not is_printed(group.rows):
        return ""
    columns = "l" + "r" * len(shown_columns(group.rows))
    head, *body = [" & ".join(cell.translate(_LATEX) for cell in line) + " \\\\" for line in _cells(group)]
    caption = [text.translate(_LATEX) + "." for text in [group_title(group.rows[0]), *group_facts(group)]]
    caption += [f"\\textbf{{{text.translate(_LATEX)}.}}" for text in group_alarms(group)]
    return "\n".join(["\\begin{table}", "\\centering", f"\\begin{{tabular}}{{{columns}}}", "\\toprule", head,
                      "\\midrule", *body, "\\bottomrule", "\\end{tabular}",
                      f"\\caption{{{' '.join(caption)}}}", "\\end{table}", "", ""])


def csv_text(rows):
    """Returns every row with every column: numbers in full, in the columns' units (voxels, MiB, seconds)."""
    own = {column.name: column for row in rows for column in own_columns(row)}
    columns = [Column(name, "", "", pointer) for name, pointer in _CSV_KEYS.items()]
    columns += [] if all(has(row, "/measurement") for row in rows) else all_columns()
    columns += own.values()
    lines = [[column.name for column in columns]]
    lines += [[_csv_cell(value_of(column, row)) for column in columns] for row in rows]
    return "".join(",".join(line) + "\n" for line in lines)


def _csv_cell(value):
    text = "" if value is None else value if isinstance(value, str) else to_json(value)
    return '"' + text.replace('"', '""') + '"' if re.search('[,"\n\r]', text) else text


def markdown_report(rows):
    """Returns all tables below the question of their experiment and, for an ablation, its effects."""
    out, experiment, judged = io.StringIO(), None, ablations.judge_ablations(rows)
    for group in latest_groups(rows):
        first = group.rows[0]
        key = first.get("experiment", ""), first.get("tier", "")
        if key != experiment:
            out.write(f"## {key[0]} ({key[1]}): {first.get('question', '')}\n\n")
            for ablation in judged:
                if (ablation.experiment, ablation.tier) == key:
                    ablations.write_effects(ablation, out)
        experiment = key
        out.write(markdown_table(group) + legend(group.rows) + "\n")
    return out.getvalue()


def latex_report(rows):
    """Returns all tables in LaTeX."""
    return "".join(map(latex_table, latest_groups(rows)))


def shown(text):
    """Returns a text without line breaks and control characters; omits the middle of a long one."""
    text = re.sub("[\x00-\x1f\x7f-\x9f]", "?", re.sub("[ \t-\r]+", " ", text))
    return text if len(text) <= 400 else f"{text[:200]}...{text[-200:]}"


def write_failures(rows, out):
    """Writes how many rows failed, and why the first did; variants that are not installed do not count."""
    failed = [row for row in rows if "failed" in row and "absent" not in row]
    if not failed:
        return
    parts = ["/case/name", "/sweep/value", "/resolution", "/nominal_voxel_size", "/variant/label"]
    cell = "/".join(filter(None, (text_at(failed[0], part) for part in parts)))
    reason = shown(text_at(failed[0], "/failed"))
    print(f"FAILED: {len(failed)} of {len(rows)} cells; the first is {cell}: {reason}", file=out)


def add_ratios(rows):
    """Sets the time of timed rows of one group relative to that of the first "openvdb".

    Extractors get time_over_openvdb. Voxelizers get openvdb_over_time (above 1 is faster) and
    peak_over_openvdb, relative to openvdb with its default options. Without such a row, nothing is set.
    """
    def is_base(row):
        is_default = not has(row, "/band") or find(row, "/variant/default_options") is True
        is_openvdb = text_at(row, "/variant/name") == "openvdb" and is_default
        return is_openvdb and number_at(row, "/seconds/median") > 0

    base = next(filter(is_base, rows), {})
    base_seconds, base_peak = number_at(base, "/seconds/median"), number_at(base, "/peak_bytes")
    for row in rows if base else []:
        seconds = number_at(row, "/seconds/median")
        if has(row, "/band"):
            row |= {"openvdb_over_time": base_seconds / seconds} if seconds > 0 else {}
            is_measured = has(row, "/peak_bytes") and base_peak > 0
            row |= {"peak_over_openvdb": number_at(row, "/peak_bytes") / base_peak} if is_measured else {}
        elif has(row, "/seconds/median"):
            row["time_over_openvdb"] = seconds / base_seconds


def write_plots(rows, path, out):
    """Draws the plots and the ablations' effects of rows that were read from `path`, into its directory."""
    directory = path if path.is_dir() else path.parent
    plots.write_plots(rows, directory, out)
    ablations.write_forest_plots(ablations.judge_ablations(rows), directory, out)


def print_query(query, out):
    """Prints the result of an SQL query on the rows of results/ as a table of Markdown."""
    database = RowDatabase()
    database.add_directories(ROOT / "results")
    names, found = database.query(query)
    if not found:
        print("no rows", file=out)
        return
    for line in [names, ["---"] * len(names), *found]:
        cells = (cell if isinstance(cell, str) else to_json(cell) for cell in line)
        print("| " + " | ".join(cells) + " |", file=out)


def add_command(subparsers):
    from . import page  # which imports this module
    parser = subparsers.add_parser(
        "report", help="print tables of the rows of earlier runs; fill or check the numbers of the pages")
    parser.add_argument("directory", metavar="DIR", nargs="?", type=pathlib.Path,
                        help="directory with rows.jsonl, or such a file")
    parser.add_argument("--format", choices=["md", "csv", "tex", "plots", "html"], default="md",
                        help="plots draws those of the rows into DIR; html writes DIR/report.html, a page "
                        "with tables, figures and meshes that needs no network (default: md)")
    parser.add_argument("--meshes", type=page.mesh_count, help="meshes of DIR/meshes in the page of html: "
                        f"all, none, or a number of those of the first tables (default: {page.USUAL_MESHES})")
    action = parser.add_mutually_exclusive_group()
    action.add_argument("--fill", action="store_true",
                        help="write the numbers of results/ into the pages and results/*/table.md")
    action.add_argument("--check", action="store_true",
                        help="list the numbers of these that the rows do not give; if any, exit code 3")
    action.add_argument("--query", metavar="SQL",
                        help="print the result of a query on the rows of results/: each directory is a table "
                        "(experiments/lab/database.py lists the columns)")
    action.add_argument("--stale", action="store_true",
                        help="run a sample of the cells of results/*, or only of results/DIR, again with "
                        "this program and list different results; if any, exit code 3")
    parser.set_defaults(function=functools.partial(run, parser=parser))


def run(arguments, parser):
    """Runs the command; `parser` reports options that do not go together."""
    from . import page, pages, stale  # which import this module
    others = arguments.fill or arguments.check or arguments.query
    if not (arguments.directory or others or arguments.stale):
        parser.error("DIR, --query, --fill, --check or --stale is required")
    if arguments.directory and others:
        parser.error("DIR excludes --query, --fill and --check")
    if arguments.meshes is not None and arguments.format != "html":
        parser.error("--meshes has no effect without --format html")
    if arguments.stale:
        return stale.run(arguments)
    if arguments.fill:
        for file in pages.fill(ROOT):
            print(f"filled {file}")
    elif arguments.check:
        problems = pages.check(ROOT)
        print("\n".join(problems) or "all numbers of the pages come from the rows")
        return 3 if problems else 0
    elif arguments.query:
        print_query(arguments.query, sys.stdout)
    elif arguments.format == "html":
        page.write_page(arguments.directory, arguments.meshes, sys.stdout)
    elif arguments.format == "plots":
        write_plots(read_rows(arguments.directory), arguments.directory, sys.stdout)
    else:
        report = {"md": markdown_report, "csv": csv_text, "tex": latex_report}[arguments.format]
        sys.stdout.write(report(plots.as_asked_today(read_rows(arguments.directory), arguments.directory)))
    return 0
