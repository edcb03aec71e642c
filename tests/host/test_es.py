"""Hosts in OpenGL ES: what holds in desktop OpenGL holds here, and what a context lacks is refused by its name.

Mesa makes contexts of 3.2; `test_older_versions_and_fewer_extensions` runs these tests again in processes whose driver
is told to be less.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.backends.base import Backend
from passgraph.backends.registry import open_backend
from passgraph.errors import BackendError, DeviceMissingError
from passgraph.formats import FORMATS
from passgraph.verify.conformance import Case, judge
from tests.conformance.choice import CASES
from tests.host.application import BYTES, FLOATS, HEIGHT, KEPT, RGBA, WIDTH
from tests.host.es import EsApplication, make_es_hostile
from tests.host.gl_state import Dump, State, differences, objects
from tests.host.test_conformance import FIRST, LONG, BottomUpHost
from tests.host.test_reading import ISOLATIONS, READERS, of_host, read_program
from tests.host.test_writing import ROWS, blue, blurred, corner

pytestmark = pytest.mark.gl

#: Where the driver is told to be less, its desktop OpenGL is too little for a context of ours.
IS_TOLD = "MESA_EXTENSION_OVERRIDE" in os.environ
OWN = "numpy" if IS_TOLD else "gl"
SIZE = (WIDTH, HEIGHT)
KINDS = [name for name in KEPT if name != "a rectangle"]
MESH = pg.Mesh.make([(-0.9, -0.8, 0), (0.8, -0.3, 0), (-0.2, 0.9, 0)], [(0, 1, 2)])


@dataclass
class Place:
    """An application, a host in its context, and programs that are compiled once."""

    app: EsApplication
    host: pg.gl.Host
    programs: dict[str, pg.Program]

    def program(self, name: str, make: Any) -> pg.Program:
        if name not in self.programs:
            self.programs[name] = make()
        return self.programs[name]


@pytest.fixture(scope="module", params=ISOLATIONS)
def place(request: pytest.FixtureRequest) -> Iterator[Place]:
    app = EsApplication()
    with pg.gl.Host.current(request.param) as host:
        made = Place(app, host, {})
        yield made
        for program in made.programs.values():
            program.close()
    app.close()


@pytest.fixture
def app() -> Iterator[EsApplication]:
    made = EsApplication()
    yield made
    made.close()


def lean(has: Any, *names: str) -> Any:
    """Capabilities without some extensions, of a version that needs them."""
    return replace(has, version=(3, 0), extensions=has.extensions - set(names))


def blur() -> pg.Target:
    return blurred(pg.target("picture", "rgba8"))


@cache
def expected() -> Any:
    with pg.compile(blur(), backend=OWN, results="stored") as program:
        return program(frame=ROWS)["picture"].copy()


# Reading


@pytest.mark.sampled
@pytest.mark.parametrize("name", KINDS)
def test_whatever_an_engine_keeps_its_picture_in(place: Place, name: str) -> None:
    has = place.app.gl.has
    if (name == "a texture of four samples" and has.version < (3, 1)) or (name == "RG16" and has.not_kept()):
        pytest.skip("not in this context")
    kept = KEPT[name](place.app)
    beside = place.program("beside", lambda: read_program(READERS["beside"], "mirror", place.host))
    own = place.program("own beside", lambda: read_program(READERS["beside"], "mirror", OWN))
    picture = of_host(place.app, place.host, kept, size=SIZE)
    assert (picture.size, picture.format.name) == (SIZE, kept.format)
    tolerance = 0.0 if kept.format.endswith("f") and not kept.depth and name != "10 bits" and OWN == "gl" else 2e-6
    np.testing.assert_allclose(
        beside(frame=picture)["out"], own(frame=kept.values)["out"], rtol=2e-6 if IS_TOLD else 0, atol=tolerance
    )


@pytest.mark.sampled
@pytest.mark.parametrize("reader", READERS)
def test_the_bits_are_those_of_an_array(place: Place, reader: str) -> None:
    whole = np.random.default_rng(2).normal(0, 1, (32, 64, 4)).astype(np.float32)
    picture = place.host.texture(
        place.app.texture(0x8814, RGBA, FLOATS, whole, (64, 32)), region=(7, 14, 19, 13), size=(64, 32)
    )
    with read_program(READERS[reader], "repeat", place.host) as program:
        got = program(frame=picture)["out"]
    with read_program(READERS[reader], "repeat", OWN) as program:
        wanted = program(frame=np.ascontiguousarray(whole[5:18, 7:26]))["out"]
    np.testing.assert_allclose(got, wanted, rtol=0, atol=1e-5 if IS_TOLD else 0)


def test_a_part_of_several_samples(place: Place) -> None:
    kept = KEPT["a renderbuffer of four samples"](place.app)
    same = place.program("same", lambda: pg.compile(same_graph(), backend=place.host, results="stored"))
    got = same(frame=of_host(place.app, place.host, kept, region=(5, 3, 11, 7), size=SIZE))["picture"]
    np.testing.assert_array_equal(got, np.round(kept.values * 255)[HEIGHT - 10 : HEIGHT - 3, 5:16])


def test_what_changes_in_a_part_of_several_samples_is_written(place: Place) -> None:
    """A result that is what the picture holds, but for one row."""
    app, host = place.app, place.host
    kept, region = KEPT["a renderbuffer of four samples"](app), (5, 3, 11, 7)
    wanted = np.round(kept.values * 255).astype(np.uint8)
    rows = wanted[HEIGHT - 10 : HEIGHT - 3, 5:16].copy()
    rows[2] = 255 - rows[2]
    wanted[HEIGHT - 8, 5:16] = rows[2]
    same = place.program("same", lambda: pg.compile(same_graph(), backend=place.host, results="stored"))
    into = host.framebuffer(kept.framebuffer, region=region, size=SIZE)
    same.run(frame=np.ascontiguousarray(rows), into={"picture": into})
    plain = app.of_texture(app.texture(0x8058, RGBA, BYTES, None))
    app.blit(kept.framebuffer, plain, False)
    np.testing.assert_array_equal(app.pixels(plain), wanted)


def same_graph(format_: str = "rgba8") -> pg.Target:
    same = pg.kernel(source="def same(c: Image) -> vec4: return c[0, 0]")
    return same(pg.Input("frame", format_), into=pg.target("picture", format_))


def test_depth_comes_back_from_draws(place: Place) -> None:
    """OpenGL ES reads no depth; drawn into, it comes back through a pass."""

    def drawn(backend: Any) -> Any:
        target = pg.draw(
            MESH, vertex=corner, fragment=blue, into=pg.target("picture", "rgba8"),
            depth=pg.target("depth", "depth32f_stencil8"),
        )  # fmt: skip
        with pg.compile([target, target.depth], backend=backend, size=SIZE) as program:
            result = program()
            return result["picture"].copy(), result["depth"].copy()

    for got, wanted in zip(drawn(place.host), drawn(OWN), strict=True):
        np.testing.assert_array_equal(got, wanted)


@pytest.mark.sampled
@pytest.mark.parametrize("format_", ["r8", "rg8", "rgb8", "rgb8_srgb", "rgba16", "rgb16", "r16f", "rgb16f", "rgb32f"])
def test_arrays_of_every_kind_go_in_and_come_back(place: Place, format_: str) -> None:
    stored = FORMATS[format_]
    if stored.number in place.host.limits.not_written:
        pytest.skip("not in this context")
    letters = "rgba"[: stored.channels]
    type_ = "float" if stored.channels == 1 else f"vec{stored.channels}"
    same = pg.kernel(source=f"def same(c: Image) -> {type_}: return c[0, 0].{letters}")
    random = np.random.default_rng(4)
    shape = (HEIGHT, WIDTH, stored.channels)
    if stored.steps:
        rows: Any = random.integers(0, stored.steps + 1, shape).astype(stored.number)
    else:
        rows = random.normal(0, 9, shape).astype(stored.number)
    graph = same(pg.Input("frame", format_), into=pg.target("picture", format_))
    with pg.compile(graph, backend=place.host, results="stored") as program:
        np.testing.assert_array_equal(program(frame=rows)["picture"], rows)
        strided = np.zeros((HEIGHT, 2 * WIDTH, stored.channels), stored.number)[:, 3 : 3 + WIDTH]
        np.testing.assert_array_equal(program(frame=rows, into={"picture": strided})["picture"], rows)
    if not stored.srgb:
        with pg.compile(graph, backend=place.host) as program:  # values go through a pass that quantises them
            values = np.tile(rows / np.float32(stored.steps or 1), (24, 2, 1)).astype(np.float32)
            np.testing.assert_array_equal(program(frame=values)["picture"], values)


# Writing


@pytest.mark.parametrize(
    "kept", ["a texture", "a renderbuffer", "four samples", "a renderbuffer of four samples", "a layer", "the window"]
)
def test_wherever_an_engine_draws(place: Place, kept: str) -> None:
    app, host = place.app, place.host
    if kept == "four samples" and app.gl.has.version < (3, 1):
        pytest.skip("not in this context")
    source = app.of_texture(app.texture(0x8058, RGBA, BYTES, ROWS))
    target = {
        "a texture": lambda: app.of_texture(app.texture(0x8058, RGBA, BYTES, None)),
        "a renderbuffer": lambda: app.of_renderbuffer(0x8058, source),
        "four samples": lambda: app.of_samples(0x8058, source),
        "a renderbuffer of four samples": lambda: app.of_renderbuffer(0x8058, source, 4),
        "a layer": lambda: app.of_layer(app.layer(ROWS), 1),
        "the window": lambda: app.window(np.zeros_like(ROWS)),
    }[kept]()
    program = place.program("blur", lambda: pg.compile(blur(), backend=host))
    program.run(frame=host.framebuffer(source, size=SIZE), into={"picture": host.framebuffer(target, size=SIZE)})
    assert ("moved into" if "samples" in kept else "written in place") in program.explain()
    if "samples" in kept:
        plain = app.of_texture(app.texture(0x8058, RGBA, BYTES, None))
        app.blit(target, plain, False)
        target = plain
    np.testing.assert_array_equal(app.pixels(target), expected())


@pytest.mark.parametrize("where", ["a texture", "the window"])
def test_a_pass_may_write_over_what_it_reads(place: Place, where: str) -> None:
    app, host = place.app, place.host
    target = app.window(ROWS) if where == "the window" else app.of_texture(app.texture(0x8058, RGBA, BYTES, ROWS))
    found = host.framebuffer(target, size=None if where == "the window" else SIZE)
    place.program("blur", lambda: pg.compile(blur(), backend=host)).run(frame=found, into={"picture": found})
    np.testing.assert_array_equal(app.pixels(target), expected())


def test_draws_into_an_engines_picture_are_those_of_ours(place: Place) -> None:
    app, host = place.app, place.host
    graph = pg.draw(MESH, vertex=corner, fragment=blue, into=pg.target("picture", "rgba8"))
    target = app.of_texture(app.texture(0x8058, RGBA, BYTES, ROWS))
    with pg.compile(graph, backend=host, size=SIZE) as program:
        program.run(into={"picture": host.framebuffer(target, size=SIZE)})
    with pg.compile(graph, backend=OWN, size=SIZE, results="stored") as own:
        np.testing.assert_array_equal(app.pixels(target), own()["picture"])


@pytest.mark.parametrize("said", [None, False])
def test_srgb_pictures_keep_their_numbers(place: Place, said: bool | None) -> None:
    """Also where the device decodes all that is read, and encodes all that is written; ``said``: take them as plain."""
    app, host = place.app, place.host
    rows = ROWS.copy()
    rows.reshape(-1)[:1024] = np.repeat(np.arange(256), 4)
    target = app.of_texture(app.texture(0x8C43, RGBA, BYTES, rows))
    found = host.framebuffer(target, size=SIZE, srgb=said)
    assert found.color is not None
    name = "rgba8_srgb" if said is None else "rgba8"
    assert found.color.format.name == name
    turned = pg.kernel(source="def turned(c: Image) -> vec4: return vec4(c[0, 0].gbr, c[0, 0].a)")
    with pg.compile(turned(pg.Input("frame", name), into=pg.target("picture", name)), backend=host) as program:
        program.run(frame=found, into={"picture": found})
    np.testing.assert_array_equal(app.pixels(target), rows[..., [1, 2, 0, 3]])


# Leaving the engine alone


@pytest.mark.parametrize("isolation", ISOLATIONS)
def test_all_state_and_all_objects_are_as_they_were(app: EsApplication, isolation: Any) -> None:
    source, target = (app.of_texture(app.texture(0x8058, RGBA, BYTES, ROWS)) for _ in range(2))
    depth, samples = (
        KEPT[name](app) for name in ("depth 24 stencil 8 in a renderbuffer", "a renderbuffer of four samples")
    )
    make_es_hostile(app)
    dump, own = Dump(app.gl), objects(app.gl)
    before = dump()
    drawn = pg.draw(
        MESH, vertex=corner, fragment=blue, into=pg.target("picture", "rgba8"), cull="back",
        depth=pg.target("depth", "depth32f_stencil8"), depth_compare="less_equal",
        stencil=pg.Stencil(compare="always", reference=3, passed="replace"), blend=pg.Blend("source_alpha", "one"),
        polygon_offset=(1.0, 2.0),
    )  # fmt: skip
    shown = pg.kernel(source="def shown(d: Image) -> vec4: return vec4(d[0, 0].r)")
    with pg.gl.Host.current(isolation) as host:
        with pg.compile(blur(), backend=host) as program:
            into = {"picture": host.framebuffer(target, size=SIZE)}
            for framebuffer in (source, target, samples.framebuffer):
                program.run(frame=host.framebuffer(framebuffer, size=SIZE), into=into)
            got = program(frame=ROWS)["picture"]
        with pg.compile(drawn, backend=host, size=SIZE) as program:
            program.run(into=into)
        with pg.compile(shown(pg.Input("d"), into=pg.target("picture", "rgba8")), backend=host) as program:
            program(d=of_host(app, host, depth, size=SIZE))
    assert not differences(before, dump())
    assert objects(app.gl) == own
    np.testing.assert_array_equal(np.round(got * 255), expected())


# Conformance


@pytest.fixture(scope="module", params=["sibling", pytest.param("guard", marks=pytest.mark.slow)])
def engine(request: pytest.FixtureRequest) -> Iterator[tuple[list[Backend], Dump, State]]:
    app = EsApplication()
    with open_backend("reference") as reference, BottomUpHost.current(request.param) as host:
        make_es_hostile(app)
        dump = Dump(app.gl)
        yield [reference, host], dump, dump()
    app.close()


#: Of the first of each kind, what compiles and runs in a moment, and a draw that does.
SHORT = {"draws/pictures and parameters"} | {
    case.id for case in CASES if case.id in FIRST and not case.name.startswith((*LONG, "the last", "dirty", "bloom"))
}


@pytest.mark.sampled
@pytest.mark.parametrize(
    "case",
    [pytest.param(case, marks=[] if case.id in SHORT else [pytest.mark.slow]) for case in CASES if case.quick],
    ids=lambda case: case.id,
)
def test_every_case_in_an_engines_context(case: Case, engine: tuple[list[Backend], Dump, State]) -> None:
    backends, dump, before = engine
    faults = [str(verdict) for verdict in judge(case, backends) if verdict.outcome != "passed"]
    assert not faults, "\n".join(faults)
    assert not differences(before, dump())


# What is lacking


#: What the context has not → a graph, and what is said at compile time.
LACKING: dict[str, tuple[tuple[str, ...], Any, str]] = {
    "floats": (
        ("GL_EXT_color_buffer_float",),
        lambda: same_graph("rgba32f"),
        "target 'picture' is rgba32f; .* no target of that format, which takes GL_EXT_color_buffer_float",
    ),
    "halves": (
        ("GL_EXT_color_buffer_float", "GL_EXT_color_buffer_half_float"),
        lambda: same_graph("rgba16f"),
        "target 'picture' is rgba16f; .* which takes GL_EXT_color_buffer_half_float",
    ),
    "shorts": (
        ("GL_EXT_texture_norm16",),
        lambda: pg.kernel(source="def same(c: Image) -> vec4: return c[0, 0]")(
            pg.Input("frame", "rgba16"), into=pg.target("picture", "rgba8")
        ),
        "input 'frame' is rgba16; .* no picture of that format, which takes GL_EXT_texture_norm16",
    ),
    "blended floats": (
        ("GL_EXT_float_blend",),
        lambda: pg.draw(
            MESH, vertex=corner, fragment=blue, into=pg.target("picture", "rgba32f"), blend=pg.Blend("one", "one")
        ),
        "blends into rgba32f, which takes GL_EXT_float_blend.* such as rgba16f",
    ),
}


@pytest.mark.parametrize("name", LACKING)
def test_what_the_context_lacks_is_refused_by_its_name(
    app: EsApplication, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    names, graph, said = LACKING[name]
    from passgraph.backends.gl import gl_functions

    asked = gl_functions.capabilities_of
    monkeypatch.setattr(gl_functions, "capabilities_of", lambda gl: lean(asked(gl), *names))
    with pg.gl.Host.current() as host, pytest.raises(BackendError, match=said):
        pg.compile(graph(), backend=host, size=SIZE).run(frame=ROWS)


def test_the_size_of_a_texture_comes_from_the_caller(app: EsApplication, monkeypatch: pytest.MonkeyPatch) -> None:
    """Before 3.1 OpenGL ES does not tell it."""
    name = app.texture(0x8058, RGBA, BYTES, ROWS)
    with pg.gl.Host.current() as host, pg.compile(same_graph(), backend=host, results="stored") as program:
        monkeypatch.setattr(host.context.gl, "GetTexLevelParameteriv", None)
        with pytest.raises(BackendError, match=rf"size of texture {name} is not known; give it as size=\(width"):
            host.texture(name)
        np.testing.assert_array_equal(program(frame=host.texture(name, size=SIZE))["picture"], ROWS)
        app.gl.delete("Texture", name)
        with pytest.raises(BackendError, match=f"there is no texture {name}"):
            host.texture(name, size=SIZE)


@pytest.mark.parametrize("isolation", ISOLATIONS)
def test_what_a_context_is_counts_and_not_what_was_asked_for(isolation: Any) -> None:
    """Programs of OpenGL ES 2 run in newer contexts where drivers make such."""
    app = EsApplication(asked=2)
    with pg.gl.Host.current(isolation) as host, pg.compile(same_graph(), backend=host, results="stored") as program:
        assert host.isolation == isolation
        picture = host.texture(app.texture(0x8058, RGBA, BYTES, ROWS), size=SIZE)
        np.testing.assert_array_equal(program(frame=picture)["picture"], ROWS)
    app.close()


def test_a_context_that_is_too_old_is_refused() -> None:
    from passgraph.backends.gl.capabilities import version_of

    for text in ("OpenGL ES 2.0 (ANGLE 2.1)", "2.1 Mesa", ""):
        with pytest.raises(DeviceMissingError, match=r"OpenGL 3.3 or OpenGL ES 3.0; request a newer one"):
            version_of(text)


#: Of these 3.0 promises none.  Without the last two no pass writes floats.
FEWER = " ".join(f"-GL_{name}" for name in (
    "OES_viewport_array", "EXT_clip_control", "OES_draw_buffers_indexed", "EXT_texture_norm16",
    "EXT_sRGB_write_control", "EXT_texture_sRGB_decode", "EXT_gpu_shader5",
))  # fmt: skip
FEWEST = f"{FEWER} -GL_EXT_float_blend -GL_EXT_color_buffer_half_float -GL_EXT_color_buffer_float"
#: Tests that need no target of floats.
WITHOUT_FLOATS = "wherever or may_write_over or srgb or all_state or part_of_several or (draws and engines_picture)"


@pytest.mark.slow
@pytest.mark.skipif(IS_TOLD, reason="this is that other process")
@pytest.mark.parametrize(
    ("version", "extensions", "which"),
    [
        ("3.0", FEWEST, WITHOUT_FLOATS),
        pytest.param("3.1", "", "not lacks", marks=pytest.mark.slow),
        pytest.param("3.0", FEWER, "not lacks", marks=pytest.mark.slow),
    ],
)
def test_older_versions_and_fewer_extensions(version: str, extensions: str, which: str) -> None:
    told = {"MESA_GLES_VERSION_OVERRIDE": version, "MESA_EXTENSION_OVERRIDE": extensions}
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", "-m", "not slow", "-k", which]
    done = subprocess.run([*command, __file__], env={**os.environ, **told}, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout[-3000:]
