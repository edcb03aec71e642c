"""Effects are found by their decorator, and their signatures and docstrings say all of their parameters."""

from __future__ import annotations

import inspect
import subprocess
import sys
import typing
from pathlib import Path
from typing import Any

import pytest

import passgraph as pg
from passgraph.effects import Pcss, gaussian_blur
from passgraph.effects.checked import Takes, effect
from passgraph.effects.effect_table import EFFECTS, Effect, by_family
from passgraph.effects.light2d import World2D

OUTSIDE = Path(__file__).parents[1] / "outside_effect"
#: What a function of each kind begins with.
TAKEN: dict[Takes, list[object]] = {
    "nothing": [],
    "picture": [pg.Target],
    "picture+depth": [pg.Target, pg.Target],
    "scene": [pg.Scene],
    "world2d": [World2D, tuple[int, int]],
}


def installed(folder: Path, name: str, module: str) -> None:
    """A package with one entry point, as an installer leaves it."""
    info = folder / f"{name.replace('-', '_')}-0.1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 0.1.0\n")
    (info / "entry_points.txt").write_text(f"[passgraph.effects]\n{module}\n")


def told(code: str, *paths: Path) -> str:
    """What a new interpreter prints; the checkout and these folders come first."""
    root = Path(__file__).parents[2]
    start = f"import sys; sys.path[:0] = {[*map(str, paths), str(root)]!r}\n"
    done = subprocess.run([sys.executable, "-c", start + code], capture_output=True, text=True, check=False)
    return done.stdout + done.stderr


@pytest.mark.parametrize("effect", EFFECTS.values(), ids=list(EFFECTS))
def test_what_an_effect_takes_is_what_its_signature_begins_with(effect: Effect) -> None:
    hints = typing.get_type_hints(effect.function)
    names = list(inspect.signature(effect.function).parameters)
    kinds = TAKEN[effect.takes]
    # An effect may also do without the depth that it takes.
    found = [typing.get_args(hint)[0] if type(None) in typing.get_args(hint) else hint
             for hint in (hints[name] for name in names[: len(kinds)])]  # fmt: skip
    assert found == kinds
    assert effect.function.effect.takes == effect.takes  # type: ignore[attr-defined]
    assert effect.function.effect.name == effect.name  # type: ignore[attr-defined]


@pytest.mark.parametrize("effect", EFFECTS.values(), ids=list(EFFECTS))
def test_defaults_lie_in_their_ranges_and_choices(effect: Effect) -> None:
    assert effect.summary
    assert effect.parameters
    for parameter in effect.parameters:
        assert parameter.help, parameter.name
        assert not parameter.help.startswith(("see ", "as in ")), parameter.name
        if parameter.type == "choice":
            assert parameter.default in parameter.choices
        elif parameter.default is not None and parameter.type in ("float", "int", "rgb"):
            for value in parameter.default if isinstance(parameter.default, tuple) else (parameter.default,):
                assert value in parameter.range


@pytest.mark.parametrize("effect", EFFECTS.values(), ids=list(EFFECTS))
def test_what_is_out_of_range_is_refused_by_the_function_too(effect: Effect) -> None:
    taken = {"scene": [pg.Scene.shipped()], "world2d": [World2D.shipped(), (8, 8)]}.get(
        effect.takes, [pg.Input("frame"), pg.Input("depth")][: 1 + (effect.takes == "picture+depth")]
    )
    choices = {"taps": "pcss", "bleed": "vsm", "exponent": "evsm4", "pcf_size": "pcf", "radius_px": "blur"}
    for parameter in effect.parameters:
        for wrong in _beyond(parameter.range):
            value = (wrong,) * 3 if parameter.type == "rgb" else int(wrong) if parameter.type == "int" else wrong
            given = {parameter.name: value}
            if effect.name == "soft-shadow" and parameter.name in choices:
                given["shadow_filter"] = choices[parameter.name]
            with pytest.raises(pg.GraphError, match=r" must be (odd, )?(above )?-?\d"):
                effect.build(*taken, **given)


def _beyond(limits: pg.Range) -> list[float]:
    below = [] if limits.low is None else [limits.low if limits.above else limits.low - 1]
    return below + ([] if limits.high is None else [limits.high + 1])


def test_a_filter_is_the_same_by_name_and_as_data() -> None:
    scene = pg.Scene.shipped()
    by_name = EFFECTS["soft-shadow"].build(scene, shadow_filter="pcss", taps=7, bleed=0.3)
    as_data = EFFECTS["soft-shadow"].function(scene, filter=Pcss(taps=7))
    assert _steps(by_name) == _steps(as_data)
    with pytest.raises(pg.GraphError, match="shadow_filter cannot be 'pcs'; it is one of auto, blur"):
        EFFECTS["soft-shadow"].build(scene, shadow_filter="pcs")


def _steps(picture: pg.Target) -> str:
    with pg.compile(picture, "null", (32, 18)) as program:
        return program.explain()


def test_listing_imports_no_effect() -> None:
    code = "from passgraph.effects.effect_table import EFFECTS, by_family; print(len(EFFECTS), BLOOM in sys.modules)"
    code = code.replace("BLOOM", "'passgraph.effects.lens.bloom'")
    assert told(code) == f"{len(EFFECTS)} False\n"


def test_an_unknown_parameter_is_named() -> None:
    with pytest.raises(KeyError, match="has no parameter 'sigma'"):
        EFFECTS["gaussian-blur"].parameter("sigma")


def test_a_wrong_mark_is_refused() -> None:
    with pytest.raises(pg.GraphError, match="effect: takes cannot be 'mesh'; it is one of nothing, picture, picture"):
        effect("x", "mesh")  # type: ignore[arg-type]


# Other packages'


def test_a_parameter_without_a_type_is_named() -> None:
    with pytest.raises(pg.GraphError, match=r"effect 'dimmed': parameter 'share' needs a type, such as share: float"):

        @effect("dimmed")
        def dimmed(photo: pg.Target, share=0.5):  # type: ignore[no-untyped-def]
            return photo


def test_an_effect_of_another_package_is_one_of_all(tmp_path: Path) -> None:
    installed(tmp_path, "passgraph-halved", "halved = passgraph_halved:halved")
    code = """
import passgraph as pg
from passgraph.commands.entry import run
from passgraph.verify.conformance.effect_cases import cases
from passgraph.effects.effect_table import EFFECTS, by_family
found = EFFECTS["halved"]
print(found.takes, found.summary, [(p.name, str(p.range), p.help) for p in found.parameters])
print([case.name for case in cases() if "halved" in case.name])
wrong = ["apply", "halved", "x.png", "-o", "y.png", "--share", "0"]
print(run(["apply", "--help"]), run(["apply", "halved", "--help"]), run(wrong))
"""
    out = " ".join(told(code, OUTSIDE, tmp_path).split())
    assert "picture A picture with less light. [('share', 'above 0 and at most 1', 'of the light that is left')]" in out
    assert "['halved']" in out
    assert " halved A picture with less light." in out
    assert "Of the light that is left [default: 0.5; 0.0<x<=1.0]" in out
    assert "0.0 is not in the range 0.0<x<=1.0" in out
    assert " 0 0 2 " in out


@pytest.mark.parametrize(
    ("module", "message"),
    [
        ("halved = passgraph_gone:halved", "effect 'halved' (passgraph_gone:halved) cannot be loaded: No module named"),
        ("halved = passgraph_halved:scale", "(passgraph_halved:scale) is not marked with @effect(\"halved\")"),
        ("dimmed = passgraph_halved:halved", "(passgraph_halved:halved) calls itself 'halved'; use one name"),
    ],
)  # fmt: skip
def test_a_package_that_is_wrong_is_named(tmp_path: Path, module: str, message: str) -> None:
    installed(tmp_path, "passgraph-wrong", module)
    code = (
        "from passgraph.commands.entry import run; print(run(['apply', '--help']), run(['apply', 'bloom', '--help']))"
    )
    out = told(code, OUTSIDE, tmp_path)
    assert message in out
    assert "\n2 0\n" in out


def test_every_built_in_effect_has_a_family() -> None:
    families = by_family(EFFECTS.values())
    built_in = {name for name, effect in EFFECTS.items() if effect.path.startswith("passgraph.effects.")}
    assert built_in.isdisjoint(effect.name for effect in families.get("Others", ()))
    assert [effect.name for effect in families["Flat worlds"]] == ["light2d"]
    assert "fog" in {effect.name for effect in families["Pictures with depth"]}


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (
            {"sigma": 2.0},
            r"^gaussian_blur has no parameter 'sigma' \(did you mean 'sigma_px'\?\); it has color, sigma_px, ",
        ),
        ({"zzz": 2.0}, r"^gaussian_blur has no parameter 'zzz'; it has color, "),
        ({"color": None}, r"^gaussian_blur: multiple values for argument 'color'$"),
    ],
)
def test_a_wrong_parameter_is_told_with_the_effect_and_what_it_has(options: dict[str, Any], words: str) -> None:
    with pytest.raises(TypeError, match=words):
        gaussian_blur(pg.Input("frame"), **options)
