"""Ambient occlusion on a scene of Panda3D's own models, from its depth buffer and camera.

    python docs/engines/panda3d.py

writes docs/images/engines/panda3d.png.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

if __name__ == "__main__":
    import demo  # noqa: F401 (puts the checkout on the path)

from docs.engines.demo import Picture, occluded, show
from passgraph.engines import panda3d as adapter
from passgraph.engines.attachment import Attachment


def behind_all(output: Any, call: Callable[[], object]) -> Callable[[], object]:
    """Have a function called when all of a window or buffer is drawn; returns what ends it."""
    from panda3d.core import PythonCallbackObject

    region = output.make_display_region()
    region.sort = adapter.SORT + 1
    region.set_draw_callback(PythonCallbackObject(lambda data: call()))
    return lambda: (region.clear_draw_callback(), output.remove_display_region(region))


class Scene:
    """A panda on a field of boxes; a process has one of ShowBase."""

    engine = "panda3d"
    hook = "`DisplayRegion.set_draw_callback`"

    def __init__(self, size: tuple[int, int], samples: int = 0) -> None:
        from direct.showbase.ShowBase import ShowBase
        from panda3d.core import AmbientLight, DirectionalLight, FrameBufferProperties, Vec4, load_prc_file_data

        # p3headlessgl renders through EGL, without a display; in a window nothing else changes.
        load_prc_file_data("", "load-display p3headlessgl\nwindow-type offscreen\naudio-library-name null\n")
        load_prc_file_data("", f"win-size {size[0]} {size[1]}\nnotify-level-display error\n")
        load_prc_file_data("", f"framebuffer-multisample {int(samples > 0)}\nmultisamples {samples}\n")
        self.base = ShowBase()
        properties = FrameBufferProperties()
        properties.set_rgba_bits(8, 8, 8, 8)
        properties.set_depth_bits(24)
        properties.set_multisamples(samples)
        self.buffer = self.base.win.make_texture_buffer("scene", *size, None, False, properties)
        self.buffer.set_clear_color(Vec4(0.45, 0.55, 0.7, 1))
        self.camera = self.base.make_camera(self.buffer)
        self.camera.set_pos(9, -17, 8)
        self.camera.look_at(0, 0, 2)
        self.panda = self.base.loader.load_model("models/panda")
        self.panda.set_scale(0.5)
        self.panda.reparent_to(self.base.render)
        for x in range(-3, 4):
            for y in range(-3, 4):
                box = self.base.loader.load_model("models/box")
                box.set_texture_off(1)
                box.set_color(0.75, 0.7, 0.62, 1)
                box.set_scale(2.0, 2.0, 1.0 + 0.5 * ((3 * x + 5 * y) % 4))
                box.set_pos(2.0 * x, 2.0 * y, -2.5)
                box.reparent_to(self.base.render)
        sun, sky = DirectionalLight("sun"), AmbientLight("sky")
        sun.set_color(Vec4(0.7, 0.65, 0.6, 1))
        sky.set_color(Vec4(0.45, 0.45, 0.5, 1))
        path = self.base.render.attach_new_node(sun)
        path.set_hpr(-30, -60, 0)
        self.base.render.set_light(path)
        self.base.render.set_light(self.base.render.attach_new_node(sky))
        self.turned = 20.0

    shown = partial(occluded, radius=1.5)

    def draw(self) -> None:
        self.turned += 5.0
        self.panda.set_h(self.turned)
        self.base.graphics_engine.render_frame()

    def picture(self) -> Picture:
        texture = self.buffer.get_texture()
        self.base.graphics_engine.extract_texture_data(texture, self.buffer.gsg)
        rows = np.frombuffer(texture.get_ram_image_as("RGB"), np.uint8)
        rows = rows.reshape(texture.get_y_size(), texture.get_x_size(), 3)
        width, height = self.buffer.get_fb_x_size(), self.buffer.get_fb_y_size()
        return rows[:height][::-1, :width].copy()

    def attach(self, effect: Callable[..., Any], **values: Any) -> Attachment:
        return adapter.attach(self.buffer, effect, **values)

    def hook_in(self, call: Callable[[], object]) -> Callable[[], object]:
        return behind_all(self.buffer, call)

    def resize(self, size: tuple[int, int]) -> None:
        self.buffer.set_size(*size)

    def close(self) -> None:
        self.base.destroy()


if __name__ == "__main__":
    show(Scene)
