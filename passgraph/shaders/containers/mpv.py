"""mpv user shaders: passes that hook into a player's chain (mpv's manual, option glsl-shaders).

Rows count from the top.  The picture is MAIN, and NATIVE, RGB, LINEAR, OUTPUT and their like are the same here, each as
the passes at earlier stages leave it; LUMA is its luma (Rec. 709), and its colours join again behind the passes, scaled
bilinearly.  What passes write holds half floats.  Colours are those of sRGB.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
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
from passgraph.shaders.containers.pictures import small_kernel
from passgraph.shaders.glsl import Shader, parse

#: Stages at which the picture is the picture, in the order in which a player comes by.
_STAGES = ("RGB", "NATIVE", "MAINPRESUB", "MAIN", "LINEAR", "SIGMOID", "PREKERNEL", "POSTKERNEL", "SCALED", "OUTPUT")
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
_LUMA = f"""uniform sampler2D t;
void main() {{ gl_FragColor = vec4(dot({_HERE.format("t")}.rgb, vec3(.2126, .7152, .0722)), 0.0, 0.0, 1.0); }}"""
_COPIED = "uniform sampler2D t; void main() {{ gl_FragColor = {0}; }}"
_JOINED = """uniform sampler2D t, luma;
void main() {{
    vec4 c = {1};
    gl_FragColor = vec4(c.rgb + ({0}.x - dot(c.rgb, vec3(.2126, .7152, .0722))), c.a);
}}"""


@dataclass(frozen=True)
class _Pass:
    """One block that is a pass, with its kernel."""

    block: MpvBlock
    hook: str
    kernel: PixelKernel[Target]


@dataclass
class _Chain:
    """Textures by name while the graph is made: what they hold, how large they are, and by how many of their texels
    passes have moved them (``//!OFFSET``)."""

    held: dict[str, Target]
    sizes: dict[str, tuple[Formula, Formula]]
    output: tuple[Formula, Formula]
    offsets: dict[str, tuple[float, float]]

    def keep(self, names: Iterable[str], made: Target, size: tuple[Formula, Formula]) -> None:
        for name in names:
            self.held[name], self.sizes[name] = made, size


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
    passes: list[_Pass] = []
    shaders: list[Shader] = []
    for number, block in enumerate(b for b in blocks if "HOOK" in b.said):
        hook = _hook_of(block, file)
        # The texture that is hooked has its own name too.
        hooked = {"HOOKED", *(name for name in block.all("HOOK") if re.search(rf"\b{name}_", block.code))}
        prelude = _COMMON + uniforms
        for name in sorted({*block.all("BIND"), *hooked}):
            moved = block.is_aligned and name in hooked
            prelude += _BOUND.format(name, f"(pg_position + pg_offset * {name}_pt)" if moved else "pg_position")
        shader = parse(
            block.code, name=f"{name_of(path)}{number or ''}", file=file, entry="pg_main", prelude=prelude,
            postlude=_BEHIND[block.components(file, 1 if hook == "LUMA" else 4)], rows_up=False,
        )  # fmt: skip
        shaders.append(shader)
        passes.append(_Pass(block, hook, PixelKernel[Target].of_shader(shader)))
    if not passes:
        raise InputError(f"{file}: has no pass (//!HOOK)")
    parameters["output_scale"] = ShaderParameter(
        "output_scale", FLOAT, 2.0, 0.0625, 16.0, "OUTPUT by the frame, for conditions (//!WHEN)"
    )

    def build(pictures: Mapping[str, Target], values: Mapping[str, Any], into: TargetSpec) -> Target:
        return _built(passes, pictures["frame"], values, into, file)

    words = {word for one in passes for text in one.block.expressions() for word in text.split()}
    constants = frozenset({"output_scale", *(parameters.keys() & words)})
    summary = next((b.first("DESC") for b in blocks if "DESC" in b.said), f"{path.stem}: an mpv user shader")
    return ShaderEffect(
        name_of(path), "mpv", summary, "", ("frame",), parameters, notes_of(shaders), file, build, constants
    )


def _built(passes: list[_Pass], frame: Target, values: Mapping[str, Any], into: TargetSpec, file: str) -> Target:
    scale = float(values["output_scale"])
    whole: tuple[Formula, Formula] = ("width", "height")
    output: tuple[Formula, Formula] = (_scaled("width", scale), _scaled("height", scale))
    chain = _Chain({}, {}, output, dict.fromkeys(("MAIN", "LUMA"), (0.0, 0.0)))
    chain.keep(_STAGES, frame, whole)
    has_luma = any(one.hook == "LUMA" for one in passes)
    if has_luma:
        luma = small_kernel("luma", _LUMA)(t=frame, into=_spec(f"{into.name}.luma", whole, "rgba32f"))
        chain.keep(["LUMA"], luma, whole)
    uniforms = clock_uniforms(values) | dict(values) | {"pg_scale": scale}
    for number, one in enumerate(passes):
        _add_pass(one, chain, frame, uniforms, f"{into.name}.{number}", file)
    own = "LUMA" if has_luma else "OUTPUT"
    size, offset = chain.sizes[own], chain.offsets["LUMA" if has_luma else "MAIN"]
    shown: dict[str, Any] = {"t": chain.held["OUTPUT"]}
    read = _HERE if offset == (0.0, 0.0) else _MOVED
    text = _COPIED.format(read.format("t"))
    if has_luma:
        shown["luma"] = chain.held["LUMA"]
        text = _JOINED.format(read.format("luma"), (_HERE if size == chain.sizes["OUTPUT"] else _SCALED).format("t"))
    if read is _MOVED:
        shown["pg_offset"], text = offset, f"uniform vec2 pg_offset; {text}"
    return small_kernel("joined", text)(into=replace(into, size=Computed(*size)), **shown)


def _scaled(side: str, scale: float) -> Formula:
    return "floor", ("add", ("mul", side, scale), 0.5)


def _add_pass(one: _Pass, chain: _Chain, frame: Target, uniforms: Mapping[str, Any], name: str, file: str) -> None:
    """One block: where its condition holds, its pass, and what it replaces or saves."""
    where = f"{file}:{one.block.line}"
    hooked = chain.sizes[one.hook]
    sizes = chain.sizes | {"HOOKED": hooked, "OUTPUT": chain.output, "NATIVE_CROPPED": chain.sizes["OUTPUT"]}
    numbers = {word: float(value) for word, value in uniforms.items() if isinstance(value, (int, float))}
    if any(not holds(text, sizes, f"{where}: WHEN", numbers) for text in one.block.all("WHEN")):
        return
    width, height = (
        side_formula(one.block.first(side, f"HOOKED.{side[0].lower()}"), sizes, f"{where}: {side}", numbers)
        for side in ("WIDTH", "HEIGHT")
    )
    moved = "LUMA" if one.hook == "LUMA" else "MAIN"
    known = {**uniforms, **{f"pg_of_{texture}": held for texture, held in chain.held.items()}}
    known |= {"pg_of_HOOKED": chain.held[one.hook], "pg_offset": chain.offsets[moved]}
    known |= {"pg_frame_before": frame, "pg_frame_now": chain.held["OUTPUT"]}
    given: dict[str, Any] = {}
    for parameter in one.kernel.parameters:
        if parameter.name not in known:
            own = parameter.name.removeprefix("pg_of_")
            raise InputError(f"{where}: //!BIND {own}: no pass before has saved it")
        given[parameter.name] = known[parameter.name]
    made = one.kernel(into=_spec(name, (width, height)), **given)
    saved = one.block.first("SAVE", one.hook)
    if saved != one.hook:
        chain.keep([saved], made, (width, height))
        return
    chain.keep(["LUMA"] if saved == "LUMA" else _STAGES[_STAGES.index(saved) :], made, (width, height))
    grown = [
        evaluated(new, NOMINAL) / evaluated(old, NOMINAL) for new, old in zip((width, height), hooked, strict=True)
    ]
    own_offset, before = one.block.offset(file), chain.offsets[moved]
    x, y = (said + factor * t for said, factor, t in zip(own_offset, grown, before, strict=True))
    chain.offsets[moved] = (0.0, 0.0) if one.block.is_aligned else (x, y)


def _hook_of(block: MpvBlock, file: str) -> str:
    hooks = block.all("HOOK")
    known = next((hook for hook in hooks if hook in _STAGES or hook == "LUMA"), None)
    if known is None:
        raise InputError(
            f"{file}:{block.line}: //!HOOK {' '.join(hooks)} is not read here; a picture has MAIN, its like, and LUMA"
        )
    return known


def _parameter(block: MpvBlock, file: str) -> ShaderParameter:
    where = f"{file}:{block.line}: //!PARAM"
    type_ = _TYPES.get(block.first("TYPE", "float"))
    if type_ is None:
        raise InputError(f"{where}: TYPE {block.first('TYPE')} is not read here; there are {', '.join(_TYPES)}")
    low, high = (_number(block.first(side), f"{where}: {side}") for side in ("MINIMUM", "MAXIMUM"))
    default = _number(block.code.strip() or "0", where)
    assert default is not None
    return ShaderParameter(
        block.first("PARAM"), type_, int(default) if type_ is INT else default, low, high, block.first("DESC")
    )


def _number(text: str, where: str) -> float | None:
    if not text:
        return None
    try:
        return float(text)
    except ValueError:
        raise InputError(f"{where} must be a number, got {text!r}") from None


def _spec(name: str, size: tuple[Formula, Formula], format: str = "rgba16f") -> TargetSpec:
    return replace(target(name, format), size=Computed(*size))
