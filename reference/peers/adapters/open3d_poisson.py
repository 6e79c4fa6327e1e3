"""Open3D, samples with normals and Poisson reconstruction: open3d_poisson.py REQUEST

Four samples per square of a voxel, and the octree depth whose cells are at most a voxel wide in the
reconstructed box, which is 1.1 times the model by default; the other options are the defaults (tutorial,
Surface reconstruction). One thread, because waiting threads are busy. The mesh is open where it reaches that
box. The documentation promises no topology and no distance.
"""
import math

import adapter

SAMPLES = 4


def remesh(request, points, triangles):
    voxel = adapter.length(request)
    open3d.utility.random.seed(request.get("seed") or 0)
    mesh = open3d.geometry.TriangleMesh(open3d.utility.Vector3dVector(points),
                                        open3d.utility.Vector3iVector(triangles))
    count = max(1000, int(SAMPLES * mesh.get_surface_area() / voxel**2))
    cloud = mesh.sample_points_uniformly(count, use_triangle_normal=True)
    depth = math.ceil(math.log2(1.1 * numpy.ptp(points, axis=0).max() / voxel))
    reconstruct = open3d.geometry.TriangleMesh.create_from_point_cloud_poisson
    made, _ = reconstruct(cloud, depth=depth, n_threads=1)
    return numpy.asarray(made.vertices), [numpy.asarray(made.triangles)]


open3d = adapter.require("open3d", "python3-open3d")
numpy = adapter.require("numpy", "python3-numpy")
adapter.run(adapter.with_arrays(remesh))
