"""OpenVDB, a level set and its mesh: openvdb.py [ADAPTIVITY] REQUEST

The narrow band has the default half width of 3 voxels (openvdb/Types.h, LEVEL_SET_HALF_WIDTH). Adaptivity is
0 by default, which gives quads only, and at most 1 (openvdb/tools/VolumeToMesh.h: "higher thresholds will
allow more variation in polygon size"). The documentation promises no topology and no distance. The polygons
have their normals inside, so they are flipped. Points have single precision, as OpenVDB returns them.
"""
import sys

import adapter


def remesh(request, points, triangles):
    adaptivity = float(sys.argv[1]) if len(sys.argv) > 2 else 0.0
    transform = vdb.createLinearTransform(voxelSize=adapter.length(request))
    grid = vdb.FloatGrid.createLevelSetFromPolygons(points, triangles=triangles, transform=transform)
    points, triangles, quads = grid.convertToPolygons(adaptivity=adaptivity)
    return points, [triangles[:, ::-1], quads[:, ::-1]]


vdb = adapter.require("pyopenvdb", "python3-openvdb")
adapter.run(adapter.with_arrays(remesh))
