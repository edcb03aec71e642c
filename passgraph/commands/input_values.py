"""Values and pictures of a graph's inputs: typed text from the command line, random pictures, devices."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Any

import click

from passgraph.arguments import near, shown
from passgraph.errors import DeviceMissingError, InputError
from passgraph.graph.run_values import FILLED_IN, Derived, Value, sources_of
from passgraph.graph.targets import Pass
from passgraph.language.symbols import TYPE_MARKERS
from passgraph.language.types import BOOL, FLOAT, INT, UINT, Array, Matrix, Scalar, Type, Vector, innermost
from passgraph.language.uniform_layout import components
from passgraph.pictures import load
from passgraph.plan.dependencies import inputs_behind, passes_behind

if TYPE_CHECKING:
    from passgraph.commands.own_file import Graph
    from passgraph.language.ir import Parameter
    from passgraph.verify.conformance.case import Picture


_BOOLS = {"true": True, "yes": True, "on": True, "1": True, "false": False, "no": False, "off": False, "0": False}
#: Scalar types that can be written on a command line.
_SCALARS = (BOOL, INT, UINT, FLOAT)
_ALL: tuple[Scalar | Vector | Matrix, ...] = (
    *_SCALARS,
    *(Vector(element, size) for element in _SCALARS for size in (2, 3, 4)),
    *(Matrix(columns, rows) for columns in (2, 3, 4) for rows in (2, 3, 4)),
)
_TYPES: dict[str, Type] = {str(type_): type_ for type_ in _ALL}


class SettingType(click.ParamType[tuple[str, str]]):
    """NAME=VALUE."""

    name, examples = "NAME=VALUE", "exposure=0.5 or tint=1,0.9,0.8"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[str, str]:
        name, sign, text = str(value).partition("=")
        if not (name and sign and text.strip()):
            self.fail(f"{shown(str(value))} is not {self.name}, such as {self.examples}", param, ctx)
        return name, text


def declared(graph: Graph) -> dict[str, tuple[Value, Type | None]]:
    """Return the run values of a graph, with their types in kernels; None if they are not numbers."""
    values: dict[str, tuple[Value, Type | None]] = {}
    for node in passes_behind(list(graph.values())):
        for parameter, parameter_value in node.values.items():
            for source in sources_of({parameter: parameter_value}):
                if FILLED_IN.get(source.name) is not source:
                    # The kernel's type is that of the derived value; the source has its own.
                    type_ = (
                        _own_type(source) if isinstance(parameter_value, Derived) else _parameter_type(node, parameter)
                    )
                    values.setdefault(source.name, (source, type_))
    return values


def _own_type(value: Value) -> Type | None:
    try:
        return _TYPES.get(TYPE_MARKERS.get(value.type, ""))
    except TypeError:  # a class that cannot be a key
        return None


def _parameter_type(node: Pass, name: str) -> Type | None:
    for parameter in _parameters(node, name):
        plain = isinstance(innermost(parameter.type), (Scalar, Vector, Matrix))
        return parameter.type if plain else None
    return None


def _parameters(node: Pass, name: str) -> list[Parameter]:
    """Return the parameters of this name of a pass's kernels."""
    own = name.rpartition("/")[2]
    return [p for kernel in node.kernels for p in kernel.parameters if p.name == own]


def takers(graph: Graph, value: Value) -> list[Parameter]:
    """Return the kernels' parameters that a run value is passed to directly, without those of derived values."""
    given = [
        (node, name)
        for node in passes_behind(list(graph.values()))
        for name, one in node.values.items()
        if isinstance(one, Value) and one.name == value.name
    ]
    return [parameter for node, name in given for parameter in _parameters(node, name)]


def known_values(graphs: Mapping[str, Graph], settings: Sequence[tuple[str, str]]) -> None:
    """Raise InputError for a name that no graph has, with the most similar one."""
    known = sorted({name for graph in graphs.values() for name in declared(graph)})
    for name, _ in settings:
        if name not in known:
            raise InputError(
                f"--set: there is no value {shown(name)}{near(name, known)}; there are {', '.join(known) or 'none'}"
            )


def run_values(name: str, graph: Graph, settings: Mapping[str, str]) -> dict[str, object]:
    """Return the run values of a graph from texts, by name.

    Raises
    ------
    InputError
        For a text that does not fit the kernel's declaration, and for a missing value without a default.
    """
    given: dict[str, object] = {}
    for value, (handle, type_) in declared(graph).items():
        if value in settings:
            given[value] = _read(value, settings[value], handle, type_)
        elif handle.default is None:
            raise InputError(f"{name}: value {value!r} has no default; give {_way(value, handle, type_)}")
    return given


class TypedValue(click.ParamType[Any]):
    """A value of a kernel's type; components of a vector are separated by commas."""

    def __init__(self, type_: Type) -> None:
        self.type_, self.name = type_, str(type_)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if not isinstance(value, str):
            return value
        name = self.name if param is None or param.name is None else param.name
        try:
            return read_value(value, self.type_, name, "--" + name.replace("_", "-"))
        except InputError as error:
            raise click.UsageError(str(error), ctx) from None


def written_value(value: object) -> str:
    """Return a value as written on the command line.

    >>> written_value((0.5, 1, 2)), written_value(((1.0, 0.0), (0.0, 1.0))), written_value(True)
    ('0.5,1,2', '1,0;0,1', 'true')
    """
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, (tuple, list)):
        nested = any(isinstance(part, (tuple, list)) for part in value)
        return (";" if nested else ",").join(map(written_value, value))
    return f"{value:g}" if isinstance(value, float) else str(value)


def _way(name: str, handle: Value, type_: Type | None) -> str:
    if type_ is None:
        kind = getattr(handle.type, "__name__", str(handle.type))
        return (
            f"it one in the file, pg.Value({name!r}, {kind}, default=…): a {kind} cannot be written on a command line"
        )
    return f"--set {name}={_example(type_)} ({type_})"


def _example(type_: Type) -> str:
    if isinstance(type_, Scalar):
        return {"float": "0.5", "int": "2", "uint": "2", "bool": "true"}[type_.name]
    if isinstance(type_, Vector):
        integers = ("1", "2", "3", "4")
        parts = {"float": ("1", "0.9", "0.8", "1"), "int": integers, "uint": integers, "bool": ("true", "false") * 2}
        return ",".join(parts[type_.element.name][: type_.size])
    if isinstance(type_, Matrix):
        rows = (",".join(str(int(row == column)) for column in range(type_.columns)) for row in range(type_.rows))
        return ";".join(rows)
    assert isinstance(type_, Array)
    return ";".join([_example(type_.element)] * min(type_.length, 3))


def _read(name: str, text: str, handle: Value, type_: Type | None) -> object:
    if type_ is None:
        raise InputError(f"--set {name}: {_way(name, handle, type_)}")
    return read_value(text, type_, name, f"--set {name}")


def read_value(text: str, type_: Type, name: str, where: str) -> object:
    """Parse a value of a kernel's type; ``where`` is its option, for messages."""
    words = [word for word in re.split(r"[\s,;]+", text.strip()) if word]
    parts, left = _taken(type_, words, f"{where}={shown(text)[1:-1]}")
    wanted = _count(type_)
    if left or len(words) != wanted:
        raise InputError(
            f"{where}: {name} is {type_}, expected {wanted} number{'s' if wanted > 1 else ''} such as "
            f"{_example(type_)}{' (row by row)' if isinstance(type_, Matrix) else ''}, got {len(words)}"
        )
    components(parts, type_, where)  # raises for numbers beyond float32 or ints
    return parts


def _count(type_: Type) -> int:
    if isinstance(type_, Matrix):
        return type_.columns * type_.rows
    if isinstance(type_, Vector):
        return type_.size
    return type_.length * _count(type_.element) if isinstance(type_, Array) else 1


def _taken(type_: Type, words: list[str], where: str) -> tuple[Any, list[str]]:
    """Take a value of a type from the first words; return it, perhaps incomplete, and the remaining words."""
    if isinstance(type_, Scalar):
        return (_number(type_, words[0], where), words[1:]) if words else (None, [])
    if isinstance(type_, Vector):
        element, length = type_.element, type_.size
    elif isinstance(type_, Matrix):
        element, length = Vector(FLOAT, type_.columns), type_.rows  # type: ignore[assignment]
    else:
        assert isinstance(type_, Array)
        element, length = type_.element, type_.length  # type: ignore[assignment]
    parts = []
    for _ in range(length):
        one, words = _taken(element, words, where)
        parts.append(one)
    return parts, words


def _number(type_: Scalar, word: str, where: str) -> bool | int | float:
    try:
        if type_ == BOOL:
            return _BOOLS[word.lower()]
        return int(word) if type_ in (INT, UINT) else float(word)
    except (KeyError, ValueError):
        expected = {"bool": "true or false", "float": "a number"}.get(type_.name, "a whole number")
        raise InputError(f"{where}: expected {expected} such as {_example(type_)}, got {shown(word)}") from None


#: Default size of generated pictures for a check.
MADE_SIZE = (96, 64)


class InputType(SettingType):
    """NAME=FILE."""

    name, examples = "NAME=FILE", "frame=photo.png"


@contextmanager
def opened(names: Sequence[str]) -> Iterator[list[Any]]:
    """Open the named backends, or all available ones."""
    from passgraph.backends.registry import compared_backends, open_backend

    with ExitStack() as stack:
        backends = []
        for name in names or compared_backends():
            try:
                backends.append(stack.enter_context(open_backend(name)))
            except DeviceMissingError as error:
                if names:
                    raise
                click.echo(f"{name}: missing: {' '.join(str(error).split())}")
        if not backends:
            raise InputError("no backend is here to be checked; see: passgraph backends")
        yield backends


def read_inputs(graphs: Mapping[str, Graph], inputs: Sequence[tuple[str, str]]) -> dict[str, Picture]:
    known = sorted({name for graph in graphs.values() for name in inputs_behind(list(graph.values()))})
    for name, _ in inputs:
        if name not in known:
            raise InputError(f"there is no input {name!r}{near(name, known)}; there are {', '.join(known) or 'none'}")
    return {name: load(path) for name, path in inputs}


def plain_input(size: tuple[int, int], seed: int, number: str) -> Picture:
    """Generate a picture of usual values, for a channel type."""
    from passgraph.verify.conformance.case_inputs import plausible

    return plausible(size, seed)


def extreme_input(size: tuple[int, int], seed: int, number: str) -> Picture:
    """Generate a picture with zeros, negative, huge and tiny values too, as far as the format has them."""
    from passgraph.verify.conformance.case_inputs import picture, with_special

    return with_special(picture(size, seed), number)


def made_inputs(
    graph: Graph,
    pictures: Mapping[str, Picture],
    size: tuple[int, int] | None,
    made_size: tuple[int, int] = MADE_SIZE,
    make_picture: Callable[[tuple[int, int], int, str], Picture] = plain_input,
) -> tuple[tuple[int, int], dict[str, Picture]]:
    """Return the output's size, and a picture for each input: given, its default, or generated.

    ``made`` generates a picture from a size, a seed and a channel type: `plain_input` or `extreme_input`.
    """
    first = next(iter(pictures.values()), None)
    chosen = size or (made_size if first is None else (first.shape[1], first.shape[0]))
    brought = {}
    for number, (name, spec) in enumerate(inputs_behind(list(graph.values())).items()):
        channels = 4 if spec.format is None else spec.format.channels
        if name in pictures:
            brought[name] = pictures[name][:, :, :channels]
        elif spec.default is None:
            kind = "f4" if spec.format is None else spec.format.number
            brought[name] = make_picture(spec.size or chosen, number, kind)[:, :, :channels]
    return chosen, brought
