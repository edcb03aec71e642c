"""Parse the text of a kernel to its typed intermediate representation.

Functions are inlined and structs split into fields (:mod:`.function_body`); branches, loops and exits are in
:mod:`.statements`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from passgraph.errors import KernelError
from passgraph.language import ir
from passgraph.language.assignments import Variable
from passgraph.language.composites import array_part
from passgraph.language.function_body import KEPT, Builder, Frame
from passgraph.language.long_arrays import check_reads
from passgraph.language.scope import FunctionSource, Scope
from passgraph.language.signature import VERTEX, read_signature
from passgraph.language.source import Span, fail
from passgraph.language.types import (
    BOOL,
    FLOAT,
    VEC4,
    Array,
    ImageType,
    Matrix,
    Scalar,
    Struct,
    TupleType,
    Type,
    Vector,
    element_of,
    image_names,
)
from passgraph.language.values import ImageValue, Part, StructValue


def parse_kernel(function: FunctionSource, stage: ir.Stage) -> ir.TypedKernel:
    """Parse a whole kernel: signature, body, results.

    Raises
    ------
    KernelError
        For anything outside of the language, with file, line, source line and caret.
    """
    program, _ = parse_with_scopes(function, stage)
    return program


def parse_with_scopes(
    function: FunctionSource, stage: ir.Stage
) -> tuple[ir.TypedKernel, Mapping[FunctionSource, Scope]]:
    """Return the kernel, and for each function in it the scope that recorded its captured constants."""
    builder = Builder(stage)
    try:
        return _parse(function, stage, builder), builder.scopes
    except RecursionError:
        span = function.source.span(function.node)
        raise KernelError(
            span.point_at(f"{function.name} nests too deeply (calls, branches and expressions together)")
        ) from None


def _parse(function: FunctionSource, stage: ir.Stage, builder: Builder) -> ir.TypedKernel:
    signature = read_signature(function)
    builder.calls.append(function.node)
    span = function.source.span(function.node)
    _check_result(function, stage, signature.result, span)
    frame = Frame(function, builder, signature.result)
    for parameter in signature.parameters:
        _check_parameter(parameter, stage, signature.parameters[0])
        frame.bind(parameter.name, parameter.type, _parameter_part(parameter, stage), parameter.span)
    builder.emit(ir.Assign(KEPT, ir.Literal(BOOL, True, span), span))
    frame.run()
    keep = builder.keep_or_clear(frame.result, span)
    results = tuple(_results(frame.result))
    body = builder.body()
    check_reads(signature.parameters, *body)
    return ir.TypedKernel(function.name, stage, signature.parameters, body, results, keep, span)


def _parameter_part(parameter: ir.Parameter, stage: ir.Stage) -> Part:
    if parameter.type == VERTEX and stage == "vertex":
        fields = {n: ir.Builtin(t, "vertex", parameter.span, n) for n, t in VERTEX.fields}  # type: ignore[arg-type]
        return StructValue(VERTEX, dict(fields))
    if stage == "fragment" and isinstance(parameter.type, Struct):
        return _varyings(parameter.type, parameter.span)
    if stage in ("blend", "border"):
        assert isinstance(parameter.type, (Scalar, Vector))  # library text
        return ir.Builtin(parameter.type, parameter.name, parameter.span)
    return parameter_value(parameter.type, parameter.name, parameter.const, parameter.span)


def _varyings(struct: Struct, span: Span) -> StructValue:
    fields: dict[str, Part] = {}
    for name, type_ in struct.fields:
        fields[name] = ir.Builtin(type_, "varying", span, name)  # type: ignore[arg-type]
    return StructValue(struct, fields)


def parameter_value(type_: Type, name: str, const: bool, span: Span) -> Part:
    """Return a parameter as a value; a struct is split into fields."""
    if isinstance(type_, ImageType):
        return ImageValue(name)
    if isinstance(type_, Struct):
        return StructValue(type_, {n: parameter_value(t, f"{name}.{n}", const, span) for n, t in type_.fields})
    if isinstance(type_, Array):
        return array_part(type_, lambda path, flat: _uniforms(flat, path, const, span), name)
    assert isinstance(type_, (Scalar, Vector, Matrix))
    return ir.Uniform(type_, name, const, span)


def _uniforms(flat: Array, name: str, const: bool, span: Span) -> ir.Uniform | tuple[ImageValue, ...]:
    if isinstance(flat.element, ImageType):
        return tuple(map(ImageValue, image_names(flat, name)))
    return ir.Uniform(flat, name, const, span)


def _results(variable: Variable, name: str = "") -> Iterable[ir.Result]:
    if variable.fields:
        for key, member in variable.fields.items():
            yield from _results(member, key)
    else:
        assert isinstance(variable.type, (Scalar, Vector, Matrix))
        yield ir.Result(name, variable.type, ir.Local(variable.type, variable.name))


def _check_result(function: FunctionSource, stage: ir.Stage, result: Type, span: Span) -> None:
    if stage in ("function", "border"):
        return  # the library may return ints
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


def _check_parameter(parameter: ir.Parameter, stage: ir.Stage, first: ir.Parameter) -> None:
    type_ = parameter.type
    if type_ == VERTEX and stage != "vertex":
        fail(parameter.span, f"a {stage} kernel has no vertex; only @pg.vertex kernels take one")
    if isinstance(type_, Struct) and stage == "fragment" and parameter is not first:
        fail(
            parameter.span,
            "the varyings are a fragment kernel's first parameter; give other values one by one",
        )
