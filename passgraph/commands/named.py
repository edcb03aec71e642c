"""Resolve a command-line name: a built-in effect, or an item of the user's file."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, cast

from passgraph.arguments import near, shown
from passgraph.commands.effect_chain import SEPARATOR, EffectChain
from passgraph.commands.shader_files import effects_of_shader, read_as_volumes
from passgraph.effects.effect_table import EFFECTS, Effect, summary_of
from passgraph.errors import InputError
from passgraph.graph.calls import PixelKernel
from passgraph.language.types import ImageType, Struct
from passgraph.ranges import Range
from passgraph.records import dataclass
from passgraph.shaders import EXPORT_SUFFIX, NOT_READ, SUFFIXES

if TYPE_CHECKING:
    from passgraph.commands.own_file import Graph
    from passgraph.effects.parameters import Parameter
    from passgraph.graph.calls import PixelKernel
    from passgraph.language.ir import Parameter as KernelParameter


def named_effect(text: str) -> Effect:
    """Return the effect of ``EFFECT``, ``FILE`` or ``FILE:NAME``, or the chain of several with commas between them.

    Raises
    ------
    InputError
        For an unknown effect, with the most similar name; for a file without effects, or with several and no name.
    KernelError
        For a kernel in the file that is outside the language.
    """
    if parts := _parts(text):
        return EffectChain.of([named_effect(part) for part in parts])
    path, name = file_and_name(text)
    if path is None:
        if text not in EFFECTS:
            raise InputError(
                f"there is no effect {shown(text)}{near(text, list(EFFECTS))}; there are {', '.join(EFFECTS)}, and "
                "files of yours: FILE.py"
            )
        return EFFECTS[text]
    return _chosen(effects_of_file(path), path, name)


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


def _parts(text: str) -> list[str]:
    """Return the names in a chain of effects; of one effect, or of a file with a comma in its name, none."""
    return [] if SEPARATOR not in text or Path(text).exists() else [part.strip() for part in text.split(SEPARATOR)]


def is_named(text: str) -> bool:
    """Return True if a text names effects or a file of kernels, not a picture or a scene."""
    if parts := _parts(text):
        return all(map(is_named, parts))
    path, _ = file_and_name(text)
    return text in EFFECTS if path is None else path.suffix.lower() in (".py", ".txt", *SUFFIXES, *NOT_READ)


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


#: Suffixes of shader files; a file with any other suffix but .py is the text of a kernel.
SHADERS = frozenset((*SUFFIXES, *NOT_READ, EXPORT_SUFFIX))


def effects_of_file(path: Path) -> Mapping[str, Effect]:
    """Return the effects and kernels of a user's file: a Python module is run, other files are parsed."""
    if path.suffix.lower() in SHADERS:
        return effects_of_shader(path)
    from passgraph.commands.own_file import kernel_of_text, names_of, own_effects

    if path.suffix.lower() != ".py":
        kernel = kernel_of_text(path)
        return {kernel.name: _of_kernel(kernel, path)}
    names = names_of(path)
    effects = own_effects(names, path)
    kernels = {name: one for name, one in names.items() if isinstance(one, PixelKernel) and name not in effects}
    return effects | {name: _of_kernel(kernel, path) for name, kernel in kernels.items()}


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
    from passgraph.commands.own_file import graphs_of, on_inputs

    path, name = file_and_name(text)
    if path is None and text not in EFFECTS and Path(text).exists():
        path = Path(text)
    if path is not None and path.suffix.lower() not in SHADERS:
        return graphs_of(path, name)
    effect = named_effect(text)
    return {effect.name: on_inputs(effect)}
