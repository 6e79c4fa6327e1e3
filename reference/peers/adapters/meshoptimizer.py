"""meshoptimizer's remesh: meshoptimizer.py REQUEST

Resolution of the longest side, at most 256, and the flag Solve. The release notes of version 1.3 describe the
result as "a closed mesh", which is the claim watertight. They promise no distance, and say that features closer than a
voxel may be merged.
"""
import adapter

adapter.run(lambda request: adapter.with_files(
    request, [*adapter.node("meshoptimizer_peer.mjs"), "remesh", "IN.obj", "OUT.obj", adapter.length(request)],
    watertight=True))
