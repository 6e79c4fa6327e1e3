"""Facts of triangle meshes with whole coordinates, exact and without code of the program.

Coordinates are below LIMIT in magnitude, so that determinants of three differences fit 64 bits.
"""

import numpy
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

LIMIT = 2**19
# Counts of the validation report, named as in its JSON.
COUNTS = ("points", "triangles", "boundary_edges", "non_manifold_edges", "non_manifold_vertices",
          "inconsistent_edges", "degenerate_polygons", "duplicate_polygons", "isolated_points", "components",
          "euler_characteristic")
PAIRS = ("disjoint", "vertex_sharing", "edge_sharing")


def _components(count, pairs):
    ones = numpy.ones(len(pairs), bool)
    return connected_components(coo_matrix((ones, (pairs[:, 0], pairs[:, 1])), (count, count)), False)


def components(points, triangles):
    """Returns a label of each vertex: triangles that share a vertex have the same one."""
    return _components(len(points), numpy.concatenate([triangles[:, :2], triangles[:, 1:]]))[1]


def determinant(a, b, c, d):
    """Returns six times the volumes of tetrahedra (n, 3), positive if d sees a, b, c clockwise."""
    u, v, w = b - a, c - a, d - a
    return (u * numpy.cross(v, w)).sum(axis=-1)


def topology(points, triangles):
    """Returns the counts of edges, vertices and polygons."""
    sides = numpy.concatenate([triangles[:, [k, (k + 1) % 3]] for k in range(3)])
    of = numpy.tile(numpy.arange(len(triangles)), 3)  # triangle of each side
    of, sides = of[is_edge := sides[:, 0] != sides[:, 1]], sides[is_edge]
    edges, edge_of, uses = numpy.unique(numpy.sort(sides), axis=0, return_inverse=True, return_counts=True)
    ascending = numpy.bincount(edge_of, sides[:, 0] < sides[:, 1], len(edges))
    # Fans: a node for each triangle at each of its vertices, and links through the ends of each edge.
    nodes, node = numpy.unique(numpy.stack([sides.ravel(), of.repeat(2)]), axis=1, return_inverse=True)
    ends = numpy.stack([edge_of, edge_of], axis=1).ravel() * 2 + (sides == sides.max(axis=1)[:, None]).ravel()
    hubs = len(nodes[0]) + ends
    fan = _components(hubs.max(initial=0) + 1, numpy.stack([node, hubs], axis=1))[1][:len(nodes[0])]
    fans_at = numpy.unique(numpy.stack([nodes[0], fan]), axis=1)[0]
    used = numpy.unique(triangles)
    return {"points": len(points), "triangles": len(triangles), "boundary_edges": (uses == 1).sum(),
            "non_manifold_edges": (uses > 2).sum(),
            "non_manifold_vertices": (numpy.bincount(fans_at) > 1).sum(),
            "inconsistent_edges": ((uses == 2) & (ascending != 1)).sum(),
            "duplicate_polygons": len(triangles) - len(numpy.unique(numpy.sort(triangles), axis=0)),
            "isolated_points": len(points) - len(used),
            "components": len(numpy.unique(components(points, triangles)[used])),
            "euler_characteristic": len(used) - len(edges) + len(triangles)}


def _meets(segment, triangle):
    """Returns which closed segments (n, 2, 3) have a point in common with closed triangles (n, 3, 3)."""
    p, q = segment[:, 0], segment[:, 1]
    a, b, c = (triangle[:, k] for k in range(3))
    side = numpy.sign([determinant(a, b, c, p), determinant(a, b, c, q)])
    turns = numpy.sign([determinant(p, q, a, b), determinant(p, q, b, c), determinant(p, q, c, a)])
    through = ~((turns > 0).any(axis=0) & (turns < 0).any(axis=0))
    flat = ~side.any(axis=0)
    result = through & (side.prod(axis=0) <= 0) & ~flat
    if flat.any():
        result[flat] = _meets_in_plane(segment[flat], triangle[flat])
    return result


def _meets_in_plane(segment, triangle):
    """Returns the same of segments in the planes of their triangles."""
    normal = abs(numpy.cross(triangle[:, 1] - triangle[:, 0], triangle[:, 2] - triangle[:, 0]))
    axes = numpy.array([[1, 2], [0, 2], [0, 1]])[normal.argmax(axis=1)][:, None]
    p, q = numpy.take_along_axis(segment, axes, 2).transpose(1, 0, 2)
    corners = numpy.take_along_axis(triangle, axes, 2).transpose(1, 0, 2)

    def turn(a, b, c):
        u, v = b - a, c - a
        return numpy.sign(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])

    result = numpy.zeros(len(p), bool)
    for end in (p, q):  # within the triangle
        turns = numpy.array([turn(corners[k], corners[k - 2], end) for k in range(3)])
        result |= (turns >= 0).all(axis=0) | (turns <= 0).all(axis=0)
    low, high = numpy.minimum(p, q), numpy.maximum(p, q)
    for k in range(3):  # across a side of it
        a, b = corners[k], corners[k - 2]
        boxes = ((numpy.minimum(a, b) <= high) & (low <= numpy.maximum(a, b))).all(axis=1)
        result |= boxes & (turn(p, q, a) * turn(p, q, b) <= 0) & (turn(a, b, p) * turn(a, b, q) <= 0)
    return result


def _rotated(triangles, corner):
    """Returns triangles (n, 3) that start at their given corner (n)."""
    return numpy.take_along_axis(triangles, (corner[:, None] + numpy.arange(3)) % 3, 1)


def _overlapping_boxes(corners):
    low, high = corners.min(axis=1), corners.max(axis=1)
    meet = numpy.ones((len(low), len(low)), bool)
    for axis in range(3):
        meet &= low[:, None, axis] <= high[None, :, axis]
    return numpy.argwhere(numpy.triu(meet & meet.T, 1))


def intersections(points, triangles):
    """Returns pairs of triangles that intersect beyond their common vertices, by the number of these.

    Returns three arrays of pairs (disjoint, sharing a vertex, sharing an edge); degenerate triangles are
    left out.
    """
    area = numpy.cross(points[triangles[:, 1]] - points[triangles[:, 0]],
                       points[triangles[:, 2]] - points[triangles[:, 0]])
    proper = numpy.flatnonzero(area.any(axis=1))
    pairs = proper[_overlapping_boxes(points[triangles[proper]])]
    first, second = triangles[pairs[:, 0]], triangles[pairs[:, 1]]
    equal = first[:, :, None] == second[:, None, :]
    shared = equal.sum(axis=(1, 2))
    found = []

    apart = shared == 0
    a, b = points[first[apart]], points[second[apart]]
    meet = numpy.zeros(apart.sum(), bool)
    for k in range(3):
        meet |= _meets(a[:, [k, k - 2]], b) | _meets(b[:, [k, k - 2]], a)
    found.append(pairs[apart][meet])

    one = shared == 1
    # The segment or area that they have in common reaches the side opposite to the vertex in one of them.
    a = points[_rotated(first[one], equal[one].any(axis=2).argmax(axis=1))]
    b = points[_rotated(second[one], equal[one].any(axis=1).argmax(axis=1))]
    found.append(pairs[one][_meets(a[:, 1:], b) | _meets(b[:, 1:], a)])

    two = shared == 2
    a = points[_rotated(first[two], (~equal[two].any(axis=2)).argmax(axis=1))]  # the free corner first
    b = points[_rotated(second[two], (~equal[two].any(axis=1)).argmax(axis=1))][:, 0]
    along = a[:, 2] - a[:, 1]
    normals = [numpy.cross(along, free - a[:, 1]) for free in (a[:, 0], b)]
    # Products of two normals may exceed 64 bits; their largest component shows the direction.
    largest = abs(normals[0]).argmax(axis=1)[:, None]
    signs = [numpy.sign(numpy.take_along_axis(normal, largest, 1))[:, 0] for normal in normals]
    folded = (determinant(a[:, 0], a[:, 1], a[:, 2], b) == 0) & (signs[0] == signs[1])
    found.append(numpy.concatenate([pairs[two][folded], pairs[shared == 3]]))
    return found


def volume(points, triangles):
    """Returns six times the volume within closed triangles, about the origin."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return int((a * numpy.cross(b, c)).sum())


def winding_number(point, points, triangles):
    """Returns how often closed triangles wind around a point, by their solid angles."""
    a, b, c = (points[triangles[:, k]] - point + 0.0 for k in range(3))
    la, lb, lc = (numpy.linalg.norm(v, axis=1) for v in (a, b, c))
    above = (a * numpy.cross(b, c)).sum(axis=1)
    below = (la * lb * lc + (a * b).sum(axis=1) * lc + (b * c).sum(axis=1) * la + (c * a).sum(axis=1) * lb)
    return round(numpy.arctan2(above, below).sum() / (2 * numpy.pi))


def bodies(points, triangles):
    """Returns the number of components with a positive volume."""
    label = components(points, triangles)[triangles[:, 0]]
    return sum(volume(points, triangles[label == own]) > 0 for own in numpy.unique(label))


def inside_out(points, triangles):
    """Returns how many components have a negative volume and are not within others, as cavities are."""
    label, count = components(points, triangles)[triangles[:, 0]], 0
    for own in numpy.unique(label):
        is_own = label == own
        if volume(points, triangles[is_own]) < 0:
            start = points[triangles[is_own][0, 0]]
            count += is_own.all() or winding_number(start, points, triangles[~is_own]) <= 0
    return int(count)


def smallest_angle(points, triangles):
    """Returns the smallest angle in degrees."""
    angles = []
    for k in range(3):
        u, v = (points[triangles[:, k - j]] - points[triangles[:, k]] for j in (1, 2))
        angles.append(numpy.arctan2(numpy.linalg.norm(numpy.cross(u, v), axis=1), (u * v).sum(axis=1)))
    return float(numpy.degrees(numpy.min(angles)))


def facts(points, triangles):
    """Returns COUNTS, PAIRS, inside_out_components (None if unknown) and smallest_angle of a mesh."""
    if abs(points).max() >= LIMIT:
        raise ValueError(f"coordinates reach {abs(points).max()}; they must be below {LIMIT}")
    found = topology(points, triangles)
    area = numpy.cross(points[triangles[:, 1]] - points[triangles[:, 0]],
                       points[triangles[:, 2]] - points[triangles[:, 0]])
    found["degenerate_polygons"] = (~area.any(axis=1)).sum()
    found |= dict(zip(PAIRS, map(len, intersections(points, triangles))))
    found = {name: int(count) for name, count in found.items()}
    bounds = not (found["boundary_edges"] or found["inconsistent_edges"])
    embedded = not (found["non_manifold_edges"] or any(found[kind] for kind in PAIRS))
    found["inside_out_components"] = inside_out(points, triangles) if bounds and embedded else None
    found["smallest_angle"] = 0.0 if found["degenerate_polygons"] else smallest_angle(points, triangles)
    return found
