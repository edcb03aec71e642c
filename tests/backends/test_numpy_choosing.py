"""Passes that only choose among stored numbers work on them as they are, and give what decoding and rounding would."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import passgraph as pg
from passgraph.backends.numpy.machine.machine_code import lanes
from passgraph.backends.numpy.pixels.buffer_layout import Layout
from passgraph.backends.numpy.pixels.chains import single_stage
from passgraph.plan.build import build
from passgraph.plan.data import PixelStep

Picture = NDArray[Any]
PADS: dict[str, Any] = {
    "clamp": "edge",
    "zero": "constant",
    "repeat": "wrap",
    "mirror": "symmetric",
    "reflect-101": "reflect",
}
RESULTS = {1: "float", 2: "vec2", 3: "vec3", 4: "vec4"}
#: Around register widths of 32 and 64 bytes, and several registers.
WIDTHS = (1, 2, 31, 65, 200)


def chosen(channels: int, text: str) -> Any:
    """A kernel that gives these of its channels."""
    letters = "rgba"[:channels]
    return pg.kernel(source=f"def chosen(c: Image) -> {RESULTS[channels]}: return ({text}).{letters}")


def layout(made: pg.Target) -> Layout:
    (step,) = build({"made": made}).steps
    assert isinstance(step, PixelStep)
    return Layout.for_chain(single_stage(step), lanes())


def at(picture: Picture, dx: int, dy: int, border: str) -> Picture:
    """``color[dx, dy]`` of every pixel."""
    height, width = picture.shape[:2]
    around = np.pad(picture, ((2, 2), (2, 2), (0, 0)), PADS[border])
    return around[2 + dy : 2 + dy + height, 2 + dx : 2 + dx + width]


@pytest.mark.sampled
@pytest.mark.parametrize("border", PADS)
@pytest.mark.parametrize("format_", ["r8", "rg16", "rgb8", "rgba8", "rgba16"])
def test_numbers_are_those_of_numpy(format_: str, border: str) -> None:
    """The ends of rows lead elsewhere by the border rule; a reach to one side leaves the other as it is."""
    channels, bits = len(format_.rstrip("168")), np.uint8 if format_.endswith("8") else np.uint16
    kernel = chosen(channels, "max(min(c[-2, 0], c[0, 1]), min(c[-1, -2], c[0, 0]))")
    frame = pg.Input("frame", format_).border(border)
    for width in WIDTHS:
        picture = np.random.default_rng(width).integers(0, np.iinfo(bits).max + 1, (5, width, channels)).astype(bits)
        expected = np.maximum(
            np.minimum(at(picture, -2, 0, border), at(picture, 0, 1, border)),
            np.minimum(at(picture, -1, -2, border), picture),
        )
        found = np.empty_like(picture)
        with pg.compile(kernel(frame, into=pg.target("chosen", format_))) as program:
            program(frame=picture, into={"chosen": found})
        assert np.array_equal(found, expected), width


def test_what_only_chooses_is_told_from_what_does_not() -> None:
    def selects(text: str, format_: str = "rgba8", into: str = "rgba8") -> bool:
        made = chosen(4, text)(pg.Input("frame", format_, (9, 9)), into=pg.target("chosen", into))
        return layout(made).stages[0].selects

    assert selects("min(c[0, 0], c[1, 0])")
    assert selects("c[0, 1]", "rgba16", "rgba16")
    assert not selects("min(c[0, 0], 0.3)")
    assert not selects("min(c[0, 0], c[1, 0] * 0.5)")
    assert not selects("min(c[0, 0], c[1, 0])", "rgba8", "rgba16")
    assert not selects("min(c[0, 0], c[1, 0])", "rgba8_srgb", "rgba8_srgb")
    assert not selects("min(c[0, 0], c[1, 0])", "rgba16f", "rgba16f")
    assert not selects("min(c.texel(pixel() // 2), c[1, 0])")
    assert not selects("min(c[0, 0], c[1, 0].bgra)")


def test_registers_are_full_and_stay_in_the_room_behind_pictures() -> None:
    """Four bytes for each float32; what a turn of the loop loads may end behind a picture, see machine/memory.py."""
    made = chosen(4, "min(c[0, 0], c[-1, 0])")(pg.Input("f", "rgba8", (99, 9)), into=pg.target("chosen", "rgba8"))
    stage = layout(made).stages[0]
    assert stage.lanes == 4 * lanes()
    assert stage.lanes * stage.vectors <= 128


def test_callers_memory_is_read_and_written_in_place() -> None:
    """Rows of another array, from the bottom up."""
    random = np.random.default_rng(0)
    outer, made = (random.integers(0, 256, (9, 150, 4)).astype(np.uint8) for _ in range(2))
    picture, into = outer[::-1, 7:-6], made[:, 5:-8]
    kept = made.copy()
    kept[:, 5:-8] = np.minimum(at(picture, 1, 1, "clamp"), picture)
    kernel = chosen(4, "min(c[0, 0], c[1, 1])")
    with pg.compile(kernel(pg.Input("frame", "rgba8"), into=pg.target("chosen", "rgba8"))) as program:
        program(frame=picture, into={"chosen": into})
    assert np.array_equal(made, kept)
