"""Blender add-on: volumes, remeshing, Booleans, fracture and judges of hermesh on the active object.

For Blender 3.4 with the interpreter of the system (Debian), which finds the Python module hermesh. Each operator works in a thread
while Blender stays responsive: the status bar shows progress, Escape cancels, and undo takes the result back. Without a display
(`blender -b`), or called with EXEC_DEFAULT, an operator waits for its end.
"""

import threading

import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty, StringProperty

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
    """The object's polygons as they are shown, with modifiers and numbers on faces, in world units, and for each triangle the
    polygon of the object that it is of."""
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
            if attribute.domain == "FACE" and attribute.data_type in ("INT", "FLOAT") and not attribute.name.startswith("."):
                values = np.empty(len(mesh.polygons), np.int32 if attribute.data_type == "INT" else np.float32)
                attribute.data.foreach_get("value", values)
                attributes[attribute.name] = values[polygons]
    finally:
        shown.to_mesh_clear()
    triangles = triangles.reshape(-1, 3)
    if np.linalg.det(matrix[:3, :3]) < 0:
        triangles = triangles[:, ::-1]  # a mirror turns polygons over
    return hermesh.Mesh(points, triangles, polygon_attributes=attributes), polygons


def data_of(mesh, name):
    """A new mesh of Blender's of a hermesh.Mesh, in world units, with its attributes of polygons."""
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


# ---- Operators.


class Work:
    """A call of hermesh in a thread of its own."""

    def __init__(self, call):
        import hermesh
        self.cancel, self.said, self.result, self.error = threading.Event(), ("", 0.0), None, None
        self.log = hermesh.Log()

        def run():
            try:
                self.result = call(cancel=self.cancel, log=self.log, progress=self.note)
            except Exception as error:  # shown by the operator, whatever it is
                self.error = error

        self.thread = threading.Thread(target=run, daemon=True)
        self.thread.start()

    def note(self, stage, fraction):
        self.said = stage, fraction


class Operator:
    """What the operators share. prepare() reads Blender's data and returns a call that works on hermesh's alone; finish() puts its
    result into the scene."""
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        return context.active_object is not None and context.active_object.type == "MESH" and context.mode == "OBJECT"

    def begin(self, context):
        try:
            self.work = Work(self.prepare(context))
        except (ImportError, RuntimeError, ValueError) as error:
            self.report({"ERROR"}, str(error))
            return False
        return True

    def end(self, context):
        import hermesh
        self.work.thread.join()
        for note in self.work.log.notes:
            self.report({"WARNING"}, note)
        if isinstance(self.work.error, hermesh.Cancelled):
            self.report({"INFO"}, "cancelled")
            return {"CANCELLED"}
        if self.work.error is not None:
            self.report({"ERROR"}, str(self.work.error))
            return {"CANCELLED"}
        self.finish(context, self.work.result)
        return {"FINISHED"}

    def execute(self, context):
        return self.end(context) if self.begin(context) else {"CANCELLED"}

    def invoke(self, context, event):
        if bpy.app.background:
            return self.execute(context)
        if not self.begin(context):
            return {"CANCELLED"}
        self.shown = ""
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
            text = f"hermesh: {self.work.said[0]} {100 * self.work.said[1]:.0f} %  (Escape cancels)"
            if text != self.shown:  # for Blender draws its window anew each time
                context.workspace.status_text_set(text)
                self.shown = text
            return {"RUNNING_MODAL"}
        context.window_manager.event_timer_remove(self.timer)
        context.workspace.status_text_set(None)
        return self.end(context)


class HERMESH_OT_volume(Operator, bpy.types.Operator):
    """Write the level set of the active object to a .vdb file and show it"""
    bl_idname, bl_label = "hermesh.volume", "Polygons to Volume"
    filepath: StringProperty(subtype="FILE_PATH", description="The .vdb file that is written")

    def prepare(self, context):
        import hermesh
        settings = context.scene.hermesh
        if not self.filepath.endswith(".vdb"):
            raise ValueError("say which .vdb file the volume is written to")
        path = bpy.path.abspath(self.filepath)
        mesh, resolution, signs = mesh_of(context, context.active_object)[0], settings.resolution, settings.signs

        def call(**watching):
            volume = hermesh.voxelize(mesh, resolution=resolution, signs=signs, **watching)
            hermesh.write_vdb(path, volume, **watching)
            return path

        return call

    def finish(self, context, path):
        volume = bpy.data.volumes.new("hermesh")
        volume.filepath = path
        context.collection.objects.link(bpy.data.objects.new(context.active_object.name + " volume", volume))

    def invoke(self, context, event):
        if not self.filepath:
            context.window_manager.fileselect_add(self)
            return {"RUNNING_MODAL"}
        return super().invoke(context, event)


class HERMESH_OT_remesh(Operator, bpy.types.Operator):
    """Replace the active object's mesh by a watertight, adaptive one"""
    bl_idname, bl_label = "hermesh.remesh", "Remesh"

    def prepare(self, context):
        import hermesh
        settings = context.scene.hermesh
        mesh, options = mesh_of(context, context.active_object)[0], settings.options()
        return lambda **watching: hermesh.remesh(mesh, **options, **watching)

    def finish(self, context, mesh):
        replace(context.active_object, mesh)


def replace(item, mesh):
    """Gives the object a mesh that is in world units; where it stands and what modifies it is in the mesh."""
    data = data_of(mesh, item.data.name)
    for material in item.data.materials:
        data.materials.append(material)
    inverse = item.matrix_world.inverted()
    data.transform(inverse)
    if inverse.determinant() < 0:
        data.flip_normals()
    item.modifiers.clear()
    item.data = data


class HERMESH_OT_combine(Operator, bpy.types.Operator):
    """Combine the active object with the other one on Hermite data, which keep the curves where both meet"""
    bl_idname, bl_label = "hermesh.combine", "Boolean"

    def prepare(self, context):
        import hermesh
        settings = context.scene.hermesh
        if settings.other is None or settings.other == context.active_object:
            raise ValueError("choose another object to combine the active one with")
        first, second = mesh_of(context, context.active_object)[0], mesh_of(context, settings.other)[0]
        operation, options = settings.operation, settings.options()
        return lambda **watching: hermesh.combine(operation, first, second, **options, **watching)

    def finish(self, context, mesh):
        replace(context.active_object, mesh)


class HERMESH_OT_fracture(Operator, bpy.types.Operator):
    """Break the active object into pieces that fit; it is hidden, and the pieces are new objects"""
    bl_idname, bl_label = "hermesh.fracture", "Fracture"

    def prepare(self, context):
        import hermesh
        settings = context.scene.hermesh
        mesh = mesh_of(context, context.active_object)[0]
        options = dict(cutters=f"{settings.cutters}:{settings.pieces}", seed=settings.seed, resolution=settings.resolution,
                       signs=settings.signs)
        if settings.at_cursor:
            options["impact"] = tuple(context.scene.cursor.location)
        return lambda **watching: hermesh.fracture(mesh, **options, **watching)

    def finish(self, context, fracture):
        whole = context.active_object
        for number, piece in enumerate(fracture.pieces, 1):
            add_object(context, piece.mesh, f"{whole.name} piece {number}", whole)
        whole.hide_set(True)


class HERMESH_OT_judge(Operator, bpy.types.Operator):
    """Judge the active object; polygons with defects are selected"""
    bl_idname, bl_label = "hermesh.judge", "Judge"

    def prepare(self, context):
        import hermesh
        mesh, self.polygons = mesh_of(context, context.active_object)
        return lambda **watching: hermesh.validate(mesh, **watching)

    def finish(self, context, report):
        context.scene.hermesh.verdict = str(report)
        data = context.active_object.data
        bad = {int(self.polygons[p]) for defect in report.defects for place in defect.places for p in place.polygons if p >= 0}
        for kind in (data.vertices, data.edges):
            kind.foreach_set("select", np.zeros(len(kind), bool))
        # Modifiers may have made polygons that the object itself does not have.
        data.polygons.foreach_set("select", np.array([i in bad for i in range(len(data.polygons))], bool))
        self.report({"INFO"}, report.sentences[0])


# ---- Settings and the panel.


def choices(*names):
    return [(name, name.capitalize().replace("-", " "), "") for name in names]


class HermeshSettings(bpy.types.PropertyGroup):
    resolution: IntProperty(name="Resolution", default=100, min=1, soft_max=1000,
                            description="Voxels along the longest side of the object")
    tolerance: FloatProperty(name="Tolerance", default=0.1, min=0.0, soft_max=2.0,
                             description="Voxels that the mesh may be from the finest one")
    signs: EnumProperty(name="Inside", items=choices("auto", "flood-fill", "winding-number"),
                        description="How the inside is found; winding numbers for meshes with holes")
    operation: EnumProperty(name="Operation", items=choices("union", "intersection", "difference"))
    other: PointerProperty(name="Other", type=bpy.types.Object, poll=lambda self, item: item.type == "MESH")
    cutters: EnumProperty(name="Cutters", items=choices("voronoi", "chunks", "planes"))
    pieces: IntProperty(name="Number", default=10, min=1, soft_max=200, description="Cells or planes")
    seed: IntProperty(name="Seed", min=0, description="Of everything random")
    at_cursor: BoolProperty(name="Impact at cursor", description="Smallest pieces about the 3D cursor")
    verdict: StringProperty(name="Verdict")

    def options(self):
        return dict(resolution=self.resolution, signs=self.signs, tolerance=self.tolerance)


class HERMESH_PT_panel(bpy.types.Panel):
    bl_label, bl_space_type, bl_region_type, bl_category = "hermesh", "VIEW_3D", "UI", "hermesh"

    def draw(self, context):
        settings, layout = context.scene.hermesh, self.layout
        for name in ("resolution", "tolerance", "signs"):
            layout.prop(settings, name)
        for operator, names in ((HERMESH_OT_volume, ()), (HERMESH_OT_remesh, ()), (HERMESH_OT_combine, ("operation", "other")),
                                (HERMESH_OT_fracture, ("cutters", "pieces", "seed", "at_cursor")), (HERMESH_OT_judge, ())):
            box = layout.box()
            for name in names:
                box.prop(settings, name)
            box.operator(operator.bl_idname)
        for line in settings.verdict.splitlines():
            layout.label(text=line)


classes = (HermeshSettings, HERMESH_OT_volume, HERMESH_OT_remesh, HERMESH_OT_combine, HERMESH_OT_fracture, HERMESH_OT_judge,
           HERMESH_PT_panel)


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
