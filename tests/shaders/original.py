"""Original shaders on OpenGL, through moderngl: what kernels made of them are held against."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from tests.offscreen import offscreen

Picture = NDArray[np.float32]

_QUAD = "#version 330\nin vec2 corner; void main() { gl_Position = vec4(corner, 0.0, 1.0); }"
#: What GLSL 3.30 calls otherwise, and the two values that preludes may use here.
HEAD = """#version 330
#extension GL_ARB_texture_gather : enable
#define texture2D texture
#define gl_FragColor shown_color
out vec4 shown_color;
uniform vec2 pg_output_size;
#define pg_position (gl_FragCoord.xy / pg_output_size)
"""
#: By whether there are smaller levels, and whether the nearest texel is taken: how to read smaller, and larger.
_FILTERS = {
    (False, False): (moderngl.LINEAR, moderngl.LINEAR),
    (False, True): (moderngl.NEAREST, moderngl.NEAREST),
    (True, False): (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR),
    (True, True): (moderngl.NEAREST_MIPMAP_NEAREST, moderngl.NEAREST),
}


class Original:
    """An OpenGL context that runs fragment shaders over a whole picture."""

    def __init__(self, context: moderngl.Context) -> None:
        self.context = context
        self.corners = context.buffer(np.array([-1, -1, 3, -1, -1, 3], np.float32).tobytes())
        #: The last one, with its text and the names of its values, which each run sets anew.
        self._kept: tuple[tuple[str, ...], moderngl.Program] | None = None

    def _program(self, text: str, names: Iterable[str]) -> moderngl.Program:
        """The program of a text: long ones take seconds, and are run with one set of values after another."""
        key = (text, *sorted(names))
        if self._kept is None or self._kept[0] != key:
            if self._kept is not None:
                self._kept[1].release()
            self._kept = (key, self.context.program(vertex_shader=_QUAD, fragment_shader=text))
        return self._kept[1]

    def run(
        self, text: str, size: tuple[int, int], pictures: Mapping[str, Picture], values: Mapping[str, Any],
        head: str = HEAD, *, levels: bool = False, nearest: bool = False, repeat: bool = False,
    ) -> Picture:  # fmt: skip
        """The picture (h, w, 4) that a shader draws, row 0 on top, as pictures are given; ``levels``, with mip maps."""
        context = self.context
        context.__enter__()  # whichever is current, this one stays so
        program = self._program(head + text, [*values, *pictures])
        textures = []
        for unit, (name, picture) in enumerate(pictures.items()):
            height, width = picture.shape[:2]
            texture = context.texture((width, height), 4, np.ascontiguousarray(picture[::-1]).tobytes(), dtype="f4")
            if levels:
                texture.build_mipmaps()
            texture.filter = _FILTERS[levels, nearest]
            texture.repeat_x = texture.repeat_y = repeat
            texture.use(unit)
            textures.append(texture)
            if name in program:
                program[name].value = unit  # type: ignore[union-attr]
        for name, value in {**values, "pg_output_size": tuple(map(float, size))}.items():
            if name in program:
                program[name].value = value  # type: ignore[union-attr]
        target = context.texture(size, 4, dtype="f4")
        frame = context.framebuffer([target])
        frame.use()
        frame.clear()
        quad = context.vertex_array(program, [(self.corners, "2f", "corner")])
        quad.render(moderngl.TRIANGLES)
        found = np.frombuffer(frame.read(components=4, dtype="f4"), np.float32).reshape(size[1], size[0], 4)
        for owned in (quad, frame, target, *textures):
            owned.release()
        return found[::-1].copy()


@contextmanager
def original() -> Iterator[Original]:
    """A context, for as long as it is needed."""
    with offscreen() as context:
        yield Original(context)
