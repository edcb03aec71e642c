"""Effects in pygfx: they run as an effect pass, when a renderer flushes its frame."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from passgraph.engines.attachment import Attachment, Effect, Seen, View, imported
from passgraph.engines.hooks import check_has, hook
from passgraph.hosts.webgpu import Host, HostFramebuffer, HostPicture

#: Stands for the frame as it is where an effect is left out or has failed.
_COPY = """
    @fragment
    fn fs_main(varyings: Varyings) -> @location(0) vec4<f32> {
        return textureLoad(colorTex, vec2i(varyings.position.xy), 0);
    }
"""


def attach(renderer: Any, effect: Effect, *, camera: object = None, **values: object) -> Attachment:
    """Run an effect on every frame of a renderer, after its own effect passes.

    Parameters
    ----------
    renderer : a ``pygfx.WgpuRenderer``; fastplotlib's figures have one as ``.renderer``
    effect, camera, values : see `passgraph.engines.attachment.Attachment`; left out, the camera is the one of the last
        ``renderer.render(scene, camera)``

    The effect runs on the renderer's own texture, which is larger than the canvas where ``pixel_scale`` is more than 1.
    Colors are stored there in 8 bits by the sRGB curve, and the effect gets them as in other engines: as they are
    stored, or linear where it says that it takes linear light.

    Raises
    ------
    InputError, GraphError, KernelError
        What the effect raises when its graph is made.

    >>> renderer = pygfx.WgpuRenderer(canvas)                                # doctest: +SKIP
    >>> attached = passgraph.engines.pygfx.attach(renderer, black_and_white)    # doctest: +SKIP
    """
    gfx = imported("pygfx", "pygfx")
    renderer = getattr(renderer, "renderer", renderer)
    check_has(renderer, "pygfx", "a pygfx.WgpuRenderer", "effect_passes", "device", "render")
    attachment = _Attachment(renderer, effect, values, camera)
    attached = _pass_of(gfx, attachment)
    renderer.effect_passes = (*renderer.effect_passes, attached)

    def detach() -> None:
        renderer.effect_passes = tuple(step for step in renderer.effect_passes if step is not attached)

    attachment.on_close(detach)
    attachment.on_close(hook(renderer, "render", before=lambda: None, when=attachment.seen_by))
    return attachment


class _Attachment(Attachment):
    """An effect between two textures of a renderer."""

    def __init__(self, renderer: Any, effect: Effect, values: dict[str, object], camera: object) -> None:
        self.renderer, self.seen, self.drawn_by = renderer, Seen(zero_to_one=True), None
        #: Of the pass that runs: color, depth and destination; of none, what the renderer has.
        self.textures: tuple[Any, Any, Any] | None = None
        super().__init__("pygfx", effect, values, frame=self._frame_of, camera=camera, engine_camera=self._view_of)

    def seen_by(self, scene: Any, camera: Any, *_: object, **__: object) -> bool:
        """Remember the camera of the frame."""
        self.drawn_by = camera
        return False

    def _view_of(self) -> View | None:
        camera: Any = self.drawn_by
        return None if camera is None else self.seen.by(camera.view_matrix, camera.projection_matrix)

    def _open_host(self) -> Host:
        return Host(self.renderer.device)

    def _frame_of(self, host: Any) -> Any:
        blender = self.renderer._blender
        color, depth, _ = self.textures or (blender.get_texture("color"), blender.get_texture("depth"), None)
        if color is None:
            return None
        return HostFramebuffer(host.texture(color, srgb=False), None if depth is None else host.texture(depth))

    def _destination(self, frame: HostPicture) -> HostPicture:
        assert self.textures is not None
        return replace(frame.host.texture(self.textures[2]), format=frame.format)

    def record(self, encoder: Any, textures: tuple[Any, Any, Any]) -> bool:
        """Run the effect between textures; return False if it was skipped and they are unchanged."""
        with self._running:
            self.textures, self.ran = textures, False
            try:
                with self._opened_host().recording(encoder):
                    self.draw()
            finally:
                self.textures = None
            return self.ran

    def _draw(self) -> None:
        super()._draw()
        self.ran = True


def _pass_of(gfx: Any, attachment: _Attachment) -> Any:
    """Return a pygfx effect pass that runs an attachment."""

    class PassgraphPass(gfx.renderers.wgpu.EffectPass):  # type: ignore[misc]
        USES_DEPTH = True
        wgsl = _COPY

        @property
        def enabled(self) -> bool:
            return attachment.enabled

        def render(self, command_encoder: Any, color_tex: Any, depth_tex: Any, target_tex: Any) -> None:
            if not attachment.record(command_encoder, (color_tex, depth_tex, target_tex)):
                super().render(command_encoder, color_tex, depth_tex, target_tex)

    return PassgraphPass()
