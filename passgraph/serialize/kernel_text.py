"""Serialize kernels as text: functions with the meanings of their names, and shaders with their context.

A function or struct is a *definition*: its text, and the meaning of each name in it that is not part of the language.
A meaning is the number of an earlier definition, or the text of a constant.
"""

from __future__ import annotations

import ast
import json
import math
from collections.abc import Mapping
from dataclasses import asdict
from types import ModuleType
from typing import TYPE_CHECKING, Any, cast

from passgraph.errors import GraphError, KernelError
from passgraph.graph.calls import PixelKernel
from passgraph.language import ir
from passgraph.language.kernel import Kernel
from passgraph.language.meanings import INT_MAX
from passgraph.language.native import MATH, Math
from passgraph.language.parameter_limits import read_range
from passgraph.language.scope import TEXT_NAMES, FunctionSource, ModuleName, Scope, text_scope
from passgraph.language.signature import host_value, literal_value, read_struct, resolve
from passgraph.language.source import MAX_SOURCE_CHARACTERS, Source, check_length
from passgraph.language.symbols import TYPE_MARKERS, UINT_MAX
from passgraph.language.types import UINT, ImageType, Matrix, Scalar, Struct, Type, Vector, innermost, sides_of
from passgraph.ranges import Range
from passgraph.serialize.reader import Document

if TYPE_CHECKING:
    from passgraph.glsl import Shader

#: Most characters of a shader's text, as for shader files.
_MOST_OF_SHADER = 500_000
#: Names of floats in texts of constants.
_CONSTANTS = text_scope({"inf": math.inf, "nan": math.nan})
_NAMES = {id(value): name for name, value in TEXT_NAMES.items()}
_STAGES = ("pixel", "vertex", "fragment")
#: Cost of parsing, in parts of a document that are read in the same time: of a definition, and of each expression or
#: statement of a kernel, token of a shader, and number of a constant.
_PARTS_OF_DEFINITION, _PARTS_OF_NODE = 100, 10


class KernelWriter:
    """Write kernels, and the definitions that they use, each once."""

    def __init__(self, definitions: list[dict[str, Any]]) -> None:
        self.definitions = definitions
        self._numbers: dict[str, int] = {}
        self._open: list[FunctionSource] = []

    def kernel(self, kernel: Kernel, where: str) -> dict[str, Any]:
        """Encode a kernel: its function and stage, or its shader.

        Raises
        ------
        GraphError
            For a kernel without source text, and text that is too long to be decoded.
        """
        shader = getattr(kernel, "shader", None)
        known_sizes = getattr(kernel, "known_sizes", False)
        if shader is not None:
            return {"glsl": asdict(shader), "known_sizes": known_sizes, "math": kernel.math}
        if kernel.definition is None:
            raise GraphError(f"{where}: kernel {kernel.name} has no text, which a document holds; make it from text")
        try:
            function = self._function(kernel.definition, kernel.scopes)
        except KernelError as error:
            raise GraphError(f"{where}: its kernel cannot be serialized: {error}") from None
        return {"stage": kernel.stage, "function": function, "known_sizes": known_sizes, "math": kernel.math}

    def _add(self, file: str, line: int, text: str, names: dict[str, str | int]) -> int:
        check_length(Source(file, text, line))
        record = {"file": file, "line": line, "text": text, "names": dict(sorted(names.items()))}
        key = json.dumps(record)
        if key not in self._numbers:
            self._numbers[key] = len(self.definitions)
            self.definitions.append(record)
        return self._numbers[key]

    def _function(self, function: FunctionSource, scopes: Mapping[FunctionSource, Scope]) -> int:
        if function in self._open:
            raise KernelError(f"{function.name} names itself, by way of what it calls")
        self._open.append(function)
        names: dict[str, str | int] = {}
        # Names in the signature are resolved in the function's own scope, those in the body in this kernel's.
        body = scopes[function].meanings if function in scopes else {}
        for path, meaning in {**function.scope.meanings, **body}.items():
            if isinstance(meaning, FunctionSource):
                names[path] = self._function(meaning, scopes)
            elif isinstance(meaning, Struct):
                names[path] = self._struct(meaning)
            elif not isinstance(meaning, ModuleName) and (text := _text(meaning)) != path:
                names[path] = text
        self._open.pop()
        node, source = function.node, function.source
        first = min([node.lineno, *(decorator.lineno for decorator in node.decorator_list)])
        lines = source.lines[first - 1 : node.end_lineno]
        return self._add(source.file, source.first_line + first - 1, "\n".join(lines), names)

    def _struct(self, struct: Struct) -> int:
        names: dict[str, str | int] = {}
        lines, defaults = [f"class {struct.name}:"], dict(struct.defaults)
        for name, type_ in struct.fields:
            written = f"{name}: {self._annotation(type_, names)}"
            lines.append(f"    {written} = {_host_text(defaults[name])}" if name in defaults else f"    {written}")
        return self._add("<struct>", 1, "\n".join(lines), names)

    def _annotation(self, type_: Type, names: dict[str, str | int]) -> str:
        inner = innermost(type_)
        text = str(inner)
        if isinstance(inner, Struct):
            number = self._struct(inner)
            # Structs of different modules may have the same name.
            while text in TEXT_NAMES or names.setdefault(text, number) != number:
                text += "_"
        for side in reversed(sides_of(type_) if inner is not type_ else ()):
            text = f"Array[{text}, {side}]"
        return text


def _text(meaning: Any) -> str:
    """Return a constant, a range or a name of the language as text."""
    if isinstance(meaning, ir.Literal):
        if meaning.type is UINT:
            return f"uint({_number(meaning.value)})"
        return _number(int(meaning.value) & UINT_MAX if meaning.bits else meaning.value)
    if isinstance(meaning, (ir.Construct, ir.Table)):
        return _host_text(host_value(meaning))
    if isinstance(meaning, Range):
        low, high = (None if end is None else float(end) for end in (meaning.low, meaning.high))
        return f"Range({low}, {high}, {meaning.unit!a}, {meaning.above}, {meaning.odd})"
    if isinstance(meaning, (Scalar, Vector, Matrix, ImageType)):
        return str(meaning)
    return meaning if isinstance(meaning, str) else _NAMES[id(meaning)]


def _host_text(value: Any) -> str:
    """Return a number, tuple, vector or matrix as text."""
    if not isinstance(value, tuple):
        return f"uint({_number(value)})" if TYPE_MARKERS.get(type(value)) == "uint" else _number(value)
    kind = TYPE_MARKERS.get(type(value), "")
    return f"{kind}({', '.join(map(_host_text, value))}{',' if not kind else ''})"


def _number(value: ir.Number) -> str:
    """Return a number as text: bit patterns as such, and NaN with its sign."""
    if isinstance(value, float) and math.isnan(value):
        return "-nan" if math.copysign(1.0, value) < 0 else "nan"
    if isinstance(value, (bool, float)):
        return repr(value)
    return hex(value) if value > INT_MAX else str(int(value))


class KernelReader:
    """Read the data of :class:`KernelWriter`: untrusted text, which is parsed and never executed."""

    def __init__(self, document: Document) -> None:
        self.document = document
        self.definitions: list[FunctionSource | Struct] = []

    def definition(self, data: object, where: str) -> FunctionSource | Struct:
        """Parse a function or struct, to which later ones may refer.

        Raises
        ------
        InputError
            For text that is neither, and unknown names.
        """
        document = self.document
        record = document.record(data, where, "file", "line", "text", "names")
        file = document.text(record["file"], f"{where}.file")
        line = document.integer(record["line"], where, 1, 1 << 31)
        text = document.text(record["text"], f"{where}.text", MAX_SOURCE_CHARACTERS)
        document.count(_PARTS_OF_DEFINITION + len(text) // 4, where)
        names = document.entries(record["names"], f"{where}.names")
        own = {path: self._meaning(entry, f"{where}.names.{path}") for path, entry in names.items()}
        with document.at(where):
            source, scope = check_length(Source(file, text, line)), text_scope(self._dotted(own, f"{where}.names"))
            body = source.parse().body
            if len(body) == 1 and isinstance(body[0], ast.FunctionDef):
                return FunctionSource.of_node(source, body[0], scope)
            if len(body) == 1 and isinstance(body[0], ast.ClassDef):
                return read_struct(body[0], source, scope)
        document.wrong(f"{where}.text", "one function, or one class of typed fields", text)

    def _meaning(self, data: object, where: str) -> object:
        document = self.document
        if not isinstance(data, str):
            return document.index(data, where, self.definitions, "definitions")
        if data in TEXT_NAMES:
            return TEXT_NAMES[data]
        text = document.text(data, where, MAX_SOURCE_CHARACTERS)
        document.count(_PARTS_OF_NODE * (1 + text.count(",")), where)
        with document.at(where):
            source = Source(where, text)
            body = source.parse().body if text.isascii() else []
            if len(body) == 1 and isinstance(body[0], ast.Expr):
                node = body[0].value
                if isinstance(node, ast.Call) and resolve(node.func, _CONSTANTS, source) is Range:
                    return read_range(node, lambda name: resolve(name, _CONSTANTS, source), source)
                return literal_value(node, source, _CONSTANTS)
        document.wrong(where, "a number of a definition before it, a constant, or a name of the language", data)

    def _dotted(self, names: Mapping[str, object], where: str) -> dict[str, object]:
        """Convert dotted names to a scope: ``math.pi`` becomes ``pi`` of a module ``math``."""
        namespace: dict[str, object] = {}
        for path, value in names.items():
            *modules, last = path.split(".")
            inner = namespace
            for name in modules:
                module = inner.setdefault(name, ModuleType(name))
                if not isinstance(module, ModuleType):
                    self.document.wrong(where, f"names of which {name!r} is a module or none", path)
                inner = vars(module)
            inner[last] = value
        return namespace

    def kernel(self, data: object, where: str) -> Kernel:
        """Parse a kernel.

        Raises
        ------
        InputError
            For text that is no kernel of that stage, with its file and line.
        """
        document = self.document
        if isinstance(data, Mapping) and "glsl" in data:
            record = document.record(data, where, "glsl", "known_sizes", "math")
            known_sizes = document.flag(record["known_sizes"], f"{where}.known_sizes")
            with document.at(where):
                shader = self._shader(record["glsl"], f"{where}.glsl")
                document.count(_PARTS_OF_NODE * shader.token_count, where)
                kernel: Kernel = PixelKernel.of_shader(shader, known_sizes)
                return self._counted(self._with_math(kernel, record["math"], where), where)
        record = document.record(data, where, "stage", "function", "known_sizes", "math")
        stage, function = record["stage"], record["function"]
        known_sizes = document.flag(record["known_sizes"], f"{where}.known_sizes")
        definition = document.index(function, f"{where}.function", self.definitions, "definitions")
        if not isinstance(definition, FunctionSource):
            document.wrong(f"{where}.function", "the number of a function", function)
        if not isinstance(stage, str) or stage not in _STAGES:
            document.wrong(f"{where}.stage", f"one of {', '.join(_STAGES)}", stage)
        with document.at(where):
            parsed = (
                # The kernel's target says how many of its channels the pass computes.
                PixelKernel(definition, known_sizes, alike=True)
                if stage == "pixel"
                else Kernel(definition, cast(ir.Stage, stage))
            )
            return self._counted(self._with_math(parsed, record["math"], where), where)

    def _with_math(self, kernel: Kernel, math: object, where: str) -> Kernel:
        """Return a kernel with its own choice of functions; None leaves it to the program's options."""
        if math is None:
            return kernel
        if not isinstance(math, str) or math not in MATH:
            self.document.wrong(f"{where}.math", f"one of {', '.join(MATH)}, or null", math)
        return kernel.with_math(cast("Math", math))

    def _counted(self, kernel: Kernel, where: str) -> Kernel:
        """Count a kernel's expanded size against the document's limit; short text can expand to much."""
        pending: list[ir.Stmt | ir.Expr] = [*kernel.program.body]
        visited: set[int] = set()
        while pending:
            node = pending.pop()
            if id(node) not in visited:
                visited.add(id(node))
                pending += ir.parts_of(node)
        self.document.count(_PARTS_OF_NODE * len(visited), where)
        return kernel

    def _shader(self, data: object, where: str) -> Shader:
        from passgraph.glsl import ShaderText, parse_shader  # few documents hold shaders

        document = self.document
        flags, tables = ("rows_up", "has_vertex_stage"), ("defines", "values", "included")
        if isinstance(data, Mapping):  # documents from before plain shaders had vertex shaders lack it
            data = {"has_vertex_stage": False, **data}
        record = document.record(data, where, *ShaderText.__dataclass_fields__)
        fields: dict[str, Any] = {}
        for name, value in record.items():
            place = f"{where}.{name}"
            if name in flags:
                fields[name] = document.flag(value, place)
            elif name in tables:
                entries = document.entries(value, place)
                fields[name] = {key: document.text(one, place, _MOST_OF_SHADER) for key, one in entries.items()}
            else:
                fields[name] = document.text(value, place, _MOST_OF_SHADER)
        return parse_shader(ShaderText(**fields))
