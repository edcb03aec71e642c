"""ISF files: shaders with a JSON header that names inputs, passes and persistent buffers (isf.video, version 2)."""

from __future__ import annotations

import ast
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

from passgraph.arguments import shown
from passgraph.errors import InputError
from passgraph.glsl import parse
from passgraph.glsl import syntax as g
from passgraph.glsl.preprocess import preprocessed
from passgraph.graph.calls import PixelKernel
from passgraph.graph.run_values import MAX_DEPTH, Formula
from passgraph.graph.targets import Computed, Relative, Target, TargetSpec, previous, target
from passgraph.language.kernel import kernel_from_text
from passgraph.language.source import fail
from passgraph.language.types import BOOL, FLOAT, INT, VEC2, VEC4, Scalar, Type, Vector, component_count
from passgraph.reading import parsed_json
from passgraph.shaders.containers.clock import PRELUDE, SECONDS, clock_parameters, clock_uniforms
from passgraph.shaders.containers.effect import (
    ShaderEffect,
    ShaderParameter,
    name_of,
    notes_of,
    shader_text,
)
from passgraph.shaders.containers.shader_images import handle_or_black, imported, shown_with_kept
from passgraph.shaders.containers.vertex_stage import Inputs, vertex_stage

#: Most characters of a formula.
MAX_LENGTH = 500
_SIDES = {"WIDTH": "width", "HEIGHT": "height"}
_SIGNS: dict[type[ast.operator], str] = {ast.Add: "add", ast.Sub: "sub", ast.Mult: "mul", ast.Div: "div"}
_FUNCTIONS = {"floor": 1, "ceil": 1, "abs": 1, "min": 2, "max": 2}


def size_formula(text: str, values: Mapping[str, Any], where: str) -> Formula:
    """Parse a formula, with the current values of parameters; the text is never executed.

    >>> size_formula("max(floor($WIDTH*0.25),$least)", {"least": 2.0}, "WIDTH")
    ('max', ('floor', ('mul', 'width', 0.25)), 2.0)
    """
    plain = re.sub(r"\$(\w+)", r"pg_\1", text)
    if len(text) > MAX_LENGTH:
        raise InputError(f"{where}: a size has at most {MAX_LENGTH} characters, got {len(text)}")
    try:
        tree = ast.parse(plain.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise InputError(f"{where}: {text!r} is no formula of $WIDTH and $HEIGHT") from None
    return _formula(tree, values, text, where, 0)


def _formula(node: ast.expr, values: Mapping[str, Any], text: str, where: str, depth: int) -> Formula:
    if depth >= MAX_DEPTH:
        raise InputError(f"{where}: {text!r} nests deeper than {MAX_DEPTH}")

    def part(inner: ast.expr) -> Formula:
        return _formula(inner, values, text, where, depth + 1)

    if isinstance(node, ast.Constant) and isinstance(node.value, (int, float)) and not isinstance(node.value, bool):
        return float(node.value)
    if isinstance(node, ast.Name) and node.id.startswith("pg_"):
        return _named(node.id.removeprefix("pg_"), values, text, where)
    if isinstance(node, ast.BinOp) and type(node.op) in _SIGNS:
        return _SIGNS[type(node.op)], part(node.left), part(node.right)
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.USub, ast.UAdd)):
        return ("neg", part(node.operand)) if isinstance(node.op, ast.USub) else part(node.operand)
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and not node.keywords:
        name = node.func.id
        if _FUNCTIONS.get(name) == len(node.args):
            return name, *(part(argument) for argument in node.args)
    raise InputError(
        f"{where}: {text!r} has {ast.unparse(node)!r}; a size has numbers, $WIDTH, $HEIGHT, $parameters, + - * / and "
        f"{', '.join(_FUNCTIONS)}"
    )


def _named(name: str, values: Mapping[str, Any], text: str, where: str) -> Formula:
    if name in _SIDES:
        return _SIDES[name]
    if name not in values:
        raise InputError(f"{where}: {text!r} has ${name}, which is no parameter; there are $WIDTH and $HEIGHT")
    return float(values[name])


MAX_INPUTS, MAX_PASSES, MAX_IMPORTED = 256, 64, 32
#: The comment that holds the header; line comments may stand before it.
_HEADER = re.compile(r"(?:\s|//[^\n]*\n)*+/\*(.*?)\*/", re.DOTALL)
_NAME = re.compile(r"[A-Za-z_]\w{0,63}")
#: Type of an input → that of its uniform; None for pictures.
_TYPES: dict[str, Type | None] = {
    "float": FLOAT, "bool": BOOL, "event": BOOL, "long": INT, "point2d": VEC2, "color": VEC4,
    "image": None, "audio": None, "audiofft": None, "cube": None,
}  # fmt: skip


@dataclass(frozen=True)
class IsfPass:
    """A pass: its buffer (empty for the picture itself), the buffer's size (None for the picture's), and more."""

    target: str
    size: tuple[str, str]
    persistent: bool
    is_float: bool

    def formulas(self, values: Mapping[str, Any], where: str) -> tuple[Formula, Formula] | None:
        """Return its size as formulas, with parameters replaced by their values."""
        if not any(self.size):
            return None
        width, height = (text or name for text, name in zip(self.size, ("$WIDTH", "$HEIGHT"), strict=True))
        return size_formula(width, values, f"{where}: WIDTH"), size_formula(height, values, f"{where}: HEIGHT")


@dataclass(frozen=True)
class IsfHeader:
    """An ISF header."""

    description: str
    credit: str
    parameters: Mapping[str, ShaderParameter]
    images: tuple[str, ...]
    imported: Mapping[str, object]  # name → path
    passes: tuple[IsfPass, ...]


def is_isf(text: str) -> bool:
    """Return True if a text begins with a comment that holds a JSON object, after line comments."""
    match = _HEADER.match(text)
    return match is not None and match[1].lstrip().startswith("{")


def read_header(text: str, file: str) -> IsfHeader:
    """Parse the header of an ISF file.

    Raises
    ------
    InputError
        For invalid JSON, with line and column, and for entries that ISF does not have.
    """
    match = _HEADER.match(text)
    if match is None:
        raise InputError(f"{file}: an ISF file begins with a comment that holds a JSON object")
    try:
        header = parsed_json(match[1])
    except json.JSONDecodeError as error:
        before = text[: match.start(1) + error.pos]
        line, column = before.count("\n") + 1, len(before) - (before.rfind("\n") + 1) + 1
        shown_line = text.splitlines()[line - 1] if line <= len(text.splitlines()) else ""
        raise InputError(
            f"{file}:{line}: the header is no JSON: {error.msg}\n    {shown_line}\n    {' ' * (column - 1)}^"
        ) from None
    except ValueError as error:
        raise InputError(f"{file}: the header is no JSON: {error}") from None
    return _header(_object(header, f"{file}: the header"), file)


def _header(header: Mapping[str, Any], file: str) -> IsfHeader:
    parameters: dict[str, ShaderParameter] = {}
    images: list[str] = []
    for number, entry in enumerate(_list(header.get("INPUTS", []), f"{file}: INPUTS", MAX_INPUTS)):
        where = f"{file}: INPUTS[{number}]"
        one = _object(entry, where)
        name = _name(one.get("NAME"), where)
        if name in parameters or name in images:
            raise InputError(f"{where}: there are two inputs {name!r}")
        kind = str(one.get("TYPE", "")).lower()
        if kind not in _TYPES:
            raise InputError(f"{where}: TYPE is one of {', '.join(_TYPES)}; got {shown(one.get('TYPE'))}")
        type_ = _TYPES[kind]
        if type_ is None:
            images.append(name)
        else:
            parameters[name] = _parameter(name, type_, one, where)
    passes = tuple(
        _pass(_object(one, f"{file}: PASSES[{i}]"), f"{file}: PASSES[{i}]")
        for i, one in enumerate(_list(header.get("PASSES", []), f"{file}: PASSES", MAX_PASSES))
    )
    # The frame comes first, in any position in the file.
    images.sort(key=lambda name: name != "inputImage")
    return IsfHeader(
        str(header.get("DESCRIPTION", "")), str(header.get("CREDIT", "")), parameters, tuple(images),
        _imported(header.get("IMPORTED", {}), file), passes or (IsfPass("", ("", ""), False, False),),
    )  # fmt: skip


def _parameter(name: str, type_: Scalar | Vector | Type, one: Mapping[str, Any], where: str) -> ShaderParameter:
    low, high = (_limit(one.get(key), type_, f"{where}: {key}") for key in ("MIN", "MAX"))
    choices: dict[str, int] = {}
    if type_ is INT and "VALUES" in one:
        values = [int(_number(v, f"{where}: VALUES")) for v in _list(one["VALUES"], f"{where}: VALUES", 4096)]
        labels = [str(label) for label in _list(one.get("LABELS", []), f"{where}: LABELS", 4096)]
        labels += [str(value) for value in values[len(labels) :]]
        choices = dict(zip(labels, values, strict=False))
    if "DEFAULT" in one:
        default = _default(one["DEFAULT"], type_, f"{where}: DEFAULT")
    elif choices:
        default = next(iter(choices.values()))
    elif type_ is FLOAT and low is not None and low > 0:
        default = low
    else:
        default = _default(0, type_, where)
    if type_ is BOOL:
        low = high = None
    # Hosts use a default outside of its range, so the range is extended to it.
    if isinstance(default, (int, float)):
        low = low if low is None else min(low, default)
        high = high if high is None else max(high, default)
    return ShaderParameter(name, type_, default, low, high, str(one.get("LABEL", "")), choices)


def _default(value: Any, type_: Type, where: str) -> Any:
    count = component_count(type_)
    if count == 1:
        number = _number(value, where)
        return bool(number) if type_ is BOOL else int(number) if type_ is INT else float(number)
    parts = value if isinstance(value, list) else [value] * count
    numbers = [float(_number(part, where)) for part in parts[:count]]
    # Colors may omit alpha.
    return tuple(numbers + [1.0] * (count - len(numbers)))


def _limit(value: Any, type_: Type, where: str) -> Any:
    if value is None or type_ is BOOL:
        return None
    count = component_count(type_)
    if isinstance(value, list) and count > 1:
        if len(value) < count:
            raise InputError(f"{where} must be {count} numbers, got {shown(value)}")
        return tuple(float(_number(part, where)) for part in value[:count])
    return float(_number(value, where))


def _pass(one: Mapping[str, Any], where: str) -> IsfPass:
    one = {key.upper(): value for key, value in one.items()}
    target = one.get("TARGET", "")
    if target:
        target = _name(target, where)
    sizes = tuple(str(one.get(key, "")) for key in ("WIDTH", "HEIGHT"))
    return IsfPass(target, (sizes[0], sizes[1]), _flag(one.get("PERSISTENT")), _flag(one.get("FLOAT")))


def _imported(imported: Any, file: str) -> dict[str, object]:
    """Return the imports by name: version 2 has an object, version 1 a list."""
    where = f"{file}: IMPORTED"
    if isinstance(imported, list):
        rows = [_object(one, where) for one in _list(imported, where, MAX_IMPORTED)]
        return {_name(one.get("NAME"), where): one.get("PATH") for one in rows}
    imports = _object(imported, where)
    if len(imports) > MAX_IMPORTED:
        raise InputError(f"{where}: {len(imports)} pictures; at most {MAX_IMPORTED}")
    return {_name(name, where): _object(one, where).get("PATH") for name, one in imports.items()}


def _flag(value: Any) -> bool:
    return value is True or str(value).lower() in ("1", "1.0", "true", "yes")


def _object(value: Any, where: str) -> Mapping[str, Any]:
    if not isinstance(value, dict):
        raise InputError(f"{where} must be an object, got {shown(value)}")
    return value


def _list(value: Any, where: str, most: int) -> list[Any]:
    if not isinstance(value, list):
        raise InputError(f"{where} must be a list, got {shown(value)}")
    if len(value) > most:
        raise InputError(f"{where} has {len(value)} entries; at most {most}")
    return value


def _name(value: Any, where: str) -> str:
    if not isinstance(value, str) or not _NAME.fullmatch(value):
        raise InputError(f"{where}: a name has letters, digits and underscores, got {shown(value)}")
    return value


def _number(value: Any, where: str) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        number = float("nan")
    if not abs(number) < 3.4e38:
        raise InputError(f"{where} must be a number, got {shown(value)}")
    return number


#: ISF is GLSL 1.20, unless a text says otherwise.
_DEFINES = {"__VERSION__": "120"}


def _no_input(variable: g.Variable) -> str:
    fail(variable.span, f"input {variable.name} has no value in ISF; isf_FragNormCoord is the corner")


#: What hosts give to vertex shaders. Pixels show the position that has moved to them.
_INPUTS = Inputs(
    _no_input,
    keeps_place=lambda value, inputs: False,
    known=dict.fromkeys(("isf_FragNormCoord", "vv_FragNormCoord"), ("vec2", "pg_corner")),
    functions=dict.fromkeys(
        ("isf_vertShaderInit", "vv_vertShaderInit"),
        ("vec4", "pg_v_gl_Position = vec4(pg_corner * 2.0 - 1.0, 0.0, 1.0)"),
    ),
    place="pg_here",
)
_MOVED = "\n#define isf_FragNormCoord pg_here\n#define vv_FragNormCoord pg_here\n"


def vertex_prelude(text: str, file: str) -> str:
    """Return GLSL that runs a vertex shader before the fragment shader."""
    tokens, _ = preprocessed([(text, file)], _DEFINES, None)
    stage = vertex_stage(tokens, file, _INPUTS)
    return stage.text + _MOVED if stage.moves else stage.text


#: Values that hosts set. No time has passed before the first frame.
_VALUES = {
    "TIME": SECONDS, "TIMEDELTA": "pg_frame == 0 ? 0.0 : pg_step", "FRAMEINDEX": "pg_frame", "DATE": "pg_date",
    "RENDERSIZE": "pg_output_size",
}  # fmt: skip
_BEFORE = f"""{PRELUDE}
#define IMG_SIZE(image) vec2(textureSize(image, 0))
#define IMG_NORM_PIXEL(image, at) texture2D(image, at)
#define IMG_PIXEL(image, at) texture2D(image, (at) / IMG_SIZE(image))
#define IMG_THIS_NORM_PIXEL(image) texture2D(image, isf_FragNormCoord)
#define IMG_THIS_PIXEL(image) texture2D(image, isf_FragNormCoord)
"""
_WHERE = "".join(
    f"#ifndef {name}_FragNormCoord\n#define {name}_FragNormCoord pg_position\n#endif\n" for name in ("isf", "vv")
)


def read_isf(text: str, path: Path) -> ShaderEffect:
    """Read an ISF file as an effect, with a vertex shader of the same name in its folder.

    Raises
    ------
    InputError
        For an invalid header.
    KernelError
        For an unsupported shader, with file, line and caret.
    """
    file = str(path)
    header = read_header(text, file)
    prelude = _BEFORE + _declared(header)
    vertex = path.with_suffix(".vs")
    if vertex.is_file():
        prelude += vertex_prelude(shader_text(vertex, "a vertex shader"), str(vertex)) + "\n"
    shaders = [
        parse(
            text, name=f"{name_of(path)}{number or ''}", file=file, prelude=prelude + _WHERE,
            defines=_DEFINES, values=_VALUES | {"PASSINDEX": str(number)},
        )
        for number in range(len(header.passes))
    ]  # fmt: skip
    kernels = [PixelKernel[Target].of_shader(shader) for shader in shaders]
    used = {parameter.name for kernel in kernels for parameter in kernel.parameters}
    parameters = clock_parameters(used, header.parameters) | dict(header.parameters)
    graph = _Graph(header, kernels, path)
    summary = header.description.strip().partition("\n")[0] or f"{path.stem}: an ISF shader"
    return ShaderEffect(
        name_of(path), "ISF", summary, header.credit, header.images, parameters, notes_of(shaders), file, graph.built,
        frozenset(re.findall(r"\$(\w+)", " ".join(side for one in header.passes for side in one.size))),
    )  # fmt: skip


def _declared(header: IsfHeader) -> str:
    """Return the declarations of uniforms for the header's inputs."""
    names = [*header.images, *header.imported, *(one.target for one in header.passes if one.target)]
    lines = [f"uniform sampler2D {name};" for name in dict.fromkeys(names)]
    lines += [f"#define _{name}_imgRect vec4(0.0, 0.0, IMG_SIZE({name}))" for name in dict.fromkeys(names)]
    lines += [f"#define _{name}_imgSize IMG_SIZE({name})" for name in dict.fromkeys(names)]
    lines += [f"uniform {one.type} {one.name};" for one in header.parameters.values()]
    return "\n".join(lines) + "\n"


@cache
def _showing(scaled: bool) -> PixelKernel[Target]:
    """Return the kernel that shows a buffer with a size of its own, or of the output's size."""
    read = ".sample(uv())" if scaled else "[0, 0]"
    return PixelKernel[Target](kernel_from_text(f"def shown(buffer: Image) -> vec4: return buffer{read}"))


class _Graph:
    """The passes of a file, ready to be called."""

    def __init__(self, header: IsfHeader, kernels: list[PixelKernel[Target]], path: Path) -> None:
        self.header, self.kernels, self.path = header, kernels, path
        self.imported = {name: imported(name, at, path.parent, str(path)) for name, at in header.imported.items()}

    def built(self, pictures: Mapping[str, Target], values: Mapping[str, Any], into: TargetSpec) -> Target:
        specs = self._specs(values, into)

        def draw(shown: TargetSpec) -> list[Target]:
            if specs[-1] is into:
                return self._drawn(pictures, values, [*specs[:-1], shown])
            drawn = self._drawn(pictures, values, specs)
            return [*drawn, _showing(isinstance(specs[-1].size, Computed))(buffer=drawn[-1], into=shown)]

        return shown_with_kept(draw, f"{into.name}.shown", into)

    def _drawn(
        self, pictures: Mapping[str, Target], values: Mapping[str, Any], specs: list[TargetSpec]
    ) -> list[Target]:
        """Return the target of each pass."""
        last = {one.target: spec for one, spec in zip(self.header.passes, specs, strict=True) if one.target}
        persistent = {one.target for one in self.header.passes if one.target and one.persistent}
        uniforms = dict(values) | clock_uniforms(values, self.header.parameters)
        buffers: dict[str, Target] = {}
        drawn: list[Target] = []
        for one, spec, kernel in zip(self.header.passes, specs, self.kernels, strict=True):
            arguments: dict[str, Any] = {}
            for parameter in kernel.parameters:
                name = parameter.name
                if name in uniforms:
                    arguments[name] = uniforms[name]
                elif name in buffers:
                    arguments[name] = buffers[name]
                elif name in persistent:
                    arguments[name] = previous(last[name])
                else:
                    arguments[name] = handle_or_black(pictures.get(name) or self.imported.get(name))
            drawn.append(kernel.called(arguments, spec))
            if one.target:
                buffers[one.target] = drawn[-1]
        return drawn

    def _specs(self, values: Mapping[str, Any], into: TargetSpec) -> list[TargetSpec]:
        """Return a target for each pass; the last one's is the caller's, unless it draws into a persistent buffer."""
        specs: list[TargetSpec] = []
        for number, one in enumerate(self.header.passes):
            # A persistent buffer, or one with a size, keeps the file's format and size.
            if number == len(self.header.passes) - 1 and not (one.target and (one.persistent or any(one.size))):
                specs.append(into)
                break
            formulas = one.formulas(values, f"{self.path}: PASSES[{number}]")
            size = Relative() if formulas is None else Computed(*formulas)
            spec = target(f"{into.name}.{one.target or 'pass'}.{number}", "rgba32f" if one.is_float else "rgba8")
            specs.append(replace(spec, size=size))
        return specs
