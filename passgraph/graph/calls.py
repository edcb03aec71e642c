"""Calling a kernel on targets adds a pass to the graph; nothing runs yet."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Generic, Protocol, Self, TypeAlias, TypeVar, cast, overload

import numpy as np

from passgraph import arguments
from passgraph.arguments import flag, instance, text
from passgraph.errors import GraphError
from passgraph.formats import Format, float_format
from passgraph.graph.run_values import Derived, Value, sources_of
from passgraph.graph.targets import InputSpec, Pass, PixelPass, Target, TargetSpec
from passgraph.language import ir
from passgraph.language.kernel import Kernel, function_source, kernel_from_text
from passgraph.language.long_arrays import checked_numbers, is_buffer
from passgraph.language.meanings import uint_of_bits
from passgraph.language.scope import FunctionSource
from passgraph.language.types import (
    FLOAT,
    UINT,
    VEC4,
    Array,
    ImageType,
    Matrix,
    Scalar,
    Struct,
    Type,
    Vector,
    component_count,
    element_of,
    flat_type,
    image_names,
    is_plain,
    plain_parts,
    sides_of,
)
from passgraph.language.uniform_layout import components, in_range

if TYPE_CHECKING:
    import networkx as nx

    from passgraph.glsl import Shader, ShaderText
    from passgraph.language.symbols import vec2, vec3, vec4

# Declared return types of kernels, and what a call on targets returns.  A call returns Any for text, which type
# checkers cannot read, and for structs.
One: TypeAlias = "float | vec2 | vec3 | vec4"
Two: TypeAlias = "tuple[One, One]"
Three: TypeAlias = "tuple[One, One, One]"
Pair: TypeAlias = tuple[Target, Target]
Triple: TypeAlias = tuple[Target, Target, Target]
Made = TypeVar("Made")


def channels_of(type_: Type) -> int:
    return component_count(type_)


def default_format(type_: Type) -> Format:
    """Return the float32 format for a result type."""
    return float_format(channels_of(type_))


class PixelKernel(Kernel, Generic[Made]):
    """A kernel that runs once per pixel.  Calling it on targets adds a pass and returns its target or targets."""

    #: Builds the kernel for a set of images that have mipmaps, whose level it selects by derivatives.
    leveled: Callable[[frozenset[str]], ir.TypedKernel] | None = None
    #: The source text of the shader that it was parsed from.
    shader: ShaderText | None = None
    #: Targets may have fewer channels than the result: they get the first ones.
    alike = False

    def __init__(self, function: FunctionSource, known_sizes: bool = False, alike: bool = False) -> None:
        super().__init__(function, "pixel")
        self.known_sizes, self.alike = known_sizes, alike

    @classmethod
    def of_program(cls, program: ir.TypedKernel, known_sizes: bool = False) -> Self:
        kernel = super().of_program(program)
        kernel.known_sizes = known_sizes
        return kernel

    @classmethod
    def of_shader(cls, shader: Shader, known_sizes: bool = False) -> Self:
        """Return a kernel from a fragment shader; reads of images with mipmaps select their level by derivatives."""
        kernel = cls.of_program(shader.program, known_sizes)
        kernel.leveled, kernel.shader = shader.leveled, shader.source
        return kernel

    def __call__(self, /, *arguments: Any, into: Any = None, name: str | None = None, **named: Any) -> Made:
        """Add a pass that writes ``into``; its default name is that of its target, or the kernel's."""
        return self.called(named, into, name, arguments)

    def called(
        self, named: Mapping[str, Any], into: Any = None, name: str | None = None, arguments: Sequence[Any] = ()
    ) -> Made:
        """Add a pass; for parameters with foreign names, which may include ``into`` and ``name``."""
        self.check_constants()
        name = pass_name(name, into, self.name, f"kernel {self.name}: the pass's name")
        bound = bind(self, arguments, named)
        specs = _specs(into, self, name)
        images, values, constants = split_arguments(self, bound)
        kernel = _narrowed(_with_levels(self, images), specs, alike=self.alike)
        for spec, result in zip(specs, kernel.program.results, strict=True):
            _check_result(self.name, spec, result.type)
        if any(spec in (t.spec for t in images.values() if not t.is_previous) for spec in specs):
            raise GraphError(
                f"pass {name!r} reads and writes one target; write into another one, or read "
                "last frame's by pg.previous()"
            )
        node = PixelPass(name, kernel, images, values, constants, specs, self.known_sizes)
        targets = tuple(Target(spec, node, slot) for slot, spec in enumerate(specs))
        return cast("Made", targets[0] if len(targets) == 1 else targets)


def pass_name(given: object, into: object, otherwise: str, what: str) -> str:
    """Return the given name, or that of the targets that the pass writes first, or ``otherwise``."""
    if given is not None:
        return text(given, what)
    specs = into if isinstance(into, (tuple, list)) else [into]
    names = [spec.name for spec in specs if isinstance(spec, TargetSpec)]
    return "+".join(names) if names and len(names) == len(specs) else otherwise


def _specs(into: Any, kernel: Kernel, name: str) -> tuple[TargetSpec, ...]:
    results = kernel.program.results
    if into is None:
        names = [name if len(results) == 1 else f"{name}.{result.name}" for result in results]
        return tuple(TargetSpec(n, default_format(r.type)) for n, r in zip(names, results, strict=True))
    specs = tuple(into) if isinstance(into, (tuple, list)) else (into,)
    for spec in specs:
        if isinstance(spec, Target):
            raise GraphError(
                f"pass {name!r} writes every pixel of {spec.name!r}; give a new pg.target(...), not a handle"
            )
        if not isinstance(spec, TargetSpec):
            raise GraphError(f"pass {name!r} writes into pg.target(...), got {type(spec).__name__}")
    if len(specs) != len(results):
        raise GraphError(
            f"kernel {kernel.name} returns {len(results)} result(s), and pass {name!r} has {len(specs)} target(s)"
        )
    if len(set(specs)) != len(specs):
        raise GraphError(f"pass {name!r} writes one target twice")
    return specs


def _with_levels(kernel: PixelKernel[Made], images: Mapping[str, Target]) -> Kernel:
    """Return the variant of a kernel for the images that have mipmaps."""
    names = frozenset(name for name, target in images.items() if target.has_levels)
    if kernel.leveled is None or not names:
        return kernel
    return kernel.computing(kernel.leveled(names))


def _narrowed(kernel: Kernel, specs: Sequence[TargetSpec], *, alike: bool) -> Kernel:
    """Return a kernel that drops the last channels of vec4 results: alpha for targets with three channels, since
    effects compute with four and most pictures have three; and what a target lacks if channels are computed ``alike``.
    """
    program, results = kernel.program, list(kernel.program.results)
    for slot, (spec, result) in enumerate(zip(specs, results, strict=True)):
        channels = spec.format.channels
        if result.type == VEC4 and (channels == 3 or (alike and channels < 3)):
            type_ = FLOAT if channels == 1 else Vector(FLOAT, channels)
            results[slot] = ir.Result(result.name, type_, ir.Swizzle(type_, result.value, tuple(range(channels))))
    if results == list(program.results):
        return kernel
    return kernel.computing(replace(program, results=tuple(results)))


def _check_result(name: str, spec: TargetSpec, type_: Type) -> None:
    if spec.format.is_depth:
        raise GraphError(f"kernel {name} cannot write depth target {spec.name!r}; depth is written by draws")
    if channels_of(type_) != spec.format.channels:
        fits = ("r", "rg", "rgb", "rgba")[channels_of(type_) - 1]
        raise GraphError(
            f"kernel {name} returns {type_}, and target {spec.name!r} has {spec.format.channels} channel(s) "
            f"({spec.format.name}); use a format such as {fits}32f or return {spec.format.channels} "
            "component(s)"
        )


def bind(kernel: Kernel, arguments: Sequence[Any], named: Mapping[str, Any]) -> dict[str, Any]:
    """Return the arguments by parameter name."""
    names = [p.name for p in kernel.parameters]
    if len(arguments) > len(names):
        raise GraphError(
            f"kernel {kernel.name} takes {len(names)} arguments ({', '.join(names)}), got {len(arguments)}"
        )
    bound = dict(zip(names, arguments, strict=False))
    for key, value in named.items():
        if key not in names:
            raise GraphError(f"kernel {kernel.name} has no parameter {key!r}; it has {', '.join(names) or 'none'}")
        if key in bound:
            raise GraphError(f"kernel {kernel.name} gets {key!r} twice")
        bound[key] = value
    missing = [p.name for p in kernel.parameters if p.name not in bound and not p.has_default]
    if missing:
        raise GraphError(f"kernel {kernel.name} needs {', '.join(missing)}")
    return bound


def split_arguments(
    kernel: Kernel, bound: Mapping[str, Any]
) -> tuple[dict[str, Target], dict[str, object], dict[str, object]]:
    """Split a kernel's arguments into images, values and baked constants, each checked against its parameter."""
    images: dict[str, Target] = {}
    values: dict[str, object] = {}
    constants: dict[str, object] = {}
    for parameter in kernel.parameters:
        where = f"kernel {kernel.name}, parameter {parameter.name!r}"
        argument = bound.get(parameter.name, parameter.default)
        if isinstance(parameter.type, ImageType):
            images[parameter.name] = _image(argument, where)
        elif image_names(parameter.type, parameter.name):
            _take_apart(argument, parameter, where, images, values)
        elif parameter.const:
            if isinstance(argument, (Value, Derived, Target)):
                raise GraphError(
                    f"{where} is Const: it is baked when the graph is compiled and takes a number, got {argument!r}"
                )
            _check_range(argument, parameter, parameter.type, where)
            constants[parameter.name] = argument
        else:
            values[parameter.name] = _value(argument, parameter, where)
    return images, values, constants


def _take_apart(
    argument: Any, parameter: ir.Parameter, where: str, images: dict[str, Target], values: dict[str, object]
) -> None:
    """Return the images of a struct parameter by name; its other fields are treated like any value."""
    if isinstance(argument, (Value, Derived)):
        raise GraphError(
            f"{where} holds images, which are known when the graph is made; give a {parameter.type} whose images are "
            f"targets, not the run value {argument.name!r}"
        )
    for name, type_, value in leaves(argument, parameter.type, parameter.name):
        if isinstance(type_, ImageType):
            images[name] = _image(value, f"{where}, {name}")
        elif isinstance(type_, Array) and isinstance(type_.element, ImageType):
            for k, one in enumerate(value):  # type: ignore[arg-type, var-annotated]
                images[f"{name}.{k}"] = _image(one, f"{where}, {name}.{k}")
        else:
            _check_numbers(value, type_, f"{where}, {name}")
            values[parameter.name] = argument


def _image(argument: Any, where: str) -> Target:
    if isinstance(argument, TargetSpec):
        raise GraphError(f"{where}: target {argument.name!r} is declared but not written; pass what its pass returned")
    if not isinstance(argument, Target):
        raise GraphError(f"{where} is an Image and takes a target or pg.Input(...), got {type(argument).__name__}")
    return argument


def _value(argument: Any, parameter: ir.Parameter, where: str) -> object:
    type_ = parameter.type
    if isinstance(argument, Target):
        raise GraphError(f"{where} is {type_}, got the target {argument.name!r}; declare the parameter as Image")
    if isinstance(argument, (Value, Derived)):
        return argument
    for name, leaf, value in leaves(argument, type_, where):
        _check_range(value, parameter, leaf, name)
    return argument


def check_given(passes: Iterable[Pass], given: Mapping[str, object]) -> None:
    """Raise InputError for values of a run, by name, that the passes do not allow: as a run would, but before one."""
    for node in passes:
        parameters = {parameter.name: parameter for kernel in node.kernels for parameter in kernel.parameters}
        for name, handle in node.values.items():
            for source in sources_of({name: handle}):
                if source.name in given and not isinstance(given[source.name], (Value, Derived)):
                    source.check(given[source.name])
            if isinstance(handle, Value) and handle.name in given:
                _value(given[handle.name], parameters[name], f"kernel {node.name}, parameter {name!r}")


def _check_range(value: object, parameter: ir.Parameter, type_: Type, name: str) -> None:
    """Raise InputError unless it is a value of a plain type within the parameter's range."""
    if parameter.range is None:
        _check_numbers(value, type_, name)
    else:
        in_range(value, type_, parameter.range, name)


def _check_numbers(value: object, type_: Type, name: str) -> None:
    """Raise InputError unless it is a value of a plain type."""
    if isinstance(type_, Array) and is_buffer(type_):
        checked_numbers(value, type_, name)
    else:
        components(value, type_, name)


def leaves(value: object, type_: Type, name: str) -> list[tuple[str, Type, object]]:
    """Return a parameter's plain parts and images: itself, the fields of a struct (its attributes), or one array per
    part for an array of structs, in the order of :func:`passgraph.language.types.plain_parts`."""
    if isinstance(type_, Array):
        return _columns(value, type_, name)
    if not isinstance(type_, Struct):
        return [(name, type_, value)]
    parts: list[tuple[str, Type, object]] = []
    for field_name, field_type in type_.fields:
        if not hasattr(value, field_name):
            raise GraphError(
                f"{name} is {type_.name} and needs a field {field_name!r}, which {type(value).__name__} lacks"
            )
        parts += leaves(getattr(value, field_name), field_type, f"{name}.{field_name}")
    return parts


def _columns(value: object, type_: Array, name: str) -> list[tuple[str, Type, object]]:
    """Return the plain parts of an array; an array of structs has one array per part."""
    if isinstance(type_.element, (Scalar, Vector, Matrix)):
        return [(name, type_, value)]
    flat = flat_type(type_)
    sides = sides_of(type_)
    if isinstance(value, np.ndarray) and value.shape[: len(sides)] == sides and is_plain(flat):
        return [(name, flat, value.reshape(-1, *value.shape[len(sides) :]))]  # avoids a list of each row
    entries = _entries(value, type_, name)
    if not isinstance(flat.element, Struct):
        return [(name, flat, entries)]
    rows = [leaves(one, flat.element, f"{name}[{k}]") for k, one in enumerate(entries)]
    parts: list[tuple[str, Type, object]] = []
    for (path, part), *column in zip(plain_parts(type_, name), *rows, strict=True):
        parts.append((path, part, [one for _, inner, given in column for one in _in_a_row(given, inner, path)]))
    return parts


def _in_a_row(entries: Any, type_: Type, name: str) -> list[Any]:
    """Return the entries that one struct adds to an array of a part: one value, or an inner array's entries."""
    if not isinstance(type_, Array):
        return [entries]
    if isinstance(type_.element, ImageType):
        return _entries(entries, type_, name)
    entry, element = type_.element, element_of(type_)
    numbers: Any = components(entries, type_, name)
    if element is not FLOAT:
        numbers = numbers.astype(np.int64)
    if element is UINT:
        numbers = uint_of_bits(numbers)
    return list(numbers) if isinstance(entry, Scalar) else list(numbers.reshape(type_.length, -1))


def _entries(value: Any, type_: Array, name: str) -> list[Any]:
    """Return an array's entries on the host; nested arrays are flattened."""
    listed = isinstance(value, (list, tuple)) or (isinstance(value, np.ndarray) and value.ndim > 0)
    if not listed or len(value) != type_.length:
        raise GraphError(f"{name} must be {type_}, a list of {type_.length}, got {arguments.shown(value)}")
    if not isinstance(type_.element, Array):
        return list(value)
    inner = type_.element
    return [one for k, row in enumerate(value) for one in _entries(row, inner, f"{name}[{k}]")]


class _Maker(Protocol):
    """A decorator with settings."""

    @overload
    def __call__(self, definition: Callable[..., One], /) -> PixelKernel[Target]: ...
    @overload
    def __call__(self, definition: Callable[..., Two], /) -> PixelKernel[Pair]: ...
    @overload
    def __call__(self, definition: Callable[..., Three], /) -> PixelKernel[Triple]: ...
    @overload
    def __call__(self, definition: Callable[..., object], /) -> PixelKernel[Any]: ...


@overload
def kernel(
    definition: Callable[..., One], *, known_sizes: bool = False, alike: bool = False
) -> PixelKernel[Target]: ...
@overload
def kernel(definition: Callable[..., Two], *, known_sizes: bool = False, alike: bool = False) -> PixelKernel[Pair]: ...
@overload
def kernel(
    definition: Callable[..., Three], *, known_sizes: bool = False, alike: bool = False
) -> PixelKernel[Triple]: ...
@overload
def kernel(
    definition: Callable[..., object], *, known_sizes: bool = False, alike: bool = False
) -> PixelKernel[Any]: ...
@overload
def kernel(*, known_sizes: bool = False, alike: bool = False) -> _Maker: ...
@overload
def kernel(
    *, source: str, name: str | None = None, known_sizes: bool = False, alike: bool = False
) -> PixelKernel[Any]: ...
@overload
def kernel(*, glsl: str, name: str | None = None, known_sizes: bool = False) -> PixelKernel[Any]: ...
def kernel(
    definition: Callable[..., Any] | None = None,
    *,
    source: str | None = None,
    glsl: str | None = None,
    name: str | None = None,
    known_sizes: bool = False,
    alike: bool = False,
) -> PixelKernel[Any] | _Maker:
    """Make a kernel that runs once for each pixel of its target(s).

    Use it as a decorator, or give ``source``: text is parsed and never executed, so untrusted text is safe.  ``glsl``
    is the text of a fragment shader instead (docs/shaders.md): its uniforms become the parameters, samplers first, and
    ``name`` names the kernel.  With ``known_sizes`` the kernel is compiled for the sizes in the plan: ``image.size``
    and ``output_size()`` are constants, branches on them cost nothing, and other sizes compile it again.  ``alike``
    states that every channel is computed like the first: targets with fewer channels get the first ones.

    Raises
    ------
    KernelError
        For anything outside the language, with file, line, source line and caret.

    Examples
    --------
    >>> invert = kernel(source="def invert(color: Image) -> vec4: return vec4(1.0 - color[0, 0].rgb, 1.0)")
    >>> invert
    <passgraph pixel kernel invert(color: Image)>
    """
    flag(known_sizes, "a kernel's known_sizes")
    flag(alike, "a kernel's alike")
    if glsl is not None:
        if definition is not None or source is not None:
            raise GraphError("a kernel is made from a function, from source=... or from glsl=..., one of the three")
        return PixelKernel.of_shader(_shader(glsl, name), known_sizes)
    if definition is None and source is None and name is None and (known_sizes or alike):
        return lambda marked: PixelKernel(_definition(marked, None, None), known_sizes, alike)
    return PixelKernel(_definition(definition, source, name), known_sizes, alike)


def vertex(
    definition: Callable[..., Any] | None = None, *, source: str | None = None, name: str | None = None
) -> Kernel:
    """Make a kernel that runs once per vertex and returns a struct with ``position: vec4`` in clip space."""
    return Kernel(_definition(definition, source, name), "vertex")


def fragment(
    definition: Callable[..., Any] | None = None, *, source: str | None = None, name: str | None = None
) -> Kernel:
    """Make a kernel that runs once per fragment, on the interpolated struct of the vertex kernel."""
    return Kernel(_definition(definition, source, name), "fragment")


def _definition(definition: Callable[..., Any] | None, source: str | None, name: str | None) -> Any:
    if (definition is None) == (source is None):
        raise GraphError("a kernel is made from a function or from source=..., one of the two")
    if source is not None:
        return kernel_from_text(source, None if name is None else text(name, "the name of a function"))
    assert definition is not None
    return function_source(definition)


def _shader(glsl: str, name: str | None) -> Shader:
    from passgraph.glsl import parse  # imported here, as few programs read shaders

    return parse(glsl, name="shader" if name is None else text(name, "the name of a kernel"))


def graph(*outputs: Target) -> nx.DiGraph:
    """Return the graph behind some targets: passes and targets are nodes, data flows along edges.

    >>> invert = kernel(source="def invert(color: Image) -> vec4: return vec4(1.0 - color[0, 0].rgb, 1.0)")
    >>> from passgraph.graph.targets import Input
    >>> [str(kind) for _, kind in graph(invert(Input("frame"))).nodes(data="kind")]
    ['target', 'pass', 'input']
    """
    import networkx as nx

    for output in outputs:
        instance(output, Target, "what pg.graph takes", "a target that a pass returned, or an input")
    network = nx.DiGraph()
    pending = [output.content for output in outputs]
    seen: set[object] = set()
    while pending:
        target = pending.pop()
        if target in seen:
            continue
        seen.add(target)
        kind = "input" if isinstance(target.spec, InputSpec) else "history" if target.is_previous else "target"
        network.add_node(target, kind=kind, name=target.name)
        if target.made_by is None:
            continue
        node = target.made_by
        network.add_node(node, kind="pass", name=node.name)
        network.add_edge(node, target)
        for parameter in node.reads:
            network.add_edge(parameter.content, node)
            pending.append(parameter.content)
    return network
