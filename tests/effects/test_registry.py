"""The table of effects says what the functions take."""

from __future__ import annotations

import inspect

import pytest

from passgraph.effects.registry import EFFECTS, Effect, effect_named

_POSITIONAL = {"picture": 1, "picture+depth": 2, "scene": 1, "world2d": 2}


@pytest.mark.parametrize("effect", EFFECTS.values(), ids=list(EFFECTS))
def test_parameters_and_defaults_are_those_of_the_function(effect: Effect) -> None:
    signature = inspect.signature(effect.function)
    names = list(signature.parameters)
    for parameter in effect.parameters:
        assert parameter.name in names[_POSITIONAL[effect.takes] :]
        assert signature.parameters[parameter.name].default == parameter.default, parameter.name


@pytest.mark.parametrize("effect", EFFECTS.values(), ids=list(EFFECTS))
def test_defaults_lie_in_their_ranges_and_choices(effect: Effect) -> None:
    for parameter in effect.parameters:
        assert parameter.help
        if parameter.type == "choice":
            assert parameter.default in parameter.choices
        elif parameter.default is not None and parameter.type in ("float", "int", "rgb"):
            for value in parameter.default if isinstance(parameter.default, tuple) else (parameter.default,):
                assert isinstance(value, (int, float))
                assert parameter.low is None or value >= parameter.low
                assert parameter.high is None or value <= parameter.high


def test_an_unknown_name_gets_a_suggestion() -> None:
    with pytest.raises(KeyError, match="did you mean 'tone-map'"):
        effect_named("tone-mapp")
    with pytest.raises(KeyError, match="has no parameter 'sigma'"):
        EFFECTS["gaussian-blur"].parameter("sigma")
