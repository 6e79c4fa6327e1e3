"""A session in a real Blender in a window, with keys: xvfb-run -a -s "-screen 0 1280x1024x24" blender
--factory-startup -p 0 0 800 600 --python window_test.py [-- PRESSES]

Prints the delay from the key Escape to the end of the work, measured from the start of the program that sends
the key. A failed assertion ends Blender with 1.
"""

import pathlib
import statistics
import sys
import threading
import time

import bpy

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import hermesh_blender  # noqa: E402
import in_window  # noqa: E402

presses = int(sys.argv[sys.argv.index("--") + 1]) if "--" in sys.argv else 12
stamps = {}


def invoke(operator):
    with in_window.in_view():
        result = operator("INVOKE_DEFAULT")
    assert result == {"RUNNING_MODAL"}, result
    return hermesh_blender.said.work


def until_it_ends(work):
    while hermesh_blender.said.work is work:
        yield 0.02


def stamp_what_is_heard():
    """Notes when the operator hears of Escape and when it returns."""
    modal, end = hermesh_blender.Operator.modal, hermesh_blender.Operator.end

    def stamped_modal(self, context, event):
        if event.type == "ESC":
            stamps.setdefault("heard", time.monotonic())
        return modal(self, context, event)

    def stamped_end(self, context):
        try:
            return end(self, context)
        finally:
            stamps["returned"] = time.monotonic()

    hermesh_blender.Operator.modal, hermesh_blender.Operator.end = stamped_modal, stamped_end


def press_escape(work, delay):
    """Runs in its own thread: a step would run right after a redraw and right before the next one, at no
    moment in between."""
    time.sleep(delay)
    stamps.update(pressed=time.monotonic(), stage=work.said[0], alive=work.thread.is_alive())
    in_window.xdotool("key", "Escape")


def steps():
    hermesh_blender.register()
    in_window.clear()
    area, _ = in_window.view()
    area.spaces.active.show_region_ui = True
    # Blender draws a view several times in a row to smooth its edges, and ignores keys meanwhile:
    # milliseconds on a graphics card, seconds with software rendering on a busy processor.
    bpy.context.preferences.system.viewport_aa = "OFF"
    in_window.move_mouse(area.x + area.width // 3, area.y + area.height // 2)
    bpy.ops.mesh.primitive_cube_add(location=(3.0, 0.0, 0.0))
    bpy.context.active_object.name = "other"
    bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24)
    bpy.context.active_object.name = "ball"
    bpy.ops.ed.undo_push(message="made")
    yield 0.5

    # Another object becomes the active one meanwhile: the ball is the one that is remeshed, and no second
    # work begins.
    before = len(bpy.data.objects["ball"].data.polygons)
    settings = bpy.context.scene.hermesh
    settings.resolution = 150
    work = invoke(bpy.ops.hermesh.remesh)
    with in_window.in_view():
        bpy.context.view_layer.objects.active = bpy.data.objects["other"]
        assert not bpy.ops.hermesh.remesh.poll()
    yield from until_it_ends(work)
    assert work.error is None and not hermesh_blender.said.errors
    assert len(bpy.data.objects["other"].data.polygons) == 6
    assert len(bpy.data.objects["ball"].data.polygons) > before
    with in_window.in_view():
        bpy.ops.ed.undo()
    yield 0.2
    assert len(bpy.data.objects["ball"].data.polygons) == before

    # The object goes away meanwhile.
    with in_window.in_view():
        bpy.context.view_layer.objects.active = bpy.data.objects["ball"]
        work = invoke(bpy.ops.hermesh.remesh)
        bpy.data.objects["ball"].name = "renamed"
    yield from until_it_ends(work)
    assert hermesh_blender.said.errors == [
        "the object ball is not there any more"], hermesh_blender.said.errors
    bpy.data.objects["renamed"].name = "ball"

    # Escape, at many moments of the work.
    stamp_what_is_heard()
    heard, ended, returned = [], [], []
    bpy.context.scene.hermesh.resolution = 700
    for number in range(presses):
        with in_window.in_view():
            bpy.context.view_layer.objects.active = bpy.data.objects["ball"]
        work = invoke(bpy.ops.hermesh.remesh)
        stamps.clear()
        thread = threading.Thread(target=press_escape, args=(work, 0.3 + 0.17 * number))
        thread.start()
        yield from until_it_ends(work)
        thread.join()
        assert stamps["alive"] and hermesh_blender.said.notes[-1] == "cancelled" and work.ended is not None
        for times, moment in ((heard, stamps["heard"]), (ended, work.ended), (returned, stamps["returned"])):
            times.append(1000 * (moment - stamps["pressed"]))
        print(f"Escape in '{stamps['stage']}': heard after {heard[-1]:.0f} ms, ended after {ended[-1]:.0f} "
              f"ms, returned after "
              f"{returned[-1]:.0f} ms")
        yield 0.3
    for name, times in (("heard", heard), ("ended", ended), ("returned", returned)):
        print(f"Escape to {name}: median {statistics.median(times):.0f} ms, at most {max(times):.0f} ms, "
              f"{presses} presses")
    assert len(bpy.data.objects["ball"].data.polygons) == before
    # The goal is 200 ms; machines that do other work besides get some more.
    assert statistics.median(ended) < 400, ended
    print("the session in a window went as it should")


in_window.run(steps())
