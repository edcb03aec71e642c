"""Compare every value that a kernel computes at a pixel of a backend with the oracle's bounds; find the first wrong
one.

A backend returns pixels, not variables. So the kernel is rewritten: every pixel computes the inspected one, and the
target has a pixel for each value that a variable takes, a function returns or a branch tests. Pixel n keeps the n-th of
them. The reference, the oracle and the backend run the rewritten kernel on the pictures that the pass read on the
backend, so a difference belongs to this pass.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

from passgraph.backends.base import Backend
from passgraph.backends.reference import ReferenceBackend
from passgraph.backends.reference.traced import is_about_returns, is_of_source, variable_of
from passgraph.errors import GraphError
from passgraph.formats import FORMATS, float_format
from passgraph.graph.run_values import OUTPUT_SIZE, sources_of
from passgraph.graph.run_values import Value as RunValue
from passgraph.graph.targets import Absolute, InputSpec, Outputs, PixelPass, Target, TargetSpec, named_outputs
from passgraph.language import ir
from passgraph.language.source import Span
from passgraph.language.types import BOOL, FLOAT, INT, IVEC2, UINT, VEC4, Matrix, Scalar, Vector
from passgraph.plan.data import PixelStep
from passgraph.run.compile import compile
from passgraph.run.execution import Execution
from passgraph.run.inspection import Inspection, step_named
from passgraph.verify.oracle.pass_bounds import Passes

#: Most values compared; later ones are ignored.
MOST_VALUES = 1024
#: Parameter with the position of the inspected pixel, and the locals of the rewritten kernel.
PIXEL, COUNT, KEPT, PLACE = "inspected_pixel", "$count", "$kept", "$place"
#: Prefix of the input that replaces an image, before the image's name.
IMAGE = "image "
Numbers: TypeAlias = tuple[float, ...]


@dataclass(frozen=True)
class Probe:
    """A place in the kernel where a value is kept: ``size`` numbers of a variable, of a loop's index at each trip,
    of what is returned (``name`` is empty or a field), or of a branch's condition."""

    span: Span
    name: str
    size: int
    kind: str  # "takes", "trip", "returns" or "branch"


@dataclass(frozen=True)
class LineValue:
    """A value of the kernel at the pixel.

    Attributes
    ----------
    probe : its place in the kernel
    value, reference : on the backend, and in float64 rounded to float32
    low, high : the bounds of a conforming backend
    allowed : True if the backend took this step too, with a value within the bounds
    """

    probe: Probe
    value: Numbers
    reference: Numbers
    low: Numbers
    high: Numbers
    allowed: bool


@dataclass(frozen=True)
class Lines:
    """The values of one pass at one pixel, in the order in which the reference takes them.

    ``inspection`` is the reference's trace in float64, on the pictures that the pass read on the backend.
    """

    backend: str
    inspection: Inspection
    values: Sequence[LineValue]

    @property
    def first_wrong(self) -> int | None:
        """Return the index of the first value outside its bounds; None if there is none."""
        return next((n for n, value in enumerate(self.values) if not value.allowed), None)


def lines_at(
    outputs: Outputs,
    backend: Backend,
    pixel: tuple[int, int],
    given: Mapping[str, Any],
    *,
    step: str | None = None,
    size: tuple[int, int] | None = None,
) -> Lines:
    """Compare each value that a full-screen pass computes at a pixel with the bounds of a conforming backend.

    Parameters
    ----------
    outputs, size
        As for :func:`passgraph.compile`.
    backend
        An open backend.
    pixel
        (x, y), from 0 at the left and on top.
    given
        Pictures and values by name, as for a run. The run is the first one: history holds its initial value.
    step
        The pass's name; default: the last pass.

    Raises
    ------
    GraphError
        For a draw, an unknown pass, or a pixel outside the target.

    Examples
    --------
    >>> import numpy as np
    >>> import passgraph as pg
    >>> from passgraph.backends.registry import open_backend
    >>> kernel = pg.kernel(source='''def scale(color: Image) -> vec4:
    ...     c = color[0, 0] * 0.1
    ...     return c + 0.5''')
    >>> with open_backend("numpy") as backend:
    ...     found = lines_at(kernel(pg.Input("frame")), backend, (0, 0), {"frame": np.ones((1, 1, 4), np.float32)})
    >>> [(value.probe.span.line, value.probe.name, value.value[0]) for value in found.values], found.first_wrong
    ([(2, 'c', 0.10000000149011612), (3, '', 0.6000000238418579)], None)
    """
    passes = Passes(named_outputs(outputs), size, [given])
    looked = step_named(passes.plan, step)
    if not isinstance(looked, PixelStep):
        raise GraphError(f"lines of pass {looked.name!r}: it draws triangles; expected a full-screen pass")
    (x, y), (width, height) = pixel, looked.size
    if not (0 <= x < width and 0 <= y < height):
        raise GraphError(f"lines of pass {looked.name!r}: pixel ({x}, {y}) is outside of {width}x{height}")
    probed = _Probed(looked.source.kernel.program, looked.size)
    inputs = _pictures_read(passes, looked, backend)
    own = {**inputs, **passes.frames[0][1], OUTPUT_SIZE.name: passes.plan.size}
    node = _on_inputs(looked, inputs)
    with compile(Target(node.into[0], node), ReferenceBackend(), non_finite="keep") as program:
        inspection = program.inspect(x, y, **_needed(node, own))
    return Lines(backend.name, inspection, _compared(node, probed, backend, {**own, PIXEL: pixel}))


def _pictures_read(passes: Passes, looked: PixelStep, backend: Backend) -> dict[str, Any]:
    """Return the content of each image of a pass on a backend, by the name of the input that replaces it."""
    (pictures, values), pictures_read = passes.frames[0], dict[str, Any]()
    resources = {resource.name: resource.id for resource in passes.plan.resources} | dict(looked.images)
    execution = Execution(passes.plan, backend)
    try:

        def observe(step: object, _: Any) -> None:
            if step is looked:
                for name, target in looked.source.images.items():
                    pictures_read[IMAGE + name] = execution.download(resources.get(name, resources.get(target.name, 0)))

        execution.run(pictures, values, observe)
    finally:
        execution.release()
    return pictures_read


def _on_inputs(looked: PixelStep, inputs: Mapping[str, Any]) -> PixelPass:
    """Return the pass with inputs in place of the targets that it reads."""
    images = {}
    for name, target in looked.source.images.items():
        height, width, channels = inputs[IMAGE + name].shape
        stored_format = target.spec.format
        format_ = float_format(channels) if stored_format is None or stored_format.is_depth else stored_format
        spec = InputSpec(IMAGE + name, format_, (width, height))
        images[name] = replace(target, spec=spec, made_by=None, slot=0, frames_ago=0)
    into = tuple(replace(spec, size=Absolute(*looked.size)) for spec in looked.source.into)
    return replace(looked.source, images=images, into=into)


def _needed(node: PixelPass, inputs: Mapping[str, Any]) -> dict[str, Any]:
    """Return the pictures and values that a pass uses."""
    names = {*(image.name for image in node.images.values()), *(source.name for source in sources_of(node.values))}
    return {name: value for name, value in inputs.items() if name in names}


_TARGETS = {"value": "rgba32f", "place": "r32f"}


def _compared(node: PixelPass, probed: _Probed, backend: Backend, inputs: Mapping[str, Any]) -> list[LineValue]:
    """Return the reference's values in order, each with the backend's."""
    into = tuple(TargetSpec(name, FORMATS[format_], Absolute(MOST_VALUES, 1)) for name, format_ in _TARGETS.items())
    kernel, pixel = node.kernel.computing(probed.program), RunValue(PIXEL, tuple)
    node = replace(node, name="lines", kernel=kernel, values={**node.values, PIXEL: pixel}, into=into)
    targets = {spec.name: Target(spec, node, slot) for slot, spec in enumerate(into)}
    passes = Passes(targets, None, [_needed(node, inputs)])
    expected, allowed = passes.allowed(backend.promises)
    (step,) = passes.written(backend)
    names = {passes.plan.resources[key[2]].name: key for key in expected}
    value, place = names["value"], names["place"]
    lines = []
    for n in range(MOST_VALUES):
        number = int(expected[place][0, n, 0])
        if number < 0:
            break
        probe = probed.probes[number]
        bounds = [allowed[key].values for key in (value, place)]
        beyond = [b.without(step[key])[0, n] for b, key in zip(bounds, (value, place), strict=True)]
        low, high = (tuple(end[0, n, : probe.size].tolist()) for end in (bounds[0].lo, bounds[0].hi))
        took, reference = (tuple(picture[value][0, n, : probe.size].tolist()) for picture in (step, expected))
        lines.append(LineValue(probe, took, reference, low, high, not any(b.any() for b in beyond)))
    return lines


class _Probed:
    """A kernel that computes one pixel everywhere; ``program`` gives the n-th value at pixel (n, 0), and its place in
    ``probes``, -1 where there are fewer values."""

    def __init__(self, program: ir.TypedKernel, size: tuple[int, int]) -> None:
        self.size = size
        self.probes: list[Probe] = []
        self._pixel = ir.Uniform(IVEC2, PIXEL)
        start = (
            ir.Assign(COUNT, ir.Literal(INT, 0)),
            ir.Assign(KEPT, ir.Construct(VEC4, (ir.Literal(FLOAT, 0.0),) * 4)),
            ir.Assign(PLACE, ir.Literal(FLOAT, -1.0)),
        )
        results = (ir.Result("value", VEC4, ir.Local(VEC4, KEPT)), ir.Result("place", FLOAT, ir.Local(FLOAT, PLACE)))
        parameters = (*program.parameters, ir.Parameter(PIXEL, IVEC2))
        body = (*start, *self._block(program.body))
        self.program = replace(program, parameters=parameters, body=body, results=results, keep=None)

    def _block(self, statements: Sequence[ir.Stmt]) -> tuple[ir.Stmt, ...]:
        return tuple(probed for statement in statements for probed in self._statement(statement))

    def _statement(self, statement: ir.Stmt) -> Iterator[ir.Stmt]:
        if isinstance(statement, ir.Assign):
            value = self._here(statement.value)
            yield replace(statement, value=value)
            if (variable := variable_of(statement.name)) is not None:
                name, returns = variable
                local = ir.Local(value.type, statement.name)
                yield from self._keep(local, statement.span, name, "returns" if returns else "takes")
        elif isinstance(statement, ir.If):
            condition = self._here(statement.condition)
            if not is_about_returns(statement.condition):
                yield from self._keep(condition, statement.span, "", "branch")
            yield replace(
                statement, condition=condition, then=self._block(statement.then), orelse=self._block(statement.orelse)
            )
        elif isinstance(statement, ir.For):
            start, stop, step = (self._here(end) for end in (statement.start, statement.stop, statement.step))
            name, _ = variable_of(statement.name) or (statement.name, False)
            index = tuple(self._keep(ir.Local(INT, statement.name), statement.span, name, "trip"))
            yield replace(statement, start=start, stop=stop, step=step, body=(*index, *self._block(statement.body)))
        else:
            yield statement

    def _here(self, expression: ir.Expr) -> ir.Expr:
        """Rewrite an expression to the inspected pixel, independent of the pixel that computes it."""
        if isinstance(expression, ir.Builtin) and expression.name == "pixel":
            return self._pixel
        if isinstance(expression, ir.Builtin) and expression.name == "output_size":
            return ir.Construct(IVEC2, tuple(ir.Literal(INT, side) for side in self.size))
        probed = ir.with_parts(expression, self._here)
        if isinstance(probed, ir.Texel) and probed.relative:
            x, y = (
                ir.Apply(INT, "add", (offset, ir.Swizzle(INT, self._pixel, (axis,))))
                for axis, offset in enumerate((probed.x, probed.y))
            )
            return replace(probed, x=x, y=y, relative=False)
        return probed

    def _keep(self, value: ir.Expr, span: Span, name: str, kind: str) -> Iterator[ir.Stmt]:
        """Yield statements that keep a value if it is the n-th, where n is the column of the computing pixel."""
        if not is_of_source(span):
            return
        for part, suffix in _columns(value):
            numbers = _floats(part)
            padded = ir.Construct(VEC4, (*numbers, *(ir.Literal(FLOAT, 0.0),) * (4 - len(numbers))))
            place = ir.Literal(FLOAT, float(len(self.probes)))
            self.probes.append(Probe(span, name + suffix, len(numbers), kind))
            count = ir.Local(INT, COUNT)
            is_this = ir.Apply(BOOL, "equal", (count, ir.Swizzle(INT, ir.Builtin(IVEC2, "pixel"), (0,))))
            yield ir.Assign(KEPT, ir.Select(VEC4, is_this, padded, ir.Local(VEC4, KEPT)))
            yield ir.Assign(PLACE, ir.Select(FLOAT, is_this, place, ir.Local(FLOAT, PLACE)))
            yield ir.Assign(COUNT, ir.Apply(INT, "add", (count, ir.Literal(INT, 1))))


def _columns(value: ir.Expr) -> Iterator[tuple[ir.Expr, str]]:
    """Yield a scalar or vector unchanged, a matrix by columns; arrays are left out."""
    if isinstance(value.type, Matrix):
        for column in range(value.type.columns):
            yield ir.Index(Vector(FLOAT, value.type.rows), value, ir.Literal(INT, column)), f"[{column}]"
    elif isinstance(value.type, (Scalar, Vector)):
        yield value, ""


def _floats(value: ir.Expr) -> tuple[ir.Expr, ...]:
    """Return the components as floats; whole numbers beyond 2^24 are rounded, bools are 0 and 1."""
    type_ = value.type
    if isinstance(type_, Vector):
        return tuple(_float(ir.Swizzle(type_.element, value, (k,))) for k in range(type_.size))
    return (_float(value),)


def _float(value: ir.Expr) -> ir.Expr:
    if value.type == BOOL:
        return ir.Select(FLOAT, value, ir.Literal(FLOAT, 1.0), ir.Literal(FLOAT, 0.0))
    if value.type == INT:
        return ir.Apply(FLOAT, "to_float", (value,))
    return ir.Apply(FLOAT, "float_from_uint", (value,)) if value.type == UINT else value
