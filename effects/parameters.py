"""An effect's parameters, for the command line, the documentation and tests: from signature and docstring."""

from __future__ import annotations

import dataclasses
import inspect
import re
from collections.abc import Callable, Iterator, Mapping
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

from passgraph.effects.annotations import words_of
from passgraph.effects.checked import POSITIONAL, Choice
from passgraph.errors import GraphError
from passgraph.graph.run_values import Derived, Value
from passgraph.graph.targets import Target
from passgraph.language.types import Type
from passgraph.ranges import Range
from passgraph.records import dataclass
from passgraph.signatures import signature

ParameterType = Literal["float", "int", "bool", "choice", "rgb", "picture", "text", "value"]
#: ``*these`` and ``**these``.
_ANY_NUMBER = (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)
#: One entry of a docstring's list of parameters: names, a colon, and a description.
ENTRY = re.compile(r"^(\w+(?:, \w+)*) : (.*)$")


@dataclass(frozen=True, slots=True)
class Called:
    """Annotates a parameter whose name on the command line differs from its Python name."""

    name: str


@dataclass(frozen=True, slots=True)
class Text:
    """Annotates a ``str`` that the command line may set; names of passes lack it."""


@dataclass(frozen=True, slots=True)
class Parameter:
    """One parameter as plain data.

    Attributes
    ----------
    name : on the command line, with underscores
    type : "float", "int", "bool", "choice", "rgb" (three floats), "picture" (a target; on the command line a file),
        "text" or "value" (for a kernel, as its declaration ``value_type`` says)
    default : default value; None if the effect chooses one, see ``help``
    range : for numbers, and for each of the three of "rgb"; with the unit
    help : first sentence of its description in the docstring
    choices : the words of a "choice"
    value_type : the type that a kernel declares, for "value"
    required : True if there is no default and no substitute
    """

    name: str
    type: ParameterType
    default: object
    range: Range
    help: str
    choices: tuple[str, ...] = ()
    value_type: Type | None = None
    required: bool = False


def parameters_of(function: Callable[..., Any]) -> tuple[Parameter, ...]:
    """Return all arguments that can be given as text, except positional ones of an effect.

    Names, targets to write into and scenes cannot.  For a function that is not an effect: arguments with a default.

    >>> from passgraph.effects.checked import checked
    >>> import passgraph as pg
    >>> @checked
    ... def dimmed(color: pg.Target, share: Annotated[float, pg.Range(0, 1)] = 0.5, name: str = "x") -> pg.Target:
    ...     '''Darker.
    ...
    ...     Parameters
    ...     ----------
    ...     share : of the light that is left
    ...     '''
    ...     return color
    >>> [(p.name, p.type, p.default, str(p.range), p.help) for p in parameters_of(dimmed)]
    [('share', 'float', 0.5, '0 to 1', 'of the light that is left')]
    """
    parameters: list[Parameter] = []
    for name, hint, default, text in _arguments(function):
        kind = _Kind.from_hint(hint)
        if kind.alternatives:
            words = tuple(one.word() for one in kind.alternatives)
            parameters.append(Parameter(kind.called or name, "choice", words[0], Range(), text, words))
            parameters += _settings(kind.alternatives)
        elif kind.said is not None:
            words, is_required = tuple(words_of(kind.hint)), default is inspect.Parameter.empty
            default = None if is_required else default
            said = kind.called or name
            parameters.append(Parameter(said, kind.said, default, kind.range, text, words, required=is_required))
    return tuple(parameters)


def arguments_from(function: Callable[..., Any], given: Mapping[str, Any]) -> dict[str, Any]:
    """Return keyword arguments from `Parameter` names: settings of a choice become an object of the chosen class.

    Settings that the chosen class lacks are ignored, as are options of effects of another kind.
    """
    left, arguments = dict(given), dict[str, Any]()
    for name, hint, _, _ in _arguments(function):
        kind = _Kind.from_hint(hint)
        if kind.alternatives:
            word = left.pop(kind.called or name, kind.alternatives[0].word())
            settings = {each.name for each in _settings(kind.alternatives)}
            mine = {key: left.pop(key) for key in settings & left.keys()}
            by_word = {one.word(): one for one in kind.alternatives}
            if word not in by_word:
                raise GraphError(f"{kind.called or name} cannot be {word!r}; it is one of {', '.join(by_word)}")
            arguments[name] = _chosen(by_word[word], mine)
        elif kind.called in left:
            arguments[name] = left.pop(kind.called)
    return {**left, **arguments}


def _chosen(class_: type[Choice], settings: Mapping[str, Any]) -> Choice:
    arguments: dict[str, Any] = {}
    for field, kind in _fields(class_):
        if kind.alternatives:
            arguments[field.name] = _chosen(kind.alternatives[0], settings)
        elif (kind.called or field.name) in settings:
            arguments[field.name] = settings[kind.called or field.name]
    return class_(**arguments)


def _settings(alternatives: tuple[type[Choice], ...]) -> Iterator[Parameter]:
    """Yield fields of all alternatives, each name once, with the words of the classes that have it."""
    found: dict[str, list[tuple[type[Choice], Any, _Kind]]] = {}
    for one in alternatives:
        for field, kind in _fields(one):
            if kind.said is not None:
                found.setdefault(kind.called or field.name, []).append((one, field, kind))
    for name, uses in found.items():
        first, field, kind = uses[0]
        words = [one.word() for one in alternatives if name in _names(one)]
        defaults = {other.default for _, other, _ in uses}
        assert kind.said is not None
        text = f"of {', '.join(words)}: {help_of(first)[field.name]}"
        default = field.default if len(defaults) == 1 else None
        yield Parameter(name, kind.said, default, kind.range, text, tuple(words_of(kind.hint)))


def _names(class_: type[Choice]) -> set[str]:
    """Return the names of all settings, nested choices included."""
    inner = [_names(one) for _, kind in _fields(class_) for one in kind.alternatives]
    return {kind.called or field.name for field, kind in _fields(class_) if kind.said}.union(*inner)


def _fields(class_: type[Choice]) -> Iterator[tuple[Any, _Kind]]:
    hints = get_type_hints(class_, include_extras=True)
    for field in dataclasses.fields(class_):  # type: ignore[arg-type]
        yield field, _Kind.from_hint(hints[field.name])


def _arguments(function: Callable[..., Any]) -> Iterator[tuple[str, Any, Any, str]]:
    """Yield name, annotation, default (none: `inspect.Parameter.empty`) and help of keyword arguments."""
    hints, texts = get_type_hints(function, include_extras=True), help_of(function)
    mark = getattr(function, "effect", None)
    for place, (name, parameter) in enumerate(signature(function).parameters.items()):
        by_position = mark is None or place < POSITIONAL[mark.takes] or parameter.kind in _ANY_NUMBER
        if parameter.default is not inspect.Parameter.empty or not by_position:
            yield name, hints.get(name, Any), parameter.default, texts.get(name, "")


@dataclass(frozen=True, slots=True)
class _Kind:
    """The parsed form of an annotation: the first of its alternatives that text can express."""

    hint: Any
    said: ParameterType | None
    range: Range
    called: str | None
    alternatives: tuple[type[Choice], ...] = ()

    @classmethod
    def from_hint(cls, hint: Any) -> _Kind:
        notes: list[Any] = []
        plain = list(_plain(hint, notes))
        limit = next((note for note in notes if isinstance(note, Range)), Range())
        called = next((note.name for note in notes if isinstance(note, Called)), None)
        if str in plain and any(isinstance(note, Text) for note in notes):
            return cls(str, "text", limit, called)
        choices = tuple(one for one in plain if isinstance(one, type) and issubclass(one, Choice))
        for one in plain:
            type_ = None if choices else _type_of(one)
            if choices or type_ is not None:
                return cls(one, type_, limit, called, choices)
        return cls(hint, None, limit, called)


def _plain(hint: Any, notes: list[Any]) -> Iterator[Any]:
    """Yield the alternatives of an annotation, without run values; ``notes`` collects their annotations."""
    origin = get_origin(hint)
    if origin is Annotated:
        notes += hint.__metadata__
        yield from _plain(get_args(hint)[0], notes)
    elif origin in (Union, UnionType):
        for one in get_args(hint):
            yield from _plain(one, notes)
    elif hint not in (NoneType, Value, Derived):
        yield hint


def _type_of(hint: Any) -> ParameterType | None:
    if get_origin(hint) is Literal:
        return "choice"
    if hint == tuple[float, float, float]:
        return "rgb"
    known: dict[Any, ParameterType] = {float: "float", int: "int", bool: "bool", Target: "picture"}
    return known.get(hint)


def help_of(documented: Any) -> dict[str, str]:
    """Return the first sentence for each name in a docstring's Parameters (or Attributes), without markup."""
    heading = re.search(r"^(Parameters|Attributes)\n-+\n", inspect.getdoc(documented) or "", re.MULTILINE)
    texts: dict[str, str] = {}
    names: list[str] = []
    for line in heading.string[heading.end() :].splitlines() if heading else ():
        if not line.strip():
            break
        if entry := ENTRY.match(line):
            names = entry[1].split(", ")
            texts |= dict.fromkeys(names, entry[2])
        else:
            texts |= {name: f"{texts[name]} {line.strip()}" for name in names}
    return {name: _sentence(text) for name, text in texts.items()}


def _sentence(text: str) -> str:
    return re.sub(r"(?<=[^.\d])\.\s.*", "", text.replace("`", "")).strip().rstrip(".")
