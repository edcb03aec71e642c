"""An engine without an adapter: the loop says itself when its frame is whole.

    xvfb-run -a python docs/engines/raylib.py

writes docs/images/engines/raylib.png: ambient occlusion in raylib, from its depth buffer and matrices.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

if __name__ == "__main__":
    import demo  # noqa: F401 (puts the checkout on the path)

from docs.engines.demo import Picture, occluded, show
from passgraph.engines.attachment import Attachment, View


class Scene:
    """Cubes and a sphere on a plane; a process has one window."""

    engine = "raylib"
    hook = "a call before `end_drawing`"
    needs_display = True
    shown = partial(occluded, radius=1.5)

    def __init__(self, size: tuple[int, int]) -> None:
        import pyray

        self.ray = pyray
        pyray.set_trace_log_level(pyray.TraceLogLevel.LOG_WARNING)
        pyray.set_config_flags(pyray.ConfigFlags.FLAG_WINDOW_RESIZABLE)
        pyray.init_window(*size, "scene")
        self.camera = pyray.Camera3D((6.0, 5.0, 7.0), (0.0, 0.4, 0.0), (0.0, 1.0, 0.0), 40.0, 0)
        self.target = pyray.load_render_texture(*size)
        self.calls: list[Callable[[], object]] = []
        self.time = 0.0

    def draw(self) -> None:
        ray = self.ray
        self.time += 0.2
        ray.begin_drawing()
        ray.begin_texture_mode(self.target)
        ray.clear_background((140, 166, 204, 255))
        ray.begin_mode_3d(self.camera)
        self.seen_by = [self._matrix(ray.rl_get_matrix_modelview()), self._matrix(ray.rl_get_matrix_projection())]
        ray.draw_plane((0.0, 0.0, 0.0), (12.0, 12.0), (178, 172, 165, 255))
        for place, sides, colour in (
            ((2.4, 0.8, 0.5), (1.6, 1.6, 1.6), (205, 92, 80, 255)),
            ((-2.4, 1.4, -1.0), (1.4, 2.8, 1.4), (95, 150, 205, 255)),
            ((0.4, 0.5, 3.0), (1.8, 1.0, 1.0), (215, 190, 100, 255)),
        ):
            ray.draw_cube(place, *sides, colour)
            ray.draw_cube_wires(place, *sides, (40, 40, 40, 255))
        ray.draw_sphere((np.sin(self.time) - 0.5, 0.9, np.cos(self.time) - 1.2), 0.9, (110, 180, 110, 255))
        ray.end_mode_3d()
        # raylib gathers what is drawn; now all of it is in the frame.
        ray.rl_draw_render_batch_active()
        for call in list(self.calls):
            call()
        ray.end_texture_mode()
        ray.end_drawing()

    def _matrix(self, matrix: Any) -> Any:
        return np.array([[getattr(matrix, f"m{row + 4 * column}") for column in range(4)] for row in range(4)])

    def picture(self) -> Picture:
        image = self.ray.load_image_from_texture(self.target.texture)
        rows = np.frombuffer(self.ray.ffi.buffer(image.data, image.width * image.height * 4), np.uint8)
        made = rows.reshape(image.height, image.width, 4)[::-1, :, :3].copy()
        self.ray.unload_image(image)
        return made

    def attach(self, effect: Callable[..., Any], isolation: Any = "auto", **values: Any) -> Attachment:
        made = Attachment(
            "raylib", effect, values, frame=lambda host: host.framebuffer(self.target.id),
            engine_camera=lambda: View.of_matrices(*self.seen_by), isolation=isolation,
        )  # fmt: skip
        made.on_close(self.hook_in(made.draw))
        return made

    def hook_in(self, call: Callable[[], object]) -> Callable[[], object]:
        self.calls.append(call)
        return lambda: self.calls.remove(call)

    def resize(self, size: tuple[int, int]) -> None:
        self.ray.unload_render_texture(self.target)
        self.target = self.ray.load_render_texture(*size)

    def close(self) -> None:
        self.ray.close_window()


if __name__ == "__main__":
    show(Scene)
