"""Compares the time and memory of a call of the module with the program: cost.py MESH RESOLUTION
[REPETITIONS]

Each runs in its own process, which reads the mesh, remeshes it and writes the result; the runs are
interleaved, so load on the machine affects both. $HERMESH_PROGRAM is the program, $PYTHONPATH has the module.
Prints the seconds of the work itself, those of the whole process and the peaks of resident memory; one copy
means the size of the arrays of both meshes. Exits with 1 if the results differ, or if, by medians and without
the start-up, the module takes over 3 % more CPU time, or more memory than one additional copy.
"""

import json
import os
import statistics
import subprocess
import sys
import tempfile

import hermesh

mesh, resolution = sys.argv[1], int(sys.argv[2])
repetitions = int(sys.argv[3]) if len(sys.argv) > 3 else 7

MODULE = """
import json, sys, time
import hermesh
log = hermesh.Log()
scan = hermesh.read_mesh(sys.argv[1], log=log)
points, triangles, origin = scan.points, scan.triangles, scan.origin
begun, begun_cpu = time.perf_counter(), time.process_time()
clean = hermesh.remesh(scan, resolution=int(sys.argv[2]), log=log)
seconds, cpu = time.perf_counter() - begun, time.process_time() - begun_cpu
arrays = clean.points, clean.triangles, clean.quads
clean.write(sys.argv[3], log=log)
size = sum(a.nbytes for a in (points, triangles, *arrays))
print(json.dumps({"call": seconds, "call_cpu": cpu, "array_bytes": size}))
"""


def run(command):
    """Seconds and peak of memory in MiB of a process, and what it prints."""
    process = subprocess.Popen(["/usr/bin/env", "time", "-f", "%e %U %S %M", *command],
                               stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    out, err = process.communicate()
    if process.returncode != 0:
        sys.exit(err)
    elapsed, user, system, peak = err.strip().splitlines()[-1].split()
    return float(elapsed), float(user) + float(system), int(peak) / 1024, out



with tempfile.TemporaryDirectory() as folder:
    theirs, ours = os.path.join(folder, "program.ply"), os.path.join(folder, "module.ply")
    program = [os.environ["HERMESH_PROGRAM"], "remesh", mesh, theirs, "--resolution", str(resolution),
               "--json"]
    module = [sys.executable, "-c", MODULE, mesh, str(resolution), ours]
    # The cost of either before any work.
    starts = {"program": [run([os.environ["HERMESH_PROGRAM"], "--version"]) for _ in range(3)],
              "module": [run([sys.executable, "-c", "import hermesh"]) for _ in range(3)]}
    rows = {"program": [], "module": []}
    for _ in range(repetitions):
        for name, command in (("program", program), ("module", module)):
            rows[name].append(run(command))
    with open(theirs, "rb") as a, open(ours, "rb") as b:
        same = a.read() == b.read()
        print("bytes:", "the same" if same else "DIFFERENT")
    for name, row in rows.items():
        print(f"{name:8} elapsed {' '.join(f'{r[0]:.2f}' for r in row)} s, median "
              f"{statistics.median(r[0] for r in row):.2f};"
              f" CPU median {statistics.median(r[1] for r in row):.2f} s; peak {min(r[2] for r in row):.0f} "
              f"to"
              f" {max(r[2] for r in row):.0f} MiB")
    over = {}
    for kind, of in (("least", min), ("median", statistics.median)):
        beyond = {name: [of(r[i] for r in row) - of(r[i] for r in starts[name]) for i in range(3)]
                  for name, row in rows.items()}
        for name, (elapsed, cpu, peak) in beyond.items():
            begin = [of(r[i] for r in starts[name]) for i in range(3)]
            print(f"{kind:6} {name:8} start {begin[0]:.2f} s, {begin[1]:.2f} s of CPU, {begin[2]:.0f} MiB;"
                  f" beyond the start {elapsed:.2f} s, {cpu:.2f} s of CPU, {peak:.1f} MiB")
        ours, theirs = beyond["module"], beyond["program"]
        over[kind] = 100 * (ours[1] / theirs[1] - 1), ours[2] - theirs[2]
        print(f"{kind:6} module over program, beyond the starts: elapsed "
              f"{100 * (ours[0] / theirs[0] - 1):+.1f} %,"
              f" CPU {over[kind][0]:+.1f} %, peak {over[kind][1]:+.1f} MiB")
    calls = [json.loads(row[3]) for row in rows["module"]]
    size = calls[0]["array_bytes"] / 2**20
    print(f"the call alone, on arrays that are there: median "
          f"{statistics.median(c['call'] for c in calls):.2f} s,"
          f" {statistics.median(c['call_cpu'] for c in calls):.2f} s of CPU")
    print(f"one copy of the arrays of both meshes: {size:.1f} MiB")
    more_cpu, more_memory = over["median"]
    sys.exit(0 if same and more_cpu <= 3 and more_memory <= size else 1)
