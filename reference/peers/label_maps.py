#!/usr/bin/env python3
"""Compares meshes of label maps by hermesh with those by VTK's discrete flying edges and marching cubes.

    reference/peers/label_maps.py BUILD OUT [--sizes 128,256] [--repetitions 3]

The maps have 30 labels: Voronoi cells of random seeds in a ball, and six balls of five nested labels each.
Writes OUT/rows.json and OUT/table.md with one row for each map and method:
- CPU seconds of one thread, the least of the repetitions: of VTK's filters, from samples to meshes in
  memory, and of the process `hermesh extract --label 1`, which meshes all labels, but also reads the map
  and writes a mesh;
- triangles, defects and intersecting pairs, summed over the meshes of the labels, and the number of labels
  whose mesh is watertight, all by `hermesh validate`;
- largest difference of a label's volume from that of its voxels, percent;
- largest distance of a vertex from the boundary between voxels of different labels, in voxels;
- smallest angle of a triangle, degrees.

Smoothing has the parameters of VTK's example Medical/GenerateModelsFromLabels: 15 iterations of
vtkWindowedSincPolyDataFilter with a pass band of 0.001 and normalized coordinates, without smoothing of
boundaries and feature edges. As there, all labels are smoothed together: discrete marching cubes shares the
vertices of the walls between labels, discrete flying edges does not. Meshes are flipped if their volume is
negative.
"""
import argparse
import datetime
import json
import os
import pathlib
import platform
import subprocess
import sys
import tempfile
import time

sys.path.append(str(pathlib.Path(__file__).resolve().parent / "adapters"))
import adapter

LABELS, SEED = 30, 1
DEFECTS = {"open edges": "boundary_edges", "non-manifold edges": "non_manifold_edges",
           "non-manifold vertices": "non_manifold_vertices", "components inside out": "inside_out_components",
           "self-intersecting pairs": "self_intersecting_pairs"}


def maps(size):
    """Yields the name and the labels, indexed by z, y and x, of each map."""
    at = (numpy.indices((size,) * 3).reshape(3, -1).T - (size - 1) / 2 - [0.11, 0.23, 0.07]) / (size / 2 - 2)
    seeds = numpy.random.default_rng(SEED).uniform(-1, 1, (20 * LABELS, 3))
    seeds = seeds[numpy.linalg.norm(seeds, axis=1) < 0.95][:LABELS]
    centres = 0.65 * numpy.concatenate([numpy.eye(3), -numpy.eye(3)])
    cells, _ = nearest_of(seeds, at)
    balls, distance = nearest_of(centres, at)
    shells = numpy.ceil(distance / 0.33 * 5).clip(1)
    for name, labels in (("Voronoi cells", numpy.where(numpy.linalg.norm(at, axis=1) < 1, cells + 1, 0)),
                         ("nested balls", numpy.where(shells <= 5, 5 * balls + shells, 0))):
        yield name, labels.astype(numpy.uint8).reshape((size,) * 3)


def nearest_of(centres, at):
    """Returns the number of the nearest centre of each position, and its distance."""
    number, least = numpy.zeros(len(at)), numpy.full(len(at), numpy.inf)
    for each, centre in enumerate(centres):
        distance = numpy.linalg.norm(at - centre, axis=1)
        number[distance < least] = each
        least = numpy.minimum(least, distance)
    return number, least


def vtk_meshes(labels, kind, repetitions):
    """Returns the seconds, and {label: (points, triangles)}."""
    image = vtk.vtkImageData()
    image.SetDimensions(*labels.shape[::-1])
    image.GetPointData().SetScalars(support.numpy_to_vtk(labels.ravel(), deep=True))
    seconds = []
    for _ in range(repetitions):
        surface, last = kind(), vtk.vtkWindowedSincPolyDataFilter()
        surface.SetInputData(image)
        surface.GenerateValues(LABELS, 1, LABELS)
        last.SetInputConnection(surface.GetOutputPort())
        last.SetNumberOfIterations(15)
        last.BoundarySmoothingOff()
        last.FeatureEdgeSmoothingOff()
        last.SetFeatureAngle(120.0)
        last.SetPassBand(0.001)
        last.NonManifoldSmoothingOn()
        last.NormalizeCoordinatesOn()
        start = time.process_time()
        last.Update()
        seconds.append(time.process_time() - start)
    mesh = last.GetOutput()
    points = support.vtk_to_numpy(mesh.GetPoints().GetData()).astype(float)
    triangles = support.vtk_to_numpy(mesh.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    if of_cells := mesh.GetCellData().GetScalars():
        owners = support.vtk_to_numpy(of_cells)
    else:
        owners = support.vtk_to_numpy(mesh.GetPointData().GetScalars())[triangles[:, 0]]
    meshes = {}
    for label in range(1, LABELS + 1):
        used, corners = numpy.unique(triangles[owners == label], return_inverse=True)
        corners, own = corners.reshape(-1, 3), points[used]
        a, b, c = own[corners].transpose(1, 0, 2)
        if numpy.einsum("ij,ij", a, numpy.cross(b, c)) < 0:
            corners = corners[:, ::-1]
        meshes[label] = own, corners
    return min(seconds), meshes


def hermesh_meshes(hermesh, labels, folder, repetitions):
    """Returns the same for hermesh."""
    (folder / "map.raw").write_bytes(labels.tobytes())
    run(hermesh, "import", folder / "map.raw", folder / "map.vdb", "--labels", "--type", "uint8",
        "--spacing", "1,1,1", "--dims", ",".join(map(str, labels.shape[::-1])))
    seconds = []
    extract = [hermesh, "extract", folder / "map.vdb", folder / "out.obj", "--threads", "1", "--json"]
    for _ in range(repetitions):
        before = sum(os.times()[2:4])  # of child processes
        run(*extract, "--label", "1")
        seconds.append(sum(os.times()[2:4]) - before)
    report = json.loads(run(*extract, "--labels", "all"))
    files = {label["label"]: label["file"] for label in report["result"]["labels"]}
    return min(seconds), {label: adapter.peer.read_obj(file) for label, file in files.items()}


def distances(labels, points):
    """Returns the distance of each point from the boundary between voxels of different labels."""
    reach = 2
    padded = numpy.pad(labels, 16).T  # indexed by x, y and z
    result = numpy.full(len(points), numpy.inf)
    while (far := numpy.flatnonzero(result > reach - 0.5)).size and reach <= 8:
        own, squared = points[far] + 16, numpy.full(len(far), numpy.inf)
        for offset in numpy.ndindex((2 * reach,) * 3):
            at = numpy.rint(own).astype(int) + offset - reach
            first = padded[tuple(at.T)]
            for axis in range(3):
                differs = numpy.flatnonzero(first != padded[tuple((at + numpy.eye(3, dtype=int)[axis]).T)])
                off = numpy.abs(own[differs] - at[differs] - 0.5 * numpy.eye(3)[axis])
                off -= 0.5 * (1 - numpy.eye(3)[axis])  # across the axis: beyond the unit square
                off = numpy.where(numpy.arange(3) == axis, off, off.clip(0))
                squared[differs] = numpy.minimum(squared[differs], (off ** 2).sum(axis=1))
        result[far] = numpy.sqrt(squared)
        reach *= 2
    return result


def measure(hermesh, labels, meshes, folder):
    """Returns the metrics of the meshes of a map."""
    files = []
    for label, (points, triangles) in sorted(meshes.items()):
        files.append(folder / f"label-{label}.ply")
        adapter.write_ply(files[-1], points, [triangles])
    lines = run(hermesh, "validate", *files, "--json", "--jobs", "2").splitlines()
    by_file = {line["input"]: line for line in map(json.loads, lines)}
    reports = [by_file[str(file)] for file in files]
    voxels = numpy.bincount(labels.ravel(), minlength=LABELS + 1)
    sums = {header: sum(report[key] or 0 for report in reports) for header, key in
            {"triangles": "triangles", "watertight labels": "watertight", **DEFECTS}.items()}
    return sums | {
        "volume error [%]": max(abs(report["volume"] / voxels[label] - 1) * 100
                                for label, report in zip(sorted(meshes), reports)),
        "distance [voxel]": max(distances(labels, points).max() for points, _ in meshes.values()),
        "smallest angle [°]": min(report["smallest_angle"] for report in reports)}


def run(*command):
    return subprocess.run(list(map(str, command)), check=True, capture_output=True, text=True).stdout


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--sizes", default="128,256")
    parser.add_argument("--repetitions", type=int, default=3)
    options = parser.parse_args()
    hermesh = options.build / "hermesh"
    vtk.vtkSMPTools.Initialize(1)
    rows = []
    for size in map(int, options.sizes.split(",")):
        for name, labels in maps(size):
            for method, kind in {"hermesh": None, "VTK DiscreteFlyingEdges3D": vtk.vtkDiscreteFlyingEdges3D,
                                 "VTK DiscreteMarchingCubes": vtk.vtkDiscreteMarchingCubes}.items():
                with tempfile.TemporaryDirectory() as work:
                    folder = pathlib.Path(work)
                    seconds, meshes = (vtk_meshes(labels, kind, options.repetitions) if kind else
                                       hermesh_meshes(hermesh, labels, folder, options.repetitions))
                    rows.append({"map": name, "samples": f"{size}³", "method": method, "CPU seconds": seconds,
                                 **measure(hermesh, labels, meshes, folder)})
                print(rows[-1], flush=True)
    options.out.mkdir(parents=True, exist_ok=True)
    about = [str(datetime.date.today()), *run(hermesh, "--version").splitlines()[:2],
             "VTK " + vtk.vtkVersion().GetVTKVersion(), platform.machine()]
    (options.out / "rows.json").write_text(json.dumps({"about": about, "rows": rows}, indent=1) + "\n")
    text = [list(rows[0]), ["--:" if number > 2 else "---" for number in range(len(rows[0]))],
            *([f"{x:.3g}" if isinstance(x, float) else str(x) for x in row.values()] for row in rows)]
    (options.out / "table.md").write_text("".join("| " + " | ".join(line) + " |\n" for line in text) +
                                          "\n" + ", ".join(about) + "\n")


numpy = adapter.require("numpy", "python3-numpy")
vtk = adapter.require("vtk", "python3-vtk9")
support = adapter.require("vtk.util.numpy_support", "python3-vtk9")
if __name__ == "__main__":
    main()
