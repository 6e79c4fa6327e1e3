"""meshoptimizer's remesh: meshoptimizer.py REQUEST

Resolution of the longest side, at most 256, and the flag Solve. The release notes of version 1.3 describe the
result as "a closed mesh", which is the claim watertight; they promise no distance, and state that features
closer than a voxel may be merged. The function is experimental (README).
"""
import adapter


def work(request):
    command = [*adapter.node("meshoptimizer_peer.mjs"), "remesh", "IN.obj", "OUT.obj"]
    return adapter.with_files(request, [*command, adapter.length(request)], watertight=True)


adapter.run(work)
