"""Draws the panels: xvfb-run -a -s "-screen 0 1280x1300x24" blender --factory-startup -p 0 0 1280 1300
--python draw_panels.py -- FOLDER

Writes FOLDER/panels.png, the sidebar as it is at first, with options chosen, at work, judged and with an
error, and FOLDER/window.png, with the pieces of what was worked on: the Dragon of $HERMESH_DATA, or without
it a ball with holes.
"""

import gzip
import os
import pathlib
import sys
import tempfile

import bmesh
import bpy
import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import hermesh_blender  # noqa: E402
import in_window  # noqa: E402

folder = pathlib.Path(sys.argv[sys.argv.index("--") + 1])
folder.mkdir(parents=True, exist_ok=True)


def alone():
    """Leaves Blender's own panel of an object's placement and ours in the sidebar."""
    for panel in bpy.types.Panel.__subclasses__():
        if panel.__module__ != hermesh_blender.__name__ and getattr(panel, "bl_region_type", "") == "UI" \
                and getattr(panel, "bl_space_type", "") == "VIEW_3D" and hasattr(panel, "bl_rna"):
            try:
                bpy.utils.unregister_class(panel)
            except RuntimeError:
                pass  # a class that others derive from is not registered itself


def choose_tab():
    """Clicks on the second tab, since scripts cannot choose one."""
    sidebar = in_window.view()[1]
    x, y = sidebar.x + sidebar.width - 14, sidebar.y + sidebar.height - 84
    for step in (lambda: in_window.move_mouse(x, y), lambda: in_window.xdotool("click", "1"),
                 lambda: in_window.move_mouse(400, y)):
        step()
        yield 0.5


def pixels(of_sidebar):
    """What the 3D view shows, or its sidebar alone, as rows from below of red, green and blue."""
    area, sidebar = in_window.view()
    with tempfile.TemporaryDirectory() as scratch:
        path = os.path.join(scratch, "shot.png")
        with in_window.in_view():
            bpy.ops.screen.screenshot_area(filepath=path)
        image = bpy.data.images.load(path)
        width, height = image.size
        shot = np.empty(4 * width * height, np.float32)
        image.pixels.foreach_get(shot)
        bpy.data.images.remove(image)
    shot = shot.reshape(height, width, 4)[..., :3]
    if not of_sidebar:
        return shot
    left, below = sidebar.x - area.x, sidebar.y - area.y
    shot = shot[below:below + sidebar.height, left:left + sidebar.width]
    # Below the last panel there is only the background, nearly uniform along rows; the tab at the right edge
    # does not count.
    used = np.flatnonzero(np.ptp(shot[:, :-30, 0], axis=1) > 0.1)
    return shot[max(0, used[0] - 6):]


def write(shot, name, levels):
    height, width = shot.shape[:2]
    image = bpy.data.images.new(name, width, height)
    shot = np.round(shot * levels) / levels  # so few colours make a small file
    image.pixels.foreach_set(np.concatenate([shot, np.ones((height, width, 1), np.float32)], 2).ravel())
    image.filepath_raw, image.file_format = str(folder / name), "PNG"
    bpy.context.scene.render.image_settings.compression = 100
    image.save()
    print(f"{folder / name}: {width} x {height}, {os.path.getsize(folder / name)} bytes")


def beside(shots):
    height, gap = max(len(shot) for shot in shots), 8
    columns = []
    for shot in shots:
        column = np.ones((height, shot.shape[1] + gap, 3), np.float32)
        column[height - len(shot):, :shot.shape[1]] = shot
        columns.append(column)
    return np.concatenate(columns, 1)[:, :-gap]


def model():
    """The active object: the Dragon of the coarser scan, upright, or a ball."""
    dragon = pathlib.Path(os.environ.get("HERMESH_DATA", "/nowhere"), "dragon_vrip_res2.ply.gz")
    if dragon.exists():
        with tempfile.TemporaryDirectory() as scratch:
            path = os.path.join(scratch, "Dragon.ply")
            pathlib.Path(path).write_bytes(gzip.decompress(dragon.read_bytes()))
            bpy.ops.import_mesh.ply(filepath=path)
        item = bpy.context.active_object
        item.scale, item.rotation_euler, item.location = (
            (20.0, 20.0, 20.0), (np.pi / 2, 0.0, 0.3), (0.0, 0.0, -2.5))
    else:
        bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24, radius=1.5)
        item = bpy.context.active_object
        item.name = "Ball"
        ball = bmesh.new()
        ball.from_mesh(item.data)
        ball.faces.ensure_lookup_table()
        bmesh.ops.delete(ball, geom=[ball.faces[i] for i in (700, 701, 900)], context="FACES_ONLY")
        ball.to_mesh(item.data)
        ball.free()
    return item


def steps():
    hermesh_blender.register()
    in_window.view()[0].spaces.active.show_region_ui = True
    bpy.context.preferences.system.viewport_aa = "OFF"  # until the last picture, for a processor draws
    alone()
    camera = bpy.context.scene.camera
    for item in list(bpy.data.objects):
        if item != camera:
            bpy.data.objects.remove(item)
    item, settings = model(), bpy.context.scene.hermesh
    bpy.ops.mesh.primitive_cube_add(size=1.0, location=(1.5, 0.0, 0.0))
    hammer = bpy.context.active_object
    hammer.name, hammer.display_type = "Hammer", "WIRE"
    bpy.context.view_layer.objects.active = item

    area = in_window.view()[0]
    overlay = area.spaces.active.overlay
    overlay.show_floor = overlay.show_axis_x = overlay.show_axis_y = False
    area.tag_redraw()  # for clicks go to the tabs as they are drawn
    yield 0.5
    yield from choose_tab()

    shots = [pixels(True)]
    settings.other, settings.file, settings.mask = hammer, "/tmp/dragon.vdb", "camera"
    settings.size_by, settings.voxel_size, settings.cutters, settings.at_cursor = (
        "voxel_size", 0.05, "chunks", True)
    yield 0.5
    shots.append(pixels(True))

    settings.size_by, settings.mask, settings.resolution = "resolution", "none", 600
    with in_window.in_view():
        bpy.ops.hermesh.remesh("INVOKE_DEFAULT")
    work = hermesh_blender.said.work
    while work.said[1] < 0.1:
        yield 0.05
    hermesh_blender.draw_sidebars(bpy.context)
    yield 0.05
    shots.append(pixels(True))
    work.cancel.set()
    while hermesh_blender.said.work is not None:
        yield 0.1
    settings.resolution = 100

    bpy.ops.hermesh.judge()
    yield 0.5
    shots.append(pixels(True))

    settings.file = "//dragon.vdb"
    try:
        bpy.ops.hermesh.volume()
    except RuntimeError as error:
        print("as it should:", error)
    settings.defects.clear()
    settings.verdict = ""
    yield 0.5
    shots.append(pixels(True))
    write(beside(shots), "panels.png", 15)
    bpy.ops.hermesh.dismiss()

    settings.seed = 1
    bpy.context.scene.cursor.location = (0.5, -1.0, 0.0)
    bpy.ops.hermesh.fracture()
    hammer.hide_set(True)
    camera.hide_set(True)
    for piece in bpy.data.objects:
        if " piece " in piece.name:
            piece.location = 0.3 * np.mean([corner[:] for corner in piece.bound_box], 0)
    with in_window.in_view():
        bpy.ops.view3d.view_all()
        bpy.ops.view3d.zoom(delta=-1)
    bpy.context.preferences.system.viewport_aa = "5"
    yield 5.0
    shot = pixels(False)
    write(shot[len(shot) - 900:, 150:], "window.png", 12)


in_window.run(steps())
