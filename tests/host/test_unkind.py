"""Pictures that an unkind engine has: right numbers, or an error at once that says what it is."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.backends.gl import gl_functions as g
from passgraph.errors import BackendError, InputError
from passgraph.hosts.gl import check_asked
from passgraph.hosts.gl_pictures import EmptyPictureError
from tests.host.application import BYTES, DEPTH, FLOATS, HEIGHT, RED, RGBA, SIZE, WIDTH, Application
from tests.host.test_life import compiled
from tests.host.test_reading import ISOLATIONS
from tests.host.test_writing import ROWS, expected

pytestmark = pytest.mark.gl
ARRAY, VOLUME, CUBE, BUFFER = 0x8C1A, 0x806F, 0x8513, 0x8C2A
UINT, INT, POINTER = ctypes.c_uint, ctypes.c_int, ctypes.c_void_p


def call(app: Application, name: str, types: tuple[Any, ...], *arguments: Any) -> None:
    """A function of OpenGL's that applications have and passgraph does not use."""
    ctypes.CFUNCTYPE(None, *types)(app.native.load_opengl_function(name))(*arguments)


def copied(channels: int = 4, **target: Any) -> pg.Target:
    source = f"def copied(c: Image) -> {'float' if channels == 1 else 'vec4'}: return c[0, 0]"
    source = source.replace("c[0, 0]", "c[0, 0].r") if channels == 1 else source
    return pg.kernel(source=source)(pg.Input("frame"), into=pg.target("copied", **target))


class _Named:
    """As moderngl's textures and framebuffers are."""

    glo = 3


def test_an_object_of_moderngl_is_told_where_its_name_is() -> None:
    with pytest.raises(pg.InputError, match=r"is a whole number; moderngl's objects have it as \.glo"):
        check_asked(_Named(), None, None, "bottom", None)


@pytest.mark.parametrize("isolation", ISOLATIONS)
@pytest.mark.parametrize(
    ("internal", "external", "kind"),
    [(0x8814, RGBA, FLOATS), (0x8D7C, 0x8D99, BYTES), (0x81A6, DEPTH, FLOATS)],
    ids=["floats", "whole numbers", "depth"],
)
def test_a_texture_that_gets_another_format_is_not_taken_for_the_old_one(
    app: Application, internal: int, external: int, kind: int, isolation: Any
) -> None:
    name = app.texture(0x8058, RGBA, BYTES, ROWS)
    with pg.gl.Host.current(isolation) as host, compiled(host) as program:
        old = host.texture(name)
        program.run(frame=old, into={"picture": old})
        app.gl.BindTexture(g.TEXTURE_2D, name)
        app.gl.TexImage2D(g.TEXTURE_2D, 0, internal, *SIZE, 0, external, kind, None)
        for given in ({"frame": old}, {"frame": ROWS, "into": {"picture": old}}):
            with pytest.raises(InputError, match="texture 1 has another format or number of samples now"):
                program.run(**given)


@pytest.mark.sampled
@pytest.mark.parametrize("isolation", ISOLATIONS)
@pytest.mark.parametrize("kind", ["texture", "renderbuffer"])
@pytest.mark.parametrize("samples", [1, 2, 3])
def test_any_number_of_samples(app: Application, samples: int, kind: str, isolation: Any) -> None:
    """Drivers take the next larger number that they have."""
    source = app.of_texture(app.texture(0x8058, RGBA, BYTES, ROWS))
    if kind == "texture":
        name = app.gl.new("Texture")
        app.gl.BindTexture(0x9100, name)
        app.make_samples(0x9100, samples, 0x8058, *SIZE, 1)
        app.gl.BindTexture(0x9100, 0)
        made = app.of_texture(name, 0x9100)
        app.blit(source, made, False)
    else:
        made = app.of_renderbuffer(0x8058, source, samples)
    with pg.gl.Host.current(isolation) as host, compiled(host) as program:
        found = host.framebuffer(made)
        assert found.samples >= samples
        program.run(frame=found, into={"picture": found})
    plain = app.of_texture(app.texture(0x8058, RGBA, BYTES, None))
    app.blit(made, plain, False)
    np.testing.assert_array_equal(app.pixels(plain), expected())


@pytest.mark.parametrize("isolation", ISOLATIONS)
def test_numbers_are_those_that_are_held_whatever_samplers_make_of_them(app: Application, isolation: Any) -> None:
    name = app.texture(0x8058, RGBA, BYTES, ROWS)
    app.gl.BindTexture(g.TEXTURE_2D, name)
    for channel, gets in zip(range(0x8E42, 0x8E46), (1, 0x1905, 0x1904, RED), strict=True):
        app.gl.TexParameteri(g.TEXTURE_2D, channel, gets)
    with pg.gl.Host.current(isolation) as host, pg.compile(copied(format="rgba8"), backend=host) as program:
        np.testing.assert_array_equal(np.round(program(frame=host.texture(name))["copied"] * 255), ROWS)


@pytest.mark.parametrize("isolation", ISOLATIONS)
def test_depth_is_read_where_samplers_get_the_stencil(app: Application, isolation: Any) -> None:
    rows = np.full((HEIGHT, WIDTH, 1), (3 << 30) | 5, np.uint32)
    name = app.texture(0x88F0, 0x84F9, 0x84FA, rows)
    app.gl.BindTexture(g.TEXTURE_2D, name)
    app.gl.TexParameteri(g.TEXTURE_2D, 0x90EA, 0x1901)
    app.gl.BindTexture(g.TEXTURE_2D, 0)
    with pg.gl.Host.current(isolation) as host, pg.compile(copied(1, format="r32f"), backend=host) as program:
        np.testing.assert_allclose(program(frame=host.texture(name))["copied"], 0.75, atol=2e-6)


@pytest.mark.parametrize("isolation", ISOLATIONS)
def test_a_level_is_written_from_another_of_the_same_texture(app: Application, isolation: Any) -> None:
    gl, name, size = app.gl, app.gl.new("Texture"), (2 * WIDTH, 2 * HEIGHT)
    large = np.random.default_rng(4).integers(0, 256, (*size[::-1], 4), np.uint8)
    gl.BindTexture(g.TEXTURE_2D, name)
    for level, rows in enumerate((large[::-1].copy(), ROWS[::-1].copy())):
        gl.TexImage2D(g.TEXTURE_2D, level, 0x8058, *rows.shape[1::-1], 0, RGBA, BYTES, rows.ctypes.data)
    gl.TexParameteri(g.TEXTURE_2D, 0x813D, 1)
    gl.TexParameteri(g.TEXTURE_2D, 0x2801, 0x2703)
    gl.BindTexture(g.TEXTURE_2D, 0)
    whole, half = app.of_texture(name), app.of_texture(name, level=1)
    smaller = pg.kernel(source="def smaller(c: Image) -> vec4: return c.texel(2 * pixel())")
    larger = pg.kernel(source="def larger(c: Image) -> vec4: return c.texel(ivec2(pixel().x // 2, pixel().y // 2))")
    frame = pg.Input("frame")
    with pg.gl.Host.current(isolation) as host:
        with pg.compile(smaller(frame, into=pg.target("s", "rgba8", size=SIZE)), backend=host) as program:
            program.run(frame=host.framebuffer(whole), into={"s": host.framebuffer(half)})
        np.testing.assert_array_equal(app.pixels(half), large[::2, ::2])
        with pg.compile(larger(frame, into=pg.target("l", "rgba8", size=size)), backend=host) as program:
            program.run(frame=host.framebuffer(half), into={"l": host.framebuffer(whole)})
        np.testing.assert_array_equal(app.pixels(whole, size=size), large[::2, ::2].repeat(2, 0).repeat(2, 1))


def volume(app: Application) -> int:
    name = app.gl.new("Texture")
    app.gl.BindTexture(VOLUME, name)
    app.TexImage3D(VOLUME, 0, 0x8058, WIDTH, HEIGHT, 3, 0, RGBA, BYTES, None)
    app.gl.BindTexture(VOLUME, 0)
    return name


def cube(app: Application) -> int:
    name = app.gl.new("Texture")
    app.gl.BindTexture(CUBE, name)
    for side in range(6):
        app.gl.TexImage2D(0x8515 + side, 0, 0x8058, 8, 8, 0, RGBA, BYTES, None)
    app.gl.BindTexture(CUBE, 0)
    return name


def buffer_texture(app: Application) -> int:
    held, name = app.gl.new("Buffer"), app.gl.new("Texture")
    app.gl.BindBuffer(BUFFER, held)
    call(app, "glBufferData", (UINT, ctypes.c_ssize_t, POINTER, UINT), BUFFER, 4096, None, 0x88E4)
    app.gl.BindTexture(BUFFER, name)
    call(app, "glTexBuffer", (UINT, UINT, UINT), BUFFER, 0x8058, held)
    app.gl.BindTexture(BUFFER, 0)
    return name


def empty(app: Application) -> int:
    name = app.gl.new("Texture")
    app.gl.BindTexture(g.TEXTURE_2D, name)
    app.gl.TexImage2D(g.TEXTURE_2D, 0, 0x8058, 0, 0, 0, RGBA, BYTES, None)
    app.gl.BindTexture(g.TEXTURE_2D, 0)
    return name


def all_layers(app: Application) -> int:
    name = app.layer(ROWS)
    points = (g.FRAMEBUFFER, g.COLOR_ATTACHMENT0, name, 0)
    return app.framebuffer(lambda: call(app, "glFramebufferTexture", (UINT, UINT, UINT, INT), *points))


#: What it is → how it is asked for, and what is said.
REFUSED: dict[str, tuple[Callable[[Application, pg.gl.Host], Any], str]] = {
    "an array": (lambda app, host: host.texture(app.layer(ROWS)), "texture 1 is an array; give a framebuffer"),
    "a volume": (lambda app, host: host.texture(volume(app)), "texture 1 is a volume; give a framebuffer"),
    "a cube map": (lambda app, host: host.texture(cube(app)), "texture 1 is a cube map; give a framebuffer"),
    "a buffer": (lambda app, host: host.texture(buffer_texture(app)), "is of a kind that no pass reads or writes"),
    "all layers": (lambda app, host: host.framebuffer(all_layers(app)), "draws into all layers of texture 1 at once"),
    "no pixels": (lambda app, host: host.texture(empty(app)), "texture 1 has no pixels"),
    "stencil": (lambda app, host: host.texture(app.texture(0x8D48, 0x1901, BYTES, None)), "no colours and no depth"),
}


@pytest.mark.parametrize("isolation", ISOLATIONS)
@pytest.mark.parametrize("name", REFUSED)
def test_what_no_kernel_reads_is_said_to_be_that(app: Application, name: str, isolation: Any) -> None:
    ask, said = REFUSED[name]
    with pg.gl.Host.current(isolation) as host:
        with pytest.raises(BackendError, match=said) as raised:
            ask(app, host)
        assert isinstance(raised.value, EmptyPictureError) == (name == "no pixels")
        app.gl.drain()
        with compiled(host) as program:  # and it works on
            assert np.array_equal(program(frame=ROWS)["picture"].shape[:2], (HEIGHT, WIDTH))
