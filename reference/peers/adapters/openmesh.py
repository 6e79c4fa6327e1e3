"""OpenMesh's decimater within a distance: openmesh.py REQUEST

Quadrics give the order; ModHausdorff "only allows collapses if the Hausdorff distance after a collapse is
lower than the given tolerance" (ModHausdorffT.hh). It bounds the distances of the input's vertices to the
output, not those of other points, so no distance is claimed. OpenMesh takes manifold meshes only, and
ModNormalFlipping excludes no self-intersection, so no topology is claimed.
"""
import adapter


def work(request):
    command = [adapter.peer_program("openmesh_peer"), "IN.obj", "OUT.obj", request["error"]]
    return adapter.with_files(request, command)


adapter.run(work)
