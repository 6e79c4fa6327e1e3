"""Volumes to and from dense arrays, files, and pyopenvdb's grids."""

import os
import tempfile
import unittest

import numpy as np
from shapes import cube, torus, volume_of

import hermesh


class Volumes(unittest.TestCase):

    def test_of_arrays_and_back(self):
        x, y, z = np.meshgrid(np.arange(3), np.arange(4), np.arange(5), indexing="ij")
        values = (100 * x + 10 * y + z).astype(np.float32)
        volume = hermesh.Volume.from_numpy(values, lower=(-1, 2, 10), voxel_size=0.5, origin=(1, 2, 3))
        self.assertEqual((volume.lower, volume.dims, volume.active_voxels), ((-1, 2, 10), (3, 4, 5), 60))
        self.assertFalse(volume.is_level_set)
        self.assertEqual(volume.value_range, (0, 234))
        np.testing.assert_array_equal(volume.to_numpy(), values)
        np.testing.assert_array_equal(volume.to_numpy((0, 3, 11), (2, 2, 2)), values[1:3, 1:3, 1:3])
        # Trilinear interpolation is exact for a linear function; index (0.5, 3.25, 11) lies there.
        np.testing.assert_allclose(volume.sample([[1.25, 3.625, 8.5]]), [150 + 12.5 + 1])
        np.testing.assert_array_equal(volume.placement,
                                      [[0.5, 0, 0, 1], [0, 0.5, 0, 2], [0, 0, 0.5, 3], [0, 0, 0, 1]])
        turned = hermesh.Volume.from_numpy(values, placement=[[0, -2, 0, 5], [3, 0, 0, 6], [0, 0, -1, 7]])
        np.testing.assert_allclose(turned.placement[:3], [[0, -2, 0, 5], [3, 0, 0, 6], [0, 0, -1, 7]],
                                   atol=1e-12)

    def test_of_any_array_of_numbers(self):
        values = np.arange(24).reshape(2, 3, 4)
        for array in (values, values.astype(np.int16), values.astype(float),
                      np.asfortranarray(values.astype(np.float32))):
            np.testing.assert_array_equal(hermesh.Volume.from_numpy(array).to_numpy(), values)

    def test_with_a_surface_have_the_same_one_through_an_array(self):
        level_set = hermesh.voxelize(torus(), resolution=40)
        self.assertTrue(level_set.is_level_set)
        again = hermesh.Volume.from_numpy(level_set.to_numpy(), lower=level_set.lower,
                                          placement=level_set.placement, level_set=True,
                                          background=level_set.background)
        a, b = hermesh.extract(level_set), hermesh.extract(again)
        self.assertGreater(len(a.quads), 1000)
        np.testing.assert_array_equal(a.points, b.points)
        np.testing.assert_array_equal(a.quads, b.quads)

    def test_of_a_field_have_a_surface(self):
        axis = np.linspace(-1, 1, 41)
        x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
        density = 1 - np.sqrt(x * x + y * y + z * z)  # greater inside, as in a scan
        ball = hermesh.extract(hermesh.Volume.from_numpy(density, voxel_size=0.05, origin=(-1, -1, -1)),
                               isovalue=0.4)
        self.assertAlmostEqual(volume_of(ball), 4 / 3 * np.pi * 0.6**3, delta=0.01)

    def test_share_a_lattice(self):
        first = hermesh.voxelize(cube(), voxel_size=0.11)
        second = hermesh.voxelize(cube(1.0, (0.3, 0.3, 0.3)), like=first)
        np.testing.assert_allclose(second.placement, first.placement, atol=1e-15)
        self.assertAlmostEqual(float(second.sample([[1.2, 1.2, 1.2]])[0]), -0.1, delta=0.02)

    def test_go_through_files(self):
        volumes = hermesh.voxelize_grids(torus(), "sdf,fog", resolution=20)
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "two.vdb")
            hermesh.write_vdb(path, volumes)
            self.assertEqual(sorted(hermesh.grid_names(path)), ["fog", "sdf"])
            fog = hermesh.read_vdb(path, grid="fog")
            np.testing.assert_array_equal(fog.to_numpy(),
                                          next(v for v in volumes if v.name == "fog").to_numpy())
            volumes[0].with_name("density").write(path)
            self.assertEqual(hermesh.grid_names(path), ["density"])

    def test_are_grids_of_pyopenvdb(self):
        try:
            import pyopenvdb
        except ImportError:
            self.skipTest("pyopenvdb is not installed")
        level_set = hermesh.voxelize(torus(), resolution=20)
        grid = hermesh.to_pyopenvdb(level_set)
        self.assertIsInstance(grid, pyopenvdb.FloatGrid)
        self.assertEqual(grid.activeVoxelCount(), level_set.active_voxels)
        back = hermesh.from_pyopenvdb(grid)
        np.testing.assert_array_equal(back.to_numpy(), level_set.to_numpy())
        self.assertTrue(back.is_level_set)

    def test_that_are_none_are_refused(self):
        for array, words in ((np.zeros((2, 2)), "three dimensions"),
                             (np.full((2, 2, 2), np.nan), "not a finite number"),
                             (np.zeros((0, 2, 2)), "empty")):
            with self.assertRaisesRegex(hermesh.Error, words):
                hermesh.Volume.from_numpy(array)
        flat = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 0]]
        with self.assertRaisesRegex(hermesh.Error, "cannot be inverted"):
            hermesh.Volume.from_numpy(np.zeros((2, 2, 2)), placement=flat)
        with self.assertRaisesRegex(hermesh.Error, "shape"):
            hermesh.voxelize(cube(), resolution=10).sample([1, 2, 3])


if __name__ == "__main__":
    unittest.main()
