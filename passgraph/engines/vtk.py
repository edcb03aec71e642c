"""Run effects in VTK and in libraries built on it, such as PyVista, after a renderer has drawn its actors."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.engines.attachment import Attachment, Effect, Seen, View
from passgraph.hosts.gl import Host, HostFramebuffer, Isolation

#: VTK averages samples as colors to this power (``vtkOpenGLRenderWindow``, its resolve shader).
SAMPLE_GAMMA = 2.2


def attach(
    renderer: Any, effect: Effect, *, camera: object = None, isolation: Isolation = "auto", **values: object
) -> Attachment:
    """Run an effect on every frame of a renderer, in its part of the window.

    Parameters
    ----------
    renderer : a ``vtkRenderer``, or an object with one as ``.renderer``, such as a PyVista plotter
    effect, camera, isolation, values : see `passgraph.engines.attachment.Attachment`; the default camera is the
        renderer's active one

    Renders for picking, whose colors are numbers of actors, are unchanged. Screenshots larger than the window
    (``screenshot(scale=2)``) are drawn in tiles; the effect runs on each tile, and reads nothing beyond its borders.

    Raises
    ------
    InputError, GraphError, KernelError
        Raised by the effect when its graph is built.

    >>> plotter = pyvista.Plotter(off_screen=True)                           # doctest: +SKIP
    >>> attached = passgraph.engines.vtk.attach(plotter, black_and_white)    # doctest: +SKIP
    """
    renderer = getattr(renderer, "renderer", renderer)
    seen = Seen()

    def view() -> View:
        return seen.by(*matrices(renderer))

    def frame(host: Host) -> HostFramebuffer | None:
        if renderer.GetSelector() is not None:
            return None
        region = _region(renderer)
        return host.framebuffer(region=region, sample_gamma=SAMPLE_GAMMA) if region[2] and region[3] else None

    attachment = Attachment("vtk", effect, values, frame=frame, camera=camera, engine_camera=view, isolation=isolation)
    tag = renderer.AddObserver("EndEvent", attachment.draw)
    attachment.on_close(lambda: renderer.RemoveObserver(tag))
    return attachment


def _region(renderer: Any) -> tuple[int, int, int, int]:
    """Return the renderer's part (x, y, width, height) of what is drawn now: the window, or one tile of a larger
    screenshot, which may have none of it."""
    width, height, x, y = out = [[0], [0], [0], [0]]
    renderer.GetTiledSizeAndOrigin(*out)
    return x[0], y[0], width[0], height[0]


def matrices(renderer: Any) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return OpenGL's view and projection of a renderer's active camera."""
    camera = renderer.GetActiveCamera()
    projection = camera.GetProjectionTransformMatrix(renderer.GetTiledAspectRatio(), -1.0, 1.0)
    return _rows(camera.GetViewTransformMatrix()), _rows(projection)


def _rows(matrix: Any) -> NDArray[np.float64]:
    return np.array([[matrix.GetElement(row, column) for column in range(4)] for row in range(4)])
