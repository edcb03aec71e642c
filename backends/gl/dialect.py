"""The GLSL version of a context: shader headers."""

from __future__ import annotations

from passgraph.backends.gl.capabilities import Capabilities
from passgraph.records import dataclass

_FULLSCREEN = """void main()
{
    gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0);
}
"""
#: OpenGL ES computes floats, ints and texture reads in 16 bits by default.
_PRECISIONS = "precision highp float;\nprecision highp int;\nprecision highp sampler2D;"

_PRECISE = "#define PRECISE precise\n#define FMA fma"
_NOT_PRECISE = "#define PRECISE\n#define FMA(a, b, c) ((a) * (b) + (c))"


@dataclass(frozen=True)
class Dialect:
    """A version of GLSL.

    Attributes
    ----------
    version : the ``#version`` line
    rest : extensions, precisions, ``PRECISE``, with which drivers keep the order of float arithmetic, and ``FMA``
    is_precise : True if ``PRECISE`` may have an effect
    """

    version: str
    rest: str
    is_precise: bool = True

    @property
    def header(self) -> str:
        return f"{self.version}\n{self.rest}"

    @property
    def fullscreen(self) -> str:
        """Return a vertex shader: one triangle that covers the viewport."""
        return f"{self.version}\n{_FULLSCREEN}"

    @property
    def no_colour(self) -> str:
        """Return the fragment shader of a draw that writes depth and stencil only."""
        return f"{self.version}\nvoid main()\n{{\n}}\n"


#: For desktop OpenGL, where ``precise`` comes through an extension.
GLSL_330 = Dialect(
    "#version 330 core",
    f"""#ifdef GL_ARB_gpu_shader5
#extension GL_ARB_gpu_shader5 : enable
{_PRECISE}
#else
{_NOT_PRECISE}
#endif""",
)


def dialect_of(has: Capabilities) -> Dialect:
    """Return the GLSL version of a context: for OpenGL ES the newest, since ``precise`` came late.

    >>> dialect_of(Capabilities(True, (3, 2), frozenset())).version
    '#version 320 es'
    >>> dialect_of(Capabilities(True, (3, 1), frozenset({"GL_OES_gpu_shader5"}))).rest.splitlines()[:2]
    ['#extension GL_OES_gpu_shader5 : enable', '#define PRECISE precise']
    >>> dialect_of(Capabilities(True, (3, 0), frozenset())).rest.splitlines()[0]
    '#define PRECISE'
    """
    if not has.is_es:
        return GLSL_330
    if has.version >= (3, 2):
        return Dialect("#version 320 es", f"{_PRECISE}\n{_PRECISIONS}")
    found = [name for name in ("GL_EXT_gpu_shader5", "GL_OES_gpu_shader5") if name in has.extensions]
    if has.version >= (3, 1) and found:
        enabled = f"#extension {found[0]} : enable\n{_PRECISE}"
        return Dialect("#version 310 es", f"{enabled}\n{_PRECISIONS}")
    return Dialect("#version 300 es", f"{_NOT_PRECISE}\n{_PRECISIONS}", is_precise=False)
