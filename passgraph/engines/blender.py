"""Run effects in Blender, on views that scripts and add-ons draw off screen."""

from __future__ import annotations

from typing import Any

import numpy as np

from passgraph.engines.attachment import Attachment, Effect, Seen, View
from passgraph.engines.hooks import check_has
from passgraph.hosts.gl import Host, HostFramebuffer, Isolation


class ViewAttachment(Attachment):
    """An effect on a ``GPUOffScreen``; Blender has no callback after it is drawn, so this class draws it."""

    def __init__(
        self, offscreen: Any, effect: Effect, camera: object, isolation: Isolation, values: dict[str, object]
    ) -> None:
        check_has(offscreen, "blender", "a gpu.types.GPUOffScreen", "draw_view3d", "bind", "width")
        self.offscreen = offscreen
        self._seen = Seen()
        self._matrices: tuple[Any, Any] | None = None
        super().__init__(
            "blender", effect, values, frame=self._bound, camera=camera, engine_camera=self._saw, isolation=isolation
        )

    def draw_view3d(
        self, scene: Any, view_layer: Any, view3d: Any, region: Any, view_matrix: Any, projection_matrix: Any,
        **options: Any,
    ) -> None:  # fmt: skip
        """Replace ``offscreen.draw_view3d``, with the same arguments; the effect gets the camera of both matrices."""
        self.offscreen.draw_view3d(scene, view_layer, view3d, region, view_matrix, projection_matrix, **options)
        self._matrices = np.array(view_matrix, np.float64), np.array(projection_matrix, np.float64)
        self.draw()

    def draw(self, *_: object) -> None:
        """Run the effect on a buffer drawn in another way, such as with ``gpu.shader`` and ``gpu_extras``."""
        with self.offscreen.bind():
            super().draw()

    def _bound(self, host: Host) -> HostFramebuffer:
        return host.framebuffer(region=(0, 0, self.offscreen.width, self.offscreen.height), srgb=False)

    def _saw(self) -> View | None:
        return None if self._matrices is None else self._seen.by(*self._matrices)


def attach(
    offscreen: Any, effect: Effect, *, camera: object = None, isolation: Isolation = "auto", **values: object
) -> ViewAttachment:
    """Run an effect on an off-screen buffer that the attachment's ``draw_view3d`` draws.

    Parameters
    ----------
    offscreen : a ``gpu.types.GPUOffScreen``; Blender must be set to draw with OpenGL
    effect, camera, isolation, values : see `passgraph.engines.attachment.Attachment`; the default camera is that of
        the latest matrices of ``draw_view3d``

    Raises
    ------
    InputError, GraphError, KernelError
        Raised by the effect when its graph is built.

    >>> attached = attach(offscreen, black_and_white)                        # doctest: +SKIP
    >>> attached.draw_view3d(scene, view_layer, space, region, view, projection)    # doctest: +SKIP
    """
    return ViewAttachment(offscreen, effect, camera, isolation, dict(values))
