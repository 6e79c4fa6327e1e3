import base64
import collections
import hashlib
import io
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest
import zipfile
from unittest import mock

import numpy

from .. import benchmark, child, corpus, polygons, protocol, rates
from ..database import RowDatabase
from ..rows import ROOT, LabError

HERMESH = os.environ.get("HERMESH")
FACES = "0 2 3,0 3 1,4 5 7,4 7 6,0 1 5,0 5 4,2 6 7,2 7 3,0 4 6,0 6 2,1 3 7,1 7 5"
CUBE = "\n".join(["OFF", "8 12 0", *(f"{x} {y} {z}" for z in (0, 2) for y in (0, 2) for x in (0, 2)),
                  *(f"3 {face}" for face in FACES.split(",")), ""])
LIMITS = child.Limits(seconds=30, memory_mib=4096)
WILD = ROOT / "experiments/data/wild.tsv"
WILD_500 = "a2cd7b8c5889e36b8bee63f49c37b35922357583634736f93de1e7f03450a848"  # SHA-256 of its hashes
SHIFTED = CUBE.replace("\n0 ", "\n0.1 ").replace("\n2 ", "\n2.1 ")
# Part of an adapter: what it reads, and a function that writes a cube as a PLY file.
ADAPTER = f"""
import json, os, pathlib, sys, time
request = json.loads(pathlib.Path(sys.argv[-1]).read_text())
def write(off, faces=12):
    lines = off.splitlines()
    pathlib.Path(request["output"]).write_text(
        "ply\\nformat ascii 1.0\\nelement vertex 8\\nproperty double x\\n"
        "property double y\\nproperty double z\\nelement face %d\\nproperty list uchar int vertex_indices\\n"
        "end_header\\n" % faces + "\\n".join(lines[2:10 + faces]) + "\\n")
def end(status="done", **result):
    pathlib.Path(request["result"]).write_text(json.dumps(dict(status=status, **result)))
CUBE, SHIFTED = {CUBE!r}, {SHIFTED!r}
"""


def row_of(method="a", sha="1", **values):
    """Returns a row as Benchmark.rows() does."""
    return {"sha256": sha * 64, "method": method, "status": "done", "cpu_seconds": 1.0, "wall_seconds": 1.0,
            "peak_mib": 50.0, "triangles": 100, "watertight": True, "defects": {}, "lost": 0.0,
            "vanished": 0.0, "filled": 0.0, "invented": 0.0, "claims": {}, "failed_claims": [],
            "class": "clean solid", "tags": "several bodies", "name": "cube.off", "model_triangles": 12, **values}


class Child(unittest.TestCase):
    def test_statuses(self):
        python = sys.executable
        for status, command, limits in (
                ("done", ["true"], LIMITS),
                ("refused", ["false"], LIMITS),
                ("crash", [python, "-c", "import os; os.abort()"], LIMITS),
                ("memory limit", [python, "-c", "b'x' * 2**32"], child.Limits(30, 512)),
                ("time limit", ["sleep", "60"], child.Limits(0.2, 4096)),
                # Children of the program are ended, too.
                ("time limit", ["sh", "-c", "sleep 60; true"], child.Limits(0.2, 4096))):
            self.assertEqual(child.run(command, limits).status, status, command)

    def test_figures(self):
        script = "x = bytearray(100 * 2**20)\nfor _ in range(10**6): pass"
        ended = child.run([sys.executable, "-c", script], LIMITS)
        self.assertGreater(ended.peak_mib, 100)
        self.assertLess(child.run(["sleep", "0.1"], LIMITS).peak_mib, 20)  # less than this process
        self.assertGreater(ended.cpu_seconds, 0.01)


class Rates(unittest.TestCase):
    def test_classes(self):
        box = {"lower": [0, 0, 0], "upper": [1, 1, 1]}
        report = {"triangles": 100, "quads": 0, "boundary_edges": 0, "non_manifold_edges": 0,
                  "duplicate_polygons": 0, "inconsistent_edges": 0, "self_intersecting_pairs": 0}
        for change, bounds, expected in (
                ({}, box, "clean solid"),
                ({"self_intersecting_pairs": 1}, box, "closed, self-intersecting"),
                ({"non_manifold_edges": 1, "self_intersecting_pairs": 1}, box,
                 "closed, non-manifold or doubled"),
                ({"boundary_edges": 2}, box, "few holes"),  # of 151 edges
                ({"boundary_edges": 20}, box, "open sheets"),
                ({}, {"lower": [0, 0, 0], "upper": [1, 1, 0]}, "flat"),
                ({"triangles": 0}, box, "no mesh")):
            self.assertEqual(benchmark.classify({**report, **change}, bounds), expected)
        self.assertEqual(benchmark.classify(None, None), "no mesh")

    def test_wilson_interval(self):
        # Wilson 1927, by hand for 9 of 10 at 95 %.
        self.assertEqual(rates.rate(9, 10), "90.0 [59.6, 98.2]")

    def test_sample_depends_on_the_seed_only(self):
        entries = [corpus.Entry("p", "1", f"f{i}", f"{i:064}", "off", 1, "none") for i in range(100)]
        first = corpus.sample(entries, 10, 1)
        self.assertEqual(len(first), 10)
        self.assertEqual(first, corpus.sample(list(reversed(entries)), 10, 1)[::-1])
        self.assertNotEqual(first, corpus.sample(entries, 10, 2))

    def test_each_prefix_of_the_order_has_each_stratum_in_proportion(self):
        entries = [corpus.Entry("p", "1", f"f{i}", f"{i:064}", "off", 1, "none",
                                kind="flat" if i < 30 else "clean solid", triangles=10 if i % 2 else 10**6)
                   for i in range(300)]
        corpus.set_order(entries, 1)
        self.assertEqual(sorted(e.order for e in entries), list(range(1, 301)))
        for count in (20, 60, 250):
            chosen = collections.Counter((e.kind, e.triangles) for e in corpus.listed(entries, count))
            for (kind, _), found in chosen.items():
                self.assertLessEqual(abs(found - count * (15 if kind == "flat" else 135) / 300), 1)
        first = [e.sha256 for e in corpus.listed(entries, 20)]
        corpus.set_order(entries, 2)
        self.assertNotEqual(first, [e.sha256 for e in corpus.listed(entries, 20)])

    def test_wild_500_follows_from_its_seed(self):
        entries = corpus.read_corpus(WILD)
        stored = [e.sha256 for e in corpus.listed(entries, 500)]
        self.assertTrue(all(e.kind in rates.CLASSES for e in entries))
        corpus.set_order(entries, 1)
        self.assertEqual(stored, [e.sha256 for e in corpus.listed(entries, 500)])
        self.assertEqual(hashlib.sha256("\n".join(stored).encode()).hexdigest(), WILD_500)

    def test_table(self):
        claims = {"watertight": True}
        rows = [row_of(), row_of(sha="2", watertight=False, claims=claims, failed_claims=["watertight"]),
                row_of(sha="3", status="refused"), row_of(sha="4", lost=0.02, claims=claims),
                row_of("b", status="not installed")]
        line = rates.table(rows, ["a", "b"]).splitlines()[-1].split(" | ")
        self.assertEqual(line[:3], ["| a", "all meshes", "4"])
        self.assertEqual([cell.split()[0] for cell in line[3:8]], ["75.0", "50.0", "25.0", "50.0", "33.3"])

    def test_table_of_simplification(self):
        rows = [row_of(distance=0.5), row_of(sha="2", distance=1.5), row_of(sha="3", status="refused")]
        text = rates.table(rows, ["a"], "simplify").splitlines()
        line = dict(zip(text[0].split(" | "), text[-1].split(" | ")))
        self.assertTrue(line["valid and within the bound %"].startswith("33.3 "))
        self.assertTrue(line["over the bound %"].startswith("50.0 "))
        self.assertEqual((line["median % of the bound"], line["median % of the model's triangles"]),
                         ("100", "833.3"))
        self.assertEqual(rates.trouble(rows[1])[1], "1.50 times the bound")

    def test_volumes_of_pairs_add_up(self):
        def of(operation, volume, method="a"):
            return row_of(method, operation[0], **{"class": operation}, pair="p", volumes=[8.0, 4.0],
                          wrong=0.0, volume=volume)
        rows = [of("union", 11.0), of("intersection", 1.0), of("difference", 7.6), of("union", 11.0, "b")]
        self.assertEqual([round(error, 9) for error in sorted(rates.volume_errors(rows[:3]))], [0, 0.05])
        self.assertEqual(rates.volume_errors(rows[3:]), [])
        lines = rates.table(rows, ["a", "b"], "combine").splitlines()
        cells = [dict(zip(lines[0].split(" | "), line.split(" | "))) for line in lines]
        found = {(c["| method"], c["class"]): c["volumes differ > 1%"].split()[0] for c in cells[2:]}
        self.assertEqual(found[("| a", "all meshes")], "50.0")
        self.assertEqual(found[("| b", "all meshes")], "–")

    def test_profile(self):
        # b takes twice as long as a on model 1, half as long on model 2; only a solves 3, no method solves 4.
        rows = [row_of("a", "1"), row_of("b", "1", cpu_seconds=2), row_of("a", "2", cpu_seconds=4),
                row_of("b", "2", cpu_seconds=2), row_of("a", "3"), row_of("b", "3", watertight=False),
                row_of("a", "4", status="refused"), row_of("b", "4", status="crash"),
                row_of("a", "5", **{"class": "no mesh"})]
        found = rates.profile(rows, "cpu_seconds")
        self.assertEqual([list(part) for part in found["a"]], [[1, 1, 2], [0.25, 0.5, 0.75]])
        self.assertEqual([list(part) for part in found["b"]], [[1, 2], [0.25, 0.5]])

    def test_gallery(self):
        hostile = "</td><script>alert(1)</script>"
        rows = [row_of("other", status="crash", message=hostile), row_of("ours", sha="3"),
                row_of("ours", sha="2", lost=0.5, vanished=0.5)]
        with tempfile.TemporaryDirectory() as work:
            pictures = pathlib.Path(work)
            (pictures / rates.picture_name("1" * 64)).write_bytes(b"png")
            html = rates.gallery(rows, {"ours"}, "Why?", pictures)
        self.assertEqual(html.count("<tr data"), 2)
        self.assertLess(html.index("50.0% of the visible surface vanished"), html.index("crash: "))
        self.assertNotIn(hostile, html)
        self.assertEqual(html.count("data:image/png;base64,cG5n"), 1)

    def test_differences(self):
        with tempfile.TemporaryDirectory() as work:
            folders = [pathlib.Path(work) / name for name in "abc"]
            slower = row_of(cpu_seconds=2, peak_mib=1, failed_claims=["seconds"])
            for folder, rows in zip(folders, ([row_of()], [slower], [row_of(triangles=99), row_of("b")])):
                folder.mkdir()
                (folder / "rows-1-of-2.ndjson").write_text("".join(json.dumps(row) + "\n" for row in rows))
            self.assertEqual(rates.differences(folders[0], folders[1]), [])
            found = rates.differences(folders[0], folders[2])
            self.assertEqual([line.split(": ", 1)[1] for line in found],
                             ["triangles: 100 and 99", f"only in {folders[2]}"])
            with self.assertRaises(LabError):
                rates.differences(folders[0], work)


class Corpus(unittest.TestCase):
    def test_the_size_of_a_package_is_asked_for_once(self):
        entries = [corpus.Entry("p", "1", name, name * 64, "off", 1, "none") for name in "ab"]
        said = []
        with mock.patch.object(corpus, "_package_bytes", return_value=3 * 2**20) as size, \
                mock.patch.object(corpus, "_download"), mock.patch.object(corpus, "_unpack") as unpack:
            corpus.fetch(entries, pathlib.Path("absent"), said.append)
        size.assert_called_once_with("p")
        unpack.assert_called_once()
        self.assertEqual(said, ["2 models are in 1 packages: 3 MiB to download", "downloading p, 3 MiB"])


class Experiments(unittest.TestCase):
    def test_files_of_the_project(self):
        for file in (ROOT / "experiments/lab/questions").glob("*.toml"):
            self.assertIn("method", benchmark.read_experiment(file))

    def test_the_quick_tier_of_wild_has_one_method_of_six_programs(self):
        methods = benchmark.read_experiment(ROOT / "experiments/lab/questions/wild.toml")["method"]

        def names(*arguments):
            return {method["name"] for method in benchmark.select_methods(methods, *arguments)}
        self.assertEqual(names("quick"), {"hermesh", "OpenVDB", "CGAL alpha wrap", "VTK flying edges",
                                          "meshoptimizer remesh", "Manifold simplify"})
        self.assertEqual(names("full"), {method["name"] for method in methods})
        self.assertEqual(names("quick", ["Blender, voxels", "OpenVDB"]), {"Blender, voxels", "OpenVDB"})
        with self.assertRaises(LabError):
            names("full", ["absent"])

    def test_methods(self):
        numbers = "".join(f"{key} = 1\n" for key in ("models", "seed", "resolution", "seconds", "memory_mib"))
        head = f'question = "q"\ncorpus = "c"\n{numbers}[[method]]\nname = "a"\n'
        with tempfile.TemporaryDirectory() as work:
            file = pathlib.Path(work) / "a.toml"
            for method, is_right in (('request = ["a"]', True), ('adapter = ["a"]', True), ("", False),
                                     ('request = ["a"]\nclaims = {watertight = true}', True),
                                     ('request = ["a"]\ntier = "full"', True),
                                     ('request = ["a"]\ntier = "quick"', False),
                                     ('request = ["a"]\nadapter = ["a"]', False),
                                     ('adapter = ["a"]\nclaims = {watertight = true}', False)):
                file.write_text(head + method)
                with self.subTest(method) if is_right else self.assertRaises(LabError):
                    benchmark.read_experiment(file)
            file.write_text(head + 'request = ["a"]')
            for task, is_right in (('task = "simplify"\nerror = 0.1', True), ('task = "simplify"', False),
                                   ('task = "paint"', False)):
                other = pathlib.Path(work) / "c.toml"
                other.write_text(f'base = "a.toml"\n{task}')
                with self.subTest(task) if is_right else self.assertRaises(LabError):
                    benchmark.read_experiment(other)
            other = pathlib.Path(work) / "b.toml"
            other.write_text('base = "a.toml"\nresolution = 5')
            self.assertEqual(benchmark.read_experiment(other)["resolution"], 5)
            file.write_text('base = "b.toml"')
            with self.assertRaises(LabError):
                benchmark.read_experiment(other)


class Polygons(unittest.TestCase):
    def test_formats(self):
        lines = CUBE.splitlines()
        points, faces = lines[2:10], [line.split()[1:] for line in lines[10:]]
        corners = numpy.array([[list(map(float, points[int(i)].split())) for i in face] for face in faces])
        head = "ply\nformat %s 1.0\nelement vertex 8\nproperty float x\nproperty float y\n" \
               "property float z\nelement face 12\nproperty list uchar int vertex_indices\nend_header\n"
        record = numpy.zeros(12, [("count", "u1"), ("v", "<i4", 3)])
        record["count"], record["v"] = 3, numpy.array(faces, int)
        numbers = [list(map(int, face)) for face in faces]
        stl = numpy.zeros(12, [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
        stl["corners"] = corners
        files = {
            "a.off": CUBE.encode(), "a.ply": (head % "ascii" + "\n".join(lines[2:])).encode(),
            "b.ply": (head % "binary_little_endian").encode()
            + numpy.array([p.split() for p in points], "<f4").tobytes() + record.tobytes(),
            "a.obj": ("".join(f"v {p}\n" for p in points)
                      + "".join("f %d/1 %d %d\n" % (a + 1, b + 1, c - 8) for a, b, c in numbers)).encode(),
            "a.stl": bytes(80) + numpy.uint32(12).tobytes() + stl.tobytes(),
            "b.stl": "".join("vertex %g %g %g\n" % tuple(p) for p in corners.reshape(-1, 3)).encode()}
        with tempfile.TemporaryDirectory() as work:
            for name, content in files.items():
                path = pathlib.Path(work) / name
                path.write_bytes(content)
                found, is_triangle = polygons.read(path)
                numpy.testing.assert_array_equal(found, corners, name)
                self.assertTrue(is_triangle.all())
            for name, content in self.scene_files(corners / 2 - 3).items():
                path = pathlib.Path(work) / name
                path.write_bytes(content)
                numpy.testing.assert_allclose(polygons.read(path)[0], corners, err_msg=name)
            path.write_text("solid")
            for wrong in (path, pathlib.Path(work) / "a.off.partial"):
                wrong.touch()
                with self.assertRaises(ValueError):
                    polygons.read(wrong)
        self.assertEqual(polygons.picture(corners, ([0, 0, 0], [2, 2, 2]))[:4], b"\x89PNG")
        self.assertEqual(polygons.thin_share(corners, 0.1), 0)
        self.assertEqual(polygons.thin_share(corners, 2.1), 1)


    def scene_files(self, corners):
        """Returns files of a mesh of half the size, moved by -3, with transforms that restore it."""
        points, order = numpy.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
        binary = order.astype("<u2").tobytes() + points.astype("<f4").tobytes()
        document = {
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [1]}],
            "nodes": [{"mesh": 0, "translation": [3, 3, 3]},
                      {"children": [0], "matrix": [2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1]}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 1}, "indices": 0},
                                       {"attributes": {"POSITION": 1}, "mode": 1}]}],  # lines
            "accessors": [{"bufferView": 0, "componentType": 5123, "count": 36, "type": "SCALAR"},
                          {"bufferView": 1, "componentType": 5126, "count": 8, "type": "VEC3"}],
            "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 72},
                            {"buffer": 0, "byteOffset": 72, "byteLength": 96}],
            "buffers": [{"byteLength": len(binary)}]}
        text = json.dumps(document).encode()
        length = (20 + len(text) + 8 + len(binary)).to_bytes(4, "little")
        glb = b"glTF" + b"\2\0\0\0" + length + len(text).to_bytes(4, "little") + b"JSON" + text \
            + len(binary).to_bytes(4, "little") + b"BIN\0" + binary
        document["buffers"][0]["uri"] = "data:;base64," + base64.b64encode(binary).decode()
        vertices = "".join('<vertex x="%g" y="%g" z="%g"/>' % tuple(p) for p in points)
        triangles = "".join('<triangle v1="%d" v2="%d" v3="%d"/>' % tuple(t) for t in order.reshape(-1, 3))
        model = f"""<model xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"><resources>
            <object id="1"><mesh><vertices>{vertices}</vertices><triangles>{triangles}</triangles></mesh>
            </object><object id="2"><components>
            <component objectid="1" transform="1 0 0 0 1 0 0 0 1 3 3 3"/></components></object></resources>
            <build><item objectid="2" transform="2 0 0 0 2 0 0 0 2 0 0 0"/></build></model>"""
        archive = io.BytesIO()
        with zipfile.ZipFile(archive, "w") as out:
            out.writestr("3D/3dmodel.model", model)
        return {"a.gltf": json.dumps(document).encode(), "a.glb": glb, "a.3mf": archive.getvalue()}


class Solids(unittest.TestCase):
    def setUp(self):
        with tempfile.TemporaryDirectory() as work:
            files = [pathlib.Path(work) / name for name in ("a.off", "b.off")]
            for file, text in zip(files, (CUBE, SHIFTED)):
                file.write_text(text)
            self.cube, self.shifted = (polygons.read(file)[0] for file in files)

    def test_misplaced_volume_of_pieces(self):
        cube = polygons.solid(self.cube)
        left = cube * [0.5, 1, 1]
        halves = [left, left + [1, 0, 0]]
        middle, quarter = numpy.array([[1.0, 0, 0, 1]]), numpy.array([[1.0, 0, 0, 0.5]])
        for pieces, planes, expected in (
                (halves, middle, 0), ([cube], middle, 0.5), ([cube], quarter, 0.25), (halves, quarter, 0.25),
                (halves, numpy.array([[0.0, 0, 1, 0.5]]), 0.25), ([left], middle, 0.5),
                (2 * halves, middle, 1), ([cube + [0, 0, 1]], numpy.array([[0.0, 0, 1, -1]]), 1)):
            self.assertAlmostEqual(polygons.misplaced_share(cube, pieces, planes), expected, delta=0.05)
        planes = polygons.random_planes(cube, 5, 1)
        numpy.testing.assert_allclose(numpy.linalg.norm(planes[:, :3], axis=1), 1)
        sides = cube.reshape(-1, 3) @ planes[:, :3].T - planes[:, 3]
        self.assertTrue(((sides.min(axis=0) < 0) & (sides.max(axis=0) > 0)).all())
        numpy.testing.assert_array_equal(planes, polygons.random_planes(cube, 5, 1))

    def test_wrong_volume(self):
        self.assertAlmostEqual(abs(polygons.volume(self.shifted)), 8)
        common = 1.9 * 2 * 2
        for operation, expected in (("union", (8 - common) / (16 - common)),
                                    ("intersection", (8 - common) / common),
                                    ("difference", common / (8 - common))):
            found = polygons.wrong_share(self.cube, self.shifted, self.cube, operation)
            self.assertAlmostEqual(found / expected, 1, delta=0.3)
        self.assertEqual(polygons.wrong_share(self.cube, self.cube, self.cube, "union"), 0)
        self.assertEqual(polygons.wrong_share(self.cube, self.cube, self.cube, "difference"), 1)
        # A column of 0.01 × 0.01 × 2 is common, of which the output has half.
        moved = self.cube + [1.99, 1.99, 0]
        half = self.cube * [0.005, 0.005, 0.5] + [1.99, 1.99, 0]
        self.assertAlmostEqual(polygons.wrong_share(self.cube, moved, half, "intersection"), 0.5)

    def test_placed_solids_meet(self):
        inverted = self.shifted[:, ::-1]
        for seed in range(4):
            first, second = polygons.place(self.cube, 100 * inverted, seed)
            self.assertGreater(min(map(polygons.volume, (first, second))), 7.9)
            self.assertGreater(polygons.wrong_share(first, second, first, "difference"), 1e-3)  # they overlap

    def test_pairs(self):
        entries = [corpus.Entry("p", "1", f"f{i}", f"{i:064}", "off" if i % 2 else "gltf", 1, "none")
                   for i in range(20)]
        pairs = corpus.pairs(entries, 10, 1)
        self.assertEqual([pair.operation for pair in pairs[:3]], list(corpus.OPERATIONS))
        self.assertEqual(len({pair.sha256 for pair in pairs}), 30)
        self.assertEqual(len(corpus.pairs(entries, 100, 1)), 3 * 90)
        self.assertTrue(all(pair.first.format == pair.second.format == "off" for pair in pairs))
        self.assertEqual([pair.sha256 for pair in corpus.pairs(entries[::-1], 5, 1)],
                         [pair.sha256 for pair in pairs[:15]])


class Protocol(unittest.TestCase):
    def test_malformed_results(self):
        with tempfile.TemporaryDirectory() as work:
            file = pathlib.Path(work) / "result.json"
            for text in ("", "[]", "{}", '{"status": "crash"}', '{"status": "done", "seconds": -1}',
                         '{"status": "done", "claims": []}', '{"status": "done", "claims": {"valid": true}}',
                         '{"status": "done", "claims": {"watertight": 1}}',
                         '{"status": "done", "claims": {"distance_to_input": true}}',
                         '{"status": "done", "claims": {"distance_to_input": NaN}}'):
                file.write_text(text)
                with self.assertRaises(ValueError, msg=text):
                    protocol.read_result(file)
            file.write_text('{"status": "done", "claims": {"manifold": null, "distance_to_input": 1}}')
            self.assertEqual(protocol.read_result(file)["claims"], {"distance_to_input": 1})

    def test_times(self):
        def is_false(seconds, wall, cpu, mib=0.0):
            return protocol.is_false_time(seconds, child.Ended("done", 0, cpu, 1.0, "", "", wall), mib)
        with mock.patch("os.cpu_count", return_value=2):
            self.assertFalse(is_false(1.0, 1.0, 1.0))
            self.assertFalse(is_false(0.0, 3.0, 4.9))  # the start of an interpreter
            self.assertFalse(is_false(10.0, 16.0, 29.0))  # two cores, and a start
            self.assertFalse(is_false(0.1, 20.0, 20.0, mib=16))  # large files
            self.assertTrue(is_false(1.1, 1.0, 1.0))
            self.assertTrue(is_false(1.0, 20.0, 20.0))


@unittest.skipUnless(HERMESH, "the environment variable HERMESH names no program")
class Benchmark(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.work = pathlib.Path(folder.name)
        self.said = []

    def adapter(self, name, script):
        file = self.work / f"{name}.py"
        file.write_text(ADAPTER + script)
        return {"name": name, "adapter": ["python3", str(file)]}

    def run_methods(self, methods, models=(CUBE,), out="out", jobs=1, shard="", chosen=slice(None),
                    are_pairs=False, **changes):
        entries = []
        for number, model in enumerate(models):
            name = "model.obj" if model.startswith("v ") else "model.off"
            entries.append(corpus.Entry("package", "1", name, f"{number}" * 64, "off", len(model), "none"))
            path = corpus.location(entries[-1], self.work / "cache")
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(model)
        if are_pairs:
            entries = [corpus.Pair(*entries, operation, 3) for operation in corpus.OPERATIONS]
        experiment = {"question": "", "resolution": 20, "seed": 7, "seconds": 30, "memory_mib": 4096,
                      "method": methods, **changes}
        run = benchmark.Benchmark(experiment, HERMESH, self.work / out, self.said.append, shard)
        return run.run(entries[chosen], self.work / "cache", jobs)

    def test_false_claims_are_caught_and_true_ones_are_not(self):
        topology = "watertight=True, manifold=True, intersection_free=True"
        cases = {
            "honest": ("start = time.monotonic(); write(CUBE); end(seconds=time.monotonic() - start, "
                       f"claims=dict({topology}, distance_to_input=0, distance_from_input=0))", []),
            "claims nothing": ("write(CUBE, 11); end()", []),
            "honest shift": ("write(SHIFTED); end(claims=dict(distance_to_input=0.1, "
                             "distance_from_input=0.1))", []),
            "hole": (f"write(CUBE, 11); end(claims=dict({topology}))", ["watertight"]),
            "near": ("write(SHIFTED); end(claims=dict(distance_to_input=0.01))", ["distance_to_input"]),
            "complete": ("write(SHIFTED); end(claims=dict(distance_from_input=0.01))",
                         ["distance_from_input"]),
            "slow": ("write(CUBE); end(seconds=100)", ["seconds"]),
            "fast": ("write(CUBE)\nwhile time.process_time() < 1: pass\nend(seconds=0.001)", ["seconds"])}
        with mock.patch.object(protocol, "START_SECONDS", 0.5):
            rows = self.run_methods([self.adapter(name, script) for name, (script, _) in cases.items()])
        self.assertEqual({row["method"]: row.get("failed_claims", row) for row in rows},
                         {name: failed for name, (_, failed) in cases.items()})
        always, never = "100.0 [20.7, 100.0]", "0.0 [0.0, 79.3]"
        self.assertIn(f"| hole | clean solid | 1 | {always} | {never} | {never} | {always} | ",
                      rates.table(rows, list(cases)))

    def test_claims_about_visible_points_ignore_enclosed_ones(self):
        # A cube within the cube: a mesh of the outer one only.
        small = [" ".join(str(0.5 + float(c) / 2) for c in line.split()) for line in CUBE.splitlines()[2:10]]
        faces = [[int(i) for i in face.split()] for face in FACES.split(",")]
        model = "\n".join(["OFF", "16 24 0", *CUBE.splitlines()[2:10], *small,
                           *("3 %d %d %d" % (a + k, b + k, c + k) for k in (0, 8) for a, b, c in faces), ""])
        claim = "end(claims=dict(distance_from_input=0.01))"
        methods = [self.adapter("outer", f"write(CUBE); {claim}"),
                   self.adapter("shifted", f"write(SHIFTED); {claim}")]
        rows = self.run_methods(methods, [model])
        # The enclosed cube is farther away than the visible parts that refute the claim.
        self.assertEqual([(row["status"], row["failed_claims"]) for row in rows],
                         [("done", []), ("done", ["distance_from_input"])])

    def test_quads_may_be_split_either_way(self):
        # One face is two triangles over a quad that is not flat; the claim holds for one diagonal.
        points = CUBE.splitlines()[2:9] + ["2 2 3"]
        quads = "0 2 3 1,4 5 7 6,0 1 5 4,2 6 7 3,0 4 6 2,1 3 7 5".split(",")
        model = "\n".join(["OFF", "8 6 0", *points, *(f"4 {quad}" for quad in quads), ""])
        split = ["3 {0} {1} {2}|3 {0} {2} {3}".format(*quad.split()) for quad in quads]
        mesh = "\n".join(["OFF", "8 12 0", *points, *"|".join(split).split("|"), ""])
        row, = self.run_methods([self.adapter("split", f"write({mesh!r}); end(claims=dict("
                                              "distance_to_input=0.0, distance_from_input=0.0))")], [model])
        self.assertEqual(row["failed_claims"], [])

    def test_how_adapters_end(self):
        methods = [self.adapter(name, script) for name, script in (
            ("refuses", "end('refused', message='too thin')"), ("fails", "sys.exit('no licence')"),
            ("paths", f"sys.exit(request['input'] + ' ' + request['output'] + ' {ROOT}/a.py')"),
            ("silent", "pass"),
            ("malformed", "write(CUBE); end(claims=dict(perfect=True))"), ("no mesh", "end()"),
            ("crash", "os.abort()"),
            ("absent", "print('no blender', file=sys.stderr); sys.exit(77)"))]
        methods += [{"name": "no file", "adapter": ["python3", "reference/peers/absent.py"]},
                    {"name": "no program", "request": ["hermesh-absent-program"]}]
        rows = self.run_methods(methods, [CUBE, SHIFTED])
        self.assertEqual([row["status"] for row in rows if row["sha256"] == "0" * 64],
                         ["refused", "refused", "refused", "wrong output", "wrong output", "wrong output", "crash"])
        self.assertEqual([row["message"] for row in rows][:4],
                         ["too thin", "no licence", "model.off out.ply a.py",
                          "no result was written to request.result"])
        absent = [line for line in self.said if "not installed" in line]
        self.assertEqual(len(absent), 3)  # not of the second model
        self.assertIn("no blender", absent[0])

    def test_no_adapter_is_left_out_of_hard_models(self):
        script = "sys.exit(77) if 'v 9' in open(request['input']).read() else end('refused')"
        hard = "v 9 0 0\nv 0 0 0\nv 0 9 0\nv 0 0 9\nf 2 3 1\nf 2 1 4\nf 2 4 3\nf 1 3 4\n"
        rows = self.run_methods([self.adapter("dodges", script)], [CUBE, hard])
        self.assertEqual([row["status"] for row in rows], ["refused", "refused"])

    def test_requests(self):
        copy = self.adapter("copy", "end('refused', message=json.dumps([request, "
                            "os.environ['HERMESH_INPUT'], os.environ.get('HERMESH_VOXEL_SIZE')]))")
        for changes, resolution in (({}, 20), ({"error": 0.01}, None)):
            row, = self.run_methods([copy], out=f"out{resolution}", **changes)
            request, input_file, voxel = json.loads(row["message"])
            self.assertEqual(input_file, "model.off")
            expected = {"version": 1, "task": "remesh", "seed": 7, "threads": 1, "seconds": 30,
                        "memory_mib": 4096, "resolution": resolution}
            self.assertEqual(request | expected, request)
            self.assertEqual(request["input"], input_file)
            if resolution:
                self.assertEqual((request["voxel_size"], voxel), (0.1, "0.1"))
            else:
                self.assertAlmostEqual(request["error"], 0.02 * 3**0.5)
                self.assertIsNone(voxel)

    def test_simplification_is_measured_against_the_bound(self):
        scripts = {"copy": "write(CUBE); end(claims=dict(distance_from_input=request['error']))",
                   "far": "write(SHIFTED); end()",
                   "false": "write(SHIFTED); end(claims=dict(distance_to_input=request['error']))",
                   "asked": "end('refused', message=request['task'])"}
        rows = self.run_methods([self.adapter(*script) for script in scripts.items()], task="simplify",
                                error=0.01)
        self.assertEqual(rows[3]["message"], "simplify")
        self.assertEqual([row["failed_claims"] for row in rows[:3]], [[], [], ["distance_to_input"]])
        self.assertEqual(rows[0]["distance"], 0)
        self.assertGreater(rows[1]["distance"], 0.1 / (0.02 * 3**0.5))
        self.assertEqual([row["near"] for row in rates.counted(rows)], [True, False, False, False])

    def test_combinations(self):
        copy = """rows = [line.split() for line in open(request['input'])]
write("\\n".join(["OFF", "8 12 0", *(" ".join(row[1:]) for row in rows if row[0] == "v"),
                 *("3 %d %d %d" % tuple(int(v) - 1 for v in row[1:]) for row in rows if row[0] == "f")]))
end(claims=dict(watertight=True))"""
        right = {"name": "hermesh", "claims": {"watertight": True},
                 "request": ["{hermesh}", "combine", "{operation}", "{input}", "{second}", "{output}",
                             "--voxel-size", "{voxel}"]}
        rows = self.run_methods([right, self.adapter("copy", copy),
                                 self.adapter("open", copy.replace('"f")]))', '"f")]), 11)'))],
                                [CUBE, SHIFTED], task="combine", resolution=100, are_pairs=True)
        found = {(row["method"], row["class"]): row for row in rates.counted(rows)}
        self.assertEqual(len(found), 9)
        for operation in corpus.OPERATIONS:
            self.assertTrue(found["hermesh", operation]["near"], found["hermesh", operation])
            self.assertFalse(found["copy", operation]["near"])
            self.assertEqual(found["copy", operation]["failed_claims"], [])
            self.assertEqual(found["open", operation]["failed_claims"], ["watertight"])
        self.assertLess(max(rates.volume_errors([r for r in rows if r["method"] == "hermesh"])), 0.01)
        # The identities cannot reveal a mesh that is the same for all operations and large enough.
        self.assertGreater(max(rates.volume_errors([r for r in rows if r["method"] == "copy"])), 0.1)
        rates.write_report(rows, ["hermesh", "copy"], {"hermesh"}, "Why?", self.work / "out", "combine")
        self.assertIn("of the volume wrong", (self.work / "out/gallery.html").read_text())

    def test_fractures(self):
        mkdir = "os.mkdir(request['output']); request['output'] += '/1.ply'; "
        right = {"name": "hermesh", "claims": {"watertight": True},
                 "request": ["{hermesh}", "fracture", "{input}", "{output}", "--cutters", "planes:{planes}",
                             "--voxel-size", "{voxel}", "--no-picture"]}
        rows = self.run_methods([right, self.adapter("whole", f"{mkdir}write(CUBE); end()"),
                                 self.adapter("open", f"{mkdir}write(CUBE, 11); end(claims=dict("
                                              "watertight=True))"),
                                 self.adapter("twice", f"{mkdir}write(CUBE, 11); request['output'] = "
                                              "request['output'].replace('1.ply', '2.ply'); write(CUBE, 11); "
                                              "end()"),
                                 self.adapter("none", "end()")], task="fracture", resolution=50)
        self.assertEqual([row["status"] for row in rows], ["done"] * 4 + ["wrong output"])
        self.assertEqual([row["near"] for row in rates.counted(rows)], [True] + 4 * [False])
        self.assertEqual(rows[3]["defects"]["boundary_edges"], 2 * rows[2]["defects"]["boundary_edges"])
        self.assertEqual(rows[2]["failed_claims"], ["watertight"])
        self.assertGreater(rows[0]["pieces"], 2)
        self.assertLess(rows[1]["volume_error"], 1e-6)  # only the planes reveal that it is not cut
        self.assertAlmostEqual(rows[0]["volume"], 8, delta=0.08)
        rates.write_report(rows, ["hermesh", "whole"], {"hermesh"}, "Why?", self.work / "out", "fracture")
        self.assertIn("of the volume wrong", (self.work / "out/gallery.html").read_text())

    def test_claims_of_requests(self):
        request = ["{hermesh}", "remesh", "{input}", "{output}", "--voxel-size", "{voxel}"]
        claims = {"watertight": True, "distance_to_input": "{voxel}"}
        row, = self.run_methods([{"name": "remesh", "request": request, "claims": claims}])
        self.assertEqual(row["claims"], {"watertight": True, "distance_to_input": 0.1})
        self.assertEqual(row["failed_claims"], [])

    def test_examples(self):
        adapters = ROOT / "experiments/lab/adapters"
        methods = [{"name": "hull", "adapter": ["python3", "experiments/lab/adapters/example.py"]}]
        obj = "".join(f"v {line}\n" for line in CUBE.splitlines()[2:10]) \
            + "".join("f %d %d %d\n" % tuple(int(i) + 1 for i in face.split()) for face in FACES.split(","))
        if shutil.which("g++"):
            subprocess.run(["g++", adapters / "example.cpp", "-o", self.work / "example"], check=True)
            methods.append({"name": "box", "adapter": [str(self.work / "example")]})
        for row in self.run_methods(methods, [obj]):
            found = row["status"], row["watertight"], row["failed_claims"]
            self.assertEqual(found, ("done", True, []), row)
            self.assertLess(row["lost"], 1e-3)
        for name in ("example.py", "example.cpp"):
            self.assertLessEqual(len((adapters / name).read_text().splitlines()), 30)

    def test_shards_and_jobs_make_the_same_rows(self):
        methods = [self.adapter("cube", "write(CUBE); end(claims=dict(watertight=True))"),
                   {"name": "refuses", "request": ["false"]}]
        models = [CUBE, SHIFTED, CUBE + "\n"]
        self.run_methods(methods, models, "whole")
        self.run_methods(methods, models, "parts", 2, "-1-of-2", slice(0, None, 2))
        self.run_methods(methods, models, "parts", 1, "-2-of-2", slice(1, None, 2))
        self.assertEqual(len(list((self.work / "parts").glob("rows*.ndjson"))), 2)
        self.assertEqual(rates.differences(self.work / "whole", self.work / "parts"), [])
        self.said.clear()
        rows = self.run_methods(methods, models, "parts")
        self.assertEqual((len(rows), self.said), (6, []))
        rates.write_report(rows, ["cube", "refuses", "absent"], {"cube"}, "Why?", self.work / "parts")
        self.assertIn("Not installed, and left out: absent.", (self.work / "parts/table.md").read_text())
        self.assertIn("<svg", (self.work / "parts/profiles.svg").read_text())
        self.assertIn("data:image/png", (self.work / "parts/gallery.html").read_text())
        database = RowDatabase()
        database.add_directories(self.work)
        query = """SELECT method, sum(done), rate(sum(valid), count(*)) FROM parts WHERE class = 'clean solid'
                   GROUP BY method"""
        self.assertEqual(database.query(query)[1],
                         [("cube", 3, "100.0 [43.9, 100.0]"), ("refuses", 0, "0.0 [0.0, 56.1]")])

    def test_rows_are_resumed_and_outputs_validated(self):
        with tempfile.TemporaryDirectory() as work:
            cache, out = pathlib.Path(work) / "cache", pathlib.Path(work) / "out"
            entry = corpus.Entry("package", "1", "cube.off", "0" * 64, "off", len(CUBE), "none")
            path = corpus.location(entry, cache)
            path.parent.mkdir(parents=True)
            path.write_text(CUBE)
            experiment = {"question": "", "resolution": 20, "seed": 1, "seconds": 30, "memory_mib": 4096}
            experiment["method"] = [
                {"name": "remesh",
                 "request": ["{hermesh}", "remesh", "{input}", "{output}", "--resolution", "{resolution}"]},
                {"name": "no mesh", "request": ["cp", "{input}", "{output}"]},
                {"name": "nothing", "request": ["true"]},
                {"name": "refuses", "request": ["false"]}]
            said = []
            rows = benchmark.Benchmark(experiment, HERMESH, out, said.append).run([entry], cache)
            self.assertEqual([r["status"] for r in rows], ["done", "wrong output", "wrong output", "refused"])
            self.assertEqual(rows[0]["class"], "clean solid")
            self.assertTrue(rows[0]["watertight"])
            self.assertEqual(rows[0]["triangles"], 12)
            self.assertLess(rows[0]["lost"] + rows[0]["invented"], 1e-3)
            # A line that was cut off is written again, complete ones are not.
            file = out / "rows.ndjson"
            lines = file.read_text().splitlines(keepends=True)
            file.write_text("".join(lines[:3]) + lines[3][:20])
            said.clear()
            again = benchmark.Benchmark(experiment, HERMESH, out, said.append).run([entry], cache)
            self.assertEqual(len(said), 1)
            self.assertEqual([r["status"] for r in again], [r["status"] for r in rows])
            text = rates.table(rows, ["remesh", "refuses"])
            self.assertIn("| remesh | clean solid | 1 | 100.0", text)
            self.assertIn("| refuses | clean solid | 1 | 0.0", text)


if __name__ == "__main__":
    unittest.main()
