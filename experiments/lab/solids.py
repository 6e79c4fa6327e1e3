"""Small closed solids with whole coordinates: closed-form surfaces and coarse meshes of public models."""

import os
import pathlib
import subprocess
import tempfile

import numpy

from . import corpus, lattice, models, polygons

EXTENT = 2**17  # longest side; coordinates are multiples of 4 about the origin
VOXEL = EXTENT / 200
PUBLIC = ("joint", "bearing", "screw", "bunny", "chair")  # cases, and voxels along their longest sides:
RESOLUTION = 14


def _grid(points):
    """Returns triangles over a grid of vertices (rows, columns, 3) that closes in both directions."""
    rows, columns = points.shape[:2]
    i, j = numpy.meshgrid(numpy.arange(rows), numpy.arange(columns), indexing="ij")
    a, b, c, d = (((i + s) % rows * columns + (j + t) % columns).ravel()
                  for s, t in ((0, 0), (1, 0), (1, 1), (0, 1)))
    quads = numpy.concatenate([numpy.stack([a, b, c], axis=1), numpy.stack([a, c, d], axis=1)])
    return points.reshape(-1, 3), quads


def _revolved(radii, heights, around=16, shape=lambda angle: 1.0):
    """Returns the solid of a profile from bottom to top, whose first and last points are on the axis."""
    angle = numpy.arange(around) * 2 * numpy.pi / around
    scale = shape(angle) * numpy.ones(around)
    inner = numpy.stack([numpy.outer(radii[1:-1], scale * numpy.cos(angle)),
                         numpy.outer(radii[1:-1], scale * numpy.sin(angle)),
                         numpy.outer(heights[1:-1], numpy.ones(around))], axis=2)
    points, triangles = _grid(inner)
    triangles = triangles[(triangles // around).max(axis=1) - (triangles // around).min(axis=1) <= 1]
    first, last = len(points), len(points) + 1
    at, after = numpy.arange(around), (numpy.arange(around) + 1) % around
    top = (len(radii) - 3) * around
    caps = [numpy.stack([numpy.full(around, first), after, at], axis=1),
            numpy.stack([numpy.full(around, last), top + at, top + after], axis=1)]
    poles = [[0, 0, heights[0]], [0, 0, heights[-1]]]
    return numpy.concatenate([points, poles]), numpy.concatenate([triangles[:, ::-1], *caps])


def _sphere(rings=10, around=16):
    angle = numpy.linspace(0, numpy.pi, rings + 1)
    return _revolved(numpy.sin(angle), -numpy.cos(angle), around)


def _tube(curve, radius, across=8):
    """Returns a tube about a closed curve (n, 3)."""
    tangent = numpy.roll(curve, -1, axis=0) - numpy.roll(curve, 1, axis=0)
    tangent /= numpy.linalg.norm(tangent, axis=1)[:, None]
    side = numpy.cross(tangent, [0, 0, 1.0])
    side /= numpy.linalg.norm(side, axis=1)[:, None]
    up = numpy.cross(side, tangent)
    angle = numpy.arange(across) * 2 * numpy.pi / across
    return _grid(curve[:, None] + radius * (numpy.cos(angle)[None, :, None] * side[:, None]
                                            + numpy.sin(angle)[None, :, None] * up[:, None]))


def _cells(filled):
    """Returns the boundary of cubes (i, j, k) of a grid of truth values."""
    filled = numpy.pad(filled, 1)
    corners = []
    for axis in range(3):
        for side in (0, 1):
            is_face = filled & ~numpy.roll(filled, 1 - 2 * side, axis)
            u, v = numpy.eye(3, dtype=int)[[(axis + 1) % 3, (axis + 2) % 3]]
            low = numpy.argwhere(is_face) + side * numpy.eye(3, dtype=int)[axis]
            square = [low, low + u, low + u + v, low + v][:: 2 * side - 1]
            corners += [numpy.stack(square[:3], axis=1), numpy.stack([square[0], *square[2:]], axis=1)]
    points, triangles = numpy.unique(numpy.concatenate(corners).reshape(-1, 3), axis=0, return_inverse=True)
    return points + 0.0, triangles.reshape(-1, 3)


def joined(*meshes):
    """Returns several meshes as one."""
    starts = numpy.cumsum([0, *(len(points) for points, _ in meshes)])
    return (numpy.concatenate([points for points, _ in meshes]),
            numpy.concatenate([triangles + start for (_, triangles), start in zip(meshes, starts)]))


def _closed_form():
    """Yields names and meshes."""
    turn = numpy.arange(48) * 2 * numpy.pi / 48
    ring = numpy.stack([numpy.cos(turn), numpy.sin(turn), 0 * turn], axis=1)
    points, triangles = _sphere()
    block = _cells(numpy.ones((5, 5, 5), bool))
    yield "sphere", (points, triangles)
    yield "ellipsoid", (points * [1, 0.7, 0.4], triangles)
    yield "torus", _tube(ring[::2], 0.35, 10)
    yield "cube", block
    yield "cylinder", _revolved([0, 0.5, 1, 1, 1, 1, 0.5, 0], [-1, -1, -1, -0.3, 0.3, 1, 1, 1], 24)
    yield "cone", _revolved([0, 0.5, 1, 0.7, 0.4, 0], [-1, -1, -1, -0.4, 0.2, 1], 20)
    yield "capsule", _revolved([0, 0.35, 0.5, 0.5, 0.5, 0.35, 0], [-1.5, -1.35, -1, 0, 1, 1.35, 1.5], 20)
    yield "star", _revolved([0, 0.5, 1, 1, 0.5, 0], [-0.4, -0.4, -0.4, 0.4, 0.4, 0.4], 28,
                            lambda angle: 1 + 0.3 * numpy.cos(7 * angle))
    twisted, angle = block[0] - 2.5 - 1, (block[0][:, 2] - 3.5) * 0.25
    yield "twisted block", (numpy.stack(
        [numpy.cos(angle) * twisted[:, 0] - numpy.sin(angle) * twisted[:, 1],
         numpy.sin(angle) * twisted[:, 0] + numpy.cos(angle) * twisted[:, 1], 1.5 * twisted[:, 2]], axis=1),
        block[1])
    bracket = numpy.ones((5, 3, 5), bool)
    bracket[2:, :, 2:] = False
    yield "bracket", _cells(bracket)
    sponge = numpy.ones((3, 3, 3), bool)
    sponge[1, 1] = sponge[1, :, 1] = sponge[:, 1, 1] = False
    yield "sponge", _cells(sponge.repeat(2, 0).repeat(2, 1).repeat(2, 2))
    turn = numpy.arange(72) * 2 * numpy.pi / 72
    yield "trefoil", _tube(numpy.stack(
        [numpy.sin(turn) + 2 * numpy.sin(2 * turn), numpy.cos(turn) - 2 * numpy.cos(2 * turn),
         -1.2 * numpy.sin(3 * turn)], axis=1), 0.45)
    yield "ball with a cavity", joined((points, triangles), (0.5 * points, triangles[:, ::-1]))
    flat, rest = _tube(ring[::2], 0.25)
    yield "linked rings", joined((flat, rest), (flat[:, [2, 0, 1]] + [0, 1, 0], rest))
    yield "two bodies", joined((points, triangles), (0.2 * block[0] + [1.6, -0.7, -0.6], block[1]))


def on_lattice(points, triangles, extent=EXTENT):
    """Returns a mesh scaled to an extent, on multiples of 4 about the origin, and facing outwards."""
    low, high = points.min(axis=0), points.max(axis=0)
    points = 4 * numpy.rint((points - (low + high) / 2) / (high - low).max() * extent / 4).astype(numpy.int64)
    return points, triangles if lattice.volume(points, triangles) > 0 else triangles[:, ::-1]


def _public(name, program):
    """Returns a coarse mesh of a public case, or None if its file is not available."""
    files = [pathlib.Path(directory, file["file"])
             for directory in filter(None, [os.environ.get("HERMESH_DATA"), corpus.cache_root()])
             for file in models.catalogue()[name]["files"]]
    source = next((file for file in files if file.exists()), None)
    if not source:
        return None
    with tempfile.TemporaryDirectory() as directory:
        out = pathlib.Path(directory, "coarse.ply")
        subprocess.run([program, "remesh", source, out, "--resolution", str(RESOLUTION), "--quiet"],
                       check=True, capture_output=True)
        corners = polygons.read(out)[0]
    points, triangles = numpy.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    return points, triangles.reshape(-1, 3)


def all_solids(program, names=None):
    """Returns {name: (points, triangles)}; `program` makes the coarse meshes of public models."""
    found = {name: mesh for name, mesh in _closed_form() if not names or name in names}
    for name in PUBLIC:
        if (not names or name in names) and (mesh := _public(name, program)):
            found[name] = mesh
    return {name: on_lattice(*mesh) for name, mesh in found.items()}
