"""Original Shadertoy passes on OpenGL, as the site runs them: what effects are held against.

Buffers hold float32 and are read linearly, clamped, unless a channel says otherwise; a pass reads what the buffers
before it have just drawn, and of itself and the others what they drew last.  Rows count from the bottom.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray
from textures import smooth

Picture = NDArray[np.float32]
Size = tuple[int, int]

_VERTEX = "#version 430\nin vec2 host_corner; void main() { gl_Position = vec4(host_corner, 0.0, 1.0); }"
_HEAD = """#version 430
out vec4 host_color;
uniform vec3 iResolution;
uniform float iTime, iTimeDelta, iFrameRate;
uniform int iFrame;
uniform vec4 iMouse, iDate;
uniform vec3 iChannelResolution[4];
uniform sampler2D iChannel0, iChannel1, iChannel2, iChannel3;
"""
_TAIL = "\nvoid main() { host_color = vec4(0.0); mainImage(host_color, gl_FragCoord.xy); }"


@dataclass(frozen=True)
class Drawn:
    """A pass: its name, its text, and by channel the buffer or picture that it reads."""

    name: str
    text: str
    channels: Mapping[int, str] = field(default_factory=dict)


class Original:
    """Passes in the order in which they are drawn, the picture last; buffers are kept from frame to frame.

    ``pictures`` come from outside, as large as the output and with row 0 on top.
    """

    def __init__(
        self, context: moderngl.Context, passes: Sequence[Drawn], common: str, size: Size,
        pictures: Mapping[str, Picture] = {},
    ) -> None:  # fmt: skip
        self.context, self.passes, self.size = context, passes, size
        context.__enter__()  # whichever is current, this one stays so
        corners = np.array([-1, -1, 1, -1, -1, 1, 1, 1], np.float32)
        quad = context.buffer(corners.tobytes())
        self.arrays = []
        for one in passes:
            text = _HEAD + common + "\n" + one.text + _TAIL
            program = context.program(vertex_shader=_VERTEX, fragment_shader=text)
            self.arrays.append(context.vertex_array(program, [(quad, "2f", "host_corner")]))
        empty = np.zeros((size[1], size[0], 4), np.float32)
        self.held = {one.name: self._texture(empty) for one in passes}
        self.held |= {name: self._texture(picture) for name, picture in pictures.items()}

    def _texture(self, picture: Picture) -> moderngl.Texture:
        return smooth(self.context.texture(self.size, 4, np.ascontiguousarray(picture[::-1]).tobytes(), dtype="f4"))

    def frame(self, number: int, seconds: float, step: float, mouse: tuple[float, ...]) -> Picture:
        """The picture of a frame, row 0 on top."""
        told: dict[str, Any] = {
            "iResolution": (*self.size, 1.0), "iTime": seconds, "iTimeDelta": step, "iFrameRate": 1 / step,
            "iFrame": number, "iMouse": mouse, "iChannelResolution": [(*self.size, 1.0)] * 4,
        }  # fmt: skip
        for one, array in zip(self.passes, self.arrays, strict=True):
            target = smooth(self.context.texture(self.size, 4, dtype="f4"))
            program: Any = array.program
            for channel, name in one.channels.items():
                if f"iChannel{channel}" in program:
                    self.held[name].use(channel)
                    program[f"iChannel{channel}"].value = channel
            for name, value in told.items():
                if name in program:
                    uniform = program[name]
                    is_one = name == "iChannelResolution" and uniform.array_length == 1
                    uniform.value = value[0] if is_one else value
            self.context.framebuffer([target]).use()
            array.render(moderngl.TRIANGLE_STRIP)
            self.held[one.name].release()
            self.held[one.name] = target
        shown = np.frombuffer(self.held[self.passes[-1].name].read(), np.float32)
        return shown.reshape(self.size[1], self.size[0], 4)[::-1].copy()
