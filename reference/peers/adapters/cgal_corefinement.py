"""CGAL's Boolean operations by corefinement, or for the task fracture its cuts: cgal_corefinement.py REQUEST

corefine_and_compute_union, _intersection and _difference with their defaults (User Manual, Polygon Mesh
Processing, Boolean Operations), and clip with a plane and clip_volume, once for each side. They take closed
meshes that bound a volume, and return false if the result is not manifold, which is a refusal here. So each
result is closed and manifold; vertices on intersections are rounded, so freedom of self-intersections is not
claimed.
"""
import adapter


def work(request):
    peer = adapter.peer_program("cgal_peer")
    command = [peer, "cut", "IN.obj", "OUT", request["planes"]] if request["task"] == "fracture" else \
        [peer, request["operation"], "IN.obj", "OUT.obj", "SECOND.obj"]
    return adapter.with_files(request, command, refusal="CGAL cannot", watertight=True, manifold=True)


adapter.run(work)
