"""Blender's modifier Remesh: blender -b --python blender_peer.py -- IN.obj OUT.obj VOXEL ADAPTIVITY|sharp

With voxels, or in mode Sharp with cells of that size. Its modifier Boolean with the exact solver:
blender -b --python blender_peer.py -- IN.obj OUT.obj union|intersection|difference SECOND.obj
"""
import math
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import bmesh
import bpy
import peer

SMALLEST_VOXEL = 0.001
OPERATIONS = {"union": "UNION", "intersection": "INTERSECT", "difference": "DIFFERENCE"}
source, target, voxel, adaptivity = sys.argv[sys.argv.index("--") + 1:]
is_boolean = voxel in OPERATIONS
# Small models are enlarged, because Blender has no voxels below 0.0001.
scale = 1.0 if is_boolean else max(1.0, SMALLEST_VOXEL / float(voxel))


def add(points, triangles):
    mesh = bpy.data.meshes.new("peer")
    mesh.from_pydata((scale * points).tolist(), [], triangles.tolist())
    thing = bpy.data.objects.new("peer", mesh)
    bpy.context.collection.objects.link(thing)
    return thing


points, triangles = peer.read_obj(source)
thing = add(points, triangles)
modifier = thing.modifiers.new("peer", "BOOLEAN" if is_boolean else "REMESH")
if is_boolean:
    modifier.operation, modifier.solver = OPERATIONS[voxel], "EXACT"
    modifier.object = add(*peer.read_obj(adaptivity))
elif adaptivity == "sharp":
    modifier.mode = "SHARP"
    # The grid has 2^depth cells, and the longest side of the model is its size times the scale, at most 0.99.
    cells = max(points.max(axis=0) - points.min(axis=0)) / float(voxel)
    modifier.octree_depth = min(12, max(1, math.ceil(math.log2(cells / 0.99))))
    modifier.scale = min(0.99, cells / 2**modifier.octree_depth)
    modifier.use_remove_disconnected = False
else:
    modifier.mode = "VOXEL"
    modifier.voxel_size = scale * float(voxel)
    modifier.adaptivity = float(adaptivity)


def work():
    graph = bpy.context.evaluated_depsgraph_get()
    made = thing.evaluated_get(graph).to_mesh()
    made.calc_loop_triangles()
    return made


made = peer.measured(work)
if is_boolean:
    # The display's triangles of polygons with many corners intersect; this is the default of Triangulate.
    shape = bmesh.new()
    shape.from_mesh(made)
    bmesh.ops.triangulate(shape, faces=shape.faces[:], quad_method="BEAUTY", ngon_method="BEAUTY")
    shape.to_mesh(made)
    made.calc_loop_triangles()
peer.write_obj(target, [v.co / scale for v in made.vertices], [tuple(t.vertices) for t in made.loop_triangles])
