"""Arrays in, arrays out: what is copied, which types are taken, what is refused."""

import time
import tracemalloc
import types
import unittest

import numpy as np
from shapes import cube, torus, volume_of

import hermesh


def most_memory():
    """Bytes that this process has had resident at most."""
    with open("/proc/self/status", encoding="ascii") as status:
        return next(1024 * int(line.split()[1]) for line in status if line.startswith("VmHWM"))


class Arrays(unittest.TestCase):

    def test_come_back_as_they_were_given(self):
        points, triangles = torus()
        quads = np.array([[0, 1, 2, 3]], np.int32)
        mesh = hermesh.Mesh(points, triangles, quads)
        np.testing.assert_array_equal(mesh.points, points)
        np.testing.assert_array_equal(mesh.triangles, triangles)
        np.testing.assert_array_equal(mesh.quads, quads)
        self.assertEqual((mesh.points.dtype, mesh.triangles.dtype, mesh.quads.dtype),
                         (np.float32, np.uint32, np.uint32))
        self.assertEqual(mesh.origin, (0, 0, 0))

    def test_are_views_that_outlive_the_mesh(self):
        mesh = hermesh.Mesh(*torus())
        points, again = mesh.points, mesh.points
        self.assertTrue(np.shares_memory(points, again))
        self.assertEqual(points.ctypes.data, again.ctypes.data)
        self.assertFalse(points.flags.writeable)
        self.assertFalse(points.flags.owndata)
        expected = points.copy()
        del mesh, again
        [hermesh.Mesh(*torus()) for _ in range(20)]
        np.testing.assert_array_equal(points, expected)

    def test_of_fitting_types_are_not_converted(self):
        points, triangles = torus(around=400, across=200)
        for kind in (np.uint32, np.int32):
            given = triangles.astype(kind)
            tracemalloc.start()
            mesh = hermesh.Mesh(points, given)
            views = mesh.points, mesh.triangles
            peak = tracemalloc.get_traced_memory()[1]
            tracemalloc.stop()
            self.assertEqual(len(views[1]), 160_000)
            # numpy reports every allocated array to tracemalloc; one of the triangles alone has 1.9 MB.
            self.assertLess(peak, 100_000)

    def test_of_a_million_triangles_are_copied_once(self):
        points, triangles = torus(around=1000, across=500)
        size = points.nbytes + triangles.nbytes
        before, begun = most_memory(), time.process_time()
        mesh = hermesh.Mesh(points, triangles)
        views = [(mesh.points, mesh.triangles) for _ in range(100)]
        self.assertLess(time.process_time() - begun, 2.0)
        self.assertEqual(views[99][1].shape, (1_000_000, 3))
        # 17 MiB a copy; the overhead of the allocator is small compared with that.
        self.assertLess(most_memory() - before, 1.3 * size)

    def test_of_every_type_of_number_make_the_same_mesh(self):
        points, triangles = torus()
        points = np.round(points * 64) / 64  # which half precision holds, too
        expected = hermesh.Mesh(points, triangles)
        for kind in (np.float16, np.float32, np.float64, np.dtype(">f4"), np.dtype(">f8"), np.longdouble):
            np.testing.assert_array_equal(hermesh.Mesh(points.astype(kind), triangles).points,
                                          expected.points)
        for kind in (np.int16, np.uint16, np.int32, np.uint32, np.int64, np.uint64, np.dtype(">i4")):
            np.testing.assert_array_equal(hermesh.Mesh(points, triangles.astype(kind)).triangles,
                                          expected.triangles)
        by_columns = hermesh.Mesh(np.asfortranarray(points), np.asfortranarray(triangles))
        np.testing.assert_array_equal(by_columns.points, expected.points)
        np.testing.assert_array_equal(by_columns.triangles, expected.triangles)
        lists = hermesh.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        np.testing.assert_array_equal(lists.points, [[0, 0, 0], [1, 0, 0], [0, 1, 0]])

    def test_keep_precision_far_from_zero(self):
        points, quads = cube(1.0, (1e7, 0, -1e7))
        mesh = hermesh.Mesh(points, None, quads)
        # single precision about 0 would have steps of 1
        np.testing.assert_array_equal(mesh.world_points(), points)
        self.assertNotEqual(mesh.origin[0], 0)

    def test_of_attributes(self):
        points, quads = cube()
        normals = np.arange(24, dtype=np.float32).reshape(8, 3)
        parts = np.array([7, 8, -1, 0, 0, 0], np.int32)
        uv = np.linspace(0, 1, 48).reshape(24, 2)
        mesh = hermesh.Mesh(points, None, quads, point_attributes={"normal": normals},
                            polygon_attributes={"part": parts}, corner_attributes={"uv": uv},
                            labels={"part": ["a", "b"]})
        np.testing.assert_array_equal(mesh.point_attributes["normal"], normals)
        np.testing.assert_array_equal(mesh.polygon_attributes["part"], parts)
        self.assertEqual(mesh.polygon_attributes["part"].dtype, np.int32)
        np.testing.assert_allclose(mesh.corner_attributes["uv"], uv, atol=1e-7)
        self.assertEqual(mesh.labels, {"part": ["a", "b"]})
        self.assertTrue(np.shares_memory(mesh.point_attributes["normal"], mesh.point_attributes["normal"]))
        height = hermesh.Mesh(points, None, quads).with_attributes(point_attributes={"height": points[:, 2]})
        np.testing.assert_array_equal(height.point_attributes["height"], points[:, 2])
        self.assertEqual(list(mesh.with_attributes().point_attributes), [])

    def test_that_are_no_mesh_are_refused(self):
        points, triangles = [[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]

        def complaint(*arrays, **attributes):
            with self.assertRaises(hermesh.Error) as caught:
                hermesh.Mesh(*arrays, **attributes)
            return str(caught.exception)

        self.assertEqual(complaint(points, [[0, 1, 3]]),
                         "triangle number 0 refers to point 3, but there are 3 points (both count from 0)")
        self.assertIn("triangle number 1 refers to point -1", complaint(points, [[0, 1, 2], [0, -1, 2]]))
        self.assertIn("refers to point 4294967296", complaint(points, [[0, 1, 2**32]]))
        self.assertIn("whole numbers", complaint(points, [[0.0, 1.0, 2.0]]))
        self.assertEqual(complaint([[0, 0, 0], [1, np.nan, 0], [0, 1, 0]], triangles),
                         "point 1 (counting from 0) has a coordinate that is not a finite number")
        self.assertIn("shape (n, 3), not (3, 2)", complaint([[0, 0], [1, 0], [0, 1]], triangles))
        self.assertIn("shape (n, 3), not (9,)", complaint(np.zeros(9), triangles))
        self.assertIn("no numbers", complaint([["a", "b", "c"]], triangles))
        self.assertEqual(complaint(points, triangles, point_attributes={"a": [1.5, 2.5]}),
                         "the attribute 'a' has 2 values, but the mesh needs 3")

    def test_that_functions_take(self):
        points, quads = cube(2.0, (-1, -1, -1))
        triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
        trimesh_like = types.SimpleNamespace(vertices=points, faces=triangles)
        meshio_like = types.SimpleNamespace(points=points, cells_dict={"quad": quads}, point_data={})
        for mesh in (hermesh.Mesh(points, None, quads), (points, quads), (points, triangles),
                     (points, None, quads), trimesh_like, meshio_like):
            self.assertAlmostEqual(volume_of(hermesh.remesh(mesh, resolution=20)), 8.0, places=4)
        with self.assertRaises(TypeError):
            hermesh.remesh(7, resolution=20)
        with self.assertRaisesRegex(hermesh.Error, "cells of the kind tetra"):
            hermesh.as_mesh(types.SimpleNamespace(points=points, cells_dict={"tetra": quads}))

    def test_go_to_trimesh_and_meshio_where_they_are(self):
        points, quads = cube()
        mesh = hermesh.Mesh(points, None, quads)
        for name, convert in (("trimesh", hermesh.to_trimesh), ("meshio", hermesh.to_meshio)):
            with self.subTest(name):
                try:
                    __import__(name)
                except ImportError:
                    self.skipTest(f"{name} is not installed")
                self.assertAlmostEqual(volume_of(hermesh.as_mesh(convert(mesh))), 1.0)


if __name__ == "__main__":
    unittest.main()
