#!/usr/bin/env python3
"""Our meshes beside those of decimators with exactly as many triangles, from our uniform mesh as their input.

    HERMESH_DATA=... reference/peers/equal_triangles.py BUILD [--resolution 200] [--models fandisk,...] [--tolerances 0.1,...]

For each model and tolerance: manifold-dual-contouring with the tolerance; with relaxation; and with twice the tolerance and the
moment that gives as many triangles, within three hundredths, found in at most four tries. VTK's, OpenMesh's and CGAL's two
decimators get the last one's number. Root mean square distances are both ways to the uniform mesh, in voxels, by 100,000 samples;
seconds are a processor's, without making or reading the uniform mesh. Defects are those that `hermesh validate` names.
"""
import argparse
import json
import os
import subprocess
import tempfile

MODELS = {"nefertiti": "nefertiti.obj", "dragon": "dragon_vrip.ply.gz", "bunny": "bun_zipper.ply",
          "rocker-arm": "rocker-arm.obj", "fandisk": "fandisk.obj"}


def seconds_of(command):
    """What a command prints, and the processor's time that it took."""
    before = os.times().children_user
    out = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    return out, os.times().children_user - before


class Comparison:
    def __init__(self, options, model, folder):
        self.hermesh = os.path.join(options.build, "hermesh")
        self.peers = os.path.join(options.build, "reference", "peers")
        self.input = os.path.join(os.environ["HERMESH_DATA"], MODELS[model])
        self.model, self.resolution, self.folder = model, str(options.resolution), folder
        self.uniform = os.path.join(folder, "uniform.obj")
        self.mesh = os.path.join(folder, "mesh.obj")
        self.voxel = self.remesh(self.uniform, tolerance=0)["result"]["voxel_size"]
        self.triangles = triangulate(self.uniform)
        self.start = self.remesh(self.mesh, tolerance=0)["user"]

    def remesh(self, path, **settings):
        command = [self.hermesh, "remesh", self.input, path, "--resolution", self.resolution, "--threads", "1", "--json"]
        for name, value in settings.items():
            command += ["-o", f"{name}={value:.4g}"]
        out, user = seconds_of(command)
        return {**json.loads(out), "user": user}

    def row(self, label, user):
        out, _ = seconds_of([self.hermesh, "validate", self.mesh, "--reference", self.uniform, "--json", "--samples", "100000"])
        report = json.loads(out)
        distances = [report["to_reference"], report["from_reference"]]
        rms, most = ([each[key] / self.voxel for each in distances] for key in ("rms", "max"))
        verdict = report["result"]["sentences"][0]
        defects = "" if verdict.endswith("watertight.") else verdict
        print(f"{self.model:10} {label:22} {report['triangles']:7} rms {rms[0]:.5f} {rms[1]:.5f} most {most[0]:.3f} {most[1]:.3f}"
              f" {user:6.2f} s {defects}", flush=True)

    def ours(self, tolerance):
        plain = self.remesh(self.mesh, tolerance=tolerance)
        wanted = plain["triangles"]
        self.row(f"tolerance {tolerance}", plain["user"] - self.start)
        self.row("  relaxation 3", self.remesh(self.mesh, tolerance=tolerance, relaxation=3)["user"] - self.start)
        # Triangles go with the inverse cube root of the moment, where the surface is smooth.
        moment = 60 * tolerance**2.9
        for attempt in range(4):
            near = self.remesh(self.mesh, tolerance=2 * tolerance, moment=moment, relaxation=3)
            if abs(near["triangles"] / wanted - 1) < 0.03 or attempt == 3:
                break
            moment *= (near["triangles"] / wanted) ** 3
        self.row(f"  moment {moment:.4g}", near["user"] - self.start)
        return near["triangles"]

    def theirs(self, triangles):
        for label, program in {"vtk": ["vtk_peer", "quadric"], "openmesh": ["openmesh_peer", "quadric"],
                               "cgal quadrics": ["cgal_peer", "garland-heckbert"],
                               "cgal lindstrom-turk": ["cgal_peer", "lindstrom-turk"]}.items():
            command = [os.path.join(self.peers, program[0]), program[1], self.uniform, self.mesh]
            if not os.path.exists(command[0]):
                continue
            # What nearly nothing takes is reading and writing.
            _, idle = seconds_of(command + [str(self.triangles - 4)])
            _, user = seconds_of(command + [str(triangles)])
            self.row(f"  {label}", user - idle)


def triangulate(path):
    """Cuts quads between their first and third corner, as the decimation does; returns the number of triangles."""
    lines, triangles = [], 0
    with open(path) as file:
        for line in file:
            corners = line.split()[1:]
            if not line.startswith("f "):
                lines.append(line)
                continue
            for i in range(2, len(corners)):
                lines.append(f"f {corners[0]} {corners[i - 1]} {corners[i]}\n")
                triangles += 1
    with open(path, "w") as file:
        file.writelines(lines)
    return triangles


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build")
    parser.add_argument("--resolution", type=int, default=200)
    parser.add_argument("--models", default=",".join(MODELS))
    parser.add_argument("--tolerances", default="0.05,0.1,0.25,0.5")
    options = parser.parse_args()
    if not os.path.isdir(os.environ.get("HERMESH_DATA", "")):
        parser.error("HERMESH_DATA has to name the folder of the models")
    if not os.path.exists(os.path.join(options.build, "hermesh")):
        parser.error(f"{options.build} holds no program hermesh; build it first")
    for model in options.models.split(","):
        with tempfile.TemporaryDirectory() as folder:
            comparison = Comparison(options, model, folder)
            for tolerance in options.tolerances.split(","):
                comparison.theirs(comparison.ours(float(tolerance)))


if __name__ == "__main__":
    main()
