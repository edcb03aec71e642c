"""Find effects by command-line name: those of this package, by their decorator, and those of other packages.

Importing it, and listing, load no effect: built-in ones are parsed as text, see `_marked`.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from passgraph.arguments import among, shown
from passgraph.cached import cached_property
from passgraph.errors import GraphError, InputError, UnknownNameError
from passgraph.records import dataclass

if TYPE_CHECKING:
    from passgraph.color_tags import ColorSpace
    from passgraph.effects.checked import Alpha, Takes
    from passgraph.effects.parameters import Parameter
    from passgraph.graph.targets import Target


#: Entry points of other packages: ``name = "module:function"``, the function made with `passgraph.effects.effect`.
GROUP = "passgraph.effects"
#: Folder of a built-in effect → its family, in the order in which help and documentation list them.
FAMILIES = {
    "color": "Color",
    "filters": "Filters",
    "antialias": "Antialiasing and scaling",
    "lens": "Camera and light",
    "style": "Style",
    "screen": "Pictures with depth",
    "temporal": "Motion",
    "shadows": "Scenes",
    "ambient": "Scenes",
    "planar_shadows": "Scenes",
    "light2d": "Flat worlds",
}


@dataclass(frozen=True)
class Effect:
    """One effect and its command-line name.

    Attributes
    ----------
    name : such as "tone-map"
    path : module and function, ``"passgraph.effects.color.tone_map:tone_map"``
    takes : its positional arguments, see `passgraph.effects.checked.effect`
    summary : the first line of its docstring
    loaded : the function if already loaded, e.g. from a user's file; else it is imported
    """

    name: str
    path: str
    takes: Takes
    summary: str
    loaded: Callable[..., Any] | None = None

    @property
    def family(self) -> str:
        """Return one of :data:`FAMILIES`, or "Others" for an effect of another package or a user's file."""
        folders = self.path.removeprefix("passgraph.effects.").split(".")
        return FAMILIES.get(folders[0], "Others")

    @cached_property
    def function(self) -> Callable[..., Any]:
        """Return the function from targets (or a scene) to a target."""
        return self.loaded or _loaded(self.path)

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Return the other parameters of the function, from its signature."""
        from passgraph.effects.parameters import parameters_of

        return parameters_of(self.function)

    @property
    def needs_depth(self) -> bool:
        """Return True if it takes a depth and has no default for it."""
        from passgraph.signatures import signature

        if self.takes != "picture+depth":
            return False
        depth = list(signature(self.function).parameters.values())[1]
        return depth.default is depth.empty

    @property
    def linear(self) -> bool:
        """Return True if pictures of 8 and 16 bits are decoded to linear light by default."""
        return bool(self.function.effect.linear)  # type: ignore[attr-defined]

    @property
    def encodes(self) -> bool:
        """Return True if its results are colors for a display although it takes linear light."""
        mark = getattr(self.function, "effect", None)
        return mark is not None and mark.encodes

    @property
    def alpha(self) -> Alpha:
        """Return the alpha mode of the effect, see `passgraph.effects.checked.effect`."""
        mark = getattr(self.function, "effect", None)
        return "straight" if mark is None else mark.alpha

    @property
    def alike(self) -> bool:
        """Return True if it takes and gives pictures of one and two channels too."""
        mark = getattr(self.function, "effect", None)
        return mark is not None and mark.alike

    def result_space(self, parameters: Mapping[str, Any]) -> ColorSpace | None:
        """Return the color space of its results with these parameters; None if colors stay in their space."""
        mark = getattr(self.function, "effect", None)
        found = None if mark is None else mark.result_space
        return None if found is None else found(**parameters)

    def for_opaque(self) -> Effect:
        """Return the effect for pictures without transparency: without conversions that change none of these."""
        return self

    @property
    def frame_time(self) -> str | None:
        """Return the parameter with the seconds of a frame, if there is one."""
        return None

    @property
    def signals(self) -> tuple[str, ...]:
        """Return "keyboard" and "audio" if the effect reads them."""
        return ()

    def parameter(self, name: str) -> Parameter:
        """Return one parameter by name; KeyError lists the known ones."""
        for parameter in self.parameters:
            if among(name, (parameter.name,)):
                return parameter
        known = ", ".join(p.name for p in self.parameters) or "none"
        raise UnknownNameError(f"effect {self.name!r} has no parameter {shown(name)}; it has {known}")

    def build(self, *taken: Any, **given: Any) -> Any:
        """Call the function with arguments by the names of `parameters`.

        >>> import passgraph as pg
        >>> EFFECTS["soft-shadow"].build(pg.Scene.shipped(), shadow_filter="pcss", taps=8).name
        'picture'
        """
        from passgraph.effects.parameters import arguments_from

        return self.function(*taken, **arguments_from(self.function, given))


def making_one(effect: Effect, mend: str) -> Callable[..., Target]:
    """Return the function that builds an effect; InputError, with ``mend``, if it makes several pictures."""
    from passgraph.graph.targets import Target
    from passgraph.signatures import wraps

    @wraps(effect.function)
    def one_target(*pictures: Any, **parameters: Any) -> Target:
        result = effect.build(*pictures, **parameters)
        if not isinstance(result, Target):
            raise InputError(f"{effect.name}: makes several pictures; {mend}")
        return result

    return one_target


class _Effects(Mapping[str, Effect]):
    """Built-in effects first, then those of other packages, which are searched only for other names."""

    def __getitem__(self, name: str) -> Effect:
        return _one_built_in(name) or _entry_points()[name]

    def __iter__(self) -> Iterator[str]:
        return iter({**_built_in(), **_entry_points()})

    def __len__(self) -> int:
        return len(list(iter(self)))


EFFECTS: Mapping[str, Effect] = _Effects()


def by_family(effects: Iterable[Effect]) -> dict[str, list[Effect]]:
    """Sort effects into their families, in the order of :data:`FAMILIES`; families without effects are left out."""
    families: dict[str, list[Effect]] = {title: [] for title in (*FAMILIES.values(), "Others")}
    for effect in effects:
        families[effect.family].append(effect)
    return {title: found for title, found in families.items() if found}


@cache
def _built_in() -> dict[str, Effect]:
    """Return effects of this package, by kind, then by name: functions under ``@effect("name")`` in any of its
    files."""
    found = [effect for module, text in _texts() for effect in _marked(module, text)]
    order = ("nothing", "picture", "picture+depth", "scene", "world2d")
    return {effect.name: effect for effect in sorted(found, key=lambda one: (order.index(one.takes), one.name))}


@cache
def _one_built_in(name: str) -> Effect | None:
    """Return one built-in effect, without parsing the files of the others."""
    mark = f'@effect("{name}"'
    found = (effect for module, text in _texts() if mark in text for effect in _marked(module, text))
    return next((effect for effect in found if effect.name == name), None)


@cache
def _texts() -> list[tuple[str, str]]:
    """Return modules with effects and their texts, which always exist: kernels are parsed from their source too."""
    root, found = Path(__file__).parent, list[tuple[str, str]]()
    for file in sorted(root.rglob("*.py")):
        text = file.read_text(encoding="utf-8")
        if "\n@effect(" in text:
            found.append((".".join(("passgraph.effects", *file.relative_to(root).with_suffix("").parts)), text))
    return found


def _marked(module: str, text: str) -> Iterator[Effect]:
    """Yield effects of one module, which is parsed and not imported: importing all takes a quarter of a second."""
    for function in (node for node in ast.parse(text).body if isinstance(node, ast.FunctionDef)):
        for mark in function.decorator_list:
            if isinstance(mark, ast.Call) and isinstance(mark.func, ast.Name) and mark.func.id == "effect":
                name, takes, *_ = (*map(ast.literal_eval, mark.args), "picture")
                yield Effect(name, f"{module}:{function.name}", takes, summary_of(ast.get_docstring(function)))


def function_named(name: str) -> Callable[..., Any] | None:
    """Return the function of a built-in effect by its own name, such as ``tone_map``; None if there is none."""
    found = (effect for effect in _built_in().values() if effect.path.endswith(f":{name}"))
    return next((effect.function for effect in found), None)


@cache
def _entry_points() -> dict[str, Effect]:
    """Return the effects of other packages, by name; their packages are imported."""
    from importlib.metadata import entry_points

    found = {}
    for entry in sorted(entry_points(group=GROUP), key=lambda entry: entry.name):
        mark = getattr(_loaded(entry.value, entry.name), "effect", None)
        if mark is None:
            raise GraphError(f'effect {entry.name!r} ({entry.value}) is not marked with @effect("{entry.name}")')
        if mark.name != entry.name:
            raise GraphError(f"effect {entry.name!r} ({entry.value}) calls itself {mark.name!r}; use one name")
        found[mark.name] = Effect(mark.name, entry.value, mark.takes, summary_of(_loaded(entry.value).__doc__))
    return found


def _loaded(path: str, name: str | None = None) -> Callable[..., Any]:
    module, _, function = path.partition(":")
    try:
        found: Callable[..., Any] = getattr(import_module(module), function)
    except (ImportError, AttributeError) as error:
        raise GraphError(f"effect {name or function!r} ({path}) cannot be loaded: {error}") from error
    return found


def summary_of(docstring: str | None) -> str:
    """Return the first line of a docstring."""
    text = docstring or ""
    return text.strip().partition("\n")[0]
