"""hermesh itself: hermesh.py [OPTION OF hermesh remesh]... REQUEST

`hermesh list` states the guarantees of each extractor; distances are certified with --error only, and reported by
--json. The program is $HERMESH or build/release/hermesh.
"""
import json
import os
import subprocess
import sys

import adapter

DEFAULT = "manifold-dual-contouring"
GUARANTEES = {"watertight": "closed", "manifold": "manifold", "intersection_free": "no_self_intersection"}
DISTANCES = {"distance_to_input": "certified_to_polygons", "distance_from_input": "certified_from_polygons"}


def guarantees(program, extractor):
    listed = json.loads(subprocess.run([program, "list", "--json"], capture_output=True, text=True).stdout)
    promises = next(entry["promises"] for entry in listed["extractors"] if entry["name"] == extractor)
    return {claim: promises[name] for claim, name in GUARANTEES.items() if promises[name]}


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
    # With --error the method is chosen for the bound, with the guarantees of the default extractor.
    extractor = DEFAULT if request.get("error") else report["result"]["extractor"]
    claims = guarantees(program, extractor)
    claims |= {claim: report["figures"][name] for claim, name in DISTANCES.items() if name in report["figures"]}
    seconds = sum(stage["seconds"] for stage in report["stage_seconds"] if stage["stage"] not in ("read", "write"))
    return {"seconds": seconds, "claims": claims}


adapter.run(work)
