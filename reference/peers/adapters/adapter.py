"""Shared by the adapters, which run other programs for `hermesh benchmark` (README.md, Adapters).

An adapter is started with the path of a request, a JSON file, as its last argument. It writes the mesh and
the result, another JSON file, or ends with exit code 77 if its program is not installed.

All programs but hermesh get the same polygons, because none of them reads every format: `assimp export`
converts the input to an OBJ file. It applies the transforms of the scene, splits polygons into triangles and
rounds the coordinates to single precision. Then points with identical coordinates are merged, and unused
points omitted. Nothing is repaired: holes, orientations, intersecting, duplicate and degenerate triangles
remain.
"""
import ctypes
import gzip
import importlib
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time

PEERS = pathlib.Path(__file__).resolve().parent.parent
BUILD = PEERS.parents[1] / "build/release"
NOT_INSTALLED = 77
SHELL_SIGNAL = 128  # plus its number is the exit code of a shell whose command ended by a signal
sys.path.append(str(PEERS))
import peer


class Refused(Exception):
    """The program does not accept the input, or made no mesh of it."""


def not_installed(message):
    print(message, file=sys.stderr)
    sys.exit(NOT_INSTALLED)


def require(module, package):
    """Imports a module of a Debian package."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        not_installed(f"install the package {package}: {error}")


def program(name, advice):
    """Returns the path of an executable file, or of a program in PATH."""
    return shutil.which(name) or not_installed(f"{name} is not installed; {advice}")


def node(script):
    """Returns the command of a peer in JavaScript. Without the option, V8 reserves more address space for its
    checks of memory accesses than the benchmark allows.
    """
    return [program("node", "install the package nodejs"), "--disable-wasm-trap-handler", PEERS / script]


def peer_program(name):
    """Returns the path of a peer in C++, in $HERMESH_PEERS or build/release/reference/peers."""
    directory = os.environ.get("HERMESH_PEERS", f"{BUILD}/reference/peers")
    return program(f"{directory}/{name}", "build the target peers")


def length(request):
    """Returns the voxel size, which is the requested error for programs without an error bound."""
    return request.get("voxel_size") or request["error"]


def fail_like(process):
    """Ends as a program did that failed: by the same signal, or with its messages and exit code."""
    messages = process.stderr.strip() or process.stdout.strip()
    if process.returncode == NOT_INSTALLED:
        not_installed(messages.splitlines()[-1])
    print(messages, file=sys.stderr)
    number = -process.returncode if process.returncode < 0 else process.returncode - SHELL_SIGNAL
    if number > 0:
        signal.signal(number, signal.SIG_DFL)
        os.kill(os.getpid(), number)
    sys.exit(process.returncode or "the program wrote no mesh")


def off_as_obj(source, target):
    """Converts OFF to OBJ, because Assimp 5.2 loses polygons of OFF files with comments or blank lines."""
    with open(source) as file:
        lines = [words for line in file if (words := line.split("#")[0].split())]
    counts = lines.pop(0)[1:] or lines.pop(0)
    vertices, faces = int(counts[0]), int(counts[1])
    with open(target, "w") as file:
        for words in lines[:vertices]:
            file.write("v " + " ".join(words[:3]) + "\n")
        for words in lines[vertices:vertices + faces]:
            file.write("f " + " ".join(str(int(word) + 1) for word in words[1:1 + int(words[0])]) + "\n")


def read_mesh(path):
    """Returns points (n × 3, float32) and triangles (m × 3, int32) of any file that Assimp reads."""
    numpy = require("numpy", "python3-numpy")
    assimp = program("assimp", "install the package assimp-utils")
    with tempfile.TemporaryDirectory() as work:
        if path.endswith(".gz"):
            packed, path = path, os.path.join(work, os.path.basename(path[:-3]))
            with gzip.open(packed) as source, open(path, "wb") as target:
                shutil.copyfileobj(source, target)
        if path.endswith(".off"):
            original, path = path, os.path.join(work, "off.obj")
            try:
                off_as_obj(original, path)
            except (ValueError, IndexError):
                path = original
        # Assimp's binary STL and PLY files are wrong for lines and for vertex colours.
        obj = os.path.join(work, "mesh.obj")
        done = subprocess.run([assimp, "export", path, obj, "-fobjnomtl", "-tri", "-ptv"],
                              capture_output=True, text=True, errors="replace")
        if not os.path.exists(obj):
            lines = (done.stderr + done.stdout).strip().splitlines() or ["no message"]
            raise Refused(f"Assimp cannot read the input: {lines[-1]}")
        points, triangles = peer.read_obj(obj)
    if not len(triangles):
        raise Refused("Assimp finds no polygons in the input")
    corners = points[triangles.ravel()].astype(numpy.float32)
    points, indices = numpy.unique(corners, axis=0, return_inverse=True)
    return points, indices.reshape(-1, 3).astype(numpy.int32)


def write_ply(path, points, polygons):
    """Writes a mesh; `polygons` is a list of arrays of triangles or quads."""
    import numpy
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(points)}",
              *(f"property double {axis}" for axis in "xyz"), f"element face {sum(map(len, polygons))}",
              "property list uchar int vertex_indices", "end_header\n"]
    with open(path, "wb") as file:
        file.write("\n".join(header).encode())
        file.write(numpy.asarray(points, "<f8").tobytes())
        for corners in polygons:
            rows = numpy.empty(len(corners), [("count", "u1"), ("corners", "<i4", corners.shape[1])])
            rows["count"], rows["corners"] = corners.shape[1], corners
            file.write(rows.tobytes())


def save(request, points, polygons, seconds, claims):
    if not any(map(len, polygons)):
        raise Refused("the mesh of the program is empty")
    write_ply(request["output"], points, [corners for corners in polygons if len(corners)])
    return {"seconds": seconds, "claims": claims}


def with_arrays(remesh, **claims):
    """Returns work() for remesh(request, points, triangles), which returns points and lists of polygons."""
    def work(request):
        mesh = read_mesh(request["input"])
        start = time.perf_counter()
        points, polygons = remesh(request, *mesh)
        return save(request, points, polygons, time.perf_counter() - start, claims)
    return work


def with_files(request, command, refusal=None, **claims):
    """Runs a peer whose arguments contain IN.obj or IN.ply, OUT.obj or OUT (the directory of the output), and
    SECOND.obj if there are two inputs, and which may print its seconds. A message that contains the text
    `refusal` means that the program refuses the input.
    """
    points, triangles = read_mesh(request["input"])
    with tempfile.TemporaryDirectory() as work:
        names = {name: os.path.join(work, name) for name in ("IN.obj", "IN.ply", "SECOND.obj", "OUT.obj")}
        if "IN.ply" in command:
            write_ply(names["IN.ply"], points, [triangles])
        else:
            peer.write_obj(names["IN.obj"], points, triangles)
        if "SECOND.obj" in command:
            peer.write_obj(names["SECOND.obj"], *read_mesh(request["second"]))
        if "OUT" in command:
            names["OUT"] = names["OUT.obj"] = request["output"]
            os.mkdir(request["output"])
        words = [names.get(word, str(word)) for word in command]
        done = subprocess.run(words, capture_output=True, text=True, errors="replace")
        if refusal and refusal in done.stderr:
            raise Refused(next(line.strip() for line in done.stderr.splitlines() if refusal in line))
        if done.returncode or not os.path.exists(names["OUT.obj"]):
            fail_like(done)
        seconds = [line.split()[1] for line in done.stdout.splitlines() if line.startswith("seconds ")]
        seconds = float(seconds[-1]) if seconds else None
        if "OUT" in command:
            return {"seconds": seconds, "claims": claims}
        points, triangles = peer.read_obj(names["OUT.obj"])
    return save(request, points, [triangles], seconds, claims)


def run(work):
    """Answers the request. `work` writes the mesh, and returns the seconds and claims of the result."""
    with open(sys.argv[-1]) as file:
        request = json.load(file)
    # Every library and every child respects the affinity. The system has chosen an idle processor to start on.
    cpus = sorted(os.sched_getaffinity(0))
    first = cpus.index(ctypes.CDLL(None).sched_getcpu())
    os.sched_setaffinity(0, (cpus[first:] + cpus[:first])[:request.get("threads") or None])
    try:
        result = {"status": "done", "message": "", **work(request)}
    except Refused as reason:
        result = {"status": "refused", "message": str(reason)}
    with open(request["result"], "w") as file:
        json.dump(result, file)
