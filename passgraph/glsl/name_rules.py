"""Rules of names, of constant expressions, and of outputs. They hold in code that never runs, too.

Sources: GLSL 3.30 and ES 3.00, sections 4.2.2 "Scoping", 4.3.2 "Constant Qualifier", 4.3.3 "Constant Expressions" and
7.2 "Fragment Shader Special Variables".
GLSL 4.20 and later let the value of a local constant depend on anything (4.20, section 4.3.2).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import chain

from passgraph.glsl import syntax as g
from passgraph.glsl.builtins import BUILTINS, prelude_functions
from passgraph.glsl.elsewhere import elsewhere, mending
from passgraph.glsl.image_functions import DERIVATIVES, READS
from passgraph.glsl.stage_values import LIMITS, STAGE
from passgraph.glsl.unit import Unit
from passgraph.glsl.walk import assigned_name, walked
from passgraph.language.source import Span, fail


def check_names(tree: Iterable[g.Outer], unit: Unit) -> None:
    """Raise KernelError for names without a declaration, for values that must be constant and are not, and for outputs
    of two kinds.

    The container's own text is not checked.
    """
    names = _Names(unit)
    for node in tree:
        names.outer(node)
    if len(names.written) > 1:
        kinds = sorted(names.written)
        fail(names.written[kinds[1]], f"a shader writes one kind of outputs, got {' and '.join(kinds)}; leave out one")


class _Names:
    """Walk a shader with the names of each scope: True for one that constant expressions may use."""

    def __init__(self, unit: Unit) -> None:
        self.unit, self.dialect = unit, unit.dialect
        self.scopes: list[dict[str, bool]] = [dict.fromkeys(LIMITS, True)]
        self.is_own = True  # False in the container's text
        self.outputs: set[str] = set()  # that the shader declares
        self.written: dict[str, Span] = {}  # kinds of outputs, with where they are assigned to

    def outer(self, node: g.Outer) -> None:
        """Check a declaration outside of functions."""
        self.is_own = node.span.file not in self.unit.around
        if isinstance(node, g.Function):
            self._function(node)
        elif isinstance(node, g.Declaration):
            self._declaration(node)
        elif isinstance(node, g.Struct):
            self._fields(node)
        else:
            self._lengths(node.lengths)
            for field in node.fields:
                self._lengths(field.type.lengths)
            self.scopes[-1] |= dict.fromkeys([node.instance] if node.instance else [f.name for f in node.fields], False)

    def _function(self, node: g.Function) -> None:
        self._lengths(node.result.lengths)
        for parameter in node.parameters:
            self._lengths(parameter.type.lengths)
        if node.body is not None:
            self._inner(node.body.statements, dict.fromkeys((one.name for one in node.parameters), False))

    def _fields(self, node: g.Struct) -> None:
        for field in node.fields:
            self._lengths(field.type.lengths)

    # Statements

    def _inner(self, nodes: Iterable[g.Statement | None], names: dict[str, bool] | None = None) -> None:
        """Check statements in a scope of their own."""
        self.scopes.append(names or {})
        for node in nodes:
            if node is not None:
                self._statement(node)
        self.scopes.pop()

    def _statement(self, node: g.Statement) -> None:
        if isinstance(node, g.Declaration):
            self._declaration(node)
        elif isinstance(node, g.Struct):
            self._fields(node)
        elif isinstance(node, g.Block):
            self._inner(node.statements)
        elif isinstance(node, g.If):
            self._uses(node.condition)
            self._inner([node.then])
            self._inner([node.orelse])
        elif isinstance(node, g.Loop):
            self._loop(node)
        elif isinstance(node, g.Switch):
            self._uses(node.value)
            for case in node.cases:
                self._constant(case.value, "a label")
            self._inner(chain.from_iterable(case.statements for case in node.cases))
        elif isinstance(node, (g.Evaluate, g.Return)):
            self._uses(node.value)

    def _loop(self, node: g.Loop) -> None:
        self.scopes.append({})
        if node.start is not None:
            self._statement(node.start)
        self._uses(node.condition)
        self._uses(node.update)
        self._inner([node.body])
        self.scopes.pop()

    def _declaration(self, node: g.Declaration) -> None:
        is_global, is_const = len(self.scopes) == 1, "const" in node.qualifiers
        for variable in node.variables:
            self._lengths(variable.type.lengths)
            self._uses(variable.value)
            is_constant = is_const and variable.value is not None and self._is_constant(variable.value)
            if is_const and variable.value is not None and (is_global or self.dialect.has_constant_locals):
                self._constant(variable.value, f"const {variable.name}")
            elif is_global and self.dialect.es and "uniform" not in node.qualifiers:
                self._constant(variable.value, f"the value of {variable.name} outside of functions")
            self.scopes[-1][variable.name] = is_constant
            if is_global and "out" in node.qualifiers and not variable.name.startswith("gl_"):
                self.outputs.add(variable.name)

    # Expressions

    def _lengths(self, lengths: Sequence[g.Expr | None]) -> None:
        for length in lengths:
            self._uses(length)
            self._constant(length, "the length of an array")

    def _uses(self, node: g.Expr | None) -> None:
        """Raise KernelError for a name that no declaration before introduces."""
        if not self.is_own:
            return
        for one in walked(node):
            if isinstance(one, (g.Assignment, g.Step)):
                self._writes(assigned_name(one), one.span)
            elif isinstance(one, g.Name) and not self._is_known(one.name):
                near = mending(one.name, (*chain(*self.scopes), *self.unit.values, *STAGE))
                fail(one.span, f"{one.name!r} is not defined here{near or '; declare it before'}")

    def _writes(self, name: str, span: Span) -> None:
        """Take down an output that is assigned to."""
        if not any(name in scope for scope in self.scopes[1:]):
            if name in ("gl_FragColor", "gl_FragData"):
                self.written.setdefault(name, span)
            elif name in self.outputs:
                self.written.setdefault("outputs of its own", span)

    def _is_known(self, name: str) -> bool:
        is_declared = any(name in scope for scope in self.scopes)
        return (
            is_declared or name in STAGE or name in self.unit.values or name.startswith("gl_") or bool(elsewhere(name))
        )

    def _constant(self, node: g.Expr | None, what: str) -> None:
        """Raise KernelError for a value that is not a constant expression."""
        if node is not None and self.is_own and not self._is_constant(node):
            fail(node.span, f"{what} must be a constant expression: of literals, constants and built-in functions")

    def _is_constant(self, node: g.Expr) -> bool:
        if isinstance(node, g.Number):
            return True
        if isinstance(node, g.Name):
            return next((scope[node.name] for scope in reversed(self.scopes) if node.name in scope), False)
        if isinstance(node, g.Call):
            return (node.type is not None or self._is_built_in(node.name)) and all(
                map(self._is_constant, node.arguments)
            )
        if isinstance(node, g.Member):
            return node.name == "length()" or self._is_constant(node.base)
        if isinstance(node, (g.Assignment, g.Step)) or (
            isinstance(node, g.Sequence) and self.dialect.es and self.dialect.version >= 300
        ):
            return False
        parts = (getattr(node, name) for name in node.__dataclass_fields__ if name not in ("span", "depth", "sign"))
        return all(
            self._is_constant(part) for part in chain.from_iterable(p if isinstance(p, tuple) else (p,) for p in parts)
        )

    def _is_built_in(self, name: str) -> bool:
        """Return True for a built-in function whose value depends on its arguments alone."""
        is_pure = name not in READS and name not in DERIVATIVES
        return name not in self.unit.functions and is_pure and (name in BUILTINS or bool(prelude_functions(name)))
