"""Inputs whose format is left open, and whose bytes are sRGB-encoded: ``pg.Input("frame", "srgb")``."""

from __future__ import annotations

import numpy as np
import pytest

import passgraph as pg
from passgraph.srgb import srgb_to_linear

SAME = "def same(color: Image) -> vec4: return color[0, 0]"


@pytest.mark.parametrize("backend", ["numpy", "reference"])
def test_bytes_are_decoded_and_other_numbers_are_not(backend: str) -> None:
    ramp = np.arange(256, dtype=np.uint8).reshape(8, 32)
    colours = np.dstack([ramp, ramp.T.reshape(8, 32), ramp[::-1], ramp])
    with pg.compile(pg.kernel(source=SAME)(pg.Input("frame", "srgb")), backend) as program:
        made = program(frame=colours)["same"]
        light = srgb_to_linear(colours[..., :3] / np.float64(255))
        np.testing.assert_allclose(made[..., :3], light, rtol=4 * 2.0**-23)
        np.testing.assert_array_equal(made[..., 3], colours[..., 3] / np.float32(255))  # alpha is no light
        for other in (colours.astype(np.uint16), colours.astype(np.float32)):
            most = np.float32(np.iinfo(other.dtype).max if other.dtype.kind == "u" else 1)
            np.testing.assert_array_equal(program(frame=other)["same"], other / most)


def test_it_travels() -> None:
    outputs = pg.from_data(pg.to_data(pg.kernel(source=SAME)(pg.Input("frame", "srgb"))))
    frame = np.full((1, 2, 4), 128, np.uint8)
    with pg.compile(outputs) as program:
        assert program(frame=frame)["same"][0, 0, 0] == pytest.approx(0.2158605, abs=1e-6)
