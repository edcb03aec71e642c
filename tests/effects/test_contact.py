"""Contact penumbra: how dark the floor is under what, and where it is not."""

from __future__ import annotations

import numpy as np
import pytest

import passgraph as pg
from passgraph.effects.contact import Contact, contact_passes
from tests.effects.scenes import Picture, cube, floor, render, sun

SIZE = (48, 32)


def passes(*bodies: pg.Node, darkness: float = 1.0) -> Contact:
    camera = pg.Camera((3, 3, 5), (0, 0.2, 0), vertical_fov_rad=0.7)
    made = pg.Scene((floor(), *bodies), camera, (sun(50, 20),))
    return contact_passes(made, threshold=0.4, darkness=darkness, map_size=32)


def shown(made: pg.Target, backend: str) -> Picture:
    return render(made, size=SIZE, backend=backend)[made.name]


@pytest.mark.parametrize("height", [0.0, 0.1, 0.2, 0.3])
def test_darkness_falls_linearly_to_the_threshold(height: float, backend_name: str) -> None:
    seen = shown(passes(cube((0, height, 0))).map, backend_name)
    assert seen[16, 16, :3] == pytest.approx(height / 0.4, abs=1e-3)
    assert (seen[0] == 1.0).all()


def test_darkness_scales_it(backend_name: str) -> None:
    assert shown(passes(cube(), darkness=0.5).map, backend_name)[16, 16, 0] == pytest.approx(0.5, abs=1e-3)


def test_what_is_above_the_threshold_throws_nothing(backend_name: str) -> None:
    # the high one lies beside the low one, inside the map that both give
    seen = shown(passes(cube((-1, 0, 0), 0.5), cube((1, 0.41, 0), 0.5), cube((1, 0, 1), 0.1)).map, backend_name)
    left, right = seen[:, :16, 0], seen[:, 16:, 0]
    assert (left < 0.01).sum() > 20
    assert 0 < (right < 0.99).sum() <= 9


def test_a_translucent_body_throws_its_colour(backend_name: str) -> None:
    glass = pg.Material("glass", (1.0, 0.5, 0.0, 0.25), alpha_mode="blend")
    seen = shown(passes(pg.Node(cube().mesh, glass)).map, backend_name)
    assert seen[16, 16, :3] == pytest.approx([0.75, 0.375, 0.0], abs=2e-3)


def test_every_target_agrees_with_the_reference(backend_name: str) -> None:
    made = passes(cube((0, 0.1, 0)), cube((1.2, 0, 0.5), 0.5), darkness=0.7)
    targets = (made.picture, made.lit, made.share, made.map)
    expected = render(*targets, size=SIZE)
    got = render(*targets, size=SIZE, backend=backend_name)
    again = render(*targets, size=SIZE, backend=backend_name)
    assert (expected["contact share"] < 0.6).any()
    for name, picture in got.items():
        assert np.array_equal(picture, again[name]), name
        bound = 2 / 255 if name == "picture" else 2.0**-8
        off = (abs(picture - expected[name]) > bound).any(axis=2).mean()
        assert off <= 0.01, f"{name}: {off:.2%} of the pixels differ by more than {bound:g}"


def test_what_cannot_be_is_named() -> None:
    with pytest.raises(pg.GraphError, match="within"):
        passes(cube((0, 2, 0)))
