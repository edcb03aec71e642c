"""Original mpv user shaders on OpenGL, as the player runs them: what effects are held against.

Blocks, sizes and conditions are read here by code of its own (mpv's manual, option glsl-shaders, and the meaning of
its video/out/gpu): nothing is shared with what is tested.  Textures that passes write hold half floats and are read
linearly, clamped; row 0 of a picture is row 0 of its texture.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeAlias

import moderngl
import numpy as np
from numpy.typing import NDArray
from textures import places, smooth

Picture = NDArray[np.float32]
Size = tuple[int, int]

_VERTEX = """#version 430
in vec2 host_corner;
out vec2 host_pos;
void main() { gl_Position = vec4(host_corner * 2.0 - 1.0, 0.0, 1.0); host_pos = host_corner; }"""
#: Interpolation leaves last bits to the driver, on which shaders that compare texels of one picture hang.
_EXACT = """#version 430
uniform sampler2D host_places;
#define host_pos (texelFetch(host_places, ivec2(gl_FragCoord.xy), 0).xy)
"""
_AS_IS = """#version 430
in vec2 host_pos;
"""
_HEAD = """out vec4 host_color;
uniform float random;
uniform int frame;
uniform vec2 input_size, target_size, tex_offset;
vec4 linearize(vec4 c) {
    for (int i = 0; i < 3; i++) c[i] = c[i] < 0.04045 ? c[i] / 12.92 : pow((c[i] + 0.055) / 1.055, 2.4);
    return c;
}
vec4 delinearize(vec4 c) {
    for (int i = 0; i < 3; i++) c[i] = c[i] < 0.0031308 ? c[i] * 12.92 : 1.055 * pow(c[i], 1.0 / 2.4) - 0.055;
    return c;
}
"""
_BIND = """uniform sampler2D host_of_{0};
#define {0}_raw host_of_{0}
#define {0}_pos {1}
#define {0}_size vec2(textureSize({0}_raw, 0))
#define {0}_rot mat2(1.0)
#define {0}_off vec2(0.0)
#define {0}_pt (1.0 / {0}_size)
#define {0}_map(id) {1}
#define {0}_mul 1.0
#define {0}_tex(pos) ({0}_mul * vec4(texture({0}_raw, pos)))
#define {0}_gather(pos, c) ({0}_mul * vec4(textureGather({0}_raw, pos, c)))
#define {0}_texOff(off) {0}_tex({0}_pos + {0}_pt * vec2(off))
"""
_MOVED = (
    _HEAD + "uniform sampler2D t; void main() { host_color = texture(t, host_pos + tex_offset / textureSize(t, 0)); }"
)
#: In the order in which the player comes by; all before SCALED see the picture before it is scaled.
_STAGES = ("LUMA", "CHROMA", "RGB", "NATIVE", "MAINPRESUB", "MAIN", "LINEAR", "SIGMOID", "PREKERNEL", "POSTKERNEL",
           "SCALED", "OUTPUT")  # fmt: skip
_GL_INT = 0x1404
_Program: TypeAlias = "tuple[moderngl.Program, moderngl.VertexArray]"
_PLANES = {"LUMA": 1, "CHROMA": 2}
#: Rec. 709.
_LUMA = np.array([0.2126, 0.7152, 0.0722], np.float64)


@dataclass
class Block:
    """One pass or parameter: its directives, and its text."""

    said: dict[str, list[str]] = field(default_factory=dict)
    code: str = ""

    def first(self, name: str, otherwise: str = "") -> str:
        return self.said.get(name, [otherwise])[0]


class MpvFile:
    """What a user shader says."""

    def __init__(self, path: Path) -> None:
        self.path = path
        blocks: list[Block] = []
        in_head = False
        for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
            found = re.match(r"//!\s*(\w+)\s*(.*?)\s*$", line)
            if found:
                if not in_head:
                    blocks.append(Block())
                blocks[-1].said.setdefault(found[1], []).append(found[2])
            elif blocks:
                blocks[-1].code += line + "\n"
            in_head = found is not None
        self.passes = [block for block in blocks if "HOOK" in block.said]
        self.textures = {block.first("TEXTURE"): block for block in blocks if "TEXTURE" in block.said}
        self.parameters = {block.first("PARAM"): block for block in blocks if "PARAM" in block.said}

    def defaults(self) -> dict[str, float]:
        return {name: float(block.code.split()[0]) for name, block in self.parameters.items()}


def postfix(text: str, sizes: Mapping[str, Size], values: Mapping[str, float]) -> float:
    """What an expression in postfix form comes to."""
    stack: list[float] = []
    for word in text.split():
        name, _, side = word.partition(".")
        if word == "!":
            stack.append(float(not stack.pop()))
        elif word in ("+", "-", "*", "/", "%", ">", "<", "="):
            b, a = stack.pop(), stack.pop()
            stack.append(_of_two(word, a, b))
        elif name in sizes and side:
            stack.append(float(sizes[name][0 if side[0] == "w" else 1]))
        else:
            stack.append(values[word] if word in values else float(word))
    (result,) = stack
    return result


def _of_two(sign: str, a: float, b: float) -> float:
    meanings = {"+": lambda: a + b, "-": lambda: a - b, "*": lambda: a * b, "/": lambda: a / b,
                "%": lambda: math.fmod(a, b), ">": lambda: a > b, "<": lambda: a < b, "=": lambda: a == b}  # fmt: skip
    return float(meanings[sign]())


class Original:
    """One file in an OpenGL context, for pictures of one size.

    ``exact``: halves are the nearest ones, where llvmpipe's are cut off, and places are computed; slow.  Without, all
    is left to the driver.
    """

    def __init__(
        self, context: moderngl.Context, file: MpvFile, size: Size, output: Size, values: Mapping[str, float] = {},
        *, exact: bool = True,
    ) -> None:  # fmt: skip
        self.context, self.file, self.size, self.output, self.exact = context, file, size, output, exact
        self.values = file.defaults() | dict(values)
        self.quad = context.buffer(np.array([0, 0, 1, 0, 0, 1, 1, 1], np.float32).tobytes())
        self.programs: dict[tuple[int, str], _Program] = {}
        self.kept: dict[tuple[int, str], moderngl.Texture] = {}
        self.places: dict[Size, moderngl.Texture] = {}
        self.offsets = {"MAIN": (0.0, 0.0), "LUMA": (0.0, 0.0), "CHROMA": (0.0, 0.0)}
        self.tables = {name: self._table(block) for name, block in file.textures.items()}
        self.has_planes = any(set(one.said["HOOK"]) & set(_PLANES) for one in file.passes)
        self.moved = self._program(_MOVED)

    def texture(self, picture: Picture) -> moderngl.Texture:
        """A picture (h, w, 4), row 0 on top, held as float32."""
        height, width, channels = picture.shape
        data = np.ascontiguousarray(picture, np.float32).tobytes()
        return smooth(self.context.texture((width, height), channels, data, dtype="f4"))

    def _table(self, block: Block) -> Any:
        """A texture that the file brings: floats of 32 bits, or bytes."""
        sides, kind = tuple(map(int, block.first("SIZE").split())), block.first("FORMAT")
        channels, data = len(kind.rstrip("0123456789f")), bytes.fromhex("".join(block.code.split()))
        if kind.endswith("16f"):
            data = np.frombuffer(data, "<f4").astype(np.float16).tobytes()
        dtype = {"8": "f1", "16f": "f2", "32f": "f4"}[kind.lstrip("rgba")]
        make: Any = self.context.texture if len(sides) == 2 else self.context.texture3d
        made = make(sides, channels, data, alignment=1, dtype=dtype)
        is_near, repeats = block.first("FILTER") == "NEAREST", block.first("BORDER") == "REPEAT"
        made.filter = (moderngl.NEAREST, moderngl.NEAREST) if is_near else (moderngl.LINEAR, moderngl.LINEAR)
        made.repeat_x = made.repeat_y = repeats
        return made

    def draw(self, picture: Picture) -> Picture:
        """What the player has before it scales to the window: (h, w, 4)."""
        shown = self.run({"MAIN": self.texture(picture), **self.planes(picture)})
        return self._put_back(shown["MAIN"], "MAIN", shown["MAIN"].size)

    def _joined(self, held: Mapping[str, moderngl.Texture]) -> moderngl.Texture:
        """The picture that planes are, as the player makes it of a video's."""
        luma = self._put_back(held["LUMA"], "LUMA", held["LUMA"].size)[:, :, :1]
        chroma = self._put_back(held["CHROMA"], "CHROMA", held["LUMA"].size)
        # Rec. 709: V = (R - Y) / 1.5748, U = (B - Y) / 1.8556, and 0.5 where there is none.
        red, blue = luma + 1.5748 * (chroma[:, :, 1:2] - 0.5), luma + 1.8556 * (chroma[:, :, :1] - 0.5)
        green = (luma - _LUMA[0] * red - _LUMA[2] * blue) / _LUMA[1]
        alpha = self._put_back(held["MAIN"], "MAIN", held["LUMA"].size)[:, :, 3:]
        return self.texture(np.concatenate([red, green, blue, alpha], 2).astype(np.float32))

    def planes(self, picture: Picture) -> dict[str, moderngl.Texture]:
        """Luma and colours of a picture, as the player has them of a video."""
        # In float32 and in this order, as shaders have it: some decide by the last bits of flat places.
        parts = picture[:, :, :3] * np.float32(_LUMA)
        luma = parts[:, :, 0] + parts[:, :, 1] + parts[:, :, 2]
        v, u = (picture[:, :, 0] - luma) / 1.5748 + 0.5, (picture[:, :, 2] - luma) / 1.8556 + 0.5
        zero, one = np.zeros_like(luma), np.ones_like(luma)
        return {
            "LUMA": self.texture(np.stack([luma, zero, zero, one], 2).astype(np.float32)),
            "CHROMA": self.texture(np.stack([u, v, zero, one], 2).astype(np.float32)),
        }

    def _put_back(self, texture: moderngl.Texture, own: str, size: Size) -> Picture:
        """A texture at some size, without the shift that its passes brought."""
        target = self.context.texture(size, 4, dtype="f4")
        self._render(self.moved, target, {"t": texture}, {"tex_offset": self.offsets.get(own, (0.0, 0.0))})
        return _read(target)

    def run(self, held: dict[str, moderngl.Texture]) -> dict[str, moderngl.Texture]:
        """Every pass by its stage; what is held behind the last one."""
        self.offsets = dict.fromkeys(self.offsets, (0.0, 0.0))
        for stage in _STAGES:
            own = stage if stage in _PLANES else "MAIN"
            held = held | {stage: held[own]}
            for number, block in enumerate(self.file.passes):
                hooks = block.said["HOOK"]
                # What hooks planes is not run for the picture again.
                if stage in hooks and (stage in _PLANES or not set(hooks) & set(_PLANES)):
                    self._pass(number, block, stage, held)
            held[own] = held[stage]
            if stage == "CHROMA" and self.has_planes:
                held["MAIN"] = self._joined(held)
        return held

    def _pass(self, number: int, block: Block, stage: str, held: dict[str, moderngl.Texture]) -> None:
        hooked = held[stage]
        sizes = {name: texture.size for name, texture in held.items()} | {"HOOKED": hooked.size, "OUTPUT": self.output}
        sizes["NATIVE_CROPPED"] = held["MAIN"].size
        if not all(postfix(text, sizes, self.values) for text in block.said.get("WHEN", [])):
            return
        bound = [name for name in block.said.get("BIND", []) if name not in self.tables]
        given = {name: hooked if name == "HOOKED" else held.get(name) for name in bound}
        if None in given.values():
            return
        if "HOOKED" in given:
            given[stage] = hooked
        components = int(block.first("COMPONENTS") or _PLANES.get(stage, 4))
        key = (number, stage)
        if key not in self.programs:
            self.programs[key] = self._compiled(block, stage, list(given), components)
        # The player rounds halves up.
        size = tuple(
            math.floor(postfix(block.first(side, f"HOOKED.{side[0].lower()}"), sizes, self.values) + 0.5)
            for side in ("WIDTH", "HEIGHT")
        )
        target = self.kept.get(key)
        if target is None or target.size != size:
            target = self.kept[key] = smooth(self.context.texture((size[0], size[1]), 4, dtype="f2"))
        own = stage if stage in _PLANES else "MAIN"
        values = {"tex_offset": self.offsets[own], "input_size": held["MAIN"].size}
        wide = self.context.texture((size[0], size[1]), 4, dtype="f4") if self.exact else target
        textures = {f"host_of_{name}": texture for name, texture in given.items()}
        textures |= {name: table for name, table in self.tables.items() if name in block.said.get("BIND", [])}
        self._render(self.programs[key], wide, textures, values)
        if self.exact:
            target.write(np.frombuffer(wide.read(), np.float32).astype(np.float16).tobytes())
        held[block.first("SAVE", stage)] = target
        if block.first("SAVE", stage) == stage:
            said = block.first("OFFSET", "0 0")
            x, y = (0.0, 0.0) if said == "ALIGN" else map(float, said.split())
            grown = (target.size[0] / hooked.size[0], target.size[1] / hooked.size[1])
            before = (0.0, 0.0) if said == "ALIGN" else self.offsets[own]
            self.offsets[own] = (x + grown[0] * before[0], y + grown[1] * before[1])

    def _compiled(self, block: Block, stage: str, bound: list[str], components: int) -> _Program:
        text = _HEAD
        for name, asked in self.file.parameters.items():
            kind = asked.first("TYPE").split()[-1]
            text += f"#define {name} {self.values[name]:g}\n" if kind == "DEFINE" else f"uniform {kind} {name};\n"
        for name in bound:
            is_moved = block.first("OFFSET") == "ALIGN" and name in ("HOOKED", stage)
            text += _BIND.format(name, f"(host_pos + tex_offset * {name}_pt)" if is_moved else "host_pos")
        for name in (name for name in self.tables if name in block.said.get("BIND", [])):
            text += f"uniform sampler{self.file.textures[name].first('SIZE').count(' ') + 1}D {name};\n"
        text += block.code
        unused = "".join(f"host_color.{'rgba'[i]} = {int(i == 3)}.0; " for i in range(components, 4))
        text += f"\nvoid main() {{ host_color = hook(); {unused}}}"
        return self._program(text)

    def _program(self, text: str) -> _Program:
        text = (_EXACT if self.exact else _AS_IS) + text
        program = self.context.program(vertex_shader=_VERTEX, fragment_shader=text)
        bound = [(self.quad, "2f", "host_corner")] if "host_corner" in program else []
        return program, self.context.vertex_array(program, bound)

    def _render(
        self, compiled: _Program, target: moderngl.Texture, given: Mapping[str, moderngl.Texture | None],
        values: Mapping[str, Any],
    ) -> None:  # fmt: skip
        program, array = compiled
        given = {**given, "host_places": self._places(target.size)} if self.exact else given
        for unit, (name, texture) in enumerate((n, t) for n, t in given.items() if n in program and t is not None):
            texture.use(unit)
            program[name].value = unit  # type: ignore[union-attr]
        for name, value in {"random": 0.5, "target_size": self.output, **self.values, **values}.items():
            if name in program:
                uniform: Any = program[name]
                uniform.value = int(value) if uniform.gl_type == _GL_INT else value
        self.context.framebuffer([target]).use()
        array.render(moderngl.TRIANGLE_STRIP)

    def _places(self, size: Size) -> moderngl.Texture:
        if size not in self.places:
            self.places[size] = places(self.context, size)
        return self.places[size]


def _read(texture: moderngl.Texture) -> Picture:
    kind = np.float16 if texture.dtype == "f2" else np.float32
    width, height = texture.size
    return np.frombuffer(texture.read(), kind).reshape(height, width, 4).astype(np.float32)
