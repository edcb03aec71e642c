"""Several effects as one, ``"tone-map, bloom, vignette"``: each reads the result of the one before, in one plan."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from passgraph.effects.effect_table import Effect, making_one
from passgraph.errors import InputError
from passgraph.graph.targets import Target
from passgraph.records import dataclass
from passgraph.signatures import signature

if TYPE_CHECKING:
    from passgraph.color_tags import ColorSpace
    from passgraph.effects.checked import Alpha, Takes
    from passgraph.effects.parameters import Parameter

#: Between the effects of a chain.
SEPARATOR = ","


@dataclass(frozen=True, kw_only=True)
class EffectChain(Effect):
    """Effects one after another; a parameter is named ``effect_parameter``, such as ``bloom_intensity``.

    Attributes
    ----------
    parts : name in the chain → effect; a second bloom is "bloom-2"
    converts_alpha : each effect gets alpha as it wants it; False for opaque pictures
    order : the names of the parts that run, in order; by default all of them

    An effect that wants linear light gets it, also behind one whose results are colors for a display. If there is one
    of those, the result is encoded for a display.
    """

    parts: Mapping[str, Effect]
    converts_alpha: bool = True
    order: tuple[str, ...] | None = None

    @classmethod
    def of(cls, effects: list[Effect]) -> EffectChain:
        """Return the chain of some effects, at least two.

        Raises
        ------
        InputError
            For an effect that reads no picture, or a keyboard or sound.
        """
        for effect in effects:
            if not effect.takes.startswith("picture"):
                raise InputError(f"effect {effect.name} takes a {effect.takes}; in a chain each takes a picture")
            if effect.signals:
                raise InputError(f"effect {effect.name} reads {effect.signals[0]}; in a chain none does: run it alone")
        takes: Takes = "picture+depth" if any(effect.takes == "picture+depth" for effect in effects) else "picture"
        name = f"{SEPARATOR} ".join(effect.name for effect in effects)
        summary = " Then: ".join(effect.summary for effect in effects)
        chain = cls(name, name, takes, summary, parts=_named_apart(effects))
        return replace(chain, loaded=chain.build)

    def arranged(self, order: Iterable[str]) -> EffectChain:
        """Return the chain with these parts in this order; it takes the same pictures and parameters.

        Raises
        ------
        InputError
            For a name that no part has, or one given twice.
        """
        names = tuple(order)
        if not set(names) <= set(self.parts) or len(set(names)) < len(names):
            raise InputError(f"the parts of this chain are {', '.join(self.parts)}, each once; got {', '.join(names)}")
        chain = replace(self, order=names)
        return replace(chain, loaded=chain.build)

    def alone(self, parameters: Mapping[str, Any]) -> tuple[str, dict[str, Any]]:
        """Return the text that names the parts that run, and their parameters by the names that they have there."""
        running = {name: self.parts[name] for name in (self.parts if self.order is None else self.order)}
        renamed = [""] if len(running) == 1 else [prefix for _, prefix, _ in _prefixed(_named_apart(running.values()))]
        given: dict[str, Any] = {}
        for (_, before, effect), prefix in zip(_prefixed(running), renamed, strict=True):
            given |= {prefix + name: value for name, value in _of_part(effect, before, parameters).items()}
        return f"{SEPARATOR} ".join(effect.name for effect in running.values()), given

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return tuple(
            replace(parameter, name=prefix + parameter.name)
            for _, prefix, effect in _prefixed(self.parts)
            for parameter in effect.parameters
        )

    @property
    def needs_depth(self) -> bool:
        return any(effect.needs_depth for effect in self.parts.values())

    @property
    def linear(self) -> bool:
        return any(effect.linear for effect in self.parts.values())

    @property
    def encodes(self) -> bool:
        return any(effect.encodes for effect in self.parts.values())

    @property
    def alpha(self) -> Alpha:
        return "straight"

    @property
    def frame_time(self) -> str | None:
        return next((prefix + e.frame_time for _, prefix, e in _prefixed(self.parts) if e.frame_time is not None), None)

    def result_space(self, parameters: Mapping[str, Any]) -> ColorSpace | None:
        found = None
        for _, prefix, effect in _prefixed(self.parts):
            found = effect.result_space(_of_part(effect, prefix, parameters)) or found
        return found

    def for_opaque(self) -> Effect:
        return replace(self, converts_alpha=False)

    def build(self, *pictures: Any, **parameters: Any) -> Target:
        from passgraph.effects.pictures.decoded import as_light, encoded

        picture, *depth = pictures
        is_light = self.linear
        prefixed = {name: (prefix, effect) for name, prefix, effect in _prefixed(self.parts)}
        for name in self.parts if self.order is None else self.order:
            prefix, effect = prefixed[name]
            if effect.linear and not is_light:
                picture, is_light = as_light(picture), True
            given = _of_part(effect, prefix, parameters)
            if name != effect.name and "name" in signature(effect.function).parameters:
                given["name"] = name.replace("-", "_")
            picture = self._applied(effect, [picture, *depth] if effect.takes == "picture+depth" else [picture], given)
            is_light = is_light and not effect.encodes
        return encoded(picture) if self.encodes and is_light else picture

    def _applied(self, effect: Effect, pictures: list[Any], given: dict[str, Any]) -> Target:
        from passgraph.effects.pictures.alpha import on_straight_alpha

        one_target = making_one(effect, "in a chain each makes one")
        if not self.converts_alpha or effect.alpha == "straight":
            return one_target(*pictures, **given)
        return on_straight_alpha(one_target, effect.alpha)(*pictures, **given)


def _named_apart(effects: Iterable[Effect]) -> dict[str, Effect]:
    """Return effects by name; a second bloom is "bloom-2"."""
    seen: Counter[str] = Counter()
    parts: dict[str, Effect] = {}
    for effect in effects:
        seen[effect.name] += 1
        parts[effect.name if seen[effect.name] == 1 else f"{effect.name}-{seen[effect.name]}"] = effect
    return parts


def _prefixed(parts: Mapping[str, Effect]) -> Iterator[tuple[str, str, Effect]]:
    """Yield the name, the prefix of parameters, and the effect of each part."""
    for name, effect in parts.items():
        yield name, f"{name.replace('-', '_')}_", effect


def _of_part(effect: Effect, prefix: str, parameters: Mapping[str, Any]) -> dict[str, Any]:
    """Return the parameters of one part, by their own names."""
    names = [parameter.name for parameter in effect.parameters]
    return {name: parameters[prefix + name] for name in names if prefix + name in parameters}
