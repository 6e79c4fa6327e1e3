"""scikit-image's marching cubes (Lewiner): skimage_peer.py VOLUME.vdb OUT.obj"""
import sys

import peer

try:
    import numpy
    import pyopenvdb
    from skimage.measure import marching_cubes
except ImportError as missing:
    peer.absent(f"scikit-image needs the packages python3-skimage and python3-openvdb ({missing})")

grid = pyopenvdb.read(sys.argv[1], "sdf")
low, high = grid.evalActiveVoxelBoundingBox()
low, high = numpy.array(low) - 1, numpy.array(high) + 1
values = numpy.zeros(high - low + 1, dtype=numpy.float32)
grid.copyToArray(values, ijk=tuple(int(x) for x in low))
voxel = grid.transform.voxelSize()[0]
# The gallery's example; the gradient of a distance field points out of the solid, which is `ascent` here.
points, triangles, _, _ = peer.measured(
    lambda: marching_cubes(values, 0.0, spacing=(voxel,) * 3, gradient_direction="ascent"))
peer.write_obj(sys.argv[2], points + grid.transform.indexToWorld(tuple(float(x) for x in low)), triangles)
