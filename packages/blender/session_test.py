"""A session in a real Blender without a display: blender -b --factory-startup --python-exit-code 1 --python
session_test.py [-- dragon]

A mesh is imported, converted to a volume and back, remeshed, combined, broken and validated, and everything
is undone: a ball that the script makes, or the Dragon of $HERMESH_DATA. A failed assertion ends Blender with
    1.
"""

import gzip
import os
import pathlib
import sys
import tempfile
import time

import bpy
import numpy as np
from mathutils import Matrix

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import hermesh_blender  # noqa: E402
import in_window  # noqa: E402

import hermesh  # noqa: E402

hermesh_blender.register()
with_dragon = "dragon" in sys.argv[sys.argv.index("--"):] if "--" in sys.argv else False
scratch = tempfile.TemporaryDirectory()


def path_in_scratch(name):
    return os.path.join(scratch.name, name)


def meshes():
    return [item for item in bpy.data.objects if item.type == "MESH"]


def is_done(result):
    assert result == {"FINISHED"}, result


def is_refused(operator, words):
    """The operator fails with these words, in its report and in the panel."""
    try:
        operator()
    except RuntimeError as error:
        assert words in str(error), error
    else:
        raise AssertionError(f"it did not fail: {words}")
    assert any(words in text for text in hermesh_blender.said.errors), hermesh_blender.said.errors
    assert hermesh_blender.said.work is None


def activate(item):
    for other in bpy.context.selected_objects:
        other.select_set(False)
    item.hide_set(False)
    item.select_set(True)
    bpy.context.view_layer.objects.active = item


def mesh_of(item):
    bpy.context.view_layer.update()
    return hermesh_blender.mesh_of(bpy.context, item)[0]


def made_ball():
    bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24, radius=1.0)
    bpy.ops.export_mesh.ply(filepath=path_in_scratch("model.ply"))
    bpy.ops.object.delete()
    return 2.0, 60


def unpacked_dragon():
    packed = pathlib.Path(os.environ.get("HERMESH_DATA", "/nowhere"), "dragon_vrip.ply.gz")
    if not packed.exists():
        print("there is no Dragon")
        sys.exit(0)
    pathlib.Path(path_in_scratch("model.ply")).write_bytes(gzip.decompress(packed.read_bytes()))
    return 20.0, 200


def volume_of(mesh):
    return hermesh.validate(mesh, self_intersections=False, libraries=False).volume


in_window.clear()

# Import: a mesh that a file brings, moved and scaled.
scale, resolution = unpacked_dragon() if with_dragon else made_ball()
bpy.ops.import_mesh.ply(filepath=path_in_scratch("model.ply"))
model = bpy.context.active_object
model.location, model.scale = (5.0, 0.0, 0.0), (scale, scale, scale)
model.data.materials.append(bpy.data.materials.new("stone"))
settings = bpy.context.scene.hermesh
settings.resolution, settings.tolerance = resolution, 0.1
imported = mesh_of(model)
points = imported.world_points()
lower, upper = points.min(0), points.max(0)
centre, voxel = (lower + upper) / 2, (upper - lower).max() / resolution
whole = volume_of(imported)
assert with_dragon or abs(whole / (4 / 3 * np.pi * 8) - 1) < 0.02, whole

# A volume: the model's points lie on its surface, in the world.
is_refused(bpy.ops.hermesh.volume, "which .vdb file")
is_refused(lambda: bpy.ops.hermesh.volume(filepath="//model.vdb"), "has not been saved yet")
settings.file = path_in_scratch("model.vdb")
settings.resolution = resolution // 2
is_done(bpy.ops.hermesh.volume())
assert not hermesh_blender.said.errors
volumes = [item for item in bpy.data.objects if item.type == "VOLUME"]
assert len(volumes) == 1 and volumes[0].name == "model volume"
assert (volumes[0].data.grids.load()
        and abs(volumes[0].data.grids[0].matrix_object[0][0] / (2 * voxel) - 1) < 1e-4)
# Written again, it is the same object, and Blender reads the new file.
settings.resolution = resolution
is_done(bpy.ops.hermesh.volume())
volumes = [item for item in bpy.data.objects if item.type == "VOLUME"]
assert len(volumes) == 1
assert volumes[0].data.grids.load() and abs(volumes[0].data.grids[0].matrix_object[0][0] / voxel - 1) < 1e-4
distances = hermesh.read_vdb(settings.file).sample(points[::97])
assert np.abs(distances).mean() < 0.2 * voxel, np.abs(distances).mean() / voxel

# A mesh of a volume object that was moved; a mesh object is refused.
assert not bpy.ops.hermesh.extract.poll()
volumes[0].location = (0.0, 0.0, 30.0)
volumes[0].rotation_euler = (0.0, 0.0, np.pi / 2)


def extracted(**changes):
    """The mesh that is made of the volume with these settings, in its own space: that of the model."""
    for name, value in changes.items():
        setattr(settings, name, value)
    activate(volumes[0])
    is_done(bpy.ops.hermesh.extract())
    assert volumes[0].hide_get()
    made = bpy.context.active_object
    mesh = mesh_of(made)
    assert made.matrix_world == volumes[0].matrix_world
    local = np.linalg.inv(np.array(made.matrix_world))
    bpy.data.objects.remove(made)
    return mesh, mesh.world_points() @ local[:3, :3].T + local[:3, 3]


everywhere, its_points = extracted()
assert hermesh.validate(everywhere).watertight
assert abs(volume_of(everywhere) / whole - 1) < 0.02, volume_of(everywhere) / whole
assert np.abs(its_points.min(0) - lower).max() < voxel and np.abs(its_points.max(0) - upper).max() < voxel
settings.isovalue = -5 * voxel
activate(volumes[0])
is_refused(bpy.ops.hermesh.extract, "")
settings.isovalue = 0.0

# The mask by an object: a box about the half that has greater x, which goes where the volume goes.
is_refused(lambda: extracted(mask="object"), "choose the object")
bpy.ops.mesh.primitive_cube_add(size=1.0)
box = bpy.context.active_object
extent = 2 * (upper - lower).max()
box.matrix_world = volumes[0].matrix_world
box.data.transform(Matrix.Translation(centre + [extent / 2, 0.0, 0.0]) @ Matrix.Scale(extent, 4))
half, its_points = extracted(mask="object", mask_object=box, outside="nothing")
assert its_points[:, 0].min() > centre[0] - 2 * voxel and abs(its_points[:, 0].max() - upper[0]) < voxel
coarse, its_points = extracted(outside="simplify")
assert hermesh.validate(coarse).watertight
seen = np.count_nonzero(its_points[:, 0] > centre[0] + 16 * voxel)
expected = np.count_nonzero(extracted(mask="none")[1][:, 0] > centre[0] + 16 * voxel)
assert abs(seen / expected - 1) < 0.02, (seen, expected)
assert len(coarse.points) < 0.8 * len(everywhere.points), (len(coarse.points), len(everywhere.points))
bpy.data.objects.remove(box)

# The mask by the view of a camera; a picture shifted by half its width includes that half, too.
is_refused(lambda: extracted(mask="camera"), "no camera")
camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
bpy.context.collection.objects.link(camera)
bpy.context.scene.camera = camera
stand = Matrix.Translation(centre - [0.0, 2 * extent, 0.0]) @ Matrix.Rotation(np.pi / 2, 4, "X")
camera.matrix_world = volumes[0].matrix_world @ stand
for kind in ("PERSP", "ORTHO"):
    camera.data.type, camera.data.shift_x, camera.data.ortho_scale = kind, 0.5, 2 * extent
    bpy.context.view_layer.update()
    half, its_points = extracted(mask="camera", outside="nothing")
    assert its_points[:, 0].min() > centre[0] - 2 * voxel and abs(its_points[:, 0].max() - upper[0]) < voxel
    coarse, its_points = extracted(outside="simplify")
    seen = np.count_nonzero(its_points[:, 0] > centre[0] + 16 * voxel)
    assert abs(seen / expected - 1) < 0.02, (seen, expected)
    assert len(coarse.points) < 0.8 * len(everywhere.points)
camera.data.clip_end = 0.5 * extent
is_refused(extracted, "the camera sees nothing")
camera.data.type = "PANO"
is_refused(extracted, "panoramic")
# The mask equals the frustum of the module.
camera.data.type, camera.data.shift_x, camera.data.clip_end, camera.data.lens = "PERSP", 0.0, 1000.0, 200.0
bpy.context.view_layer.update()
ours = extracted(outside="nothing")[0]
eye = centre - [0.0, 2 * extent, 0.0]
# the aspect ratio of the scene's pictures is 16:9
angle = np.degrees(2 * np.arctan(np.tan(camera.data.angle_x / 2) * 9 / 16))
frustum = hermesh.Frustum(position=eye, look_at=centre, up=(0.0, 0.0, 1.0), angle=angle, aspect=16 / 9,
                          near=extent, far=3 * extent)
theirs = hermesh.extract(hermesh.read_vdb(settings.file), extractor="manifold-dual-contouring", tolerance=0.1,
                         frustum=frustum, outside="nothing")
assert abs(len(ours.points) / len(theirs.points) - 1) < 0.02, (len(ours.points), len(theirs.points))
settings.mask = "none"
bpy.data.objects.remove(camera)
bpy.data.objects.remove(volumes[0])

# Remesh.
activate(model)
bpy.ops.ed.undo_push(message="imported")
polygons_before = len(model.data.polygons)
is_done(bpy.ops.hermesh.remesh())
model = bpy.context.active_object
assert len(model.data.polygons) != polygons_before
assert model.data.materials[0].name == "stone"
report = hermesh.validate(mesh_of(model))
assert report.watertight, report.sentences
assert abs(report.volume / whole - 1) < 0.02, report.volume
bpy.ops.ed.undo_push(message="remeshed")
polygons_after = len(model.data.polygons)

# Judge: all is well.
is_done(bpy.ops.hermesh.judge())
settings = bpy.context.scene.hermesh
assert ("watertight" in settings.verdict and settings.is_well and not settings.defects
        and settings.judged == model)
assert not any(polygon.select for polygon in bpy.context.active_object.data.polygons)

# Boolean: one half is cut off; without another object there is an error.
is_refused(bpy.ops.hermesh.combine, "choose another object")
bpy.ops.mesh.primitive_cube_add(size=extent, location=centre + [extent / 2, 0.0, 0.0])
cube = bpy.context.active_object
activate(bpy.data.objects["model"])
settings = bpy.context.scene.hermesh
settings.other, settings.operation = cube, "difference"
is_done(bpy.ops.hermesh.combine())
left = hermesh.validate(mesh_of(bpy.context.active_object))
assert left.watertight and left.volume < 0.9 * report.volume, left.volume
assert with_dragon or abs(left.volume / report.volume - 0.5) < 0.02, left.volume
bpy.ops.ed.undo_push(message="combined")

# Fracture: the pieces fit.
settings.pieces, settings.cutters, settings.seed = 5, "voronoi", 1
before = len(meshes())
is_done(bpy.ops.hermesh.fracture())
pieces = [item for item in meshes() if " piece " in item.name]
assert len(pieces) >= 5 and len(meshes()) == before + len(pieces)
assert with_dragon or len(pieces) == 5
fits = hermesh.validate_fracture([mesh_of(piece) for piece in pieces])
assert fits.consistent, fits.sentences
assert "surface" in pieces[0].data.attributes
bpy.ops.ed.undo_push(message="broken")

# An object cuts another into the parts inside and outside of it; it does not cut itself.
bpy.ops.mesh.primitive_cube_add(size=extent,
                                location=centre - [extent / 2, 0.0, 0.0] + [0.1 * extent, 0.0, extent / 2])
cutter = bpy.context.active_object
activate(pieces[0])
settings = bpy.context.scene.hermesh
settings.cutters, settings.cutter = "object", pieces[0]
is_refused(bpy.ops.hermesh.fracture, "choose another object")

# An open mesh has its defects listed and selected.
activate(pieces[0])
bpy.ops.object.mode_set(mode="EDIT")
bpy.ops.mesh.select_all(action="DESELECT")
bpy.ops.object.mode_set(mode="OBJECT")
pieces[0].data.polygons[0].select = True
bpy.ops.object.mode_set(mode="EDIT")
bpy.ops.mesh.delete(type="FACE")
bpy.ops.object.mode_set(mode="OBJECT")
is_done(bpy.ops.hermesh.judge())
settings = bpy.context.scene.hermesh
assert any(polygon.select for polygon in bpy.context.active_object.data.polygons)
assert "open" in settings.verdict or "boundary" in settings.verdict
assert (not settings.is_well
        and [(defect.name, defect.count) for defect in settings.defects] == [("boundary edges", 3)])
is_done(bpy.ops.hermesh.show_defect(index=0))
assert bpy.context.mode == "EDIT_MESH" and bpy.context.active_object.name == settings.judged.name
bpy.ops.object.mode_set(mode="OBJECT")
chosen = {i for i, polygon in enumerate(bpy.context.active_object.data.polygons) if polygon.select}
assert chosen == settings.defects[0].numbers() and 1 <= len(chosen) <= 3, chosen

# Undo: back to the combined object, then to the remeshed and the imported one.
bpy.ops.ed.undo()
assert not [item for item in meshes() if " piece " in item.name]
bpy.ops.ed.undo()
assert len(bpy.data.objects["model"].data.polygons) == polygons_after
bpy.ops.ed.undo()
assert len(bpy.data.objects["model"].data.polygons) == polygons_before

# Escape ends the work soon.
mesh = mesh_of(bpy.data.objects["model"])
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
