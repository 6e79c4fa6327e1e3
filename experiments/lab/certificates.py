"""Certificates on trial: the measurement `trial_certificates`.

Meshes are made within an error with a certificate, which validation/check_certificate.py must verify. Then
a mesh, the error or the certificate is changed so that a statement is false, or not proved any more; all of
these must be refused. Whether a change makes something false is decided here by distances between points and
triangles, in floating point and with a margin.
"""

import importlib.util
import os
import pathlib
import subprocess
import tempfile
import time
import zlib

import numpy

from . import solids
from .damage import write_mesh
from .rows import ROOT
from .stale import measured_table

MARGIN = 1.01  # by which a false statement exceeds the error
MOST_TRIES = 200
MOST_BYTES = 30e6  # of a file of $HERMESH_DATA
MOST_SECONDS = 60  # of a command; a mesh that takes longer is not made

_spec = importlib.util.spec_from_file_location("check_certificate", ROOT / "validation/check_certificate.py")
checker = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(checker)


class Certified:
    """A mesh with a certificate: source and output, each points and polygons, the header and the numbers."""

    def __init__(self, *files):
        self.source, self.output = map(checker.read, map(str, files[:2]))
        self.header, self.numbers = checker.read_certificate(files[2])
        self.error = self.header["error"]
        self.cuts = 3 * self.header["input_triangles"] if self.header["cuts"] else 0

    def state(self):
        return self.source, self.output, dict(self.header), list(self.numbers)

    def given(self):
        """Returns the corners of the triangles of the source."""
        cuts = [self.numbers[i:i + 3] for i in range(0, self.cuts, 3)] if self.cuts else None
        return self.source[0][checker.triangles_of(self.source[1], cuts)]

    def pieces(self):
        """Returns [(triangle, corners, target, position in the numbers)] of the output's and the input's."""
        at, found = self.cuts, []
        positions = iter(self._leaves())
        for name in ("output", "input"):
            other = "input" if name == "output" else "output"
            direction, _, at = checker.pieces(self.numbers, at, self.header[f"{name}_triangles"],
                                              self.header[f"{other}_triangles"])
            found.append([(*piece, next(positions)) for piece in direction])
        return found

    def _leaves(self):
        at = self.cuts
        while at < len(self.numbers):
            if self.numbers[at] > 1:
                yield at
            at += 4 if self.numbers[at] == 1 else 1


def distance(point, corners):
    """Returns the distance of a point from triangles."""
    points = numpy.broadcast_to(point, (len(corners), 3))
    weights = checker.weights_of_nearest(points, corners)
    return numpy.linalg.norm((weights[:, :, None] * corners).sum(1) - point, axis=1).min()


# ---- Changes. Each gets a state, which it may change, and returns it; None if the statement may still hold.

def moved_vertex(made, state, random):
    points = made.output[0].copy()
    vertex, way = random.integers(len(points)), random.normal(size=3)
    points[vertex] += way / numpy.linalg.norm(way) * made.error * random.uniform(2, 20)
    return (state[0], (points, made.output[1]), *state[2:]) \
        if distance(points[vertex], made.given()) > MARGIN * made.error else None


def moved_input(made, state, random):
    points = made.source[0].copy()
    used = random.choice(random.choice(numpy.array(made.source[1], object)))
    way = random.normal(size=3)
    points[used] += way / numpy.linalg.norm(way) * made.error * random.uniform(2, 20)
    output = made.output[0][numpy.array(made.output[1])]
    return ((points, made.source[1]), *state[1:]) \
        if distance(points[used], output) > MARGIN * made.error else None


def _polygons_changed(change):
    def changed(made, state, random):
        polygons = [list(polygon) for polygon in made.output[1]]
        polygons = change(polygons, random.integers(len(polygons)), random)
        header = state[2] | {"output_triangles": len(polygons)}
        return state[0], (made.output[0], polygons), header, state[3]
    return changed


def _flipped(polygons, which, random):
    polygons[which].reverse()
    return polygons


def _all_flipped(polygons, which, random):
    return [polygon[::-1] for polygon in polygons]


def _removed(polygons, which, random):
    return polygons[:which] + polygons[which + 1:]


def _duplicated(polygons, which, random):
    return [*polygons, polygons[which]]


def _other_corner(polygons, which, random):
    corner = random.integers(3)
    others = [p for p in {p for polygon in polygons for p in polygon} if p not in polygons[which]]
    polygons[which][corner] = others[random.integers(len(others))]
    return polygons


def crossing(made, state, random):
    """Moves a vertex through a triangle, so that edges intersect it, and permits any distance."""
    points, triangles = made.output[0].copy(), numpy.array(made.output[1])
    vertex, triangle = random.integers(len(points)), triangles[random.integers(len(triangles))]
    if vertex in triangle:
        return None
    a, b, c = points[triangle]
    around = triangles[(triangles == vertex).any(1)]
    middle, normal = (a + b + c) / 3, numpy.cross(b - a, c - a)
    apex = middle + 0.1 * normal / numpy.sqrt(numpy.linalg.norm(normal))
    for start in points[numpy.unique(around[around != vertex])]:
        if (start - middle) @ normal < 0:  # on the other side than the apex
            hit = numpy.linalg.solve(numpy.stack([b - a, c - a, start - apex], 1), start - a)
            if hit[:2].min() > 0.01 and hit[0] + hit[1] < 0.99 and 0 < hit[2] < 1:
                points[vertex] = apex
                error = 10 * float(numpy.linalg.norm(numpy.ptp(made.source[0], axis=0)))
                return state[0], (points, made.output[1]), state[2] | {"error": error}, state[3]
    return None


def lowered_bound(made, state, random):
    """States less than the distance of a vertex of the input."""
    output, points = made.output[0][numpy.array(made.output[1])], made.given().reshape(-1, 3)
    largest = distance(points[random.integers(len(points))], output)
    return (*state[:2], state[2] | {"error": float(largest / MARGIN)}, state[3]) \
        if largest > 0.01 * made.error else None


def _step(step):
    return 2 + (2 * step if step >= 0 else -2 * step - 1)


def exchanged(made, state, random):
    """Assigns one piece to another triangle, which is too far away."""
    side, numbers = random.integers(2), state[3]
    found, meshes = made.pieces()[side], (made.output[0][numpy.array(made.output[1])], made.given())
    which, target = random.integers(len(found)), int(random.integers(len(meshes[1 - side])))
    triangle, piece, old, at = found[which]
    corners = [numpy.array([x / sum(corner) for x in corner]) @ meshes[side][triangle] for corner in piece]
    if max(distance(p, meshes[1 - side][[target]]) for p in corners) < MARGIN * made.error:
        return None

    def follows(first, second):  # in the same block, whose steps begin at 0
        return found[first][0] // 256 == found[second][0] // 256

    before = found[which - 1][2] if which and follows(which - 1, which) else 0
    numbers[at] = _step(target - before)
    if which + 1 < len(found) and follows(which, which + 1):
        numbers[found[which + 1][3]] = _step(found[which + 1][2] - target)
    return state


def uncovered(made, state, random):
    found = made.pieces()[random.integers(2)]
    state[3][found[random.integers(len(found))][3]] = 0
    return state


def cut_short(made, state, random):
    return *state[:3], state[3][:random.integers(made.cuts, len(state[3]))]


CHANGES = {
    "vertex of the mesh moved": moved_vertex, "vertex of the input moved": moved_input,
    "triangle flipped": _polygons_changed(_flipped), "mesh inside out": _polygons_changed(_all_flipped),
    "triangle removed": _polygons_changed(_removed), "triangle twice": _polygons_changed(_duplicated),
    "other corner": _polygons_changed(_other_corner), "vertex through the mesh": crossing,
    "error lowered": lowered_bound, "piece assigned elsewhere": exchanged, "piece not assigned": uncovered,
    "certificate cut short": cut_short}


def is_refused(state):
    try:
        checker.verify(*state)
    except checker.Refused:
        return True
    return False


def sources(count, directory, hermesh):
    """Yields names and files: solids in closed form and of public models, then those of $HERMESH_DATA."""
    for name, (points, triangles) in solids.all_solids(hermesh).items():
        file = directory / f"{name.replace(' ', '_')}.off"
        write_mesh(file, points, triangles, 1.0 / solids.EXTENT)
        yield name, file
    folder = os.environ.get("HERMESH_DATA")
    for file in sorted(pathlib.Path(folder).iterdir()) if folder else []:
        if file.name.removesuffix(".gz").endswith((".off", ".obj", ".ply", ".stl")) \
                and file.stat().st_size < MOST_BYTES:
            yield file.name, file


def make(hermesh, file, directory, error, options=()):
    """Returns the files of a certified mesh and seconds; None if the program refuses the error or is slow."""
    files = file, directory / "output.ply", directory / "output.certificate"
    start = time.monotonic()
    try:
        subprocess.run([hermesh, "remesh", *files[:2], "--error", error, "--certificate", files[2], "--quiet",
                        *options], capture_output=True, check=True, timeout=MOST_SECONDS)
    except (subprocess.CalledProcessError, subprocess.TimeoutExpired):
        return None, time.monotonic() - start
    return files, time.monotonic() - start


def untampered(files, seconds):
    """Returns the values of a certified mesh, and what is wrong with it."""
    start = time.monotonic()
    try:
        found = checker.verify(checker.read(str(files[0])), checker.read(str(files[1])),
                               *checker.read_certificate(files[2]), 1.0)
        wrong = []
    except checker.Refused as error:
        found, wrong = {"pieces": 0, "uncovered_input": 0.0, "uncovered_output": 0.0}, [str(error)]
    checking = time.monotonic() - start
    sizes = [file.stat().st_size for file in files]
    return {"made": 1, "refused": len(wrong), "pieces": found["pieces"],
            "uncovered_input": found["uncovered_input"], "uncovered_output": found["uncovered_output"],
            "making_seconds": seconds, "checking_seconds": checking, "checking_ratio": checking / seconds,
            "size_ratio": sizes[2] / (sizes[0] + sizes[1])}, wrong


def measure(parameters, wants, program, progress):
    """Yields a row for each certified mesh, and for each kind of change."""
    hermesh, count, tampered = (program.file.with_name("hermesh"), int(parameters["models"]),
                                int(parameters["tampered"]))
    with tempfile.TemporaryDirectory() as scratch:
        directory, small = pathlib.Path(scratch), []
        for number, (name, file) in enumerate(sources(count, directory, hermesh)):
            if number == count:
                break
            # Scans take minutes at 0.3%.
            for error in ("1%", "0.3%") if file.parent == directory else ("1%",):
                label = f"{name}, {error}"
                if not wants(label):
                    continue
                progress(label)
                files, seconds = make(hermesh, file, directory, error)
                if not files:
                    yield label, {"made": 0, "making_seconds": seconds}, []
                    continue
                values, wrong = untampered(files, seconds)
                yield label, values | {"first_mistake": wrong[0] if wrong else ""}, wrong
        for name, file in list(sources(count, directory, hermesh))[:20]:
            files, _ = make(hermesh, file, directory, "1%")
            small += [Certified(*files)] if files else []
        for kind, change in CHANGES.items():
            if not wants(kind):
                continue
            progress(kind)
            random, accepted, done = numpy.random.default_rng(zlib.crc32(kind.encode())), [], 0
            for number in range(tampered):
                made = small[number % len(small)]
                states = (change(made, made.state(), random) for _ in range(MOST_TRIES))
                state = next((state for state in states if state), None)
                if state is None:
                    continue
                done += 1
                if not is_refused(state):
                    accepted.append(f"number {number}")
            yield kind, {"made": done, "refused": done - len(accepted),
                         "first_mistake": accepted[0] if accepted else ""}, accepted


MEASUREMENT = {
    "name": "trial_certificates", "measure": measure, "table": "certificates",
    "parameters": [{"name": name, "default": default, "minimum": 1, "maximum": 10000, "help": text}
                   for name, default, text in (("models", 20, "number of models"),
                                               ("tampered", 20, "false certificates of each kind"))],
    "shown": measured_table("certificates, and what the checker says of them", "mesh or change", {
        "made": "meshes with a certificate, or with one that was made false; 0: the error was refused, or "
                f"took more than {MOST_SECONDS} s",
        "refused": "of these, those that the checker refuses",
        "pieces": "pieces that are assigned to triangles",
        "uncovered_input, input not covered": "area of polygons that the certificate does not cover",
        "uncovered_output, mesh not covered": "the same of the mesh",
        "making_seconds, making": "seconds of remesh with --certificate",
        "checking_seconds, checking": "seconds of the check",
        "checking_ratio, checking / making": "their ratio",
        "size_ratio, size": "bytes of the certificate, divided by those of both meshes",
        "first_mistake, first mistake": "what was wrong"})}
