"""The page of results (`report --format html`): one HTML file that shows rows and needs no network."""

import argparse
import base64
import collections
import hashlib
import math
import pathlib
import re
import sys
import zlib

import numpy

from . import child, experiment, plots, program, tables
from .rows import (LabError, cell_text, find, latest_groups, number_at, own_columns, read_rows, readable,
                   text_at, to_json, value_of)

PARTS = pathlib.Path(__file__).parent / "page"
USUAL_MESHES = 10
_TABLE = ("/experiment", "/tier", "/case/name", "/resolution", "/voxelization/label", "/sweep/parameter")


# ---- Tables and histories. They refer to rows by number; `number` has the number of each id(row).


def page_data(rows):
    """Returns what the page's script shows: rows, tables, figures and histories, as one object."""
    number = {id(row): i for i, row in enumerate(rows)}
    groups = (group for group in latest_groups(rows) if tables.is_printed(group.rows))
    return {"rows": rows, "tables": [_table(group, number) for group in groups],
            "figures": figures_of(rows, number), "histories": _histories(rows, number)}


def _columns(columns):
    return [{"header": column.header, "meaning": column.meaning, "pointer": column.pointer}
            for column in columns]


def _table(group, number):
    first, columns = group.rows[0], tables.shown_columns(group.rows)
    lines = [{"row": number[id(row)], "label": text_at(row, "/variant/label"),
              "trouble": tables.alarms(row), "cells": [_cell(column, row) for column in columns]}
             for row in group.rows]
    return {"experiment": text_at(first, "/experiment"), "tier": text_at(first, "/tier"),
            "question": text_at(first, "/question"), "title": tables.group_title(first),
            "facts": tables.group_facts(group), "sentences": tables.stage_sentences(group),
            "earlier": group.earlier_runs, "first_column": tables.first_column(first),
            "columns": _columns(columns), "rows": lines}


def _cell(column, row):
    """Returns None, a text, or [text, number]."""
    value = value_of(column, row)
    if plots.as_number(value) is not None:
        return [cell_text(column, row), value]
    return value if value is None else cell_text(column, row) if isinstance(value, str) else to_json(value)


def _histories(rows, number):
    """Returns the tables with cells of which several runs have a row."""
    found = collections.defaultdict(list)
    for row in rows:
        found[tuple(text_at(row, part) for part in _TABLE)].append(row)
    histories = (_history(own, number) for own in found.values())
    return [history for history in histories if history["series"]]


def _history(rows, number):
    runs, series = collections.defaultdict(list), collections.defaultdict(list)
    for row in rows:
        runs[text_at(row, "/run")].append(row)
    in_order = sorted(runs.values(), key=lambda own: text_at(own[0], "/date"))
    columns = tables.shown_columns(rows[-1:])
    for at, own in enumerate(in_order):
        places = collections.Counter()  # of rows that agree in their label
        for row in own:
            label = _history_label(row)
            places[label] += 1
            if places[label] > 1:
                label += f" ({places[label]})"
            cells = [plots.as_number(value_of(column, row)) for column in columns]
            series[label].append({"row": number[id(row)], "run": at, "cells": cells})
    several = [(label, points) for label, points in series.items() if len(points) > 1]
    return {"title": tables.group_title(rows[-1]), "experiment": text_at(rows[-1], "/experiment"),
            "tier": text_at(rows[-1], "/tier"), "columns": _columns(columns),
            "runs": [{"date": text_at(own[0], "/date"), "cpu": text_at(own[0], "/machine/cpu"),
                      "commit": text_at(own[0], "/commit"), "dirty": find(own[0], "/dirty") is True}
                     for own in in_order],
            "series": [{"label": label, "style": i, "points": points}
                       for i, (label, points) in enumerate(several)]}


def _history_label(row):
    label = text_at(row, "/variant/label")
    if find(row, "/sweep"):
        label += f", {text_at(row, '/sweep/parameter')} {text_at(row, '/sweep/value')}"
    for name, pointer in (("voxel", "/nominal_voxel_size"), ("resolution", "/values/resolution"),
                          ("threads", "/values/threads")):
        if find(row, pointer) is not None:
            label += f", {name} {text_at(row, pointer)}"
    return label


# ---- Figures


def figures_of(rows, number):
    """Returns the figures of the latest rows: plots that they ask for, and those that suit every experiment.

    A figure is of the kind "curves", or "dots" with a line for each row and the labels to the left. Its
    points are [row, x, y, low, high] with the ends of the interval of y (in "dots" of x). `style` numbers the
    labels of an experiment, `front` asks for a line through points that no other one beats in x and y.
    """
    figures = []
    for name, own, asked in plots.plotted_rows(rows):
        styles = {}
        for figure in _figures_of_experiment(own, asked):
            series = collections.defaultdict(list)
            for label, row, *point in figure.pop("points"):
                series[label].append([number[id(row)], *point])
            figures.append({"experiment": name, **figure, "series": [
                {"label": label, "style": styles.setdefault(label, len(styles)), "points": points}
                for label, points in series.items()]})
    return figures


def _figure(kind, title, points, x_label, y_label="", **flags):
    """`points` are (label, row, x, y, low, high)."""
    return {"kind": kind, "title": title, "x_label": x_label, "y_label": y_label, "points": points,
            "log_x": False, "log_y": False, "zero_y": False, "lines": False, "front": False, **flags}


def _figures_of_experiment(rows, asked):
    yield from _asked_figures(asked, rows)
    runs = [row for row in rows if find(row, "/measurement") is None and find(row, "/sweep") is None]
    extractions = [row for row in runs if find(row, "/band") is None]
    for group in _grouped(extractions, True):
        points = _triangles_and_error(group)
        if len(points) > 1 and not _is_shown(asked, "triangles", "to_rms", group[0]):
            title = f"Triangles and distance to the input, {_subject(group[0], extractions, True)}"
            yield _figure("curves", title, points, "triangles", "rms distance to the input [voxel]",
                          log_x=True, log_y=True, front=True)
    scaled = set()
    for group in _grouped(runs, False):
        points, x_label = _time_and_size(group)
        if any(a[0] == b[0] and a[2] != b[2] for a, b in zip(points, points[1:])):
            scaled.add(_group_key(group[0], False))
            if not _is_shown(asked, "active_voxels", "seconds", group[0]):
                yield _figure("curves", f"Time and size, {_subject(group[0], runs, False)}", points, x_label,
                              "time [s]", log_x=True, log_y=True, lines=True)
    for group in _grouped(runs, True):
        is_scaled = find(group[0], "/band") is not None and _group_key(group[0], False) in scaled
        points = [] if is_scaled else _times(group)
        if len({point[0] for point in points}) > 1:
            yield _figure("dots", f"Time, {_subject(group[0], runs, True)}", points,
                          "time [s], median with the shortest and the longest repetition", log_x=True)
    for group in latest_groups(rows):
        yield from _intervals(group.rows)


def _asked_figures(asked, rows):
    for plot in asked:
        points, is_dots = [], plot["categories"]
        for curve in plots.curves_of(plot, rows):
            for point in curve.points:
                row, ends = rows[point.row], (point.low, point.high)
                if is_dots:  # what is compared lies along x
                    points.append((text_at(row, plots.label_pointer(plot)), row, point.y, 0, *ends))
                else:
                    points.append((curve.label, row, point.x, point.y, *ends))
        labels = (plot["y_label"], "") if is_dots else (plot["x_label"], plot["y_label"])
        flags = {"log_x": plot["log_y"]} if is_dots else {"log_x": plot["log_x"], "log_y": plot["log_y"]}
        flags |= {"note": plot["note"]} if plot["note"] else {}
        if points:
            yield _figure("dots" if is_dots else "curves", plot["title"], points, *labels, lines=True,
                          zero_y=not plot["log_y"], **flags)


def _is_shown(asked, x, y, row):
    """Returns True if a plot that was asked for shows these columns of the row's case."""
    return any(plot["x"] == x and plot["y"][0] == y and plot["case"] in ("", text_at(row, "/case/name"))
               and plot["resolution"] in (0, find(row, "/resolution")) for plot in asked)


def _group_key(row, with_resolution):
    parts = ["/tier", "/case/name", "/voxelization/label", "/resolution", "/nominal_voxel_size"]
    return tuple(text_at(row, part) for part in parts[:None if with_resolution else 3])


def _grouped(rows, with_resolution):
    groups = collections.defaultdict(list)
    for row in rows:
        groups[_group_key(row, with_resolution)].append(row)
    return groups.values()


def _subject(row, rows, with_resolution):
    """Returns e.g. "dragon at 400, voxelizer openvdb, full", with the tier only if the rows have several."""
    def differ(pointer):
        return any(text_at(other, pointer) != text_at(row, pointer) for other in rows)

    text = text_at(row, "/case/name")
    if with_resolution and find(row, "/resolution") is not None:
        text += f" at {text_at(row, '/resolution')}"
    if find(row, "/band") is None and differ("/voxelization/label"):
        text += f", voxelizer {text_at(row, '/voxelization/label')}"
    return text + (f", {text_at(row, '/tier')}" if differ("/tier") else "")


def _triangles_and_error(rows):
    found = [(text_at(row, "/variant/label"), row, plots.number_in("triangles", row),
              plots.number_in("to_rms", row), None, None) for row in rows]
    return [point for point in found if (point[2] or 0) > 0 and (point[3] or 0) > 0]


def _times(rows):
    """Returns the timed rows as points of a figure of dots, none if their table does not show the time."""
    if not any(column.name == "seconds" for column in tables.shown_columns(rows)):
        return []
    return [(text_at(row, "/variant/label"), row, seconds, 0, *plots.interval_of("seconds", row))
            for row in rows if (seconds := plots.number_in("seconds", row) or 0) > 0]


def _time_and_size(rows):
    """Returns the timed rows as points over their size, sorted by label and size, and what the size is."""
    done = [row for row in rows if find(row, "/failed") is None]
    has_voxels = all(plots.number_in("active_voxels", row) is not None for row in done)
    points = []
    for label, row, seconds, _, *ends in _times(rows):
        size = plots.number_in("active_voxels", row) if has_voxels else number_at(row, "/resolution")
        if (size or 0) > 0:
            points.append((label, row, size, seconds, *ends))
    labels = [point[0] for point in points]
    points.sort(key=lambda point: (labels.index(point[0]), point[2]))
    return points, "active voxels" if has_voxels else "resolution"


def _intervals(rows):
    """Yields a figure of each column of a measurement that has NAME_low and NAME_high, or is a slope."""
    columns = own_columns(rows[0])
    names = {column.name for column in columns}
    for column in columns:
        has_ends = {column.name + "_low", column.name + "_high"} <= names
        if column.name.endswith(("_low", "_high")) or not (has_ends or "slope" in column.name):
            continue
        found = ((row, plots.as_number(value_of(column, row))) for row in rows)
        points = [(text_at(row, "/variant/label"), row, value, 0, *plots.interval_of(column.name, row))
                  for row, value in found if value is not None]
        if points:
            yield _figure("dots", f"{tables.group_title(rows[0])}, {column.header}", points,
                          column.header + (" with its interval" if has_ends else ""))


# ---- Meshes that a run wrote: meshes/EXPERIMENT-CASE-RESOLUTION[-VOXELIZER]/NUMBER-LABEL.ply


def mesh_count(text):
    """Returns the number of meshes that "all", "none" or a number means. Raises ArgumentTypeError."""
    if text in ("all", "none"):
        return sys.maxsize if text == "all" else 0
    if not re.fullmatch("[0-9]{1,9}", text):
        raise argparse.ArgumentTypeError(f"expected all, none or a number of meshes, not '{text}'")
    return int(text)


def page_meshes(directory, rows, count, notes):
    """Returns (head, packed mesh) of the chosen meshes under the directory; adds what is left out to `notes`.

    Those of one directory are the methods that a table compares. Directories are chosen as a whole, in the
    order of the rows, except that the first may be too large: then its first methods are chosen.
    """
    chosen, total = _chosen_meshes(_mesh_files(directory, rows), count)
    if len(chosen) < total:
        notes.append(f"{total - len(chosen)} of the {total} meshes are not in the page, which has those of "
                     "the first tables; --meshes all, or a larger number, adds more")
    meshes, distances = [], _distances(rows, chosen)
    for file, row in chosen:
        name = f"{file.parent.name}/{file.name}"
        far, reason = distances.get(file, (None, "no row is of this mesh"))
        try:
            voxel_size = 0 if row is None else number_at(rows[row], "/voxel_size")
            head, packed = pack_mesh(*read_ply(file), voxel_size, far)
        except (LabError, OSError) as error:
            notes.append(f"{name} is not in the page: {error}")
            continue
        head |= {"group": file.parent.name if row is None else tables.group_title(rows[row]),
                 "label": file.name if row is None else text_at(rows[row], "/variant/label"),
                 "file": name, "row": row, "sentence": reason}
        meshes.append((head, packed))
    return meshes


def _mesh_files(directory, rows):
    """Returns a list of (file, number of its row or None) for each directory, in the order of the rows."""
    row_of, groups = {}, collections.defaultdict(list)
    for i, row in enumerate(rows):
        case, voxelizer, label = (experiment.file_name(text_at(row, part)) for part in (
            "/case/name", "/voxelization/label", "/variant/label"))
        group = f"{text_at(row, '/experiment')}-{case}-{text_at(row, '/resolution')}"
        row_of[group, label] = row_of[f"{group}-{voxelizer}", label] = i
    for file in sorted(pathlib.Path(directory).rglob("meshes/*/*.ply")):
        number, label = re.fullmatch(r"(\d*)-?(.*)\.ply", file.name, re.DOTALL).groups()
        row = row_of.get((file.parent.name, label)) if number else None
        groups[file.parent].append((row is None, int(number or 0), file, row))
    ordered = sorted(map(sorted, groups.values()), key=lambda group: (group[0][0], group[0][3] or 0))
    return [[(file, row) for _, _, file, row in group] for group in ordered]


def _chosen_meshes(groups, count):
    chosen = []
    for group in groups:
        if len(chosen) + len(group) <= count or not chosen:
            chosen += group[:count]
    return chosen, sum(map(len, groups))


def _distances(rows, chosen):
    """Returns {file: (distances of its vertices to the input in world units or None, why there are none)}.

    The program measures those of all meshes of an input at once, after it has checked the input's hash.
    """
    files, found = collections.defaultdict(list), {}
    for file, row in chosen:
        if row is not None and find(rows[row], "/voxel_size"):
            files[text_at(rows[row], "/case/name"), text_at(rows[row], "/case/sha256")].append(file)
    for (case, sha256), own in files.items():
        try:
            runs = program.load_program()
            done = child.work(runs.command, {
                "kind": "distances", "case": case, "sha256": sha256, "require_data": False,
                "meshes": [str(file.resolve()) for file in own], "threads": runs.description["threads"]})
            reason = done.reason and f"the distances to {case} are unknown: the program {done.reason}"
        except (LabError, OSError) as error:
            reason = str(error)
        found |= dict.fromkeys(own, (None, reason)) if reason else {
            file: (numpy.array(far), "") for file, far in zip(own, done.distances)}
    return found


_HEADER = re.compile(rb"ply\nformat binary_little_endian 1.0\n(?:comment .*\n)*element vertex (\d+)\n"
                     rb"property (float|double) x\nproperty \2 y\nproperty \2 z\nelement face (\d+)\n"
                     rb"property list uchar u?int vertex_indices\nend_header\n")


def read_ply(file):
    """Returns vertices, triangles and quads of a mesh that a run wrote. Raises LabError for other files."""
    data = pathlib.Path(file).read_bytes()
    if not (header := _HEADER.match(data)):
        raise LabError("this is not a mesh that `hermesh run` writes")
    vertices, faces, scalar = int(header[1]), int(header[3]), "<f4" if header[2] == b"float" else "<f8"
    start = header.end() + 3 * vertices * int(scalar[-1])
    quads, rest = divmod(len(data) - start - 13 * faces, 4)  # 13 bytes for a triangle, 17 for a quad
    if rest or not 0 <= quads <= faces:
        raise LabError("the file has another size than its header states")
    polygons, at = [], start
    for corners, count in ((3, faces - quads), (4, quads)):
        own = numpy.frombuffer(data, [("corners", "u1"), ("vertices", "<u4", corners)], count, at)
        if not (own["corners"] == corners).all() or (count and own["vertices"].max() >= vertices):
            raise LabError("its polygons are not triangles followed by quads of its vertices")
        polygons.append(own["vertices"].astype(numpy.int64))
        at += own.nbytes
    return numpy.frombuffer(data, scalar, 3 * vertices, header.end()).astype(float).reshape(-1, 3), *polygons


def pack_mesh(points, triangles, quads, voxel_size, distances):
    """Returns the head of a mesh and its bytes in base64. `distances` are in world units, or None.

    The bytes, deflated by zlib, are: the x of all vertices, then y, then z, as whole numbers of steps from
    the box's lower corner; the vertices of the triangles, then of the quads; and the high bytes, then the low
    bytes of each vertex's distance, of which 65535 is the largest. Coordinates of an axis and vertices of
    polygons are differences to the one before, as integers of variable length with seven bits a byte, lowest
    first: 2 d, or -2 d - 1 for a negative d. A step is 1/256 voxel, or 2^-22 of the box's longest side if
    that is larger.
    """
    if not numpy.isfinite(points).all():
        raise LabError("a coordinate is not finite")
    lower = points.min(axis=0) if len(points) else numpy.zeros(3)
    longest = (points.max(axis=0) - lower).max() if len(points) else 0
    step = max(voxel_size / 256, math.ldexp(longest or 1, -22))
    steps = numpy.floor((points - lower) / step + 0.5).astype(numpy.int64)
    data = b"".join(map(_differences, (*steps.T, numpy.concatenate([triangles.ravel(), quads.ravel()]))))
    largest = None if distances is None else distances.max(initial=0) / voxel_size
    if distances is not None:
        levels = numpy.floor(65535 * distances / (distances.max(initial=0) or 1) + 0.5).astype(">u2")
        data += levels.view("u1").reshape(-1, 2).T.tobytes()
    head = {"points": len(points), "triangles": len(triangles), "quads": len(quads), "lower": lower.tolist(),
            "step": float(step), "voxel_size": voxel_size or None, "largest": largest}
    return head, base64.b64encode(zlib.compress(data, 6)).decode()


def _differences(values):
    """Returns the differences of whole numbers as integers of variable length."""
    steps = numpy.diff(values, prepend=0)
    codes = numpy.where(steps < 0, -2 * steps - 1, 2 * steps)[:, None]
    powers = 128 ** numpy.arange(6)
    parts = codes // powers % 128 + 128 * (codes >= 128 * powers)
    return parts[(codes >= powers) | (powers == 1)].astype(numpy.uint8).tobytes()


# ---- The file


def html_page(title, rows, meshes):
    """Returns the page as text. What rows contain is data: no browser runs it.

    A policy in the head of the page prevents the browser from loading anything, and from running any script
    other than the page's own, by its hash.
    """
    import jinja2  # the other commands do not need it
    style, script = _part("page.css"), "".join(map(_part, ("figures.js", "viewer.js", "page.js")))
    policy = (f"default-src 'none'; script-src {_hash(script)}; style-src {_hash(style)}; img-src data:; "
              "base-uri 'none'; form-action 'none'")
    data = page_data(rows) | {"made_by": program.checked_out()[0], "meshes": [head for head, _ in meshes]}
    template = jinja2.Environment(autoescape=True).from_string(_part("page.html"))
    return template.render(title=title, policy=policy, style=style, script=script,
                           data=to_json(data).replace("<", "\\u003c"),  # ends no element, opens no comment
                           meshes=[packed for _, packed in meshes])


def _part(name):
    return (PARTS / name).read_text()


def _hash(text):
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


def _baseline_rows(directory, rows):
    """Returns the rows of these experiments in directories `baselines` next to the directory and above it."""
    experiments = {text_at(row, "/experiment") for row in rows}
    known, found = set(map(to_json, rows)), []
    for baselines in (directory.parent / "baselines", directory.parent.parent / "baselines"):
        for row in read_rows(baselines) if any(baselines.rglob("*.jsonl")) else []:
            text = to_json(row)
            if text_at(row, "/experiment") in experiments and text not in known:
                known.add(text)
                found.append(row)
    return found


def write_page(path, count, out):
    """Writes report.html into the directory of rows, or next to the file of rows, and names it in `out`.

    The page has `count` meshes, None is the usual number. Baselines count as earlier runs. Raises LabError if
    there are no rows.
    """
    rows, path = read_rows(path), pathlib.Path(path)
    directory, notes = path if path.is_dir() else path.parent, []
    # Earlier runs come first, because a table shows its last run.
    rows = plots.as_asked_today(_baseline_rows(directory.resolve(), rows) + rows, directory)
    meshes = page_meshes(directory, rows, USUAL_MESHES if count is None else count, notes)
    page = html_page(f"hermesh: {directory.resolve().name}", rows, meshes)
    (directory / "report.html").write_text(page)
    for note in notes:
        print(f"Note: {note}", file=out)
    size = readable(len(page.encode()) / 2**20)
    print(f"Page: {directory / 'report.html'} ({len(rows)} rows, {len(meshes)} meshes, {size} MiB)", file=out)
