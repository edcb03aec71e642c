"""Run effects in VTK and in libraries built on it, such as PyVista, after a renderer has drawn its actors."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph import arguments
from passgraph.engines.attachment import Attachment, Effect, Seen, View, imported
from passgraph.errors import InputError
from passgraph.hosts.gl import Host, HostFramebuffer, Isolation
from passgraph.hosts.gl_pictures import RegionError
from passgraph.plan.window import is_pointwise

#: VTK averages samples as colors to this power (``vtkOpenGLRenderWindow``, its resolve shader).
SAMPLE_GAMMA = 2.2


def attach(
    renderer: Any, effect: Effect, *, camera: object = None, isolation: Isolation = "auto", **values: object
) -> RendererAttachment:
    """Run an effect on every frame of a renderer, in its part of the window.

    Parameters
    ----------
    renderer : a ``vtkRenderer``, or an object with one as ``.renderer``, such as a PyVista plotter
    effect, camera, isolation, values : see `passgraph.engines.attachment.Attachment`; the default camera is the
        renderer's active one

    Renders for picking, whose colors are numbers of actors, are unchanged. VTK draws a screenshot larger than the
    window (``plotter.screenshot(scale=2)``) in tiles. An effect that reads beyond its pixel would leave seams there, so
    tiles stay without it, with a warning in the log "passgraph.engines"; use `RendererAttachment.screenshot` instead.

    Raises
    ------
    InputError, GraphError, KernelError
        Raised by the effect when its graph is built.

    >>> plotter = pyvista.Plotter(off_screen=True)                           # doctest: +SKIP
    >>> attached = passgraph.engines.vtk.attach(plotter, black_and_white)    # doctest: +SKIP
    """
    renderer = getattr(renderer, "renderer", renderer)
    attachment = RendererAttachment(renderer, effect, values, camera, isolation)
    tag = renderer.AddObserver("EndEvent", attachment.draw)
    attachment.on_close(lambda: renderer.RemoveObserver(tag))
    return attachment


class RendererAttachment(Attachment):
    """An effect in a VTK renderer."""

    def __init__(
        self, renderer: Any, effect: Effect, values: dict[str, object], camera: object, isolation: Isolation
    ) -> None:
        self.renderer = renderer
        seen = Seen()

        def view() -> View:
            return seen.by(*matrices(renderer))

        def frame(host: Host) -> HostFramebuffer | None:
            if renderer.GetSelector() is not None:
                return None
            region = _region(renderer)
            return host.framebuffer(region=region, sample_gamma=SAMPLE_GAMMA) if region[2] and region[3] else None

        super().__init__("vtk", effect, values, frame=frame, camera=camera, engine_camera=view, isolation=isolation)

    def screenshot(self, scale: int = 2) -> NDArray[np.uint8]:
        """Return the window's picture, drawn at a multiple of its size with the effects of all its renderers.

        The picture is that of a window so large. Lines, points and lengths in pixels keep their number of pixels.
        History of an effect begins anew at that size.

        Parameters
        ----------
        scale : the factor of width and height, 1 to 16

        Returns
        -------
        array
            (height, width, 3) uint8, row 0 on top, as from PyVista's ``plotter.screenshot()``.

        Raises
        ------
        InputError
            If the device draws no picture so large.
        """
        vtk = imported("vtk", "vtk")
        factor = arguments.whole_number(scale, "vtk: scale", 1, 16, InputError)
        window = self.renderer.GetRenderWindow()
        if self._host is None:
            window.Render()
        window.MakeCurrent()
        (width, height), most = window.GetSize(), self._opened_host().limits.side
        if max(width, height) * factor > most:
            raise InputError(
                f"vtk: this device draws at most {most} pixels a side, got {width * factor}x{height * factor}; take a "
                "smaller scale"
            )
        off_screen = window.GetUseOffScreenBuffers()
        try:
            # A window's own buffers are not larger than the screen.
            window.SetUseOffScreenBuffers(True)
            window.SetSize(width * factor, height * factor)
            window.Render()
            read = vtk.vtkWindowToImageFilter()
            read.SetInput(window)
            read.ShouldRerenderOff()
            read.ReadFrontBufferOff()
            read.Update()
            picture = read.GetOutput()
            numbers = np.asarray(picture.GetPointData().GetScalars(), np.uint8)
        finally:
            window.SetUseOffScreenBuffers(off_screen)
            window.SetSize(width, height)
            window.Render()
        return np.ascontiguousarray(numbers.reshape(height * factor, width * factor, -1)[::-1])

    def _draw(self) -> None:
        if tuple(self.renderer.GetRenderWindow().GetTileScale()) != (1, 1):
            current = self._current_frame()
            if current is not None and not is_pointwise(self._program_for(current[2]).plan):
                raise RegionError(
                    "this screenshot is drawn in tiles, and the effect reads beyond its pixel, which would leave "
                    "seams; take it with .screenshot(scale=2) of what attach returned"
                )
        super()._draw()


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
