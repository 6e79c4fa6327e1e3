
import pathlib
import sys

import numpy as np

import hermesh

folder = pathlib.Path(sys.argv[1])
folder.mkdir(exist_ok=True)
rng = np.random.default_rng(1)
u, v = np.meshgrid(np.arange(96) * 2 * np.pi / 96, np.arange(48) * 2 * np.pi / 48, indexing="ij")
index = lambda i, j: (i % 96) * 48 + j % 48
i, j = np.meshgrid(np.arange(96), np.arange(48), indexing="ij")
corners = np.stack([index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)], -1).reshape(-1, 4)
torus = np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]])
for name, tube, share_of_holes in (("ring", 8, 0.002), ("tyre", 12, 0.005), ("bagel", 16, 0.01)):
    radius = 40 + tube * np.cos(v)
    points = np.stack([radius * np.cos(u), radius * np.sin(u), tube * np.sin(v)], -1).reshape(-1, 3)
    points += rng.normal(0, 0.02, points.shape)
    triangles = torus[rng.random(len(torus)) > share_of_holes]
    hermesh.write_mesh(folder / f"{name}.stl", (points, triangles))
