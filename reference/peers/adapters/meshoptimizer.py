"""meshoptimizer: meshoptimizer.py [simplify|update] REQUEST

remesh (default): resolution of the longest side, at most 256, and the flag Solve. The release notes of
version 1.3 describe the result as "a closed mesh", which is the claim watertight; they promise no distance,
and state that features closer than a voxel may be merged. The function is experimental (README).

simplify and update (simplifyWithUpdate, which moves vertices): the error is the absolute limit of its error
metric, with Prune ("generally recommended for full-mesh simplification", README, Simplifier). The README
calls the metric "an approximate measure of the deviation" and promises no distance.
"""
import sys

import adapter


def work(request):
    if len(sys.argv) > 2:
        return adapter.with_files(request, [*adapter.node("meshoptimizer_peer.mjs"), sys.argv[1], "IN.obj",
                                            "OUT.obj", request["error"]])
    command = [*adapter.node("meshoptimizer_peer.mjs"), "remesh", "IN.obj", "OUT.obj"]
    return adapter.with_files(request, [*command, adapter.length(request)], watertight=True)


adapter.run(work)
