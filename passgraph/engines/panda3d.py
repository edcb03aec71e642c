"""Effects in Panda3D, and in what is built on it, such as Ursina: a display region behind all others runs them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.gl import Host, HostFramebuffer
from passgraph.backends.gl.host import Isolation
from passgraph.engines.attachment import Attachment, Effect, Seen, View, imported

#: Display regions are drawn in this order; those of scenes and of the 2D overlay are below 1000.
SORT = 1_000_000


def attach(
    output: Any, effect: Effect, *, camera: object = None, isolation: Isolation = "auto", sort: int | None = None,
    **values: object,
) -> Attachment:  # fmt: skip
    """An effect on every frame of a window or buffer.

    Parameters
    ----------
    output : ``base.win``, or another ``GraphicsOutput``
    effect, camera, isolation, values : see `passgraph.engines.attachment.Attachment`; left out, the camera is that of
        the output's first active display region that has one in perspective or orthographic
    sort : the effect changes what display regions of lower sort have drawn; 5 leaves ShowBase's 2D overlay above it.
        Left out, all; of an effect that takes depth, those before the first that clears it, as that overlay does

    Raises
    ------
    InputError, GraphError, KernelError
        What the effect raises when its graph is made.

    >>> from direct.showbase.ShowBase import ShowBase                        # doctest: +SKIP
    >>> base = ShowBase()                                                    # doctest: +SKIP
    >>> from passgraph.engines import panda3d                                # doctest: +SKIP
    >>> attached = panda3d.attach(base.win, black_and_white)                 # doctest: +SKIP
    """
    core = imported("panda3d.core", "panda3d")
    seen = Seen()

    def view() -> View | None:
        for region in output.get_active_display_regions():
            node = region.camera
            if not node.is_empty() and node.node().is_active() and node.node().get_lens() is not None:
                return seen.by(*matrices(core, node))
        return None

    def frame(host: Host) -> HostFramebuffer:
        # What is bound may be larger: Panda3D pads textures to powers of two.  Drivers call windows encoded by sRGB
        # that Panda3D does not encode for.
        region = (0, 0, output.get_fb_x_size(), output.get_fb_y_size())
        return host.framebuffer(region=region, srgb=output.get_fb_properties().get_srgb_color())

    made = Attachment("panda3d", effect, values, frame=frame, camera=camera, engine_camera=view, isolation=isolation)
    region = output.make_display_region()
    region.sort = _last(output, made.takes_depth) if sort is None else sort
    region.set_draw_callback(core.PythonCallbackObject(made.draw))

    def take_out() -> None:
        region.clear_draw_callback()
        output.remove_display_region(region)

    made.on_close(take_out)
    return made


def _last(output: Any, takes_depth: bool) -> int:
    """Behind all display regions, or before the first that clears the depth of others."""
    sorts = [(region.sort, region.get_clear_depth_active()) for region in output.get_active_display_regions()]
    first = min((sort for sort, _ in sorts), default=0)
    clearing = [sort for sort, clears in sorts if clears and sort > first]
    return min(clearing) - 1 if takes_depth and clearing else SORT


def matrices(core: Any, camera: Any) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """View and projection of a camera's node path as OpenGL has them; world coordinates stay Panda3D's, but for z of
    left-handed worlds, such as Ursina's, which is negated.

    Panda3D multiplies row vectors, and its cameras look along +y in a world with z up.
    """
    lens = camera.node().get_lens()
    turn = core.LMatrix4.convert_mat(lens.coordinate_system, core.CS_yup_right)
    world = camera.get_top().get_mat(camera)
    back = core.LMatrix4.convert_mat(core.CS_yup_right, lens.coordinate_system)
    view = _columns(world * turn)
    if np.linalg.det(view[:3, :3]) < 0.0:
        view = view @ np.diag([1.0, 1.0, -1.0, 1.0])
    return view, _columns(back * lens.get_projection_mat())


def _columns(matrix: Any) -> NDArray[np.float64]:
    return np.array([[matrix.get_cell(row, column) for row in range(4)] for column in range(4)])
