"""Kernels as objects: validated where they are defined, checked for constants that changed since."""

from __future__ import annotations

import ast
import dataclasses
import inspect
import sys
import types as pytypes
from collections.abc import Callable, Mapping
from functools import cache
from html import escape
from typing import Any, Self, TypeVar, cast, dataclass_transform

from passgraph.arguments import one_of, shown
from passgraph.cached import cached_property
from passgraph.errors import KernelError, PassgraphError
from passgraph.forking import importing
from passgraph.language import ir
from passgraph.language.native import MATH, Math
from passgraph.language.scope import TEXT_NAMES, FunctionSource, KnownTable, Scope, freeze, python_scope, text_scope
from passgraph.language.signature import literal_value, read_signature, read_struct
from passgraph.language.source import PACKAGE, Source, fail, source_from_text, source_of, source_of_class
from passgraph.language.types import Struct

T = TypeVar("T")


class Kernel:
    """A kernel of one stage.

    It is parsed where it is defined; this package's kernels are parsed at first use, since its tests parse them all and
    a program uses few.
    """

    #: Which functions it calls; None: those that the program's options name.
    math: Math | None = None

    def __init__(self, function: FunctionSource, stage: ir.Stage) -> None:
        self.stage: ir.Stage = stage
        self.name = self.__name__ = function.name
        self.__doc__ = function.doc
        self.definition: FunctionSource | None = function
        self.__module__, self.__qualname__ = function.module, function.qualname
        if not function.is_lazy:
            _ = self.program

    @cached_property
    def _parsed(self) -> tuple[ir.TypedKernel, Mapping[FunctionSource, Scope]]:
        assert self.definition is not None
        with importing:
            # Importing this package does not import the parser.
            from passgraph.language.parse import parse_with_scopes

            return parse_with_scopes(self.definition, self.stage)

    @cached_property
    def program(self) -> ir.TypedKernel:
        """Return the typed representation."""
        if self.definition is None or not self.definition.cache_key:
            return self._parsed[0]
        with importing:
            from passgraph.language import typed_cache

            name = f"{self.stage} {self.definition.cache_key}"
            program = typed_cache.recall(name)
            if program is None:
                program = self._parsed[0]
                typed_cache.remember(name, program)
            return program

    @property
    def scopes(self) -> Mapping[FunctionSource, Scope]:
        """Map each function to the scope that recorded its names."""
        return self._parsed[1]

    @classmethod
    def of_program(cls, program: ir.TypedKernel) -> Self:
        """Return a kernel without a function, from a program parsed elsewhere."""
        kernel = cls.__new__(cls)
        kernel.stage, kernel.__doc__, kernel.definition, kernel._parsed = program.stage, None, None, (program, {})
        kernel.name = kernel.__name__ = program.name
        kernel.__module__ = kernel.__qualname__ = ""
        return kernel

    def computing(self, program: ir.TypedKernel) -> Self:
        """Return the same kernel with another representation."""
        kernel = type(self).__new__(type(self))
        vars(kernel).update(vars(self), program=program)
        return kernel

    def with_math(self, math: Math) -> Self:
        """Return the kernel with functions of its own choice, whatever ``Options(math=...)`` says.

        ``"exact"``: as every backend computes them alike; ``"native"``: the device's own.

        >>> import passgraph as pg
        >>> fast = pg.kernel(source="def glow(color: Image) -> vec4: return exp2(color[0, 0])").with_math("native")
        >>> fast.math
        'native'
        """
        kernel = self.computing(self.program)
        kernel.math = cast("Math", one_of(math, f"kernel {self.name}: math", MATH))
        return kernel

    def __copy__(self) -> Self:
        return self

    def __deepcopy__(self, _: object) -> Self:
        return self

    def __reduce__(self) -> str:
        """Pickle by name, as Python functions are: a kernel captures its surroundings, which a pickle cannot hold."""
        if not self.__qualname__ or "<locals>" in self.__qualname__:
            where = "inside of a function" if self.__qualname__ else "from text"
            raise KernelError(
                f"kernel {self.name} was made {where}, and pickle finds kernels by their names, as it does functions: "
                "define it at the top of a module, or send the graph as plain data: pg.to_data(...), pg.from_data(...)"
            )
        return self.__qualname__

    @property
    def parameters(self) -> tuple[ir.Parameter, ...]:
        return self.program.parameters

    def check_constants(self) -> None:
        """Raise KernelError if a captured constant has changed since the kernel was built."""
        if "_parsed" not in vars(self):
            return  # of this package, and from the cache
        changed = [name for scope in self.scopes.values() for name in scope.changed_constants()]
        if changed:
            raise KernelError(
                f"{self.program.source.file}:{self.program.source.line}: kernel {self.name} captured "
                f"{', '.join(changed)} by value, and it changed since; make it a parameter, or define the "
                "kernel again"
            )

    def __repr__(self) -> str:
        parameters = ", ".join(f"{p.name}: {p.type}" for p in self.parameters)
        return f"<passgraph {self.stage} kernel {self.name}({parameters})>"

    def _repr_mimebundle_(self, **_: object) -> dict[str, str]:
        """Show the parameters in a notebook, with defaults and ranges, and the source."""
        from passgraph import notebook

        rows = [
            (p.name, p.type, notebook.short(p.default) if p.has_default else "", "" if p.range is None else p.range)
            for p in self.parameters
        ]
        shader = getattr(self, "shader", None)
        source = self.definition.source.text if self.definition is not None else "" if shader is None else shader.text
        parts = [f"<p><b>{escape(self.name)}</b>, a {self.stage} kernel</p>"]
        parts.append(notebook.table(("parameter", "type", "default", "range"), rows))
        if source:
            parts.append(f"<pre>{escape(source)}</pre>")
        return notebook.bundle(repr(self), "".join(parts))


def function_source(function: Callable[..., Any]) -> FunctionSource:
    """Return the source text and the scope of a Python function."""
    if isinstance(function, (Kernel, type)) or not inspect.isfunction(function):
        raise PassgraphError(f"a kernel is made from a function, got {type(function).__name__}")
    doc = None if function.__doc__ is None else inspect.cleandoc(function.__doc__)
    names = function.__module__ or "", function.__qualname__, doc, _cache_key(function)
    found = FunctionSource(function.__name__, lambda: _text_of(function), python_scope(function), *names)
    if not found.cache_key:
        _ = found.node
    return found


def _cache_key(function: Callable[..., Any]) -> str:
    """Return the name of a function of this package, and the values that it captures; empty for other functions.

    It is empty, too, for a function that captures something without an unambiguous text.
    """
    if not function.__code__.co_filename.startswith(PACKAGE):
        return ""
    captured: list[object] = []
    try:
        for name, cell in zip(function.__code__.co_freevars, function.__closure__ or (), strict=True):
            inner: FunctionSource | None = getattr(cell.cell_contents, "__passgraph_function__", None)
            if inner is not None and not inner.cache_key:
                return ""
            captured += [name, freeze(cell.cell_contents) if inner is None else inner.cache_key]
    except (TypeError, ValueError):
        return ""
    return f"{function.__module__}.{function.__qualname__}{captured or ''}"


def _text_of(function: Callable[..., Any]) -> tuple[Source, ast.FunctionDef]:
    """Read the text of a Python function."""
    source = source_of(function)
    if function.__name__ == "<lambda>":
        raise KernelError(f"{source.file}:{source.first_line}: a kernel is a def statement, not a lambda")
    node = next((n for n in source.parse().body if isinstance(n, ast.FunctionDef)), None)
    if node is None or node.name != inspect.unwrap(function).__name__:
        raise KernelError(
            f"{source.file}:{source.first_line}: the text of {function.__name__} is no longer available; "
            "the file changed after it was imported"
        )
    return source, node


def function(definition: Callable[..., T]) -> Callable[..., T]:
    """Mark a function for use inside kernels; in ordinary Python it cannot be called.

    Its parameters and result need types.  The body is inlined at each call.
    """
    source = function_source(definition)
    if not source.is_lazy:
        read_signature(source)

    def marked(*_: Any, **__: Any) -> T:
        raise PassgraphError(f"{source.name}() is a function of the kernel language; kernels call it, Python does not")

    marked.__name__, marked.__qualname__ = definition.__name__, definition.__qualname__
    marked.__module__ = definition.__module__  # pickle finds it by its name, as any function
    marked.__doc__ = definition.__doc__
    marked.__passgraph_function__ = source  # type: ignore[attr-defined]
    return marked


@dataclass_transform(frozen_default=True)
def struct(cls: type[T]) -> type[T]:
    """Make a class of typed fields for parameters and varyings; on the host a frozen dataclass.

    >>> @struct
    ... class Sun:
    ...     direction: vec3
    ...     strength: float = 1.0
    """
    decorated: object = cls
    if not isinstance(decorated, type):
        raise KernelError(f"@struct marks a class statement, got {shown(cls)}")
    frame = sys._getframe(1)
    file, line, names = frame.f_code.co_filename, frame.f_lineno, frame.f_globals
    local_names = {} if frame.f_locals is names else dict(frame.f_locals)

    def lookup(name: str) -> object:
        if name in local_names:
            return local_names[name]
        return names[name] if name in names else TEXT_NAMES[name]

    @cache
    def definition() -> Struct:
        source = source_of_class(cls, file, names, line)
        node = next(n for n in source.parse().body if isinstance(n, ast.ClassDef))
        return read_struct(node, source, Scope(lookup))

    if not file.startswith(PACKAGE):  # as kernels of this package, its structs are read at first use
        definition()
    result = dataclasses.dataclass(frozen=True)(cls)
    result.__passgraph_struct__ = definition  # type: ignore[attr-defined]
    return result


def text_functions(text: str, name: str = "<kernel text>") -> tuple[dict[str, FunctionSource], list[str]]:
    """Return the functions, structs and constants of kernel text, without executing any of it.

    Returns
    -------
    tuple
        Every function by name, and the names of those marked ``@kernel`` (or of all if none is marked).

    Raises
    ------
    KernelError
        For a statement other than ``def``, ``class`` with typed fields, an assignment of numbers, or an import of
        passgraph (which is ignored: its names are always available).
    """
    source = source_from_text(text, name)
    names: dict[str, object] = {}
    functions: dict[str, FunctionSource] = {}
    marked: list[str] = []
    tables: dict[int, KnownTable] = {}
    scope = text_scope(names, tables)
    for node in source.parse().body:
        if isinstance(node, ast.FunctionDef):
            functions[node.name] = names[node.name] = FunctionSource.of_node(source, node, text_scope(names, tables))
            if any(_last_name(d) == "kernel" for d in node.decorator_list):
                marked.append(node.name)
        elif isinstance(node, ast.ClassDef):
            names[node.name] = read_struct(node, source, scope)
        else:
            _text_statement(node, source, scope, names)
    return functions, marked or list(functions)


def _last_name(node: ast.expr) -> str:
    return node.id if isinstance(node, ast.Name) else getattr(node, "attr", "")


def _text_statement(node: ast.stmt, source: Source, scope: Scope, names: dict[str, object]) -> None:
    if isinstance(node, ast.Assign) and len(node.targets) == 1 and isinstance(node.targets[0], ast.Name):
        names[node.targets[0].id] = literal_value(node.value, source, scope)
    elif isinstance(node, ast.Import):
        for alias in node.names:
            if alias.name != "passgraph":
                fail(
                    source.span(node),
                    f"kernel text cannot import {alias.name}; the language's names need no import",
                )
            names[alias.asname or alias.name] = _language_module()
    elif isinstance(node, ast.ImportFrom):
        if node.module not in ("passgraph", "__future__"):
            fail(
                source.span(node),
                f"kernel text cannot import {node.module}; the language's names need no import",
            )
    elif not (isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)):
        fail(source.span(node), "kernel text holds functions, structs and named numbers only")


def _language_module() -> pytypes.ModuleType:
    module = pytypes.ModuleType("passgraph")
    vars(module).update(TEXT_NAMES)
    return module


def kernel_from_text(text: str, name: str | None = None, file: str = "<kernel text>") -> FunctionSource:
    """Return the function to use as a kernel: the named one, or the last one marked ``@kernel``, or the last."""
    functions, candidates = text_functions(text, file)
    if not functions:
        raise KernelError(f"{file}: no function is defined here; a kernel is written def name(...) -> vec4:")
    if name is not None and name not in functions:
        raise KernelError(f"{file}: no function {name!r} is defined here; there are {', '.join(functions)}")
    return functions[name if name is not None else candidates[-1]]
