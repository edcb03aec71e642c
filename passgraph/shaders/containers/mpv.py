"""mpv user shaders: passes that hook into a player's chain (mpv's manual, option glsl-shaders).

Rows count from the top.  The picture is MAIN, and NATIVE, RGB, LINEAR, OUTPUT and their like are the same here, each as
the passes at earlier stages leave it.  Where a file hooks LUMA or CHROMA, it sees a video's planes first: luma and the
two differences of colour, Rec. 709, from 0 to 1.  They join again behind their passes, scaled bilinearly to the size of
the luma.  What passes write holds half floats.  Colours are those of sRGB.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from passgraph.errors import InputError
from passgraph.graph.calls import PixelKernel
from passgraph.graph.formulas import Formula, evaluated
from passgraph.graph.targets import Computed, Target, TargetSpec, target
from passgraph.language.types import BOOL, FLOAT, INT, Type
from passgraph.shaders.containers.clock import PRELUDE, clock_uniforms
from passgraph.shaders.containers.effect import ShaderEffect, ShaderParameter, name_of, notes_of
from passgraph.shaders.containers.mpv_header import NOMINAL, MpvBlock, holds, read_blocks, side_formula
from passgraph.shaders.containers.mpv_textures import read_texture
from passgraph.shaders.containers.pictures import small_kernel
from passgraph.shaders.glsl import Shader, parse

#: Planes of a video, which come first, and how many components each has.
_PLANES = {"LUMA": 1, "CHROMA": 2}
#: Stages at which the picture is the picture, in the order in which a player comes by.
_STAGES = ("RGB", "NATIVE", "MAINPRESUB", "MAIN", "LINEAR", "SIGMOID", "PREKERNEL", "POSTKERNEL", "SCALED", "OUTPUT")
_ORDER = (*_PLANES, *_STAGES)
_TYPES: dict[str, Type] = {"float": FLOAT, "int": INT, "bool": BOOL, "DYNAMIC float": FLOAT, "CONSTANT float": FLOAT}
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
#define frame pg_frame
#define random 0.5
#define input_size vec2(textureSize(pg_frame_now, 0))
#define target_size floor(pg_scale * vec2(textureSize(pg_frame_before, 0)) + 0.5)
#define tex_offset pg_offset
vec4 linearize(vec4 c) {{
    vec3 steep = pow((max(c.rgb, 0.0) + 0.055) / 1.055, vec3(2.4));
    return vec4(mix(c.rgb / 12.92, steep, step(0.04045, c.rgb)), c.a);
}}
vec4 delinearize(vec4 c) {{
    vec3 steep = 1.055 * pow(max(c.rgb, 0.0), vec3(1.0 / 2.4)) - 0.055;
    return vec4(mix(c.rgb * 12.92, steep, step(0.0031308, c.rgb)), c.a);
}}
"""
#: What the player tells shaders.
_OWN = ("frame", "random", "input_size", "target_size", "tex_offset")
#: By number of components what is kept of a result.
_BEHIND = {
    count: f"void pg_main() {{ gl_FragColor = {kept}; }}"
    for count, kept in ((1, "vec4(hook().x, vec2(0.0), 1.0)"), (2, "vec4(hook().xy, 0.0, 1.0)"),
                        (3, "vec4(hook().xyz, 1.0)"), (4, "hook()"))
}  # fmt: skip
#: How to read a picture: this pixel where it is as large as the result, else this place, or where passes have put it.
_HERE = "texelFetch({0}, ivec2(gl_FragCoord.xy), 0)"
_SCALED = "texture2D({0}, pg_position)"
_MOVED = "texture2D({0}, pg_position + pg_offset / vec2(textureSize({0}, 0)))"
_WEIGHTS = "vec3(.2126, .7152, .0722)"
_LUMA = f"""uniform sampler2D t;
void main() {{ gl_FragColor = vec4(dot({_HERE.format("t")}.rgb, {_WEIGHTS}), 0.0, 0.0, 1.0); }}"""
#: Differences to the luma of blue and red, by as much as these may be, none at 0.5 (ITU-R BT.709, full range).
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
    """One block at one of its hooks, with its kernel."""

    block: MpvBlock
    hook: str
    kernel: PixelKernel[Target]


@dataclass
class _Chain:
    """Textures by name while the graph is made: what they hold, how large they are, and of the planes and the picture
    (``MAIN``) by how many of their texels passes have moved them (``//!OFFSET``)."""

    held: dict[str, Target]
    sizes: dict[str, tuple[Formula, Formula]]
    output: tuple[Formula, Formula]
    shown: dict[str, tuple[Target, tuple[Formula, Formula]]] = field(default_factory=dict)
    offsets: dict[str, tuple[float, float]] = field(default_factory=dict)

    def keep(self, names: Iterable[str], made: Target, size: tuple[Formula, Formula]) -> None:
        for name in names:
            self.held[name], self.sizes[name] = made, size

    def show(self, own: str, hook: str, made: Target, size: tuple[Formula, Formula]) -> None:
        """What a plane, or the picture from a stage on, is now."""
        self.keep([own] if own in _PLANES else _STAGES[_STAGES.index(hook) :], made, size)
        self.shown[own] = made, size
        self.offsets.setdefault(own, (0.0, 0.0))


def read_mpv(text: str, path: Path) -> ShaderEffect:
    """The effect of an mpv user shader.

    Raises
    ------
    InputError
        For directives that are wrong or not read here, with file and line.
    KernelError
        For a shader that is refused, with file, line and caret.
    """
    file = str(path)
    blocks = read_blocks(text, file)
    parameters = {one.name: one for one in (_parameter(b, file) for b in blocks if "PARAM" in b.said)}
    uniforms = "".join(f"uniform {one.type} {one.name};\n" for one in parameters.values())
    textures = {b.first("TEXTURE"): read_texture(b, file) for b in blocks if "TEXTURE" in b.said}
    passes: list[_Pass] = []
    shaders: list[Shader] = []
    for number, block in enumerate(b for b in blocks if "HOOK" in b.said):
        for hook in _hooks_of(block, file):
            shader = parse(
                block.code, name=f"{name_of(path)}{number or ''}", file=file, entry="pg_main",
                prelude=_COMMON + uniforms + _bound(block, hook, textures),
                postlude=_BEHIND[block.components(file, _PLANES.get(hook, 4))], rows_up=False,
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
        return _built(passes, textures, pictures["frame"], values, into, file)

    words = {word for one in passes for text in one.block.expressions() for word in text.split()}
    constants = frozenset(parameters.keys() & {"output_scale", "chroma_scale", *words})
    summary = next((b.first("DESC") for b in blocks if "DESC" in b.said), f"{path.stem}: an mpv user shader")
    return ShaderEffect(
        name_of(path), "mpv", summary, "", ("frame",), parameters, notes_of(shaders), file, build, constants
    )


def _bound(block: MpvBlock, hook: str, textures: Mapping[str, Target]) -> str:
    """Declarations of the textures that a pass reads: what is hooked has its own name too."""
    made = ""
    for name in sorted({*block.all("BIND"), "HOOKED", hook}):
        if name in textures:
            made += f"uniform sampler{3 if textures[name].slice_count > 1 else 2}D {name};\n"
        else:
            moved = block.is_aligned and name in ("HOOKED", hook)
            made += _BOUND.format(name, f"(pg_position + pg_offset * {name}_pt)" if moved else "pg_position")
    return made


def _built(
    passes: list[_Pass], textures: Mapping[str, Target], frame: Target, values: Mapping[str, Any], into: TargetSpec,
    file: str,
) -> Target:  # fmt: skip
    scale, of_chroma = (float(values.get(name, 1.0)) for name in ("output_scale", "chroma_scale"))
    output, reduced = ((_scaled("width", by), _scaled("height", by)) for by in (scale, of_chroma))
    chain = _Chain(dict(textures), {}, output)
    whole: tuple[Formula, Formula] = ("width", "height")
    chain.show("MAIN", _STAGES[0], frame, whole)
    of_planes = [one for one in passes if one.hook in _PLANES]
    of_colors = any(one.hook == "CHROMA" for one in of_planes)
    uniforms = clock_uniforms(values) | dict(values) | {"pg_scale": scale}
    if of_planes:
        luma = small_kernel("luma", _LUMA)(t=frame, into=_spec(f"{into.name}.luma", whole, "rgba32f"))
        chain.show("LUMA", "LUMA", luma, whole)
    if of_colors:
        size, read = (whole, _HERE) if of_chroma == 1.0 else (reduced, _SCALED)
        kernel = small_kernel("chroma", _CHROMA.format(read.format("t")))
        chain.show("CHROMA", "CHROMA", kernel(t=frame, into=_spec(f"{into.name}.chroma", size, "rgba32f")), size)
    for number, one in enumerate(passes):
        if number == len(of_planes) > 0:
            size = chain.shown["LUMA"][1]
            chain.show("MAIN", _STAGES[0], _joined(chain, _spec(f"{into.name}.joined", size), of_colors), size)
        _add_pass(one, chain, frame, uniforms, f"{into.name}.{number}", file)
    if len(of_planes) == len(passes):
        return _joined(chain, replace(into, size=Computed(*chain.shown["LUMA"][1])), of_colors)
    made, size = chain.shown["MAIN"]
    said, text = _reader(chain, "MAIN", size)
    return small_kernel("shown", said + _COPIED.format(text.format("t")))(
        t=made, into=replace(into, size=Computed(*size)), **_moved_by(chain, ["MAIN"])
    )


def _joined(chain: _Chain, into: TargetSpec, of_colors: bool) -> Target:
    """The picture that the planes are, as large as the luma."""
    size = chain.shown["LUMA"][1]
    named = {"luma": "LUMA", "t": "MAIN", **({"chroma": "CHROMA"} if of_colors else {})}
    readers = {name: _reader(chain, own, size) for name, own in named.items()}
    text = (_JOINED_OF_THREE if of_colors else _JOINED).format(*(text.format(n) for n, (_, text) in readers.items()))
    given: dict[str, Any] = {name: chain.shown[own][0] for name, own in named.items()}
    said = "".join(said for said, _ in readers.values())
    return small_kernel("joined", said + text)(into=into, **given, **_moved_by(chain, named.values()))


def _reader(chain: _Chain, own: str, size: tuple[Formula, Formula]) -> tuple[str, str]:
    """How a plane or the picture is read where the result has some size, and what has to be declared for it."""
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
    """One block: where its condition holds, its pass, and what it replaces or saves."""
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
    known = {**chain.held, **{f"pg_of_{texture}": held for texture, held in chain.held.items()}, **uniforms}
    known |= {"pg_of_HOOKED": hooked, f"pg_of_{one.hook}": hooked, "pg_offset": chain.offsets[own]}
    known |= {"pg_frame_before": frame, "pg_frame_now": chain.held["OUTPUT"]}
    given: dict[str, Any] = {}
    for parameter in one.kernel.parameters:
        if parameter.name not in known:
            name = parameter.name.removeprefix("pg_of_")
            raise InputError(f"{where}: //!BIND {name}: no pass before has saved it")
        given[parameter.name] = known[parameter.name]
    made = one.kernel.called(given, _spec(target_name, (width, height)))
    saved = one.block.first("SAVE", one.hook)
    if saved != one.hook:
        chain.keep([saved], made, (width, height))
        return
    chain.show(own, one.hook, made, (width, height))
    grown = [
        evaluated(new, NOMINAL) / evaluated(old, NOMINAL) for new, old in zip((width, height), before, strict=True)
    ]
    moved = zip(one.block.offset(file), grown, chain.offsets[own], strict=True)
    x, y = (said + factor * t for said, factor, t in moved)
    chain.offsets[own] = (0.0, 0.0) if one.block.is_aligned else (x, y)


def _hooks_of(block: MpvBlock, file: str) -> list[str]:
    """Where a block runs.  A video with planes has no RGB of its own, which blocks hook beside them for other files."""
    hooks = list(dict.fromkeys(block.all("HOOK")))
    planes = [hook for hook in hooks if hook in _PLANES]
    known = planes or [hook for hook in hooks if hook in _STAGES][:1]
    if not known:
        read = ", ".join(_PLANES)
        raise InputError(
            f"{file}:{block.line}: //!HOOK {' '.join(hooks)} is not read here; a picture has MAIN, its like, and {read}"
        )
    return known


def _parameter(block: MpvBlock, file: str) -> ShaderParameter:
    where = f"{file}:{block.line}: //!PARAM"
    type_ = _TYPES.get(block.first("TYPE", "float"))
    if type_ is None:
        raise InputError(f"{where}: TYPE {block.first('TYPE')} is not read here; there are {', '.join(_TYPES)}")
    low, high = (_number(block.first(side), f"{where}: {side}") for side in ("MINIMUM", "MAXIMUM"))
    if block.first("PARAM") in _OWN:
        raise InputError(f"{where}: {block.first('PARAM')} is a value of the player's; give the parameter another name")
    default = _number(block.code.strip() or "0", where)
    assert default is not None
    return ShaderParameter(
        block.first("PARAM"), type_, int(default) if type_ is INT else default, low, high, block.first("DESC")
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
