"""Pixel passes on every backend against the reference: each format, border and size, each effect on pictures."""

from __future__ import annotations

from importlib import import_module

import numpy as np
import pytest
from numpy.typing import NDArray

import passgraph as pg
from passgraph.compare import compare
from passgraph.effects.registry import EFFECTS
from passgraph.formats import FORMATS, Format

COLOUR_FORMATS = [f for f in FORMATS.values() if not f.is_depth]


def picture(size: tuple[int, int], channels: int, seed: int = 0) -> NDArray[np.float32]:
    """Values below, in and above [0, 1], with exact halves of 8-bit steps among them."""
    random = np.random.default_rng(seed)
    made = random.uniform(-0.2, 1.2, (size[1], size[0], channels)).astype(np.float32)
    made.reshape(-1)[::7] = (random.integers(0, 255, made.size)[::7] + 0.5) / 255
    return made


def through(format_: Format) -> pg.Target:
    """A picture stored in a format and read back by a second pass."""
    letters = "rgba"[: format_.channels]
    result = "float" if format_.channels == 1 else f"vec{format_.channels}"
    store = pg.kernel(source=f"def store(color: Image) -> {result}: return color[0, 0].{letters}")
    read = pg.kernel(source="def read(color: Image) -> vec4: return color[0, 0]")
    stored = store(pg.Input("frame"), into=pg.target("stored", format_))
    return read(stored, into=pg.target("out", "rgba32f"))


def run(target: pg.Target, backend: str, frame: NDArray[np.float32], **options: bool) -> NDArray[np.float32]:
    with pg.compile({"out": target}, backend=backend, options=pg.Options(**options)) as program:
        return program(frame=frame)["out"]


@pytest.mark.parametrize("format_", COLOUR_FORMATS, ids=lambda f: f.name)
def test_format_stores_what_the_reference_stores(format_: Format, backend_name: str) -> None:
    frame = picture((37, 23), format_.channels)
    expected, got = run(through(format_), "reference", frame), run(through(format_), backend_name, frame)
    # Reading an integer format back is a division by 255 or 65535: one unit in the last place (GL rounds as it likes).
    # sRGB passes through pow twice, whose bound is 16 ulp.
    ulp = 2.0**-23 if format_.kind.startswith("unorm") else 0.0
    if format_.srgb:
        ulp = 32 * 2.0**-23
    step = {"unorm8": 1 / 255, "unorm16": 1 / 65535}.get(format_.kind, 0.0) * (3.0 if format_.srgb else 1.0)
    allowed = np.where(near_a_boundary(frame, format_), step, 0.0) + ulp
    assert (np.abs(got - expected)[..., : format_.channels] <= allowed * 1.01).all()


def near_a_boundary(frame: NDArray[np.float32], format_: Format) -> NDArray[np.bool_]:
    """Where rounding in float32 decides between two stored values: either is right."""
    if not format_.kind.startswith("unorm"):
        return np.zeros(frame.shape, bool)
    x = np.clip(frame.astype(np.float64), 0, 1)
    if format_.srgb:
        encoded = np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)
        encoded[..., 3:] = x[..., 3:]
        x = encoded
    steps = 255 if format_.kind == "unorm8" else 65535
    scaled = x * steps
    near: NDArray[np.bool_] = np.abs(scaled - np.floor(scaled) - 0.5) < steps * 2.0**-20
    assert near.mean() < 0.5
    return near


@pytest.mark.parametrize("format_", COLOUR_FORMATS, ids=lambda f: f.name)
def test_fused_passes_give_the_same_bits(format_: Format, backend_name: str) -> None:
    """A fused producer still passes through its target's format."""
    frame = picture((37, 23), format_.channels)
    fused, apart = (run(through(format_), backend_name, frame, fuse=fuse) for fuse in (True, False))
    # GL reads integer formats within one ulp, which decoding sRGB makes a few.
    ulp = (16 if format_.srgb else 1) * 2.0**-23 if format_.kind.startswith("unorm") and backend_name == "gl" else 0.0
    np.testing.assert_allclose(fused, apart, rtol=0, atol=ulp)


@pytest.mark.parametrize("size", [(1, 1), (2, 5), (64, 64), (67, 33)])
@pytest.mark.parametrize("border", ["clamp", "zero", "repeat", "mirror"])
def test_reads_outside_follow_the_border_rule(border: str, size: tuple[int, int], backend_name: str) -> None:
    """Relative reads, absolute reads far outside, and filtered reads, together."""
    kernel = pg.kernel(
        source="""
def reach(color: Image) -> vec4:
    near = color[-3, 2] + color[4, -1] * 2.0
    far = color.texel(pixel() * 3 - ivec2(70, 90))
    soft = color.sample(uv() * 2.5 - 0.7)
    return near + far * 4.0 + soft * 8.0
"""
    )
    frame = picture(size, 4)
    target = kernel(pg.Input("frame", border=border), into=pg.target("out", "rgba32f"))
    expected, got = run(target, "reference", frame), run(target, backend_name, frame)
    # Sums of four terms below 20; the filter's position is rounded at |x| < 200, its slope is at most 8 * 1.4 a texel.
    np.testing.assert_allclose(got, expected, rtol=0, atol=8 * 1.4 * 2 * 200 * 2.0**-23 + 20 * 2.0**-22)


@pytest.mark.parametrize("name", [e.name for e in EFFECTS.values() if e.takes == "picture"])
def test_picture_effect_agrees_in_every_target(name: str, backend_name: str) -> None:
    module, _, function = EFFECTS[name].path.partition(":")
    effect = getattr(import_module(module), function)
    report = compare(effect(pg.Input("frame")), backends=[backend_name], frame=np.abs(picture((64, 40), 4)))
    (made,) = report.backends
    assert made.targets and not made.failed
    for target in made.targets:
        assert target.within_bounds, f"{target.step} → {target.target}: {target.max_error} at {target.worst}"


def test_two_runs_are_the_same_bits(backend_name: str) -> None:
    text = "def wave(c: Image) -> vec4: return sin(c[0, 0] * 40.0) * exp(c[1, 0]) + c.sample(uv() * 0.9)"
    kernel = pg.kernel(source=text)
    frame = picture((129, 65), 4)
    target = kernel(pg.Input("frame"), into=pg.target("out", "rgba32f"))
    np.testing.assert_array_equal(run(target, backend_name, frame), run(target, backend_name, frame))
