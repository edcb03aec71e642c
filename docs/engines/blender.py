"""Ambient occlusion on a view of Blender's, drawn off screen with its depth buffer and camera.

    python docs/engines/blender.py        # with bpy, in the Python that it is made for

writes docs/images/engines/bpy.png.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from math import cos, sin
from typing import Any

import numpy as np

if __name__ == "__main__":
    import demo  # noqa: F401 (puts the checkout on the path)

from docs.engines.demo import Picture, occluded, show
from passgraph.engines import blender as adapter
from passgraph.engines.blender import ViewAttachment


def open_gpu(bpy: Any, gpu: Any) -> None:
    """A context without a window."""
    if hasattr(gpu, "init"):
        gpu.init()
        return
    # Where scripts cannot ask for one, a picture that is rendered makes one, which stays current.
    render = bpy.context.scene.render
    render.engine = "BLENDER_WORKBENCH"
    render.resolution_x = render.resolution_y = 8
    bpy.ops.render.render()


class Scene:
    """Monkeys on a floor in the solid view, seen by a camera that goes round them."""

    engine = "bpy"
    hook = "after `GPUOffScreen.draw_view3d`"
    shown = partial(occluded, radius=0.6)

    def __init__(self, size: tuple[int, int]) -> None:
        import bpy
        import gpu

        open_gpu(bpy, gpu)
        self.bpy, self.gpu = bpy, gpu
        bpy.context.preferences.system.viewport_aa = "OFF"  # a view is drawn eight times for each picture otherwise
        self.attached: ViewAttachment | None = None
        self.calls: list[Callable[[], object]] = []
        screen = bpy.context.window_manager.windows[0].screen
        area = next(area for area in screen.areas if area.type == "VIEW_3D")
        self.space = area.spaces[0]
        self.region = next(region for region in area.regions if region.type == "WINDOW")
        self.space.overlay.show_overlays = False
        self.space.shading.background_type = "VIEWPORT"
        self.space.shading.background_color = (0.55, 0.6, 0.7)
        bpy.ops.object.select_all(action="SELECT")
        bpy.ops.object.delete()
        bpy.ops.mesh.primitive_plane_add(size=14)
        for x in range(-1, 2):
            for y in range(-1, 2):
                bpy.ops.mesh.primitive_monkey_add(location=(2.1 * x, 2.1 * y, 0.85), rotation=(0, 0, 0.5 * x + 0.3 * y))
                bpy.ops.object.shade_smooth()
        bpy.ops.object.camera_add()
        self.camera = bpy.context.object
        self.angle = -1.0
        self.resize(size)

    def draw(self) -> None:
        from mathutils import Vector

        context = self.bpy.context
        self.angle += 0.05
        at = Vector((9 * cos(self.angle), 9 * sin(self.angle), 5.5))
        self.camera.location = at
        self.camera.rotation_euler = (Vector((0, 0, 0.5)) - at).to_track_quat("-Z", "Y").to_euler()
        context.view_layer.update()
        width, height = self.offscreen.width, self.offscreen.height
        graph = context.evaluated_depsgraph_get()
        projection = self.camera.calc_matrix_camera(graph, x=width, y=height)
        view = self.camera.matrix_world.inverted()
        drawing = self.attached if self.attached is not None else self.offscreen
        seen = context.scene, context.view_layer, self.space, self.region, view, projection
        drawing.draw_view3d(*seen, do_color_management=True)
        with self.offscreen.bind():
            for call in self.calls:
                call()

    def picture(self) -> Picture:
        numbers = self.offscreen.texture_color.read()
        numbers.dimensions = self.offscreen.width * self.offscreen.height * 4
        rows = np.array(numbers, np.uint8).reshape(self.offscreen.height, self.offscreen.width, 4)
        return rows[::-1, :, :3].copy()

    def attach(self, effect: Callable[..., Any], **values: Any) -> ViewAttachment:
        self.attached = made = adapter.attach(self.offscreen, effect, **values)

        def forget() -> None:
            self.attached = None

        made.on_close(forget)
        return made

    def hook_in(self, call: Callable[[], object]) -> Callable[[], object]:
        self.calls.append(call)
        return lambda: self.calls.remove(call)

    def resize(self, size: tuple[int, int]) -> None:
        self.offscreen = self.gpu.types.GPUOffScreen(*size)
        if self.attached is not None:
            self.attached.offscreen = self.offscreen

    def close(self) -> None:
        self.offscreen.free()


if __name__ == "__main__":
    show(Scene)
