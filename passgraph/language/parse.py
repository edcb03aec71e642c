"""From the text of a kernel to its typed intermediate representation.

Functions are inlined, structs taken apart, and ``return`` and ``discard`` anywhere in the body turned into one
exit at the end: code behind a conditional return moves into the other branch, and a return inside a loop sets
a flag that guards the rest.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable
from dataclasses import dataclass, field

from passgraph.language import ir
from passgraph.language.expressions import (
    STAGE_VALUES,
    Expressions,
    ImageValue,
    Part,
    StructValue,
    TupleValue,
    coerce,
    index_into,
    part_type,
    swizzle_components,
)
from passgraph.language.library import library_function
from passgraph.language.scope import FunctionSource, Scope, typed_constant
from passgraph.language.signature import VERTEX, read_signature
from passgraph.language.source import Source, Span, fail
from passgraph.language.types import (
    BOOL,
    FLOAT,
    INT,
    VEC4,
    Array,
    ImageType,
    Matrix,
    Scalar,
    Struct,
    TupleType,
    Type,
    Vector,
    component_count,
    element_of,
)
from passgraph.language.typing_rules import widen

#: Calls inside calls; deeper is almost surely recursion through a chain.
MAX_CALL_DEPTH = 32
#: Statements after inlining; more than this is a runaway, not a kernel.
MAX_STATEMENTS = 20_000


@dataclass
class Builder:
    """What all frames of one kernel share."""

    stage: ir.Stage
    blocks: list[list[ir.Stmt]] = field(default_factory=lambda: [[]])
    count: int = 0
    emitted: int = 0
    calls: list[ast.FunctionDef] = field(default_factory=list)
    discards: bool = False

    def emit(self, statement: ir.Stmt) -> None:
        self.emitted += 1
        if self.emitted > MAX_STATEMENTS:
            fail(
                statement.span,
                f"the kernel grows past {MAX_STATEMENTS} statements once its functions are inlined",
            )
        self.blocks[-1].append(statement)

    def fresh(self, hint: str) -> str:
        self.count += 1
        return f"{hint}.{self.count}"


@dataclass
class Variable:
    """A local: one IR name, or one variable a field for structs."""

    type: Type
    name: str = ""
    fields: dict[str, Variable] = field(default_factory=dict)
    loop_index: bool = False


class Frame:
    """One function body being parsed: its names, its exit."""

    def __init__(self, function: FunctionSource, builder: Builder, result: Type) -> None:
        self.function, self.builder, self.result_type = function, builder, result
        self.source, self.scope, self.stage = function.source, function.scope, builder.stage
        self.expressions = Expressions(self)
        self.parts: dict[str, Part] = {}  # parameters, read-only
        self.variables: dict[str, Variable] = {}
        self.assigned: set[str] = set()
        self.result = self._variable(result, builder.fresh(f"{function.name}.result"))
        self.returned = builder.fresh(f"{function.name}.returned")
        self.loops = 0
        self.in_function = bool(builder.calls[1:])

    # Names

    def knows(self, name: str) -> bool:
        return name in self.parts or name in self.variables

    def read(self, name: str, span: Span) -> Part | None:
        if name in self.variables:
            if name not in self.assigned:
                fail(span, f"{name!r} may not have a value here; give it one before the branch or loop")
            return self._read(self.variables[name], span)
        return self.parts.get(name)

    def _read(self, variable: Variable, span: Span) -> Part:
        if isinstance(variable.type, Struct):
            fields = {name: self._read(part, span) for name, part in variable.fields.items()}
            return StructValue(variable.type, fields)
        if isinstance(variable.type, TupleType):
            return TupleValue(tuple(self._read(part, span) for part in variable.fields.values()))
        return ir.Local(variable.type, variable.name, span)  # type: ignore[arg-type]

    def _variable(self, type_: Type, name: str) -> Variable:
        if isinstance(type_, Struct):
            return Variable(type_, name, {n: self._variable(t, f"{name}.{n}") for n, t in type_.fields})
        if isinstance(type_, TupleType):
            members = {str(i): self._variable(t, f"{name}.{i}") for i, t in enumerate(type_.members)}
            return Variable(type_, name, members)
        return Variable(type_, name)

    def _store(self, variable: Variable, part: Part, span: Span, what: str) -> None:
        if isinstance(variable.type, TupleType):
            if not isinstance(part, TupleValue) or len(part.members) != len(variable.fields):
                fail(span, f"{what} must be {variable.type}, got {part_type(part)}")
            for member, value in zip(variable.fields.values(), part.members, strict=True):
                self._store(member, value, span, what)
            return
        value = coerce(part, variable.type, span, what)
        if isinstance(value, StructValue):
            for name, member in variable.fields.items():
                self._store(member, value.fields[name], span, f"{what}.{name}")
        elif not isinstance(value, (ImageValue, TupleValue)):
            self.builder.emit(ir.Assign(variable.name, value, span))

    def emit(self, statement: ir.Stmt) -> None:
        self.builder.emit(statement)

    def name_it(self, value: ir.Expr, span: Span) -> ir.Expr:
        """The value behind a name, so that using it twice computes it once."""
        if isinstance(value, (ir.Literal, ir.Local, ir.Uniform, ir.Builtin)):
            return value
        name = self.builder.fresh("t")
        self.emit(ir.Assign(name, value, span))
        return ir.Local(value.type, name, span)

    # What expressions ask of their frame

    def default(self, value: object, type_: Type, what: str, span: Span) -> ir.Expr:
        return typed_constant(value, type_, what, span)

    def stage_value(self, name: str, arguments: list[ir.Expr], span: Span) -> ir.Expr:
        type_, stages = STAGE_VALUES[name]
        if arguments:
            fail(span, f"{name}() takes no arguments")
        if self.stage not in stages:
            fail(span, f"{name}() exists in {' and '.join(stages)} kernels, not in a {self.stage} kernel")
        if name == "uv":
            return self.inline_library("pixel_uv", [], span)  # type: ignore[return-value]
        return ir.Builtin(type_, name, span)  # type: ignore[arg-type]

    def inline_library(self, name: str, arguments: list[Part], span: Span) -> Part:
        return self.inline(library_function(name), (arguments, {}), span)

    def inline(
        self, function: FunctionSource, arguments: tuple[list[Part], dict[str, Part]], span: Span
    ) -> Part:
        """The body of a function in place of a call."""
        builder = self.builder
        if function.node in builder.calls:
            fail(span, f"{function.name} calls itself; the kernel language has no recursion")
        if len(builder.calls) >= MAX_CALL_DEPTH:
            fail(span, f"calls nest deeper than {MAX_CALL_DEPTH}")
        signature = read_signature(function)
        assert signature.result is not None
        builder.calls.append(function.node)
        frame = Frame(function, builder, signature.result)
        bound = _bind(function, signature.parameters, arguments, span)
        for parameter in signature.parameters:
            if parameter.name in bound:
                part = coerce(
                    bound[parameter.name], parameter.type, span, f"{function.name}({parameter.name})"
                )
            else:
                part = self.default(
                    parameter.default, parameter.type, f"{function.name}({parameter.name})", span
                )
            frame.bind(parameter.name, parameter.type, part, span)
        frame.run()
        builder.calls.pop()
        return frame._read(frame.result, span)

    def bind(self, name: str, type_: Type, part: Part, span: Span) -> None:
        """A parameter: by name where it is only read, a variable of its own where the body assigns to it."""
        if name in _assigned_names(self.function.node.body):
            if isinstance(type_, ImageType):
                fail(span, f"parameter {name!r} is an Image and cannot be assigned to")
            self.variables[name] = variable = self._variable(type_, self.builder.fresh(name))
            self.assigned.add(name)
            self._store(variable, part, span, name)
        elif isinstance(part, (StructValue, ImageValue, TupleValue)):
            self.parts[name] = part
        else:
            self.parts[name] = self.name_it(part, span) if self.in_function else part

    # Statements

    def run(self) -> None:
        node = self.function.node
        self.emit(ir.Assign(self.returned, ir.Literal(BOOL, False), self.source.span(node)))
        self._zero(self.result)
        if not self.block(node.body):
            fail(self.source.span(node), f"{self.function.name} may end without returning {self.result_type}")

    def _zero(self, variable: Variable) -> None:
        for member in variable.fields.values():
            self._zero(member)
        if not variable.fields:
            self.emit(ir.Assign(variable.name, zero_of(variable.type)))

    def block(self, nodes: Iterable[ast.stmt]) -> bool:
        """Parse statements into the current block; true when every path through them returns."""
        pending = list(nodes)
        for position, node in enumerate(pending):
            rest = pending[position + 1 :]
            if isinstance(node, ast.If):
                return self._if(node, rest)
            if isinstance(node, ast.For):
                self._for(node)
                if _returns(node):
                    return self._guarded(rest, node)
            elif isinstance(node, ast.Return):
                self._return(node)
                return True
            elif _is_discard(node, self):
                self._discard(node)
                return True
            elif isinstance(node, (ast.Break, ast.Continue)):
                if not self.loops:
                    fail(self.source.span(node), "break and continue belong inside a for loop")
                span = self.source.span(node)
                self.emit(ir.Break(span) if isinstance(node, ast.Break) else ir.Continue(span))
                return False
            else:
                self._simple(node)
        return False

    def _captured_block(self, nodes: Iterable[ast.stmt]) -> tuple[tuple[ir.Stmt, ...], bool]:
        self.builder.blocks.append([])
        returns = self.block(nodes)
        return tuple(self.builder.blocks.pop()), returns

    def _if(self, node: ast.If, rest: list[ast.stmt]) -> bool:
        span = self.source.span(node.test)
        condition = self.expressions.condition(node.test)
        before = set(self.assigned)
        then_returns, else_returns = _always_returns(node.body, self), _always_returns(node.orelse, self)
        may_return = _returns(node)
        # What follows a branch that returned belongs to the other branch alone.
        then_nodes = [*node.body, *rest] if else_returns and not then_returns else node.body
        else_nodes = [*node.orelse, *rest] if then_returns else node.orelse
        then, then_done = self._captured_block(then_nodes)
        after_then, self.assigned = self.assigned, set(before)
        orelse, else_done = self._captured_block(else_nodes)
        after_else = self.assigned
        # A branch that left has no say in what is assigned behind it.
        if then_done:
            self.assigned = after_else
        elif else_done:
            self.assigned = after_then
        else:
            self.assigned = after_then & after_else
        self.emit(ir.If(condition, then, orelse, span))
        if then_returns or else_returns:
            return then_done and else_done
        if may_return:
            return self._guarded(rest, node)
        return self.block(rest)

    def _guarded(self, rest: list[ast.stmt], node: ast.stmt) -> bool:
        """``rest`` under the condition that nothing has returned yet."""
        if not rest:
            return False
        span = self.source.span(node)
        body, done = self._captured_block(rest)
        still_here = ir.Apply(BOOL, "logical_not", (ir.Local(BOOL, self.returned, span),), span)
        self.emit(ir.If(still_here, body, (), span))
        return done

    def _for(self, node: ast.For) -> None:
        span = self.source.span(node.iter)
        if node.orelse:
            fail(self.source.span(node.orelse[0]), "the kernel language has no for ... else")
        if not isinstance(node.target, ast.Name):
            fail(self.source.span(node.target), "a for loop has one index: for i in range(n)")
        start, stop, step = self._range(node.iter, span)
        name = node.target.id
        index = Variable(INT, self.builder.fresh(name), loop_index=True)
        shadowed, had = self.variables.get(name), name in self.assigned
        if shadowed is not None and shadowed.type is not INT:
            fail(
                self.source.span(node.target),
                f"{name!r} is {shadowed.type} already; give the index another name",
            )
        self.parts.pop(name, None)
        self.variables[name] = index
        before = set(self.assigned)
        self.assigned.add(name)
        self.loops += 1
        body, _ = self._captured_block(node.body)
        self.loops -= 1
        self.assigned = before - (set() if had else {name})
        if shadowed is not None and not shadowed.loop_index:
            self.variables[name] = shadowed
        self.emit(ir.For(index.name, start, stop, step, body, span))

    def _range(self, node: ast.expr, span: Span) -> tuple[ir.Expr, ir.Expr, ir.Expr]:
        is_range = isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "range"
        if not is_range or self.knows("range"):
            fail(span, "a for loop runs over range(...): for i in range(len(values))")
        assert isinstance(node, ast.Call)
        if node.keywords or not 1 <= len(node.args) <= 3:
            fail(span, "range() takes 1 to 3 whole numbers")
        bounds = [
            widen(self.expressions.value(a), INT, self.source.span(a), "a bound of range()")
            for a in node.args
        ]
        zero, one = ir.Literal(INT, 0, span), ir.Literal(INT, 1, span)
        if len(bounds) == 1:
            return zero, bounds[0], one
        return bounds[0], bounds[1], bounds[2] if len(bounds) == 3 else one

    def _return(self, node: ast.Return) -> None:
        span = self.source.span(node)
        if node.value is None:
            fail(span, f"{self.function.name} must return {self.result_type}")
        part = self.expressions.part(node.value)
        self._store(self.result, part, span, f"the result of {self.function.name}")
        self._leave(span)

    def _leave(self, span: Span) -> None:
        self.emit(ir.Assign(self.returned, ir.Literal(BOOL, True, span), span))
        if self.loops:
            self.emit(ir.Break(span))

    def _discard(self, node: ast.stmt) -> None:
        span = self.source.span(node)
        if self.stage != "fragment":
            fail(span, f"discard() exists in fragment kernels, not in a {self.stage} kernel")
        if self.in_function:
            fail(
                span,
                "discard() belongs in the fragment kernel itself; return a bool from the function instead",
            )
        self.builder.discards = True
        self.emit(ir.Assign("$keep", ir.Literal(BOOL, False, span), span))
        self._leave(span)

    def _simple(self, node: ast.stmt) -> None:
        span = self.source.span(node)
        if isinstance(node, ast.Assign):
            if len(node.targets) != 1:
                fail(span, "one assignment a line: a = b = c is not in the kernel language")
            self._assign(node.targets[0], self.expressions.part(node.value), span)
        elif isinstance(node, ast.AugAssign):
            load = ast.copy_location(ast.BinOp(_as_load(node.target), node.op, node.value), node)
            self._assign(node.target, self.expressions.part(load), span)
        elif isinstance(node, ast.AnnAssign):
            self._annotated(node, span)
        elif isinstance(node, ast.Pass) or (
            isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
        ):
            return
        elif isinstance(node, ast.Expr):
            fail(span, "this value is not used; a kernel has no side effects")
        else:
            fail(span, f"the kernel language has no {_STATEMENTS.get(type(node), type(node).__name__)}")

    def _annotated(self, node: ast.AnnAssign, span: Span) -> None:
        from passgraph.language.signature import annotation_type

        type_, const = annotation_type(node.annotation, self.scope, self.source)
        if const or isinstance(type_, (ImageType, TupleType)):
            fail(span, "a variable is a scalar, vector, matrix, array or struct")
        if not isinstance(node.target, ast.Name) or node.value is None:
            fail(span, "a typed variable is written name: type = value")
        value = coerce(self.expressions.part(node.value), type_, span, node.target.id)
        self._assign(node.target, value, span)

    def _assign(self, target: ast.expr, part: Part, span: Span) -> None:
        if isinstance(target, ast.Name):
            self._assign_name(target.id, part, span)
        elif isinstance(target, (ast.Tuple, ast.List)):
            if not isinstance(part, TupleValue) or len(part.members) != len(target.elts):
                fail(span, f"cannot unpack {part_type(part)} into {len(target.elts)} names")
            # All right-hand sides are computed before the first name changes.
            parts = [
                m if isinstance(m, (StructValue, ImageValue, TupleValue)) else self._freeze(m, span)
                for m in part.members
            ]
            for element, member in zip(target.elts, parts, strict=True):
                self._assign(element, member, span)
        elif isinstance(target, (ast.Attribute, ast.Subscript)):
            if isinstance(part, (StructValue, ImageValue, TupleValue)):
                fail(span, f"cannot assign {part_type(part)} to a part of a value")
            self._assign_part(target, part, span)
        else:
            fail(span, "this cannot be assigned to")

    def _freeze(self, value: ir.Expr, span: Span) -> ir.Expr:
        name = self.builder.fresh("t")
        self.emit(ir.Assign(name, value, span))
        return ir.Local(value.type, name, span)  # type: ignore[arg-type]

    def _assign_name(self, name: str, part: Part, span: Span) -> None:
        if isinstance(part, ImageValue):
            fail(span, "an Image cannot be given another name")
        variable = self.variables.get(name)
        if variable is None:
            type_ = _type_of(part)
            variable = self.variables[name] = self._variable(type_, self.builder.fresh(name))
        elif variable.loop_index:
            fail(span, f"{name!r} is a loop index and cannot be assigned to")
        self._store(variable, part, span, repr(name))
        self.assigned.add(name)

    def _assign_part(self, target: ast.Attribute | ast.Subscript, value: ir.Expr, span: Span) -> None:
        """``v.xy = …``, ``m[1] = …``, ``s.normal.x = …``: the whole is rebuilt with one part replaced."""
        base_node = target.value
        base = self.expressions.part(base_node)
        if isinstance(base, StructValue):
            assert isinstance(target, ast.Attribute)
            old = base.fields.get(target.attr)
            if not isinstance(old, ir.Local):
                fail(span, f"{ast.unparse(target)} cannot be assigned to")
            value = widen(value, old.type, span, ast.unparse(target))
            self.emit(ir.Assign(old.name, value, span))
            return
        if isinstance(base, (ImageValue, TupleValue)):
            fail(span, f"a kernel writes to its result, not to {part_type(base)}")
        whole = self._replaced(target, base, value, span)
        if isinstance(base_node, (ast.Name, ast.Attribute, ast.Subscript)):
            if isinstance(base_node, ast.Name) and base_node.id not in self.variables:
                fail(span, f"{base_node.id!r} is not a variable of this kernel and cannot be changed")
            self._assign(base_node, whole, span)
        else:
            fail(span, "only variables can be assigned to")

    def _replaced(
        self, target: ast.Attribute | ast.Subscript, base: ir.Expr, value: ir.Expr, span: Span
    ) -> ir.Expr:
        if isinstance(target, ast.Attribute):
            if not isinstance(base.type, Vector):
                fail(span, f"{base.type} has no attribute {target.attr!r}")
            components = swizzle_components(target.attr, base.type, span)
            if len(set(components)) != len(components):
                fail(span, f".{target.attr} names a component twice and cannot be assigned to")
            scalar = base.type.element
            wanted: Scalar | Vector = scalar if len(components) == 1 else Vector(scalar, len(components))
            value = self.name_it(widen(value, wanted, span, f".{target.attr}"), span)
            parts: list[ir.Expr] = []
            for i in range(base.type.size):
                if i not in components:
                    parts.append(ir.Swizzle(scalar, base, (i,), span))
                elif len(components) == 1:
                    parts.append(value)
                else:
                    parts.append(ir.Swizzle(scalar, value, (components.index(i),), span))
            return ir.Construct(base.type, tuple(parts), span)
        index = widen(self.expressions.value(target.slice), INT, span, "an index")
        element = index_into(base, index, span)
        value = widen(value, element.type, span, ast.unparse(target))
        return ir.Insert(base.type, base, index, value, span)  # type: ignore[arg-type]


_STATEMENTS: dict[type[ast.stmt], str] = {
    ast.While: "while; write for i in range(bound) with a break",
    ast.FunctionDef: "functions inside functions; mark one outside with @pg.function",
    ast.ClassDef: "classes inside functions", ast.Import: "import", ast.ImportFrom: "import",
    ast.Try: "try", ast.With: "with", ast.Raise: "raise", ast.Assert: "assert", ast.Delete: "del",
    ast.Global: "global", ast.Nonlocal: "nonlocal", ast.Match: "match; write if and elif",
}  # fmt: skip


def zero_of(type_: Type) -> ir.Expr:
    if isinstance(type_, Scalar):
        return ir.Literal(type_, {"bool": False, "int": 0, "float": 0.0}[type_.name])
    assert isinstance(type_, (Vector, Matrix, Array))
    zero = zero_of(element_of(type_))
    return ir.Construct(type_, (zero,) * component_count(type_))


def _type_of(part: Part) -> Type:
    if isinstance(part, StructValue):
        return part.struct
    if isinstance(part, TupleValue):
        return TupleType(tuple(_type_of(member) for member in part.members))
    assert not isinstance(part, ImageValue)
    return part.type


def _as_load(target: ast.expr) -> ast.expr:
    """The same place, read instead of written."""
    if isinstance(target, ast.Name):
        return ast.copy_location(ast.Name(target.id, ast.Load()), target)
    if isinstance(target, ast.Attribute):
        return ast.copy_location(ast.Attribute(_as_load(target.value), target.attr, ast.Load()), target)
    if isinstance(target, ast.Subscript):
        return ast.copy_location(ast.Subscript(_as_load(target.value), target.slice, ast.Load()), target)
    return target


def _assigned_names(nodes: Iterable[ast.stmt]) -> set[str]:
    names = set()
    for node in nodes:
        for part in ast.walk(node):
            if isinstance(part, ast.Name) and isinstance(part.ctx, ast.Store):
                names.add(part.id)
            elif isinstance(part, (ast.Attribute, ast.Subscript)) and isinstance(part.ctx, ast.Store):
                base: ast.expr = part
                while isinstance(base, (ast.Attribute, ast.Subscript)):
                    base = base.value
                if isinstance(base, ast.Name):
                    names.add(base.id)
    return names


def _is_discard(node: ast.stmt, frame: Frame) -> bool:
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
        function = node.value.func
        name = function.id if isinstance(function, ast.Name) else getattr(function, "attr", "")
        return name == "discard" and not node.value.args and not frame.knows("discard")
    return False


def _returns(node: ast.stmt) -> bool:
    for part in ast.walk(node):
        if isinstance(part, ast.Return):
            return True
        if (
            isinstance(part, ast.Call)
            and getattr(part.func, "id", getattr(part.func, "attr", "")) == "discard"
        ):
            return True
    return False


def _always_returns(nodes: list[ast.stmt], frame: Frame) -> bool:
    """Whether a block ends in a return on every path, read off its shape."""
    for node in nodes:
        if isinstance(node, ast.Return) or _is_discard(node, frame):
            return True
        if (
            isinstance(node, ast.If)
            and _always_returns(node.body, frame)
            and _always_returns(node.orelse, frame)
        ):
            return True
    return False


def _bind(
    function: FunctionSource,
    parameters: tuple[ir.Parameter, ...],
    arguments: tuple[list[Part], dict[str, Part]],
    span: Span,
) -> dict[str, Part]:
    positional, named = arguments
    names = [p.name for p in parameters]
    if len(positional) > len(names):
        fail(span, f"{function.name} takes {len(names)} arguments, got {len(positional)}")
    bound = dict(zip(names, positional, strict=False))
    for name, part in named.items():
        if name not in names:
            fail(span, f"{function.name} has no parameter {name!r}; it has {', '.join(names)}")
        if name in bound:
            fail(span, f"{function.name} gets {name!r} twice")
        bound[name] = part
    missing = [p.name for p in parameters if p.name not in bound and not p.has_default]
    if missing:
        fail(span, f"{function.name} needs {', '.join(missing)}")
    return bound


def parse_kernel(function: FunctionSource, stage: ir.Stage) -> ir.Program:
    """The whole kernel: signature, body, results.

    Raises
    ------
    KernelError
        For anything that the language refuses, with file, line, source line and caret.
    """
    signature = read_signature(function)
    builder = Builder(stage)
    builder.calls.append(function.node)
    assert signature.result is not None
    span = function.source.span(function.node)
    _check_result(function, stage, signature.result, span)
    frame = Frame(function, builder, signature.result)
    for parameter in signature.parameters:
        _check_parameter(parameter, stage, function)
        frame.bind(parameter.name, parameter.type, _parameter_part(parameter, stage), parameter.span)
    builder.emit(ir.Assign("$keep", ir.Literal(BOOL, True, span), span))
    frame.run()
    results = tuple(_results(frame.result))
    keep = ir.Local(BOOL, "$keep", span) if builder.discards else None
    return ir.Program(
        function.name, stage, signature.parameters, tuple(builder.blocks[0]), results, keep, span
    )


def _parameter_part(parameter: ir.Parameter, stage: ir.Stage) -> Part:
    if parameter.type == VERTEX and stage == "vertex":
        fields = {n: ir.Builtin(t, f"vertex.{n}", parameter.span) for n, t in VERTEX.fields}  # type: ignore[arg-type]
        return StructValue(VERTEX, dict(fields))
    if stage == "fragment" and isinstance(parameter.type, Struct):
        return _varyings(parameter.type, "varying", parameter.span)
    return _uniform(parameter.type, parameter.name, parameter.const, parameter.span)


def _varyings(struct: Struct, prefix: str, span: Span) -> StructValue:
    fields: dict[str, Part] = {}
    for name, type_ in struct.fields:
        fields[name] = ir.Builtin(type_, f"{prefix}.{name}", span)  # type: ignore[arg-type]
    return StructValue(struct, fields)


def _uniform(type_: Type, name: str, const: bool, span: Span) -> Part:
    if isinstance(type_, ImageType):
        return ImageValue(name)
    if isinstance(type_, Struct):
        return StructValue(type_, {n: _uniform(t, f"{name}.{n}", const, span) for n, t in type_.fields})
    assert isinstance(type_, (Scalar, Vector, Matrix, Array))
    return ir.Uniform(type_, name, const, span)


def _results(variable: Variable, name: str = "") -> Iterable[ir.Result]:
    if variable.fields:
        for key, member in variable.fields.items():
            yield from _results(member, key)
    else:
        assert isinstance(variable.type, (Scalar, Vector, Matrix))
        yield ir.Result(name, variable.type, ir.Local(variable.type, variable.name))


def _check_result(function: FunctionSource, stage: ir.Stage, result: Type, span: Span) -> None:
    members: tuple[tuple[str, Type], ...]
    if isinstance(result, Struct):
        members = result.fields
    elif isinstance(result, TupleType):
        members = tuple((str(i), t) for i, t in enumerate(result.members))
    else:
        members = (("", result),)
    if stage == "vertex":
        if not isinstance(result, Struct) or result.field_type("position") != VEC4:
            fail(span, "a vertex kernel returns a @pg.struct whose field position is a vec4 in clip space")
        bad = [n for n, t in members if not isinstance(t, (Scalar, Vector)) or element_of(t) is not FLOAT]
        if bad:
            fail(span, f"varyings are floats and float vectors; {', '.join(bad)} of {result} is not")
        return
    for name, type_ in members:
        if not isinstance(type_, (Scalar, Vector)) or element_of(type_) is not FLOAT:
            what = f"result {name}" if name else "the result"
            fail(
                span,
                f"{what} of {function.name} must be float or a float vector, as targets hold; got {type_}",
            )


def _check_parameter(parameter: ir.Parameter, stage: ir.Stage, function: FunctionSource) -> None:
    type_ = parameter.type
    if type_ == VERTEX and stage != "vertex":
        fail(parameter.span, f"a {stage} kernel has no vertex; only @pg.vertex kernels take one")
    if isinstance(type_, ImageType) and stage == "vertex":
        fail(parameter.span, "vertex kernels read no images; sample in the fragment kernel")
    if isinstance(type_, Struct) and type_ != VERTEX and stage == "fragment":
        first = next(p for p in function.node.args.args if True)
        if parameter.name != first.arg:
            fail(
                parameter.span,
                "the varyings are a fragment kernel's first parameter; give other values one by one",
            )


__all__ = ["Scope", "Source", "parse_kernel"]
