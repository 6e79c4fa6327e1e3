import os
import pathlib
import sys
import tempfile
import unittest

from .. import benchmark, child, corpus

HERMESH = os.environ.get("HERMESH")
FACES = "0 2 3,0 3 1,4 5 7,4 7 6,0 1 5,0 5 4,2 6 7,2 7 3,0 4 6,0 6 2,1 3 7,1 7 5"
CUBE = "\n".join(["OFF", "8 12 0", *(f"{x} {y} {z}" for z in (0, 2) for y in (0, 2) for x in (0, 2)),
                  *(f"3 {face}" for face in FACES.split(",")), ""])
LIMITS = child.Limits(seconds=30, memory_mib=4096)


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
        self.assertGreater(ended.cpu_seconds, 0.01)


class Rates(unittest.TestCase):
    def test_classes(self):
        box = {"lower": [0, 0, 0], "upper": [1, 1, 1]}
        report = {"triangles": 100, "quads": 0, "boundary_edges": 0, "non_manifold_edges": 0,
                  "duplicate_polygons": 0, "inconsistent_edges": 0, "self_intersecting_pairs": 0}
        for change, bounds, expected in (
                ({}, box, "clean solid"),
                ({"self_intersecting_pairs": 1}, box, "closed, self-intersecting"),
                ({"non_manifold_edges": 1, "self_intersecting_pairs": 1}, box, "closed, non-manifold or doubled"),
                ({"boundary_edges": 2}, box, "few holes"),  # of 151 edges
                ({"boundary_edges": 20}, box, "open sheets"),
                ({}, {"lower": [0, 0, 0], "upper": [1, 1, 0]}, "flat"),
                ({"triangles": 0}, box, "no mesh")):
            self.assertEqual(benchmark.classify({**report, **change}, bounds), expected)
        self.assertEqual(benchmark.classify(None, None), "no mesh")

    def test_wilson_interval(self):
        # Wilson 1927, by hand for 9 of 10 at 95 %.
        self.assertEqual(benchmark.rate(9, 10), "90.0 [59.6, 98.2]")

    def test_sample_depends_on_the_seed_only(self):
        entries = [corpus.Entry("p", "1", f"f{i}", f"{i:064}", "off", 1, "none") for i in range(100)]
        first = corpus.sample(entries, 10, 1)
        self.assertEqual(len(first), 10)
        self.assertEqual(first, corpus.sample(list(reversed(entries)), 10, 1)[::-1])
        self.assertNotEqual(first, corpus.sample(entries, 10, 2))


@unittest.skipUnless(HERMESH, "the environment variable HERMESH names no program")
class Benchmark(unittest.TestCase):
    def test_rows_are_resumed_and_outputs_validated(self):
        with tempfile.TemporaryDirectory() as work:
            cache, out = pathlib.Path(work) / "cache", pathlib.Path(work) / "out"
            entry = corpus.Entry("package", "1", "cube.off", "0" * 64, "off", len(CUBE), "none")
            path = corpus.location(entry, cache)
            path.parent.mkdir(parents=True)
            path.write_text(CUBE)
            experiment = {"question": "", "resolution": 20, "seconds": 30, "memory_mib": 4096, "method": [
                {"name": "remesh",
                 "request": ["{hermesh}", "remesh", "{input}", "{output}", "--resolution", "{resolution}"]},
                {"name": "no mesh", "request": ["cp", "{input}", "{output}"]},
                {"name": "nothing", "request": ["true"]},
                {"name": "refuses", "request": ["false"]}]}
            said = []
            rows = benchmark.Benchmark(experiment, HERMESH, out, said.append).run([entry], cache)
            self.assertEqual([r["status"] for r in rows], ["done", "wrong output", "wrong output", "refused"])
            self.assertEqual(rows[0]["class"], "clean solid")
            self.assertTrue(rows[0]["watertight"])
            self.assertEqual(rows[0]["triangles"], 12)
            self.assertLess(rows[0]["lost"] + rows[0]["invented"], 1e-3)
            # A line that was cut off is written again, complete ones are not.
            file = out / "rows.jsonl"
            lines = file.read_text().splitlines(keepends=True)
            file.write_text("".join(lines[:3]) + lines[3][:20])
            said.clear()
            again = benchmark.Benchmark(experiment, HERMESH, out, said.append).run([entry], cache)
            self.assertEqual(len(said), 1)
            self.assertEqual([r["status"] for r in again], [r["status"] for r in rows])
            text = benchmark.table(rows, ["remesh", "refuses"])
            self.assertIn("| remesh | clean solid | 1 | 100.0", text)
            self.assertIn("| refuses | clean solid | 1 | 0.0", text)


if __name__ == "__main__":
    unittest.main()
