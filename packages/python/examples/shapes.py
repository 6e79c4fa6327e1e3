"""Models of the examples: those of the folder $HERMESH_DATA if it is set, else shapes that are computed."""

import os
import pathlib

import numpy as np


def model(name):
    """Path of a model in $HERMESH_DATA, or None where it is not there."""
    path = pathlib.Path(os.environ.get("HERMESH_DATA", "/nowhere"), name)
    return path if path.exists() else None


def torus(large=1.0, small=0.4, around=96, across=48):
    """Points (n, 3) and triangles (m, 3) of a torus about the z axis."""
    u, v = np.meshgrid(2 * np.pi * np.arange(around) / around, 2 * np.pi * np.arange(across) / across,
                       indexing="ij")
    radius = large + small * np.cos(v)
    points = np.stack([radius * np.cos(u), radius * np.sin(u), small * np.sin(v)], axis=-1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")
    at = lambda a, b: (a % around) * across + b % across
    quads = np.stack([at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)], axis=-1).reshape(-1, 4)
    return points.astype(np.float32), np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def box(lower, upper):
    """Points (8, 3) and quads (6, 4) of an axis-aligned box."""
    corners = np.array([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)])
    points = np.where(corners, upper, lower).astype(np.float32)
    return points, np.array([[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2],
                             [1, 3, 7, 5]])
