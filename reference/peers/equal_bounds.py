#!/usr/bin/env python3
"""`hermesh remesh --error` beside CGAL's alpha wrap at the same certified bound.

    HERMESH_DATA=... reference/peers/equal_bounds.py BUILD [--models fandisk.obj,...] [--errors 1,0.3]

Errors are percent of the input's diagonal. Alpha wrap promises no bound to the input: its offset is half of the error, and alpha is
lowered from four errors to a quarter of one until `hermesh validate --certify` finds both distances within the error. Its seconds are
those of the wrap that did, or of the last one. Ours are the whole command's. Both use one thread. Holes and inner walls are none of
alpha wrap's business, so the models are closed.
"""
import argparse
import json
import math
import os
import subprocess
import tempfile

MODELS = "fandisk.obj,block.off,casting.off,joint.off,rocker-arm.obj,nefertiti.obj,xyzrgb_dragon_28k.obj"
ALPHAS = (4, 2, 1, 0.5, 0.25)  # in errors
OFFSET = 0.5


def seconds_of(command):
    """What a command prints, and the processor's time that it took."""
    before = os.times().children_user
    done = subprocess.run(command, capture_output=True, text=True)
    return done, os.times().children_user - before


def as_obj(source, target):
    """Writes an .obj with the points and polygons of an .obj or .off, and returns the diagonal of the points' box."""
    points, polygons = [], []
    with open(source) as file:
        if source.endswith(".obj"):
            for words in map(str.split, file):
                if words and words[0] == "v":
                    points.append([float(word) for word in words[1:4]])
                elif words and words[0] == "f":
                    polygons.append([int(word.split("/")[0]) for word in words[1:]])
        else:
            words = iter([word for line in file for word in line.split("#")[0].split()][1:])
            number_of_points, number_of_polygons = int(next(words)), int(next(words))
            next(words)
            points = [[float(next(words)) for _ in range(3)] for _ in range(number_of_points)]
            polygons = [[1 + int(next(words)) for _ in range(int(next(words)))] for _ in range(number_of_polygons)]
    with open(target, "w") as file:
        for point in points:
            file.write("v {} {} {}\n".format(*point))
        for polygon in polygons:
            file.write("f " + " ".join(map(str, polygon)) + "\n")
    return math.dist(list(map(min, zip(*points))), list(map(max, zip(*points))))


class Comparison:
    def __init__(self, build, model, folder):
        self.hermesh = os.path.join(build, "hermesh")
        self.peer = os.path.join(build, "reference", "peers", "cgal_peer")
        self.model, self.mesh = model, os.path.join(folder, "mesh.obj")
        self.input = os.path.join(folder, "input.obj")
        self.diagonal = as_obj(os.path.join(os.environ["HERMESH_DATA"], model), self.input)

    def row(self, label, error, seconds):
        """Prints what the judge finds; returns whether both distances are within the error."""
        done, _ = seconds_of([self.hermesh, "validate", self.mesh, "--reference", self.input, "--certify", "--json", "--samples", "100000"])
        report = json.loads(done.stdout)
        to, back = (report[f"certified_{way}_reference"]["upper"] / error for way in ("to", "from"))
        print(f"{self.model:22} {100 * error / self.diagonal:5.2g} % {label:18} {report['triangles']:8} triangles, certified to"
              f" {to:.3f} and from {back:.3f} errors {seconds:7.2f} s", flush=True)
        return max(to, back) <= 1

    def compare(self, percent):
        error = percent / 100 * self.diagonal
        done, seconds = seconds_of([self.hermesh, "remesh", self.input, self.mesh, "--error", repr(error), "--threads", "1"])
        if done.returncode:
            print(f"{self.model:22} {percent:5.2g} % hermesh refuses: {done.stderr.strip().splitlines()[-1]}", flush=True)
        else:
            self.row("hermesh", error, seconds)
        for alpha in ALPHAS:
            done, seconds = seconds_of([self.peer, "alpha-wrap", self.input, self.mesh, repr(alpha * error), repr(OFFSET * error)])
            if done.returncode:
                print(f"{self.model:22} {percent:5.2g} % alpha wrap fails: {done.stderr.strip()}", flush=True)
                return
            if self.row(f"alpha wrap {alpha}", error, seconds):
                return


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build")
    parser.add_argument("--models", default=MODELS, help="files of the data folder, .obj or .off, separated by commas")
    parser.add_argument("--errors", default="1,0.3", help="percent of the diagonal, separated by commas")
    options = parser.parse_args()
    if not os.path.isdir(os.environ.get("HERMESH_DATA", "")):
        parser.error("HERMESH_DATA has to name the folder of the models")
    for program in ("hermesh", "reference/peers/cgal_peer"):
        if not os.path.exists(os.path.join(options.build, program)):
            parser.error(f"{options.build} holds no program {program}; build it first")
    for model in options.models.split(","):
        with tempfile.TemporaryDirectory() as folder:
            comparison = Comparison(options.build, model, folder)
            for percent in map(float, options.errors.split(",")):
                comparison.compare(percent)


if __name__ == "__main__":
    main()
