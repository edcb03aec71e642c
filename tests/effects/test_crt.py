"""The tube of T. Lottes against his functions, in float64."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.effects import crt
from passgraph.effects.style.crt import MASKS, Mask
from tests.agreement import assert_within_bounds
from tests.conftest import DEVICES
from tests.effects.scenes import Float64, Picture, render

FRAME = pg.Input("frame")
every_backend = pytest.mark.parametrize("backend_name", ["reference", *DEVICES], indirect=True)


def picture(size: tuple[int, int]) -> Picture:
    """HDR, negative."""
    light = 5.0 * np.random.default_rng(size[0]).random((*size, 4)) - 1.0
    light[..., 3] = 1.0
    return np.asarray(light, np.float32)


def shown(target: pg.Target, backend: str = "numpy", **given: Any) -> Float64:
    (made,) = render(target, size=None, backend=backend, **given).values()
    return made.astype(np.float64)


class Tube:
    """His functions by their names: a picture of one texel a pixel of the beam, at places ``pos`` from 0 to 1."""

    def __init__(self, texels: Float64, size: tuple[int, int], scan: float, pix: float, warp: float) -> None:
        self.texels, self.scan, self.pix = texels, scan, pix
        self.res = np.array(texels.shape[1::-1], np.float64)
        y, x = np.mgrid[: size[0], : size[1]] + 0.5
        pos = np.stack([x / size[1], y / size[0]], axis=-1) * 2.0 - 1.0
        factors = 1.0 + pos[..., ::-1] ** 2 * np.array([0.031, 0.041]) * warp
        self.pos = pos * factors * 0.5 + 0.5

    def fetch(self, off: tuple[int, int]) -> Float64:
        at = np.floor(self.pos * self.res + off).astype(int)
        inside = ((at >= 0) & (at < self.res)).all(axis=-1)
        at = np.clip(at, 0, self.res.astype(int) - 1)
        return np.asarray(self.texels[at[..., 1], at[..., 0], :3] * inside[..., None])

    def dist(self) -> Float64:
        at = self.pos * self.res
        return np.asarray(-((at - np.floor(at)) - 0.5))

    def horz(self, taps: int, off: int, scale: float) -> Float64:
        side = range(-(taps // 2), taps // 2 + 1)
        weights = [np.exp2(scale * (self.dist()[..., :1] + i) ** 2) for i in side]
        total = sum(self.fetch((i, off)) * w for i, w in zip(side, weights, strict=True))
        return np.asarray(total / sum(weights))

    def across(self, off: int, scale: float) -> Float64:
        return np.asarray(np.exp2(scale * (self.dist()[..., 1:] + off) ** 2))

    def tri(self) -> Float64:
        taps = {-1: 3, 0: 5, 1: 3}
        return np.asarray(sum(self.horz(taps[off], off, self.pix) * self.across(off, self.scan) for off in taps))

    def bloom(self) -> Float64:
        rows = {-2: (5, self.pix), -1: (7, -1.5), 0: (7, -1.5), 1: (7, -1.5), 2: (5, self.pix)}
        return np.asarray(sum(self.horz(n, off, scale) * self.across(off, -2.0) for off, (n, scale) in rows.items()))


def mask_of(kind: Mask, size: tuple[int, int], dark: float, light: float) -> Float64:
    """His masks at the middles of pixels; rows from the top."""
    y, x = np.mgrid[: size[0], : size[1]] + 0.5
    line = np.ones(size)
    if kind == "none":
        return np.ones((*size, 3))
    if kind == "tv":
        odd = (x / 6.0 % 1.0 < 0.5) * 1.0
        line = np.where((y + odd) * 0.5 % 1.0 < 0.5, dark, light)
    if kind == "vga":
        x, y = np.floor(x), np.floor(y * 0.5)
    share = ((x + 3.0 * y) / 6.0 if kind in ("vga", "stretched-vga") else x / 3.0) * 1.000001 % 1.0
    third = np.where(share < 0.333, 0, np.where(share < 0.666, 1, 2))
    return np.asarray(np.where(third[..., None] == np.arange(3), light, dark) * line[..., None])


@pytest.mark.sampled
@every_backend
@pytest.mark.parametrize("mask", MASKS)
@pytest.mark.parametrize("size", [(1, 1), (12, 16), (21, 33)], ids=str)
def test_it_is_the_tube_of_its_author(size: tuple[int, int], mask: Mask, backend_name: str) -> None:
    frame, large = picture(size), (3 * size[0] + 1, 3 * size[1])
    tube = Tube(frame.astype(np.float64), large, -9.0, -2.5, 1.5)
    expected = (tube.tri() + 0.1 * tube.bloom()) * mask_of(mask, large, 0.4, 1.3)
    into = pg.target("crt", "rgba32f", large[::-1])
    made = crt(FRAME, 1, pg.Value("scan"), 2.5, 0.1, 1.5, mask, 0.4, 1.3, into=into)
    picture_made = shown(made, backend_name, frame=frame, scan=9.0)
    off = np.abs(picture_made[..., :3] - expected).max(axis=-1)
    # a place of float32 may lie on the other side of a texel's edge, where few taps more or less count
    assert (off > 2e-4).mean() < 0.002
    assert off.max() < 0.05
    np.testing.assert_array_equal(picture_made[..., 3], 1.0)


def test_squares_are_their_means() -> None:
    frame = picture((12, 20))
    small = frame.astype(np.float64).reshape(3, 4, 5, 4, 4).mean(axis=(1, 3))
    tube = Tube(small, (12, 20), -8.0, -3.0, 1.0)
    expected = (tube.tri() + tube.bloom() / 16.0) * mask_of("stretched-vga", (12, 20), 0.5, 1.5)
    np.testing.assert_allclose(shown(crt(FRAME), frame=frame)[..., :3], expected, atol=1e-3)


def test_beyond_the_glass_it_is_black_and_dark_pictures_stay_dark() -> None:
    frame = np.ones((40, 60, 4), np.float32)
    made = shown(crt(FRAME, curve=8.0, glow=0.0), frame=frame)
    assert made[0, 0, :3].max() < 1e-6 < made[20, 30, :3].min()
    assert (shown(crt(FRAME), frame=frame * np.float32([0, 0, 0, 1]))[..., :3] == 0.0).all()


def test_crt_within_bounds_of_the_reference() -> None:
    assert_within_bounds(crt(FRAME), frame=picture((9, 13)))
