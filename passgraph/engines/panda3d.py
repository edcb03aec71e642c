"""Run effects in Panda3D, and in engines built on it, such as Ursina, by a display region drawn after all others."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from threading import get_ident
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.engines.attachment import Attachment, Effect, Seen, View, imported
from passgraph.errors import InputError
from passgraph.hosts.gl import Host, HostFramebuffer, Isolation

#: Sort of the effect's display region; those of scenes and of the 2D overlay are below 1000.
SORT = 1_000_000


def attach(
    output: Any, effect: Effect, *, camera: object = None, isolation: Isolation = "auto", sort: int | None = None,
    **values: object,
) -> Attachment:  # fmt: skip
    """Run an effect on every frame of a window, a buffer or a display region.

    Parameters
    ----------
    output : ``base.win``, another ``GraphicsOutput``, or a ``DisplayRegion``, such as one view of a split screen
    effect, camera, isolation, values : see `passgraph.engines.attachment.Attachment`; the default camera is that of
        the display region, or of the output's first active one with a camera, perspective or orthographic
    sort : the effect runs on the drawing of display regions with a lower sort; 5 keeps ShowBase's 2D overlay above it.
        By default all of them; for an effect that takes depth, those before the first that clears it, as the overlay
        does

    Filters (``FilterManager``, ``CommonFilters``, simplepbr) draw the scene into a buffer, and show it on a card
    without depth. An effect that takes depth then runs on that buffer, before the filters. Attach it after the filters
    are set up, and again if they create new buffers.

    ``close`` in another thread than the drawing one leaves removing the display region, by then inactive, to the next
    step of Panda3D's tasks.

    Raises
    ------
    InputError, GraphError, KernelError
        Raised by the effect when its graph is built.

    >>> from direct.showbase.ShowBase import ShowBase                        # doctest: +SKIP
    >>> base = ShowBase()                                                    # doctest: +SKIP
    >>> from passgraph.engines import panda3d                                # doctest: +SKIP
    >>> attached = panda3d.attach(base.win, black_and_white)                 # doctest: +SKIP
    """
    core = imported("panda3d.core", "panda3d")
    seen = Seen()

    def view() -> View | None:
        display_region = next(_views(regions()), None)
        if display_region is None:
            return None
        region, node, lens = display_region
        if part is None and _pixels(output, region) != _pixels(output, None):
            raise InputError(
                "panda3d: the view that the effect takes its camera from fills only a part of the output, as in a "
                "split screen; attach the effect to each of its display regions in place of the output"
            )
        return seen.by(*matrices(core, node, lens))

    def regions() -> list[Any]:
        return list(output.get_active_display_regions()) if part is None else [part]

    def frame(host: Host) -> HostFramebuffer:
        if attachment.takes_depth and _filtered(output, regions()) is not None:
            raise InputError(
                "panda3d: the effect takes depth, and filters draw the scene into another buffer since it was "
                "attached; close this attachment and attach the effect again, behind the filters"
            )
        # Drivers report windows as sRGB-encoded for which Panda3D does not encode colors.
        return host.framebuffer(region=_pixels(output, part), srgb=output.get_fb_properties().get_srgb_color())

    attachment = Attachment(
        "panda3d", effect, values, frame=frame, camera=camera, engine_camera=view, isolation=isolation
    )
    part = None
    if isinstance(output, core.DisplayRegion):
        output, part = output.window, output
    while attachment.takes_depth and (scene := _filtered(output, regions())) is not None:
        output, part = scene, None
    region = output.make_display_region()
    region.sort = _last(output, attachment.takes_depth, part) if sort is None else sort
    drawing_thread: int | None = get_ident()

    def draw(data: Any) -> None:
        nonlocal drawing_thread
        drawing_thread = None  # closing it here would remove the region while it is drawn
        attachment.draw(data)
        drawing_thread = get_ident()

    def take_out(*_: object) -> None:
        region.clear_draw_callback()
        output.remove_display_region(region)

    def detach() -> None:
        if drawing_thread == get_ident():
            take_out()
        else:  # Panda3D iterates over its display regions while drawing; its tasks run between frames
            core.AsyncTaskManager.get_global_ptr().add(core.PythonTask(take_out, "passgraph: detach an effect"))

    region.set_draw_callback(core.PythonCallbackObject(draw))
    attachment.on_close(detach)
    return attachment


def _views(regions: Iterable[Any]) -> Iterator[tuple[Any, Any, Any]]:
    """Yield the display regions with an active camera, with the camera and its lens."""
    for region in regions:
        camera = region.camera
        if not camera.is_empty() and camera.node().is_active():
            lens = camera.node().get_lens(region.get_lens_index())
            if lens is not None:
                yield region, camera, lens


def _filtered(output: Any, regions: list[Any]) -> Any:
    """Return the buffer of the scene if the first view shows it on a card, as filters do; else None."""
    camera = next((camera for _, camera, _ in _views(regions)), None)
    if camera is None or not camera.has_parent():
        return None
    texture = camera.get_parent().get_texture()
    if texture is None:
        return None
    for other in output.engine.get_windows():
        before = other.is_active() and other.sort < output.sort
        if before and any(other.get_texture(k) == texture for k in range(other.count_textures())):
            return other
    return None


def _pixels(output: Any, part: Any) -> tuple[int, int, int, int]:
    """Return the rectangle of an output or display region in its texture, which may be larger: Panda3D pads textures to
    powers of two."""
    width, height = output.get_fb_x_size(), output.get_fb_y_size()
    if part is None:
        return 0, 0, width, height
    left, right = (int(0.5 + side * width) for side in (part.get_left(), part.get_right()))
    bottom, top = (int(0.5 + side * height) for side in (part.get_bottom(), part.get_top()))
    return left, bottom, right - left, top - bottom


def _last(output: Any, takes_depth: bool, part: Any = None) -> int:
    """Return the sort after all display regions, or before the first that clears the depth of others."""
    sorts = [(region.sort, region.get_clear_depth_active()) for region in output.get_active_display_regions()]
    first = min((sort for sort, _ in sorts), default=0) if part is None else part.sort
    clearing = [sort for sort, clears in sorts if clears and sort > first]
    return min(clearing) - 1 if takes_depth and clearing else SORT


def matrices(core: Any, camera: Any, lens: Any) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return OpenGL's view and projection of a camera's node path and one of its lenses.

    World coordinates are Panda3D's, with z negated for left-handed worlds, such as Ursina's. Panda3D multiplies row
    vectors, and its cameras look along +y in a world with z up.
    """
    turn = core.LMatrix4.convert_mat(lens.coordinate_system, core.CS_yup_right)
    world = camera.get_top().get_mat(camera)
    back = core.LMatrix4.convert_mat(core.CS_yup_right, lens.coordinate_system)
    view = _columns(world * turn)
    if np.linalg.det(view[:3, :3]) < 0.0:
        view = view @ np.diag([1.0, 1.0, -1.0, 1.0])
    return view, _columns(back * lens.get_projection_mat())


def _columns(matrix: Any) -> NDArray[np.float64]:
    return np.array([[matrix.get_cell(row, column) for row in range(4)] for column in range(4)])
