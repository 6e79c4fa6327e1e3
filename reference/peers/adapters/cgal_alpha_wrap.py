"""CGAL's alpha_wrap_3: cgal_alpha_wrap.py [ALPHA IN VOXELS] REQUEST

The offset is a thirtieth of alpha, as in the examples of the user manual (3D Alpha Wrapping, Examples), which
recommends "a small fraction of alpha" (Offset). Alpha is 1 voxel by default: the wrap enters cavities with a
diameter of two voxels. With an error, alpha plus offset is the error. The program is in $HERMESH_PEERS or
build/release/reference/peers.

The reference of alpha_wrap_3 promises a "watertight, 2-manifold, and intersection-free" mesh that strictly
contains the input. The manual states no bound of a distance, so none is claimed.
"""
import sys

import adapter

RATIO = 1 / 30


def work(request):
    voxels = float(sys.argv[1]) if len(sys.argv) > 2 else 1.0
    alpha = request["error"] / (1 + RATIO) if request.get("error") else request["voxel_size"] * voxels
    command = [adapter.peer_program("cgal_peer"), "alpha-wrap", "IN.obj", "OUT.obj", alpha, alpha * RATIO]
    return adapter.with_files(request, command, watertight=True, manifold=True,
                              intersection_free=True)


adapter.run(work)
