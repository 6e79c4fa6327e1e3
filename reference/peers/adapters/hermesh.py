"""hermesh itself: hermesh.py [OPTION OF hermesh remesh]... REQUEST

Topology is guaranteed by the default extractor (algorithms/extraction/README.md). Distances are certified with
--error only; --json reports them. The program is $HERMESH or build/release/hermesh.
"""
import json
import os
import subprocess
import sys

import adapter

OUTSIDE_OF_THE_METHOD = ("read", "write")


def work(request):
    program = adapter.program(os.environ.get("HERMESH", str(adapter.PEERS.parents[1] / "build/release/hermesh")),
                              "build it")
    size = ["--error", repr(request["error"])] if request.get("error") else \
        ["--voxel-size", repr(request["voxel_size"])]
    threads = ["--threads", str(request["threads"])] if request.get("threads") else []
    done = subprocess.run([program, "remesh", request["input"], request["output"], *size, *threads, "--json",
                           *sys.argv[1:-1]], capture_output=True, text=True)
    try:
        report = json.loads(done.stdout)
    except ValueError:
        adapter.fail_like(done)
    if done.returncode:
        raise adapter.Refused(report["error"] or " ".join(report["notes"]))
    figures = report["figures"]
    distances = {"distance_to_input": figures.get("certified_to_polygons"),
                 "distance_from_input": figures.get("certified_from_polygons")}
    seconds = sum(stage["seconds"] for stage in report["stage_seconds"]
                  if not stage["stage"].startswith(OUTSIDE_OF_THE_METHOD))
    return {"seconds": seconds, "claims": {"watertight": True, "manifold": True, "intersection_free": True,
                                           **{name: value for name, value in distances.items() if value}}}


adapter.run(work)
