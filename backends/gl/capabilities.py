"""Capabilities of a context: OpenGL version, extensions, limits. Queried once, when its functions are loaded."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import field, replace
from typing import Any

from passgraph.errors import DeviceMissingError
from passgraph.plan.limits import NONE
from passgraph.records import dataclass

Version = tuple[int, int]
_VERSION, _EXTENSIONS, _EXTENSION_COUNT = 0x1F02, 0x1F03, 0x821D
_RENDERER, _FRAGMENT_BUFFERS = 0x1F01, 0x90DA
_PROFILE, _COMPATIBLE_BIT, _FLAGS, _NO_ERROR_BIT, _CLIP_DISTANCES = 0x9126, 2, 0x821E, 8, 0x0D32
#: The oldest versions of OpenGL and OpenGL ES with everything that passes need.
OLDEST_DESKTOP, OLDEST_ES = (3, 3), (3, 0)


@dataclass(frozen=True)
class Where:
    """The versions and extensions that provide a function or state.

    Attributes
    ----------
    desktop, es : the first version of OpenGL, and of OpenGL ES, that has it; None if none does
    extensions : extensions that provide it, and the suffix of its function names there
    """

    desktop: Version | None = None
    es: Version | None = None
    extensions: Mapping[str, str] = field(default_factory=dict)


_EVERYWHERE, _DESKTOP = Where((3, 3), (3, 0)), Where((3, 3))
FRAMEBUFFER_SRGB, _ALPHA_TEST, _CLIP_DISTANCE = 0x8DB9, 0x0BC0, 0x3000
_CLIPPING = Where((3, 3), None, {"GL_EXT_clip_cull_distance": "", "GL_APPLE_clip_distance": ""})
#: Always switched off: state that a host program may have left on and that would change pictures.
OFF = {
    0x0C11: _EVERYWHERE,  # scissor test
    0x864F: Where((3, 3), None, {"GL_EXT_depth_clamp": ""}),
    0x8C89: _EVERYWHERE,  # rasterizer discard
    FRAMEBUFFER_SRGB: Where((3, 3), None, {"GL_EXT_sRGB_write_control": ""}),
    0x0BD0: _EVERYWHERE,  # dithering
    0x0BF2: _DESKTOP,  # logic operation
    0x0B41: _DESKTOP,  # smoothing of polygons
    0x0B20: _DESKTOP,  # smoothing of lines, without which drivers offset polygons differently
    0x809E: _EVERYWHERE,
    0x80A0: _EVERYWHERE,  # sample alpha to coverage, sample coverage
    0x8E51: Where((3, 3), (3, 1)),  # sample mask
}
#: Never switched on in our own contexts.
NEVER_OURS = {
    0x8F9D: _DESKTOP,  # primitive restart
    0x8D69: Where((4, 3), (3, 0), {"GL_ARB_ES3_compatibility": ""}),  # the same by a fixed index
    0x809F: Where((3, 3), None, {"GL_EXT_multisample_compatibility": ""}),  # alpha to one
    0x8C36: Where((4, 0), (3, 2), {"GL_ARB_sample_shading": "", "GL_OES_sample_shading": ""}),  # sampled shading
    0x92E0: Where((4, 3), (3, 2), {"GL_KHR_debug": ""}),  # messages to the host's debug callback
}


@dataclass(frozen=True)
class Capabilities:
    """The capabilities of one context.

    Attributes
    ----------
    is_es : OpenGL ES, else desktop OpenGL
    version : (major, minor)
    extensions : names, such as "GL_EXT_texture_norm16"
    off, never_ours : the entries of :data:`OFF` and :data:`NEVER_OURS` that this context has
    is_compatible : True for the compatibility profile
    has_errors : True if it reports wrong calls; without (KHR_no_error) they are undefined behavior
    """

    is_es: bool
    version: Version
    extensions: frozenset[str]
    off: tuple[int, ...] = tuple(OFF)
    never_ours: tuple[int, ...] = ()
    is_compatible: bool = False
    has_errors: bool = True

    def ending(self, where: Where) -> str | None:
        """Return the suffix of function names here (such as "EXT"); None if the functions are missing.

        >>> indexed = Where((3, 0), (3, 2), {"GL_OES_draw_buffers_indexed": "OES"})
        >>> old = Capabilities(True, (3, 1), frozenset({"GL_OES_draw_buffers_indexed"}))
        >>> old.ending(indexed), Capabilities(True, (3, 2), frozenset()).ending(indexed)
        ('OES', '')
        """
        first = where.es if self.is_es else where.desktop
        if first is not None and self.version >= first:
            return ""
        return next((ending for name, ending in where.extensions.items() if name in self.extensions), None)

    def has(self, where: Where) -> bool:
        return self.ending(where) is not None

    @property
    def always_encodes(self) -> bool:
        """Return True if writes into sRGB pictures are always encoded by the device, whatever the setting."""
        return FRAMEBUFFER_SRGB not in self.off

    @property
    def has_buffers(self) -> bool:
        """Return True if shaders can write buffers."""
        return self.has(_BUFFERS)

    @property
    def has_layers(self) -> bool:
        """Return True if a framebuffer can draw into all layers of a texture at once."""
        return self.version >= (3, 2)

    @property
    def has_stencil_textures(self) -> bool:
        """Return True if depth-stencil textures can be sampled as stencil."""
        return self.has(_STENCIL_TEXTURING)

    @property
    def has_sampled_textures(self) -> bool:
        """Return True if textures may be multisampled."""
        return self.has(_SEVERAL_SAMPLES)

    @property
    def skips_decoding(self) -> bool:
        """Return True if the stored numbers of an sRGB texture can be read without decoding."""
        return "GL_EXT_texture_sRGB_decode" in self.extensions

    def not_kept(self) -> dict[str, str]:
        """Map the channel types (`Format.number`) that no texture can store to the missing feature.

        >>> Capabilities(True, (3, 0), frozenset()).not_kept()
        {'u2': 'GL_EXT_texture_norm16'}
        """
        return {} if self.has(_SHORTS) else {"u2": "GL_EXT_texture_norm16"}

    def not_drawn(self) -> dict[str, str]:
        """Map the channel types that no pass can write to the missing feature."""
        missing = self.not_kept()
        if not self.has(_HALVES):
            missing["f2"] = "GL_EXT_color_buffer_half_float"
        if not self.has(_FLOATS):
            missing["f4"] = "GL_EXT_color_buffer_float"
        return missing

    def filtered(self, rules: Iterable[str]) -> tuple[str, ...]:
        """Return the border rules under which samplers filter float32, out of those that they have somewhere.

        >>> Capabilities(True, (3, 1), frozenset({"GL_OES_texture_float_linear"})).filtered(["clamp", "zero"])
        ('clamp',)
        """
        if not self.has(_FLOAT_FILTERING):
            return ()
        return tuple([rule for rule in rules if rule != "zero" or self.has(_BORDER_COLORS)])

    def blends(self, number: str) -> bool:
        """Return True if draws can blend into channels of this type."""
        return number != "f4" or self.has(_FLOAT_BLENDING)


_SHORTS = Where((3, 3), None, {"GL_EXT_texture_norm16": ""})
_HALVES = Where((3, 3), (3, 2), {"GL_EXT_color_buffer_float": "", "GL_EXT_color_buffer_half_float": ""})
_FLOATS = Where((3, 3), (3, 2), {"GL_EXT_color_buffer_float": ""})
_BUFFERS = Where((4, 3), (3, 1), {"GL_ARB_shader_storage_buffer_object": ""})
_CONTEXT_FLAGS = Where((3, 3), (3, 2))
_STENCIL_TEXTURING = Where((4, 3), (3, 1), {"GL_ARB_stencil_texturing": ""})
_SEVERAL_SAMPLES = Where((3, 3), (3, 1))
_FLOAT_FILTERING = Where((3, 3), None, {"GL_OES_texture_float_linear": ""})
_BORDER_COLORS = Where((3, 3), (3, 2), {"GL_EXT_texture_border_clamp": "", "GL_OES_texture_border_clamp": ""})
_FLOAT_BLENDING = Where((3, 3), None, {"GL_EXT_float_blend": ""})


def count_group(gl: Any) -> int:
    """Return the best number of compute invocations to count a row together; 0 if the current context has no compute
    shaders whose results fragment shaders can read."""
    lacks = gl.DispatchCompute is None or gl.MemoryBarrier is None or not gl.has.has_buffers
    if lacks or gl.integer(_FRAGMENT_BUFFERS) < 1:
        return 0
    return 16 if on_processor(gl.text(_RENDERER)) else 256


def capabilities_of(gl: Any) -> Capabilities:
    """Query the current context; ``gl`` has ``GetString``, ``GetStringi``, ``integer``.

    It queries only what this version has: the context may be an engine's, which would see the errors.

    Raises
    ------
    DeviceMissingError
        If it is older than passes need.
    """
    text = (gl.GetString(_VERSION) or b"").decode(errors="replace")
    is_es, version = version_of(text)
    extensions = frozenset(
        (gl.GetStringi(_EXTENSIONS, k) or b"").decode(errors="replace") for k in range(gl.integer(_EXTENSION_COUNT))
    )

    bare = Capabilities(is_es, version, extensions)
    off, never_ours = ([switch for switch, where in table.items() if bare.has(where)] for table in (OFF, NEVER_OURS))
    distances = gl.integer(_CLIP_DISTANCES) if bare.has(_CLIPPING) else 0
    is_compatible = not is_es and bool(gl.integer(_PROFILE) & _COMPATIBLE_BIT)
    return replace(
        bare,
        off=(*off, *range(_CLIP_DISTANCE, _CLIP_DISTANCE + distances)),
        never_ours=(*never_ours, *([_ALPHA_TEST] if is_compatible else [])),
        is_compatible=is_compatible,
        has_errors=not (bare.has(_CONTEXT_FLAGS) and gl.integer(_FLAGS) & _NO_ERROR_BIT),
    )


def loop_trips(renderer: str) -> int:
    """Return the most loop iterations per pixel on a device: Mesa's CPU rasterizer leaves loops after that many,
    without an error (LP_MAX_TGSI_LOOP_ITERATIONS in gallivm/lp_bld_limits.h).

    >>> loop_trips("llvmpipe (LLVM 15.0.6, 256 bits)"), loop_trips("NVIDIA H200") > 1 << 40
    (65535, True)
    """
    return 65_535 if on_processor(renderer) else NONE


def on_processor(renderer: str) -> bool:
    """Return True for Mesa's rasterizers on the CPU."""
    return any(name in renderer for name in ("llvmpipe", "softpipe"))  # ANGLE names the device below it


def version_of(text: str) -> tuple[bool, Version]:
    """Return True for OpenGL ES, and the version, from the text of ``GL_VERSION``.

    Raises
    ------
    DeviceMissingError
        If it is older than passes need.

    >>> version_of("OpenGL ES 3.2 Mesa 22.3.6"), version_of("4.5 (Core Profile) Mesa 22.3.6")
    ((True, (3, 2)), (False, (4, 5)))
    """
    is_es = text.startswith("OpenGL ES")
    match = re.search(r"(\d+)\.(\d+)", text)
    version = (int(match[1]), int(match[2])) if match else (0, 0)
    if version < (OLDEST_ES if is_es else OLDEST_DESKTOP):
        raise DeviceMissingError(
            f"gl: the context is of {'' if is_es else 'OpenGL '}{text or 'an unknown version'}; passgraph needs OpenGL "
            "3.3 or OpenGL ES 3.0; request a newer one when creating the window or the context"
        )
    return is_es, version
