"""Metamorphic relations: the measurement `trial_relations`.

A solid is changed in a way whose effect on the result is known although the result is not: it is scaled by a
power of two, moved by whole voxels, turned by a symmetry of the cube, and so on. Some changes must give
the same result to the last bit; for the others the distance between the two meshes has an upper bound.
Distances and volumes are those of `hermesh validate`.
"""

import concurrent.futures
import json
import pathlib
import random as python_random
import subprocess
import tempfile
import zlib

import numpy
from scipy.spatial.transform import Rotation

from . import polygons, solids
from .damage import write_mesh
from .rows import LabError
from .stale import measured_table

UNIT = 2.0**-16  # of the coordinates of solids, whose longest side is then 2
VOXEL = 2.0**-4
MOST_SECONDS = 600
# Method: words of the command, and what is stated of it: "tables" and "uniform" meshes depend on the
# samples alone; OpenVDB's voxelizer, "other", has absolute tolerances and visits triangles in their order;
# "tolerance" is 0.1 voxel from the uniform mesh; "free" has no stated bound.
METHODS = {
    "marching-cubes": (["--extractor", "marching-cubes"], "tables"),
    "dual-contouring": (["--extractor", "dual-contouring"], "uniform"),
    "openvdb": (["--extractor", "openvdb"], "tables"),
    "exact": (["--voxelizer", "exact", "--extractor", "dual-contouring"], "uniform"),
    "OpenVDB's voxelizer": (["--voxelizer", "openvdb", "--extractor", "dual-contouring"], "other"),
    "pseudo-normals": (["--voxelizer", "pseudo-normals", "--extractor", "dual-contouring"], "uniform"),
    "manifold-dual-contouring": (["--extractor", "manifold-dual-contouring"], "tolerance"),
    "thin parts dropped": (["--thin", "drop"], "tolerance"),
    "certified-octree": (["--extractor", "certified-octree"], "tolerance"),
    "adaptive-dual-contouring": (["--extractor", "adaptive-dual-contouring"], "free"),
    "thesis": (["--voxelizer", "thesis", "--extractor", "adaptive-dual-contouring"], "free")}


class Failed(Exception):
    """A command failed; the text is its last line."""


class Bench:
    """Runs commands in a directory."""

    def __init__(self, program, directory):
        self.program, self.directory = program, pathlib.Path(directory)

    def run(self, *words, threads=1):
        ended = subprocess.run([self.program, *map(str, words), "--threads", str(threads)],
                               cwd=self.directory, capture_output=True, text=True, timeout=MOST_SECONDS)
        if ended.returncode not in (0, 3):
            raise Failed((ended.stderr.strip() or "no message").splitlines()[-1][:200])
        return ended

    def write(self, name, points, triangles, unit=UNIT):
        write_mesh(self.directory / name, points, triangles, unit)
        return name

    def remesh(self, mesh, words, voxel=VOXEL, unit=UNIT, threads=1):
        """Returns the corners of the remeshed solid in a fixed order, and its file."""
        number = len(list(self.directory.iterdir()))
        source, out = self.write(f"in{number}.off", *mesh, unit), f"out{number}.ply"
        self.run("remesh", source, out, "--voxel-size", repr(voxel), "--quiet", "--max-loss", "100%", *words,
                 threads=threads)
        return in_order(polygons.read(self.directory / out)[0]), out

    def measures(self, mesh, reference=None):
        """Returns the report of a mesh."""
        words = ["--reference", reference, "--samples", "2000", "--solid-samples", "1"] if reference else []
        return json.loads(self.run("validate", mesh, "--json", *words).stdout)

    def apart(self, first, second):
        """Returns the two-sided distance between two meshes, in voxels."""
        report = self.measures(first, second)
        return max(report["to_reference"]["max"], report["from_reference"]["max"]) / VOXEL


def in_order(corners):
    """Returns triangles in an order that depends on their coordinates only."""
    ranks = numpy.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)[1].reshape(-1, 3)
    first = ranks.argmin(1)
    turned = numpy.take_along_axis(corners, ((first[:, None] + numpy.arange(3)) % 3)[:, :, None], 1)
    return turned[numpy.lexsort(turned.reshape(len(turned), 9).T[::-1])]


# ---- Relations of remesh. Each returns (same, apart): if the meshes are the same to the last bit, and their
# distance in voxels. `apart` is computed if they are not the same.

def scaled(bench, mesh, words, random):
    factor = 2.0**random.choice([-8, -3, 5, 17])
    one = bench.remesh(mesh, words)
    other, _ = bench.remesh(mesh, words, VOXEL * factor, UNIT * factor)
    return _compared(bench, one, (other / factor, _written(bench, other / factor)))


def _compared(bench, one, other):
    same = len(one[0]) == len(other[0]) and bool((one[0] == other[0]).all())
    return same, 0.0 if same else bench.apart(one[1], other[1])


def threads(bench, mesh, words, random):
    one, other = bench.remesh(mesh, words), bench.remesh(mesh, words, threads=3)
    return _compared(bench, one, other)


def shifted(bench, mesh, words, random):
    steps = random.integers(-20, 21, 3)
    one = bench.remesh(mesh, words)
    _, out = bench.remesh((mesh[0] + numpy.rint(steps * VOXEL / UNIT).astype(int), mesh[1]), words)
    corners = polygons.read(bench.directory / out)[0] - steps * VOXEL
    return _compared(bench, one, (in_order(corners), _written(bench, corners)))


def _written(bench, corners):
    """Writes triangles as a mesh."""
    name = f"changed{len(list(bench.directory.iterdir()))}.off"
    points, numbers = numpy.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    return bench.write(name, points, numbers.reshape(-1, 3), 1.0)


def turned(bench, mesh, words, random):
    axes = numpy.eye(3, dtype=int)[random.permutation(3)] * random.choice([-1, 1], 3)
    mirrored = numpy.linalg.det(axes) < 0
    one = bench.remesh(mesh, words)
    other = mesh[0] @ axes, mesh[1][:, ::-1] if mirrored else mesh[1]
    _, out = bench.remesh(other, words)
    corners = polygons.read(bench.directory / out)[0] @ axes.T
    corners = corners[:, ::-1] if mirrored else corners
    return _compared(bench, one, (in_order(corners), _written(bench, corners)))


def renumbered(bench, mesh, words, random):
    order = random.permutation(len(mesh[0]))
    triangles = numpy.argsort(order)[random.permutation(mesh[1])]
    triangles = numpy.stack([numpy.roll(each, random.integers(3)) for each in triangles])
    return _compared(bench, bench.remesh(mesh, words), bench.remesh((mesh[0][order], triangles), words))


def split(bench, mesh, words, random):
    """Divides a third of the triangles at points on them: the solid is the same."""
    points, triangles = mesh
    chosen = random.random(len(triangles)) < 1 / 3
    a, b, c = triangles[chosen].T
    # Corners are multiples of 4, so a + (b - a + c - a) / 4 is a whole number, and lies in the triangle.
    middle = points[a] + (points[b] - points[a] + points[c] - points[a]) // 4
    new = len(points) + numpy.arange(len(middle))
    parts = [numpy.stack(part, 1) for part in ((a, b, new), (b, c, new), (c, a, new))]
    other = numpy.concatenate([points, middle]), numpy.concatenate([triangles[~chosen], *parts])
    return _compared(bench, bench.remesh(mesh, words), bench.remesh(other, words))


def far_body(bench, mesh, words, random):
    """Adds a cube at a distance: nothing else changes."""
    cube = solids._cells(numpy.ones((3, 3, 3), bool))
    away = 4 * solids.EXTENT * random.choice([-1, 1], 3)
    other = solids.joined(mesh, ((cube[0] * solids.EXTENT / 16 + away).astype(int), cube[1]))
    one = bench.remesh(mesh, words)
    _, out = bench.remesh(other, words)
    corners = polygons.read(bench.directory / out)[0]
    corners = corners[numpy.abs(corners).max((1, 2)) < 2.5 * solids.EXTENT * UNIT]
    return _compared(bench, one, (in_order(corners), _written(bench, corners)))


def finer(bench, mesh, words, random):
    """Halves the voxels: the distance from the polygons does not grow. Returns its growth."""
    apart = []
    for voxel in (VOXEL, VOXEL / 2):
        source = bench.write("source.off", *mesh)
        apart.append(bench.apart(bench.remesh(mesh, words, voxel)[1], source))
    return apart[1] <= apart[0], max(0.0, apart[1] - apart[0])


# By relation: its function, and the largest distance that is allowed for each kind of method, in voxels
# (otherwise 0). Two meshes within a tenth of a voxel of the same uniform mesh are at most a fifth apart. A
# turned cell may be triangulated differently: with a table up to its diagonal apart, in dual contouring where
# quads are not plane.
_EXACT, _ANY = {"uniform": 1e-4, "tables": 1e-4}, {"tolerance": 0.2, "other": 0.25, "free": 1.0}
RELATIONS = {
    "number of threads": (threads, {}), "scale by a power of two": (scaled, {"other": 0.25}),
    "order of triangles and vertices": (renumbered, {"other": 0.25, "free": 1.0}),
    "shift by whole voxels": (shifted, _ANY | _EXACT), "far body added": (far_body, _ANY),
    "triangles divided": (split, _ANY | _EXACT),
    "symmetry of the cube": (turned, {"tables": 1.74, "uniform": 0.25, "other": 0.25, "tolerance": 0.45,
                                      "free": 1.0}),
    "voxels halved": (finer, {"tables": 0.05, "uniform": 0.05, "other": 0.05, "tolerance": 0.1,
                              "free": 1.0})}


# ---- Relations of other commands. Each yields (what, error in voxels): volumes are compared per area.

def _volume(bench, file):
    if not (bench.directory / file).exists():
        return 0.0, 0.0
    report = bench.measures(file)
    return report["volume"], report["area"]


def boolean(bench, mesh, words, random):
    """The laws of Boolean algebra, for volumes."""
    a = bench.write("a.off", *mesh)
    b = bench.write("b.off", mesh[0] + random.integers(-8, 9, 3) * solids.EXTENT // 32, mesh[1])
    sizes = {}
    for name, operation in (("a or b", ("union", a, b)), ("b or a", ("union", b, a)),
                            ("a and b", ("intersection", a, b)), ("a without b", ("difference", a, b)),
                            ("b without a", ("difference", b, a)), ("a or a", ("union", a, a)),
                            ("a and a", ("intersection", a, a))):
        out = name.replace(" ", "_") + ".ply"
        try:
            bench.run("combine", *operation, out, "--voxel-size", repr(VOXEL), "--quiet")
        except Failed:
            pass  # the result is empty
        sizes[name] = _volume(bench, out)
    whole, area = _volume(bench, bench.remesh(mesh, [])[1])
    v = {name: volume for name, (volume, _) in sizes.items()}
    yield "union commutes", abs(v["a or b"] - v["b or a"]) / area / VOXEL
    yield "volumes of union and intersection", abs(v["a or b"] + v["a and b"] - 2 * whole) / area / VOXEL
    yield "parts of a", abs(v["a without b"] + v["a and b"] - whole) / area / VOXEL
    yield "parts of the union", \
        abs(v["a without b"] + v["b without a"] + v["a and b"] - v["a or b"]) / area / VOXEL
    yield "a or a is a", abs(v["a or a"] - whole) / area / VOXEL
    yield "a and a is a", abs(v["a and a"] - whole) / area / VOXEL


def pieces(bench, mesh, words, random):
    """The pieces of a fracture are the solid."""
    source = bench.write("solid.off", *mesh)
    bench.run("fracture", source, "pieces", "--voxel-size", repr(VOXEL), "--cutters", "chunks:6", "--seed",
              str(random.integers(1000)), "--quiet")
    whole, area = _volume(bench, bench.remesh(mesh, [])[1])
    total = sum(_volume(bench, f"pieces/{file.name}")[0]
                for file in (bench.directory / "pieces").iterdir() if file.suffix == ".ply")
    yield "volume of the pieces", abs(total - whole) / area / VOXEL


def bounds(bench, mesh, words, random):
    """Each error bounds the distance; a smaller one needs at least 95 % as many triangles as the last."""
    source, last = bench.write("solid.off", *mesh), 0
    for error in (4 * VOXEL, 2 * VOXEL, VOXEL):
        bench.run("remesh", source, "bounded.ply", "--error", repr(error), "--quiet")
        apart = bench.apart("bounded.ply", source) * VOXEL / error
        count = len(polygons.read(bench.directory / "bounded.ply")[0])
        yield "distance within the error", max(0.0, apart - 1)
        yield "triangles of a smaller error", max(0.0, 0.95 * last - count)
        last = count


COMMANDS = {"combine": (boolean, 0.05), "fracture": (pieces, 0.05), "--error": (bounds, 0.0)}


# ---- Cases

def generated(count):
    """Yields names and solids: random turns and stretches of solids in closed form."""
    forms = list(solids._closed_form())
    for number in range(count):
        random = numpy.random.default_rng([7, number])
        name, (points, triangles) = forms[number % len(forms)]
        turn = Rotation.random(random_state=python_random.Random(number).randrange(2**31)).as_matrix()
        stretch = numpy.diag(random.uniform(0.6, 1.4, 3))
        yield f"{name} {number}", solids.on_lattice(points @ stretch @ turn, triangles)


def check(program, relation, method, name, mesh):
    """Returns [(what, same, value)] of one case, or the message of a failure."""
    random = numpy.random.default_rng(zlib.crc32(f"{relation}/{method}/{name}".encode()))
    with tempfile.TemporaryDirectory() as directory:
        bench = Bench(program, directory)
        try:
            if relation in RELATIONS:
                same, value = RELATIONS[relation][0](bench, mesh, METHODS[method][0], random)
                return [(relation, same, float(value))]
            return [(what, value == 0, float(value))
                    for what, value in COMMANDS[relation][0](bench, mesh, [], random)]
        except (Failed, subprocess.TimeoutExpired) as error:
            return f"fails: {error}"


def measure(parameters, wants, program, progress):
    """Yields a row for each relation and method."""
    hermesh = program.file.with_name("hermesh")
    count, more = int(parameters["models"]), int(parameters["generated"])
    meshes = None
    cells = [(relation, method, bounds_of.get(kind, 0.0)) for relation, (_, bounds_of) in RELATIONS.items()
             for method, (_, kind) in METHODS.items()]
    cells += [(command, "", bound) for command, (_, bound) in COMMANDS.items()]
    for relation, method, bound in cells:
        label = f"{relation}, {method}" if method else relation
        if not wants(label):
            continue
        if meshes is None:
            meshes = dict(list(solids.all_solids(hermesh).items())[-count:]) | dict(generated(more))
            if not meshes:
                raise LabError("there is no solid")
        progress(label)
        with concurrent.futures.ProcessPoolExecutor(program.description["threads"]) as pool:
            results = list(pool.map(check, *zip(*[(hermesh, relation, method, name, mesh)
                                                  for name, mesh in meshes.items()])))
        values = {"cases": len(meshes), "same": 0, "failed": 0, "worst": 0.0, "bound": bound}
        broken = []
        for name, result in zip(meshes, results):
            if isinstance(result, str):
                values["failed"] += 1
                broken.append(f"{name}: {result}")
                continue
            values["same"] += all(same for _, same, _ in result)
            what, _, worst = max(result, key=lambda each: each[2])
            values["worst"] = max(values["worst"], worst)
            if worst > bound:
                broken.append(f"{name}: {what}, {worst:.4g}")
        values |= {"violations": len(broken), "first_mistake": broken[0] if broken else ""}
        yield label, values, broken


MEASUREMENT = {
    "name": "trial_relations", "measure": measure, "table": "relations",
    "parameters": [{"name": name, "default": default, "minimum": 0, "maximum": 1000, "help": text}
                   for name, default, text in (("models", 20, "number of models and solids in closed form"),
                                               ("generated", 2, "number of generated solids"))],
    "shown": measured_table("metamorphic relations", "relation", {
        "cases": "solids, each changed once",
        "same": "of these, those with the same result, to the last bit",
        "worst, worst, voxels": "largest distance between the results, or error of a volume per area",
        "bound, bound, voxels": "largest value that is allowed",
        "failed": "cases in which a command fails", "violations": "cases beyond the bound, or failed",
        "first_mistake, first violation": "solid, and its value"})}
