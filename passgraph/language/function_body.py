"""Convert one function body to the intermediate representation: its names, its variables, its exit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeVar, cast

from passgraph.errors import KernelError, KernelLengthError
from passgraph.language import ir
from passgraph.language.assignments import Assignments, Place, Variable, new_variable, read_variable, zero_of
from passgraph.language.composites import Lists, alone, mapped, nth, spread
from passgraph.language.expressions import STAGE_VALUES, Expressions
from passgraph.language.library import library_function, written_function
from passgraph.language.long_arrays import check_local
from passgraph.language.quad_derivatives import expanded
from passgraph.language.scope import FunctionSource, KnownTable, Scope, typed_constant
from passgraph.language.signature import Signature, read_signature
from passgraph.language.source import Span, fail
from passgraph.language.statements import MAX_BLOCKS, Exit, Statements
from passgraph.language.types import (
    BOOL,
    Array,
    ImageType,
    TupleType,
    Type,
    Value,
    flat_type,
    image_names,
    is_plain,
    longest,
)
from passgraph.language.values import (
    ArrayValue,
    ImageChoice,
    ImageValue,
    Part,
    Parts,
    StructValue,
    TupleValue,
    coerce,
    part_type,
    settled,
)

T = TypeVar("T")
#: Most nested calls; deeper nesting is most likely a recursion through a chain.
MAX_CALL_DEPTH = 32
#: Most statements after inlining.
MAX_STATEMENTS = 20_000
#: Most expressions after inlining, counted as nodes of the syntax tree.
MAX_EXPRESSIONS = 60_000
#: The variable that stores if a pixel or fragment is kept.
KEPT = "$keep"
#: Expressions counted for one entry of an array copied entry by entry: an index, its computation, and the value.
_OF_ENTRY = 3


@dataclass
class Builder:
    """State shared by all frames of one kernel."""

    stage: ir.Stage
    blocks: list[list[ir.Stmt]] = field(default_factory=lambda: [[]])
    count: int = 0
    emitted: int = 0
    expressions: int = 0
    #: Nodes of the syntax trees of the enclosing functions, innermost last.
    calls: list[object] = field(default_factory=list)
    discards: int = 0  # discarding statements, including those in inlined functions
    #: Variables of derivatives, with the axis; each is assigned the expression to differentiate.
    derivatives: dict[str, str] = field(default_factory=dict)
    signatures: dict[FunctionSource, Signature] = field(default_factory=dict)
    #: For each inlined function, the names captured by its body: this kernel's own record.
    scopes: dict[FunctionSource, Scope] = field(default_factory=dict)
    tables: dict[int, KnownTable] = field(default_factory=dict)  # captured by its functions

    def emit(self, statement: ir.Stmt) -> None:
        self.count_statement(statement.span)
        self.blocks[-1].append(statement)

    def body(self) -> tuple[ir.Stmt, ...]:
        """Return all emitted statements, with derivatives computed."""
        return expanded(tuple(self.blocks[0]), self)

    def count_statement(self, span: Span) -> None:
        self.emitted += 1
        if self.emitted > MAX_STATEMENTS:
            fail(
                span,
                f"the kernel grows past {MAX_STATEMENTS} statements once its functions are inlined and its derivatives "
                "written out",
                KernelLengthError,
            )

    def captured(self, emit: Callable[[], None], span: Span) -> tuple[ir.Stmt, ...]:
        """Return what ``emit`` emits, as a block."""
        if len(self.blocks) > MAX_BLOCKS:
            fail(
                span,
                f"branches and loops nest deeper than {MAX_BLOCKS}, functions inlined; what follows a return in a "
                "branch counts as the other branch",
                KernelLengthError,
            )
        self.blocks.append([])
        emit()
        return tuple(self.blocks.pop())

    def tried(self, compute: Callable[[], T]) -> T | None:
        """Run a computation and drop what it emits; return its value, or None for an error."""
        blocks, calls, discards = len(self.blocks), len(self.calls), self.discards
        self.blocks.append([])
        try:
            return compute()
        except KernelError:
            return None
        finally:
            del self.blocks[blocks:], self.calls[calls:]
            self.discards = discards

    def discard(self, span: Span) -> None:
        """Discard this pixel or fragment; the caller leaves its body."""
        self.discards += 1
        self.emit(ir.Assign(KEPT, ir.Literal(BOOL, False, span), span))

    def keep_or_clear(self, result: Variable, span: Span) -> ir.Expr | None:
        """End a kernel that may discard: a discarded pixel is zero, a discarded fragment is not kept.

        Return the condition under which fragments are kept, None if no statement discards.
        """
        if not self.discards:
            return None
        keep = ir.Local(BOOL, KEPT, span)
        if self.stage != "pixel":
            return keep
        self.emit(ir.If(keep, (), self.captured(lambda: self.clear(result), span), span))
        return None

    def clear(self, variable: Variable) -> None:
        """Set every number of a variable to zero."""
        for member in variable.fields.values():
            self.clear(member)
        if not variable.fields:
            self.emit(ir.Assign(variable.name, zero_of(variable.type)))

    def count_expression(self, span: Span, times: int = 1) -> None:
        self.expressions += times
        if self.expressions > MAX_EXPRESSIONS:
            fail(
                span,
                f"the kernel grows past {MAX_EXPRESSIONS} expressions once its functions are inlined and its arrays "
                "written out",
                KernelLengthError,
            )

    def fresh(self, hint: str) -> str:
        self.count += 1
        return f"{hint}.{self.count}"

    # Values

    def name_it(self, value: ir.Expr, span: Span, *, keep_locals: bool = True) -> ir.Expr:
        """Put a value into a variable, so that using it twice computes it once."""
        named_kinds = (ir.Literal, ir.Uniform, ir.Builtin, ir.Table)
        if isinstance(value, named_kinds) or (keep_locals and isinstance(value, ir.Local)):
            return value
        name = self.fresh("")
        self.emit(ir.Assign(name, value, span))
        return ir.Local(value.type, name, span)

    def name_part(self, part: Part, span: Span, *, keep_locals: bool = True) -> Part:
        """Apply :meth:`name_it` to every field of a struct and member of a tuple."""
        if isinstance(part, StructValue):
            fields = {n: self.name_part(p, span, keep_locals=keep_locals) for n, p in part.fields.items()}
            return StructValue(part.struct, fields)
        if isinstance(part, TupleValue):
            members = (self.name_part(p, span, keep_locals=keep_locals) for p in part.members)
            return TupleValue(tuple(members))
        if isinstance(part, ArrayValue):
            array = part if keep_locals else self.alone(part, span)
            parts = mapped(array.parts, lambda leaf: self.name_it(leaf, span, keep_locals=keep_locals))
            return ArrayValue(array.type, parts, array.first)
        if isinstance(part, (ImageValue, ImageChoice)):
            return part
        return self.name_it(part, span, keep_locals=keep_locals)

    def store(self, variable: Variable, part: Part, span: Span, what: str) -> None:
        """Assign to a variable, field by field for structs and tuples."""
        value = self._fitted(part, variable.type, span, what)
        if variable.fields:
            # Fields may depend on the variable itself: all values are computed before the first assignment.
            value = self.name_part(value, span, keep_locals=False)
        self._assign(variable, value, span)

    def store_at(self, place: Place, part: Part, span: Span, what: str) -> None:
        """Assign to a variable or to an entry of its arrays; out of range nothing is written."""
        if not place.indices:
            self.store(place.variable, part, span, what)
            return
        value = self.name_part(self._fitted(part, place.type, span, what), span, keep_locals=False)
        values = spread(value, span, self.name_it)
        self._insert(place.variable, values, self.name_it(place.index(span), span), span)

    def _insert(self, variable: Variable, values: Lists, index: ir.Expr, span: Span) -> None:
        """Insert values into an entry: consecutive elements of each flat array."""
        if isinstance(values, dict):
            for name, member in values.items():
                self._insert(variable.fields[name], member, index, span)
            return
        self.count_expression(span, _OF_ENTRY * (len(values) - 1))
        flat = flat_type(cast(Array, variable.type))
        for k, value in enumerate(values):
            assert not isinstance(value, ImageValue)
            where = index if len(values) == 1 else nth(index, len(values), k, span)
            array = ir.Local(flat, variable.name, span)
            self.emit(ir.Assign(variable.name, ir.Insert(flat, array, where, value, span), span))

    def _fitted(self, part: Part, type_: Type, span: Span, what: str) -> Part:
        if not isinstance(type_, TupleType):
            return coerce(part, type_, span, what)
        if not isinstance(part, TupleValue) or len(part.members) != len(type_.members):
            fail(span, f"{what} must be {type_}, got {part_type(part)}")
        pairs = zip(part.members, type_.members, strict=True)
        return TupleValue(tuple(self._fitted(p, t, span, what) for p, t in pairs))

    def _assign(self, variable: Variable, part: Part, span: Span) -> None:
        if isinstance(part, TupleValue):
            for member, value in zip(variable.fields.values(), part.members, strict=True):
                self._assign(member, value, span)
        elif isinstance(part, StructValue):
            for name, member in variable.fields.items():
                self._assign(member, part.fields[name], span)
        elif isinstance(part, ArrayValue):
            self._assign_parts(variable, self.alone(part, span).parts, span)
        elif not isinstance(part, (ImageValue, ImageChoice)):
            self.emit(ir.Assign(variable.name, part, span))

    def _assign_parts(self, variable: Variable, parts: Parts, span: Span) -> None:
        if isinstance(parts, dict):
            for name, member in variable.fields.items():
                self._assign_parts(member, parts[name], span)
        elif not isinstance(parts, tuple):
            self.emit(ir.Assign(variable.name, parts, span))

    def alone(self, array: ArrayValue, span: Span) -> ArrayValue:
        """:func:`~.composites.alone`, with its growth counted."""
        if array.first is not None:
            check_local(array.type, "a variable", span)
        self.count_expression(span, 1 if array.first is None else _OF_ENTRY * longest(array.type))
        return alone(array, span)

    # Functions

    def signature(self, function: FunctionSource) -> Signature:
        if function not in self.signatures:
            signature = self.signatures[function] = read_signature(function)
            for parameter in signature.parameters:
                if parameter.range is not None:
                    fail(parameter.span, f"{function.name} is no kernel; what its parameters may be is not looked at")
        return self.signatures[function]

    def scope(self, function: FunctionSource) -> Scope:
        if function not in self.scopes:
            self.scopes[function] = Scope(
                function.scope.names, tables=self.tables, listed=function.nearby, lacking=function.scope.lacking
            )
        return self.scopes[function]


class Frame:
    """A function body while it is parsed."""

    def __init__(self, function: FunctionSource, builder: Builder, result: Type) -> None:
        self.function, self.builder, self.result_type = function, builder, result
        self.source, self.scope, self.stage = function.source, builder.scope(function), builder.stage
        self.name_it, self.name_part, self.store = builder.name_it, builder.name_part, builder.store
        self.alone, self.store_at = builder.alone, builder.store_at
        self.expressions, self.assignments = Expressions(self), Assignments(self)
        self.statements = Statements(self)
        self.parts: dict[str, Part] = {}  # parameters, read-only
        self.variables: dict[str, Variable] = {}
        self.assigned: set[str] = set()  # variables that have a value here
        self.locals = function.assigned
        self.result = new_variable(result, builder.fresh(f"{function.name}.result"))
        self.exit = Exit(builder, function.name)
        self.in_function = bool(builder.calls[1:])

    # Names

    def knows(self, name: str) -> bool:
        return name in self.parts or name in self.locals

    def read(self, name: str, span: Span) -> Part | None:
        """Return the value of a local name; None if it is not local."""
        if name in self.parts:
            return self.parts[name]
        if name not in self.locals:
            return None
        if name not in self.assigned:
            fail(span, f"{name!r} may not have a value here; give it one before the branch or loop")
        return read_variable(self.variables[name], span)

    def emit(self, statement: ir.Stmt) -> None:
        self.builder.emit(statement)

    # Interface for expressions

    def default(self, value: object, type_: Type, what: str, span: Span) -> Part:
        constant = typed_constant(value, type_, what, span)
        return constant if is_plain(type_) else ArrayValue(cast(Array, type_), constant)

    def stage_value(self, name: str, arguments: list[ir.Expr], span: Span) -> ir.Expr:
        type_, stages = STAGE_VALUES[name]
        if arguments:
            fail(span, f"{name}() takes no arguments")
        if self.stage not in stages:
            fail(span, f"{name}() exists in {' and '.join(stages)} kernels, not in a {self.stage} kernel")
        if name == "uv":
            return cast(ir.Expr, self.inline_library("pixel_uv", [], span))
        return ir.Builtin(cast(Value, type_), name, span)

    def inline_library(self, name: str, arguments: list[Part], span: Span) -> Part:
        return self.inline(library_function(name), (arguments, {}), span)

    def inline_written(self, name: str, arguments: list[ir.Expr], span: Span) -> Part | None:
        """Call a library function for such arguments; None if there is none."""
        function = written_function(name, [a.type for a in arguments])
        return None if function is None else self.inline(function, (list(arguments), {}), span)

    def inline(self, function: FunctionSource, arguments: tuple[list[Part], dict[str, Part]], span: Span) -> Part:
        return inlined(self.builder, function, arguments, span)

    def bind(self, name: str, type_: Type, part: Part, span: Span) -> None:
        """Bind a parameter: by name if it is only read, to a variable of its own if the body assigns to it."""
        if name in self.locals:
            if image_names(type_, name):
                what = "is an Image" if isinstance(type_, ImageType) else "holds an Image"
                fail(span, f"parameter {name!r} {what} and cannot be assigned to")
            self.variables[name] = variable = new_variable(type_, self.builder.fresh(name))
            self.assigned.add(name)
            self.store(variable, part, span, name)
        else:
            self.parts[name] = self.name_part(settled(part), span) if self.in_function else part

    def run(self) -> None:
        """Parse the body; its result is in ``self.result`` at the end."""
        node = self.function.node
        self.exit.open(self.source.span(node))
        self.builder.clear(self.result)
        if not self.statements.block(node.body):
            fail(self.source.span(node), f"{self.function.name} may end without returning {self.result_type}")


def inlined(
    builder: Builder, function: FunctionSource, arguments: tuple[list[Part], dict[str, Part]], span: Span
) -> Part:
    """Inline the body of a function in place of a call."""
    if function.node in builder.calls:
        fail(span, f"{function.name} calls itself; the kernel language has no recursion")
    if len(builder.calls) >= MAX_CALL_DEPTH:
        fail(span, f"calls nest deeper than {MAX_CALL_DEPTH}")
    signature = builder.signature(function)
    builder.calls.append(function.node)
    frame = Frame(function, builder, signature.result)
    bound = _bind(function, signature.parameters, arguments, span)
    for parameter in signature.parameters:
        what = f"{function.name}({parameter.name})"
        if parameter.name in bound:
            part = coerce(bound[parameter.name], parameter.type, span, what)
        else:
            part = frame.default(parameter.default, parameter.type, what, span)
        frame.bind(parameter.name, parameter.type, part, span)
    frame.run()
    builder.calls.pop()
    return read_variable(frame.result, span)


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
