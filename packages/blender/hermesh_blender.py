"""Blender add-on: volumes, remeshing, Booleans, fracture and judges of hermesh on the active object.

For Blender 3.4 with the interpreter of the system (Debian), which finds the Python module hermesh. Each
operator works in a thread while Blender stays responsive: the status bar and the panel show progress, Escape
cancels, and undo takes the result back. Without a display (`blender -b`), or called with EXEC_DEFAULT, an
operator waits for its end.
"""

import textwrap
import threading
import time

import bpy
import numpy as np
from bpy.props import (BoolProperty, CollectionProperty, EnumProperty, FloatProperty, IntProperty,
                       PointerProperty, StringProperty)

bl_info = {
    "name": "hermesh",
    "description": "Polygons to sparse volumes and back, Booleans, fracture, judges",
    "author": "The hermesh project",
    "version": (1, 0, 0),
    "blender": (3, 4, 0),
    "location": "View3D > Sidebar > hermesh",
    "category": "Mesh",
}

# ---- Blender's meshes and hermesh's.


def mesh_of(context, item):
    """Returns the object's polygons as displayed, with modifiers and face attributes, in world units, and for
    each triangle its polygon of the object."""
    import hermesh
    shown = item.evaluated_get(context.evaluated_depsgraph_get())
    mesh = shown.to_mesh()
    try:
        points = np.empty(3 * len(mesh.vertices), np.float32)
        mesh.vertices.foreach_get("co", points)
        matrix = np.array(item.matrix_world)
        points = points.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]
        mesh.calc_loop_triangles()
        triangles = np.empty(3 * len(mesh.loop_triangles), np.int32)
        mesh.loop_triangles.foreach_get("vertices", triangles)
        polygons = np.empty(len(mesh.loop_triangles), np.int32)
        mesh.loop_triangles.foreach_get("polygon_index", polygons)
        attributes = {}
        for attribute in mesh.attributes:
            if (attribute.domain == "FACE" and attribute.data_type in ("INT", "FLOAT")
                    and not attribute.name.startswith(".")):
                values = np.empty(len(mesh.polygons),
                                  np.int32 if attribute.data_type == "INT" else np.float32)
                attribute.data.foreach_get("value", values)
                attributes[attribute.name] = values[polygons]
    finally:
        shown.to_mesh_clear()
    triangles = triangles.reshape(-1, 3)
    if np.linalg.det(matrix[:3, :3]) < 0:
        triangles = triangles[:, ::-1]  # a mirror turns polygons over
    return hermesh.Mesh(points, triangles, polygon_attributes=attributes), polygons


def data_of(mesh, name):
    """Returns a new Blender mesh from a hermesh.Mesh, in world units, with its polygon attributes."""
    data = bpy.data.meshes.new(name)
    points, triangles, quads = mesh.world_points().astype(np.float32), mesh.triangles, mesh.quads
    data.vertices.add(len(points))
    data.vertices.foreach_set("co", points.ravel())
    corners = np.concatenate([triangles.ravel(), quads.ravel()]).astype(np.int32)
    sides = np.concatenate([np.full(len(triangles), 3, np.int32), np.full(len(quads), 4, np.int32)])
    data.loops.add(len(corners))
    data.loops.foreach_set("vertex_index", corners)
    data.polygons.add(len(sides))
    data.polygons.foreach_set("loop_start", (np.cumsum(sides) - sides).astype(np.int32))
    data.polygons.foreach_set("loop_total", sides)
    for attribute, values in mesh.polygon_attributes.items():
        if values.ndim == 1:
            kind = "INT" if values.dtype == np.int32 else "FLOAT"
            data.attributes.new(attribute, kind, "FACE").data.foreach_set("value", values)
    data.update(calc_edges=True)
    data.validate()
    return data


def add_object(context, mesh, name, like):
    item = bpy.data.objects.new(name, data_of(mesh, name))
    for material in like.data.materials:
        item.data.materials.append(material)
    context.collection.objects.link(item)
    return item


# ---- Masks: where the tolerance holds, in an object or in the view of the camera (Aldén 2011, §9.2).


class Camera:
    """The view of the scene's camera, read from Blender; polygons() works without Blender's data."""

    def __init__(self, scene):
        if scene.camera is None or scene.camera.type != "CAMERA":
            raise ValueError("the scene has no camera whose view could be the mask")
        data = scene.camera.data
        if data.type == "PANO":
            raise ValueError("a panoramic camera's view is no frustum; choose another camera or an object "
                             "for the mask")
        self.is_perspective, self.near, self.far = data.type == "PERSP", data.clip_start, data.clip_end
        # corners of the picture in the camera's space, which looks along -z
        self.frame = np.array(data.view_frame(scene=scene))
        # The camera's scale does not change its view.
        self.placement = np.array(scene.camera.matrix_world.normalized())

    def polygons(self, box):
        """Returns points and quads of the part of the frustum around the box with the given eight corners, in
        world units. Nearer ends make a mask of few voxels fine enough."""
        depths = -(box - self.placement[:3, 3]) @ self.placement[:3, 2]
        margin = 0.05 * np.ptp(box, axis=0).max()
        near, far = max(self.near, depths.min() - margin), min(self.far, depths.max() + margin)
        if near >= far:
            raise ValueError("the camera sees nothing of the object: it is behind the camera or beyond its "
                             "clipping distances")
        ends = []
        for depth in (near, far):
            end = self.frame.copy()
            if self.is_perspective:
                end *= (depth / -end[:, 2])[:, None]
            end[:, 2] = -depth
            ends.append(end)
        points = np.concatenate(ends) @ self.placement[:3, :3].T + self.placement[:3, 3]
        # The picture's corners are clockwise seen from the camera, so the near end, which faces it, is
        # reversed.
        sides = [[i, (i + 1) % 4, (i + 1) % 4 + 4, i + 4] for i in range(4)]
        return points, np.array([[3, 2, 1, 0], [4, 5, 6, 7]] + sides)


def corners(lower, upper):
    return np.array([[(lower, upper)[i >> axis & 1][axis] for axis in range(3)] for i in range(8)])


def mask_of(context):
    """Returns a function that makes the options of a mask, given the corners of a box (world units) around
    the surface, the matrix from the world to the mask's space, and the watching options; it works without
    Blender's data."""
    settings = context.scene.hermesh
    if settings.mask == "none":
        return lambda box, matrix, watching: {}
    resolution, outside = settings.mask_resolution, settings.outside
    if settings.mask == "camera":
        polygons = Camera(context.scene).polygons
    else:
        if settings.mask_object is None:
            raise ValueError("choose the object in which the mesh is fine")
        mesh = mesh_of(context, settings.mask_object)[0]

        def polygons(box):
            return mesh.world_points(), mesh.triangles

    def make(box, matrix, watching):
        import hermesh
        points, sides = polygons(box)
        points = points @ matrix[:3, :3].T + matrix[:3, 3]
        if np.linalg.det(matrix[:3, :3]) < 0:
            sides = sides[:, ::-1]  # a mirror turns polygons over
        return dict(mask=hermesh.voxelize((points, sides), resolution=resolution, **watching),
                    outside=outside)

    return make


# ---- Errors and notes of the last operator, for the panel.


class Said:
    """Not stored in the scene, because setting a property there redraws all windows, and undo would restore
    old errors."""

    def __init__(self):
        self.errors, self.notes, self.work, self.title = [], [], None, ""

    def begin(self, title, work):
        self.errors, self.notes, self.work, self.title = [], [], work, title


said = Said()


def draw_sidebars(context):
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                for region in area.regions:
                    if region.type == "UI":
                        region.tag_redraw()


# ---- Operators.


class Work:
    """A call of hermesh in its own thread."""

    def __init__(self, call):
        import hermesh
        self.cancel, self.said, self.result, self.error, self.ended = (
            threading.Event(), ("", 0.0), None, None, None)
        self.log = hermesh.Log()

        def run():
            try:
                self.result = call(cancel=self.cancel, log=self.log, progress=self.note)
            except Exception as error:  # shown by the operator, whatever it is
                self.error = error
            self.ended = time.monotonic()

        self.thread = threading.Thread(target=run, daemon=True)
        self.thread.start()

    def note(self, stage, fraction):
        self.said = stage, fraction

    def sentence(self):
        if self.cancel.is_set():
            return "cancelling"
        return f"{self.said[0]} {100 * self.said[1]:.0f} %"


class Operator:
    """Base of the operators. prepare() reads Blender's data of the object and returns a call that works only
    on hermesh's data; finish() puts its result into the scene."""
    bl_options = {"REGISTER", "UNDO"}
    kind = "MESH"
    drawing_share = 0.1  # of the time, at most, goes into drawing progress: who draws does not hear Escape

    @classmethod
    def poll(cls, context):
        if said.work is not None:
            cls.poll_message_set("wait for what is at work, or cancel it with Escape")
        elif (context.mode != "OBJECT" or context.active_object is None
              or context.active_object.type != cls.kind):
            cls.poll_message_set(f"make a {cls.kind.lower()} the active object, in Object Mode")
        else:
            return True
        return False

    def fail(self, error):
        said.errors.append(str(error))
        self.report({"ERROR"}, str(error))
        return {"CANCELLED"}

    def begin(self, context):
        said.begin(self.bl_label, None)
        # Blender may move its data in memory meanwhile, and the user may activate another object.
        self.item = context.active_object.name
        try:
            self.work = Work(self.prepare(context, context.active_object))
        except (ImportError, RuntimeError, ValueError) as error:
            self.fail(error)
            return False
        said.work = self.work
        return True

    def end(self, context):
        import hermesh
        self.work.thread.join()
        said.work = None
        draw_sidebars(context)
        said.notes += self.work.log.notes
        for note in self.work.log.notes:
            self.report({"WARNING"}, note)
        if isinstance(self.work.error, hermesh.Cancelled):
            said.notes.append("cancelled")
            self.report({"INFO"}, "cancelled")
            return {"CANCELLED"}
        if self.work.error is not None:
            return self.fail(self.work.error)
        item = bpy.data.objects.get(self.item)
        if item is None or item.type != self.kind:
            return self.fail(f"the object {self.item} is not there any more")
        self.finish(context, item, self.work.result)
        return {"FINISHED"}

    def execute(self, context):
        return self.end(context) if self.begin(context) else {"CANCELLED"}

    def invoke(self, context, event):
        if bpy.app.background:
            return self.execute(context)
        if not self.begin(context):
            draw_sidebars(context)
            return {"CANCELLED"}
        # short work needs no drawing
        self.shown, self.drawn, self.next_drawing = "", None, time.monotonic() + 0.3
        self.timer = context.window_manager.event_timer_add(0.05, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.type == "ESC":
            self.work.cancel.set()
            return {"RUNNING_MODAL"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        if self.work.thread.is_alive():
            self.draw_progress(context)
            return {"RUNNING_MODAL"}
        self.leave(context)
        return self.end(context)

    def draw_progress(self, context):
        """Redraws the status bar and the sidebars. This redraws the whole window: milliseconds on a graphics
        card, tenths of a second with software rendering on a busy processor."""
        now = time.monotonic()
        if self.drawn is not None:
            self.next_drawing = now + max(0.1, (now - self.drawn) / self.drawing_share)
            self.drawn = None
        text = f"{said.title}: {self.work.sentence()}  (Escape cancels)"
        if text != self.shown and now >= self.next_drawing:
            context.workspace.status_text_set(text)
            draw_sidebars(context)
            self.shown, self.drawn = text, now

    def leave(self, context):
        context.window_manager.event_timer_remove(self.timer)
        context.workspace.status_text_set(None)

    def cancel(self, context):
        """Blender calls it when it ends the operator, e.g. to open another file."""
        self.work.cancel.set()
        self.work.thread.join()
        said.work = None
        self.leave(context)


class HERMESH_OT_volume(Operator, bpy.types.Operator):
    """Write the level set of the active object to a .vdb file and show it"""
    bl_idname, bl_label = "hermesh.volume", "Polygons to Volume"
    filepath: StringProperty(subtype="FILE_PATH",
                             description="The .vdb file that is written; the panel's if it is empty")

    def prepare(self, context, item):
        import hermesh
        settings = context.scene.hermesh
        path = self.filepath or settings.file
        if not path.endswith(".vdb"):
            raise ValueError("say which .vdb file the volume is written to")
        if path.startswith("//") and not bpy.data.filepath:
            raise ValueError("a path that begins with // is one beside the .blend file, which has not been "
                             "saved yet")
        path = bpy.path.abspath(path)
        mesh, options = mesh_of(context, item)[0], settings.voxelizing()
        options.update(exterior_band=settings.exterior_band, interior_band=settings.interior_band)

        def call(**watching):
            volume = hermesh.voxelize(mesh, **options, **watching)
            hermesh.write_vdb(path, volume, **watching)
            return path

        return call

    def finish(self, context, item, path):
        known = [other for other in bpy.data.volumes if bpy.path.abspath(other.filepath) == path]
        if known:
            # Blender keeps a file's grids while any volume uses them, so all volumes release them first.
            for written in ("", path):
                for other in known:
                    other.filepath = written
                context.view_layer.update()
            return
        volume = bpy.data.volumes.new(item.name + " volume")
        volume.filepath = path
        context.collection.objects.link(bpy.data.objects.new(volume.name, volume))


class HERMESH_OT_remesh(Operator, bpy.types.Operator):
    """Replace the active object's mesh by a watertight, adaptive one"""
    bl_idname, bl_label = "hermesh.remesh", "Remesh"

    def prepare(self, context, item):
        import hermesh
        settings = context.scene.hermesh
        mesh, options, mask = mesh_of(context, item)[0], settings.meshing(), mask_of(context)
        points = mesh.world_points()
        if not len(points):
            raise ValueError("the object has no polygons")
        box = corners(points.min(0), points.max(0))
        return lambda **watching: hermesh.remesh(mesh, **options, **mask(box, np.eye(4), watching),
                                                 **watching)

    def finish(self, context, item, mesh):
        replace(item, mesh)


def replace(item, mesh):
    """Gives the object a mesh in world units, which includes its transform and modifiers."""
    data = data_of(mesh, item.data.name)
    for material in item.data.materials:
        data.materials.append(material)
    inverse = item.matrix_world.inverted()
    data.transform(inverse)
    if inverse.determinant() < 0:
        data.flip_normals()
    item.modifiers.clear()
    item.data = data


class HERMESH_OT_extract(Operator, bpy.types.Operator):
    """Make a mesh of the active volume; the volume is hidden, and the mesh is a new object"""
    bl_idname, bl_label, kind = "hermesh.extract", "Volume to Mesh", "VOLUME"

    def prepare(self, context, item):
        import hermesh
        settings = context.scene.hermesh
        grids = item.data.grids
        if not grids.load() or not len(grids):
            raise ValueError(grids.error_message or "the volume has no grid")
        path, name = (
            grids.frame_filepath or bpy.path.abspath(item.data.filepath), grids[grids.active_index].name)
        tolerance, isovalue, mask, matrix = (
            settings.tolerance, settings.isovalue, mask_of(context), np.array(item.matrix_world))

        def call(**watching):
            volume = hermesh.read_vdb(path, grid=name, **watching)
            lower = np.array(volume.lower)
            box = corners(lower, lower + np.array(volume.dims) - 1)
            for placement in (volume.placement, matrix):
                box = box @ placement[:3, :3].T + placement[:3, 3]
            masked = mask(box, np.linalg.inv(matrix), watching)
            return hermesh.extract(volume, extractor="manifold-dual-contouring", isovalue=isovalue,
                                   tolerance=tolerance, **masked, **watching)

        return call

    def finish(self, context, item, mesh):
        made = add_object(context, mesh, item.name + " mesh", item)
        made.matrix_world = item.matrix_world
        if item.matrix_world.determinant() < 0:
            made.data.flip_normals()
        item.hide_set(True)
        item.select_set(False)
        made.select_set(True)
        context.view_layer.objects.active = made


class HERMESH_OT_combine(Operator, bpy.types.Operator):
    """Combine the active object with the other one on Hermite data, which keep the curves where both meet"""
    bl_idname, bl_label = "hermesh.combine", "Boolean"

    def prepare(self, context, item):
        import hermesh
        settings = context.scene.hermesh
        if settings.other is None or settings.other == item:
            raise ValueError("choose another object to combine the active one with")
        first, second = mesh_of(context, item)[0], mesh_of(context, settings.other)[0]
        operation, options = settings.operation, settings.meshing()
        return lambda **watching: hermesh.combine(operation, first, second, **options, **watching)

    def finish(self, context, item, mesh):
        replace(item, mesh)


class HERMESH_OT_fracture(Operator, bpy.types.Operator):
    """Break the active object into pieces that fit; it is hidden, and the pieces are new objects"""
    bl_idname, bl_label = "hermesh.fracture", "Fracture"

    def prepare(self, context, item):
        import hermesh
        settings = context.scene.hermesh
        mesh = mesh_of(context, item)[0]
        options = dict(settings.voxelizing(), seed=settings.seed)
        if settings.cutters == "object":
            if settings.cutter is None or settings.cutter == item:
                raise ValueError("choose another object that cuts the active one")
            options.update(cutters=[mesh_of(context, settings.cutter)[0]], copies=settings.copies)
        else:
            options.update(cutters=f"{settings.cutters}:{settings.pieces}", roughness=settings.roughness)
        if settings.at_cursor:
            options.update(impact=tuple(context.scene.cursor.location),
                           impact_radius=settings.impact_radius or None)
        return lambda **watching: hermesh.fracture(mesh, **options, **watching)

    def finish(self, context, item, fracture):
        for number, piece in enumerate(fracture.pieces, 1):
            add_object(context, piece.mesh, f"{item.name} piece {number}", item)
        item.hide_set(True)


class HERMESH_OT_judge(Operator, bpy.types.Operator):
    """Judge the active object; its defects are listed, and up to ten polygons of each are selected"""
    bl_idname, bl_label = "hermesh.judge", "Judge"

    def prepare(self, context, item):
        import hermesh
        mesh, self.polygons = mesh_of(context, item)
        return lambda **watching: hermesh.validate(mesh, **watching)

    def finish(self, context, item, report):
        settings = context.scene.hermesh
        settings.judged, settings.verdict, settings.is_well = item, str(report), not report.defects
        settings.defects.clear()
        # Modifiers may have made polygons that the object itself does not have.
        number = len(item.data.polygons)
        for defect in report.defects:
            listed = settings.defects.add()
            listed.name, listed.count = defect.name.replace("_", " "), defect.count
            bad = {int(self.polygons[p]) for place in defect.places for p in place.polygons if p >= 0}
            listed.polygons = ",".join(str(p) for p in sorted(bad) if p < number)
        select_polygons(item.data, {p for defect in settings.defects for p in defect.numbers()})
        self.report({"INFO"}, report.sentences[0])


def select_polygons(data, numbers):
    for kind in (data.vertices, data.edges):
        kind.foreach_set("select", np.zeros(len(kind), bool))
    data.polygons.foreach_set("select", np.array([i in numbers for i in range(len(data.polygons))], bool))


class HERMESH_OT_show_defect(bpy.types.Operator):
    """Select the first polygons with this defect in Edit Mode, and look at them"""
    bl_idname, bl_label, bl_options = "hermesh.show_defect", "Show Defect", {"REGISTER", "UNDO"}
    index: IntProperty(min=0, options={"HIDDEN"})

    @classmethod
    def poll(cls, context):
        item = context.scene.hermesh.judged
        return (said.work is None and item is not None and context.mode in ("OBJECT", "EDIT_MESH")
                and item.visible_get())

    def execute(self, context):
        settings = context.scene.hermesh
        if self.index >= len(settings.defects):
            return {"CANCELLED"}
        item, numbers = settings.judged, settings.defects[self.index].numbers()
        if context.mode == "EDIT_MESH":
            bpy.ops.object.mode_set(mode="OBJECT")
        if max(numbers, default=-1) >= len(item.data.polygons):
            self.report({"ERROR"}, "the mesh is another one now; judge it anew")
            return {"CANCELLED"}
        for other in context.selected_objects:
            other.select_set(False)
        item.select_set(True)
        context.view_layer.objects.active = item
        select_polygons(item.data, numbers)
        context.tool_settings.mesh_select_mode = (False, False, True)
        bpy.ops.object.mode_set(mode="EDIT")
        if numbers and context.region_data is not None and bpy.ops.view3d.view_selected.poll():
            bpy.ops.view3d.view_selected()
        return {"FINISHED"}


class HERMESH_OT_dismiss(bpy.types.Operator):
    """Do not show this any longer"""
    bl_idname, bl_label = "hermesh.dismiss", "Dismiss"

    def execute(self, context):
        said.errors, said.notes = [], []
        draw_sidebars(context)
        return {"FINISHED"}


# ---- Settings and the panels.


def is_mesh(self, item):
    return item.type == "MESH"


class HermeshDefect(bpy.types.PropertyGroup):
    count: IntProperty()
    polygons: StringProperty(description="Numbers of the first ones, with commas between them")

    def numbers(self):
        return {int(number) for number in self.polygons.split(",") if number}


class HermeshSettings(bpy.types.PropertyGroup):
    size_by: EnumProperty(name="Voxels by", items=[
        ("resolution", "Resolution",
         "Their number along the longest side of the object says how large voxels are"),
        ("voxel_size", "Voxel Size", "Their edge says how large voxels are"),
    ], description="What says how large voxels are")
    resolution: IntProperty(name="Resolution", default=100, min=1, soft_max=1000,
                            description="Voxels along the longest side of the object")
    voxel_size: FloatProperty(name="Voxel Size", default=0.02, min=1e-6, soft_min=0.001, soft_max=1.0,
                              precision=4, unit="LENGTH", description="Edge of a voxel")
    signs: EnumProperty(name="Inside", items=[
        ("auto", "Auto", "Flood fill, or winding numbers where the mesh is open"),
        ("flood-fill", "Flood Fill", "What the outside does not reach"),
        ("winding-number", "Winding Number", "For meshes with holes, and for polygons that intersect"),
    ], description="How the inside of polygons is found")
    file: StringProperty(name="File", subtype="FILE_PATH",
                         description="The .vdb file that the volume is written to")
    exterior_band: FloatProperty(name="Ext. Band", default=3.0, min=1.0, soft_max=20.0,
                                 description="Voxels outside the surface that have their distance")
    interior_band: FloatProperty(name="Int. Band", default=3.0, min=1.0, soft_max=20.0,
                                 description="Voxels inside the surface that have their distance")
    tolerance: FloatProperty(name="Tolerance", default=0.1, min=0.0, soft_max=2.0,
                             description="Voxels that the mesh may be from the finest one")
    isovalue: FloatProperty(name="Isovalue",
                            description="Value of the volume on the surface; 0 for level sets")
    mask: EnumProperty(name="Mask", items=[
        ("none", "None", "The tolerance holds everywhere"),
        ("object", "Object", "The tolerance holds inside an object"),
        ("camera", "Camera", "The tolerance holds in what the scene's camera sees"),
    ], description="Where the tolerance holds")
    mask_object: PointerProperty(name="Object", type=bpy.types.Object, poll=is_mesh,
                                 description="The tolerance holds inside it")
    mask_resolution: IntProperty(name="Mask Voxels", default=84, min=8, soft_max=500, max=4096,
                                 description="Voxels along the mask's longest side")
    outside: EnumProperty(name="Outside", items=[
        ("simplify", "Simplify", "Merge outside the mask as far as the topology allows"),
        ("nothing", "Nothing", "Make no polygons outside the mask; the mesh is open there"),
    ], description="What is made outside the mask")
    operation: EnumProperty(name="Operation", items=[
        ("union", "Union", "What is in either solid"),
        ("intersection", "Intersect", "What is in both solids"),
        ("difference", "Difference", "The active object without the other one"),
    ], default="difference")
    other: PointerProperty(name="With", type=bpy.types.Object, poll=is_mesh,
                           description="The other solid; it stays as it is")
    cutters: EnumProperty(name="Cutters", items=[
        ("voronoi", "Voronoi", "Cells about scattered points"),
        ("chunks", "Chunks", "Cells with rough walls"),
        ("planes", "Planes", "Scattered planes"),
        ("object", "Object", "Another object"),
    ])
    pieces: IntProperty(name="Number", default=10, min=1, soft_max=200, description="Cells or planes")
    roughness: FloatProperty(name="Roughness", default=0.12, min=0.0, max=1.0,
                             description="How far walls are displaced, as a part of the distance of the "
                                         "points")
    cutter: PointerProperty(name="Object", type=bpy.types.Object, poll=is_mesh,
                            description="The object that cuts; it stays as it is")
    copies: IntProperty(name="Copies", min=0, soft_max=50,
                        description="Scattered and turned at random; 0: it cuts where it is")
    seed: IntProperty(name="Seed", min=0, description="Of everything random")
    at_cursor: BoolProperty(name="At Cursor", description="Smallest pieces about the 3D cursor")
    impact_radius: FloatProperty(name="Radius", min=0.0, unit="LENGTH",
                                 description="Where there are half as many pieces; 0: chosen for the object")
    verdict: StringProperty(name="Verdict")
    is_well: BoolProperty()
    judged: PointerProperty(type=bpy.types.Object)
    defects: CollectionProperty(type=HermeshDefect)

    def voxelizing(self):
        size = (dict(resolution=self.resolution) if self.size_by == "resolution"
                else dict(voxel_size=self.voxel_size))
        return dict(size, signs=self.signs)

    def meshing(self):
        return dict(self.voxelizing(), tolerance=self.tolerance)


def wrapped(context, layout, text, icon="NONE", taken=90):
    """Draws a text in as many lines as the sidebar's width requires, since Blender truncates lines; `taken`
    pixels of it are for margins, the icon and other items next to the text."""
    width = max(12, int((context.region.width / context.preferences.system.ui_scale - taken) / 6.3))
    column = layout.column(align=True)
    column.scale_y = 0.75
    for paragraph in text.splitlines():
        for line in textwrap.wrap(paragraph, width) or [""]:
            column.label(text=line, icon=icon)
            icon = "BLANK1" if icon != "NONE" else icon


class Panel:
    bl_space_type, bl_region_type, bl_category = "VIEW_3D", "UI", "hermesh"

    def column(self):
        self.layout.use_property_split, self.layout.use_property_decorate = True, False
        return self.layout.column(), self.layout


class HERMESH_PT_panel(Panel, bpy.types.Panel):
    bl_label = "hermesh"

    def draw(self, context):
        settings, layout = context.scene.hermesh, self.column()[1]
        if said.work is not None:
            wrapped(context, layout.box(), f"{said.title}: {said.work.sentence()}\nEscape cancels",
                    "SORTTIME")
        for texts, icon in ((said.errors, "ERROR"), (said.notes, "INFO")):
            for text in texts:
                row = layout.box().row()
                row.alert = icon == "ERROR"
                wrapped(context, row, f"{said.title}: {text}", icon, taken=125)
                row.operator(HERMESH_OT_dismiss.bl_idname, text="", icon="X", emboss=False)
        column = layout.column()
        row = column.row()
        row.use_property_split = False
        row.prop(settings, "size_by", expand=True)
        column.prop(settings, settings.size_by)
        column.prop(settings, "signs")


class SubPanel(Panel):
    bl_parent_id = "HERMESH_PT_panel"


class HERMESH_PT_volume(SubPanel, bpy.types.Panel):
    bl_label = "Volume"

    def draw(self, context):
        settings = context.scene.hermesh
        column, layout = self.column()
        column.prop(settings, "file")
        bands = column.column(align=True)
        bands.prop(settings, "exterior_band")
        bands.prop(settings, "interior_band")
        layout.operator(HERMESH_OT_volume.bl_idname, icon="VOLUME_DATA")


class HERMESH_PT_mesh(SubPanel, bpy.types.Panel):
    bl_label = "Mesh"

    def draw(self, context):
        settings = context.scene.hermesh
        column, layout = self.column()
        column.prop(settings, "tolerance")
        column.prop(settings, "mask")
        if settings.mask == "object":
            column.prop(settings, "mask_object")
        if settings.mask == "camera":
            column.prop(context.scene, "camera")
        if settings.mask != "none":
            column.prop(settings, "mask_resolution")
            column.prop(settings, "outside")
        layout.operator(HERMESH_OT_remesh.bl_idname, icon="MESH_DATA")
        layout.prop(settings, "isovalue")
        layout.operator(HERMESH_OT_extract.bl_idname, icon="OUTLINER_OB_MESH")


class HERMESH_PT_boolean(SubPanel, bpy.types.Panel):
    bl_label = "Boolean"

    def draw(self, context):
        settings = context.scene.hermesh
        column, layout = self.column()
        column.prop(settings, "operation")
        column.prop(settings, "other")
        column.prop(settings, "tolerance")
        layout.operator(HERMESH_OT_combine.bl_idname, icon="MOD_BOOLEAN")


class HERMESH_PT_fracture(SubPanel, bpy.types.Panel):
    bl_label = "Fracture"

    def draw(self, context):
        settings = context.scene.hermesh
        column, layout = self.column()
        column.prop(settings, "cutters")
        if settings.cutters == "object":
            column.prop(settings, "cutter")
            column.prop(settings, "copies")
        else:
            column.prop(settings, "pieces")
        if settings.cutters == "chunks":
            column.prop(settings, "roughness")
        column.prop(settings, "seed")
        column.row(heading="Impact").prop(settings, "at_cursor")
        if settings.at_cursor:
            column.prop(settings, "impact_radius")
        layout.operator(HERMESH_OT_fracture.bl_idname, icon="MOD_EXPLODE")


class HERMESH_PT_judge(SubPanel, bpy.types.Panel):
    bl_label = "Judge"

    def draw(self, context):
        settings, layout = context.scene.hermesh, self.layout
        layout.operator(HERMESH_OT_judge.bl_idname, icon="VIEWZOOM")
        if not settings.verdict:
            return
        box = layout.box()
        if settings.judged is not None:
            box.label(text=settings.judged.name, icon="OBJECT_DATA")
        # The other messages describe the positions of the defects, which their buttons show.
        text = settings.verdict if settings.is_well else settings.verdict.splitlines()[0]
        wrapped(context, box, text, "CHECKMARK" if settings.is_well else "ERROR")
        if settings.defects:
            rows = layout.column(align=True)
            for index, defect in enumerate(settings.defects):
                row = rows.row()
                row.label(text=f"{defect.count:,} {defect.name}")
                button = row.row()
                button.enabled = bool(defect.polygons)
                button.operator(HERMESH_OT_show_defect.bl_idname, text="",
                                icon="RESTRICT_SELECT_OFF").index = index


classes = (HermeshDefect, HermeshSettings, HERMESH_OT_volume, HERMESH_OT_remesh, HERMESH_OT_extract,
           HERMESH_OT_combine, HERMESH_OT_fracture, HERMESH_OT_judge, HERMESH_OT_show_defect,
           HERMESH_OT_dismiss, HERMESH_PT_panel, HERMESH_PT_volume, HERMESH_PT_mesh, HERMESH_PT_boolean,
           HERMESH_PT_fracture, HERMESH_PT_judge)


def register():
    for each in classes:
        bpy.utils.register_class(each)
    bpy.types.Scene.hermesh = PointerProperty(type=HermeshSettings)


def unregister():
    del bpy.types.Scene.hermesh
    for each in reversed(classes):
        bpy.utils.unregister_class(each)


if __name__ == "__main__":
    register()
