"""Vertex clustering: one point for each cell of a lattice. mine.py IN OUT CELL"""

import sys

import hermesh
import numpy as np

mesh = hermesh.read_mesh(sys.argv[1])
cells, triangles = mesh.world_points() // float(sys.argv[3]), mesh.triangulated()
_, cluster, size = np.unique(cells, axis=0, return_inverse=True, return_counts=True)
points = np.zeros((len(size), 3))
np.add.at(points, cluster, mesh.world_points())
triangles = cluster[triangles]
a, b, c = triangles.T
hermesh.write_mesh(sys.argv[2], (points / size[:, None], triangles[(a != b) & (b != c) & (c != a)]))
