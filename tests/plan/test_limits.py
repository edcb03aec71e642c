"""Limits of a device: fusion stops at them, and what holds more is refused before anything is made."""

from __future__ import annotations

import numpy as np
import pytest

import passgraph as pg
from passgraph.backends.base import Backend
from passgraph.backends.null import NullBackend
from passgraph.errors import BackendError
from passgraph.graph.calls import PixelKernel
from passgraph.graph.targets import Target
from passgraph.plan.data import Plan
from passgraph.plan.fuse import MAX_FUSED_IMAGES
from passgraph.plan.limits import Limits

SIZE = (8, 4)


def summing(name: str, images: int, numbers: int = 0) -> PixelKernel:
    """A kernel over so many images and numbers."""
    names = [f"i{k}" for k in range(images)]
    weights = [f"w{k}" for k in range(numbers)]
    given = ", ".join([*(f"{n}: Image" for n in names), *(f"{w}: float" for w in weights)])
    total = " + ".join([*(f"{n}[0, 0]" for n in names), *(f"vec4({w})" for w in weights)])
    return pg.kernel(source=f"def {name}({given}) -> vec4: return {total}")


def two_passes(images: int, numbers: int = 0) -> Target:
    """Each reads so many images; the second one of them from the first."""
    inputs = [pg.Input(f"in{k}", "rgba32f", SIZE) for k in range(2 * images - 1)]
    kernel = summing("added", images, numbers)
    weights = [0.5] * numbers
    first = kernel(*inputs[:images], *weights, into=pg.target("first", "rgba32f"))
    second: Target = kernel(first, *inputs[images:], *weights, into=pg.target("second", "rgba32f"))
    return second


def planned(target: Target | tuple[Target, ...], **limits: int) -> Plan:
    backend = NullBackend()
    backend.limits = Limits("a small device", **limits)
    with pg.compile(target, backend) as program:
        return program.plan


def refused(target: Target | tuple[Target, ...], **limits: int) -> str:
    backend = NullBackend()
    backend.limits = Limits("a small device", **limits)
    with pytest.raises(BackendError) as caught:
        pg.compile(target, backend)
    assert not backend.storages and not backend.compiled
    return str(caught.value)


def test_fusion_stops_at_the_images_of_a_pass() -> None:
    assert len(planned(two_passes(6), images=11).steps) == 1
    assert len(planned(two_passes(6), images=10).steps) == 2
    assert len(planned(two_passes(6), bindings=12).steps) == 1
    assert len(planned(two_passes(6), bindings=11).steps) == 2
    assert len(planned(two_passes(MAX_FUSED_IMAGES // 2)).steps) == 1
    assert len(planned(two_passes(MAX_FUSED_IMAGES // 2 + 1)).steps) == 2


def test_fusion_stops_at_the_numbers_of_a_pass() -> None:
    assert len(planned(two_passes(2, 6), numbers=12).steps) == 1
    assert len(planned(two_passes(2, 6), numbers=11).steps) == 2
    # Six take eight where a block is whole vectors, twelve are twelve.
    assert len(planned(two_passes(2, 6), numbers=12, rounding=4).steps) == 1
    assert len(planned(two_passes(2, 6), numbers=11, rounding=4).steps) == 2


def test_two_passes_that_each_fit_run_on_every_device(backend: Backend) -> None:
    """Of twenty images each, or as many as the device takes."""
    images = min(20, backend.limits.images)
    given = {f"in{k}": np.full((SIZE[1], SIZE[0], 4), k / 8, np.float32) for k in range(2 * images - 1)}
    with pg.compile(two_passes(images), backend) as program:
        picture = program(**given)["second"]
    assert np.array_equal(picture, np.full_like(picture, sum(range(2 * images - 1)) / 8))


def test_what_still_does_not_fit_names_pass_limit_and_device() -> None:
    pair = pg.kernel(source="def pair(c: Image) -> tuple[vec4, vec4]: return c[0, 0], c[0, 0]")
    frame = pg.Input("frame", "rgba32f", SIZE)
    assert refused(two_passes(6), images=5) == (
        "pass 'first' reads 6 images; a small device takes 5 in one pass; split the kernel"
    )
    assert refused(tuple(pair(frame)), targets=1) == (
        "pass 'pair' writes 2 targets; a small device takes 1 in one pass; split the kernel"
    )
    assert refused(tuple(pair(frame)), bindings=2) == (
        "pass 'pair' has 3 images and targets; a small device takes 2 in one pass; split the kernel"
    )
    assert refused(two_passes(1, 6), numbers=5) == (
        "pass 'first' has 6 numbers as parameters of kernel added; a small device takes 5 in one pass; make some of "
        "them Const, or put them into a picture"
    )


def test_pictures_too_large_are_refused_by_name() -> None:
    kernel = summing("added", 1)
    large = kernel(pg.Input("frame", "rgba32f", SIZE), into=pg.target("large", "rgba32f"), name="grow")
    assert refused(large, side=7) == (
        "input 'frame' is 8x4 rgba32f (0 MiB); a small device takes 7 pixels a side; use a smaller size or format, "
        "or another backend"
    )
    wide = pg.kernel(source="def wide() -> vec4: return vec4(1.0)")
    target = wide(into=pg.target("wide", "rgba32f", (9, 2)), name="grow")
    assert refused(target, side=8).startswith("pass 'grow': target 'wide' is 9x2 rgba32f (0 MiB); a small device takes")
    assert "takes 17 pixels in a picture" in refused(target, pixels=17)
    assert "takes 287 bytes in a picture" in refused(target, picture_bytes=287)
    assert planned(target, side=9, pixels=18, picture_bytes=288).steps


CORNER = """
class Corner:
    position: vec4
    tint: vec3

def place(vertex: Vertex, shift: vec3) -> Corner:
    return Corner(vec4(vertex.position + shift, 1.0), vertex.position)

def paint(corner: Corner, tint: vec4) -> vec4:
    return vec4(corner.tint, 1.0) * tint
"""


def test_draws_are_held_to_what_their_stages_take() -> None:
    mesh = pg.Mesh.make([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]])
    drawn = pg.draw(
        mesh, vertex=pg.vertex(source=CORNER, name="place"), fragment=pg.fragment(source=CORNER, name="paint"),
        into=pg.target("drawn", "rgba32f", SIZE), name="mark", shift=(0.0, 0.0, 0.0), tint=(1.0, 1.0, 1.0, 1.0),
    )  # fmt: skip
    assert refused(drawn, varyings=2) == (
        "pass 'mark' hands over 3 numbers from vertex to fragment kernel; a small device takes 2 in one pass; hand "
        "over fewer"
    )
    assert "pass 'mark' has 3 numbers as parameters of kernel place" in refused(drawn, vertex_numbers=2)
    assert "pass 'mark' has 4 numbers as parameters of kernel paint" in refused(drawn, numbers=3)
    assert planned(drawn, varyings=3, vertex_numbers=3, numbers=4).steps


def test_devices_state_real_limits(backend: Backend) -> None:
    limits = backend.limits
    assert limits.device.startswith(backend.name)
    stated = {"gl": ("side", "images", "targets", "numbers", "vertex_numbers", "varyings"),
              "opencl": ("picture_bytes", "bindings", "numbers"), "numpy": ("pixels",),
              "webgpu": ("side", "picture_bytes", "images", "targets", "numbers", "vertex_numbers", "varyings"),
    }[backend.name]  # fmt: skip
    for name in stated:
        assert 4 <= getattr(limits, name) < getattr(Limits(), name)


def counting(name: str, trips: int, body: str = "c = c * 0.5 + 0.25") -> PixelKernel:
    """A kernel whose loops, one inside the other, make 3 * trips trips: the one around is unrolled."""
    return pg.kernel(
        source=f"def {name}(a: Image) -> vec4:\n    c = a[0, 0]\n    for i in range(3):\n"
        f"        for j in range({trips}):\n            {body}\n    return c"
    )


def test_passes_whose_loops_make_too_many_trips_stay_apart_or_are_refused() -> None:
    first = counting("one", 100)(pg.Input("in", "rgba32f", SIZE), into=pg.target("first", "rgba32f"))
    second = counting("two", 90)(first, into=pg.target("second", "rgba32f"))
    assert len(planned(second, trips=570).steps) == 1
    assert len(planned(second, trips=569).steps) == 2
    assert len(planned(second, trips=300).steps) == 2
    assert refused(second, trips=299) == (
        "pass 'first' makes 300 trips of loops a pixel in kernel one; a small device takes 299 in one pass; "
        "make fewer in one pass, or use another backend"
    )


def test_loops_that_are_left_early_are_taken_whatever_they_may_make() -> None:
    left = counting("left", 100, "if c.x < 0.5: break\n            c = c * 0.5")
    assert len(planned(left(pg.Input("in", "rgba32f", SIZE), into=pg.target("first", "rgba32f")), trips=9).steps) == 1
