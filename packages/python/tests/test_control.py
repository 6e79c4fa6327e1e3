"""Progress, cancelling, threads, notes, errors."""

import ast
import os
import pathlib
import subprocess
import sys
import threading
import time
import unittest
import warnings

from shapes import cube, torus, volume_of

import hermesh


def large(**options):
    """Work of several seconds, on half a million triangles."""
    return hermesh.remesh(torus(around=1000, across=500), resolution=500, tolerance=0.1, **options)


class Control(unittest.TestCase):

    def test_progress_tells_all_stages_in_the_callers_thread(self):
        seen, threads = [], set()

        def progress(stage, fraction):
            seen.append((stage, fraction))
            threads.add(threading.get_ident())

        log = hermesh.Log()
        hermesh.remesh(torus(), resolution=60, thin="drop", progress=progress, log=log)
        self.assertEqual(threads, {threading.get_ident()})
        self.assertTrue(all(0 <= fraction <= 1 for _, fraction in seen))
        stages = {stage for stage, _ in log.stage_seconds}
        self.assertGreater(len(stages), 2)
        for stage in stages:
            self.assertIn((stage, 0.0), seen)
            self.assertIn((stage, 1.0), seen)
        self.assertIn("lost_surface_share", log.figures)

    def test_what_progress_raises_comes_out(self):

        class Mine(Exception):
            pass

        def progress(stage, fraction):
            raise Mine(stage)

        with self.assertRaises(Mine):
            hermesh.remesh(torus(), resolution=100, progress=progress)
        self.assertEqual(len(hermesh.remesh(cube(), resolution=10).points), 8)

    def test_an_event_cancels_soon(self):
        event, set_at = threading.Event(), []

        def set_it():
            set_at.append(time.monotonic())
            event.set()

        timer = threading.Timer(0.4, set_it)
        timer.start()
        with self.assertRaises(hermesh.Cancelled):
            large(cancel=event)
        self.assertLess(time.monotonic() - set_at[0], 1.0)

    def test_ctrl_c_stops_the_work(self):
        script = """if True:
            import os, signal, sys, threading, time
            from test_control import large
            begun = []
            def interrupt():
                begun.append(time.monotonic())
                os.kill(os.getpid(), signal.SIGINT)
            threading.Timer(0.5, interrupt).start()
            try:
                large()
            except KeyboardInterrupt:
                print("interrupted", time.monotonic() - begun[0])
            """
        folder = os.path.dirname(os.path.abspath(__file__))
        done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, cwd=folder)
        words = done.stdout.split()
        self.assertEqual(words[:1], ["interrupted"], done.stderr)
        self.assertLess(float(words[1]), 1.0)

    def test_other_threads_run_meanwhile(self):
        event, steps = threading.Event(), 0
        raised = []

        def work():
            try:
                large(cancel=event)
            except hermesh.Cancelled as error:
                raised.append(error)

        thread = threading.Thread(target=work)
        thread.start()
        until = time.monotonic() + 0.5
        while time.monotonic() < until:
            steps += 1
            time.sleep(0.005)
        event.set()
        thread.join()
        self.assertEqual(len(raised), 1)
        self.assertGreater(steps, 20)  # a lock that is held would let none happen

    def test_any_number_of_threads_makes_the_same_bytes(self):
        a, b = (hermesh.remesh(torus(), resolution=60, threads=threads) for threads in (1, 2))
        self.assertEqual(a.points.tobytes(), b.points.tobytes())
        self.assertEqual(a.triangles.tobytes(), b.triangles.tobytes())
        with self.assertRaisesRegex(hermesh.Error, "at least 1, not 0"):
            hermesh.remesh(torus(), resolution=60, threads=0)

    def test_notes_are_warnings_or_go_to_the_log(self):
        points, quads = cube()
        thin = points * [1, 1, 0.01] + [0, 0, 0.03], quads  # a plate between two layers of samples
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            hermesh.voxelize(thin, voxel_size=0.1)
        self.assertTrue(caught)
        self.assertTrue(all(issubclass(w.category, hermesh.Note) for w in caught))
        self.assertTrue(all(w.filename == __file__ for w in caught), [w.filename for w in caught])
        log = hermesh.Log()
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            hermesh.voxelize(thin, voxel_size=0.1, log=log)
        self.assertIn(log.notes[0], {str(w.message) for w in caught})

    def test_errors_are_sentences(self):
        for options, words in (({}, "exactly one of"),
                               ({"resolution": 10, "voxel_size": 1.0}, "exactly one of"),
                               ({"resolution": 10, "extractor": "marching-squares"},
                                "there is no extractor 'marching-squares'"),
                               ({"resolution": 10, "tolerence": 0.1}, "has no option 'tolerence'"),
                               ({"resolution": 10, "tolerance": -1}, "tolerance"),
                               ({"resolution": 10, "signs": "auto", "voxelizer_options": {"signs": "auto"}},
                                "given twice")):
            with self.assertRaisesRegex(hermesh.Error, words):
                hermesh.remesh(cube(), **options)
        with self.assertRaisesRegex(hermesh.Error, "not 'xor'"):
            hermesh.combine("xor", cube(), cube(), resolution=10)
        with self.assertRaises(TypeError):
            hermesh.remesh(cube(), resolution=10, tolerance=[1])
        with self.assertRaises(TypeError):
            hermesh.remesh(cube(), resolution="ten")

    def test_pieces_fit_and_add_up(self):
        fracture = hermesh.fracture(cube(), "planes:1,0,0,0.3;0,1,0,0.6", resolution=24)
        self.assertEqual(len(fracture), 4)
        self.assertAlmostEqual(sum(piece.volume for piece in fracture.pieces), 1.0, places=3)
        self.assertTrue(hermesh.validate_fracture(fracture).consistent)
        in_half = hermesh.fracture(cube(), [cube(1.0, (0.5, -0.1, -0.1))], resolution=24)
        self.assertEqual(len(in_half), 2)
        self.assertEqual(in_half.pieces[0].inertia.shape, (3, 3))

    def test_booleans_have_their_volumes(self):
        a, b = cube(), cube(1.0, (0.5, 0.5, 0.5))
        for operation, volume in (("union", 1.875), ("intersection", 0.125), ("difference", 0.875)):
            self.assertAlmostEqual(volume_of(hermesh.combine(operation, a, b, resolution=30)), volume,
                                   places=3)

    def test_an_open_mesh_has_defects_with_places(self):
        points, quads = cube()
        report = hermesh.validate((points, quads[1:]))
        self.assertFalse(report.watertight)
        self.assertEqual(report.boundary_edges, 4)
        defect = next(d for d in report.defects if d.name == "boundary_edges")
        self.assertEqual(defect.count, 4)
        for place in defect.places:
            self.assertAlmostEqual(place.point[2], 0.0)  # the face that is missing lies there

    def test_methods_are_listed(self):
        methods = {method.name: method for method in hermesh.extractors()}
        self.assertTrue(methods["manifold-dual-contouring"].manifold)
        self.assertIn("tolerance", [option.name for option in methods["manifold-dual-contouring"].options])
        self.assertIn("hermesh", [method.name for method in hermesh.voxelizers()])

    def test_type_hints_name_what_there_is(self):
        from hermesh import _core, _validation
        for module in (_core, _validation):
            file = pathlib.Path(hermesh.__file__).with_name(module.__name__.split(".")[1] + ".pyi")
            stubs = ast.parse(file.read_text(encoding="utf-8"))
            named = {node.name: node for node in stubs.body
                     if isinstance(node, (ast.ClassDef, ast.FunctionDef))}
            there = {name for name in vars(module) if not name.startswith("_")}
            self.assertEqual(set(named), there)
            for name, node in named.items():
                if not isinstance(node, ast.ClassDef) or name in ("Error", "Cancelled"):
                    continue
                members = {m.name if isinstance(m, ast.FunctionDef) else m.target.id for m in node.body
                           if isinstance(m, (ast.FunctionDef, ast.AnnAssign))}
                public = {m for m in vars(getattr(module, name)) if not m.startswith("_")}
                self.assertEqual({m for m in members if not m.startswith("_")}, public, name)

    def test_every_function_says_what_it_does(self):
        for name in hermesh.__all__:
            self.assertGreater(len(getattr(hermesh, name).__doc__ or ""),
                               15 if name not in ("Error", "Cancelled") else -1, name)


if __name__ == "__main__":
    unittest.main()
