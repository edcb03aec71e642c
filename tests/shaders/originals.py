"""Shader files as their hosts run them: the original GLSL on OpenGL.

What a file says (header, sizes, defaults) is read here by code of its own: nothing is shared with what is tested.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
from defined import definitions
from numpy.typing import NDArray
from textures import places, smooth

Picture = NDArray[np.float32]
Size = tuple[int, int]

#: GLSL 4.20, which converts ints as old drivers did, with the words of older versions; the quad is that of ISF hosts.
_COMMON = "#version 420\n#define texture2D texture\n"
_QUAD = _COMMON + "in vec2 host_corner;\n"
_PLACED = "gl_Position = vec4(host_corner * 2.0 - 1.0, 0.0, 1.0);"
_TRANSITION_VERTEX = f"{_QUAD}out vec2 host_uv; void main() {{ {_PLACED} host_uv = host_corner; }}"
#: Interpolation and division leave a last bit to the driver, on which comparisons with the middle of a picture hang.
_CENTRES = "uniform sampler2D host_places;\n#define {} (texelFetch(host_places, ivec2(gl_FragCoord.xy), 0).xy)\n"
_TRANSITION = """
out vec4 host_color;
uniform sampler2D host_from, host_to;
uniform float progress, ratio;
vec4 getFromColor(vec2 uv) { return texture(host_from, uv); }
vec4 getToColor(vec2 uv) { return texture(host_to, uv); }
"""
_ISF = """
uniform int PASSINDEX, FRAMEINDEX;
uniform float TIME, TIMEDELTA;
uniform vec2 RENDERSIZE;
uniform vec4 DATE;
#define IMG_SIZE(i) _ ## i ## _imgRect.zw
#define IMG_NORM_PIXEL(i, at) texture(i, at)
#define IMG_PIXEL(i, at) texture(i, (at) / IMG_SIZE(i))
#define IMG_THIS_NORM_PIXEL(i) texture(i, isf_FragNormCoord)
#define IMG_THIS_PIXEL(i) texture(i, isf_FragNormCoord)
"""
_ISF_VERTEX = f"#define varying out\nout vec2 isf_FragNormCoord;\nvoid isf_vertShaderInit() {{ {_PLACED}\n"
_ISF_VERTEX += "isf_FragNormCoord = host_corner; }\n"
_ISF_FRAGMENT = "#define varying in\n#define gl_FragColor host_color\nout vec4 host_color;\n"
_TYPES = {"float": "float", "bool": "bool", "event": "bool", "long": "int", "point2d": "vec2", "color": "vec4"}


@dataclass(frozen=True)
class Clock:
    """When a frame is shown: seconds at frame 0 and from frame to frame, and DATE."""

    time: float = 1.25
    step: float = 1 / 32
    date: tuple[float, float, float, float] = (2024.0, 5.0, 17.0, 36000.5)


@dataclass(frozen=True)
class Pass:
    """One draw: into a buffer by name (none for the picture), of that many pixels."""

    target: str
    size: Size
    is_float: bool
    persistent: bool


@dataclass(frozen=True)
class Asked:
    """A parameter as its file declares it."""

    type: str
    default: Any
    low: Any = None
    high: Any = None
    values: tuple[int, ...] = ()


class IsfFile:
    """What an ISF file says."""

    def __init__(self, path: Path) -> None:
        self.path, self.text = path, path.read_text(encoding="utf-8", errors="replace")
        self.header = json.loads(self.text.partition("/*")[2].partition("*/")[0], strict=False)
        inputs = self.header.get("INPUTS", [])
        self.images = [one["NAME"] for one in inputs if one["TYPE"].lower() not in _TYPES]
        self.parameters = {one["NAME"]: _asked(one) for one in inputs if one["TYPE"].lower() in _TYPES}
        said = self.header.get("IMPORTED", {})
        self.imported = {name: path.parent / one["PATH"] for name, one in said.items()}
        vertex = path.with_suffix(".vs")
        self.vertex = vertex.read_text() if vertex.exists() else "void main() { isf_vertShaderInit(); }"

    @property
    def persistent(self) -> bool:
        return any(_flag(one.get("PERSISTENT")) for one in self.header.get("PASSES", []))

    def passes(self, size: Size, values: Mapping[str, Any]) -> list[Pass]:
        names = {**values, "WIDTH": size[0], "HEIGHT": size[1]}
        made = []
        for one in self.header.get("PASSES") or [{}]:
            sides = (_side(one.get(key, f"${key}"), names) for key in ("WIDTH", "HEIGHT"))
            width, height = sides
            flags = _flag(one.get("FLOAT")), _flag(one.get("PERSISTENT"))
            made.append(Pass(one.get("TARGET", ""), (width, height), *flags))
        return made

    def sources(self, exact: bool) -> tuple[str, str]:
        """Vertex and fragment shader as OpenGL takes them; ``exact``: places are computed, not interpolated."""
        moved = "gl_Position" in self.vertex  # then places are what the vertex shader hands on
        place = _CENTRES.format("isf_FragNormCoord") if exact and not moved else "in vec2 isf_FragNormCoord;\n"
        buffers = [one["TARGET"] for one in self.header.get("PASSES", []) if one.get("TARGET")]
        names = dict.fromkeys([*self.images, *self.imported, *buffers])
        declared = "".join(f"uniform sampler2D {name}; uniform vec4 _{name}_imgRect;\n" for name in names)
        declared += "".join(f"uniform {one.type} {name};\n" for name, one in self.parameters.items())
        vertex = _QUAD + _ISF + declared + _ISF_VERTEX + self.vertex
        return vertex, _COMMON + _ISF + declared + _ISF_FRAGMENT + place + self.text


class TransitionFile:
    """What a gl-transition says."""

    persistent = False

    def __init__(self, path: Path) -> None:
        self.path, self.text = path, path.read_text(encoding="utf-8", errors="replace")
        self.parameters = {"progress": Asked("float", 0.5, 0.0, 1.0)}
        self.images = ["from", "to"]
        said = re.finditer(
            r"^\s*uniform\s+(\w+)\s+(\w+)\s*(?:;?\s*(?://|/\*)?\s*=\s*([^;\n*]+))?[^\n]*$", self.text, re.MULTILINE
        )
        for found in said:
            if found[1] == "sampler2D":
                self.images.append(found[2])
            elif found[2] not in ("progress", "ratio"):
                self.parameters[found[2]] = Asked(found[1], _glsl_value(found[1], found[3]))

    def passes(self, size: Size, values: Mapping[str, Any]) -> list[Pass]:
        return [Pass("", size, False, False)]

    def sources(self, exact: bool) -> tuple[str, str]:
        place = _CENTRES.format("host_uv") if exact else "in vec2 host_uv;\n"
        text = re.sub(r"^\s*uniform\s+float\s+(progress|ratio)\s*;", "", self.text, flags=re.MULTILINE)
        return (
            _TRANSITION_VERTEX,
            f"{_COMMON}{place}{_TRANSITION}{text}\nvoid main() {{ host_color = transition(host_uv); }}",
        )


File = IsfFile | TransitionFile


def _flag(said: Any) -> bool:
    return str(said).lower() in ("true", "1", "1.0")


def _side(said: Any, names: Mapping[str, Any]) -> int:
    """Pixels that a formula of a header gives; the files are known ones, so that Python may compute it."""
    known = {"floor": math.floor, "ceil": math.ceil, "max": max, "min": min, "abs": abs, **names}
    return max(1, int(eval(str(said).replace("$", ""), {"__builtins__": {}}, known)))


def _asked(one: Mapping[str, Any]) -> Asked:
    type_ = _TYPES[one["TYPE"].lower()]
    count = {"vec2": 2, "vec4": 4}.get(type_, 1)
    said = one.get("DEFAULT", one.get("VALUES", [0])[0] if type_ == "int" else 0)
    default: Any
    if count > 1:
        parts = said if isinstance(said, list) else [said] * count
        default = tuple(float(part) for part in [*parts, 1.0, 1.0][:count])
    else:
        default = {"float": float, "bool": bool, "int": int}[type_](said)
    return Asked(type_, default, one.get("MIN"), one.get("MAX"), tuple(one.get("VALUES", ())))


def _glsl_value(type_: str, text: str | None) -> Any:
    """``vec3(0.5)`` and its like as Python numbers."""
    count = int(type_[-1]) if "vec" in type_ else 1
    found = re.findall(r"true|false|-?\.?\d[\d.e-]*", (text or "").partition("//")[0])
    if text and "vec" in text:
        found = re.findall(r"-?\.?\d[\d.e-]*", text.partition("(")[2])
    if type_ in ("bool", "int"):
        return {"true": True, "false": False}.get(found[0]) if type_ == "bool" else int(float(found[0]))
    numbers = [int(word) if type_[0] == "i" else float(word) for word in found] or [0]
    return numbers[0] if count == 1 else tuple(numbers * count if len(numbers) == 1 else numbers)


class Original:
    """One file in an OpenGL context, for pictures of one size.

    ``exact``: buffers of 8 bits are read as floats that hold the same numbers, since llvmpipe filters pictures of
    8 bits with weights of 8 bits.  Without, they are read as hosts read them; for measuring.  ``settled``: functions
    of GLSL that are computed as kernels define them (defined.py), every sum and product in the order of the text.
    """

    def __init__(
        self,
        context: moderngl.Context,
        file: File,
        size: Size,
        *,
        exact: bool = True,
        settled: Collection[str] | None = None,
    ) -> None:
        self.context, self.file, self.size, self.exact = context, file, size, exact
        vertex, fragment = file.sources(exact)
        if settled is not None:
            vertex, fragment = (text.replace(_COMMON, _COMMON + definitions(settled), 1) for text in (vertex, fragment))
            fragment = fragment.replace("out vec4 host_color", "precise out vec4 host_color", 1)
        self.program = context.program(vertex_shader=vertex, fragment_shader=fragment)
        corners = np.array([0, 0, 1, 0, 0, 1, 1, 1], np.float32)
        self.quad = context.vertex_array(self.program, [(context.buffer(corners.tobytes()), "2f", "host_corner")])
        self.buffers: dict[str, _Buffer] = {}
        self.textures: dict[str, moderngl.Texture] = {}
        self.places: dict[Size, moderngl.Texture] = {}
        self.nothing = self._texture(np.zeros((1, 1, 4), np.float32))

    def show(self, pictures: Mapping[str, Picture]) -> None:
        """Bring pictures in: (h, w, 4), row 0 on top."""
        self.textures = {name: self._texture(picture) for name, picture in pictures.items()}

    def _texture(self, picture: Picture) -> moderngl.Texture:
        height, width = picture.shape[:2]
        upward = np.ascontiguousarray(picture[::-1], np.float32)
        if self.exact:
            return smooth(self.context.texture((width, height), 4, upward.tobytes(), dtype="f4"))
        return smooth(self.context.texture((width, height), 4, np.uint8(np.round(upward * 255)).tobytes()))

    def draw(self, values: Mapping[str, Any], frame: int = 0, clock: Clock = Clock()) -> list[Picture]:
        """What each pass of a frame drew."""
        return [self.last.read() for _ in self.run(values, frame, clock)]

    def run(self, values: Mapping[str, Any], frame: int = 0, clock: Clock = Clock()) -> Any:
        """Draw a frame; yields the number of each pass when it is drawn."""
        passes = self.file.passes(self.size, values)
        for one in passes:
            if one.target and not one.persistent and one.target in self.buffers:
                self.buffers.pop(one.target).release()
        for one in passes:
            if one.persistent:
                self._buffer(one)
        for number, one in enumerate(passes):
            self.last = found = self._buffer(one)
            self._set(values, number, frame, one.size, clock)
            found.begin()
            self.quad.render(moderngl.TRIANGLE_STRIP)
            found.done()
            yield number

    def _buffer(self, one: Pass) -> _Buffer:
        found = self.buffers.get(one.target)
        if found is None or found.size != one.size:
            found = self.buffers[one.target] = _Buffer(self.context, one.size, one.is_float, self.exact)
        return found

    def _set(self, values: Mapping[str, Any], number: int, frame: int, size: Size, clock: Clock) -> None:
        given: dict[str, Any] = {
            **values, "PASSINDEX": number, "FRAMEINDEX": frame, "TIME": clock.time + frame * clock.step,
            "TIMEDELTA": clock.step, "DATE": clock.date, "RENDERSIZE": tuple(map(float, size)),
            "ratio": self.size[0] / self.size[1],
        }  # fmt: skip
        unit = 0
        for name in self.program:
            uniform: Any = self.program[name]
            if not isinstance(uniform, moderngl.Uniform):
                continue
            if name in given:
                uniform.value = given[name]
            elif name.endswith("_imgRect"):
                texture = self._read(name[1:].removesuffix("_imgRect"))
                uniform.value = (0.0, 0.0, float(texture.size[0]), float(texture.size[1]))
            else:
                read = self._places(size) if name == "host_places" else self._read(name.removeprefix("host_"))
                read.use(unit)
                uniform.value = unit
                unit += 1

    def _places(self, size: Size) -> moderngl.Texture:
        if size not in self.places:
            self.places[size] = places(self.context, size)
        return self.places[size]

    def _read(self, name: str) -> moderngl.Texture:
        return self.buffers[name].shown if name in self.buffers else self.textures.get(name, self.nothing)

    def release(self) -> None:
        for buffer in self.buffers.values():
            buffer.release()
        for owned in (self.quad, self.program, self.nothing, *self.textures.values(), *self.places.values()):
            owned.release()


class _Buffer:
    """A picture that is drawn into, and the one that is read: what was drawn before."""

    def __init__(self, context: moderngl.Context, size: Size, is_float: bool, exact: bool) -> None:
        self.size, self.exact, kind = size, exact, "f4" if is_float else "f1"
        self.kind = kind
        self.shown = (
            smooth(context.texture(size, 4, bytes(size[0] * size[1] * 16), dtype="f4"))
            if exact
            else (smooth(context.texture(size, 4, bytes(size[0] * size[1] * (16 if is_float else 4)), dtype=kind)))
        )
        self.drawn = smooth(context.texture(size, 4, dtype=kind))
        self.frames = {id(t): context.framebuffer([t]) for t in ((self.drawn,) if exact else (self.drawn, self.shown))}

    def begin(self) -> None:
        frame = self.frames[id(self.drawn)]
        frame.use()
        frame.clear()

    def done(self) -> None:
        if self.exact:
            self.shown.write(self._raw().tobytes())
        else:
            self.drawn, self.shown = self.shown, self.drawn

    def _raw(self) -> Picture:
        """Rows upward."""
        texture = self.drawn if self.exact else self.shown
        kind, scale = (np.float32, 1.0) if self.kind == "f4" else (np.uint8, 255.0)
        values = np.frombuffer(texture.read(), kind).reshape(self.size[1], self.size[0], 4)
        return values.astype(np.float32) / np.float32(scale)

    def read(self) -> Picture:
        return self._raw()[::-1].copy()

    def release(self) -> None:
        for owned in (*self.frames.values(), self.drawn, self.shown):
            owned.release()
