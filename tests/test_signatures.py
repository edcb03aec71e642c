"""Signatures and annotations of effects, on Python versions that evaluate annotations early or late."""

from __future__ import annotations

import functools
import inspect
import sys
import typing
from types import ModuleType
from typing import Any

import pytest

import passgraph as pg
from passgraph import signatures
from passgraph.effects.checked import checked, effect, with_surface_depth
from passgraph.effects.effect_options import picture_of
from passgraph.effects.effect_table import EFFECTS, Effect
from passgraph.effects.parameters import parameters_of

#: What `functools.wraps` copies from Python 3.14 on.
ASSIGNED_314 = ("__module__", "__name__", "__qualname__", "__doc__", "__annotate__", "__type_params__")
#: A function of a module whose types the importing module does not know.
ELSEWHERE = """
from __future__ import annotations
from passgraph import Scene as World, Target as Picture
class Two:
    def __init__(self, picture: Picture) -> None:
        self.picture = picture
def two_passes(scene: World, *, height: Number = 0.5, mask: Picture | None = None) -> Two:
    return Two(mask)
Number = float
"""


@pytest.mark.parametrize("name", list(EFFECTS))
def test_every_parameter_of_an_effect_has_a_type(name: str) -> None:
    function = EFFECTS[name].function
    assert set(inspect.signature(function).parameters) <= set(typing.get_type_hints(function))


@pytest.mark.parametrize("name", list(EFFECTS))
def test_wrappers_of_other_packages_keep_the_types(name: str) -> None:
    function = EFFECTS[name].function

    @functools.wraps(function)
    def wrapper(*values: Any, **options: Any) -> Any:
        return function(*values, **options)

    assert typing.get_type_hints(wrapper) == typing.get_type_hints(function)


def test_types_are_looked_up_where_they_were_written() -> None:
    module = ModuleType("elsewhere")
    exec(ELSEWHERE, module.__dict__)

    @effect("two", "scene")
    @picture_of(module.two_passes)
    def two() -> None:
        """Render two.

        Parameters
        ----------
        height : of both
        """

    expected = {"scene": pg.Scene, "height": float, "mask": pg.Target | None, "return": pg.Target}
    assert typing.get_type_hints(two) == expected
    assert [option.name for option in parameters_of(two)] == ["height", "mask"]
    with pytest.raises(pg.GraphError, match="two: height must be a finite number, got 'low'"):
        two(pg.Scene.shipped(), height="low")


@pytest.mark.parametrize("decorate", [checked, with_surface_depth, signatures.wraps], ids=lambda one: one.__name__)
@pytest.mark.parametrize("assigned", [functools.WRAPPER_ASSIGNMENTS, ASSIGNED_314], ids=["here", "3.14"])
def test_assigned_annotations_are_kept(monkeypatch: pytest.MonkeyPatch, decorate: Any, assigned: tuple[str]) -> None:
    def faded(color, depth=None, share=1.0):  # type: ignore[no-untyped-def]
        return color

    faded.__annotations__ = types = {"color": pg.Target, "depth": pg.Target | None, "share": float, "return": pg.Target}
    monkeypatch.setattr(functools, "WRAPPER_ASSIGNMENTS", assigned)
    made = decorate(faded)
    made = made(lambda *values, **options: faded(*values, **options)) if decorate is signatures.wraps else made
    assert typing.get_type_hints(made) == types


@pytest.mark.skipif(sys.version_info < (3, 14), reason="earlier versions evaluate annotations at the definition")
def test_annotations_that_cannot_be_evaluated_yet() -> None:
    """As with imports under ``if TYPE_CHECKING``."""
    names: dict[str, Any] = {}
    exec("def faded(color: Target, share: Missing = 1.0) -> Target: ...", names)
    faded = names["faded"]
    assert list(signatures.signature(faded).parameters) == ["color", "share"]
    wrapped = effect("faded", "picture")(faded)
    assert list(signatures.signature(wrapped).parameters) == ["color", "share"]
    names |= {"Target": pg.Target, "Missing": float}
    assert [option.type for option in Effect("faded", "x:y", "picture", "", wrapped).parameters] == ["float"]
