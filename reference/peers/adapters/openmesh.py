"""OpenMesh's decimater within a distance: openmesh.py REQUEST

Quadrics give the order; ModHausdorff "only allows collapses if the Hausdorff distance after a collapse is
lower than the given tolerance" (ModHausdorffT.hh), which is claimed in both directions. OpenMesh takes
manifold meshes only, and ModNormalFlipping excludes no self-intersection, so no topology is claimed.
"""
import adapter


def work(request):
    command = [adapter.peer_program("openmesh_peer"), "IN.obj", "OUT.obj", request["error"]]
    return adapter.with_files(request, command, distance_to_input=request["error"],
                              distance_from_input=request["error"])


adapter.run(work)
