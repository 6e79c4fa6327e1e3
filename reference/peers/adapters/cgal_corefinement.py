"""CGAL's Boolean operations by corefinement: cgal_corefinement.py REQUEST

corefine_and_compute_union, _intersection and _difference with their defaults (User Manual, Polygon Mesh
Processing, Boolean Operations). They take closed meshes that bound a volume, and return false if the result
is not manifold, which is a refusal here. So each result is closed and manifold; vertices on intersections are
rounded, so freedom of self-intersections is not claimed.
"""
import adapter


def work(request):
    command = [adapter.peer_program("cgal_peer"), request["operation"], "IN.obj", "OUT.obj", "SECOND.obj"]
    return adapter.with_files(request, command, refusal="CGAL cannot", watertight=True, manifold=True)


adapter.run(work)
