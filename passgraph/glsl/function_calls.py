"""Calls of constructors, functions of the shader or its container, and built-in functions."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

from passgraph.errors import KernelError, UnsupportedGlslError
from passgraph.glsl import syntax as g
from passgraph.glsl.builtins import BUILTINS, overloads
from passgraph.glsl.elsewhere import elsewhere, is_built_in, mending
from passgraph.glsl.expression_parser import TYPES
from passgraph.glsl.operators import cost_of, fitted, plain
from passgraph.glsl.places import Place, place_of, read_place
from passgraph.language import ir
from passgraph.language.composites import array_of, each_image
from passgraph.language.source import Span, fail, place_in
from passgraph.language.types import INT, Array, Matrix, Scalar, Struct, Type, Vector, component_count, sides_of
from passgraph.language.values import (
    ImageChoice,
    ImageValue,
    Part,
    StructValue,
    TupleValue,
    construct,
    part_type,
    settled,
    swizzle,
    type_of,
)

if TYPE_CHECKING:
    from passgraph.glsl.glsl_body import Body


#: From this factor on, ``fract`` of a sine is noise.
_NOISE = 1000


def _is_hash(arguments: tuple[g.Expr, ...]) -> bool:
    """Return True for arguments such as ``sin(x) * 43758.5453``."""
    if len(arguments) != 1 or not isinstance(arguments[0], g.Binary) or arguments[0].sign != "*":
        return False
    sides = (arguments[0].left, arguments[0].right)
    waves = any(isinstance(side, g.Call) and side.name in ("sin", "cos") for side in sides)
    return waves and any(isinstance(side, g.Number) and side.value >= _NOISE for side in sides)


class Calls:
    """Lower the calls in a function."""

    def __init__(self, body: Body) -> None:
        self.body = body

    def call(self, node: g.Call) -> Part | None:
        if node.type is not None:
            return self._constructed(node.type, node)
        unit, span = self.body.unit, node.span
        functions = overloads(unit, node.name, self.body.place)
        candidates = [f for f in functions if len(f.parameters) == len(node.arguments)]
        arguments = self._arguments(node, candidates)
        if candidates:
            types = [part_type(self._read(a)) for a in arguments]
            chosen = self._chosen(candidates, arguments)
            if chosen is not None:
                values = [
                    self._read(a) if p.passed == "in" else a for a, p in zip(arguments, chosen.parameters, strict=True)
                ]
                for argument, parameter in zip(values, chosen.parameters, strict=True):
                    if parameter.passed != "in" and not isinstance(argument, Place):
                        fail(span, f"{node.name} writes to its parameter {parameter.name!r}, which takes a variable")
                return self.body.inline(chosen, values, span)
            if node.name not in BUILTINS:
                fail(span, f"{node.name} takes no ({', '.join(types)})")
        if node.name == "fract" and _is_hash(node.arguments):
            unit.note(span, "this noise amplifies the last bits of a sine: no two drivers make the same")
        parts = [self._read(a) for a in arguments]
        if node.name in BUILTINS:
            native, first = BUILTINS[node.name], parts[0] if parts else None
            if isinstance(first, ImageChoice):  # of an array of samplers
                return each_image(unit.builder, first, lambda image: native(unit, [image, *parts[1:]], span), span)
            return settled(native(unit, parts, span))
        if functions:
            counts = sorted({len(f.parameters) for f in functions})
            fail(span, f"{node.name} takes {' or '.join(map(str, counts))} arguments, got {len(node.arguments)}")
        if node.name in unit.functions:
            below = place_in(unit.functions[node.name][0].span, span)
            fail(span, f"{node.name} is called before its declaration{below}; declare a prototype before the call")
        reason = elsewhere(node.name) or f"there is no function {node.name!r}{self._near(node.name)}"
        fail(span, reason, UnsupportedGlslError if is_built_in(node.name) else KernelError)

    def _near(self, name: str) -> str:
        unit = self.body.unit
        structs = [known for known, binding in unit.names.items() if isinstance(binding, Struct)]
        return mending(name, (*unit.functions, *structs, *BUILTINS, *TYPES))

    def _arguments(self, node: g.Call, candidates: list[g.Function]) -> list[Part | Place]:
        """Evaluate the arguments: values, and places for parameters that the function may write to."""
        places: dict[int, Place] = {}
        computations: list[Callable[[], Part]] = []
        for i, argument in enumerate(node.arguments):
            written = any(f.parameters[i].passed != "in" for f in candidates)
            if written and isinstance(argument, (g.Name, g.Member, g.Subscript)) and self._is_variable(argument):
                places[i] = place_of(self.body, argument)
                only_out = all(f.parameters[i].passed == "out" for f in candidates)
                places[i].slot.written = places[i].slot.written or only_out
                computations.append(partial(read_place, self.body, places[i]))
            else:
                computations.append(partial(self.body.expressions.part, argument))
        parts = self.body.unit.ordered(computations, node.span)
        return [places.get(i, part) for i, part in enumerate(parts)]

    def _is_variable(self, node: g.Expr) -> bool:
        while isinstance(node, (g.Member, g.Subscript)):
            node = node.base
        return isinstance(node, g.Name) and not hasattr(self.body.find(node.name), "part")

    def _read(self, argument: Part | Place) -> Part:
        return read_place(self.body, argument) if isinstance(argument, Place) else argument

    def _chosen(self, candidates: list[g.Function], arguments: list[Part | Place]) -> g.Function | None:
        """Return the overload with the fewest conversions; of equal ones the later definition."""
        best: tuple[int, g.Function] | None = None
        for function in candidates:
            total = 0
            types = self.body.signature(function)
            for parameter, argument, type_ in zip(function.parameters, arguments, types, strict=True):
                part = self._read(argument)
                cost = cost_of(part, type_, parameter.passed)
                if cost is None or not self._is_of(part, parameter, function):
                    break
                total += cost
            else:
                if best is None or total < best[0] or (total == best[0] and function.body is not None):
                    best = (total, function)
        return None if best is None else best[1]

    def _is_of(self, part: Part, parameter: g.Parameter, function: g.Function) -> bool:
        """Return False for a picture of another sampler type than a parameter's; built-in functions take each."""
        image = part.images[0] if isinstance(part, ImageChoice) else part
        if not isinstance(image, ImageValue) or function not in self.body.unit.declared_at:
            return True
        given = self.body.unit.sampler_of(image.name)
        return given in ("", parameter.type.name) or {given, parameter.type.name} == {"samplerExternalOES", "sampler2D"}

    # Constructors

    def _constructed(self, written: g.TypeName, node: g.Call) -> Part:
        span = node.span
        computations = [partial(self.body.expressions.part, argument) for argument in node.arguments]
        parts = self.body.unit.ordered(computations, span)
        of_first = sides_of(type_of(parts[0])) if parts and not isinstance(parts[0], TupleValue) else ()
        type_ = self.body.type_of(written, written.span, (len(parts), *of_first))
        if isinstance(type_, (Struct, Array)):
            return self.composed(type_, parts, span)
        if not isinstance(type_, (Scalar, Vector, Matrix)):
            fail(span, f"{type_} has no constructor")
        values = [plain(part, span, f"what {type_}() takes") for part in parts]
        return settled(construct(type_, self._trimmed(type_, values, span), span, self.body.builder.name_it))

    def _trimmed(self, type_: Scalar | Vector | Matrix, values: list[ir.Expr], span: Span) -> list[ir.Expr]:
        """Return a constructor's arguments without the components of the last one that are not needed.

        Matrices in another type's constructor are split into columns (GLSL 3.30, section 5.4.2).
        """
        matrices = [value for value in values if isinstance(value.type, Matrix)]
        if isinstance(type_, Matrix) and matrices:
            if len(values) > 1:
                fail(span, f"{type_}() takes one matrix, or numbers and vectors, got both")
            return values
        flat: list[ir.Expr] = []
        missing = component_count(type_)
        for value in values:
            if not missing:
                fail(span, f"{type_}() takes {component_count(type_)} components, got another argument behind them")
            for column in self._columns(value, span):
                count = min(component_count(column.type), missing)
                if count:
                    is_whole = count == component_count(column.type)
                    flat.append(column if is_whole else swizzle(column, "xyzw"[:count], span))
                missing -= count
        return flat

    def _columns(self, value: ir.Expr, span: Span) -> list[ir.Expr]:
        if not isinstance(value.type, Matrix):
            return [value]
        named, matrix = self.body.builder.name_it(value, span), value.type
        return [ir.Index(matrix.column, named, ir.Literal(INT, i, span), span) for i in range(matrix.columns)]

    def composed(self, type_: Type, parts: list[Part], span: Span) -> Part:
        """Compose a struct from its fields, an array or vector from its elements, or a matrix from its columns."""
        if isinstance(type_, Struct):
            if len(parts) != len(type_.fields):
                fail(span, f"{type_.name} has {len(type_.fields)} fields, got {len(parts)} values")
            pairs = zip(type_.fields, parts, strict=True)
            return StructValue(type_, {n: fitted(p, t, span, f"{type_.name}.{n}") for (n, t), p in pairs})
        assert isinstance(type_, (Array, Vector, Matrix))
        element = type_.column if isinstance(type_, Matrix) else type_.element
        count = type_.columns if isinstance(type_, Matrix) else type_.length if isinstance(type_, Array) else type_.size
        if len(parts) != count:
            fail(span, f"{type_} takes {count} values, got {len(parts)}")
        typed = [fitted(p, element, span, f"an element of {type_}") for p in parts]
        if isinstance(type_, Array):
            return array_of(typed, span, self.body.builder)
        return ir.Construct(type_, tuple(plain(p, span, "a component") for p in typed), span)
