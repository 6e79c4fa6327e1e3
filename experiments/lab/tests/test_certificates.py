import pathlib
import tempfile
import unittest

import numpy

from .. import certificates, program, solids
from ..damage import write_mesh

checker = certificates.checker
HERMESH = program.program_file().with_name("hermesh")
POINTS = numpy.array([[0, 0, 0], [4, 0, 0], [0, 4, 0], [0, 0, 4.0]])
TETRAHEDRON = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]


def verify(source, output, targets=None, error=0.5, uncovered=0.0):
    """Checks a certificate without divided triangles, which assigns each to the one of the same number."""
    count = len(source[1]), len(output[1])
    targets = targets or [*range(count[1]), *range(count[0])]
    steps = numpy.diff([0, *targets[:count[1]]]).tolist() + numpy.diff([0, *targets[count[1]:]]).tolist()
    header = {"error": error, "cuts": False, "input_triangles": count[0], "output_triangles": count[1]}
    return checker.verify(source, output, header, [certificates._step(step) for step in steps], uncovered)


def bodies(*shifts):
    """Returns tetrahedra, each moved."""
    return (numpy.concatenate([POINTS + shift for shift in shifts]),
            [[p + 4 * i for p in triangle] for i in range(len(shifts)) for triangle in TETRAHEDRON])


class Checker(unittest.TestCase):
    def refuses(self, *arguments, **options):
        with self.assertRaises(checker.Refused):
            verify(*arguments, **options)

    def test_distances_by_hand(self):
        solid = POINTS, TETRAHEDRON
        verify(solid, (POINTS + [0.5, 0, 0], TETRAHEDRON), error=0.5)
        self.refuses(solid, (POINTS + [0.5, 0, 0], TETRAHEDRON), error=numpy.nextafter(0.5, 0))
        self.refuses(solid, solid, [1, 1, 2, 3, 0, 1, 2, 3])  # the output's first triangle
        self.refuses(solid, solid, [0, 1, 2, 3, 1, 1, 2, 3])  # the input's

    def test_topology(self):
        solid = POINTS, TETRAHEDRON
        self.refuses(solid, (POINTS, TETRAHEDRON[:3]))
        self.refuses(solid, (POINTS, [t[::-1] for t in TETRAHEDRON]))
        self.refuses(solid, (POINTS, [TETRAHEDRON[0][::-1], *TETRAHEDRON[1:]]))
        self.refuses(solid, (POINTS, [*TETRAHEDRON, TETRAHEDRON[0]]))
        two_fans = numpy.concatenate([POINTS, -POINTS[1:]])
        pinched = [*TETRAHEDRON, [0, 4, 5], [0, 6, 4], [0, 5, 6], [4, 6, 5]]
        self.refuses((two_fans, pinched), (two_fans, pinched))

    def test_intersections_of_two_bodies(self):
        for shift in ([1, 1, 1], [4, 0, 0], [2, 2, 0], [0.5, 0.5, 0.5], [4 / 3, 4 / 3, 4 / 3], [0, 0, 0],
                      [-1, -1, 4], [0, 0, 4]):
            with self.subTest(shift=shift):
                self.refuses(*[bodies([0, 0, 0], shift)] * 2)
        for shift in ([10, 0, 0], [4 + 2**-40, 0, 0], [1.5, 1.5, 1.5], [-4, -4, -4]):
            with self.subTest(shift=shift):
                verify(*[bodies([0, 0, 0], shift)] * 2)

    def test_a_fold_and_a_vertex_that_goes_through(self):
        # A tetrahedron whose triangle 123 is divided at its middle, which moves along the diagonal.
        triangles = [*TETRAHEDRON[:3], [1, 2, 4], [2, 3, 4], [3, 1, 4]]
        for place, right in ((2, True), (0.5, True), (4 / 3, True), (0, False), (-0.5, False)):
            mesh = numpy.concatenate([POINTS, [[place] * 3]]), triangles
            with self.subTest(place=place):
                (verify if right else self.refuses)(mesh, mesh)

    def test_segments_and_triangles(self):
        triangle = numpy.array([[0, 0, 0], [8, 0, 0], [0, 8, 0]], object)
        for p, q, expected in (((1, 1, 1), (1, 1, -1), True), ((1, 1, 1), (1, 1, 0), True),
                               ((9, 9, 1), (9, 9, -1), False), ((4, 4, 1), (4, 4, -1), True),
                               ((1, 1, 0), (2, 2, 0), True), ((9, 9, 0), (9, -9, 0), False),
                               ((-1, 4, 0), (9, 4, 0), True), ((8, 0, 0), (9, 0, 5), True),
                               ((9, 0, 0), (12, 0, 0), False), ((1, 1, 1), (2, 2, 2), False)):
            with self.subTest(p=p, q=q):
                self.assertEqual(checker.meets(numpy.array(p, object), numpy.array(q, object), triangle),
                                 expected)

    def test_parts_have_no_gap(self):
        line = [3, -5, 7]
        parts = checker.divided([(1, 0, 0), (0, 1, 0), (0, 0, 1)], line)
        areas = [abs(numpy.linalg.det(numpy.array([[x / sum(c) for x in c] for c in part])[[0, i, i + 1]]))
                 for part in parts for i in range(1, len(part) - 1)]
        self.assertAlmostEqual(sum(areas), 1.0)
        common = set(parts[0]) & set(parts[1])
        self.assertEqual(len(common), 2)
        self.assertTrue(all(numpy.dot(line, corner) == 0 for corner in common))

    def test_cuts_must_divide_the_polygon(self):
        quad = [[0, 1, 2, 3]]
        checker.triangles_of(quad, [[1, 2, 3], [1, 3, 0]])
        for cuts in ([[0, 1, 2], [0, 1, 3]], [[0, 1, 2]], [[0, 2, 1], [0, 3, 2]]):
            with self.assertRaises(checker.Refused):
                checker.triangles_of(quad, cuts)


class Program(unittest.TestCase):
    def certified(self, name, error="1%", ending="ply", options=()):
        """Returns a certified mesh of a solid, in a directory of its own."""
        (points, triangles), = solids.all_solids(HERMESH, [name]).values()
        directory = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        write_mesh(directory / "input.obj", points, triangles, 1e-5)
        files, _ = certificates.make(HERMESH, directory / "input.obj", directory, error, options)
        self.assertTrue(files, name)
        return certificates.Certified(*files)

    def test_certificates_are_verified(self):
        for name, error, options in (("sphere", "1%", ()), ("trefoil", "0.3%", ()), ("sponge", "2%", ()),
                                     ("linked rings", "1%", ["--through-volume"])):
            with self.subTest(name):
                made = self.certified(name, error, options=options)
                found = checker.verify(*made.state())
                self.assertEqual([found["uncovered_input"], found["uncovered_output"]], [0, 0])
                self.assertGreaterEqual(found["pieces"], sum(found[f"{side}_triangles"]
                                                             for side in ("input", "output")))

    def test_polygons_with_more_corners(self):
        with tempfile.TemporaryDirectory() as name:
            directory = pathlib.Path(name)
            # A prism whose ends are L-shaped, so that their first corner does not see all others.
            outline = [(1, 2), (0, 2), (0, 0), (2, 0), (2, 1), (1, 1)]
            points = [f"{x} {y} {z}" for z in (0, 1) for x, y in outline]
            faces = ["6 5 4 3 2 1 0", "6 6 7 8 9 10 11",
                     *(f"4 {i} {(i + 1) % 6} {(i + 1) % 6 + 6} {i + 6}" for i in range(6))]
            (directory / "input.off").write_text("\n".join(["OFF", "12 8 0", *points, *faces, ""]))
            written = []
            for threads in "1", "3":
                files, _ = certificates.make(HERMESH, directory / "input.off", directory, "1%",
                                             ["--threads", threads])
                made = certificates.Certified(*files)
                self.assertEqual(checker.verify(*made.state())["input_triangles"], 20)
                written.append(files[2].read_bytes())
            self.assertEqual(*written)

    def test_false_ones_are_refused(self):
        made = self.certified("two bodies")
        for kind, change in certificates.CHANGES.items():
            with self.subTest(kind):
                random = numpy.random.default_rng(1)
                states = (change(made, made.state(), random) for _ in range(certificates.MOST_TRIES))
                state = next(state for state in states if state)
                self.assertTrue(certificates.is_refused(state))


if __name__ == "__main__":
    unittest.main()
