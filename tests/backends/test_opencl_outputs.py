"""Stencil, blending, masks, several targets and discarding on OpenCL (rasterization.md, rules 6 and 7)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph import discard, vec2, vec4
from passgraph.backends.base import Backend
from passgraph.backends.registry import open_backend
from tests.backends.test_opencl_device import stencil_of
from tests.backends.test_opencl_draws import (
    SIZE,
    Sent,
    colour,
    depth_target,
    flat,
    mesh,
    painted,
    quad,
    rows,
    run,
    white,
)
from tests.conftest import require

pytestmark = pytest.mark.opencl


@pg.fragment
def left_half(sent: Sent) -> vec4:
    if pg.pixel().x >= 8:
        discard()
    return vec4(1.0)


@pg.fragment
def two(sent: Sent) -> tuple[vec4, vec2]:
    return sent.color, vec2(0.25, 0.5)


@pytest.fixture
def device() -> Iterator[Backend]:
    require("opencl")
    with open_backend("opencl") as opened:
        yield opened


def test_stencil_counts_and_tests(device: Backend) -> None:
    depth = depth_target("depth32f_stencil8")
    count = pg.Stencil(passed="increment")
    once = pg.draw(quad(0.0), vertex=flat, fragment=white, into=colour(), depth=depth, stencil=count)
    again = pg.draw(
        rows(),
        vertex=flat,
        fragment=white,
        into=once,
        depth=once.depth,
        stencil=count,
        depth_compare="always",
    )
    equal_two = pg.Stencil(compare="equal", reference=2)
    red = quad(0.0, (1, 0, 0, 1))
    drawn = run(
        device,
        pg.draw(
            red,
            vertex=flat,
            fragment=painted,
            into=again,
            depth=again.depth,
            stencil=equal_two,
            depth_compare="always",
        ),
    )
    assert drawn[0, 0].tolist() == [1, 1, 1, 1]
    assert drawn[-1, 0].tolist() == [1, 0, 0, 1]


@pytest.mark.parametrize(
    ("operation", "start", "stored"),
    [("increment", 255, 255), ("increment_wrap", 255, 0), ("decrement", 0, 0), ("decrement_wrap", 0, 255)],
)
def test_stencil_ends(device: Backend, operation: str, start: int, stored: int) -> None:
    assert stencil_behind(device, pg.Stencil(passed=operation), start) == stored


def test_stencil_write_mask_keeps_bits(device: Backend) -> None:
    assert stencil_behind(device, pg.Stencil(reference=0xFF, passed="replace", write_mask=0x0F), 0xA0) == 0xAF


def test_stencil_depth_fail_is_its_own_operation(device: Backend) -> None:
    rule = pg.Stencil(reference=9, depth_fail="replace", passed="zero")
    assert stencil_behind(device, rule, 1, depth_compare="never") == 9


def stencil_behind(device: Backend, rule: Any, start: int, **more: Any) -> int:
    """The stencil of a pixel after one draw under a rule."""
    from passgraph.backends.opencl.backend import OpenCLBackend

    drawn = pg.draw(
        quad(),
        vertex=flat,
        depth=depth_target("depth32f_stencil8"),
        stencil=rule,
        clear_stencil=start,
        **more,
    )
    assert isinstance(device, OpenCLBackend)
    with pg.compile(drawn, backend=device) as program:
        program.run()
        return int(stencil_of(device, stencil_storage(device, program))[3, 3])


def stencil_storage(device: Any, program: pg.Program) -> Any:
    storages = [s for s in program._execution.memories if s.stencil is not None]  # type: ignore[union-attr]
    return storages[0]


def test_blending_happens_in_the_order_of_submission(device: Backend) -> None:
    corners = [*quad().positions, *quad().positions]
    colors = [(1, 0, 0, 0.5)] * 4 + [(0, 1, 0, 0.5)] * 4
    both = mesh(corners, [(0, 1, 2), (0, 2, 3), (4, 5, 6), (4, 6, 7)], colors)
    drawn = run(device, pg.draw(both, vertex=flat, fragment=painted, into=colour(), blend="alpha"))
    np.testing.assert_array_equal(drawn, np.broadcast_to([0.25, 0.5, 0, 0.75], drawn.shape))


def test_blending_quantises_behind_it(device: Backend) -> None:
    """0.3 + 0.3 in 8 bits: the sum of unrounded 0.3 and stored 77/255."""
    first = pg.draw(quad(color=(0.3,) * 4), vertex=flat, fragment=painted, into=colour("rgba8"), blend="add")
    drawn = run(device, pg.draw(quad(color=(0.3,) * 4), vertex=flat, fragment=painted, into=first, blend="add"))
    stored = np.rint(np.float32(0.3) * 255) / 255
    assert np.rint(drawn[3, 3, 0] * 255) == np.rint((0.3 + stored) * 255)


def test_unorm_targets_clamp_before_blending(device: Backend) -> None:
    low = quad(color=(-5, 0.5, 9, 1))
    drawn = run(device, pg.draw(low, vertex=flat, fragment=painted, into=colour("rgba8", clear=0.5), blend="add"))
    np.testing.assert_array_equal(np.rint(drawn[3, 3] * 255), [128, 255, 255, 255])


def test_colour_masks_keep_channels(device: Backend) -> None:
    drawn = run(
        device,
        pg.draw(
            quad(),
            vertex=flat,
            fragment=white,
            into=colour(clear=0.25),
            color_mask=(True, False, True, False),
        ),
    )
    assert drawn[3, 3].tolist() == [1, 0.25, 1, 0.25]


def test_several_targets(device: Backend) -> None:
    second = pg.target("second", "rg16f", SIZE)
    made = pg.draw(quad(color=(1, 2, 3, 4)), vertex=flat, fragment=two, into=(colour(), second))
    with pg.compile(list(made), backend=device) as program:
        result = program()
    assert result["color"][3, 3].tolist() == [1, 2, 3, 4]
    assert result["second"][3, 3].tolist() == [0.25, 0.5]


def test_discarded_fragments_change_nothing(device: Backend) -> None:
    made = pg.draw(quad(), vertex=flat, fragment=left_half, into=colour(), depth=depth_target())
    with pg.compile([made, made.depth], backend=device) as program:
        result = program()
    assert result["color"][:, :8].min() == 1
    assert result["color"][:, 8:].max() == 0
    assert result["depth"][:, 8:].min() == 1
    assert result["depth"][:, :8].max() == 0.5


def test_discarded_fragments_leave_the_stencil(device: Backend) -> None:
    rule = pg.Stencil(passed="increment")
    depth = depth_target("depth32f_stencil8")
    drawn = pg.draw(quad(), vertex=flat, fragment=left_half, into=colour(), depth=depth, stencil=rule)
    with pg.compile(drawn, backend=device) as program:
        program.run()
        stencil = stencil_of(device, stencil_storage(device, program))  # type: ignore[attr-defined]
    assert stencil[:, :8].min() == 1
    assert stencil[:, 8:].max() == 0


@pytest.mark.parametrize("format_", ["rgba8", "rgba16", "rgba16f", "rgba32f"])
def test_targets_of_each_kind_hold_what_was_drawn(device: Backend, format_: str) -> None:
    drawn = run(device, pg.draw(quad(color=(0.2, 0.4, 0.6, 1)), vertex=flat, fragment=painted, into=colour(format_)))
    np.testing.assert_allclose(drawn[3, 3], [0.2, 0.4, 0.6, 1], atol=2e-3)
