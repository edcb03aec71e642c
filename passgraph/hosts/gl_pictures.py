"""An engine's textures, renderbuffers and framebuffers as pictures that passes read and write."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass, replace

from passgraph.backends.gl import gl_functions as g
from passgraph.backends.gl.capabilities import Capabilities
from passgraph.backends.gl.gl_functions import Functions
from passgraph.backends.gl.textures import (
    DEPTH_OF_WINDOW,
    WINDOW_BUFFERS,
    Surface,
    attachment_points,
    bind_surface,
    gl_format_of,
    in_words,
    unbind_surface,
)
from passgraph.errors import BackendError, InputError
from passgraph.formats import Format, colour_format, curved, float_format

_TYPE, _NAME, _LEVEL, _FACE, _LAYER = 0x8CD0, 0x8CD1, 0x8CD2, 0x8CD3, 0x8CD4
_TEXTURE, _RENDERBUFFER = 0x1702, 0x8D41
_COMPONENTS, _DEPTH_SIZE = (0x8212, 0x8213, 0x8214, 0x8215), 0x8216
_COMPONENT_TYPE, _ENCODING, _SRGB = 0x8211, 0x8210, 0x8C40
_UNORM, _FLOAT, _INTEGERS = 0x8C17, 0x1406, (0x1404, 0x1405)
_DRAW_BUFFER, _DRAW_BINDING, _HAS_ALL_LAYERS = 0x8825, 0x8CA6, 0x8DA7
_WITH_LAYERS = {0x8C1A: "an array", 0x806F: "a volume", 0x8513: "a cube map"}
_TEXTURE_TARGET, _RECTANGLE, _STENCIL_MODE = 0x1006, 0x84F5, 0x90EA
#: Texture parameters that change what a sampler returns → their values for unchanged texels.
_UNCHANGED = {0x8E42: 0x1903, 0x8E43: 0x1904, 0x8E44: 0x1905, 0x8E45: 0x1906, _STENCIL_MODE: 0x1902}
_RENDERBUFFER_FACTS = {"width": 0x8D42, "height": 0x8D43, "internal": 0x8D44, "samples": 0x8CAB}
_TEXTURE_FACTS = {"width": 0x1000, "height": 0x1001, "internal": 0x1003, "samples": 0x9106}
#: Internal formats without the number of bits: those of a window's buffers, and base formats.
_UNSIZED = {0, 1, 2, 3, 4, *range(0x1901, 0x190B), 0x8C40, 0x8C42, 0x84F9, 0x80E1, 0x93A1}
_RGBA8, _SRGB_ALPHA8 = 0x8058, 0x8C43
#: Sized internal formats for copies of these, by bits a channel.
_SIZED: dict[tuple[int, ...], int] = {
    (5, 6, 5, 0): 0x8D62,
    (10, 10, 10, 2): 0x8059,
    (5, 5, 5, 1): 0x8057,
    (4, 4, 4, 4): 0x8056,
}
_SIZED_DEPTHS = {(16, 0): 0x81A5, (24, 0): 0x81A6, (24, 8): 0x88F0, (32, 0): 0x81A7, (32, 8): 0x8CAD}


class EmptyPictureError(BackendError):
    """A picture of the host has no pixels at the moment."""


class RegionError(InputError):
    """A region exceeds the host's picture at the moment."""


@dataclass(frozen=True)
class Facts:
    """The properties of a surface of the host.

    Attributes
    ----------
    reported : its width, height, internal format and samples, as OpenGL reports them
    format : the format as which kernels read it
    internal : the internal format of a texture with the same numbers
    stored : the description of its storage
    stores_srgb : True if its internal format is sRGB-encoded
    bound_as, level_target, base : of a texture: its binding target, the target for queries of its levels, its base
        level
    is_changed : True if sampling returns other numbers than it holds: swizzled channels, or stencil for depth
    """

    surface: Surface
    reported: tuple[int, int, int, int]
    format: Format
    internal: int
    stored: str
    is_depth: bool
    stores_srgb: bool = False
    bound_as: int = g.TEXTURE_2D
    level_target: int = g.TEXTURE_2D
    base: int = 0
    is_changed: bool = False

    @property
    def size(self) -> tuple[int, int]:
        """(width, height) of the surface in pixels."""
        return self.reported[:2]

    @property
    def samples(self) -> int:
        """Samples a pixel; 0 without multisampling."""
        return self.reported[3]


def texture_surface(gl: Functions, name: int) -> Surface:
    """Return the surface of a texture by its name; changes the binding of unit 0.

    Raises
    ------
    BackendError
        If the texture does not exist, or is of a kind that passes cannot use.
    """
    if not gl.IsTexture(name):
        raise BackendError(
            f"gl: there is no texture {name} in the host's context; give the name that OpenGL has for it, of a texture "
            "that has been bound once and was not deleted"
        )
    gl.ActiveTexture(g.TEXTURE0)
    for target in _targets_of(gl, name):
        gl.drain()
        gl.BindTexture(target, name)
        if gl.GetError() == g.NO_ERROR:
            base = gl.texture_parameter(target, 0x813C, 0)
            gl.BindTexture(target, 0)
            gl.drain()
            return Surface("texture", name, target, base)
    raise BackendError(
        f"gl: texture {name} is of a kind that no pass reads or writes; give one of two dimensions, with one "
        "sample or several, a rectangle, or a framebuffer with one picture of an array, a volume or a cube map"
    )


def texture_targets(has: Capabilities) -> list[int]:
    """Return the texture targets that passes can read in a context, the commonest first."""
    kinds = {_RECTANGLE: not has.is_es, g.TEXTURE_2D_MULTISAMPLE: has.has_sampled_textures}
    return [g.TEXTURE_2D, *(target for target in g.OTHER_TEXTURES if kinds.get(target, True))]


def _targets_of(gl: Functions, name: int) -> list[int]:
    """Return the possible targets of a texture: only one if OpenGL reports it (4.5) or would not report an error."""
    known = texture_targets(gl.has)
    if gl.GetTextureParameteriv is None or gl.has.is_compatible:  # Mesa reports it in core contexts only
        return known if gl.has.has_errors else known[:1]
    target = ctypes.c_int(0)
    gl.GetTextureParameteriv(name, _TEXTURE_TARGET, ctypes.byref(target))
    return [target.value] if target.value in known else []


def attached(gl: Functions, depth: bool) -> Surface | None:
    """Return the attachment of the draw framebuffer's first draw buffer, or of its depth; None if there is none.

    It only queries state, so it may be called in the host's own context.
    """
    buffer = gl.integer(_DRAW_BUFFER)
    if gl.integer(_DRAW_BINDING) == 0:
        if depth:
            has_depth = gl.attachment(DEPTH_OF_WINDOW, _TYPE)
            return Surface("window", buffer=DEPTH_OF_WINDOW) if has_depth else None
        return Surface("window", buffer=buffer) if buffer in WINDOW_BUFFERS else None
    point = g.DEPTH_ATTACHMENT if depth else buffer
    if not point:
        return None
    kind = gl.attachment(point, _TYPE)
    if kind == _RENDERBUFFER:
        return Surface("renderbuffer", gl.attachment(point, _NAME))
    if kind != _TEXTURE:
        return None
    name, level = gl.attachment(point, _NAME), gl.attachment(point, _LEVEL)
    if gl.has.has_layers and gl.attachment(point, _HAS_ALL_LAYERS):
        raise BackendError(
            f"gl: the framebuffer draws into all layers of texture {name} at once; give one that a single layer is "
            "attached to"
        )
    face, layer = gl.attachment(point, _FACE), gl.attachment(point, _LAYER)
    return Surface("texture", name, face or g.TEXTURE_2D, level, layer)


def facts_of(gl: Functions, surface: Surface, scratch: int, size: tuple[int, int] | None) -> Facts:
    """Return the facts of a surface. ``scratch`` is a framebuffer of ours to attach it to, ``size`` the caller's
    information.

    Raises
    ------
    EmptyPictureError
        If it has no pixels.
    BackendError
        If it was deleted, if kernels cannot read it (integers, stencil), and if neither OpenGL nor the caller reports
        its size.
    """
    texture, level_target, is_changed = surface, g.TEXTURE_2D, False
    if surface.kind == "texture":
        texture = texture_surface(gl, surface.name)
        if not surface.target:  # known by name alone
            if texture.target in _WITH_LAYERS:
                raise BackendError(
                    f"gl: texture {surface.name} is {_WITH_LAYERS[texture.target]}; give a framebuffer that one of its "
                    "pictures is attached to"
                )
            surface = texture
        is_face = surface.target in range(0x8515, 0x851B)
        surface = replace(surface, target=surface.target if is_face else texture.target)
        level_target = surface.target
        level_facts = _of_level(gl, surface, texture.target, level_target) or _facts_by_host(surface, size)
        is_changed = _is_changed(gl, surface, texture.target)
    elif surface.kind == "renderbuffer":
        if not gl.IsRenderbuffer(surface.name):
            raise BackendError(f"gl: there is no renderbuffer {surface.name} in the host's context")
        level_facts = _of_renderbuffer(gl, surface)
    else:
        level_facts = _facts_by_host(surface, size)
    if not all(_size(level_facts)):
        raise EmptyPictureError(
            f"gl: {in_words(surface)} has no pixels, as of a window that is minimised, or of a texture that was not "
            "filled; leave such a frame out"
        )
    facts = _with_components(gl, surface, scratch, level_facts)
    return replace(facts, bound_as=texture.target, level_target=level_target, base=texture.level, is_changed=is_changed)


def told_now(gl: Functions, facts: Facts) -> tuple[int, int, int, int] | None:
    """Return `Facts.reported` of a texture or renderbuffer now, as far as OpenGL reports it; None if it was deleted."""
    surface = facts.surface
    is_texture = surface.kind == "texture"
    if not (gl.IsTexture if is_texture else gl.IsRenderbuffer)(surface.name):
        return None
    if not is_texture:
        return _all_told(_of_renderbuffer(gl, surface))
    gl.ActiveTexture(g.TEXTURE0)
    level_facts = _of_level(gl, surface, facts.bound_as, facts.level_target)
    return _all_told(level_facts) if level_facts else facts.reported


def _of_level(gl: Functions, surface: Surface, bound_as: int, level_target: int) -> dict[str, int]:
    """Query a texture's level on the active unit; empty in OpenGL ES 3.0."""
    if gl.GetTexLevelParameteriv is None:
        return {}
    gl.BindTexture(bound_as, surface.name)
    level_facts = {k: gl.level(level_target, surface.level, what) for k, what in _TEXTURE_FACTS.items()}
    gl.BindTexture(bound_as, 0)
    return level_facts


def _is_changed(gl: Functions, surface: Surface, bound_as: int) -> bool:
    gl.ActiveTexture(g.TEXTURE0)
    gl.BindTexture(bound_as, surface.name)
    expected = {k: v for k, v in _UNCHANGED.items() if k != _STENCIL_MODE or gl.has.has_stencil_textures}
    changed = any(
        gl.texture_parameter(bound_as, what, expected_value) != expected_value
        for what, expected_value in expected.items()
    )
    gl.BindTexture(bound_as, 0)
    return changed


def _of_renderbuffer(gl: Functions, surface: Surface) -> dict[str, int]:
    gl.BindRenderbuffer(g.RENDERBUFFER, surface.name)
    level_facts = {k: gl.renderbuffer(what) for k, what in _RENDERBUFFER_FACTS.items()}
    gl.BindRenderbuffer(g.RENDERBUFFER, 0)
    return level_facts


def _facts_by_host(surface: Surface, size: tuple[int, int] | None) -> dict[str, int]:
    """Return facts that OpenGL does not report: for framebuffer 0, and for textures in OpenGL ES 3.0."""
    if size is None:
        raise BackendError(f"gl: the size of {in_words(surface)} is not known; give it as size=(width, height)")
    return {"width": size[0], "height": size[1], "internal": 0, "samples": 0}


def _with_components(gl: Functions, surface: Surface, scratch: int, level_facts: dict[str, int]) -> Facts:
    depth_point, colour_point = points = attachment_points(gl, surface)
    bind_surface(gl, g.FRAMEBUFFER, scratch, surface, points)
    gl.drain()  # one of the two attachment points is an error
    components: tuple[int, ...] = tuple([gl.attachment(colour_point, what) for what in _COMPONENTS])
    depth = 0 if any(components) else gl.attachment(depth_point, _DEPTH_SIZE)
    if surface.kind == "window":
        level_facts["samples"] = gl.integer(0x80A9)
    if depth:
        internal = level_facts["internal"]
        if internal in _UNSIZED:
            stencil = gl.attachment(0x1802, 0x8217) if surface.kind == "window" else 8 * (internal == 0x84F9)
            internal = _SIZED_DEPTHS.get((depth, stencil), 0x81A6)
        facts = Facts(surface, _all_told(level_facts), float_format(1), internal, f"depth of {depth} bits", True)
        unbind_surface(gl, g.FRAMEBUFFER, surface, points)
        return facts
    kind = gl.attachment(colour_point, _COMPONENT_TYPE)
    srgb = gl.attachment(colour_point, _ENCODING) == _SRGB and components[0] == 8
    unbind_surface(gl, g.FRAMEBUFFER, surface, points)
    stored = f"{'/'.join(map(str, components))} bits{' float' if kind == _FLOAT else ''}{' sRGB' if srgb else ''}"
    if not any(components):
        raise BackendError(f"gl: {in_words(surface)} holds no colours and no depth, so that no kernel reads it")
    if kind in _INTEGERS:
        raise BackendError(f"gl: {in_words(surface)} holds whole numbers ({stored}), which no kernel reads")
    format_ = _format(components, kind, srgb)
    internal = level_facts["internal"]
    if internal in _UNSIZED:
        internal = _sized(components, format_, gl.has.is_es and srgb)
    return Facts(surface, _all_told(level_facts), format_, internal, stored, False, srgb)


def _sized(components: tuple[int, ...], format_: Format, encoded: bool) -> int:
    """Return the internal format of a copy of a surface of unknown format. ``encoded``: sRGB too; OpenGL ES converts
    copies between sRGB and other formats."""
    if encoded:
        return _SRGB_ALPHA8
    if format_.number != "f4" or components[0] == 32:
        return gl_format_of(format_).internal
    return _SIZED.get(components, _RGBA8)


def _size(level_facts: dict[str, int]) -> tuple[int, int]:
    return level_facts["width"], level_facts["height"]


def _all_told(level_facts: dict[str, int]) -> tuple[int, int, int, int]:
    return *_size(level_facts), level_facts["internal"], level_facts["samples"]


def _format(components: tuple[int, ...], kind: int, srgb: bool) -> Format:
    """Return the format with the same numbers; float32 for others, such as 5 or 10 bits a channel."""
    channels = sum(1 for bits in components if bits) if components[0] else 4
    alike = len({bits for bits in components if bits}) == 1
    number = {(_UNORM, 8): "u1", (_UNORM, 16): "u2", (_FLOAT, 16): "f2"}.get((kind, components[0])) if alike else None
    exact = colour_format(number, channels) if number else None
    return (exact and srgb and curved(exact, True)) or exact or float_format(channels)
