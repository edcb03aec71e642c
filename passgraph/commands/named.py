"""Resolve a command-line name: a built-in effect, or an item of the user's file."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, cast

from passgraph.arguments import near, shown
from passgraph.commands.shader_files import effects_of_shader, read_as_volumes
from passgraph.effects.effect_table import EFFECTS, Effect, summary_of
from passgraph.errors import InputError
from passgraph.graph.calls import PixelKernel
from passgraph.language.types import ImageType, Struct
from passgraph.ranges import Range
from passgraph.shaders import EXPORT_SUFFIX, NOT_READ, SUFFIXES

if TYPE_CHECKING:
    from passgraph.commands.own_file import Graph
    from passgraph.effects.parameters import Parameter
    from passgraph.graph.calls import PixelKernel
    from passgraph.language.ir import Parameter as KernelParameter


@dataclass(frozen=True)
class Reader:
    """Reader of a kind of file.

    Attributes
    ----------
    effects : returns a file's effects by name
    graphs : returns a file's graphs by name, or only the named one
    """

    effects: Callable[[Path], Mapping[str, Effect]]
    graphs: Callable[[Path, str | None], Mapping[str, Graph]]


def named_effect(text: str) -> Effect:
    """Return the effect of ``EFFECT``, ``FILE`` or ``FILE:NAME``.

    Raises
    ------
    InputError
        For an unknown effect, with the most similar name; for a file without effects, or with several and no name.
    KernelError
        For a kernel in the file that is outside the language.
    """
    path, name = file_and_name(text)
    if path is None:
        if text not in EFFECTS:
            raise InputError(
                f"there is no effect {shown(text)}{near(text, list(EFFECTS))}; there are {', '.join(EFFECTS)}, and "
                "files of yours: FILE.py"
            )
        return EFFECTS[text]
    return _chosen(reader_of(path).effects(path), path, name)


def _chosen(effects: Mapping[str, Effect], path: Path, name: str | None) -> Effect:
    """Return the effect of a name; without a name, the only one."""
    if name is not None:
        if name not in effects:
            raise InputError(f"{path}: has no {shown(name)}{near(name, list(effects))}; it has {_list(effects)}")
        return effects[name]
    # Functions marked as effects take precedence over kernels, which are their parts.
    chosen = [effect for effect in effects.values() if not isinstance(effect, KernelEffect)] or list(effects.values())
    if len(chosen) != 1:
        which = f"say which, such as {path}:{chosen[0].name}; it has {_list(effects)}" if chosen else _MEND
        raise InputError(f"{path}: has {'several effects' if chosen else 'no effect and no kernel'}; {which}")
    return chosen[0]


def is_named(text: str) -> bool:
    """Return True if a text names an effect or a file of kernels, not a picture or a scene."""
    path, _ = file_and_name(text)
    return text in EFFECTS if path is None else path.suffix.lower() in READERS and path.suffix.lower() != EXPORT_SUFFIX


def file_and_name(text: str) -> tuple[Path | None, str | None]:
    """Split ``FILE:NAME``; the file is None for an effect's name, which has neither a dot nor a slash.

    >>> file_and_name("mine.py:soft"), file_and_name("mine.py"), file_and_name("bloom")
    ((...Path('mine.py'), 'soft'), (...Path('mine.py'), None), (None, None))
    """
    file, colon, name = text.rpartition(":")
    if colon and Path(file).suffix and re.fullmatch(r"[\w-]+", name):
        return Path(file), name
    is_file = Path(text).suffix or "/" in text or "\\" in text
    return (Path(text), None) if is_file else (None, None)


_MEND = "mark a function from a target to a target with @effect (docs/effects.md), or write a kernel with @pg.kernel"


def _list(items: Mapping[str, object]) -> str:
    return ", ".join(items) or "none"


# Files


def effects_of_module(path: Path) -> dict[str, Effect]:
    """Run a user's Python module; return its effects and its own pixel kernels."""
    from passgraph.commands.own_file import names_of
    from passgraph.effects.checked import Mark

    names = names_of(path)
    effects: dict[str, Effect] = {}
    for function in names.values():
        mark = getattr(function, "effect", None)
        if isinstance(mark, Mark) and function.__module__ == path.stem:
            place = f"{path}:{function.__name__}"
            effects[mark.name] = Effect(mark.name, place, mark.takes, summary_of(function.__doc__), function)
    for name, kernel in names.items():
        if isinstance(kernel, PixelKernel) and name not in effects:
            effects[name] = _of_kernel(kernel, path)
    return effects


def effects_of_text(path: Path) -> dict[str, Effect]:
    """Parse a kernel's text, without running it, and return it as an effect."""
    from passgraph.commands.own_file import kernel_of_text

    kernel = kernel_of_text(path)
    return {kernel.name: _of_kernel(kernel, path)}


def _graphs_of_module_or_text(path: Path, name: str | None) -> Mapping[str, Graph]:
    from passgraph.commands.own_file import graphs_of

    return graphs_of(path, name)


def _graphs_of_shader(path: Path, name: str | None) -> Mapping[str, Graph]:
    from passgraph.commands.own_file import on_inputs

    effect = _chosen(effects_of_shader(path), path, name)
    return {effect.name: on_inputs(effect)}


_TEXT = Reader(effects_of_text, _graphs_of_module_or_text)
#: Readers by suffix; a file with any other suffix is the text of a kernel.
READERS = {
    ".py": Reader(effects_of_module, _graphs_of_module_or_text),
    ".txt": _TEXT,
    **dict.fromkeys((*SUFFIXES, *NOT_READ, EXPORT_SUFFIX), Reader(effects_of_shader, _graphs_of_shader)),
}


def reader_of(path: Path) -> Reader:
    return READERS.get(path.suffix.lower(), _TEXT)


# Kernels


@dataclass(frozen=True)
class KernelEffect(Effect):
    """A kernel as an effect: its first image is the picture, its other parameters are those of the effect.

    Without an image it generates its picture from parameters alone.
    """

    @property
    def kernel(self) -> PixelKernel[Any]:
        return cast("PixelKernel[Any]", self.function)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        from passgraph.effects.parameters import help_of

        texts = help_of(self.kernel)
        self._check_flat()
        plain = (parameter for parameter in self.kernel.parameters if parameter.name not in self._picture)
        return tuple(_said(parameter, texts.get(parameter.name, ""), self) for parameter in plain)

    def _check_flat(self) -> None:
        for volume in read_as_volumes(self.kernel.program):
            raise InputError(
                f"{self.path}: {volume!r} is read as a volume, and the command line has pictures only; write a "
                f"function from a target to a target that says how many slices it has, {volume}.slices(33), and mark "
                "it with @effect (docs/effects.md)"
            )

    @property
    def linear(self) -> bool:
        return False

    def build(self, *pictures: Any, **parameters: Any) -> Any:
        return self.kernel(**dict(zip(self._picture, pictures, strict=True)), **parameters)

    @property
    def _picture(self) -> tuple[str, ...]:
        """Return the name of the image that is the picture, if there is one."""
        return tuple(self.kernel.program.images[:1])


def _of_kernel(kernel: PixelKernel[Any], path: Path) -> KernelEffect:
    takes: Literal["picture", "nothing"] = "picture" if kernel.program.images else "nothing"
    return KernelEffect(kernel.name, f"{path}:{kernel.name}", takes, summary_of(kernel.__doc__), kernel)


def _said(parameter: KernelParameter, text: str, effect: Effect) -> Parameter:
    """Return a kernel's parameter for the command line."""
    from passgraph.effects.parameters import Parameter, ParameterType

    if isinstance(parameter.type, Struct):
        raise InputError(
            f"{effect.path}: parameter {parameter.name!r} is a {parameter.type}, which cannot be written on a command "
            "line; write a function from a target to a target that makes it, and mark it with @effect (docs/effects.md)"
        )
    if isinstance(parameter.type, ImageType):
        return Parameter(parameter.name, "picture", None, Range(), text, required=True)
    known: dict[str, ParameterType] = {"float": "float", "int": "int", "bool": "bool"}
    kind = known.get(str(parameter.type), "value")
    if kind == "bool" and not parameter.has_default:
        kind = "value"  # as a flag, leaving it out would mean False
    return Parameter(
        parameter.name, kind, parameter.default, parameter.range or Range(), text,
        value_type=parameter.type if kind == "value" else None, required=not parameter.has_default,
    )  # fmt: skip


# Graphs


def named_graphs(text: str) -> Mapping[str, Graph]:
    """Return graphs by name: an effect on inputs named after its parameters, or those of a file (see `own_file`)."""
    from passgraph.commands.own_file import on_inputs

    path, name = file_and_name(text)
    if path is None and text not in EFFECTS and Path(text).exists():
        path = Path(text)
    if path is not None:
        return reader_of(path).graphs(path, name)
    return {(effect := named_effect(text)).name: on_inputs(effect)}
