import argparse
import base64
import hashlib
import io
import json
import pathlib
import re
import sys
import tempfile
import types
import unittest
import zlib
from unittest import mock

import numpy

from .. import page, plots
from ..rows import LabError, append_rows

HOSTILE = "</script><img src=x onerror=alert(1)><!-- \u2028 & \" ' {{ 1 }} {% raw %}"


def row_of(run="1", label="a", triangles=100, rms=0.25, seconds=(0.3, 0.1, 0.2), **changes):
    """Returns a row with voxel size 0.5 and distances in world units."""
    return {"experiment": "toy", "tier": "quick", "question": "why?", "run": run,
            "commit": "0123456789abcdef",
            "date": f"2026-01-0{run}T00:00:00Z", "columns": ["triangles", "seconds", "to_rms"],
            "case": {"name": "ball", "origin": "generated", "sha256": "abcdef"},
            "resolution": 40, "voxel_size": 0.5,
            "variant": {"name": label.split()[0], "label": label, "options": ""},
            "voxelization": {"label": "openvdb", "active_voxels": 1000}, "triangle_count": triangles,
            "report": {"to_reference": {"rms": rms}},
            "seconds": {"median": sorted(seconds)[len(seconds) // 2], "all": list(seconds)}, **changes}


def titled(rows, start):
    return [figure for figure in page.page_data(rows)["figures"] if figure["title"].startswith(start)]


def points_of(figure):
    return {series["label"]: series["points"] for series in figure["series"]}


def data_in(html):
    element = re.search(r'<script type="application/json" id="data">(.*?)</script>', html, re.DOTALL)
    return json.loads(element[1])


class Page(unittest.TestCase):
    def test_hostile_texts_are_data(self):
        row = row_of(label=HOSTILE, question=HOSTILE, failed=HOSTILE, broken=[HOSTILE], **{HOSTILE: "a key"})
        html = page.html_page(HOSTILE, [row], [({"group": HOSTILE, "points": 0}, "AAAA")])
        self.assertEqual((html.count("<img"), html.count("<script"), html.count("</script>")), (0, 3, 3))
        data = data_in(html)
        self.assertEqual((data["rows"], data["meshes"][0]["group"]), ([row], HOSTILE))
        self.assertIn('id="mesh-0">AAAA</script>', html)

    def test_loads_nothing_and_runs_only_its_own_script(self):
        html = page.html_page("toy", [row_of()], [])
        policy = re.search('http-equiv="Content-Security-Policy" content="([^"]*)"', html)[1]
        self.assertTrue(policy.startswith("default-src 'none'; "))
        self.assertNotRegex(policy, "http|unsafe")
        for kind, element in (("script", "</script>\n<script>(.*?)</script>"),
                              ("style", "<style>(.*?)</style>")):
            text = re.search(element, html, re.DOTALL)[1]
            digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
            self.assertIn(f"{kind}-src 'sha256-{digest}'", policy)
        self.assertNotRegex(html,
                            r" src=|@import|url\(|fetch\(|XMLHttpRequest|innerHTML|AdjacentHTML|document.write")

    def test_colours_are_those_of_the_plots(self):
        colours = tuple(re.findall(r"--c\d: (#\w+);", page._part("page.css")))
        self.assertEqual(colours[:len(plots.COLOURS)], plots.COLOURS)


class Tables(unittest.TestCase):
    def test_have_texts_and_full_numbers(self):
        bad = row_of(label="bad", triangles=20, broken=["closed (5 boundary edges)"])
        del bad["seconds"]
        table, = page.page_data([row_of(triangles=1234567, rms=0.125), bad])["tables"]
        self.assertEqual(table["title"], "ball at resolution 40")
        self.assertEqual(table["rows"][0]["cells"], [["1,234,567", 1234567], ["0.2", 0.2], ["0.25", 0.25]])
        self.assertEqual(table["rows"][1]["cells"][1], None)
        self.assertEqual([len(line["trouble"]) for line in table["rows"]], [0, 1])

    def test_histories_are_of_cells_with_several_runs(self):
        history, = page.page_data([row_of("2"), row_of("2", "once"), row_of("1", triangles=30)])["histories"]
        self.assertEqual([run["date"][:10] for run in history["runs"]], ["2026-01-01", "2026-01-02"])
        series, = history["series"]
        self.assertEqual([(point["row"], point["run"], point["cells"][0]) for point in series["points"]],
                         [(2, 0, 30), (0, 1, 100)])
        self.assertEqual(page.page_data([row_of("1"), row_of("1", "b")])["histories"], [])


class Figures(unittest.TestCase):
    def test_extractions_have_errors_and_times(self):
        rows = [row_of(label="b 0", rms=0.25), row_of(label="b 0.1", triangles=50, rms=0.5, seconds=[0.4])]
        error, = titled(rows, "Triangles and distance")
        self.assertTrue(error["log_x"] and error["log_y"] and error["front"])
        self.assertEqual(points_of(error),
                         {"b 0": [[0, 100, 0.5, None, None]], "b 0.1": [[1, 50, 1, None, None]]})
        times, = titled(rows, "Time, ")
        self.assertEqual(points_of(times),
                         {"b 0": [[0, 0.2, 0, 0.1, 0.3]], "b 0.1": [[1, 0.4, 0, None, None]]})
        self.assertEqual(titled(rows, "Time and size"), [])
        for figure in (error, times):  # a label has one style
            self.assertEqual([series["style"] for series in figure["series"]], [0, 1])

    def test_several_resolutions_have_time_over_size(self):
        large = row_of(seconds=[2.0], resolution=80, voxelization={"label": "openvdb", "active_voxels": 4000})
        figure, = titled([large, row_of()], "Time and size")
        self.assertEqual(figure["x_label"], "active voxels")
        self.assertEqual(points_of(figure), {"a": [[1, 1000, 0.2, 0.1, 0.3], [0, 4000, 2, None, None]]})

    def test_plots_of_the_rows_replace_those_of_their_kind(self):
        plot = {"name": "p", "title": "asked", "x": "triangles", "y": ["to_rms"], "x_label": "",
                "y_label": ""}
        rows = [row_of(label="b", triangles=50), row_of(plots=[plot])]
        figure, = titled(rows, "asked")
        self.assertEqual(points_of(figure)["a"], [[1, 100, 0.5, None, None]])
        self.assertEqual(titled(rows, "Triangles and distance"), [])
        plot["categories"] = True
        figure, = titled(rows, "asked")
        self.assertEqual((figure["kind"], points_of(figure)["a"]), ("dots", [[1, 0.5, 0, None, None]]))

    def test_measurements_show_intervals(self):
        names = ["order", "order_low", "order_high", "size"]
        row = {"experiment": "scaling", "tier": "quick", "run": "1", "measurement": {"name": "m"},
               "case": {"name": "extraction"}, "variant": {"name": "a", "label": "a"},
               "table": {"title": "t", "columns": [{"name": n, "header": n, "meaning": n} for n in names]},
               "values": {"order": 1.9, "order_low": 1.7, "order_high": 2.1, "size": 7}}
        figure, = page.page_data([row])["figures"]
        self.assertEqual((figure["kind"], points_of(figure)), ("dots", {"a": [[0, 1.9, 0, 1.7, 2.1]]}))


def unpacked(head, packed):
    """Returns the steps of coordinates, the vertices of polygons and the distances, as viewer.js does."""
    data, values, at = zlib.decompress(base64.b64decode(packed)), [], 0
    for count in [head["points"]] * 3 + [3 * head["triangles"] + 4 * head["quads"]]:
        values.append([])
        for _ in range(count):
            code = shift = 0
            while True:
                code |= (data[at] & 127) << shift
                shift, at = shift + 7, at + 1
                if data[at - 1] < 128:
                    break
            values[-1].append((values[-1] or [0])[-1] + (-(code >> 1) - 1 if code & 1 else code >> 1))
    half = (len(data) - at) // 2
    distances = [(256 * data[at + i] + data[at + half + i]) / 65535 * head["largest"] for i in range(half)]
    return numpy.array(values[:3]).T, values[3], distances


class Meshes(unittest.TestCase):
    def setUp(self):
        self.directory = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()), "toy")
        self.directory.mkdir()
        self.notes = []

    def square(self, name, scalar="<f4"):
        """Writes a triangle and a quad as `hermesh run` does."""
        file = self.directory / "meshes" / name
        file.parent.mkdir(parents=True, exist_ok=True)
        kind = "float" if scalar == "<f4" else "double"
        header = "ply\nformat binary_little_endian 1.0\nelement vertex 4\n"
        header += "".join(f"property {kind} {axis}\n" for axis in "xyz")
        header += "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
        points = numpy.array([[0, 0, 0.25], [1, 0, 0.25], [1, 1, 0.25], [0, 1, 0.25]], scalar)
        faces = b"".join(bytes([len(face)]) + numpy.array(face, "<i4").tobytes()
                         for face in ([2, 1, 0], [0, 1, 2, 3]))
        file.write_bytes(header.encode() + points.tobytes() + faces)
        return file

    def meshes(self, rows, source):
        """Returns the meshes of the page if this script is the program that measures distances."""
        made = types.SimpleNamespace(command=[sys.executable, "-S", "-c", source], description={"threads": 1})
        with mock.patch.object(page.program, "load_program", lambda: made):
            return page.page_meshes(self.directory, rows, 10, self.notes)

    def test_packed_points_are_right_to_half_a_step(self):
        random = numpy.random.default_rng(1)
        points = random.normal(size=(300, 3)) * [1, 1e3, 1e-3]
        triangles, quads = random.integers(300, size=(500, 3)), random.integers(300, size=(200, 4))
        for voxel_size, far in ((0.5, random.random(300)), (1e-4, None)):
            head, packed = page.pack_mesh(points, triangles, quads, voxel_size, far)
            steps, corners, distances = unpacked(head, packed)
            errors = abs(head["lower"] + steps * head["step"] - points)
            self.assertLessEqual(errors.max(), head["step"] * 0.5001)
            self.assertEqual(corners, [*triangles.ravel(), *quads.ravel()])
            for distance, expected in zip(distances, [] if far is None else far / voxel_size, strict=True):
                self.assertAlmostEqual(distance, expected, delta=2 / 65535)
        points[0, 0] = numpy.nan
        with self.assertRaises(LabError):
            page.pack_mesh(points, triangles, quads, 0.5, None)

    def test_a_tiny_voxel_has_no_tiny_steps(self):
        points, none = numpy.array([[0, 0, 0], [1e6, 0, 0]]), numpy.zeros((0, 3), int)
        head, packed = page.pack_mesh(points, none, none, 1e-12, None)
        self.assertEqual(unpacked(head, packed)[0].max(), 1 << 22)

    def test_files_of_runs_are_read(self):
        for scalar in ("<f4", "<f8"):
            file = self.square("toy-ball-40/1-a.ply", scalar)
            points, triangles, quads = page.read_ply(file)
            self.assertEqual(points.tolist(), [[0, 0, 0.25], [1, 0, 0.25], [1, 1, 0.25], [0, 1, 0.25]])
            self.assertEqual((triangles.tolist(), quads.tolist()), ([[2, 1, 0]], [[0, 1, 2, 3]]))
        whole = file.read_bytes()
        for damaged in (b"no mesh", whole[:-1], whole + b"x", whole[:-4] + b"\x09\0\0\0",
                        whole[:-30] + b"\5" + whole[-29:]):
            file.write_bytes(damaged)
            self.assertEqual(self.meshes([row_of()], "pass"), [])
        self.assertEqual(len([note for note in self.notes if "toy-ball-40/1-a.ply" in note]), 5)

    def test_counts_are_all_none_or_a_number(self):
        self.assertEqual([page.mesh_count(text) for text in ("all", "none", "3")], [sys.maxsize, 0, 3])
        for wrong in ("", "some", "-1", "3.5", "3 ", "9" * 23):
            with self.assertRaises(argparse.ArgumentTypeError):
                page.mesh_count(wrong)

    def test_compared_methods_are_chosen_together(self):
        rows = [row_of(label=label, case={"name": case}) for case in ("z", "y", "x") for label in "abc"]
        for case in "xyz":
            for number, label in enumerate("abc", 1):
                self.square(f"toy-{case}-40/{number}-{label}.ply")
        self.square("toy-x-40/10-c.ply")
        groups = page._mesh_files(self.directory, rows)
        self.assertEqual([[row for _, row in group] for group in groups],
                         [[0, 1, 2], [3, 4, 5], [6, 7, 8, 8]])
        self.assertEqual([file.name for file, _ in groups[2]], ["1-a.ply", "2-b.ply", "3-c.ply", "10-c.ply"])
        for count, expected in ((0, []), (2, [0, 1]), (5, [0, 1, 2]), (7, [0, 1, 2, 3, 4, 5]),
                                (10, [0, 1, 2, 3, 4, 5, 6, 7, 8, 8])):
            chosen, total = page._chosen_meshes(groups, count)
            self.assertEqual(([row for _, row in chosen], total), (expected, 10))

    def test_have_their_rows_and_distances(self):
        for name in ("toy-ball-40/1-a-b.ply", "toy-ball-40/2-unknown.ply", "toy-ball-40-openvdb/1-other.ply"):
            self.square(name)
        changed = {"name": "ball", "origin": "generated", "sha256": "0123"}
        rows = [row_of("1", "a b"), row_of("2", "a b"), row_of("2", "other", case=changed)]
        meshes = self.meshes(rows, (
            "import json, os\njob = json.loads(input())\n"
            "answers = [{'distances': [0.25] * 4} for mesh in job['meshes']] + [{'done': True}]\n"
            "if job['sha256'] != 'abcdef': answers = [{'error': 'another input'}]\n"
            "for answer in answers: os.write(3, json.dumps(answer).encode() + b'\\n')"))
        heads = {head["file"].split("/")[1]: head for head, _ in meshes}
        first, other = heads["1-a-b.ply"], heads["1-other.ply"]
        self.assertEqual((first["row"], first["largest"], first["sentence"]), (1, 0.5, ""))  # in voxels
        self.assertEqual(unpacked(*meshes[0])[2], [0.5] * 4)
        self.assertEqual((first["group"], first["label"]), ("ball at resolution 40", "a b"))
        self.assertEqual((other["row"], other["largest"], other["sentence"]), (2, None, "another input"))
        self.assertEqual((heads["2-unknown.ply"]["row"], self.notes), (None, []))

    def test_without_a_working_program_have_no_distances(self):
        self.square("toy-ball-40/1-a.ply")
        for source in ("raise SystemExit(1)", "pass"):
            (head, _), = self.meshes([row_of()], source)
            self.assertEqual((head["largest"], bool(head["sentence"])), (None, True))

    def written(self, path):
        """Writes the page of a directory, or of a file of rows, and returns its data."""
        page.write_page(path, 0, io.StringIO())
        return data_in(((path if path.is_dir() else path.parent) / "report.html").read_text())

    def test_baselines_are_earlier_runs(self):
        baselines, own = self.directory.parent / "baselines", row_of("2")
        append_rows(self.directory / "rows.jsonl", [own])
        self.assertEqual(len(self.written(self.directory)["rows"]), 1)
        baselines.mkdir()
        another = row_of("1", experiment="another")
        append_rows(baselines / "rows.jsonl", [row_of("1", triangles=30), another, own])
        data = self.written(self.directory / "rows.jsonl")
        self.assertEqual([row["run"] for row in data["rows"]], ["1", "2"])
        table, = data["tables"]
        self.assertEqual((table["rows"][0]["row"], table["earlier"], len(data["histories"])), (1, 1, 1))
        local = self.directory.parent / "local/toy"  # as results/local/toy and results/baselines
        local.mkdir(parents=True)
        append_rows(local / "rows.jsonl", [row_of("3")])
        self.assertEqual([row["run"] for row in self.written(local)["rows"]], ["1", "2", "3"])


if __name__ == "__main__":
    unittest.main()
