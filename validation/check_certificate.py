#!/usr/bin/env python3
"""Checks a certificate of hermesh: that a mesh is closed, manifold and free of self-intersection, and that no
point of it is farther from the input than the stated error, and no point of the input farther from it.

    check_certificate.py INPUT OUTPUT CERTIFICATE [--uncovered SHARE] [--json]

The program reads the three files and nothing else, and shares no code with hermesh. Meshes are OFF, OBJ, PLY
or STL files, also gzipped; their coordinates count as the doubles nearest to their text. All decisions are
made in whole numbers of any length. Floating point only proposes points of triangles that are near enough,
which is then tested exactly.

  Closed, manifold:  each directed edge occurs once, and so does its reverse; the triangles at a vertex are
      one fan; no triangle has area 0; the enclosed volume is positive.
  No self-intersection:  two triangles have no point in common but shared vertices and edges.
  Distance:  the certificate divides each triangle by lines into convex pieces and assigns each piece to a
      triangle of the other mesh (algorithms/remesh/certificate.h has the format). If all corners of a piece
      are within the error of its triangle, so is all of the piece: the distance from a convex set is convex.

Exit code: 0 if everything is verified, 1 if something is false or not proved, 2 if a file cannot be read.
"""

import argparse
import collections
import fractions
import gzip
import json
import math
import re
import sys
import zlib

import numpy

FORMAT = "hermesh certificate 1"
BITS = 40  # of barycentric coordinates of proposed points
BLOCK = 1 << 16  # rows in one step
_TYPES = {"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4",
          "float": "f4", "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2",
          "int32": "i4", "uint32": "u4", "float32": "f4", "float64": "f8"}


class Refused(Exception):
    """A statement is false, or its proof is."""


class Unreadable(Exception):
    """A file cannot be read."""


def read(path):
    """Returns points (n, 3) and polygons, a list of lists of point numbers."""
    name = path.lower().removesuffix(".gz")
    try:
        with (gzip.open if path.lower().endswith(".gz") else open)(path, "rb") as file:
            data = file.read()
        reader = {"off": _off, "obj": _obj, "ply": _ply, "stl": _stl}.get(name.rsplit(".", 1)[-1])
        if not reader:
            raise Unreadable(f"{path}: meshes must be OFF, OBJ, PLY or STL; convert others first")
        points, polygons = reader(data)
        points = numpy.array(points, float).reshape(-1, 3)
    except (OSError, ValueError, LookupError, TypeError, EOFError, zlib.error) as error:
        raise Unreadable(f"{path}: {error}") from None
    used = numpy.concatenate([numpy.asarray(polygon) for polygon in polygons] or [numpy.zeros(0, int)])
    if not len(used) or used.min() < 0 or used.max() >= len(points) or not numpy.isfinite(points[used]).all():
        raise Unreadable(f"{path}: no polygon, a vertex that does not exist, or one that is not finite")
    return numpy.nan_to_num(points, posinf=0, neginf=0), polygons


def _off(data):
    lines = [words for line in data.decode().splitlines() if (words := line.split("#")[0].split())]
    head = lines.pop(0)
    if head[0] != "OFF":
        raise ValueError("an OFF file starts with OFF")
    count, faces = map(int, (head[1:] or lines.pop(0))[:2])
    return ([line[:3] for line in lines[:count]],
            [list(map(int, line[1:1 + int(line[0])])) for line in lines[count:count + faces]])


def _obj(data):
    points, polygons = [], []
    for line in data.decode(errors="replace").replace("\\\n", " ").splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            points.append(words[1:4])
        elif words[:1] == ["f"]:
            corners = [int(word.split("/")[0]) for word in words[1:]]
            polygons.append([c - 1 if c > 0 else len(points) + c for c in corners])
    return points, polygons


def _stl(data):
    count = int.from_bytes(data[80:84], "little")
    if len(data) == 84 + 50 * count:
        record = numpy.dtype([("normal", "<f4", 3), ("corners", "<f4", 9), ("attribute", "<u2")])
        corners = numpy.frombuffer(data, record, count, 84)["corners"].reshape(-1, 3)
    else:
        corners = numpy.array([words.split() for words in re.findall(rb"vertex\s+(\S+\s+\S+\s+\S+)", data)],
                              numpy.float32)
    points, numbers = numpy.unique(corners.astype(float) + 0.0, axis=0, return_inverse=True)
    return points, numbers.reshape(-1, 3).tolist()


def _ply(data):
    head, _, body = re.split(rb"(end_header\r?\n)", data, maxsplit=1)
    lines = [line.split() for line in head.decode().splitlines()]
    order = next({"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}[line[1]]
                 for line in lines if line[:1] == ["format"])
    elements = []
    for line in lines:
        if line[:1] == ["element"]:
            elements.append((line[1], int(line[2]), []))
        elif line[:1] == ["property"]:
            elements[-1][2].append((line[-1], line[1:-1]))
    words, at = iter(body.split()) if not order else None, 0

    def take(kind, count):
        nonlocal at
        if words is not None:
            return [float(next(words)) for _ in range(count)]
        values = numpy.frombuffer(body, order + _TYPES[kind], count, at)
        at += values.nbytes
        return values.tolist()

    points, polygons = [], []
    for name, count, properties in elements:
        lists = {label for label, kind in properties if len(kind) > 1}
        if order and not lists:
            record = numpy.dtype([(label, order + _TYPES[kind[0]]) for label, kind in properties])
            values = numpy.frombuffer(body, record, count, at)
            at += values.nbytes
            if name == "vertex":
                points = numpy.stack([values[axis].astype(float) for axis in "xyz"], 1)
            continue
        for _ in range(count):
            row = {label: take(kind[2], int(take(kind[1], 1)[0])) if label in lists else take(kind[0], 1)[0]
                   for label, kind in properties}
            if name == "vertex":
                points.append([row[axis] for axis in "xyz"])
            elif name == "face":
                polygons.append([int(p) for p in row.get("vertex_indices", row.get("vertex_index"))])
    return points, polygons


def read_certificate(path):
    """Returns the header and the whole numbers."""
    try:
        with open(path, "rb") as file:
            header = json.loads(file.readline())
            numbers = numpy.frombuffer(zlib.decompress(file.read()), "<i4").tolist()
        if header["format"] != FORMAT:
            raise ValueError(f"not of the format '{FORMAT}'")
        if not 0 < float(header["error"]) < math.inf:
            raise ValueError("the error is not a positive number")
        return header, numbers
    except (OSError, ValueError, LookupError, TypeError, zlib.error) as error:
        raise Unreadable(f"{path}: {error}") from None


def triangles_of(polygons, cuts):
    """Returns triangles (n, 3): the polygons themselves, or the cuts, which must divide each polygon."""
    if cuts is None:
        if any(len(polygon) != 3 for polygon in polygons):
            raise Refused("a polygon has not three corners, and the certificate does not say how it is cut")
        return numpy.array(polygons)
    at = 0
    for polygon in polygons:
        parts = cuts[at:at + len(polygon) - 2]
        at += len(polygon) - 2
        edges = collections.Counter()
        for part in parts:
            for a, b in zip(part, part[1:] + part[:1]):
                edges[a, b] += 1
                edges[b, a] -= 1
        for a, b in zip(polygon, polygon[1:] + polygon[:1]):
            edges[a, b] -= 1
            edges[b, a] += 1
        if any(edges.values()):
            raise Refused(f"the cuts of polygon {polygon} are not its parts")
    if at != len(cuts):
        raise Refused("the certificate cuts other polygons")
    return numpy.array(cuts)


def whole(*arrays):
    """Returns coordinates as whole numbers of any length, and the exponent of two of their unit."""
    parts = [numpy.frexp(array) for array in arrays]
    least = min((int(exponent[mantissa != 0].min()) for mantissa, exponent in parts if mantissa.any()),
                default=0) - 53
    made = []
    for mantissa, exponent in parts:
        shift = numpy.maximum(exponent - 53 - least, 0).astype(object)
        made.append((mantissa * 2.0**53).astype(numpy.int64).astype(object) << shift)
    return made, least


def check_topology(triangles):
    """Raises Refused unless the triangles are a closed, oriented manifold."""
    if (triangles == numpy.roll(triangles, 1, 1)).any():
        raise Refused("a triangle has a vertex twice")
    count = int(triangles.max()) + 1
    start, end = triangles.ravel(), numpy.roll(triangles, -1, 1).ravel()
    edges, reverse = start * count + end, end * count + start
    order = numpy.argsort(edges)
    at = numpy.minimum(numpy.searchsorted(edges[order], reverse), len(edges) - 1)
    if (numpy.diff(edges[order]) == 0).any():
        raise Refused("a directed edge occurs twice: the mesh is not manifold, or not oriented")
    if (edges[order][at] != reverse).any():
        raise Refused("the mesh has a boundary edge")
    # The edge that follows another one around its first vertex: the reverse of the third side.
    follows = order[at].reshape(-1, 3)[:, [2, 0, 1]].ravel()
    least, step = numpy.arange(len(edges)), follows
    for _ in range(len(edges).bit_length()):
        least, step = numpy.minimum(least, least[step]), step[step]
    if (least == numpy.arange(len(edges))).sum() != len(numpy.unique(start)):
        raise Refused("the triangles at a vertex are several fans")


def cross(u, v):
    return numpy.stack([u[..., 1] * v[..., 2] - u[..., 2] * v[..., 1],
                        u[..., 2] * v[..., 0] - u[..., 0] * v[..., 2],
                        u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]], -1)


def dot(u, v):
    return (u * v).sum(-1)


def overlapping_pairs(corners):
    """Yields arrays of pairs of triangles whose boxes overlap."""
    low, high = corners.min(1), corners.max(1)
    axis = int(numpy.argmax(high.max(0) - low.min(0)))
    others = [(axis + 1) % 3, (axis + 2) % 3]
    order = numpy.argsort(low[:, axis], kind="stable")
    low, high = low[order], high[order]
    ends = numpy.searchsorted(low[:, axis], high[:, axis], "right")
    low, high = low[:, others].copy(), high[:, others].copy()
    found, size = [], 0
    for i, end in enumerate(ends.tolist()):
        near = numpy.flatnonzero(((low[i + 1:end] <= high[i]) & (high[i + 1:end] >= low[i])).all(1))
        if len(near):
            found.append(numpy.stack([numpy.full(len(near), order[i]), order[near + i + 1]], 1))
            size += len(near)
        if size > BLOCK:
            yield numpy.concatenate(found)
            found, size = [], 0
    if found:
        yield numpy.concatenate(found)


def orient(a, b, c, d):
    """Returns six times the volume of a tetrahedron."""
    return dot(cross(b - a, c - a), d - a)


def meets_in_plane(p, q, triangle):
    """Returns whether a segment and a triangle in the same plane have a point in common."""
    normal = cross(triangle[1] - triangle[0], triangle[2] - triangle[0])
    for side in (q - p, *(numpy.roll(triangle, -1, 0) - triangle)):
        axis = cross(normal, side)
        segment, others = [dot(axis, p), dot(axis, q)], [dot(axis, corner) for corner in triangle]
        if max(segment) < min(others) or min(segment) > max(others):
            return False
    return True


def meets(p, q, triangle):
    """Returns whether a segment and a triangle have a point in common."""
    a, b, c = triangle
    above, below = orient(a, b, c, p), orient(a, b, c, q)
    if above == below == 0:
        return meets_in_plane(p, q, triangle)
    if above * below > 0:
        return False
    sides = [orient(p, q, a, b), orient(p, q, b, c), orient(p, q, c, a)]
    return min(sides) >= 0 or max(sides) <= 0


def on_one_side(first, second, corners):
    """Returns for each pair if these corners of the second triangle are on the same side of the first."""
    sides = numpy.array([orient(*(first[:, i] for i in range(3)), second[:, k]) for k in corners])
    return (sides > 0).all(0) | (sides < 0).all(0)


def check_embedding(triangles, points, exact):
    """Raises Refused if two triangles have more in common than their shared vertices. Returns the pairs."""
    a, b, c = (exact[triangles[:, i]] for i in range(3))
    if not cross(b - a, c - a).any(1).all():
        raise Refused("a triangle has no area")
    count = 0
    for pairs in overlapping_pairs(points[triangles]):
        count += len(pairs)
        same = triangles[pairs[:, 0]][:, :, None] == triangles[pairs[:, 1]][:, None, :]
        shared = same.sum((1, 2))
        if (shared == 3).any():
            raise Refused("a triangle occurs twice")
        # With an edge in common they are not folded onto each other, in the same plane.
        chosen, where = pairs[shared == 2], same[shared == 2]
        first, second = (numpy.take_along_axis(
            triangles[chosen[:, side]], (where.any(2 - side).argmin(1)[:, None] + numpy.arange(3)) % 3, 1)
            for side in (0, 1))  # the vertex that is not shared comes first
        edge, apexes = exact[first[:, 2]] - exact[first[:, 1]], (exact[first[:, 0]], exact[second[:, 0]])
        normals = [cross(edge, apex - exact[first[:, 1]]) for apex in apexes]
        if ((dot(normals[0], apexes[1] - exact[first[:, 1]]) == 0) & (dot(*normals) >= 0)).any():
            raise Refused("two triangles at an edge are folded onto each other")
        # With a vertex in common the opposite side of neither meets the other triangle; with none, no side.
        for number, corners in ((1, (1, 2)), (0, (0, 1, 2))):
            chosen, where = pairs[shared == number], same[shared == number]
            starts = [where.any(2 - side).argmax(1)[:, None] for side in (0, 1)]  # the shared vertex, or 0
            turned = [(start + numpy.arange(3)) % 3 for start in starts]
            numbers = [numpy.take_along_axis(triangles[chosen[:, side]], turned[side], 1) for side in (0, 1)]
            for first in (0, 1):
                kept = ~on_one_side(exact[numbers[first]], exact[numbers[1 - first]], corners)
                numbers, chosen = [each[kept] for each in numbers], chosen[kept]
            for row, pair in enumerate(chosen.tolist()):
                one, other = (exact[each[row]] for each in numbers)
                if any(meets(s[k], s[k - 1], t) for s, t in ((one, other), (other, one))
                       for k in (corners[1:] if number else corners)):
                    raise Refused(f"triangles {pair[0]} and {pair[1]} intersect")
    return count


def pieces(numbers, at, count, targets):
    """Returns pieces [(triangle, corners, target)] of `count` trees, with whole barycentric coordinates, the
    shares of triangles that are not covered, and the position after the trees."""
    whole_triangle = [(1, 0, 0), (0, 1, 0), (0, 0, 1)]
    found, uncovered = [], []
    try:
        for triangle in range(count):
            last = 0 if triangle % 256 == 0 else last
            stack = [whole_triangle]
            while stack:
                piece, code = stack.pop(), numbers[at]
                at += 1
                if code == 1:
                    parts = divided(piece, numbers[at:at + 3])
                    at += 3
                    stack += parts[::-1]
                elif code == 0:
                    uncovered.append((triangle, piece))
                else:
                    step = code - 2
                    last += -(step + 1) // 2 if step % 2 else step // 2
                    if code < 0 or not 0 <= last < targets:
                        raise Refused("a piece is assigned to a triangle that does not exist")
                    found.append((triangle, piece, last))
    except IndexError:
        raise Refused("the certificate ends too early") from None
    return found, uncovered, at


def divided(piece, line):
    """Returns the parts of a convex polygon where the linear function of the line is >= 0, and <= 0."""
    parts = ([], [])
    values = [sum(c * x for c, x in zip(line, corner)) for corner in piece]
    for i, corner in enumerate(piece):
        here, there, beyond = values[i], values[i - len(piece) + 1], piece[i - len(piece) + 1]
        if here >= 0:
            parts[0].append(corner)
        if here <= 0:
            parts[1].append(corner)
        if here > 0 > there or here < 0 < there:
            between = [abs(there) * x + abs(here) * y for x, y in zip(corner, beyond)]
            common = math.gcd(*between)
            for part in parts:
                part.append(tuple(x // common for x in between))
    return parts


def weights_of_nearest(p, triangles):
    """Returns barycentric coordinates of points of triangles that are nearly nearest to p."""
    a, b, c = (triangles[:, i] for i in range(3))

    def along(start, end):
        side = end - start
        length = dot(side, side)
        return numpy.clip(dot(p - start, side) / numpy.where(length > 0, length, 1), 0, 1)

    candidates = []
    for i, (start, end) in enumerate(((a, b), (b, c), (c, a))):
        t, weights = along(start, end), numpy.zeros((len(p), 3))
        weights[:, i], weights[:, (i + 1) % 3] = 1 - t, t
        candidates.append(weights)
    normal = cross(b - a, c - a)
    square = numpy.where(dot(normal, normal) > 0, dot(normal, normal), 1)
    v, w = dot(cross(p - a, c - a), normal) / square, dot(cross(b - a, p - a), normal) / square
    inside = numpy.stack([1 - v - w, v, w], 1)
    inside[(inside < 0).any(1)] = [1, 0, 0]
    candidates.append(inside)
    candidates = numpy.stack(candidates, 1)
    distances = numpy.linalg.norm((candidates[..., None] * triangles[:, None]).sum(2) - p[:, None], axis=2)
    return candidates[numpy.arange(len(p)), distances.argmin(1)]


def check_distance(found, mesh, other, squared, name):
    """Raises Refused unless all corners of the pieces are within the error, whose square is given. Meshes are
    triangles, points, and points as whole numbers."""
    triangles, points, exact = mesh
    other, other_points, other_exact = other
    for start in range(0, len(found), BLOCK):
        block = found[start:start + BLOCK]
        sizes = [len(piece) for _, piece, _ in block]
        number = numpy.repeat([triangle for triangle, _, _ in block], sizes)
        target = numpy.repeat([target for _, _, target in block], sizes)
        weights = numpy.array([corner for _, piece, _ in block for corner in piece], object)
        total = weights.sum(1)
        place = (weights[:, :, None] * exact[triangles[number]]).sum(1)  # times total
        shares = (weights / total[:, None]).astype(float)
        near = weights_of_nearest((shares[:, :, None] * points[triangles[number]]).sum(1),
                                  other_points[other[target]])
        proposed = numpy.rint(near * 2.0**BITS).astype(numpy.int64)
        proposed[numpy.arange(len(near)), near.argmax(1)] += 2**BITS - proposed.sum(1)
        nearest = (proposed.astype(object)[:, :, None] * other_exact[other[target]]).sum(1)  # times 2^BITS
        apart = place * 2**BITS - nearest * total[:, None]
        far = numpy.array(dot(apart, apart) * squared.denominator
                          > squared.numerator * (total * 2**BITS)**2, bool) | (proposed < 0).any(1)
        if far.any():
            row = numpy.flatnonzero(far)[0]
            raise Refused(f"{name} {number[row]} is not shown to be within the error of triangle "
                          f"{target[row]} of the other mesh")


def share(uncovered, corners):
    """Returns the area of pieces, and its share of all triangles."""
    area = numpy.linalg.norm(cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    left = 0.0
    for triangle, piece in uncovered:
        b = numpy.array([[x / sum(corner) for x in corner] for corner in piece])
        left += area[triangle] * sum(abs(numpy.linalg.det(b[[0, i - 1, i]])) for i in range(2, len(b)))
    return left, left / area.sum()


def verify(source, output, header, numbers, uncovered=0.0):
    """Returns what is verified of two meshes, each points and polygons as of read(). Raises Refused."""
    cuts, at = None, 0
    if header["cuts"]:
        at = 3 * header["input_triangles"]
        cuts = [numbers[i:i + 3] for i in range(0, at, 3)]
    given, made = triangles_of(source[1], cuts), triangles_of(output[1], None)
    if (len(given), len(made)) != (header["input_triangles"], header["output_triangles"]):
        raise Refused("the certificate is about other meshes: the numbers of triangles differ")
    (given_exact, made_exact), exponent = whole(source[0], output[0])
    middle = (source[0][given].min((0, 1)) + source[0][given].max((0, 1))) / 2
    given, made = (given, source[0] - middle, given_exact), (made, output[0] - middle, made_exact)

    check_topology(made[0])
    a, b, c = (made_exact[made[0][:, i]] for i in range(3))
    if dot(a, cross(b, c)).sum() <= 0:
        raise Refused("the mesh encloses no positive volume")
    found = {"error": float(header["error"]), "pairs": check_embedding(*made), "pieces": 0}
    squared = (fractions.Fraction(found["error"]) / fractions.Fraction(2)**exponent)**2
    for name, mesh, other in (("output", made, given), ("input", given, made)):
        assigned, left, at = pieces(numbers, at, len(mesh[0]), len(other[0]))
        check_distance(assigned, mesh, other, squared, f"{name} triangle")
        found["pieces"] += len(assigned)
        found[f"{name}_triangles"] = len(mesh[0])
        found[f"uncovered_{name}"], part = share(left, mesh[1][mesh[0]])
        if part > uncovered:
            raise Refused(f"the certificate does not cover {100 * part:.3g}% of the area of the {name}")
    if at != len(numbers):
        raise Refused("the certificate has more trees than there are triangles")
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("input")
    parser.add_argument("output")
    parser.add_argument("certificate")
    parser.add_argument("--uncovered", type=float, default=0.0, metavar="SHARE",
                        help="share of the area of either mesh that the certificate need not cover, such as "
                        "polygons inside the solid (default: 0)")
    parser.add_argument("--json", action="store_true", help="print a JSON object")
    arguments = parser.parse_args()
    try:
        made = verify(read(arguments.input), read(arguments.output), *read_certificate(arguments.certificate),
                      arguments.uncovered)
    except (Refused, Unreadable) as error:
        made = {"verified": False, "reason": str(error)}
        print(json.dumps(made) if arguments.json else f"NOT verified: {error}",
              file=sys.stdout if arguments.json else sys.stderr)
        return 1 if isinstance(error, Refused) else 2
    if arguments.json:
        print(json.dumps({"verified": True} | made))
    else:
        print(f"verified: {made['output_triangles']} triangles, closed, manifold and free of "
              f"self-intersection; they and the {made['input_triangles']} triangles of the input are within "
              f"{made['error']:.6g} of each other")
        for name in ("output", "input"):
            if made[f"uncovered_{name}"] > 0:
                print(f"except an area of {made[f'uncovered_{name}']:.4g} of the {name}, not covered")
    return 0


if __name__ == "__main__":
    sys.exit(main())
