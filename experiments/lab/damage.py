"""Damaged meshes for the validation: the measurement `trial_damage`, a matrix of what was done to meshes and
of what `hermesh validate` reports.

Each damage is checked by lattice.py, which shares no code with the program: the mesh must have exactly the
defects of its kind. The report is right if all its counts, pairs, angles, volumes and distances are those
that were computed independently, if it names the defects of the kind, and no others.
"""

import concurrent.futures
import dataclasses
import json
import pathlib
import subprocess
import tempfile
import zlib

import numpy
from scipy.spatial import cKDTree

from . import lattice, polygons, solids
from .lattice import COUNTS, PAIRS
from .rows import LabError
from .stale import measured_table

VOXEL = solids.VOXEL
SLIVER = 0.1  # degrees
SHARE = 0.003  # of the area: larger walls and parts must be found (validation/solid_comparison.h: 0.1 %, 1 %)
MOST_TRIES = 400
# Words of a report, in the order of the columns.
WORDS = ("boundary", "edges", "vertices", "orientation", "inside out", "intersections", "degenerate",
         "duplicate", "isolated", "sliver", "components", "distance", "other solid", "refused")


class Unsuitable(Exception):
    """The chosen part of the mesh is not suitable for the damage; another one is tried."""


@dataclasses.dataclass
class Damaged:
    points: numpy.ndarray
    triangles: numpy.ndarray
    reference: tuple = None  # a mesh that the damaged one is compared with
    other_solid: bool = None  # True, False, or None if the definition of the verdict decides
    moved: float = None  # largest distance to the reference, lattice units
    factor: float = 1.0  # of all coordinates
    text: tuple = None  # replacement in the file
    words: set = dataclasses.field(default_factory=set)  # of the report, in addition to those of the mesh


def words_of(counts, components):
    """Returns the words of a report or of facts; `components` is the number of the undamaged mesh."""
    pairs = counts.get("self_intersections", counts)
    found = {"boundary": counts["boundary_edges"], "edges": counts["non_manifold_edges"],
             "vertices": counts["non_manifold_vertices"], "orientation": counts["inconsistent_edges"],
             "inside out": counts["inside_out_components"], "intersections": sum(pairs[k] for k in PAIRS),
             "degenerate": counts["degenerate_polygons"], "duplicate": counts["duplicate_polygons"],
             "isolated": counts["isolated_points"], "sliver": counts["smallest_angle"] < SLIVER,
             "components": counts["components"] != components}
    return {word for word, present in found.items() if present}


# ---- Damages. Each gets points and triangles, which it may change, and a random generator.

def _patch(triangles, random, most=6):
    """Returns the numbers of triangles that are connected by edges."""
    chosen = [random.integers(len(triangles))]
    for _ in range(random.integers(most)):
        common = numpy.isin(triangles, triangles[random.choice(chosen)]).sum(axis=1) == 2
        chosen.append(random.choice(numpy.flatnonzero(common)))
    return numpy.unique(chosen)


def _edge(triangles, random):
    """Returns a random edge a, b, its triangle's third vertex, and the numbers of both of its triangles."""
    first = random.integers(len(triangles))
    a, b, c = numpy.roll(triangles[first], random.integers(3))
    other = numpy.flatnonzero((triangles == a).any(axis=1) & (triangles == b).any(axis=1))
    return a, b, c, first, other[other != first][0]


def _normal(points, triangle):
    a, b, c = points[triangle] + 0.0
    normal = numpy.cross(b - a, c - a)
    return normal / numpy.linalg.norm(normal)


def _added(points, triangles, new_points, new_triangles):
    return Damaged(*(numpy.concatenate([old, numpy.reshape(new, (-1, 3)).astype(int)])
                     for old, new in ((points, new_points), (triangles, new_triangles))))


def _outwards(points, triangles):
    """Returns a closed convex mesh that faces outwards."""
    return triangles if lattice.volume(points, triangles) > 0 else triangles[:, ::-1]


TETRAHEDRON = numpy.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
OCTAHEDRON = numpy.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]])
EIGHT = numpy.array([[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]])


def _whole(points):
    return numpy.rint(points).astype(numpy.int64)


def _satellite(points, triangles, random):
    """Returns a closed body away from a mesh, large enough to be found."""
    size = solids.EXTENT * random.uniform(0.08, 0.2)
    body = _whole(size * (OCTAHEDRON + random.uniform(-0.3, 0.3, (6, 3))))
    direction = random.normal(size=3)
    body = body + _whole(direction / numpy.linalg.norm(direction) * solids.EXTENT * random.uniform(1.1, 1.4))
    return body, _outwards(body, EIGHT)


def _area(points, triangles):
    return polygons.normals(points[triangles] + 0.0)[1].sum()


def _interior_point(points, triangles, random):
    """Returns a point inside and about its distance from the surface, the deepest of some random ones."""
    tree = cKDTree(polygons.samples(points[triangles] + 0.0, 20_000)[0])
    tries = _whole(random.uniform(points.min(axis=0), points.max(axis=0), (64, 3)))
    depths = tree.query(tries)[0]
    for at in numpy.argsort(-depths):
        if lattice.winding_number(tries[at], points, triangles) == 1:
            return tries[at], 0.95 * depths[at]
    raise Unsuitable


def hole(points, triangles, random):
    return Damaged(points, numpy.delete(triangles, _patch(triangles, random), axis=0))


def flip(points, triangles, random):
    chosen = _patch(triangles, random)
    triangles[chosen] = triangles[chosen][:, ::-1]
    return Damaged(points, triangles)


def inside_out(points, triangles, random):
    label = lattice.components(points, triangles)[triangles[:, 0]]
    is_chosen = label == random.choice(label)
    triangles[is_chosen] = triangles[is_chosen][:, ::-1]
    return Damaged(points, triangles)


def _attached(points, triangles, random, common):
    """Adds a tetrahedron that shares vertices with the mesh."""
    at = numpy.flatnonzero((triangles == common[0]).any(axis=1))
    normal = sum(_normal(points, triangles[k]) for k in at)
    size = numpy.linalg.norm(numpy.ptp(points[triangles[at[0]]], axis=0)) * random.uniform(0.1, 0.5)
    new = _whole(points[common[0]] + size * (normal / numpy.linalg.norm(normal)
                                             + random.uniform(-0.5, 0.5, (4 - len(common), 3))))
    corners = numpy.concatenate([common, len(points) + numpy.arange(len(new))])
    body = numpy.concatenate([points[common], new])
    return _added(points, triangles, new, corners[_outwards(body, TETRAHEDRON)])


def pinched_vertex(points, triangles, random):
    return _attached(points, triangles, random, triangles[random.integers(len(triangles))][:1])


def pinched_edge(points, triangles, random):
    return _attached(points, triangles, random, triangles[random.integers(len(triangles))][:2])


def duplicate(points, triangles, random):
    copy = numpy.roll(triangles[random.integers(len(triangles))], random.integers(3))
    return _added(points, triangles, [], [copy])


def duplicate_flipped(points, triangles, random):
    return _added(points, triangles, [], [triangles[random.integers(len(triangles))][::-1]])


def sliver(points, triangles, random):
    """Divides a triangle at a point that is some units off one of its edges."""
    a, b, c, first, _ = _edge(triangles, random)
    along = random.uniform(0.3, 0.7)
    inwards = numpy.cross(_normal(points, triangles[first]), points[b] - points[a])
    new = _whole(points[a] + along * (points[b] - points[a])
                 + random.uniform(2, 5) * inwards / numpy.linalg.norm(inwards))
    v = len(points)
    return _added(points, numpy.delete(triangles, first, axis=0), new, [[a, b, v], [b, c, v], [c, a, v]])


def _divided_edge(points, triangles, random):
    a, b, c, first, _ = _edge(triangles, random)
    weight, v = random.integers(1, 4), len(points)
    new = (weight * points[a] + (4 - weight) * points[b]) // 4  # exact: coordinates are multiples of 4
    return _added(points, numpy.delete(triangles, first, axis=0), new, [[a, v, c], [v, b, c]]), (a, b, v)


def degenerate(points, triangles, random):
    """Adds a triangle without area: a cap on a divided edge, or one that repeats a corner."""
    if random.random() < 0.5:
        damaged, cap = _divided_edge(points, triangles, random)
        return _added(damaged.points, damaged.triangles, [], [cap])
    a, b = triangles[random.integers(len(triangles))][:2]
    return _added(points, triangles, [], [[a, b, b]])


def t_junction(points, triangles, random):
    return _divided_edge(points, triangles, random)[0]


def shift(points, triangles, random):
    """Moves the mesh by 0.01 to 10 voxels: by as much as its outermost vertex leaves the reference."""
    direction, length = random.normal(size=3), VOXEL * 10 ** random.uniform(-2, 1)
    offset = _whole(direction / numpy.linalg.norm(direction) * length)
    length = float(numpy.linalg.norm(offset))
    is_explained = length < 1.7 * VOXEL
    is_far = length > 5 * VOXEL
    return Damaged(points + offset, triangles, (points, triangles), False if is_explained else is_far or None,
                   length, words={"distance"})


def missing_component(points, triangles, random):
    body = _satellite(points, triangles, random)
    if _area(*body) < 0.03 * _area(points, triangles):
        raise Unsuitable
    return Damaged(points, triangles, solids.joined((points, triangles), body), True, words={"other solid"})


def extra_component(points, triangles, random):
    body = _satellite(points, triangles, random)
    if _area(*body) < SHARE * _area(points, triangles):
        raise Unsuitable
    return Damaged(*solids.joined((points, triangles), body), (points, triangles), True,
                   words={"other solid", "distance"})


def fold(points, triangles, random):
    """Moves a vertex across the opposite edge of one of its triangles."""
    v, b, c = numpy.roll(triangles[random.integers(len(triangles))], random.integers(3))
    points[v] += _whole(random.uniform(1.2, 2.0) * ((points[b] + points[c]) / 2 - points[v]))
    return Damaged(points, triangles)


def overlap(points, triangles, random):
    """Adds a triangle in the plane of another one, partly on it."""
    a, b, c = points[triangles[random.integers(len(triangles))]]
    new = [(2 * a + b + c) // 4, (a + 2 * b + c) // 4, b + c - a]
    return _added(points, triangles, new, [len(points) + numpy.arange(3)])


def overlapping_bodies(points, triangles, random):
    offset = _whole(random.uniform(-0.3, 0.3, 3) * solids.EXTENT)
    return Damaged(*solids.joined((points, triangles), (points + offset, triangles)))


def touching_bodies(points, triangles, random):
    damaged = pinched_vertex(points, triangles, random)
    v = damaged.triangles[-4:].min()  # of the mesh; the body gets a vertex of its own at its position
    body = damaged.triangles[-4:]
    body[body == v] = len(damaged.points)
    return Damaged(numpy.concatenate([damaged.points, points[v][None]]), damaged.triangles)


def self_intersection(points, triangles, random):
    """Moves a vertex through another part of the surface."""
    v, target = random.integers(len(points)), points[triangles[random.integers(len(triangles))]].mean(axis=0)
    points[v] += _whole(1.2 * (target - points[v]))
    return Damaged(points, triangles)


def inner_wall(points, triangles, random):
    """Adds a wall across the solid beneath a vertex."""
    v = random.integers(len(points))
    at = triangles[(triangles == v).any(axis=1)]
    normal = sum(_normal(points, triangle) for triangle in at)
    ring = points[numpy.setdiff1d(at, v)]
    depth = random.uniform(0.2, 1.0) * numpy.linalg.norm(numpy.ptp(ring, axis=0))
    new = _whole(ring.mean(axis=0) - depth * normal / numpy.linalg.norm(normal))
    walls = [numpy.roll(triangle, -list(triangle).index(v)) for triangle in at]
    return _added(points, triangles, new, [[len(points), b, c] for _, b, c in walls])


def inner_sheet(points, triangles, random):
    """Adds an open triangle inside."""
    centre, depth = _interior_point(points, triangles, random)
    a, b = numpy.linalg.qr(random.normal(size=(3, 2)))[0].T
    new = centre + _whole(0.9 * depth * numpy.array([a, -0.5 * a + 0.8 * b, -0.5 * a - 0.8 * b]))
    return _added(points, triangles, new, [len(points) + numpy.arange(3)])


def inner_shell(points, triangles, random):
    """Adds a closed shell inside that faces outwards as the solid does."""
    centre, depth = _interior_point(points, triangles, random)
    shell = centre + _whole((depth - 4 * VOXEL) * OCTAHEDRON)
    if depth < 6 * VOXEL or _area(shell, EIGHT) < SHARE * _area(points, triangles):
        raise Unsuitable
    return Damaged(*solids.joined((points, triangles), (shell, _outwards(shell, EIGHT))),
                   (points, triangles), True, words={"other solid", "distance"})


def units(points, triangles, random):
    """Scales the mesh as if it were in other units than the reference."""
    factor = random.choice([1000, 100, 10, 25.4, 2.54, 304.8, 0.9144]) ** random.choice([-1.0, 1.0])
    return Damaged(points, triangles, (points, triangles), True, factor=float(factor),
                   words={"other solid", "distance"})


def mirrored(points, triangles, random):
    """Exchanges two axes, so that the solid is another one and inside out."""
    swapped = points[:, random.permutation([0, 1, 2])]
    if lattice.volume(swapped, triangles) * lattice.volume(points, triangles) > 0:
        raise Unsuitable
    return Damaged(swapped, triangles)


def not_a_number(points, triangles, random):
    wrong = random.choice(["nan", "-nan", "NaN", "inf", "-inf", "1e999"])
    return Damaged(points, triangles, text=(random.integers(len(points)), random.integers(3), wrong))


def bad_index(points, triangles, random):
    wrong = len(points) + random.integers(1, 5)
    return Damaged(points, triangles,
                   text=(len(points) + random.integers(len(triangles)), random.integers(3), str(wrong)))


def unwelded(points, triangles, random):
    """Cuts the surface along a path of two edges."""
    v = random.integers(len(points))
    at = numpy.flatnonzero((triangles == v).any(axis=1))
    first, last = random.choice(len(at), 2, replace=False)
    rest = {tuple(numpy.roll(triangles[k], -list(triangles[k]).index(v))[1:]): k for k in at}
    after = {b: (c, k) for (b, c), k in rest.items()}
    b = list(after)[first]
    for _ in range(1 + last % (len(at) - 1)):
        b, k = after[b]
        triangles[k][triangles[k] == v] = len(points)
    return Damaged(numpy.concatenate([points, points[v][None]]), triangles)


def isolated(points, triangles, random):
    new = _whole(random.uniform(-1, 1, 3) * solids.EXTENT)
    return _added(points, triangles, new, [])


def good(points, triangles, random):
    """Renumbers, rotates by a symmetry of the cube, and moves vertices slightly."""
    axes = numpy.eye(3, dtype=int)[random.permutation(3)] * random.choice([-1, 1], 3)
    order = random.permutation(len(points))
    turned = triangles[:, ::-1] if numpy.linalg.det(axes) < 0 else triangles
    turned = numpy.argsort(order)[random.permutation(turned)]
    turned = numpy.stack([numpy.roll(each, random.integers(3)) for each in turned])
    moved = (points @ axes)[order]
    reference = (moved, turned)
    if random.random() < 0.5:
        moved = moved + random.integers(-40, 41, moved.shape)
    return Damaged(moved, turned, reference if random.random() < 0.5 else None, False)


# Kind: the damage, the words that it must cause, and others that it may cause.
KINDS = {
    "none": (good, set(), set()),
    "hole": (hole, {"boundary"}, set()),
    "flipped triangles": (flip, {"orientation"}, set()),
    "component inside out": (inside_out, {"inside out"}, set()),
    "pinched vertex": (pinched_vertex, {"vertices"}, set()),
    "pinched edge": (pinched_edge, {"edges"}, set()),
    "duplicate triangle": (duplicate, {"duplicate", "edges", "intersections"}, set()),
    "duplicate, flipped": (duplicate_flipped, {"duplicate", "edges", "intersections"}, set()),
    "sliver": (sliver, {"sliver"}, set()),
    "degenerate triangle": (degenerate, {"degenerate", "sliver"}, {"intersections", "edges"}),
    "T-junction": (t_junction, {"boundary", "intersections"}, set()),
    "shift": (shift, set(), {"other solid"}),
    "missing component": (missing_component, set(), set()),
    "extra component": (extra_component, {"components"}, set()),
    "fold": (fold, {"intersections"}, set()),
    "overlap": (overlap, {"boundary", "components", "intersections"}, set()),
    "overlapping bodies": (overlapping_bodies, {"components", "intersections"}, set()),
    "touching bodies": (touching_bodies, {"components", "intersections"}, set()),
    "self-intersection": (self_intersection, {"intersections"}, set()),
    "inner wall": (inner_wall, {"edges"}, set()),
    "inner sheet": (inner_sheet, {"boundary", "components"}, set()),
    "inner shell": (inner_shell, {"components"}, set()),
    "other units": (units, set(), set()),
    "exchanged axes": (mirrored, {"inside out"}, set()),
    "not a finite number": (not_a_number, {"refused"}, set()),
    "missing vertex": (bad_index, {"refused"}, set()),
    "unwelded edges": (unwelded, {"boundary", "intersections"}, set()),
    "isolated vertex": (isolated, {"isolated"}, set()),
}


def damage(kind, mesh, seed):
    """Returns a damaged mesh and its facts; None, None if the model is not suitable for the kind.

    The facts of the mesh have exactly the words of its kind.
    """
    change, must, may = KINDS[kind]
    random, components = numpy.random.default_rng(seed), lattice.topology(*mesh)["components"]
    for _ in range(MOST_TRIES):
        try:
            damaged = change(*(array.copy() for array in mesh), random)
        except Unsuitable:
            continue
        facts = lattice.facts(damaged.points, damaged.triangles)
        facts["volume"] = lattice.volume(damaged.points, damaged.triangles) / 6
        words = {"refused"} if damaged.text else words_of(facts, components)
        if must <= words <= must | may:
            damaged.words |= words
            return damaged, facts
    return None, None


# ---- Reports

def write_mesh(path, points, triangles, scale, text=None):
    """Writes OFF or OBJ; `text` replaces a number of a line: (line, column, number)."""
    is_obj = str(path).endswith(".obj")
    lines = [list(map(repr, map(float, point))) for point in points * scale]
    lines += [list(map(str, triangle)) for triangle in triangles + int(is_obj)]
    if text:
        lines[text[0]][text[1]] = text[2]
    heads = ["v", "f"] if is_obj else ["", "3"]
    body = "".join(f"{heads[number >= len(points)]} {' '.join(line)}\n" for number, line in enumerate(lines))
    pathlib.Path(path).write_text(body if is_obj else f"OFF\n{len(points)} {len(triangles)} 0\n{body}")


def _is_near(value, right, scale):
    return value is not None and abs(value - right) <= 1e-9 * scale


def mistakes(report, damaged, facts, scale, components):
    """Returns the words of a report, and how it differs from the truth."""
    if report["status"] == "failed":
        wrong = [] if damaged.text else [f"refused: {report['error']}"]
        if damaged.text:
            line, points = damaged.text[0], len(damaged.points)
            place = f"point {line} " if line < points else f"polygon {line - points} "
            wrong = [] if place in report["error"] else [f"refused without {place}: {report['error']}"]
        return {"refused"}, wrong
    if damaged.text:
        return set(), ["not refused"]
    words = words_of(report, components)
    found = report | report["self_intersections"]
    wrong = [f"{name} {found[name]}, not {facts[name]}" for name in (*COUNTS, *PAIRS)
             if found[name] != facts[name]]
    turned, right = found["inside_out_components"], facts["inside_out_components"]
    if right is not None and turned != right:
        wrong.append(f"inside_out_components {turned}, not {right}")
    if abs(found["smallest_angle"] - facts["smallest_angle"]) > 1e-6:
        wrong.append(f"smallest_angle {found['smallest_angle']}, not {facts['smallest_angle']}")
    unit = scale * damaged.factor
    if not facts["boundary_edges"] and not facts["inconsistent_edges"] and not facts["non_manifold_edges"] \
            and not _is_near(found["volume"], facts["volume"] * unit**3, (solids.EXTENT * unit)**3):
        wrong.append(f"volume {found['volume']}, not {facts['volume'] * unit**3}")
    wrong += [text for library in found["libraries"].values() for text in library["disagreements"]]
    if found["watertight"] != (not words & set(WORDS[:6])):
        wrong.append(f"watertight {found['watertight']} in spite of {sorted(words)}")
    if damaged.reference:
        distance, solid = found["to_reference"]["max"], found["solid"]
        words |= {"distance"} if distance > 0.005 * VOXEL * scale else set()
        words |= {"other solid"} if solid["verdict"] == "differs" else set()
        if damaged.other_solid is not None and (solid["verdict"] == "differs") != damaged.other_solid:
            wrong.append(f"solid {solid['verdict']}")
        if damaged.moved and not _is_near(distance, damaged.moved * scale, damaged.moved * scale):
            wrong.append(f"moved by {damaged.moved * scale}, not {distance}")
        if solid["mesh_components"] != facts["components"]:
            wrong.append(f"mesh of {solid['mesh_components']} components, not {facts['components']}")
        bodies = lattice.bodies(*damaged.reference)  # a void may be meant to be filled
        if solid["reference_components"] != bodies:
            wrong.append(f"reference of {solid['reference_components']} components, not {bodies}")
    return words, wrong


def check(program, kind, name, mesh, seed):
    """Returns the words of the report on a damaged mesh, and what is wrong with it; None if unsuitable."""
    random = numpy.random.default_rng([seed, zlib.crc32(f"{kind}/{name}".encode())])
    damaged, facts = damage(kind, mesh, random)
    if damaged is None:
        return None
    scale = 2.0 ** random.integers(-30, 10)
    with tempfile.TemporaryDirectory() as directory:
        file = pathlib.Path(directory, random.choice(["mesh.off", "mesh.obj"]))
        write_mesh(file, damaged.points, damaged.triangles, scale * damaged.factor, damaged.text)
        command = [program, "validate", file, "--json", "--threads", "1"]
        if damaged.reference:
            reference = pathlib.Path(directory, "reference.off")
            write_mesh(reference, *damaged.reference, scale)
            command += ["--reference", reference, "--voxel-size", repr(VOXEL * scale), "--samples", "2000",
                        "--solid-samples", "20000"]
        ended = subprocess.run(command, capture_output=True, text=True)
    if not ended.stdout:
        return set(), [f"exit code {ended.returncode} without a report: {ended.stderr.strip()[-200:]}"]
    words, wrong = mistakes(json.loads(ended.stdout), damaged, facts, scale,
                            lattice.topology(*mesh)["components"])
    if damaged.reference and kind in ("shift", "none"):
        return words, wrong  # small distances are explained
    wrong += [f"does not report {word}" for word in sorted(damaged.words - words)]
    return words, wrong + [f"reports {word}" for word in sorted(words - damaged.words)]


def measure(parameters, wants, program, progress):
    """Yields a row for each kind of damage."""
    file = program.file.with_name("hermesh")
    models, threads = None, program.description["threads"]
    count, good, each = (int(parameters[name]) for name in ("models", "good", "each"))
    for kind in filter(wants, KINDS):
        if models is None:  # coarse meshes of public models take seconds
            models = solids.all_solids(file)
            if len(models) < count:
                raise LabError(f"only {len(models)} of {count} models are available; put the public cases "
                               f"{', '.join(solids.PUBLIC)} into $HERMESH_DATA")
        progress(kind)
        jobs = [(file, kind, name, mesh, seed) for name, mesh in list(models.items())[:count]
                for seed in range(good if kind == "none" else each)]
        with concurrent.futures.ProcessPoolExecutor(threads) as pool:
            results = list(pool.map(check, *zip(*jobs)))
        values = {"meshes": 0, "right": 0} | {word.replace(" ", "_"): 0 for word in WORDS} | {"unsuitable": 0}
        broken = []
        for (_, _, name, _, seed), result in zip(jobs, results):
            if result is None:
                values["unsuitable"] += 1
                continue
            words, wrong = result
            values["meshes"] += 1
            values["right"] += not wrong
            for word in words:
                values[word.replace(" ", "_")] += 1
            broken += [f"{name}, seed {seed}: {'; '.join(wrong)}"] if wrong else []
        yield kind, values | {"first_mistake": broken[0] if broken else ""}, broken


MEASUREMENT = {
    "name": "trial_damage", "measure": measure, "table": "damage",
    "parameters": [{"name": name, "default": default, "minimum": 1, "maximum": 1000, "help": text}
                   for name, default, text in (("models", 20, "number of models"),
                                               ("each", 1, "damaged meshes of each kind and model"),
                                               ("good", 1, "undamaged meshes of each model"))],
    "shown": measured_table("damaged meshes and what is reported of them", "damage", {
        "meshes": "damaged meshes, each checked to be as its kind states",
        "right": "of these, those whose report has all counts, measures and defects right, and no others",
        "boundary": "reports with boundary edges", "edges": "with edges of more than two polygons",
        "vertices": "with vertices of more than one fan", "orientation": "with inconsistent edges",
        "inside_out, inside out": "with components that are inside out",
        "intersections": "with intersecting pairs of triangles",
        "degenerate": "with degenerate polygons", "duplicate": "with duplicate polygons",
        "isolated": "with isolated points", "sliver": f"with a smallest angle below {SLIVER} degrees",
        "components": "with another number of components than the undamaged mesh",
        "distance": "with a distance from the reference above 0.005 voxel",
        "other_solid, other solid": "with another solid than the reference's",
        "refused": "refused with the number of the point or polygon",
        "unsuitable": "meshes for which no suitable part of the model was found",
        "first_mistake, first mistake": "model, seed and what is wrong"})}
