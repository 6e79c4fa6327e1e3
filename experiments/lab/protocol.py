"""The protocol between the benchmark and any program (PROTOCOL.md), and the checks of claims."""

import json
import math
import os

from . import polygons
from .rows import shown

TASKS = ("remesh", "simplify", "combine", "fracture")
NOT_INSTALLED = 77  # exit code of an adapter whose program is not installed
# Counts of `hermesh validate` that must be 0.
CLAIMS = {"watertight": ("boundary_edges", "inconsistent_edges"),
          "manifold": ("non_manifold_edges", "non_manifold_vertices"),
          "intersection_free": ("self_intersecting_pairs",)}
DISTANCES = {"distance_to_input": "to_reference", "distance_from_input": "from_reference"}
ROUNDING = 1e-6  # of the largest coordinate: more than two roundings to single precision
SLACK = 1e-6  # relative, of a claimed distance
# CPU time that a process may use outside the time that it claims: a start, and reading and writing files.
START_SECONDS, SECONDS_PER_MIB, CLOCK_SECONDS = 5.0, 1.0, 0.01


def write_request(directory, **values):
    """Writes request.json; returns its path and the environment with the same values as HERMESH_NAME."""
    name = "pieces" if values.get("task") == "fracture" else "out.ply"
    request = {"version": 1, **values, "output": f"{directory}/{name}",
               "result": f"{directory}/result.json"}
    path = f"{directory}/request.json"
    with open(path, "w") as file:
        json.dump(request, file)
    names = {f"HERMESH_{key.upper()}": str(value) for key, value in request.items() if value is not None}
    return path, request, {**os.environ, **names, "HERMESH_REQUEST": path}


def _check_number(name, value):
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not 0 <= value < math.inf:
        raise ValueError(f"{name} must be a number of at least 0, not {shown(repr(value))}")


def check_claims(claims):
    """Returns the claims without null. Raises ValueError for an unknown name or a value of the wrong type."""
    if not isinstance(claims, dict):
        raise ValueError("claims must be an object")
    for name, value in claims.items():
        if name not in CLAIMS | DISTANCES:
            raise ValueError(f"unknown claim '{shown(name)}'; expected {', '.join([*CLAIMS, *DISTANCES])}")
        if name in CLAIMS and not isinstance(value, bool | None):
            raise ValueError(f"claims.{name} must be true or false, not {shown(repr(value))}")
        if name in DISTANCES and value is not None:
            _check_number(f"claims.{name}", value)
    return {name: value for name, value in claims.items() if value is not None}


def read_result(path):
    """Returns the result that an adapter wrote. Raises ValueError if it is missing or malformed."""
    try:
        with open(path) as file:
            result = json.load(file)
    except FileNotFoundError:
        raise ValueError("no result was written to request.result") from None
    except (ValueError, OSError) as error:
        raise ValueError(f"the result is not JSON: {shown(error, 200)}") from None
    except RecursionError:
        raise ValueError("the result is nested too deeply to be read") from None
    if not isinstance(result, dict) or result.get("status") not in ("done", "refused"):
        raise ValueError("the status of the result must be done or refused")
    if result.get("seconds") is not None:
        _check_number("seconds", result["seconds"])
    claims = result.get("claims")
    return {**result, "claims": check_claims({} if claims is None else claims)}


def failed_claims(claims, seconds, ended, mib, report, scale, ask, model, output):
    """Returns the names of the claims that a measurement refutes.

    `mib` is the size of the input and output files, `report` that of `hermesh validate`, `scale` the largest
    coordinate of the input. ask(*arguments) returns the report of the output with other arguments.
    """
    failed = [name for name, counts in CLAIMS.items() if claims.get(name) and any(map(report.get, counts))]
    for name, key in DISTANCES.items():
        limit = claims.get(name, math.inf) * (1 + SLACK) + ROUNDING * scale
        if key in report and distance(report, key, limit, ask, model) > limit \
                and (key == "to_reference" or visible_distance(ask, model, output, scale, limit) > limit):
            failed.append(name)
    return failed + (["seconds"] if seconds is not None and is_false_time(seconds, ended, mib) else [])


def distance(report, key, limit, ask, model):
    """Returns the largest sampled distance in one direction. A polygon that is not flat has several
    triangulations; if the distance exceeds the limit, it is the smaller one of both.
    """
    largest = report[key]["max"]
    return largest if largest <= limit else \
        min(largest, ask(str(model), "--reference-quads", "as-given")[key]["max"])


def share_of_error(report, error, scale, ask, model):
    """Returns the larger one of both sampled distances divided by the error, at most 1 if the excess is
    within the allowance for rounding.
    """
    limit = error * (1 + SLACK) + ROUNDING * scale
    largest = max(distance(report, key, limit, ask, model) for key in DISTANCES.values())
    return largest / error if largest > limit else min(1.0, largest / error)


def is_false_time(seconds, ended, mib):
    """Returns True if a claimed wall time is longer than the measured one, or too short for the CPU time."""
    possible = seconds * (os.cpu_count() or 1) * 1.25 + START_SECONDS + SECONDS_PER_MIB * mib
    return seconds > 1.01 * ended.wall_seconds + CLOCK_SECONDS or ended.cpu_seconds > possible


def visible_distance(ask, model, output, scale, limit):
    """Returns a lower bound of the largest distance from visible points of the model to the output.

    It measures the distances of visible samples that may be farther than the limit; 0 without such samples.
    """
    try:
        points = polygons.distant_visible_points(*polygons.read(model), polygons.read(output)[0], limit)
    except ValueError:
        return 0.0  # a file that is not read here: the claim is not checked
    if not len(points):
        return 0.0
    # Triangles that are small compared with the rounding stand for the points.
    file, size = f"{output}.points.off", 0.1 * ROUNDING * scale
    corners = (points[:, None] + size * polygons.UNIT_TRIANGLE).reshape(-1, 3)
    faces = "".join(f"3 {i} {i + 1} {i + 2}\n" for i in range(0, len(corners), 3))
    with open(file, "w") as out:
        out.write(f"OFF\n{len(corners)} {len(points)} 0\n")
        out.writelines("%.17g %.17g %.17g\n" % tuple(corner) for corner in corners)
        out.write(faces)
    report = ask(file)
    return max(0.0, report["from_reference"]["max"] - 2 * size)
