"""Vertex shaders of passes over a picture: GLSL that runs them at the corners, before the fragment shader."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

from passgraph.errors import InputError
from passgraph.glsl import syntax as g
from passgraph.glsl.dialect import Dialect
from passgraph.glsl.glsl_parser import Parser
from passgraph.glsl.tokens import Token
from passgraph.glsl.walk import assigned_names
from passgraph.language.source import Span, fail
from passgraph.shaders.containers.corners import MAX_VARYINGS, WITHIN, Varying, interpolated

_HANDED, _GIVEN = frozenset(["varying", "out"]), frozenset(["attribute", "in"])
_LAYERS = _HANDED | _GIVEN | {"flat", "smooth", "noperspective", "centroid", "invariant"}
_END = Token("end", "", Span("", 1, 0, 0))
_FLOATS = re.compile(r"float|vec[234]|mat[234](x[234])?")
#: Outputs that GLSL itself declares, with what the fragment shader calls them.
_BUILT_IN = {"gl_FrontColor": "gl_Color", "gl_FrontSecondaryColor": "gl_SecondaryColor", "gl_TexCoord": "gl_TexCoord"}


@dataclass(frozen=True)
class Inputs:
    """What a format gives to vertex shaders.

    Attributes
    ----------
    at_corner : returns GLSL of a declared input at ``pg_corner``, which is (0, 0) to (1, 1); raises for an unknown one
    known : inputs that the text need not declare, each with its type and its value at ``pg_corner``
    uniforms : uniforms that the format sets, declared or not, each with its type and its value
    functions : functions without parameters, each with the type and the value of its result
    keeps_place : returns True for a value of ``gl_Position``, without spaces, that leaves the picture where it is; it
        also gets the names of inputs that the shader uses for nothing else
    place : a variable of the fragment shader that is the corner's position, interpolated, where the picture moves
    """

    at_corner: Callable[[g.Variable], str]
    keeps_place: Callable[[str, frozenset[str]], bool]
    known: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    uniforms: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    functions: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    place: str = ""


@dataclass(frozen=True)
class VertexStage:
    """GLSL that runs a vertex shader; ``moves`` is False if the picture clearly stays where it is."""

    text: str
    moves: bool


def vertex_stage(tokens: Sequence[Token], file: str, inputs: Inputs, dialect: Dialect | None = None) -> VertexStage:
    """Return GLSL that runs a vertex shader at the corners, with a variable for each output, set at this pixel.

    Names of the vertex shader's own get a prefix, since the fragment shader may use them for something else. Lines keep
    their numbers.
    """
    tree = Parser(list(tokens), file, dialect).shader()
    own = _declared(tree, inputs)
    tokens = [*_undeclared(tokens, inputs.uniforms), _END]
    words = {token.text for token in tokens if token.kind == "name"} - own.names
    built_in = {name: other for name, other in _BUILT_IN.items() if name in words}
    own.handed += [Varying("vec4", other, 8 if "Tex" in name else 0) for name, other in built_in.items()]
    known = {name: one for name, one in inputs.known.items() if name in words - own.uniforms}
    known |= {name: one for name, one in inputs.uniforms.items() if name in words}
    functions = {name: one for name, one in inputs.functions.items() if name in words}
    given = own.given | {name: value for name, (_, value) in known.items()}
    moves = not _stays(tokens, inputs, _never_hidden(tokens, given, known))
    if moves and inputs.place:
        own.handed.append(Varying("vec2", inputs.place, 0))
        given[inputs.place] = "pg_corner"
    if sum(max(1, one.count) for one in own.handed) > MAX_VARYINGS:
        raise InputError(f"{file}: the vertex shader hands on more than {MAX_VARYINGS} values")
    renamed = {name: f"pg_v_{name}" for name in (*own.names, *known, *functions, *filter(None, [inputs.place]))}
    renamed |= {name: f"pg_v_{other}" for name, other in built_in.items()}
    renamed |= {name: f"pg_a_{name}" for name in known.keys() & built_in.values()}  # gl_Color is an input, too
    before = ["vec2 pg_corner; vec4 pg_v_gl_Position; float pg_v_gl_PointSize;"]
    before += [f"{type_} {renamed[name]};" for name, (type_, _) in known.items()]
    before += [f"{type_} pg_v_{name}() {{ return {value}; }}" for name, (type_, value) in functions.items()]
    ours = {*built_in.values(), inputs.place}
    before += [f"{one.type} pg_v_{one.name}{_length(one)};" for one in own.handed if one.name in ours]
    lines = [f"{' '.join(before)} {_text(_renamed(tokens, renamed))}"]
    lines += [f"{one.type} {one.name}{_length(one)};" for one in own.handed]
    # Each vertex begins with the globals as they are declared.
    changing = list(_changing(tree))
    lines += [f"{type_} pg_0_{name}{'[]' * sides} = {renamed[name]};" for name, type_, sides in changing]
    corners = "".join(f"{renamed[name]} = pg_0_{name}; " for name, _, _ in changing)
    corners += "".join(f"{renamed[name]} = {value}; " for name, value in given.items())
    # Colors of fixed functions are clamped (OpenGL 2.1, section 2.14.6).
    clamped = [f"pg_v_{other} = clamp(pg_v_{other}, 0.0, 1.0);" for other in built_in.values() if "Color" in other]
    lines += [f"void pg_vertex() {{ {corners}pg_v_main(); {' '.join(clamped)} }}"]
    # Outputs are computed before the fragment shader, whose globals may use them.
    run = interpolated(own.handed, moves)
    lines += [WITHIN, "float pg_run() {", *run, "  return 0.0; }", "float pg_done = pg_run();"]
    lines += ["vec4 gl_FragCoord = vec4(gl_FragCoord.xy, pg_zw);"] if moves else []
    return VertexStage("\n".join(lines), moves)


@dataclass
class _Declared:
    """What a vertex shader declares outside of functions; ``given`` are inputs, with their values."""

    names: set[str] = field(default_factory=lambda: {"gl_Position", "gl_PointSize"})
    uniforms: set[str] = field(default_factory=set)
    handed: list[Varying] = field(default_factory=list)
    given: dict[str, str] = field(default_factory=dict)


def _declared(tree: Sequence[g.Outer], inputs: Inputs) -> _Declared:
    own = _Declared()
    for node in tree:
        if isinstance(node, g.Interface) and not node.qualifiers & {"uniform", "buffer"}:
            fail(node.span, "a vertex shader hands on variables here, no blocks; declare each of them as out")
        if isinstance(node, (g.Function, g.Struct)):
            own.names.add(node.name)
        elif isinstance(node, g.Declaration):
            variables = [variable for variable in node.variables if variable.name not in _BUILT_IN]
            names = own.uniforms if "uniform" in node.qualifiers else own.names
            names |= {variable.name for variable in variables}
            if node.qualifiers & _HANDED:
                own.handed += map(_varying, variables)
            elif node.qualifiers & _GIVEN:
                own.given |= {variable.name: inputs.at_corner(variable) for variable in variables}
    return own


def _length(one: Varying) -> str:
    return f"[{one.count}]" if one.count else ""


def _changing(tree: Sequence[g.Outer]) -> Iterator[tuple[str, str, int]]:
    """Yield the globals with a value that functions change: name, type, and the count of its lengths."""
    functions = [node for node in tree if isinstance(node, g.Function)]
    named: dict[str, list[g.Function]] = {}
    for function in functions:
        named.setdefault(function.name, []).append(function)
    changed = assigned_names(tuple(functions), lambda name: named.get(name, ()))
    structs = {node.name for node in tree if isinstance(node, g.Struct)}
    for node in (one for one in tree if isinstance(one, g.Declaration) and "uniform" not in one.qualifiers):
        for variable in node.variables:
            if variable.value is not None and variable.name in changed:
                type_ = variable.type.name
                yield variable.name, f"pg_v_{type_}" if type_ in structs else type_, len(variable.type.lengths)


def _varying(variable: g.Variable) -> Varying:
    """Return a varying; it must be of floats, since only these are interpolated."""
    lengths = variable.type.lengths
    length = lengths[0] if lengths else None
    number = length.value if isinstance(length, g.Number) else None
    type_ = variable.type.name
    if not _FLOATS.fullmatch(type_) or len(lengths) > 1 or (lengths and not isinstance(number, int)):
        fail(variable.span, f"a vertex shader hands on floats, vectors and matrices of them here, got {type_}")
    return Varying(type_, variable.name, number if isinstance(number, int) else 0)


def _undeclared(tokens: Sequence[Token], uniforms: Mapping[str, tuple[str, str]]) -> Iterator[Token]:
    """Yield the tokens without declarations of uniforms that the format sets, and of GLSL's own outputs."""
    at = 0
    while at < len(tokens):
        word = tokens[at].text
        if word != "uniform" and word not in _HANDED:
            yield tokens[at]
            at += 1
            continue
        end = next((k for k in range(at, len(tokens)) if tokens[k].text in (";", "{")), len(tokens) - 1) + 1
        statement = tokens[at:end]
        ours = [token for token in statement if token.text in (uniforms if word == "uniform" else _BUILT_IN)]
        if not ours:
            yield from statement
        elif len(ours) <= sum(token.text == "," for token in statement):
            fail(ours[0].span, f"{ours[0].text} is declared together with others; give it a declaration of its own")
        at = end


def _never_hidden(tokens: Sequence[Token], given: Iterable[str], known: Collection[str]) -> frozenset[str]:
    """Return the inputs whose names nothing else has: a name behind another word is declared there."""
    pairs = Counter(
        token.text for before, token in pairwise(tokens) if before.kind == "name" and before.text != "return"
    )
    return frozenset(name for name in given if pairs[name] == (name not in known))


def _stays(tokens: Sequence[Token], inputs: Inputs, never_hidden: frozenset[str]) -> bool:
    """Return True if the shader clearly does not move the picture."""
    for i, token in enumerate(tokens):
        following = tokens[i + 1 : i + 60]
        if token.text == "gl_Position" and following and following[0].text not in (";", ",", ")"):
            end = next((k for k, other in enumerate(following) if other.text == ";"), 0)
            value = "".join(_plain(other) for other in following[1:end])
            if following[0].text != "=" or not inputs.keeps_place(value, never_hidden):
                return False
    return True


def _plain(token: Token) -> str:
    """Return a token's text; ``1.``, ``1`` and ``1.0`` are written alike."""
    return token.text[0] if re.fullmatch(r"[01](\.0*)?", token.text) else token.text


def _renamed(tokens: Sequence[Token], names: Mapping[str, str]) -> Iterator[tuple[str, Span]]:
    """Yield the words with the shader's own names renamed, without qualifiers of stage inputs and outputs."""
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
            yield names[token.text] if own else token.text, token.span
        before = token.text


def _text(words: Iterable[tuple[str, Span]]) -> str:
    """Join words to text, with line breaks up to each word's line in the file."""
    pieces: list[str] = []
    line = 1
    for word, span in words:
        pieces.append("\n" * max(0, span.line - line) + word)
        line = max(line, span.line)
    return " ".join(pieces)
