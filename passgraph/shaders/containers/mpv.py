"""mpv user shaders: passes that hook into a player's chain (mpv's manual, option glsl-shaders).

Rows count from the top. The picture is MAIN; NATIVE, RGB, LINEAR, OUTPUT and similar stages are the same here, each
with the result of the passes at earlier stages. Files that hook LUMA or CHROMA first get a video's planes: luma and two
color differences, Rec. 709, from 0 to 1. They are joined after their passes, scaled bilinearly to the size of the luma.
Passes write half floats. Colors are sRGB-encoded.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from passgraph.errors import GraphError, InputError
from passgraph.glsl import Shader, parse
from passgraph.graph.calls import PixelKernel
from passgraph.graph.run_values import Formula, evaluated
from passgraph.graph.targets import Computed, Target, TargetSpec, target
from passgraph.language.types import BOOL, FLOAT, INT, UINT, Type
from passgraph.quantise import opaque
from passgraph.shaders.containers.clock import PRELUDE, clock_uniforms
from passgraph.shaders.containers.effect import ShaderEffect, ShaderParameter, name_of, notes_of
from passgraph.shaders.containers.shader_images import brought, small_kernel

MAX_BLOCKS = 256
_DIRECTIVE = re.compile(r"^//!\s*([A-Z]+)\b[ \t]*(.*?)[ \t]*$")
#: Directives of a block; and unsupported ones with the reason.
_KNOWN = frozenset(["HOOK", "BIND", "SAVE", "DESC", "WIDTH", "HEIGHT", "WHEN", "OFFSET", "COMPONENTS", "PARAM", "TYPE",
                    "MINIMUM", "MAXIMUM", "TEXTURE", "SIZE", "FORMAT", "FILTER", "BORDER", "STORAGE"])  # fmt: skip
_REFUSED = {"COMPUTE": "a compute shader", "BUFFER": "a buffer", "VAR": "a variable of a buffer"}
#: Directives that name a texture or a parameter.
_NAMES = frozenset(["HOOK", "BIND", "SAVE", "PARAM", "TEXTURE"])
_SIGNS = {"+": "add", "-": "sub", "*": "mul", "/": "div", "%": "rest", "<": "less", ">": "less", "=": "equal"}
#: Width and height by the name of a texture.
Sizes: TypeAlias = Mapping[str, tuple[Formula, Formula]]
#: The assumed frame size for conditions of ``WHEN``; only those on ratios are exact.
NOMINAL = (1920, 1080)


@dataclass(frozen=True)
class MpvBlock:
    """A pass (or parameter): its directives, each with its line, and its GLSL, with line numbers of the file."""

    line: int
    said: dict[str, list[tuple[str, int]]] = field(default_factory=dict)
    code: str = ""

    def first(self, name: str, otherwise: str = "") -> str:
        return self.said[name][0][0] if name in self.said else otherwise

    def all(self, name: str) -> list[str]:
        return [value for value, _ in self.said.get(name, [])]

    @property
    def is_aligned(self) -> bool:
        """True if this pass undoes the offsets of earlier passes."""
        return self.first("OFFSET") == "ALIGN"

    def offset(self, file: str) -> tuple[float, float]:
        """Return the offset of the picture by this pass, in texels of its result."""
        if self.is_aligned or "OFFSET" not in self.said:
            return 0.0, 0.0
        text, line = self.said["OFFSET"][0]
        match = re.fullmatch(r"([-+]?\d*\.?\d+)\s+([-+]?\d*\.?\d+)", text)
        if match is None:
            raise InputError(f"{file}:{line}: //!OFFSET is two numbers of texels or ALIGN, got {text!r}")
        return float(match[1]), float(match[2])

    def components(self, file: str, otherwise: int) -> int:
        """Return the number of components of its result."""
        text, line = self.said.get("COMPONENTS", [(str(otherwise), self.line)])[0]
        if text not in ("1", "2", "3", "4"):
            raise InputError(f"{file}:{line}: //!COMPONENTS is 1 to 4, got {text!r}")
        return int(text)

    def expressions(self) -> list[str]:
        """Return its expressions in postfix form."""
        return [text for name in ("WIDTH", "HEIGHT", "WHEN") for text in self.all(name)]


def is_mpv(text: str) -> bool:
    """Return True if a text has a hook of mpv."""
    return re.search(r"^//!\s*HOOK\b", text, re.MULTILINE) is not None


def read_blocks(text: str, file: str) -> list[MpvBlock]:
    """Parse the blocks of a file.

    Raises
    ------
    InputError
        For an unknown or unsupported directive, with file and line.
    """
    blocks: list[MpvBlock] = []
    code: list[str] = []
    in_head = False
    lines = text.splitlines()
    for number, line in enumerate(lines, 1):
        match = _DIRECTIVE.match(line)
        if match is not None:
            if not in_head:
                _close(blocks, code)
                blocks.append(MpvBlock(number))
                if len(blocks) > MAX_BLOCKS:
                    raise InputError(f"{file}:{number}: more than {MAX_BLOCKS} passes")
                code = [""] * number
            name, value = match[1], match[2]
            if name in _REFUSED:
                raise InputError(f"{file}:{number}: {_REFUSED[name]} (//!{name}) is not read here\n    {line}")
            if name not in _KNOWN:
                raise InputError(f"{file}:{number}: //!{name} is no directive of mpv's\n    {line}")
            if name in _NAMES and re.fullmatch(r"(?!gl_|pg_)[A-Za-z_]\w*", value, re.ASCII) is None:
                raise InputError(
                    f"{file}:{number}: //!{name} is a name that shaders can write, got {value!r}\n    {line}"
                )
            blocks[-1].said.setdefault(name, []).append((value, number))
            code = [""] * number
        else:
            code.append(line)
        in_head = match is not None
    _close(blocks, code)
    return blocks


def _close(blocks: list[MpvBlock], code: list[str]) -> None:
    if blocks:
        blocks[-1] = MpvBlock(blocks[-1].line, blocks[-1].said, "\n".join(code))


def rpn_formula(text: str, sizes: Sizes, where: str, values: Mapping[str, float] = {}) -> Formula:
    """Parse a postfix expression, ``HOOKED.w 2 *``, to a formula of the frame's size; parameters have values.

    >>> rpn_formula("MAIN.w 2 *", {"MAIN": ("width", "height")}, "WIDTH")
    ('mul', 'width', 2.0)
    """
    stack: list[Formula] = []
    for word in text.split():
        count = 1 if word == "!" else 2 if word in _SIGNS else 0
        if len(stack) < count:
            raise InputError(f"{where}: {text!r} has too few operands for {word}")
        if count == 1:
            stack.append(("equal", stack.pop(), 0.0))
        elif count == 2:
            b, a = stack.pop(), stack.pop()
            stack.append(("less", b, a) if word == ">" else (_SIGNS[word], a, b))
        else:
            stack.append(_operand(word, sizes, values, text, where))
    if len(stack) != 1:
        raise InputError(f"{where}: {text!r} is no size or condition in postfix form, such as HOOKED.w 2 *")
    return stack[0]


def side_formula(text: str, sizes: Sizes, where: str, values: Mapping[str, float] = {}) -> Formula:
    """Parse the length of a side in pixels, rounded to nearest as in mpv.

    >>> side_formula("MAIN.w 2 /", {"MAIN": ("width", "height")}, "WIDTH")
    ('floor', ('add', ('div', 'width', 2.0), 0.5))
    """
    side = rpn_formula(text, sizes, where, values)
    return side if _is_whole(side) else ("floor", ("add", side, 0.5))


def _is_whole(formula: Formula) -> bool:
    if isinstance(formula, tuple):
        stays_whole = formula[0] in ("add", "sub", "mul")
        return formula[0] == "floor" or (stays_whole and all(_is_whole(part) for part in formula[1:]))
    return isinstance(formula, str) or float(formula).is_integer()


def holds(text: str, sizes: Sizes, where: str, values: Mapping[str, float] = {}) -> bool:
    """Return True if a condition holds for a frame of :data:`NOMINAL` size; False if it divides by zero."""
    condition = rpn_formula(text, sizes, where, values)
    try:
        return evaluated(condition, NOMINAL) != 0
    except GraphError:
        return False


def _operand(word: str, sizes: Sizes, values: Mapping[str, float], text: str, where: str) -> Formula:
    name, dot, side = word.partition(".")
    if dot and name in sizes and side in ("w", "width", "h", "height"):
        return sizes[name][0 if side.startswith("w") else 1]
    if word in values:
        return values[word]
    try:
        number = float(word)
    except ValueError:
        number = float("nan")
    if not abs(number) < 1e9:
        known = ", ".join([*(f"{one}.w" for one in sizes), *values])
        raise InputError(f"{where}: {text!r} has {word!r}; there are numbers, {' '.join(_SIGNS)} ! and {known}")
    return number


#: Most texels of a side, and of a texture.
MAX_SIDE, MAX_TEXELS = 16_384, 1 << 22
_FORMAT = re.compile(r"(r|rg|rgb|rgba)(8|16|16hf|16f|32f)")
#: Dtypes of a texture's hexadecimal data, by format. For half floats (16f) the data are float32, which the player
#: rounds; formats with hf have halves.
_KINDS: dict[str, str] = {"8": "u1", "16": "<u2", "16hf": "<f2", "16f": "<f4", "32f": "<f4"}
_FILTERS = {"LINEAR": "linear", "NEAREST": "nearest"}
_BORDERS = {"CLAMP": "clamp", "REPEAT": "repeat", "MIRROR": "mirror"}


def read_texture(block: MpvBlock, file: str) -> Target:
    """Read the picture in a block, with its filter and border; the slices of a volume are stored below one another.

    Raises
    ------
    InputError
        For an unknown size, format, filter or border, and for a wrong number of digits, checked before allocation.
    """
    name = block.first("TEXTURE")
    where = f"{file}:{block.line}: //!TEXTURE {name}"
    if "STORAGE" in block.said:
        raise InputError(f"{where}: a texture that passes write (//!STORAGE) is not read here")
    sides = block.first("SIZE").split()
    if len(sides) not in (2, 3) or not all(re.fullmatch(r"\d{1,5}", side) for side in sides):
        raise InputError(f"{where}: SIZE is width and height, and the depth of a volume, got {block.first('SIZE')!r}")
    width, height, depth = (*map(int, sides), 1)[:3]
    if not (min(width, height, depth) >= 1 and max(width, height, depth) <= MAX_SIDE) or (
        width * height * depth > MAX_TEXELS or height * depth > 4 * MAX_SIDE
    ):
        raise InputError(f"{where}: SIZE has sides from 1 to {MAX_SIDE} and at most {MAX_TEXELS} texels")
    match = _FORMAT.fullmatch(block.first("FORMAT"))
    if match is None:
        raise InputError(
            f"{where}: FORMAT is such as rgba16f, of 8 or 16 bits or floats, got {block.first('FORMAT')!r}"
        )
    letters, kind = match[1], match[2]
    texels = _texels(block.code, (height * depth, width, len(letters)), np.dtype(_KINDS[kind]), where)
    picture = brought(where, f"{letters}{kind.replace('h', '')}", texels)
    picture = picture.filter(_said(block, "FILTER", _FILTERS, where)).border(_said(block, "BORDER", _BORDERS, where))
    return picture.slices(depth) if len(sides) == 3 else picture


def _texels(text: str, shape: tuple[int, int, int], kind: np.dtype[Any], where: str) -> NDArray[np.float32]:
    digits = "".join(text.split())
    expected = 2 * kind.itemsize * int(np.prod(shape))
    if len(digits) != expected:
        raise InputError(f"{where}: its size and format ask for {expected} hexadecimal digits, got {len(digits)}")
    if not re.fullmatch(r"[0-9a-fA-F]*", digits):
        raise InputError(f"{where}: its texels must be hexadecimal digits")
    stored = np.frombuffer(bytes.fromhex(digits), kind).reshape(shape)
    with np.errstate(all="ignore"):
        return (stored / np.float64(opaque(kind))).astype(np.float32)


def _said(block: MpvBlock, name: str, known: dict[str, str], where: str) -> str:
    word = block.first(name, next(iter(known)))
    if word not in known:
        raise InputError(f"{where}: {name} is one of {', '.join(known)}, got {word!r}")
    return known[word]


#: Planes of a video, which come first, with their numbers of components.
_PLANES = {"LUMA": 1, "CHROMA": 2}
#: Stages of the whole picture, in the player's order.
_STAGES = ("RGB", "NATIVE", "MAINPRESUB", "MAIN", "LINEAR", "SIGMOID", "PREKERNEL", "POSTKERNEL", "SCALED", "OUTPUT")
_ORDER = (*_PLANES, *_STAGES)
#: Types of parameters, after ``ENUM``, ``DYNAMIC`` or ``CONSTANT``.
_TYPES: dict[str, Type] = {"float": FLOAT, "int": INT, "uint": UINT, "bool": BOOL, "DEFINE": INT}
_TYPE = re.compile(r"(ENUM )?(?:DYNAMIC |CONSTANT )?(\w+)")
_BOUND = """
uniform sampler2D pg_of_{0};
#define {0}_raw pg_of_{0}
#define {0}_pos {1}
#define {0}_size vec2(textureSize({0}_raw, 0))
#define {0}_rot mat2(1.0)
#define {0}_off vec2(0.0)
#define {0}_pt (1.0 / {0}_size)
#define {0}_mul 1.0
#define {0}_map(id) {1}
#define {0}_tex(pos) texture2D({0}_raw, pos)
#define {0}_texOff(off) texture2D({0}_raw, {0}_pos + {0}_pt * vec2(off))
#define {0}_gather(pos, c) textureGather({0}_raw, pos, c)
"""
_COMMON = f"""#version 450
{PRELUDE}
uniform sampler2D pg_frame_before, pg_frame_now;
uniform vec2 pg_offset;
uniform float pg_scale;
vec4 linearize(vec4 c) {{
    vec3 steep = pow((max(c.rgb, 0.0) + 0.055) / 1.055, vec3(2.4));
    return vec4(mix(c.rgb / 12.92, steep, step(0.04045, c.rgb)), c.a);
}}
vec4 delinearize(vec4 c) {{
    vec3 steep = 1.055 * pow(max(c.rgb, 0.0), vec3(1.0 / 2.4)) - 0.055;
    return vec4(mix(c.rgb * 12.92, steep, step(0.0031308, c.rgb)), c.a);
}}
"""
#: Values that the player sets.
_VALUES = {
    "frame": "pg_frame", "random": "0.5", "input_size": "vec2(textureSize(pg_frame_now, 0))",
    "target_size": "floor(pg_scale * vec2(textureSize(pg_frame_before, 0)) + 0.5)", "tex_offset": "pg_offset",
}  # fmt: skip
#: The entry function of a pass, by its number of components.
_BEHIND = {
    count: f"void pg_main() {{ gl_FragColor = {kept}; }}"
    for count, kept in ((1, "vec4(hook().x, vec2(0.0), 1.0)"), (2, "vec4(hook().xy, 0.0, 1.0)"),
                        (3, "vec4(hook().xyz, 1.0)"), (4, "hook()"))
}  # fmt: skip
#: Ways to read a picture: this pixel if it is as large as the result, else this position, or an offset one.
_HERE = "texelFetch({0}, ivec2(gl_FragCoord.xy), 0)"
_SCALED = "texture2D({0}, pg_position)"
_MOVED = "texture2D({0}, pg_position + pg_offset / vec2(textureSize({0}, 0)))"
_WEIGHTS = "vec3(.2126, .7152, .0722)"
_LUMA = f"""uniform sampler2D t;
void main() {{ gl_FragColor = vec4(dot({_HERE.format("t")}.rgb, {_WEIGHTS}), 0.0, 0.0, 1.0); }}"""
#: Color differences of blue and red, scaled to their ranges, with zero at 0.5 (ITU-R BT.709, full range).
_CHROMA = f"""uniform sampler2D t;
void main() {{{{
    vec4 c = {{0}};
    vec2 apart = c.br - dot(c.rgb, {_WEIGHTS});
    gl_FragColor = vec4(apart / vec2(1.8556, 1.5748) + 0.5, 0.0, 1.0);
}}}}"""
_COPIED = "uniform sampler2D t; void main() {{ gl_FragColor = {0}; }}"
_JOINED = f"""uniform sampler2D t, luma;
void main() {{{{
    vec4 c = {{1}};
    gl_FragColor = vec4(c.rgb + ({{0}}.x - dot(c.rgb, {_WEIGHTS})), c.a);
}}}}"""
_JOINED_OF_THREE = """uniform sampler2D t, luma, chroma;
void main() {{
    float y = {0}.x;
    vec2 apart = ({2}.xy - 0.5) * vec2(1.8556, 1.5748);
    float red = y + apart.y, blue = y + apart.x;
    gl_FragColor = vec4(red, (y - 0.2126 * red - 0.0722 * blue) / 0.7152, blue, {1}.a);
}}"""


@dataclass(frozen=True)
class _Pass:
    """A block at one of its hooks, with its kernel."""

    block: MpvBlock
    hook: str
    kernel: PixelKernel[Target]


@dataclass
class _Chain:
    """Textures by name while the graph is built: their targets and sizes, and for the planes and the picture (``MAIN``)
    their offsets in texels (``//!OFFSET``)."""

    pictures: dict[str, Target]
    sizes: dict[str, tuple[Formula, Formula]]
    output: tuple[Formula, Formula]
    shown: dict[str, tuple[Target, tuple[Formula, Formula]]] = field(default_factory=dict)
    offsets: dict[str, tuple[float, float]] = field(default_factory=dict)

    def keep(self, names: Iterable[str], picture: Target, size: tuple[Formula, Formula]) -> None:
        for name in names:
            self.pictures[name], self.sizes[name] = picture, size

    def show(self, own: str, hook: str, picture: Target, size: tuple[Formula, Formula]) -> None:
        """Set the current content of a plane, or of the picture from a stage on."""
        self.keep([own] if own in _PLANES else _STAGES[_STAGES.index(hook) :], picture, size)
        self.shown[own] = picture, size
        self.offsets.setdefault(own, (0.0, 0.0))


def read_mpv(text: str, path: Path) -> ShaderEffect:
    """Read an mpv user shader as an effect.

    Raises
    ------
    InputError
        For invalid or unsupported directives, with file and line.
    KernelError
        For an unsupported shader, with file, line and caret.
    """
    file = str(path)
    blocks = read_blocks(text, file)
    parameters, macros, options = _parameters(blocks, file)
    uniforms = "".join(f"uniform {one.type} {one.name};\n" for one in parameters.values())
    textures = {b.first("TEXTURE"): read_texture(b, file) for b in blocks if "TEXTURE" in b.said}
    passes: list[_Pass] = []
    shaders: list[Shader] = []
    for number, block in enumerate(b for b in blocks if "HOOK" in b.said):
        for hook in _hooks_of(block, file):
            shader = parse(
                block.code, name=f"{name_of(path)}{number or ''}", file=file, entry="pg_main",
                prelude=_COMMON + uniforms + _bound(block, hook, textures),
                postlude=_BEHIND[block.components(file, _PLANES.get(hook, 4))], rows_up=False, defines=macros,
                values=_VALUES | {name: str(number) for name, number in options.items()},
            )  # fmt: skip
            shaders.append(shader)
            passes.append(_Pass(block, hook, PixelKernel[Target].of_shader(shader)))
    passes.sort(key=lambda one: _ORDER.index(one.hook))
    if not passes:
        raise InputError(f"{file}: has no pass (//!HOOK)")
    parameters["output_scale"] = ShaderParameter(
        "output_scale", FLOAT, 2.0, 0.0625, 16.0, "OUTPUT by the frame, for conditions (//!WHEN)"
    )

    if any(one.hook == "CHROMA" for one in passes):
        parameters["chroma_scale"] = ShaderParameter(
            "chroma_scale", FLOAT, 1.0, 0.25, 1.0, "CHROMA by the frame: 0.5 as in most videos, for its hooks"
        )

    def build(pictures: Mapping[str, Target], values: Mapping[str, Any], into: TargetSpec) -> Target:
        return _built(passes, textures, pictures["frame"], numbers | dict(values), into, file)

    numbers = options | {name: float(number) for name, number in macros.items()}

    words = {word for one in passes for text in one.block.expressions() for word in text.split()}
    constants = frozenset(parameters.keys() & {"output_scale", "chroma_scale", *words})
    summary = next((b.first("DESC") for b in blocks if "DESC" in b.said), f"{path.stem}: an mpv user shader")
    return ShaderEffect(
        name_of(path), "mpv", summary, "", ("frame",), parameters, notes_of(shaders), file, build, constants
    )


def _bound(block: MpvBlock, hook: str, textures: Mapping[str, Target]) -> str:
    """Return declarations of the textures that a pass reads; the hooked one also has its own name."""
    declarations = ""
    for name in sorted({*block.all("BIND"), "HOOKED", hook}):
        if name in textures:
            declarations += f"uniform sampler{3 if textures[name].slice_count > 1 else 2}D {name};\n"
        else:
            moved = block.is_aligned and name in ("HOOKED", hook)
            declarations += _BOUND.format(name, f"(pg_position + pg_offset * {name}_pt)" if moved else "pg_position")
    return declarations


def _built(
    passes: list[_Pass], textures: Mapping[str, Target], frame: Target, values: Mapping[str, Any], into: TargetSpec,
    file: str,
) -> Target:  # fmt: skip
    scale, of_chroma = (float(values.get(name, 1.0)) for name in ("output_scale", "chroma_scale"))
    output, reduced = ((_scaled("width", by), _scaled("height", by)) for by in (scale, of_chroma))
    chain = _Chain(dict(textures), {}, output)
    full_size: tuple[Formula, Formula] = ("width", "height")
    chain.show("MAIN", _STAGES[0], frame, full_size)
    of_planes = [one for one in passes if one.hook in _PLANES]
    of_colors = any(one.hook == "CHROMA" for one in of_planes)
    uniforms = clock_uniforms(values) | dict(values) | {"pg_scale": scale}
    if of_planes:
        luma = small_kernel("luma", _LUMA)(t=frame, into=_spec(f"{into.name}.luma", full_size, "rgba32f"))
        chain.show("LUMA", "LUMA", luma, full_size)
    if of_colors:
        size, read = (full_size, _HERE) if of_chroma == 1.0 else (reduced, _SCALED)
        kernel = small_kernel("chroma", _CHROMA.format(read.format("t")))
        chain.show("CHROMA", "CHROMA", kernel(t=frame, into=_spec(f"{into.name}.chroma", size, "rgba32f")), size)
    for number, one in enumerate(passes):
        if number == len(of_planes) > 0:
            size = chain.shown["LUMA"][1]
            chain.show("MAIN", _STAGES[0], _joined(chain, _spec(f"{into.name}.joined", size), of_colors), size)
        _add_pass(one, chain, frame, uniforms, f"{into.name}.{number}", file)
    if len(of_planes) == len(passes):
        return _joined(chain, replace(into, size=Computed(*chain.shown["LUMA"][1])), of_colors)
    shown, size = chain.shown["MAIN"]
    reader_text, text = _reader(chain, "MAIN", size)
    return small_kernel("shown", reader_text + _COPIED.format(text.format("t")))(
        t=shown, into=replace(into, size=Computed(*size)), **_moved_by(chain, ["MAIN"])
    )


def _joined(chain: _Chain, into: TargetSpec, of_colors: bool) -> Target:
    """Join the planes to a picture as large as the luma."""
    size = chain.shown["LUMA"][1]
    named = {"luma": "LUMA", "t": "MAIN", **({"chroma": "CHROMA"} if of_colors else {})}
    readers = {name: _reader(chain, own, size) for name, own in named.items()}
    text = (_JOINED_OF_THREE if of_colors else _JOINED).format(*(text.format(n) for n, (_, text) in readers.items()))
    images: dict[str, Any] = {name: chain.shown[own][0] for name, own in named.items()}
    readers_text = "".join(readers_text for readers_text, _ in readers.values())
    return small_kernel("joined", readers_text + text)(into=into, **images, **_moved_by(chain, named.values()))


def _reader(chain: _Chain, own: str, size: tuple[Formula, Formula]) -> tuple[str, str]:
    """Return the expression that reads a plane or the picture for a result of some size, and its declarations."""
    if chain.offsets[own] != (0.0, 0.0):
        return f"uniform vec2 pg_moved_{own};\n", _MOVED.replace("pg_offset", f"pg_moved_{own}")
    return "", _HERE if chain.shown[own][1] == size else _SCALED


def _moved_by(chain: _Chain, owns: Iterable[str]) -> dict[str, Any]:
    return {f"pg_moved_{own}": chain.offsets[own] for own in owns if chain.offsets[own] != (0.0, 0.0)}


def _scaled(side: str, scale: float) -> Formula:
    return "floor", ("add", ("mul", side, scale), 0.5)


def _add_pass(
    one: _Pass, chain: _Chain, frame: Target, uniforms: Mapping[str, Any], target_name: str, file: str
) -> None:
    """Add a block's pass if its condition holds, and replace or save its texture."""
    where = f"{file}:{one.block.line}"
    own = one.hook if one.hook in _PLANES else "MAIN"
    hooked, before = chain.shown[own]
    sizes = chain.sizes | {"HOOKED": before, "OUTPUT": chain.output, "NATIVE_CROPPED": chain.sizes["OUTPUT"]}
    numbers = {word: float(value) for word, value in uniforms.items() if isinstance(value, (int, float))}
    if any(not holds(text, sizes, f"{where}: WHEN", numbers) for text in one.block.all("WHEN")):
        return
    width, height = (
        side_formula(one.block.first(side, f"HOOKED.{side[0].lower()}"), sizes, f"{where}: {side}", numbers)
        for side in ("WIDTH", "HEIGHT")
    )
    known = {
        **chain.pictures,
        **{f"pg_of_{texture}": picture for texture, picture in chain.pictures.items()},
        **uniforms,
    }
    known |= {"pg_of_HOOKED": hooked, f"pg_of_{one.hook}": hooked, "pg_offset": chain.offsets[own]}
    known |= {"pg_frame_before": frame, "pg_frame_now": chain.pictures["OUTPUT"]}
    arguments: dict[str, Any] = {}
    for parameter in one.kernel.parameters:
        if parameter.name not in known:
            name = parameter.name.removeprefix("pg_of_")
            raise InputError(f"{where}: //!BIND {name}: no pass before has saved it")
        arguments[parameter.name] = known[parameter.name]
    result = one.kernel.called(arguments, _spec(target_name, (width, height)))
    saved = one.block.first("SAVE", one.hook)
    if saved != one.hook:
        chain.keep([saved], result, (width, height))
        return
    chain.show(own, one.hook, result, (width, height))
    grown = [
        evaluated(new, NOMINAL) / evaluated(old, NOMINAL) for new, old in zip((width, height), before, strict=True)
    ]
    moved = zip(one.block.offset(file), grown, chain.offsets[own], strict=True)
    x, y = (offset + factor * t for offset, factor, t in moved)
    chain.offsets[own] = (0.0, 0.0) if one.block.is_aligned else (x, y)


def _hooks_of(block: MpvBlock, file: str) -> list[str]:
    """Return the hooks of a block. A video with planes has no RGB stage; blocks that hook it are for other files."""
    hooks = list(dict.fromkeys(block.all("HOOK")))
    planes = [hook for hook in hooks if hook in _PLANES]
    known = planes or [hook for hook in hooks if hook in _STAGES][:1]
    if not known:
        read = ", ".join(_PLANES)
        raise InputError(
            f"{file}:{block.line}: //!HOOK {' '.join(hooks)} is not read here; a picture has MAIN, its like, and {read}"
        )
    return known


def _parameters(
    blocks: Iterable[MpvBlock], file: str
) -> tuple[dict[str, ShaderParameter], dict[str, str], dict[str, int]]:
    """Return a file's parameters, macros (``//!TYPE DEFINE``: their number is the file's) and names of choices."""
    parameters: dict[str, ShaderParameter] = {}
    macros: dict[str, str] = {}
    options: dict[str, int] = {}
    for block in (one for one in blocks if "PARAM" in one.said):
        one = _parameter(block, file)
        if one.name in parameters or one.name in macros:
            raise InputError(
                f"{file}:{block.line}: //!PARAM: there are two parameters {one.name!r}; rename one of them"
            )
        is_macro = block.first("TYPE").endswith("DEFINE")
        if is_macro:
            macros[one.name] = str(one.default)
        else:
            parameters[one.name] = one
        for name, number in one.choices.items():
            if options.setdefault(name, number) != number:
                raise InputError(
                    f"{file}:{block.line}: //!PARAM: choice {name!r} has another number in a parameter above"
                )
            if is_macro:
                macros[name] = str(number)
    return parameters, macros, options


def _parameter(block: MpvBlock, file: str) -> ShaderParameter:
    where = f"{file}:{block.line}: //!PARAM"
    match = _TYPE.fullmatch(" ".join(block.first("TYPE", "float").split()))
    type_ = None if match is None else _TYPES.get(match[2])
    is_choice = match is not None and match[1] is not None
    if type_ is None or (is_choice and type_ is not INT):
        known = f"{', '.join(_TYPES)}, ENUM int and ENUM DEFINE"
        raise InputError(f"{where}: TYPE {block.first('TYPE')} is not read here; there are {known}")
    if is_choice and not re.fullmatch(r"[-+\d.\s]*", block.code):
        names = block.code.split()
        if not all(re.fullmatch(r"(?!gl_|pg_)[A-Za-z_]\w*", name, re.ASCII) for name in names):
            raise InputError(f"{where}: the choices of an ENUM are names, one a line, got {block.code.strip()!r}")
        choices = {name: number for number, name in enumerate(names)}
        return ShaderParameter(block.first("PARAM"), type_, 0, 0, len(choices) - 1, block.first("DESC"), choices)
    low, high = (_number(block.first(side), f"{where}: {side}") for side in ("MINIMUM", "MAXIMUM"))
    if block.first("PARAM") in _VALUES:
        raise InputError(f"{where}: {block.first('PARAM')} is a value of the player's; give the parameter another name")
    default = _number(block.code.strip() or "0", where)
    assert default is not None
    return ShaderParameter(
        block.first("PARAM"), type_, int(default) if type_ in (INT, UINT) else default, low, high, block.first("DESC")
    )


def _number(text: str, where: str) -> float | None:
    if not text:
        return None
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise InputError(f"{where} must be a number, got {text!r}")
    return number


def _spec(name: str, size: tuple[Formula, Formula], format: str = "rgba16f") -> TargetSpec:
    return replace(target(name, format), size=Computed(*size))
