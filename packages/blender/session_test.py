"""A session in a real Blender without a display: blender -b --factory-startup --python-exit-code 1 --python session_test.py

A mesh is imported, remeshed, combined, broken and judged, and undone. Any assertion that fails ends Blender with 1.
"""

import os
import pathlib
import sys
import tempfile
import time

import bpy

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import hermesh_blender  # noqa: E402

import hermesh  # noqa: E402

hermesh_blender.register()


def meshes():
    return [item for item in bpy.data.objects if item.type == "MESH"]


def is_done(result):
    assert result == {"FINISHED"}, result


def activate(item):
    for other in bpy.context.selected_objects:
        other.select_set(False)
    item.select_set(True)
    bpy.context.view_layer.objects.active = item


for item in list(bpy.data.objects):
    bpy.data.objects.remove(item)

# Import: a ball that a file brings, moved and scaled, with one polygon missing.
with tempfile.TemporaryDirectory() as folder:
    bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24, radius=1.0)
    bpy.ops.export_mesh.ply(filepath=os.path.join(folder, "ball.ply"))
    bpy.ops.object.delete()
    bpy.ops.import_mesh.ply(filepath=os.path.join(folder, "ball.ply"))
    ball = bpy.context.active_object
    ball.location, ball.scale = (5.0, 0.0, 0.0), (2.0, 2.0, 2.0)
    bpy.context.view_layer.update()
    ball.data.materials.append(bpy.data.materials.new("stone"))
    settings = bpy.context.scene.hermesh
    settings.resolution, settings.tolerance = 60, 0.1

    is_done(bpy.ops.hermesh.volume(filepath=os.path.join(folder, "ball.vdb")))
    level_set = hermesh.read_vdb(os.path.join(folder, "ball.vdb"))
    assert abs(float(level_set.sample([[7.0, 0.0, 0.0]])[0])) < 0.02  # the ball's surface in the world
    assert [item for item in bpy.data.objects if item.type == "VOLUME"]

activate(ball)
bpy.ops.ed.undo_push(message="imported")
polygons_before = len(ball.data.polygons)
is_done(bpy.ops.hermesh.remesh())
ball = bpy.context.active_object
assert len(ball.data.polygons) != polygons_before
assert ball.data.materials[0].name == "stone"
report = hermesh.validate(hermesh_blender.mesh_of(bpy.context, ball)[0])
assert report.watertight, report.sentences
assert abs(report.volume / (4 / 3 * 3.14159265 * 8) - 1) < 0.02, report.volume
bpy.ops.ed.undo_push(message="remeshed")
polygons_after = len(ball.data.polygons)

# Judge: all is well; without a polygon it is open, and its neighbours are selected.
is_done(bpy.ops.hermesh.judge())
assert "watertight" in bpy.context.scene.hermesh.verdict
assert not any(polygon.select for polygon in bpy.context.active_object.data.polygons)

# Boolean: a corner is cut off.
bpy.ops.mesh.primitive_cube_add(size=4.0, location=(7.0, 0.0, 0.0))
cube = bpy.context.active_object
activate(bpy.data.objects[ball.name])
settings = bpy.context.scene.hermesh
settings.other, settings.operation = cube, "difference"
is_done(bpy.ops.hermesh.combine())
half = hermesh.validate(hermesh_blender.mesh_of(bpy.context, bpy.context.active_object)[0])
assert half.watertight and abs(half.volume / report.volume - 0.5) < 0.02, half.volume
bpy.ops.ed.undo_push(message="combined")

# Fracture: the pieces fit.
settings.pieces, settings.cutters, settings.seed = 5, "voronoi", 1
before = len(meshes())
is_done(bpy.ops.hermesh.fracture())
pieces = [item for item in meshes() if " piece " in item.name]
assert len(pieces) == 5 and len(meshes()) == before + 5
fits = hermesh.validate_fracture([hermesh_blender.mesh_of(bpy.context, piece)[0] for piece in pieces])
assert fits.consistent, fits.sentences
assert "surface" in pieces[0].data.attributes
bpy.ops.ed.undo_push(message="broken")

# An open mesh has its defects selected.
activate(pieces[0])
bpy.ops.object.mode_set(mode="EDIT")
bpy.ops.mesh.select_all(action="DESELECT")
bpy.ops.object.mode_set(mode="OBJECT")
pieces[0].data.polygons[0].select = True
bpy.ops.object.mode_set(mode="EDIT")
bpy.ops.mesh.delete(type="FACE")
bpy.ops.object.mode_set(mode="OBJECT")
is_done(bpy.ops.hermesh.judge())
assert any(polygon.select for polygon in bpy.context.active_object.data.polygons)
assert "open" in bpy.context.scene.hermesh.verdict or "boundary" in bpy.context.scene.hermesh.verdict

# Undo: back to the combined object, then to the remeshed and the imported one.
bpy.ops.ed.undo()
assert not [item for item in meshes() if " piece " in item.name]
bpy.ops.ed.undo()
assert len(bpy.data.objects["ball"].data.polygons) == polygons_after
bpy.ops.ed.undo()
assert len(bpy.data.objects["ball"].data.polygons) == polygons_before

# What Escape does: the work ends soon.
mesh = hermesh_blender.mesh_of(bpy.context, bpy.data.objects["ball"])[0]
work = hermesh_blender.Work(lambda **watching: hermesh.remesh(mesh, resolution=700, **watching))
time.sleep(0.5)
assert work.thread.is_alive()
begun = time.monotonic()
work.cancel.set()
work.thread.join()
seconds = time.monotonic() - begun
assert isinstance(work.error, hermesh.Cancelled), work.error
print(f"cancelled within {1000 * seconds:.0f} ms")
assert seconds < 1.0, seconds
print("the session went as it should")
