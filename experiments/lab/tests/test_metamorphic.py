import tempfile
import unittest

import numpy

from .. import metamorphic, program, solids

HERMESH = program.program_file().with_name("hermesh")
CUBE = solids.on_lattice(*dict(solids._closed_form())["cube"])


class Identity(metamorphic.Bench):
    """Returns the input as its mesh, changed by `fault(corners, mesh, voxel, unit, threads)`."""

    def __init__(self, directory, fault):
        super().__init__(None, directory)
        self.fault = fault

    def remesh(self, mesh, words, voxel=metamorphic.VOXEL, unit=metamorphic.UNIT, threads=1):
        corners = self.fault(mesh[0][mesh[1]] * unit, mesh, voxel, unit, threads)
        return metamorphic.in_order(corners), metamorphic._written(self, corners)

    def apart(self, first, second):  # of the boxes
        meshes = [metamorphic.polygons.read(self.directory / name)[0] for name in (first, second)]
        boxes = [numpy.concatenate([corners.min((0, 1)), corners.max((0, 1))]) for corners in meshes]
        return numpy.abs(boxes[0] - boxes[1]).max() / metamorphic.VOXEL


# Relation: a fault that violates it.
FAULTS = {
    "number of threads": lambda c, mesh, voxel, unit, threads: c * (1 if threads == 1 else 1 + 2**-20),
    "scale by a power of two": lambda c, mesh, voxel, unit, threads: c + 1e-6,
    "order of triangles and vertices": lambda c, mesh, *_: c + 2**-20 * mesh[0][0],
    "shift by whole voxels": lambda c, mesh, *_: c * 1.1,
    "far body added": lambda c, mesh, *_: c + 2**-20 * len(mesh[1]),
    "triangles divided": lambda c, mesh, *_: c * (1 + 0.001 * len(mesh[1])),
    "symmetry of the cube": lambda c, mesh, *_: c * [1.0, 1.5, 2.0],
    "voxels halved": lambda c, mesh, voxel, *_: c * (1 + 0.1 / voxel)}


class Relations(unittest.TestCase):
    def test_hermesh_keeps_them(self):
        for relation in metamorphic.RELATIONS:
            with self.subTest(relation):
                (_, same, value), = metamorphic.check(HERMESH, relation, "dual-contouring", "cube", CUBE)
                self.assertLessEqual(value, metamorphic.RELATIONS[relation][1].get("uniform", 0.0))
                if relation in ("number of threads", "scale by a power of two"):
                    self.assertTrue(same)

    def test_laws_of_commands(self):
        for command, (_, bound) in metamorphic.COMMANDS.items():
            with self.subTest(command):
                for what, _, value in metamorphic.check(HERMESH, command, "", "cube", CUBE):
                    self.assertLessEqual(value, bound, what)

    def test_the_order_of_triangles_does_not_count(self):
        corners = numpy.arange(18.0).reshape(2, 3, 3)
        turned = numpy.roll(corners[::-1], 1, 1)
        numpy.testing.assert_array_equal(metamorphic.in_order(corners), metamorphic.in_order(turned))
        mirrored = metamorphic.in_order(corners[:, ::-1])
        self.assertFalse((mirrored == metamorphic.in_order(corners)).all())

    def test_violations_are_seen(self):
        for relation, (function, bounds) in metamorphic.RELATIONS.items():
            for fault, right in ((lambda corners, *_: corners, True), (FAULTS[relation], False)):
                with self.subTest(relation, right=right), tempfile.TemporaryDirectory() as directory:
                    bench = Identity(directory, fault)
                    same, value = function(bench, CUBE, [], numpy.random.default_rng(3))
                    self.assertEqual(value <= bounds.get("uniform", 0.0), right)
                    if same:
                        self.assertEqual(value, 0)


if __name__ == "__main__":
    unittest.main()
