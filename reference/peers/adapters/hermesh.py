"""hermesh itself: hermesh.py [OPTION OF hermesh remesh]... REQUEST

`hermesh list` states the guarantees of each extractor; with an error, --json reports certified distances. The
program is $HERMESH or build/release/hermesh. It reads the input itself, in double precision.
"""
import json
import os
import subprocess
import sys

import adapter

DEFAULT = "manifold-dual-contouring"
GUARANTEES = {"watertight": "closed", "manifold": "manifold", "intersection_free": "no_self_intersection"}
DISTANCES = {"distance_to_input": "certified_to_polygons", "distance_from_input": "certified_from_polygons"}


def call(*arguments):
    program = adapter.program(os.environ.get("HERMESH", str(adapter.BUILD / "hermesh")), "build it")
    done = subprocess.run([program, *arguments, "--json"], capture_output=True, text=True)
    try:
        return json.loads(done.stdout)
    except ValueError:
        adapter.fail_like(done)


def work(request):
    size = "error" if request.get("error") else "voxel_size"
    threads = ["--threads", str(request["threads"])] if request.get("threads") else []
    report = call("remesh", request["input"], request["output"], "--" + size.replace("_", "-"),
                  repr(request[size]), *threads, *sys.argv[1:-1])
    if report["exit_code"]:
        raise adapter.Refused(report["error"] or " ".join(report["notes"]))
    # With an error the method is chosen for the bound, with the guarantees of the default extractor.
    name = DEFAULT if size == "error" else report["result"]["extractor"]
    listed = next(entry["promises"] for entry in call("list")["extractors"] if entry["name"] == name)
    claims = {claim: listed[guarantee] for claim, guarantee in GUARANTEES.items() if listed[guarantee]}
    figures = report["figures"]
    claims |= {claim: figures[figure] for claim, figure in DISTANCES.items() if figure in figures}
    stages = [stage for stage in report["stage_seconds"] if stage["stage"] not in ("read", "write")]
    return {"seconds": sum(stage["seconds"] for stage in stages), "claims": claims}


adapter.run(work)
