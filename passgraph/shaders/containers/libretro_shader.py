"""One libretro shader (``.glsl``): a vertex and a fragment shader in one text, told apart by macros, as one kernel.

The vertex half runs at the picture's corners.  Its names are renamed, so that both halves may have functions and types
of the same name, and it stands before the fragment half, which finds what it hands on as variables that are set.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator
from itertools import pairwise
from pathlib import Path

from passgraph.errors import InputError
from passgraph.language.source import Span, fail
from passgraph.language.types import FLOAT
from passgraph.shaders.containers.corners import MAX_VARYINGS, WITHIN, Varying, interpolated
from passgraph.shaders.containers.effect import ShaderParameter
from passgraph.shaders.glsl import Shader, parse
from passgraph.shaders.glsl import syntax as g
from passgraph.shaders.glsl.parse import Parser
from passgraph.shaders.glsl.preprocess import preprocessed
from passgraph.shaders.glsl.tokens import Token

#: From version 130 on, some declare an output and write gl_FragColor all the same.
_DEFINES = {"PARAMETER_UNIFORM": "1", "__VERSION__": "120"}
_HALVES = re.compile(r"^[ \t]*#[ \t]*(?:el)?if.*\b(VERTEX|FRAGMENT)\b", re.MULTILINE)
_PARAMETER = re.compile(
    r'^[ \t]*#pragma[ \t]+parameter[ \t]+(\w+)[ \t]+"([^"\n]*)"[ \t]+(\S+)(?:[ \t]+(\S+)[ \t]+(\S+))?', re.MULTILINE
)
#: Where what the player sets for each pass may be declared, and which variables of a prelude are here.
_SET = re.compile(r"\buniform\s+(?:\w+\s+)??(?:vec2\s+(?P<names>\w+(?:\s*,\s*\w+)*)|mat4\s+MVPMatrix)\s*;")
_SIZE = re.compile(r"\w*(?:TextureSize|InputSize)|OutputSize")
_SAMPLER_OF = re.compile(r"(\w*?)(?:TextureSize|InputSize)")
#: Clip space from positions, both with (0, 0) and (1, 1) at corners of the picture.
_MATRIX = (
    "const mat4 MVPMatrix = mat4(2.0, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, -1.0, -1.0, 0.0, 1.0);"
)
#: How shaders say that the picture stays where it is; without spaces.
_STAYS = {
    "MVPMatrix*VertexCoord",
    "+".join(f"VertexCoord.{axis}*MVPMatrix[{i}]" for i, axis in enumerate("xyzw")),
}
_HANDED, _GIVEN = frozenset(["varying", "out"]), frozenset(["attribute", "in"])
_LAYERS = _HANDED | _GIVEN | {"flat", "smooth", "noperspective", "centroid", "invariant"}
_END = Token("end", "", Span("", 1, 0, 0))
_FLOATS = ("float", "vec2", "vec3", "vec4")


def is_libretro(text: str) -> bool:
    """Whether a text has both halves."""
    return {match[1] for match in _HALVES.finditer(text)} == {"VERTEX", "FRAGMENT"}


def shader_parameters(text: str, file: str) -> dict[str, ShaderParameter]:
    """What ``#pragma parameter NAME "label" default low high step`` lines say."""
    found = {}
    for name, label, *numbers in (match.groups() for match in _PARAMETER.finditer(text)):
        try:
            default, low, high = (None if number is None else float(number) for number in numbers)
        except ValueError:
            raise InputError(f"{file}: #pragma parameter {name} has a default and a range, got {numbers}") from None
        if default is None or not all(math.isfinite(number or 0.0) for number in (default, low, high)):
            raise InputError(f"{file}: #pragma parameter {name} has finite numbers, got {numbers}")
        if low is not None and high is not None and low > high:
            low = high = None  # some files turn them round
        found[name] = ShaderParameter(name, FLOAT, default, low, high, label.strip())
    return found


def read_shader(text: str, path: Path, name: str, pictures: Iterable[str]) -> Shader:
    """The kernel of a shader; ``pictures`` are names of samplers whose sizes may be asked for.

    Raises
    ------
    KernelError
        For what is not GLSL or not read here, with file and line.
    """
    file, known = str(path), {f"{picture}Texture" for picture in pictures}
    sizes: dict[str, str] = {}
    for size in (size for match in _SET.finditer(text) for size in _sizes(match)):
        own = _SAMPLER_OF.fullmatch(size)
        if own is not None:
            sampler = f"{own[1]}Texture"
            if sampler not in known:
                raise InputError(f"{file}: {size} is the size of no picture that this pass has")
            sizes[size] = sampler
    plain = _SET.sub(_without, text)
    tokens, _ = preprocessed([(plain, file)], {**_DEFINES, "VERTEX": "1"}, path.parent)
    declared = ["vec2 OutputSize = pg_output_size;", _MATRIX]
    declared += [f"uniform sampler2D {sampler};" for sampler in sorted(set(sizes.values()))]
    declared += [f"vec2 {size} = vec2(textureSize({sampler}, 0));" for size, sampler in sizes.items()]
    prelude = f"{' '.join(declared)} {_vertex_half(tokens, file)}"
    return parse(
        plain, name=name, file=file, prelude=prelude, prelude_file=f"{file}, vertex half",
        defines={**_DEFINES, "FRAGMENT": "1"}, folder=path.parent, rows_up=False,
    )  # fmt: skip


def _sizes(declared: re.Match[str]) -> list[str]:
    """Names of a declaration that are sizes of pictures."""
    return [name for name in re.findall(r"\w+", declared["names"] or "") if _SIZE.fullmatch(name)]


def _without(declared: re.Match[str]) -> str:
    """A declaration without what the player sets: spaces in its place, so that all else keeps its line and column."""
    text, names = declared[0], _sizes(declared)
    if len(names) == len(re.findall(r"\w+", declared["names"] or "")):
        return re.sub(r"\S", " ", text)
    for name in names:
        text = re.sub(rf"\b{name}\s*,|,\s*{name}\b", lambda found: re.sub(r"\S", " ", found[0]), text, count=1)
    return text


def _vertex_half(tokens: list[Token], file: str) -> str:
    """GLSL that runs the vertex half at the corners and leaves a variable for each value that it hands on."""
    tree = Parser(list(tokens), file).shader()
    names: set[str] = {"gl_Position", "gl_PointSize"}
    handed: list[Varying] = []
    given: list[g.Variable] = []
    for node in tree:
        if isinstance(node, (g.Function, g.Struct)):
            names.add(node.name)
        elif isinstance(node, g.Declaration) and "uniform" not in node.qualifiers:
            names |= {variable.name for variable in node.variables}
            if node.qualifiers & _HANDED:
                handed += [_varying(variable) for variable in node.variables]
            elif node.qualifiers & _GIVEN:
                given += node.variables
    if sum(max(1, one.count) for one in handed) > MAX_VARYINGS:
        raise InputError(f"{file}: the vertex half hands on more than {MAX_VARYINGS} values")
    lines = ["vec2 pg_corner; vec4 pg_v_gl_Position; float pg_v_gl_PointSize;", _text(_renamed([*tokens, _END], names))]
    lines += [f"{one.type} {one.name}{f'[{one.count}]' if one.count else ''};" for one in handed]
    corners = "".join(f"pg_v_{one.name} = {_corner_value(one)}; " for one in given)
    lines += [f"void pg_vertex() {{ {corners}pg_v_main(); }}"]
    # A variable whose value is computed before anything of the fragment half, whose globals may ask for it.
    run = interpolated(handed, moved=not _stays(tokens))
    lines += [WITHIN, "float pg_run() {", *run, "  return 0.0; }", "float pg_done = pg_run();"]
    return "\n".join(lines)


def _varying(variable: g.Variable) -> Varying:
    """What is handed on must be floats, which alone are interpolated."""
    lengths = variable.type.lengths
    length = lengths[0] if lengths else None
    whole = length.value if isinstance(length, g.Number) else None
    if variable.type.name not in _FLOATS or len(lengths) > 1 or (lengths and not isinstance(whole, int)):
        fail(variable.span, f"the vertex half hands on floats and vectors of them, got {variable.type.name}")
    return Varying(variable.type.name, variable.name, whole if isinstance(whole, int) else 0)


def _corner_value(variable: g.Variable) -> str:
    """An attribute at a corner: positions, white."""
    type_, name = variable.type.name, variable.name
    if type_ in ("vec2", "vec4") and name.endswith("Coord"):
        return "pg_corner" if type_ == "vec2" else "vec4(pg_corner, 0.0, 1.0)"
    if type_ == "vec4" and name.lower() == "color":
        return "vec4(1.0)"
    fail(variable.span, f"{name} has no value in a pass over a picture; VertexCoord, TexCoord and COLOR have")


def _stays(tokens: list[Token]) -> bool:
    """Whether the picture is plainly left where it is."""
    for i, token in enumerate(tokens):
        following = tokens[i + 1 : i + 60]
        if token.text == "gl_Position" and following and following[0].text not in (";", ",", ")"):
            end = next((k for k, other in enumerate(following) if other.text == ";"), 0)
            if following[0].text != "=" or "".join(t.text for t in following[1:end]) not in _STAYS:
                return False
    return True


def _renamed(tokens: list[Token], names: set[str]) -> Iterator[tuple[str, Span]]:
    """The words with the half's own names renamed, without what makes variables inputs and outputs of a stage."""
    depth, before, struct = 0, "", -1  # the depth of a struct whose fields are named, or -1
    for token, following in pairwise(tokens):
        if token.text == "struct":
            struct = depth
        elif token.text == "}" and struct == depth - 1:
            struct = -1
        depth += {"(": 1, "{": 1, ")": -1, "}": -1}.get(token.text, 0)
        if depth or token.text not in _LAYERS:
            own = token.text in names and token.kind == "name" and before != "."
            own = own and (struct < 0 or depth <= struct or following.kind == "name")  # fields keep their names
            yield f"pg_v_{token.text}" if own else token.text, token.span
        before = token.text


def _text(words: Iterable[tuple[str, Span]]) -> str:
    """Words as text, each on its own line of the file where that is farther down."""
    pieces: list[str] = []
    line = 1
    for word, span in words:
        pieces.append("\n" * max(0, span.line - line) + word)
        line = max(line, span.line)
    return " ".join(pieces)
