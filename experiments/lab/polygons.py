"""Polygons of mesh files (OBJ, OFF, PLY, STL, glTF, 3MF, also gzipped): samples, rays, pictures, solids."""

import gzip
import io
import pathlib
import re
import zipfile
import zlib
from xml.etree import ElementTree

import numpy
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from . import scenes

UNIT_TRIANGLE = numpy.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 1]])
_TYPES = {"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4",
          "float": "f4", "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2",
          "int32": "i4", "uint32": "u4", "float32": "f4", "float64": "f8"}


def read(path):
    """Returns the corners of all triangles (n, 3, 3), polygons as fans, and which triangles are polygons (n).

    Raises ValueError for other formats and for damaged files.
    """
    name = str(path).lower().removesuffix(".gz")
    reader = next((r for end, r in ((".obj", _obj), (".off", _off), (".ply", _ply), (".stl", _stl))
                   if name.endswith(end)), None)
    scene = next((r for end, r in ((".gltf", scenes.gltf), (".glb", scenes.gltf), (".3mf", scenes.three_mf))
                  if name.endswith(end)), None)
    if not reader and not scene:
        raise ValueError(f"{path}: only OBJ, OFF, PLY, STL, glTF and 3MF are read here")
    try:
        with (gzip.open if str(path).lower().endswith(".gz") else open)(path, "rb") as file:
            data = file.read()
        if scene:
            corners, is_triangle = scene(data, pathlib.Path(path).parent), True
        else:
            points, fans, is_triangle = reader(data)
            corners = numpy.asarray(points, float).reshape(-1, 3)[numpy.asarray(fans, int).reshape(-1, 3)]
    except (LookupError, TypeError, AttributeError, OverflowError, RecursionError, StopIteration, EOFError,
            OSError, zlib.error, zipfile.BadZipFile, ElementTree.ParseError) as error:
        raise ValueError(f"{path}: the file is damaged: {error}") from None
    if not len(corners) or not numpy.isfinite(corners).all():
        raise ValueError(f"{path}: the file has no polygon, or a coordinate is not finite")
    return corners, numpy.broadcast_to(is_triangle, len(corners))


def _fans(polygons):
    """Returns the triangles of polygons, and which of them are polygons."""
    fans = [(p[0], b, c, len(p) == 3) for p in polygons for b, c in zip(p[1:], p[2:])]
    table = numpy.array(fans, int).reshape(-1, 4)
    return table[:, :3], table[:, 3] == 1


def _obj(data):
    points, polygons = [], []
    for line in data.decode(errors="replace").replace("\\\n", " ").splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            points.append([float(word) for word in words[1:4]])
        elif words[:1] == ["f"]:
            corners = [int(word.split("/")[0]) for word in words[1:]]
            polygons.append([c - 1 if c > 0 else len(points) + c for c in corners])
    return points, *_fans(polygons)


def _off(data):
    text = data.decode(errors="replace")
    lines = [words for line in text.splitlines() if (words := line.split("#")[0].split())]
    head = lines.pop(0)
    if not head[0].endswith("OFF"):
        raise ValueError("an OFF file starts with OFF")
    points, faces = map(int, (head[1:] or lines.pop(0))[:2])
    polygons = [list(map(int, words[1:int(words[0]) + 1])) for words in lines[points:points + faces]]
    return [list(map(float, words[:3])) for words in lines[:points]], *_fans(polygons)


def _stl(data):
    count = int.from_bytes(data[80:84], "little") if len(data) >= 84 else 0
    if len(data) >= 84 and len(data) == 84 + 50 * count:
        record = [("normal", "<f4", 3), ("corners", "<f4", 9), ("attribute", "<u2")]
        records = numpy.frombuffer(data, record, count, 84)
        points = records["corners"].reshape(-1, 3)
    else:
        points = [words.split() for words in re.findall(rb"vertex\s+(\S+\s+\S+\s+\S+)", data)]
    return numpy.array(points, float), numpy.arange(len(points)), True


def _ply(data):
    head, _, body = data.partition(b"end_header\n" if b"end_header\n" in data else b"end_header\r\n")
    elements, order = [], "<"
    for words in map(str.split, head.decode(errors="replace").splitlines()):
        if words[:1] == ["format"] and words[1] != "ascii":
            order = "<" if "little" in words[1] else ">"
        elif words[:1] == ["format"]:
            order = ""
        elif words[:1] == ["element"]:
            elements.append((words[1], int(words[2]), []))
        elif words[:1] == ["property"]:
            elements[-1][2].append((words[-1], words[1:-1]))
    values = iter(body.split()) if not order else None
    at = 0

    def take(kind, count):
        nonlocal at
        if values is not None:
            return [float(next(values)) for _ in range(count)]
        found = numpy.frombuffer(body, order + _TYPES[kind], count, at)
        at += found.nbytes
        return found.tolist()

    points, polygons = [], []
    for name, count, properties in elements:
        if order and all(len(kind) == 1 for _, kind in properties):  # without lists: all at once
            record = [(label, order + _TYPES[kind[0]]) for label, kind in properties]
            records = numpy.frombuffer(body, record, count, at)
            at += records.nbytes
            if name == "vertex":
                points = numpy.stack([records[axis].astype(float) for axis in "xyz"], axis=1)
            continue
        if order and name == "face" and len(properties) == 1:  # all triangles: all at once
            _, (_, length, kind) = properties[0]
            record = numpy.dtype([("corners", order + _TYPES[length]), ("vertices", order + _TYPES[kind], 3)])
            if len(body) - at >= count * record.itemsize:
                records = numpy.frombuffer(body, record, count, at)
                if (records["corners"] == 3).all():
                    return points, records["vertices"], True
        for _ in range(count):
            row = {}
            for label, kind in properties:
                length = int(take(kind[1], 1)[0]) if len(kind) == 3 else 1
                row[label] = take(kind[-1], length) if len(kind) == 3 else take(kind[0], 1)[0]
            if name == "vertex":
                points.append([row[axis] for axis in "xyz"])
            elif name == "face":
                polygons.append([int(v) for v in row.get("vertex_indices", row.get("vertex_index"))])
    return points, *_fans(polygons)


def write_obj(path, corners):
    """Writes triangles, in which corners with the same coordinates are one vertex."""
    points, vertices = numpy.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    with open(path, "w") as file:
        file.writelines("v %.17g %.17g %.17g\n" % tuple(point) for point in points)
        file.writelines("f %d %d %d\n" % tuple(triangle) for triangle in vertices.reshape(-1, 3) + 1)


def volume(corners):
    """Returns the volume within closed triangles."""
    a, b, c = (corners[:, i] - corners[:1, 0] for i in range(3))
    return float(numpy.einsum("ij,ij", a, numpy.cross(b, c)) / 6)


def _inner_point(corners, seed):
    """Returns a random point between a random point of the surface and the next one inwards."""
    point, chosen = samples(corners, 1, seed)
    inwards = -normals(corners)[0][chosen[0]]
    depth = first_hit(corners, point[0], inwards, 1e-6 * numpy.ptp(corners.reshape(-1, 3)))
    return point[0] + (numpy.random.default_rng(seed).random() * depth if depth < numpy.inf else 0) * inwards


def solid(corners):
    """Returns a solid with a positive volume, in single precision."""
    return (corners if volume(corners) > 0 else corners[:, ::-1]).astype(numpy.float32).astype(float)


def place(first, second, seed):
    """Returns two solids that overlap, in single precision and with positive volumes.

    The second one is scaled to the diagonal of the first and rotated, and a random point within it is moved
    to a random point within the first.
    """
    first, second = solid(first), solid(second)
    diagonals = [numpy.linalg.norm(numpy.ptp(s.reshape(-1, 3), axis=0)) for s in (first, second)]
    second = diagonals[0] / diagonals[1] * second @ Rotation.random(random_state=seed).as_matrix().T
    second = second + _inner_point(first, seed) - _inner_point(second, seed + 1)
    return [first, solid(second)]


def random_planes(corners, count, seed):
    """Returns planes through random points within a solid: unit normals and offsets (count, 4)."""
    normals = numpy.random.default_rng(seed).normal(size=(count, 3))
    normals /= numpy.linalg.norm(normals, axis=1)[:, None]
    points = [_inner_point(corners, seed + i) for i in range(count)]
    return numpy.column_stack([normals, numpy.einsum("ij,ij->i", normals, points)])


def _crossings(corners, lines):
    """Yields the heights at which each vertical line (x, y) crosses closed triangles, and the changes of the
    winding number there on the way up.
    """
    low, high = corners[:, :, :2].min(axis=1), corners[:, :, :2].max(axis=1)
    for line in lines:
        near = corners[((low <= line) & (line <= high)).all(axis=1)]
        d = near[:, :, :2] - line
        weights = numpy.stack([d[:, i - 2, 0] * d[:, i - 1, 1] - d[:, i - 2, 1] * d[:, i - 1, 0]
                               for i in range(3)], axis=1)
        is_hit = (weights > 0).all(axis=1) | (weights < 0).all(axis=1)
        weights, total = weights[is_hit], weights[is_hit].sum(axis=1)
        yield (weights * near[is_hit, :, 2]).sum(axis=1) / total, -numpy.sign(total).astype(int)


def _segments(solids, lines, planes=numpy.empty((0, 4))):
    """Yields, for each vertical line, its segments between crossings with the solids and the planes: their
    lengths, which solids they are in (n, solids), and on which sides of the planes they are (n, planes).
    """
    for line, found in zip(lines, zip(*(_crossings(solid, lines) for solid in solids))):
        with numpy.errstate(divide="ignore", invalid="ignore"):  # vertical planes
            cuts = (planes[:, 3] - planes[:, :2] @ line) / planes[:, 2]
        height = numpy.concatenate([*(z for z, _ in found), cuts[numpy.isfinite(cuts)]])
        change = numpy.zeros((len(height), len(solids)), int)
        change[:sum(len(z) for z, _ in found)] = numpy.concatenate(
            [numpy.outer(sign, unit) for (_, sign), unit in zip(found, numpy.eye(len(solids), dtype=int))])
        order = numpy.argsort(height)
        height = height[order]
        middle = (height[1:] + height[:-1]) / 2
        sides = numpy.outer(middle, planes[:, 2]) + planes[:, :2] @ line > planes[:, 3]
        yield numpy.diff(height), numpy.cumsum(change[order], axis=0)[:-1] > 0, sides


def misplaced_share(solid, pieces, planes, count=1000):
    """Returns the volume in which the pieces of a solid that is cut by planes are wrong, as a share of it:
    volume of the solid that is in no piece, in several, or in a piece with more volume in another cell of the
    planes, and volume of pieces outside the solid. It is integrated along random vertical lines.
    """
    low, high = (side(solid.reshape(-1, 3), axis=0) for side in (numpy.min, numpy.max))
    lines = numpy.random.default_rng(0).uniform(low[:2], high[:2], (count, 2))
    total = wrong = 0.0
    volumes = numpy.zeros((len(pieces), 2**len(planes)))  # of pieces in cells
    for length, inside, sides in _segments([solid, *pieces], lines, planes):
        is_one = inside[:, 0] & (inside[:, 1:].sum(axis=1) == 1)
        total += length[inside[:, 0]].sum()
        wrong += length[inside.any(axis=1) & ~is_one].sum()
        cells = sides @ 2**numpy.arange(len(planes))
        numpy.add.at(volumes, (inside[is_one, 1:].argmax(axis=1), cells[is_one]), length[is_one])
    wrong += volumes.sum() - volumes.max(axis=1).sum()
    return float(wrong / total) if total else 1.0


def wrong_share(first, second, output, operation, count=1000):
    """Returns the volume in which a mesh differs from the result of an operation, as a share of the result.

    Both volumes are integrated along random vertical lines through the box that contains the result. A mesh
    that leaves this box is wrong by at least the excess of its volume.
    """
    points = [corners.reshape(-1, 3) for corners in (first, second)]
    lows, highs = [p.min(axis=0) for p in points], [p.max(axis=0) for p in points]
    low, high = {"union": (numpy.min(lows, axis=0), numpy.max(highs, axis=0)),
                 "difference": (lows[0], highs[0]),
                 "intersection": (numpy.max(lows, axis=0), numpy.min(highs, axis=0))}[operation]
    area = numpy.prod(high[:2] - low[:2]) / count  # that a line represents
    lines = numpy.random.default_rng(0).uniform(low[:2], high[:2], (count, 2))
    wrong = total = within = 0.0
    for length, inside, _ in _segments((first, second, output), lines):
        a, b, made = inside.T
        right = {"union": a | b, "intersection": a & b, "difference": a & ~b}[operation]
        wrong, total, within = (before + area * length[chosen].sum() for before, chosen in (
            (wrong, made != right), (total, right), (within, made)))
    sides = output.reshape(-1, 3)
    margin = 1e-3 * (high - low)
    if (sides < low - margin).any() or (sides > high + margin).any():
        wrong += max(0.0, volume(output) - within)
    return float(wrong / total) if total else float(wrong > 0)


def normals(corners):
    """Returns unit normals (0 for degenerate triangles) and areas."""
    normal = numpy.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = numpy.linalg.norm(normal, axis=1)
    return normal / numpy.maximum(length, 1e-300)[:, None], length / 2


def samples(corners, count, seed=0):
    """Returns points that are distributed uniformly over the area, and the numbers of their triangles."""
    random, areas = numpy.random.default_rng(seed), normals(corners)[1]
    if not areas.sum():
        return numpy.empty((0, 3)), numpy.empty(0, int)
    chosen = random.choice(len(corners), count, p=areas / areas.sum())
    a, b = random.random((2, count))
    a, b = numpy.where(a + b > 1, 1 - a, a), numpy.where(a + b > 1, 1 - b, b)
    weights = numpy.stack([1 - a - b, a, b], axis=1)
    return numpy.einsum("ij,ijk->ik", weights, corners[chosen]), chosen


def first_hit(corners, origin, direction, after):
    """Returns the distance along a ray to its first hit beyond the distance `after`, else infinity."""
    start, edge1, edge2 = origin - corners[:, 0], *(corners[:, i] - corners[:, 0] for i in (1, 2))
    p, q = numpy.cross(direction, edge2), numpy.cross(start, edge1)
    with numpy.errstate(divide="ignore", invalid="ignore"):
        inverse = 1 / numpy.einsum("ij,ij->i", edge1, p)
        u, v = numpy.einsum("ij,ij->i", start, p) * inverse, q @ direction * inverse
        t = numpy.einsum("ij,ij->i", edge2, q) * inverse
        return t[(u >= 0) & (v >= 0) & (u + v <= 1) & (t > after)].min(initial=numpy.inf)


def distant_visible_points(model, is_triangle, output, limit, count=256, rays=16):
    """Returns samples of the model from which two rays leave it, of those farther than `limit` from the output.

    Samples are vertices and points within triangles, which do not depend on the triangulation of polygons.
    `count` of them are tested: a quarter are the farthest ones, and the others are spread over the rest,
    since the farthest ones may all be hidden.
    """
    within = samples(model[is_triangle], 20_000)[0]
    points = numpy.unique(numpy.concatenate([model.reshape(-1, 3), within]), axis=0)
    known = samples(output, 50_000)[0]
    if not len(known):
        return points[:0]
    distances = cKDTree(known).query(points)[0]
    order = numpy.argsort(-distances)[:numpy.count_nonzero(distances > limit)]
    rest = order[count // 4:]
    spread = rest[numpy.linspace(0, len(rest) - 1, min(len(rest), 3 * count // 4)).astype(int)]
    points = points[numpy.concatenate([order[:count // 4], spread])]
    if not len(points):
        return points
    directions = numpy.random.default_rng(0).normal(size=(rays, 3))
    directions /= numpy.linalg.norm(directions, axis=1)[:, None]
    after = 1e-7 * numpy.ptp(model.reshape(-1, 3), axis=0).max()
    free = [sum(numpy.isinf(first_hit(model, point, direction, after)) for direction in directions)
            for point in points]
    return points[numpy.array(free) >= 2]


def thin_share(corners, voxel, count=200):
    """Returns the share of the area from which a ray inwards meets the surface again within a voxel."""
    points, chosen = samples(corners, count)
    inwards = -normals(corners)[0][chosen]
    hits = [first_hit(corners, p, d, 1e-4 * voxel) < voxel for p, d in zip(points, inwards)]
    return float(numpy.mean(hits)) if hits else 0.0


def picture(corners, box, pixels=160):
    """Returns a PNG of the triangles, seen diagonally from above; `box` (lower, upper) fills the frame."""
    import matplotlib.image
    centre, longest = numpy.mean(box, axis=0), numpy.linalg.norm(numpy.subtract(*box)) or 1.0
    right, up = numpy.array([0.8, -0.6, 0]), numpy.array([0.36, 0.48, 0.8])
    towards = numpy.cross(right, up)
    points, chosen = samples(corners, 8 * pixels**2)
    shade = 0.25 + 0.75 * abs(normals(corners)[0][chosen] @ (0.3 * right + 0.5 * up + 0.8 * towards))
    x, y = (((points - centre) @ axis / longest * 0.98 + 0.5) * pixels for axis in (right, -up))
    order = numpy.argsort((points - centre) @ towards)
    order = order[(x[order] >= 0) & (x[order] < pixels) & (y[order] >= 0) & (y[order] < pixels)]
    image, png = numpy.ones((pixels, pixels)), io.BytesIO()
    image[y[order].astype(int), x[order].astype(int)] = 0.85 * shade[order].clip(0, 1)
    matplotlib.image.imsave(png, image, cmap="gray", vmin=0, vmax=1, format="png")
    return png.getvalue()
