import unittest

import numpy

from .. import damage, lattice, program, solids

MESHES = {name: solids.on_lattice(*mesh) for name, mesh in solids._closed_form()}
HERMESH = program.program_file().with_name("hermesh")
CUBE = MESHES["cube"]


def pairs_of(first, second):
    """Returns how many pairs intersect, by kind, of two triangles (3, 3)."""
    points, triangles = numpy.unique(numpy.array([*first, *second]), axis=0, return_inverse=True)
    return [len(pairs) for pairs in lattice.intersections(points, triangles.reshape(2, 3))]


class Lattice(unittest.TestCase):
    FLAT = ((0, 0, 0), (8, 0, 0), (0, 8, 0))

    def test_pairs_computed_by_hand(self):
        for other, expected in (
                (((2, 2, -4), (2, 2, 4), (20, 20, 0)), [1, 0, 0]),  # through it
                (((2, 2, 1), (2, 2, 4), (20, 20, 2)), [0, 0, 0]),  # above it
                (((2, 2, 0), (2, 3, 9), (3, 2, 9)), [1, 0, 0]),  # touches with a vertex
                (((4, 4, 0), (9, 9, 0), (9, 8, 0)), [1, 0, 0]),  # touches the long side, in the plane
                (((5, 4, 0), (9, 9, 0), (9, 8, 0)), [0, 0, 0]),  # beside it, in the plane
                (((1, 1, 0), (2, 1, 0), (1, 2, 0)), [1, 0, 0]),  # within it
                (((0, 0, 0), (-8, 0, 0), (0, -8, 0)), [0, 0, 0]),  # shares a vertex only
                (((0, 0, 0), (2, 2, 0), (0, -8, 3)), [0, 1, 0]),  # shares a vertex, and a segment
                (((0, 0, 0), (4, 4, 1), (-4, -1, 1)), [0, 0, 0]),
                (((0, 0, 0), (8, 0, 0), (0, 3, 3)), [0, 0, 0]),  # share an edge
                (((0, 0, 0), (8, 0, 0), (3, -3, 0)), [0, 0, 0]),
                (((0, 0, 0), (8, 0, 0), (9, 3, 0)), [0, 0, 1])):  # folded
            with self.subTest(other=other):
                self.assertEqual(pairs_of(self.FLAT, other), expected)
                self.assertEqual(pairs_of(other[::-1], self.FLAT), expected)

    def test_counts_of_two_tetrahedra(self):
        points = numpy.array([[0, 0, 0], [4, 0, 0], [0, 4, 0], [0, 0, 4], [-4, 0, 0], [0, -4, 0], [0, 0, -4]])
        first, shared = damage.TETRAHEDRON, numpy.array([0, 4, 5, 6])
        facts = lattice.facts(points, numpy.concatenate([first, shared[damage.TETRAHEDRON][:, ::-1]]))
        self.assertEqual([facts[key] for key in ("components", "non_manifold_vertices", "boundary_edges",
                                                 "euler_characteristic", "inside_out_components")],
                         [1, 1, 0, 3, 0])
        self.assertAlmostEqual(facts["smallest_angle"], 45.0)
        facts = lattice.facts(points, first[:3])
        self.assertEqual([facts["boundary_edges"], facts["isolated_points"]], [3, 3])

    def test_a_cavity_faces_inwards(self):
        points, triangles = MESHES["ball with a cavity"]
        self.assertEqual(lattice.inside_out(points, triangles), 0)
        self.assertEqual(lattice.inside_out(points, triangles[:, ::-1]), 1)


class Solids(unittest.TestCase):
    def test_have_no_defect(self):
        for name, (points, triangles) in MESHES.items():
            with self.subTest(name):
                facts = lattice.facts(points, triangles)
                self.assertEqual(damage.words_of(facts, facts["components"]), set())
                self.assertGreater(lattice.volume(points, triangles), 0)
                self.assertFalse((points % 4).any())


class Damages(unittest.TestCase):
    def test_each_kind_is_as_it_states(self):
        for kind, (_, must, _) in damage.KINDS.items():
            with self.subTest(kind):
                damaged, facts = damage.damage(kind, CUBE, 1)
                again, _ = damage.damage(kind, CUBE, 1)
                self.assertTrue((damaged.points == again.points).all())
                self.assertLessEqual(must, damaged.words)
                if kind not in ("none", "shift", "other units", "exchanged axes", "component inside out"):
                    self.assertTrue(len(damaged.points) != len(CUBE[0]) or damaged.text or damaged.reference
                                    or (damaged.points != CUBE[0]).any()
                                    or len(damaged.triangles) != len(CUBE[1])
                                    or (damaged.triangles != CUBE[1]).any())

    def test_is_not_done_where_it_cannot_be(self):
        flat = CUBE[0] // [1, 1, 100], CUBE[1]
        self.assertEqual(damage.damage("inner shell", flat, 1), (None, None))

    @unittest.skipUnless(HERMESH.is_file(), "the program is not built")
    def test_reports_are_right(self):
        for kind in damage.KINDS:
            with self.subTest(kind):
                words, wrong = damage.check(HERMESH, kind, "cube", CUBE, 0)
                self.assertEqual(wrong, [])

    def test_a_wrong_report_is_noticed(self):
        damaged, facts = damage.damage("hole", CUBE, 1)
        report = facts | {"status": "done", "self_intersections": facts, "libraries": {}, "watertight": False}
        self.assertEqual(damage.mistakes(report, damaged, facts, 1.0, 1), ({"boundary"}, []))
        for change in ({"boundary_edges": 0}, {"watertight": True}, {"components": 2}, {"disjoint": 1},
                       {"smallest_angle": 1.0}):
            with self.subTest(change):
                changed = report | change
                changed["self_intersections"] = changed
                self.assertTrue(damage.mistakes(changed, damaged, facts, 1.0, 1)[1])
