"""Helpers of scripts that control Blender in a window, such as one of xvfb-run, step by step between its
redraws."""

import os
import subprocess
import sys
import traceback

import bpy


def view(window=None):
    """The window's 3D view, and its sidebar's region."""
    area = next(area for area in (window or bpy.context.window_manager.windows[0]).screen.areas
                if area.type == "VIEW_3D")
    return area, next(region for region in area.regions if region.type == "UI")


def in_view():
    """A context for operators that are called as if from the 3D view."""
    window = bpy.context.window_manager.windows[0]
    area = view(window)[0]
    region = next(region for region in area.regions if region.type == "WINDOW")
    return bpy.context.temp_override(window=window, area=area, region=region)


def xdotool(*words):
    """Sends keys and clicks like a keyboard and a mouse; without a window manager the window under the mouse
    gets the keys."""
    subprocess.run(["xdotool", *words], check=True)


def move_mouse(x, y):
    """Moves the mouse to a position in pixels from the window's lower left, like Blender's coordinates of
    regions; the window may be anywhere."""
    height = bpy.context.window_manager.windows[0].height
    xdotool("search", "--onlyvisible", "--class", "Blender", "mousemove", "--window", "%1", str(x),
            str(height - y))


def clear():
    for item in list(bpy.data.objects):
        bpy.data.objects.remove(item)


def run(steps):
    """Runs the steps, a generator of the seconds to wait before the next one, while Blender's window is open,
    then ends Blender, with 1 if a step raises an exception."""

    def step():
        try:
            return next(steps)
        except StopIteration:
            code = 0
        except BaseException:
            traceback.print_exc()
            code = 1
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)  # for nobody could answer the question whether to save

    bpy.context.preferences.view.show_splash = False
    bpy.app.timers.register(step, first_interval=1.0)
