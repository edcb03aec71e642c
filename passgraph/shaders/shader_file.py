"""Load a shader file of any supported format as an effect."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from passgraph import arguments
from passgraph.errors import InputError
from passgraph.shaders import NOT_READ, SUFFIXES
from passgraph.shaders.containers.effect import ShaderEffect, shader_text
from passgraph.shaders.containers.isf import is_isf, read_isf
from passgraph.shaders.containers.libretro import is_libretro, is_preset, read_libretro_preset, read_libretro_shader
from passgraph.shaders.containers.mpv import is_mpv, read_mpv
from passgraph.shaders.containers.plain import read_plain
from passgraph.shaders.containers.shadertoy import is_shadertoy, is_shadertoy_export, read_export, read_shadertoy
from passgraph.shaders.containers.transition import is_transition, read_transition

#: Predicates of formats, with their readers; the first that matches is used.
FORMATS: tuple[tuple[Callable[[str], bool], Callable[[str, Path], ShaderEffect]], ...] = (
    (is_shadertoy_export, read_export),
    (is_libretro, read_libretro_shader),
    (is_preset, read_libretro_preset),
    (is_isf, read_isf),
    (is_mpv, read_mpv),
    (is_transition, read_transition),
    (is_shadertoy, read_shadertoy),
)


def load_shader(path: str | os.PathLike[str]) -> ShaderEffect:
    """Load a shader file as an effect: ISF, a gl-transition, a Shadertoy shader or its export, an mpv user shader, a
    libretro preset or shader, or a plain fragment shader in GLSL.

    Text is parsed and never executed.

    Parameters
    ----------
    path : the file; included and imported files must be in its folder

    Returns
    -------
    ShaderEffect
        The effect, to be called with pictures and parameters; its attributes list them.

    Raises
    ------
    InputError
        For a file that cannot be read, and an invalid header.
    KernelError
        For an unsupported shader, with file, line and caret.

    Examples
    --------
    >>> import tempfile, pathlib
    >>> import passgraph as pg
    >>> file = pathlib.Path(tempfile.mkdtemp()) / "fade.glsl"
    >>> _ = file.write_text("vec4 transition(vec2 uv) { return mix(getFromColor(uv), getToColor(uv), progress); }")
    >>> fade = pg.load_shader(file)
    >>> fade.kind, fade.images, list(fade.parameters)
    ('gl-transition', ('from', 'to'), ['progress'])
    >>> import numpy as np
    >>> black, white = (np.full((2, 2, 4), v, np.float32) for v in (0.0, 1.0))
    >>> made = fade(pg.Input("a"), pg.Input("b"), progress=0.25)
    >>> float(pg.compile(made)(a=black, b=white)["fade"][0, 0, 0])
    0.25
    """
    file = arguments.path(path, "the path of a shader")
    if file.suffix.lower() in NOT_READ:
        what, instead = NOT_READ[file.suffix.lower()]
        raise InputError(f"{file}: is {what}; expected a fragment shader in GLSL ({' '.join(SUFFIXES)}); {instead}")
    text = shader_text(file, "a shader")
    if "\0" in text:
        raise InputError(f"{file}: is no text")
    return next((read for fits, read in FORMATS if fits(text)), read_plain)(text, file)
