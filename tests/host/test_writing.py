"""Results are written into an engine's pictures where they are, beside nothing else, also over what they come from."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph import Image, vec4
from passgraph.errors import InputError
from tests.host.application import BYTES, FLOATS, HEIGHT, RGB, RGBA, WIDTH, Application

pytestmark = pytest.mark.gl

BLUR = """def blur(c: Image) -> vec4:
    s = vec4(0.0)
    for i in range(-3, 4):
        s += c[i, 2 * i]
    return s / 7.0"""
ROWS = np.random.default_rng(1).integers(0, 256, (HEIGHT, WIDTH, 4), np.uint8)


@pg.struct
class Corner:
    position: vec4


@pg.vertex
def corner(vertex: pg.Vertex) -> Corner:
    return Corner(vec4(vertex.position, 1.0))


@pg.fragment
def blue(corner: Corner) -> vec4:
    return vec4(0.2, 0.6, 1.0, 1.0)


def blurred(target: pg.TargetSpec) -> pg.Target:
    return pg.kernel(source=BLUR)(pg.Input("frame", "rgba8"), into=target)


def expected(graph: Any = blurred) -> np.ndarray[Any, Any]:
    with pg.compile(graph(pg.target("picture", "rgba8")), backend="gl", results="stored") as program:
        return program(frame=ROWS)["picture"].copy()


@pytest.mark.parametrize("isolation", ["sibling", "guard"])
def test_a_pass_may_write_over_what_it_reads(app: Application, isolation: Any) -> None:
    framebuffer = app.of_texture(app.texture(0x8058, RGBA, BYTES, ROWS))
    with pg.gl.Host.current(isolation) as host:
        program = pg.compile(blurred(pg.target("picture", "rgba8")), backend=host)
        found = host.framebuffer(framebuffer)
        program.run(frame=found, into={"picture": found})
        assert "copied on the device, since a result is written there" in program.explain()
        program.close()
    np.testing.assert_array_equal(app.pixels(framebuffer), expected())


@pytest.mark.parametrize(
    "kept", ["a texture", "a renderbuffer", "four samples", "a renderbuffer of four samples", "a rectangle", "a layer"]
)
def test_wherever_an_engine_draws(app: Application, kept: str) -> None:
    source = app.of_texture(app.texture(0x8058, RGBA, BYTES, ROWS))
    made = {
        "a texture": lambda: app.of_texture(app.texture(0x8058, RGBA, BYTES, None)),
        "a renderbuffer": lambda: app.of_renderbuffer(0x8058, source),
        "four samples": lambda: app.of_samples(0x8058, source),
        "a renderbuffer of four samples": lambda: app.of_renderbuffer(0x8058, source, 4),
        "a rectangle": lambda: app.of_texture(app.texture(0x8058, RGBA, BYTES, None, target=0x84F5), 0x84F5),
        "a layer": lambda: app.of_layer(app.layer(ROWS), 1),
    }[kept]()
    with pg.gl.Host.current() as host:
        program = pg.compile(blurred(pg.target("picture", "rgba8")), backend=host)
        program.run(frame=host.framebuffer(source), into={"picture": host.framebuffer(made)})
        # of several samples a pixel, those stay that the result does not change
        assert ("moved into" if "samples" in kept else "written in place") in program.explain()
        program.close()
    plain = app.of_texture(app.texture(0x8058, RGBA, BYTES, None))
    app.blit(made, plain, False)
    np.testing.assert_array_equal(app.pixels(plain), expected())


def test_only_the_part_that_is_given_is_written(app: Application) -> None:
    around = np.full((40, 50, 4), 77, np.uint8)
    framebuffer = app.of_texture(app.texture(0x8058, RGBA, BYTES, around, (50, 40)))
    with pg.gl.Host.current() as host:
        program = pg.compile(blurred(pg.target("picture", "rgba8")), backend=host)
        found = host.framebuffer(framebuffer, region=(9, 11, WIDTH, HEIGHT))
        program.run(frame=ROWS, into={"picture": found})
        program.close()
    wanted = around.copy()
    wanted[40 - 11 - HEIGHT : 40 - 11, 9 : 9 + WIDTH] = expected()
    np.testing.assert_array_equal(app.pixels(framebuffer, size=(50, 40)), wanted)


def test_draws_into_an_engines_picture_are_those_of_ours(app: Application) -> None:
    """Triangles stay top down inside: where an edge falls on a pixel must not depend on who owns the picture."""
    mesh = pg.Mesh.make(np.array([(-0.9, -0.8, 0), (0.8, -0.3, 0), (-0.2, 0.9, 0)], np.float32), np.array([(0, 1, 2)]))

    def drawn(target: pg.TargetSpec) -> pg.Target:
        return pg.draw(mesh, vertex=corner, fragment=blue, into=target)

    framebuffer = app.of_texture(app.texture(0x8058, RGBA, BYTES, ROWS))
    size = (WIDTH, HEIGHT)
    with pg.gl.Host.current() as host:
        program = pg.compile(drawn(pg.target("picture", "rgba8", size=size)), backend=host)
        program.run(into={"picture": host.framebuffer(framebuffer)})
        program.close()
    with pg.compile(drawn(pg.target("picture", "rgba8", size=size)), backend="gl", results="stored") as own:
        np.testing.assert_array_equal(app.pixels(framebuffer), own()["picture"])


@pytest.mark.parametrize(
    ("internal", "external", "tolerance"), [(0x881A, RGBA, 0), (0x8051, RGB, 0), (0x8059, RGBA, 1)]
)
def test_another_format_is_rounded_by_the_device(
    app: Application, internal: int, external: int, tolerance: int
) -> None:
    framebuffer = app.of_texture(app.texture(internal, external, FLOATS, None))
    with pg.gl.Host.current() as host:
        program = pg.compile(blurred(pg.target("picture", "rgba8")), backend=host)
        program.run(frame=ROWS, into={"picture": host.framebuffer(framebuffer)})
        program.close()
    read = np.round(app.pixels(framebuffer, FLOATS) * 255)[..., :3]
    np.testing.assert_allclose(read, expected()[..., :3], atol=tolerance)


def test_srgb_pictures_are_read_linear_and_written_encoded(app: Application) -> None:
    framebuffer = app.of_texture(app.texture(0x8C43, RGBA, BYTES, ROWS))
    half = pg.kernel(source="def half(c: Image) -> vec4: return vec4(0.5 * c[0, 0].rgb, c[0, 0].a)")

    def halved(backend: Any, **options: Any) -> pg.Program:
        graph = half(pg.Input("frame", "rgba8_srgb"), into=pg.target("picture", "rgba8_srgb"))
        return pg.compile(graph, backend=backend, **options)

    with pg.gl.Host.current() as host, halved(host) as program:
        found = host.framebuffer(framebuffer)
        assert found.color is not None and found.color.format.name == "rgba8_srgb"
        program.run(frame=found, into={"picture": found})
        plain = pg.compile(blurred(pg.target("picture", "rgba8")), backend=host)
        with pytest.raises(
            InputError, match=r"into= gives a .*: only one is sRGB-encoded; give the target format rgba8_srgb, or"
        ):
            plain.run(frame=ROWS, into={"picture": found})
        plain.close()
    with halved("gl", results="stored") as own:
        np.testing.assert_array_equal(app.pixels(framebuffer), own(frame=ROWS)["picture"])


def test_encoded_colours_in_a_format_that_does_not_say_so(app: Application) -> None:
    name = app.texture(0x8058, RGBA, BYTES, ROWS)
    with pg.gl.Host.current() as host:
        picture = host.texture(name, srgb=True)
        assert picture.format.name == "rgba8_srgb"
        with pytest.raises(InputError, match="there is no format"):
            host.texture(app.texture(0x8814, RGBA, FLOATS, None), srgb=True)


def test_results_of_other_targets_come_back_as_arrays(app: Application) -> None:
    framebuffer = app.of_texture(app.texture(0x8058, RGBA, BYTES, None))

    @pg.kernel
    def both(c: Image) -> tuple[vec4, vec4]:
        return c[0, 0], vec4(1.0) - c[0, 0]

    same, inverse = both(pg.Input("frame", "rgba8"), into=(pg.target("same", "rgba8"), pg.target("inverse", "rgba8")))
    with pg.gl.Host.current() as host:
        program = pg.compile([same, inverse], backend=host, results="stored")
        given = host.framebuffer(framebuffer)
        result = program(frame=ROWS, into={"same": given})
        np.testing.assert_array_equal(result["inverse"], 255 - ROWS)
        assert result["same"] is given.color
        program.close()
    np.testing.assert_array_equal(app.pixels(framebuffer), ROWS)


def test_temporal_effects_remember_an_engines_frames(app: Application) -> None:
    frame = pg.Input("frame", "rgba8")
    mixed = pg.kernel(source="def mixed(c: Image, old: Image) -> vec4: return mix(old[0, 0], c[0, 0], 0.25)")
    out = pg.target("picture", "rgba8")
    graph = mixed(frame, pg.previous(out), into=out)
    name = app.texture(0x8058, RGBA, BYTES, ROWS)
    target = app.of_texture(app.texture(0x8058, RGBA, BYTES, None))
    with pg.gl.Host.current() as host:
        program = pg.compile(graph, backend=host)
        for _ in range(3):
            program.run(frame=host.texture(name), into={"picture": host.framebuffer(target)})
        program.close()
    with pg.compile(graph, backend="gl", results="stored") as own:
        for _ in range(3):
            wanted = own(frame=ROWS)["picture"]
        np.testing.assert_array_equal(app.pixels(target), wanted)


def test_a_look_at_every_pass_sees_its_rows_from_the_top(app: Application) -> None:
    name = app.texture(0x8058, RGBA, BYTES, ROWS)
    target = app.of_texture(app.texture(0x8058, RGBA, BYTES, None))
    seen: list[np.ndarray[Any, Any]] = []
    with pg.gl.Host.current() as host:
        program = pg.compile(blurred(pg.target("picture", "rgba8")), backend=host)
        program.run(
            lambda _, pictures: seen.append(pictures["picture"]),
            frame=host.texture(name), into={"picture": host.framebuffer(target)},
        )  # fmt: skip
        program.close()
    np.testing.assert_array_equal(np.round(seen[0] * 255), expected())
