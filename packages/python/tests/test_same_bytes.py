"""The files that the program writes for the same options, byte by byte. $HERMESH_PROGRAM is the program."""

import gzip
import json
import os
import pathlib
import subprocess
import tempfile
import unittest

import numpy as np
from shapes import cube, torus

import hermesh


class SameBytes(unittest.TestCase):

    def setUp(self):
        holder = tempfile.TemporaryDirectory()
        self.addCleanup(holder.cleanup)
        self.folder = pathlib.Path(holder.name)
        self.torus, self.cube = self.folder / "torus.ply", self.folder / "cube.ply"
        hermesh.write_mesh(self.torus, torus())
        hermesh.write_mesh(self.cube, cube(1.0, (0.5, 0, -0.5)))

    def program(self, *arguments):
        """What the program prints; its files are looked at by the caller."""
        done = subprocess.run([os.environ["HERMESH_PROGRAM"], *map(str, arguments)], capture_output=True,
                              text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def compare(self, result, end, *arguments):
        """Checks that the program, with these arguments followed by a path, writes the same bytes as the
        result."""
        theirs, ours = self.folder / ("program" + end), self.folder / ("module" + end)
        self.program(*arguments, theirs)
        result.write(ours)
        self.assertGreater(ours.stat().st_size, 100)
        self.assertEqual(theirs.read_bytes(), ours.read_bytes())

    def test_of_remesh(self):
        self.compare(hermesh.remesh(self.torus, resolution=50), ".ply", "remesh", self.torus, "--resolution",
                     50)
        # Arrays give the same result as their file.
        self.compare(hermesh.remesh(torus(), voxel_size=0.05, tolerance=0.3, signs="winding-number",
                                    exterior_band=4), ".obj",
                     "remesh", self.torus, "--voxel-size", 0.05, "-o", "tolerance=0.3", "--signs",
                     "winding-number", "--exterior-band", 4)
        self.compare(hermesh.remesh(self.torus, resolution=40, extractor="certified-octree", flatness=0.2,
                                    threads=1), ".ply",
                     "remesh", self.torus, "--resolution", 40, "--extractor", "certified-octree", "-o",
                     "flatness=0.2")

    def test_of_remesh_within(self):
        made = hermesh.remesh_within(self.torus, error=0.03)
        self.compare(made.mesh, ".ply", "remesh", self.torus, "--error", 0.03)
        self.assertLessEqual(max(made.to_polygons, made.from_polygons), 0.03)
        self.compare(hermesh.remesh_within(self.torus, triangles=300).mesh, ".ply", "remesh", self.torus,
                     "--triangles", 300)
        self.compare(hermesh.remesh(self.torus, error=0.03), ".ply", "remesh", self.torus, "--error", 0.03)
        with self.assertRaises(hermesh.Error):
            hermesh.remesh_within(self.torus)

    def test_of_exceptions(self):
        plate = self.folder / "hair.ply"
        points, quads = cube(1.0)
        hermesh.write_mesh(plate, (np.vstack([points, points * [1, 1, 0.0001] + [0, 0, 1.3037]]),
                                   np.vstack([quads, quads + 8])))
        with self.assertRaises(hermesh.Error):
            hermesh.remesh_within(plate, error=0.05, thin="drop", through_volume=True)
        with self.assertWarns(hermesh.Note):
            made = hermesh.remesh_within(plate, error=0.05, thin="drop", through_volume=True,
                                         except_thin=True)
        theirs, ours = self.folder / "program.ply", self.folder / "module.ply"
        self.program("remesh", plate, theirs, "--error", 0.05, "--thin", "drop", "--through-volume",
                     "--except-thin")
        made.mesh.write(ours)
        self.assertEqual(theirs.read_bytes(), ours.read_bytes())
        self.assertTrue(made.exceptions)
        for ball in made.exceptions:
            self.assertGreater(ball.distance, 0.05)
            self.assertFalse(ball.is_hole)

    def test_of_thin_parts(self):
        plate = self.folder / "plate.ply"
        points, quads = cube(1.0)
        hermesh.write_mesh(plate, (points * [1, 1, 0.001] + [0, 0, 0.013], quads))
        with self.assertWarns(hermesh.Note):
            self.compare(hermesh.remesh(plate, voxel_size=0.02), ".ply", "remesh", plate, "--voxel-size", 0.02)
        for thin in ["drop", "refuse", "lose"]:
            with self.assertRaises(hermesh.Error):
                hermesh.remesh(plate, voxel_size=0.02, thin=thin)

    def test_of_quads(self):
        self.compare(hermesh.remesh(cube(1.0, (0.5, 0, -0.5)), resolution=30, extractor="dual-contouring"),
                     ".ply", "remesh", self.cube, "--resolution", 30, "--extractor", "dual-contouring")

    def test_of_voxelize_and_extract(self):
        level_set = hermesh.voxelize(self.torus, resolution=40, interior_band=5)
        self.compare(level_set, ".vdb", "voxelize", self.torus, "--resolution", 40, "--interior-band", 5)
        volume = self.folder / "program.vdb"
        self.compare(hermesh.extract(hermesh.read_vdb(volume), extractor="marching-cubes", isovalue=0.05),
                     ".off", "extract", volume, "--extractor", "marching-cubes", "--isovalue", 0.05)
        self.compare(hermesh.extract(level_set, source=self.torus, hermite="exact"), ".ply", "extract",
                     volume, "--source", self.torus, "-o", "hermite=exact")

    def test_of_combine(self):
        for operation in ("union", "intersection", "difference"):
            mesh = hermesh.combine(operation, self.torus, self.cube, resolution=40, tolerance=0.2)
            theirs, ours = self.folder / "program.ply", self.folder / "module.ply"
            self.program("combine", operation, self.torus, self.cube, theirs, "--resolution", 40, "-o",
                         "tolerance=0.2")
            mesh.write(ours)
            self.assertEqual(theirs.read_bytes(), ours.read_bytes())

    def test_of_fracture(self):
        fracture = hermesh.fracture(self.torus, "chunks:6", resolution=40, seed=3, min_volume=10,
                                    impact=(1, 0, 0))
        pieces = self.folder / "pieces"
        self.program("fracture", self.torus, pieces, "--resolution", 40, "--cutters", "chunks:6", "--seed", 3,
                     "--min-volume", 10, "--impact", 1, 0, 0, "--no-picture")
        files = sorted(pieces.glob("*.ply"))
        self.assertEqual(len(files), len(fracture))
        self.assertGreaterEqual(len(files), 6)
        for file, piece in zip(files, fracture.pieces):
            ours = self.folder / "piece.ply"
            piece.mesh.write(ours)
            self.assertEqual(file.read_bytes(), ours.read_bytes(), file)

    def test_of_import(self):
        samples = np.random.default_rng(1).integers(-1000, 2000, (6, 7, 8), dtype=np.int16)
        raw = self.folder / "scan.raw.gz"
        raw.write_bytes(gzip.compress(samples.tobytes(), mtime=0))
        volume = hermesh.import_volume(raw, dims=(8, 7, 6), type="int16", spacing=(0.5, 0.5, 2))
        np.testing.assert_array_equal(volume.to_numpy(), samples.transpose())  # x is fastest in the file
        self.compare(volume, ".vdb", "import", raw, "--dims", "8,7,6", "--type", "int16", "--spacing",
                     "0.5,0.5,2")

    def test_of_validate(self):
        mesh = self.folder / "mesh.ply"
        hermesh.remesh(self.torus, resolution=30).write(mesh)
        theirs = json.loads(self.program("validate", mesh, "--reference", self.torus, "--json", "--certify",
                                         "--samples", 5000))
        report = hermesh.validate(mesh, reference=self.torus, certify=True, samples=5000)
        ours = report.to_dict()
        # The program adds values such as the file's name.
        self.assertGreater(len(ours), 15)
        self.assertEqual({key: theirs.get(key) for key in ours}, ours)
        self.assertTrue(report.watertight)
        self.assertEqual(report.genus, 1)
        self.assertLess(report.to_reference.max, report.certified_to_reference.upper)
        self.assertIn("watertight", str(report))

    def test_of_errors(self):
        broken = self.folder / "broken.ply"
        broken.write_bytes(self.torus.read_bytes()[:2000])
        for path in (broken, self.folder / "absent.ply"):
            done = subprocess.run([os.environ["HERMESH_PROGRAM"], "remesh", path, self.folder / "out.ply",
                                   "--resolution", "40"],
                                  capture_output=True, text=True)
            self.assertEqual(done.returncode, 1)
            with self.assertRaises(hermesh.Error) as caught:
                hermesh.remesh(path, resolution=40)
            self.assertIsInstance(caught.exception, RuntimeError)
            self.assertIn(str(caught.exception), done.stderr)


if __name__ == "__main__":
    unittest.main()
