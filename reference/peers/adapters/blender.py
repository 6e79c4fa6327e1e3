"""Blender's modifiers Remesh and Boolean, and its Bisect: blender.py voxel|sharp|boolean|cut REQUEST

Modes Voxel and Sharp with their defaults (User Manual, Modeling, Modifiers, Remesh), except that Remove
Disconnected is off in mode Sharp: by default it removes all bodies but the largest. Octree depth and scale
give cells of the requested size. The manual promises "a new manifold mesh" in mode Voxel, and nothing in mode
Sharp. The modifier Boolean has the solver Exact and its other defaults. Its polygons have many corners, and
are split with the default of the modifier Triangulate for them, Beauty. The manual promises no topology.
Bisect runs once for each side of a plane, with Fill (User Manual, Meshes, Editing, Mesh, Bisect).
"""
import sys

import adapter


def work(request):
    mode = sys.argv[1]
    blender = adapter.program("blender", "install the package blender")
    command = [blender, "--background", "--factory-startup", "--threads", request.get("threads") or 0,
               "--python-exit-code", "1", "--python", adapter.PEERS / "blender_peer.py", "--", "IN.obj",
               "OUT.obj"]
    if mode == "boolean":
        return adapter.with_files(request, [*command, request["operation"], "SECOND.obj"])
    if mode == "cut":
        return adapter.with_files(request, ["OUT" if word == "OUT.obj" else word for word in command]
                                  + ["cut", request["planes"]])
    command += [adapter.length(request), "sharp" if mode == "sharp" else "0"]
    return adapter.with_files(request, command, **({"manifold": True} if mode == "voxel" else {}))


adapter.run(work)
