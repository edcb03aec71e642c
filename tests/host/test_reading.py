"""Kernels read an engine's pictures where they are, whatever it keeps them in: the same bits as of an array."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import passgraph as pg
from tests.host.application import KEPT, Application, Kept

pytestmark = pytest.mark.gl

ISOLATIONS = ("sibling", "guard")
#: Every way to read: here, beside, beyond each border, by a place that is computed, filtered.
READERS = {
    "here": "def read(c: Image) -> vec4: return c[0, 0]",
    "beside": "def read(c: Image) -> vec4: return c[3, -2] + 2.0 * c[-1, 4]",
    "anywhere": "def read(c: Image) -> vec4: return c.texel(ivec2(pixel().y * 2 - 3, pixel().x - 2))",
    "filtered": "def read(c: Image) -> vec4: return c.sample(uv() * 1.3 - vec2(0.2, 0.1))",
}
BORDERS = ("clamp", "mirror", "repeat", "zero")
PLACEMENTS = ("whole", "part", "from the top", "part from the top")


def read_program(source: str, border: str, backend: Any, math: Any = "exact") -> pg.Program:
    frame = pg.Input("frame").border(border)
    output = pg.kernel(source=source)(frame, into=pg.target("out", "rgba32f"))
    return pg.compile(output, backend=backend, options=pg.Options(math=math))


def of_host(app: Application, host: pg.gl.Host, kept: Kept, **asked: Any) -> pg.gl.HostPicture:
    found = host.framebuffer(kept.framebuffer, **asked)
    picture = found.depth if kept.depth else found.color
    assert picture is not None
    return picture


@pytest.mark.sampled
@pytest.mark.parametrize("isolation", ISOLATIONS)
@pytest.mark.parametrize("name", KEPT)
def test_whatever_an_engine_keeps_its_picture_in(app: Application, name: str, isolation: Any) -> None:
    kept = KEPT[name](app)
    with pg.gl.Host.current(isolation) as host:
        picture = of_host(app, host, kept)
        assert (picture.size, picture.format.name) == (kept.values.shape[1::-1], kept.format)
        with read_program(READERS["beside"], "mirror", host) as program:
            got = program(frame=picture)["out"]
    with read_program(READERS["beside"], "mirror", "gl") as program:
        given = kept.values
        expected = program(frame=given)["out"]
    # What OpenGL makes of n/255 is an ulp off on some drivers; of floats nothing is.
    tolerance = 0.0 if kept.format.endswith("f") and not kept.depth and name != "10 bits" else 2e-6
    np.testing.assert_allclose(got, expected, rtol=0, atol=tolerance)


def texture_of(app: Application, placement: str) -> tuple[np.ndarray, dict[str, Any]]:
    """Make a texture that holds a picture in one of :data:`PLACEMENTS`; return the picture, and where it lies."""
    random = np.random.default_rng(2)
    values = random.normal(0, 1, (13, 19, 4)).astype(np.float32)
    whole, region = values, None
    if "part" in placement:
        whole = random.normal(50, 1, (32, 64, 4)).astype(np.float32)
        region = (7, 32 - 5 - 13, 19, 13)
        whole[5:18, 7:26] = values
    if "top" in placement:
        whole = whole[::-1]
        region = region and (7, 5, 19, 13)
    name = app.texture(0x8814, 0x1908, 0x1406, whole, whole.shape[1::-1])
    return values, {"name": name, "region": region, "origin": "top" if "top" in placement else "bottom"}


@pytest.mark.sampled
@pytest.mark.parametrize("border", BORDERS)
@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize("placement", PLACEMENTS)
def test_the_bits_are_those_of_an_array(app: Application, placement: str, reader: str, border: str) -> None:
    values, texture = texture_of(app, placement)
    with pg.gl.Host.current() as host:
        picture = host.texture(**texture)
        with read_program(READERS[reader], border, host) as program:
            got = program(frame=picture)["out"]
    with read_program(READERS[reader], border, "gl") as program:
        np.testing.assert_array_equal(got, program(frame=values)["out"])


@pytest.mark.sampled
@pytest.mark.parametrize("border", BORDERS)
@pytest.mark.parametrize("placement", PLACEMENTS)
def test_native_math_filters_a_part_as_a_picture(app: Application, placement: str, border: str) -> None:
    """Samplers wrap at the edges of textures, which are not those of a part; weights have 8 bits each way."""
    values, texture = texture_of(app, placement)
    with pg.gl.Host.current() as host:
        picture = host.texture(**texture)
        with read_program(READERS["filtered"], border, host, "native") as program:
            got = program(frame=picture)["out"]
            assert "the device's own filter" in program.plan.explain()
    with read_program(READERS["filtered"], border, "numpy") as program:
        expected = program(frame=values)["out"]
    np.testing.assert_allclose(got, expected, rtol=0, atol=2.0**-7 * np.ptp(values))
