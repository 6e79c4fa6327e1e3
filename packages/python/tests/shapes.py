"""Meshes that the tests share."""

import numpy as np


def torus(large=1.0, small=0.4, around=48, across=24):
    """Points (n, 3) float32 and triangles (m, 3) uint32 of a torus about the z axis."""
    u, v = np.meshgrid(2 * np.pi * np.arange(around) / around, 2 * np.pi * np.arange(across) / across,
                       indexing="ij")
    radius = large + small * np.cos(v)
    points = np.stack([radius * np.cos(u), radius * np.sin(u), small * np.sin(v)], axis=-1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")
    at = lambda a, b: (a % around) * across + b % across
    quads = np.stack([at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)], axis=-1).reshape(-1, 4)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    return points.astype(np.float32), np.ascontiguousarray(triangles, np.uint32)


def cube(side=1.0, lower=(0, 0, 0)):
    """Points (8, 3) float64 and quads (6, 4) int64 of an axis-aligned cube."""
    corners = np.array([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)], float)
    quads = np.array([[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]])
    return side * corners + np.asarray(lower, float), quads


def volume_of(mesh):
    """Of a closed hermesh.Mesh: the sum over its triangles of the tetrahedra with the origin."""
    p = mesh.world_points()
    a, b, c = (p[mesh.triangulated()[:, i]] for i in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)
