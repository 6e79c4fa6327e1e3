"""Blender's modifier Remesh: blender -b --python blender_peer.py -- IN.obj OUT.obj VOXEL ADAPTIVITY|sharp

With voxels, or in mode Sharp with cells of that size. Its modifier Boolean with the exact solver:
blender -b --python blender_peer.py -- IN.obj OUT.obj union|intersection|difference SECOND.obj

Its Bisect with Fill, which writes each piece to a file:
blender -b --python blender_peer.py -- IN.obj DIRECTORY cut PLANES
with nx,ny,nz,d of the points x with n·x = d, separated by semicolons.
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
scale = 1.0 if is_boolean or voxel == "cut" else max(1.0, SMALLEST_VOXEL / float(voxel))


def add(points, triangles):
    mesh = bpy.data.meshes.new("peer")
    mesh.from_pydata((scale * points).tolist(), [], triangles.tolist())
    thing = bpy.data.objects.new("peer", mesh)
    bpy.context.collection.objects.link(thing)
    return thing


def triangulate(mesh):
    """Splits polygons as the modifier Triangulate: the display's triangles of large polygons intersect."""
    shape = bmesh.new()
    shape.from_mesh(mesh)
    bmesh.ops.triangulate(shape, faces=shape.faces[:], quad_method="BEAUTY", ngon_method="BEAUTY")
    shape.to_mesh(mesh)
    mesh.calc_loop_triangles()


def write(path, mesh):
    peer.write_obj(path, [v.co / scale for v in mesh.vertices],
                   [tuple(t.vertices) for t in mesh.loop_triangles])


def half_of(piece, plane, cleared):
    half = piece.copy()
    half.data = piece.data.copy()
    bpy.context.collection.objects.link(half)
    bpy.context.view_layer.objects.active = half
    half.select_set(True)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    *normal, offset = plane
    bpy.ops.mesh.bisect(plane_co=[offset * x for x in normal], plane_no=normal, use_fill=True,
                        **{cleared: True})
    bpy.ops.object.mode_set(mode="OBJECT")
    half.select_set(False)
    return half


def cut(whole, planes):
    pieces = [whole]
    for plane in planes:
        halves = [half_of(piece, plane, side) for piece in pieces for side in ("clear_inner", "clear_outer")]
        pieces = [half for half in halves if half.data.polygons]
    return [piece.data for piece in pieces]


points, triangles = peer.read_obj(source)
thing = add(points, triangles)
if voxel == "cut":
    planes = [list(map(float, plane.split(","))) for plane in adaptivity.split(";")]
    for number, mesh in enumerate(peer.measured(lambda: cut(thing, planes)), 1):
        triangulate(mesh)
        write(f"{target}/{number}.obj", mesh)
    sys.exit()
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
    triangulate(made)
write(target, made)
