"""Chains of original libretro shaders on OpenGL, as a player draws them: what effects are held against.

Both halves go to the driver as they are.  Row 0 of pictures is row 0 of textures: shaders count rows from the top.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

Picture = NDArray[np.float32]
Size = tuple[int, int]

_STRIP = np.array([[0, 0, 0, 1], [1, 0, 0, 1], [0, 1, 0, 1], [1, 1, 0, 1]], np.float32)
_MATRIX = (2, 0, 0, 0, 0, 2, 0, 0, 0, 0, -1, 0, -1, -1, 0, 1)
#: Some shaders declare FragColor, and write gl_FragColor all the same, as older versions of GLSL call it.
_HEAD = "#version 330\n#define PARAMETER_UNIFORM\n#define gl_FragColor FragColor\n#define "
_SRGB8_ALPHA8, _FRAMEBUFFER_SRGB, _BORDER = 0x8C43, 0x8DB9, (0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Drawn:
    """One pass: its text, its size, and how the picture that it starts from is read."""

    text: str
    size: Size
    linear: bool = False
    wrap: str = "zero"
    format: str = "rgba8"
    mipmaps: bool = False


@dataclass
class Chain:
    """Passes with the pictures that they keep from frame to frame."""

    context: moderngl.Context
    passes: Sequence[Drawn]
    textures: Mapping[str, tuple[Picture, bool, str, bool]] = field(default_factory=dict)
    feedback: int | None = None
    values: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.strip = self.context.buffer(_STRIP.tobytes())
        self.programs = [
            self.context.program(_HEAD + "VERTEX\n" + text, fragment_shader=_HEAD + "FRAGMENT\n" + text)
            for text in (re.sub(r"^\s*#version.*$", "", one.text, flags=re.MULTILINE) for one in self.passes)
        ]
        self.held = {name: self.texture(*told) for name, told in self.textures.items()}
        self.frames: list[moderngl.Texture] = []
        self.fed: moderngl.Texture | None = None

    def texture(self, picture: Picture, linear: bool, wrap: str, mipmaps: bool = False) -> moderngl.Texture:
        size = (picture.shape[1], picture.shape[0])
        made = self.context.texture(size, 4, np.ascontiguousarray(picture).tobytes(), dtype="f4")
        return self.read_as(made, linear, wrap, mipmaps)

    def read_as(self, texture: moderngl.Texture, linear: bool, wrap: str, mipmaps: bool = False) -> moderngl.Texture:
        texture.filter = (moderngl.LINEAR, moderngl.LINEAR) if linear else (moderngl.NEAREST, moderngl.NEAREST)
        if mipmaps:
            texture.build_mipmaps()
            smaller = moderngl.LINEAR_MIPMAP_LINEAR if linear else moderngl.NEAREST_MIPMAP_NEAREST
            texture.filter = (smaller, texture.filter[1])
        if wrap == "zero":
            sampler = self.context.sampler(border_color=_BORDER, filter=texture.filter)
            texture.extra = sampler
        texture.repeat_x = texture.repeat_y = wrap == "repeat"
        return texture

    def frame(self, picture: Picture, number: int) -> Picture:
        """What the last pass draws for one more frame."""
        first = self.passes[0]
        black = np.zeros_like(picture)
        while len(self.frames) < 8:
            self.frames.append(self.texture(black, first.linear, first.wrap, first.mipmaps))
        self.frames = [self.texture(picture, first.linear, first.wrap, first.mipmaps), *self.frames[:7]]
        made = [self.frames[0]]
        for at, (one, program) in enumerate(zip(self.passes, self.programs, strict=True), 1):
            reader = self.passes[at] if at < len(self.passes) else Drawn("", (1, 1))
            last = at == len(self.passes)
            target = self.target(one, last)
            named = {"Orig": made[0], "": made[-1], f"PassPrev{at}": made[0], "Prev": self.frames[1]}
            named |= {f"Prev{i}": self.frames[i + 1] for i in range(1, 7)}
            for i in range(1, at):
                named |= {f"Pass{i}": made[i], f"PassPrev{at - i}": made[i]}
            if self.feedback is not None:
                again = self.passes[self.feedback]
                named["Feedback"] = self.fed or self.texture(
                    np.zeros((*again.size[::-1], 4), np.float32), False, "zero"
                )
            self.draw(one, program, named, target, number)
            made.append(self.read_as(target, reader.linear, reader.wrap, reader.mipmaps))
        if self.feedback is not None:
            self.fed = made[self.feedback + 1]
        size = self.passes[-1].size
        return np.frombuffer(made[-1].read(), np.float32).reshape(size[1], size[0], 4).copy()

    def target(self, one: Drawn, last: bool) -> moderngl.Texture:
        if last or one.format == "rgba32f":
            return self.context.texture(one.size, 4, dtype="f4")
        if one.format == "rgba8_srgb":
            return self.context.texture(one.size, 4, dtype="f1", internal_format=_SRGB8_ALPHA8)
        return self.context.texture(one.size, 4, dtype="f1")

    def draw(
        self, one: Drawn, program: Any, named: Mapping[str, moderngl.Texture], target: moderngl.Texture, number: int
    ) -> None:
        pictures = {f"{name}Texture": texture for name, texture in named.items()} | self.held
        first = pictures.pop("Texture")  # on the first unit, which samplers read that nobody sets
        read = [("Texture", first), *((name, texture) for name, texture in pictures.items() if name in program)]
        for unit, (name, texture) in enumerate(read):
            self.context.clear_samplers(unit, unit + 1)
            texture.use(unit)
            if texture.extra is not None:
                texture.extra.use(unit)
            if name in program:
                program[name].value = unit
        values: dict[str, Any] = {
            **self.values, "MVPMatrix": _MATRIX, "OutputSize": one.size, "FrameDirection": 1, "FrameCount": number,
        }  # fmt: skip
        for name, texture in named.items():
            values |= {f"{name}TextureSize": texture.size, f"{name}InputSize": texture.size}
        for name, value in values.items():
            if name in program:
                program[name].value = value
        frame = self.context.framebuffer([target])
        frame.use()
        frame.clear()
        (self.context.enable_direct if one.format == "rgba8_srgb" else self.context.disable_direct)(_FRAMEBUFFER_SRGB)
        inputs = [name for name in program if isinstance(program[name], moderngl.Attribute)]
        white = self.context.buffer(np.ones((4, 4), np.float32).tobytes())
        content = [
            (white if name == "COLOR" else self.strip, _layout(program[name].dimension), name) for name in inputs
        ]
        quad = self.context.vertex_array(program, content)
        quad.render(moderngl.TRIANGLE_STRIP)


def _layout(dimension: int) -> str:
    """Four floats a corner, of which an attribute takes so many."""
    return f"{dimension}f {16 - 4 * dimension}x" if dimension < 4 else "4f"
