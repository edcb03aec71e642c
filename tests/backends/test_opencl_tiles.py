"""The tiled rasteriser on OpenCL: what must not depend on how work is split."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph import mat4, vec3, vec4
from passgraph.backends.opencl import OpenCLBackend, raster
from passgraph.errors import BackendError
from passgraph.scene.teapot import teapot_mesh
from tests.conftest import require

pytestmark = pytest.mark.opencl
#: Several tiles of either way, the last ones cut.
SIZE = (100, 70)
#: A camera in front of the teapot, so near that parts of it are behind the eye; the sky shows.
NEAR = np.array([[2, 0, 0, 3], [0, 3, 0, -8], [0, 0, -1.02, 1.3], [0, 0, -1, 1.5]])


@pg.struct
class Surface:
    position: vec4
    normal: vec3


@pg.vertex
def place(vertex: pg.Vertex, matrix: mat4) -> Surface:
    return Surface(matrix * vec4(vertex.position, 1.0), vertex.normal)


@pg.fragment
def shaded(surface: Surface) -> vec4:
    return vec4(surface.normal * 0.5, 0.5)


@pytest.fixture
def device() -> Iterator[OpenCLBackend]:
    require("opencl")
    with OpenCLBackend() as opened:
        yield opened


def teapot(device: OpenCLBackend, blend: Any = None) -> bytes:
    """Bits of colour and depth of a teapot that several planes cut."""
    drawn = pg.draw(
        teapot_mesh(4), vertex=place, fragment=shaded, into=pg.target("color", "rgba16f", SIZE),
        depth=pg.target("depth", "depth32f", SIZE), values={"matrix": NEAR}, blend=blend,
        depth_compare="always" if blend else "less",
    )  # fmt: skip
    with pg.compile([drawn, drawn.depth], backend=device) as program:
        result = program()
        assert np.unique(result["color"]).size > 100
        assert 0 < np.count_nonzero(result["depth"] == 1) < SIZE[0] * SIZE[1]
        return result["color"].tobytes() + result["depth"].tobytes()


@pytest.mark.parametrize("blend", [None, "alpha"])
def test_two_runs_give_the_same_bits(device: OpenCLBackend, blend: Any) -> None:
    assert teapot(device, blend) == teapot(device, blend)


@pytest.mark.parametrize("blend", [None, "alpha"])
def test_work_groups_and_single_items_draw_the_same_bits(
    device: OpenCLBackend, blend: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What CPUs run and what graphics processors run."""
    expected = teapot(device, blend)
    monkeypatch.setattr(device, "is_cpu", not device.is_cpu)
    assert teapot(device, blend) == expected


@pytest.mark.parametrize(("tile", "chunks"), [(8, 256), (32, 1), (64, 7)])
def test_tiles_and_chunks_do_not_show(
    device: OpenCLBackend, tile: int, chunks: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    expected = teapot(device, "alpha")
    monkeypatch.setattr(raster, "TILE_SERIAL", tile)
    monkeypatch.setattr(raster, "MAX_CHUNKS", chunks)
    assert teapot(device, "alpha") == expected


def test_a_mesh_too_large_for_scratch_memory_is_drawn_in_parts(
    device: OpenCLBackend, monkeypatch: pytest.MonkeyPatch
) -> None:
    expected = teapot(device, "alpha")
    monkeypatch.setattr(raster, "MAX_SCRATCH_BYTES", 20_000)
    assert teapot(device, "alpha") == expected


def test_a_triangle_that_does_not_fit_is_refused(device: OpenCLBackend, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(raster, "MAX_SCRATCH_BYTES", 40)
    with pytest.raises(BackendError, match="draw 'color': one triangle needs more than 40 bytes"):
        teapot(device)


def test_targets_of_one_pixel(device: OpenCLBackend) -> None:
    drawn = pg.draw(
        teapot_mesh(2), vertex=place, fragment=shaded, into=pg.target("color", "rgba32f", (1, 1), clear=0.25),
        values={"matrix": np.diag([1, 1, 0.1, 9.0])},
    )  # fmt: skip
    with pg.compile(drawn, backend=device) as program:
        assert program()["color"].shape == (1, 1, 4)


def test_a_mesh_out_of_sight_leaves_the_clear_colour(device: OpenCLBackend) -> None:
    away = np.eye(4)
    away[0, 3] = 100
    drawn = pg.draw(
        teapot_mesh(2), vertex=place, fragment=shaded, into=pg.target("color", "rgba8", SIZE, clear=1.0),
        values={"matrix": away},
    )  # fmt: skip
    with pg.compile(drawn, backend=device) as program:
        np.testing.assert_array_equal(program()["color"], 1)


def test_a_fragment_kernel_reads_images(device: OpenCLBackend) -> None:
    frame = np.random.default_rng(5).random((SIZE[1], SIZE[0], 4), np.float32)
    square = teapot_mesh(2)
    drawn = pg.draw(
        square, vertex=place, fragment=looked_up, into=pg.target("color", "rgba32f", SIZE),
        values={"matrix": np.diag([1, 1, 0.01, 1.0]), "frame": pg.Input("frame")},
    )  # fmt: skip
    with pg.compile(drawn, backend=device) as program:
        got = program(frame=frame)["color"]
    hit = got[..., 3] > 0
    assert hit.any()
    np.testing.assert_array_equal(got[hit], frame[hit])


@pg.fragment
def looked_up(surface: Surface, frame: pg.Image) -> vec4:
    return frame.texel(pg.pixel())
