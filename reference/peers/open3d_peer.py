"""Open3D's quadric decimation: open3d_peer.py IN.obj OUT.obj FRACTION"""
import sys

import peer

try:
    import numpy
    import open3d
except ImportError as missing:
    peer.absent(f"Open3D needs the package python3-open3d ({missing})")

points, triangles = peer.read_obj(sys.argv[1])
mesh = open3d.geometry.TriangleMesh(open3d.utility.Vector3dVector(points), open3d.utility.Vector3iVector(triangles))
made = peer.measured(lambda: mesh.simplify_quadric_decimation(int(float(sys.argv[3]) * len(triangles))))
peer.write_obj(sys.argv[2], numpy.asarray(made.vertices), numpy.asarray(made.triangles))
