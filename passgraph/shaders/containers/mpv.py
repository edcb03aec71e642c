"""mpv user shaders: passes that hook into a player's chain (mpv's manual, option glsl-shaders).

Rows count from the top.  The picture is MAIN, and NATIVE, RGB, LINEAR, OUTPUT and their like are the same here; LUMA is
its luma (Rec. 709), and its colours join again behind the passes, scaled bilinearly.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, cast

from passgraph.errors import InputError
from passgraph.graph.calls import PixelKernel
from passgraph.graph.formulas import Formula
from passgraph.graph.targets import Computed, Target, TargetSpec, target
from passgraph.language.types import BOOL, FLOAT, INT, Type
from passgraph.shaders.containers.clock import PRELUDE, clock_uniforms
from passgraph.shaders.containers.effect import ShaderEffect, ShaderParameter, name_of, notes_of
from passgraph.shaders.containers.mpv_header import MpvBlock, holds, read_blocks, rpn_formula
from passgraph.shaders.glsl import Shader, parse

#: Stages at which the picture is the picture.
_PICTURE = ("MAIN", "MAINPRESUB", "NATIVE", "NATIVE_CROPPED", "RGB", "LINEAR", "SIGMOID", "PREKERNEL", "POSTKERNEL",
            "SCALED", "OUTPUT")  # fmt: skip
#: What keeps its size, whatever passes do.
_FIXED = ("NATIVE", "NATIVE_CROPPED", "OUTPUT")
_TYPES: dict[str, Type] = {"float": FLOAT, "int": INT, "bool": BOOL, "DYNAMIC float": FLOAT, "CONSTANT float": FLOAT}
_BOUND = """
uniform sampler2D {0}_raw;
#define {0}_pos pg_position
#define {0}_size vec2(textureSize({0}_raw, 0))
#define {0}_pt (1.0 / {0}_size)
#define {0}_mul 1.0
#define {0}_map(id) pg_position
#define {0}_tex(pos) texture2D({0}_raw, pos)
#define {0}_texOff(off) texture2D({0}_raw, {0}_pos + {0}_pt * vec2(off))
#define {0}_gather(pos, c) textureGather({0}_raw, pos, c)
"""
_COMMON = f"""{PRELUDE}
#define frame pg_frame
#define random 0.5
#define input_size pg_output_size
#define target_size pg_output_size
#define tex_offset vec2(0.0)
#define linearize(c) (c)
#define delinearize(c) (c)
"""
_BEHIND = "void pg_main() { gl_FragColor = hook(); }"
_LUMA = """uniform sampler2D t;
void main() { gl_FragColor = vec4(dot(texture2D(t, pg_position).rgb, vec3(.2126, .7152, .0722))); }"""
_COPIED = "uniform sampler2D t; void main() { gl_FragColor = texture2D(t, pg_position); }"
_JOINED = """uniform sampler2D t; uniform sampler2D luma;
void main() {
    vec4 c = texture2D(t, pg_position);
    float y = texture2D(luma, pg_position).x;
    gl_FragColor = vec4(c.rgb + (y - dot(c.rgb, vec3(.2126, .7152, .0722))), c.a);
}"""


@dataclass(frozen=True)
class _Pass:
    """One block that is a pass, with its kernel."""

    block: MpvBlock
    hook: str
    kernel: PixelKernel[Target]
    bound: tuple[str, ...]


@dataclass
class _Chain:
    """Textures by name while the graph is made: what they hold, and how large they are."""

    held: dict[str, Target]
    sizes: dict[str, tuple[Formula, Formula]]


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
        hooked = [name for name in block.all("HOOK") if re.search(rf"\b{name}_", block.code)]
        bound = tuple(dict.fromkeys((*block.all("BIND"), "HOOKED", *hooked)))
        prelude = _COMMON + uniforms + "".join(_BOUND.format(name) for name in bound)
        shader = parse(
            block.code, name=f"{name_of(path)}{number or ''}", file=file, entry="pg_main", prelude=prelude,
            postlude=_BEHIND, rows_up=False,
        )  # fmt: skip
        shaders.append(shader)
        passes.append(_Pass(block, hook, PixelKernel[Target].of_shader(shader), bound))
    if not passes:
        raise InputError(f"{file}: has no pass (//!HOOK)")
    parameters["output_scale"] = ShaderParameter(
        "output_scale", FLOAT, 2.0, 0.0625, 16.0, "OUTPUT by the frame, for conditions (//!WHEN)"
    )

    def build(pictures: Mapping[str, Target], values: Mapping[str, Any], into: TargetSpec) -> Target:
        return _built(passes, pictures["frame"], values, into, file)

    summary = next((b.first("DESC") for b in blocks if "DESC" in b.said), f"{path.stem}: an mpv user shader")
    return ShaderEffect(name_of(path), "mpv", summary, "", ("frame",), parameters, notes_of(shaders), file, build)


def _built(passes: list[_Pass], frame: Target, values: Mapping[str, Any], into: TargetSpec, file: str) -> Target:
    scale = values["output_scale"]
    if not isinstance(scale, (int, float)):
        raise InputError(f"{file}: output_scale must be a number that is known when the graph is made")
    whole: tuple[Formula, Formula] = ("width", "height")
    output: tuple[Formula, Formula] = (("mul", "width", float(scale)), ("mul", "height", float(scale)))
    chain = _Chain({"MAIN": frame}, dict.fromkeys(_PICTURE, whole) | {"OUTPUT": output})
    if any(one.hook == "LUMA" for one in passes):
        chain.held["LUMA"] = _kernel("luma", _LUMA)(t=frame, into=_spec(f"{into.name}.luma", whole))
        chain.sizes["LUMA"] = whole
    uniforms = clock_uniforms(values) | dict(values)
    for number, one in enumerate(passes):
        _add_pass(one, chain, uniforms, f"{into.name}.{number}", file)
    last = chain.held["MAIN"]
    named = {"t": last, "luma": chain.held["LUMA"]} if "LUMA" in chain.held else {"t": last}
    size = chain.sizes["LUMA" if "LUMA" in chain.held else "MAIN"]
    text = _JOINED if "luma" in named else _COPIED
    return _kernel("joined", text)(into=replace(into, size=Computed(*size)), **cast("dict[str, Any]", named))


def _add_pass(one: _Pass, chain: _Chain, uniforms: Mapping[str, Any], name: str, file: str) -> None:
    """One block: where its condition holds, its pass, and what it replaces or saves."""
    where = f"{file}:{one.block.line}"
    sizes = chain.sizes | {"HOOKED": chain.sizes[one.hook]}
    if any(not holds(text, sizes, f"{where}: WHEN") for text in one.block.all("WHEN")):
        return
    size = tuple(
        rpn_formula(one.block.first(side, f"HOOKED.{side[0].lower()}"), sizes, f"{where}: {side}")
        for side in ("WIDTH", "HEIGHT")
    )
    given: dict[str, Any] = {}
    for parameter in one.kernel.parameters:
        own = parameter.name.removesuffix("_raw")
        texture = one.hook if own == "HOOKED" else "MAIN" if own in _PICTURE else own
        if parameter.name in uniforms:
            given[parameter.name] = uniforms[parameter.name]
        elif texture in chain.held:
            given[parameter.name] = chain.held[texture]
        else:
            raise InputError(f"{where}: //!BIND {own}: no pass before has saved it")
    made = one.kernel(into=_spec(name, (size[0], size[1])), **given)
    saved = one.block.first("SAVE", one.hook)
    saved = "MAIN" if saved in _PICTURE else saved
    chain.held[saved], chain.sizes[saved] = made, (size[0], size[1])
    if saved == "MAIN":
        chain.sizes |= dict.fromkeys((name for name in _PICTURE if name not in _FIXED), (size[0], size[1]))


def _hook_of(block: MpvBlock, file: str) -> str:
    hooks = block.all("HOOK")
    known = next((hook for hook in hooks if hook in _PICTURE or hook == "LUMA"), None)
    if known is None:
        raise InputError(
            f"{file}:{block.line}: //!HOOK {' '.join(hooks)} is not read here; a picture has MAIN, its like, and LUMA"
        )
    return "LUMA" if known == "LUMA" else "MAIN"


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


def _spec(name: str, size: tuple[Formula, Formula]) -> TargetSpec:
    return replace(target(name, "rgba16f"), size=Computed(*size))


def _kernel(name: str, text: str) -> PixelKernel[Target]:
    return PixelKernel[Target].of_program(parse(text, name=name, rows_up=False).program)
