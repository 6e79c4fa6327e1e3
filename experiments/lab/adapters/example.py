"""An adapter in Python: writes the convex hull of an OBJ, OFF, PLY or STL file (PROTOCOL.md)."""

import json
import pathlib
import sys
import time
sys.path.append(str(pathlib.Path(__file__).parents[3]))
import numpy
from scipy.spatial import ConvexHull
from experiments.lab import polygons

request = json.loads(pathlib.Path(sys.argv[-1]).read_text())
result = {"status": "done", "claims": {"watertight": True, "manifold": True}}
try:
    points = numpy.unique(polygons.read(request["input"])[0].reshape(-1, 3), axis=0)
    start = time.monotonic()
    hull = ConvexHull(points)
    normals = numpy.cross(*(points[hull.simplices[:, i]] - points[hull.simplices[:, 0]] for i in (1, 2)))
    is_inwards = (normals * hull.equations[:, :3]).sum(axis=1) < 0
    triangles = numpy.where(is_inwards[:, None], hull.simplices[:, ::-1], hull.simplices)
    result["seconds"] = time.monotonic() - start
    with open(request["output"], "w") as out:
        head = "".join(f"property double {axis}\n" for axis in "xyz")
        out.write(f"ply\nformat ascii 1.0\nelement vertex {len(points)}\n{head}"
                  f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n")
        out.writelines("%.17g %.17g %.17g\n" % tuple(point) for point in points)
        out.writelines("3 %d %d %d\n" % tuple(corners) for corners in triangles)
except ValueError as error:  # QhullError is one
    result = {"status": "refused", "message": str(error).splitlines()[0]}
pathlib.Path(request["result"]).write_text(json.dumps(result))
