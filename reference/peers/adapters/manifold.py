"""Manifold's simplify, Boolean operations (task combine) and splitByPlane (fracture): manifold.py REQUEST

It refuses meshes that are not manifold. The tolerance is the error, or a quarter of a voxel. The reference of
Manifold.simplify states that "all surfaces will have moved by less than tolerance"; each Manifold is an
"oriented, 2-manifold, triangle mesh", which is closed.
"""
import adapter


def work(request):
    command = [*adapter.node("manifold_peer.mjs"), "IN.obj", "OUT.obj"]
    if request["task"] == "combine":
        return adapter.with_files(request, [*command, request["operation"], "SECOND.obj"],
                                  refusal="ManifoldError", watertight=True, manifold=True)
    if request["task"] == "fracture":
        command = [*adapter.node("manifold_peer.mjs"), "IN.obj", "OUT", "cut", request["planes"]]
        return adapter.with_files(request, command, refusal="ManifoldError", watertight=True, manifold=True)
    tolerance = request.get("error") or 0.25 * request["voxel_size"]
    return adapter.with_files(request, [*command, tolerance], refusal="ManifoldError", watertight=True,
                              manifold=True, distance_to_input=tolerance, distance_from_input=tolerance)


adapter.run(work)
