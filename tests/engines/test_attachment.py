"""What adapters share, in a context that stands for an engine's."""

from __future__ import annotations

import gc
import logging
import os
import re
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import pytest

import passgraph as pg
import passgraph.effects
from docs.engines.demo import functions, inverse, inverse_of
from docs.engines.play import count_objects
from passgraph.backends.gl.textures import Surface
from passgraph.effects.checked import effect
from passgraph.engines.attachment import KEPT_PROGRAMS, Attachment, Seen, View, imported
from passgraph.srgb import linear_to_srgb, srgb_to_linear
from tests.conftest import require
from tests.engines.harmless import root
from tests.offscreen import offscreen

pytestmark = pytest.mark.gl
SIZE = (9, 6)
CAMERA = pg.Camera((0.0, 0.0, 5.0), (0.0, 0.0, 0.0), near=1.0, far=9.0)


class Engine:
    """A framebuffer with a depth, drawn in a context that is current."""

    def __init__(self, context: moderngl.Context, size: tuple[int, int], internal: int | None) -> None:
        self.context = context
        self.internal = internal
        self.resize(size)

    def resize(self, size: tuple[int, int]) -> None:
        self.color = self.context.texture(size, 4, internal_format=self.internal)
        self.depth = self.context.depth_texture(size)
        self.framebuffer = self.context.framebuffer([self.color], self.depth)
        self.framebuffer.use()
        width, height = size
        numbers = np.random.default_rng(1).integers(0, 256, (height, width, 4), np.uint8)
        self.color.write(numbers[::-1].tobytes())
        self.drawn = numbers

    def clear(self, red: float, depth: float) -> None:
        self.framebuffer.clear(red, 0.0, 0.0, 1.0, depth=depth)

    def picture(self) -> Any:
        width, height = self.color.size
        return np.frombuffer(self.color.read(), np.uint8).reshape(height, width, 4)[::-1]


@contextmanager
def opened(size: tuple[int, int] = SIZE, internal: int | None = None) -> Iterator[Engine]:
    require("gl")
    with offscreen() as context:
        yield Engine(context, size, internal)


@pytest.fixture
def engine() -> Iterator[Engine]:
    with opened() as made:
        yield made


def attach(effect_: Any, **options: Any) -> Attachment:
    camera, isolation = options.pop("camera", None), options.pop("isolation", "auto")
    return Attachment("engine", effect_, options, camera=camera, isolation=isolation)


@pytest.mark.parametrize("isolation", ["sibling", "guard"])
def test_the_frame_is_changed_in_place_and_nothing_is_left(engine: Engine, isolation: str) -> None:
    before = count_objects()
    with attach(inverse, isolation=isolation) as attached:
        attached.draw()
        assert attached.error is None
        assert attached.isolation == isolation
        np.testing.assert_array_equal(engine.picture()[..., :3], inverse_of(engine.drawn[..., :3]))
    assert count_objects() == before
    once = engine.picture()
    attached.draw()
    attached.close()
    np.testing.assert_array_equal(engine.picture(), once)


def test_an_effect_that_is_not_enabled_does_nothing(engine: Engine) -> None:
    with attach(inverse) as attached:
        attached.enabled = False
        attached.draw()
        np.testing.assert_array_equal(engine.picture(), engine.drawn)


def test_other_sizes_are_planned_anew(engine: Engine) -> None:
    with attach(inverse) as attached:
        for size in (SIZE, (1, 1), (13, 2), SIZE):
            engine.resize(size)
            attached.draw()
            np.testing.assert_array_equal(engine.picture()[..., :3], inverse_of(engine.drawn[..., :3]))


def test_frames_smaller_than_the_engine_says_are_left_out(engine: Engine, caplog: pytest.LogCaptureFixture) -> None:
    """One warning for several such frames in a row, and the effect runs again where the frame fits."""
    width, height = SIZE
    sizes = [(width, height + 1), (width, height + 1), (width, height)] * 2

    def frame(host: pg.gl.Host) -> pg.gl.HostFramebuffer:
        return host.framebuffer(region=(0, 0, *sizes.pop(0)))

    with Attachment("engine", inverse, {}, frame=frame) as attached, caplog.at_level(logging.WARNING):
        for _ in range(2):
            for _ in range(2):
                attached.draw()
                np.testing.assert_array_equal(engine.picture(), engine.drawn)
            attached.draw()
            np.testing.assert_array_equal(engine.picture()[..., :3], inverse_of(engine.drawn[..., :3]))
            engine.resize(SIZE)
    assert attached.error is None
    assert [record.levelname for record in caplog.records] == ["WARNING", "WARNING"]


fog = pg.kernel(source="def fog(c: Image, d: Image, far: float) -> vec4: return vec4(vec3(d[0, 0].r / far), 1.0)")


def by_distance(frame: pg.Target, depth: pg.Target) -> pg.Target:
    return fog(frame, depth, pg.Value("reach", float), into=pg.target("fog", "rgba8"))


@pytest.mark.parametrize(
    "camera", [CAMERA, lambda: CAMERA, (CAMERA.view_matrix(), CAMERA.projection_matrix(1.5)), View.from_camera(CAMERA)]
)
def test_depth_comes_as_distances(engine: Engine, camera: Any) -> None:
    """The middle of the depth buffer is 1 / (0.5 / 1 + 0.5 / 9) = 1.8 away; nothing is at its end."""
    with attach(by_distance, camera=camera, reach=9.0) as attached:
        engine.clear(0.0, depth=0.5)
        attached.draw()
        assert attached.error is None
        assert engine.picture()[0, 0].tolist() == [51, 51, 51, 255]
        attached.set(reach=18.0)
        engine.clear(0.0, depth=0.5)
        attached.draw()
        assert engine.picture()[0, 0, 0] in (25, 26)
        engine.clear(1.0, depth=1.0)
        attached.draw()
        assert engine.picture()[0, 0, 0] == 0


NEAR, FAR = 0.5, 9.0
#: As Direct3D has it: depth 0 at near, 1 at far.
FROM_0 = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, FAR / (NEAR - FAR), NEAR * FAR / (NEAR - FAR)], [0, 0, -1, 0]])


@pytest.mark.parametrize("said", ["by OpenGL", "by the caller"])
def test_clip_space_from_0_to_1_is_asked_for_or_said(engine: Engine, said: str) -> None:
    """The number that this matrix writes for a distance of 2.25, which is half of ``reach``."""
    depth = (FAR - NEAR * FAR / 2.25) / (FAR - NEAR)
    camera = (np.eye(4), FROM_0) if said == "by OpenGL" else (np.eye(4), FROM_0, True)
    if said == "by OpenGL":
        native = functions()
        native.ClipControl(0x8CA1, 0x935F)
    with attach(by_distance, camera=camera, reach=4.5) as attached:
        engine.clear(0.0, depth)
        attached.draw()
        assert attached.error is None
        assert engine.picture()[0, 0, 0] in (127, 128)


def test_a_run_value_changes_without_planning(engine: Engine) -> None:
    planned: list[int] = []

    def counted(frame: pg.Target, share: float | pg.Value = 1.0, steps: int = 1) -> pg.Target:
        planned.append(steps)
        scaled = pg.kernel(source="def scaled(c: Image, by: float) -> vec4: return c[0, 0] * by")
        return scaled(frame, share, into=pg.target("scaled", "rgba8"))

    # The text of annotations is read, which names what is in this function.
    counted.__annotations__ = {"frame": pg.Target, "share": float | pg.Value, "steps": int}
    with attach(counted, share=0.5) as attached:
        attached.draw()
        [program] = attached._programs.values()
        attached.set(share=0.25)
        engine.clear(0.8, depth=1.0)
        attached.draw()
        assert list(attached._programs.values()) == [program]
        assert engine.picture()[0, 0, 0] == 51
        attached.set(steps=3)
        attached.draw()
        assert program not in attached._programs.values()
        assert planned[-1] == 3


@pytest.fixture
def compiled(monkeypatch: pytest.MonkeyPatch) -> list[object]:
    """What is compiled, from now on."""
    original, made = pg.compile, list[object]()
    monkeypatch.setattr(pg, "compile", lambda *given, **options: made.append(given) or original(*given, **options))
    return made


def test_views_of_several_sizes_are_planned_once_each(engine: Engine, compiled: list[object]) -> None:
    sizes = [(9, 6), (8, 4), (7, 3), (5, 5)]
    with attach(inverse) as attached:
        for size in sizes * 3:
            engine.resize(size)
            attached.draw()
            np.testing.assert_array_equal(engine.picture()[..., :3], inverse_of(engine.drawn[..., :3]))
        assert len(compiled) == len(sizes)
        for size in [(10, 2), sizes[0]]:  # the one unused for longest goes, which was the first
            engine.resize(size)
            attached.draw()
        assert len(compiled) == len(sizes) + 2
        assert len(attached._programs) == KEPT_PROGRAMS


ISF = """/*{"INPUTS": [{"NAME": "inputImage", "TYPE": "image"},
 {"NAME": "strength", "TYPE": "float", "DEFAULT": 1.0, "MIN": 0.0, "MAX": 1.0},
 {"NAME": "tint", "TYPE": "color", "DEFAULT": [1.0, 1.0, 1.0, 1.0]},
 {"NAME": "swap", "TYPE": "bool", "DEFAULT": false}]}*/
void main() {
    vec4 c = IMG_THIS_PIXEL(inputImage) * strength * tint;
    gl_FragColor = vec4(swap ? c.bgr : c.rgb, 1.0);
}"""


def test_every_uniform_of_a_shader_changes_without_planning(
    engine: Engine, compiled: list[object], tmp_path: Path
) -> None:
    """Also those that were not named when it was attached."""
    (tmp_path / "tinted.fs").write_text(ISF)
    with attach(pg.load_shader(tmp_path / "tinted.fs")) as attached:
        for values, expected in (
            ({}, (200, 100, 50)),
            ({"strength": 0.5}, (100, 50, 25)),
            ({"tint": (1.0, 0.0, 1.0, 1.0)}, (100, 0, 25)),
            ({"swap": True, "strength": 1.0}, (50, 0, 200)),
        ):
            attached.set(**values)
            engine.color.write(bytes([200, 100, 50, 255] * (SIZE[0] * SIZE[1])))
            attached.draw()
            assert attached.error is None
            assert tuple(engine.picture()[0, 0, :3]) == expected
        assert len(compiled) == 1
        with pytest.raises(pg.InputError, match=r"no value 'strenght'; it has .*strength"):
            attached.set(strenght=1.0)
        with pytest.raises(pg.InputError, match=r"from 0\.0 to 1\.0"):
            attached.set(strength=2.0)


def test_another_effect_takes_the_place_of_the_first(engine: Engine) -> None:
    half = pg.kernel(source="def half(c: Image, by: float) -> vec4: return vec4(c[0, 0].rgb * by, c[0, 0].a)")
    with attach(inverse) as attached:
        attached.draw()
        with pytest.raises(AttributeError, match="effect"):
            attached.effect = half  # type: ignore[misc]
        with pytest.raises(pg.InputError, match="no value 'much'"):
            attached.replace(inverse, much=1)
        assert attached.effect is inverse
        attached.replace(lambda frame, by: half(frame, by), by=0.5)
        engine.color.write(bytes([200, 100, 50, 255] * (SIZE[0] * SIZE[1])))
        attached.draw()
        assert attached.error is None
        assert engine.picture()[0, 0].tolist() == [100, 50, 25, 255]


def test_an_effect_may_call_the_functions_of_the_engines_device(
    engine: Engine, monkeypatch: pytest.MonkeyPatch
) -> None:
    curve = pg.kernel(source="def curve(c: Image) -> vec4: return vec4(exp2(c[0, 0].rgb) - 1.0, 1.0)")
    options = []
    compile_graph = pg.compile
    monkeypatch.setattr(
        pg, "compile", lambda *a, **named: (options.append(named["options"]), compile_graph(*a, **named))[1]
    )
    with attach(lambda frame: curve(frame)) as attached:
        attached.draw()
        assert attached.math == "exact"
        attached.math = "native"
        attached.draw()
        assert attached.error is None
        assert attached.math == "native"
        with pytest.raises(pg.InputError, match="exact, native"):
            attached.math = "fast"  # type: ignore[assignment]
    assert [each.math for each in options] == ["exact", "native"]


def test_an_effect_gets_the_camera_of_the_frame_before(engine: Engine) -> None:
    """The first frame has its own."""
    tinted = pg.kernel(source="def tinted(c: Image, by: float) -> vec4: return vec4(by, c[0, 0].gba)")

    def way(frame: pg.Target, camera: pg.Value, previous_camera: pg.Value) -> pg.Target:
        by = pg.combine(lambda now, before: (now.eye[0] - before.eye[0]) / 255.0, camera, previous_camera)
        return tinted(frame, by)

    eyes = [3.0, 10.0, 30.0]
    cameras = [replace(CAMERA, eye=(x, 0.0, 5.0), target=(x, 0.0, 0.0)) for x in eyes]
    with attach(way, camera=lambda: cameras[0]) as attached:
        seen = []
        while cameras:
            attached.draw()
            assert attached.error is None
            seen.append(int(engine.picture()[0, 0, 0]))
            cameras.pop(0)
    assert seen == [0, 7, 20]


def test_motion_blur_follows_the_engines_camera(engine: Engine) -> None:
    """A camera that stands changes no bit; one that moves by 4 pixels blurs light over 2, half of them each way."""
    pixel = 2.0 * 1.8 * np.tan(0.5 * CAMERA.vertical_fov_rad) / SIZE[1]  # at the distance that depth 0.5 stands for
    moved = replace(CAMERA, eye=(4.0 * pixel, 0.0, 5.0), target=(4.0 * pixel, 0.0, 0.0))
    cameras, seen = [CAMERA, CAMERA, moved], []
    with attach(passgraph.effects.motion_blur, camera=lambda: cameras[0], taps=8) as attached:
        while cameras:
            engine.clear(0.0, depth=0.5)
            engine.color.write(engine.drawn[::-1].tobytes())
            attached.draw()
            assert attached.error is None
            seen.append(engine.picture().astype(np.float64) / 255.0)
            cameras.pop(0)
    drawn = engine.drawn / 255.0
    np.testing.assert_array_equal(seen[0], drawn)
    np.testing.assert_array_equal(seen[1], drawn)
    light = np.pad(srgb_to_linear(drawn[..., :3]), ((0, 0), (1, 1), (0, 0)), mode="edge")
    blurred = 0.25 * light[:, :-2] + 0.5 * light[:, 1:-1] + 0.25 * light[:, 2:]
    np.testing.assert_allclose(seen[2][..., :3], linear_to_srgb(blurred), atol=1.5 / 255.0)


def test_history_goes_on_in_another_effect_where_targets_match(engine: Engine) -> None:
    add = pg.kernel(source="def add(c: Image, p: Image, by: float) -> vec4: return vec4(p[0, 0].rgb + by, c[0, 0].a)")

    def brighter(frame: pg.Target, by: float, name: str = "sums") -> pg.Target:
        sums = pg.target(name, "rgba32f", like=frame)
        return add(frame, pg.previous(sums), by, into=sums)

    with attach(brighter, by=0.25) as attached:
        attached.draw()
        attached.replace(lambda frame, by: brighter(frame, by), by=0.5)
        attached.draw()
        assert engine.picture()[0, 0, 0] == 191
        attached.set(by=0.0)
        attached.draw()
        assert engine.picture()[0, 0, 0] == 191
        attached.replace(lambda frame, by: brighter(frame, by, name="others"), by=0.5)
        attached.draw()
        assert attached.error is None
        assert engine.picture()[0, 0, 0] == 128


def test_a_warm_effect_compiles_nothing_in_its_first_frame(engine: Engine, compiled: list[object]) -> None:
    with attach(inverse) as attached:
        assert attached.warm_up()
        assert len(compiled) == 1
        np.testing.assert_array_equal(engine.picture(), engine.drawn)
        attached.draw()
        assert len(compiled) == 1
        np.testing.assert_array_equal(engine.picture()[..., :3], inverse_of(engine.drawn[..., :3]))
    with Attachment("engine", inverse, {}, frame=lambda host: None) as attached:
        assert not attached.warm_up()
    engine.context.framebuffer([engine.color]).use()
    with attach(by_distance, reach=9.0) as attached, pytest.raises(pg.InputError, match="the frame has none"):
        attached.warm_up()


def test_warming_up_runs_every_pass_and_keeps_no_history(engine: Engine) -> None:
    def brighter(frame: pg.Target) -> pg.Target:
        sums = pg.target("sums", "rgba32f", like=frame)
        add = pg.kernel(source="def add(c: Image, p: Image) -> vec4: return vec4(p[0, 0].rgb + 0.25, c[0, 0].a)")
        return add(frame, pg.previous(sums), into=sums)

    with attach(brighter) as attached:
        assert attached.warm_up()
        np.testing.assert_array_equal(engine.picture(), engine.drawn)
        attached.draw()
        assert engine.picture()[0, 0, 0] == 64


def test_planning_anew_says_what_it_cost(engine: Engine, caplog: pytest.LogCaptureFixture) -> None:
    def repeated(frame: pg.Target, times: int = 1) -> pg.Target:
        half = pg.kernel(source="def half(c: Image) -> vec4: return c[0, 0] * 0.5")
        for number in range(times):
            frame = half(frame, into=pg.target(f"half{number}"))
        return frame

    with attach(repeated) as attached, caplog.at_level(logging.INFO, "passgraph.engines"):
        attached.draw()
        assert not caplog.records
        attached.set(times=2)
        attached.draw()
        assert re.search(r"planned and compiled in \d+ ms", caplog.text)


def test_names_that_the_effect_does_not_have_are_refused(engine: Engine) -> None:
    with pytest.raises(pg.InputError, match="engine: the effect has no value 'far'; it has reach"):
        attach(by_distance, far=3.0)
    with (
        attach(by_distance, camera=CAMERA) as attached,
        pytest.raises(pg.InputError, match="has no value 'far'; it has reach"),
    ):
        attached.set(far=3.0)


def test_numbers_outside_of_ranges_are_refused_before_a_frame(engine: Engine) -> None:
    def own(frame: pg.Target, share: float | pg.Value = 0.5) -> pg.Target:
        text = "def own(c: Image, share: Annotated[float, Range(0, 1)]) -> vec4: return c[0, 0] * share"
        made: pg.Target = pg.kernel(source=text)(frame, share, into=pg.target("own", "rgba8"))
        return made

    for effect_, name, right, wrong, words in (
        (passgraph.effects.bloom, "intensity", 1.0, -1.0, "bloom: intensity must be 0 or more, got -1.0"),
        (passgraph.effects.occluded, "radius", 1.0, 0.0, "occluded: radius must be above 0, got 0.0"),
        (own, "share", 1.0, 2.0, "kernel own, parameter 'share' must be 0 to 1, got 2"),
    ):
        with pytest.raises(pg.InputError, match=re.escape(words)):
            attach(effect_, camera=CAMERA, **{name: wrong})
        with attach(effect_, camera=CAMERA, **{name: right}) as attached:
            with pytest.raises(pg.InputError, match=re.escape(words)):
                attached.set(**{name: wrong})
            attached.draw()
            assert attached.error is None, attached.error


def test_what_an_effect_raises_when_it_is_planned_comes_from_attach() -> None:
    with pytest.raises(pg.GraphError, match="the effect must return the target of its last pass, got 3"):
        attach(lambda frame: 3)
    with pytest.raises(pg.InputError, match="the effect"):
        attach(3)
    with pytest.raises(pg.InputError, match=r"camera= takes a pg\.Camera, \(view, projection\) .*got 3"):
        attach(inverse, camera=3)


def test_an_effect_without_its_camera_is_switched_off_and_says_how_to_mend_it(
    engine: Engine, caplog: pytest.LogCaptureFixture
) -> None:
    with attach(by_distance, reach=9.0) as attached, caplog.at_level(logging.ERROR):
        attached.draw()
        attached.draw()
        assert not attached.enabled
        assert "the engine has no camera that could be asked; give camera=" in str(attached.error)
        assert len(caplog.records) == 1
        np.testing.assert_array_equal(engine.picture(), engine.drawn)
        attached.enabled = True
        assert attached.error is None
        attached.draw()
        assert len(caplog.records) == 2


def test_what_is_no_error_of_ours_is_caught_too(engine: Engine, caplog: pytest.LogCaptureFixture) -> None:
    def camera() -> pg.Camera:
        raise ZeroDivisionError("the caller's own")

    with attach(by_distance, reach=9.0, camera=camera) as attached, caplog.at_level(logging.ERROR):
        attached.draw()
        assert isinstance(attached.error, ZeroDivisionError)
        assert caplog.records[0].exc_info is not None  # where it came from
        np.testing.assert_array_equal(engine.picture(), engine.drawn)


#: What some effects need beside the frame.
NEEDED = {"color_transform": {"src": "sRGB - Texture", "display": "sRGB - Display"}}
#: One takes a mask, the others make pictures of another size.
NOT_IN_ENGINES = ("depth_aware_blur", "fsr1", "resize")
FRAMES = "What it returns is written over the frame."
library = {name: getattr(passgraph.effects, name) for name in passgraph.effects.__all__}


@pytest.mark.sampled
@pytest.mark.parametrize("name", [name for name, value in library.items() if hasattr(value, "effect")])
def test_effects_of_the_library_take_frames_or_say_that_they_take_none(engine: Engine, name: str) -> None:
    """Those that the page for engines lists do."""
    listed = (root / "docs" / "engines.md").read_text().split(FRAMES)[1].split("One of your own")[0]
    if library[name].effect.takes.startswith("picture"):
        assert f"`{name}`" in listed or name in NOT_IN_ENGINES
        with attach(library[name], camera=CAMERA, **NEEDED.get(name, {})) as attached:
            if name in ("color_transform", "depth_of_field", "motion_blur", "occluded", "vignette"):
                attached.draw()
            assert attached.error is None
    else:
        assert f"`{name}`" not in listed
        with pytest.raises(pg.InputError, match=r"engine: .* of passgraph's, and an engine has frames"):
            attach(library[name])


def test_the_effect_of_the_page_for_engines(engine: Engine) -> None:
    tinted = pg.kernel(source="def tinted(c: Image, tint: vec3) -> vec4: return vec4(c[0, 0].rgb * tint, c[0, 0].a)")
    with attach(lambda frame: tinted(frame, pg.Value("tint", pg.vec3)), tint=(1.0, 0.5, 0.25)) as attached:
        engine.color.write(bytes([200, 200, 200, 255] * (SIZE[0] * SIZE[1])))
        attached.draw()
        assert attached.error is None
        assert engine.picture()[0, 0].tolist() == [200, 100, 50, 255]


@effect("halved-light", linear=True)
def halved_light(frame: pg.Target) -> pg.Target:
    """Half the light."""
    half = pg.kernel(source="def half(c: Image) -> vec4: return vec4(c[0, 0].rgb * 0.5, c[0, 0].a)")
    return half(frame)


@pytest.mark.parametrize("internal", [None, 0x8C43], ids=["rgba8", "srgb8_alpha8"])
def test_effects_in_linear_light_get_it_and_are_stored_encoded(internal: int | None) -> None:
    """0.8 in sRGB is 0.6038 of light; half of that is 0.5857 in sRGB."""
    with opened(internal=internal) as engine:
        with attach(halved_light) as attached:
            engine.color.write(bytes([204, 0, 255, 77] * (SIZE[0] * SIZE[1])))
            attached.draw()
            assert attached.error is None
        red, green, blue, alpha = engine.picture()[0, 0].tolist()
        assert (red, green, blue, alpha) == (149, 0, 188, 77)


def test_an_engine_s_new_context_is_followed() -> None:
    with ExitStack() as engines:
        engines.enter_context(opened())
        with attach(inverse) as attached:
            attached.draw()
            second = engines.enter_context(opened((7, 5)))
            attached.draw()
            assert attached.error is None
            np.testing.assert_array_equal(second.picture()[..., :3], inverse_of(second.drawn[..., :3]))


def test_views_are_made_anew_where_matrices_change() -> None:
    seen = Seen()
    view, projection = CAMERA.view_matrix(), CAMERA.projection_matrix(1.5)
    one = seen.by(view, projection)
    assert seen.by(view.copy(), projection) is one
    other = pg.Camera((0.0, 0.0, 6.0), (0.0, 0.0, 0.0), near=1.0, far=9.0)
    assert seen.by(other.view_matrix(), projection).camera.eye == (0.0, 0.0, 6.0)


def test_an_engine_that_is_not_installed_is_named() -> None:
    with pytest.raises(pg.DeviceMissingError, match=r"no-such-engine is not installed.*pip install no-such-engine"):
        imported("no_such_engine", "no-such-engine")


brighter = pg.kernel(source="def brighter(c: Image) -> vec4: return vec4(min(2.0 * c[0, 0].rgb, vec3(1.0)), 1.0)")


def doubled(frame: pg.Target) -> pg.Target:
    return brighter(frame, into=pg.target("brighter", "rgba8"))


def doubled_of(picture: Any) -> Any:
    return np.minimum(2 * picture.astype(int), 255).astype(np.uint8)


@pytest.mark.parametrize("isolations", [("sibling", "guard"), ("guard", "sibling"), ("sibling", "sibling")])
@pytest.mark.parametrize("order", [1, -1])
def test_two_effects_on_one_frame_run_in_the_order_of_their_hooks(
    engine: Engine, isolations: tuple[str, str], order: int
) -> None:
    kinds = [(inverse, inverse_of), (doubled, doubled_of)][::order]
    before, wanted = count_objects(), engine.drawn[..., :3]
    both = [attach(kind, isolation=isolation) for (kind, _), isolation in zip(kinds, isolations, strict=True)]
    for attached, (_, of) in zip(both, kinds, strict=True):
        attached.draw()
        assert attached.error is None
        wanted = of(wanted)
    np.testing.assert_array_equal(engine.picture()[..., :3], wanted)
    for attached in both:
        attached.close()
    assert count_objects() == before


def test_an_effect_that_is_closed_while_it_runs_ends_with_its_frame(engine: Engine) -> None:
    def camera() -> pg.Camera:
        attached.draw()  # a frame that is drawn within the frame goes without
        attached.close()
        return CAMERA

    before = count_objects()
    attached = attach(by_distance, camera=camera, reach=9.0)
    engine.clear(0.0, depth=0.5)
    attached.draw()
    assert attached.error is None
    assert engine.picture()[0, 0].tolist() == [51, 51, 51, 255]
    assert count_objects() == before
    engine.clear(0.0, depth=0.5)
    attached.draw()
    assert engine.picture()[0, 0, 0] == 0


def test_a_minimised_window_s_frames_are_left_out(engine: Engine) -> None:
    class Minimised:
        """What a window is while it has no pixels."""

        size = SIZE

        def frame(self, host: Any) -> Any:
            if self.size == (0, 0):
                return host._picture(Surface("window"), self.size, None, "bottom", False)
            return host.framebuffer(srgb=False)

    window = Minimised()
    with Attachment("engine", inverse, {}, frame=window.frame) as attached:
        attached.draw()
        once = engine.picture()
        window.size = (0, 0)
        attached.draw()
        np.testing.assert_array_equal(engine.picture(), once)
        assert attached.enabled and attached.error is None
        window.size = SIZE
        attached.draw()
        np.testing.assert_array_equal(engine.picture()[..., :3], inverse_of(once[..., :3]))


def filled(frame: pg.Target, level: int) -> pg.Target:
    kernel = pg.kernel(source="def filled(c: Image, by: float) -> vec4: return 0.0 * c[0, 0] + vec4(by)")
    return kernel(frame, level / 255, into=pg.target("filled", "rgba8"))


@pytest.mark.parametrize("done", ["set", "close"])
def test_another_thread_may_set_or_close_while_a_frame_is_planned(engine: Engine, done: str) -> None:
    planning, is_set = threading.Event(), threading.Event()

    def told(frame: pg.Target, level: int = 1) -> pg.Target:
        if threading.current_thread() is drawing and started:
            planning.set()
            is_set.wait(10.0 if done == "set" else 0.1)  # closing waits for the frame
        return filled(frame, level)

    def other() -> None:
        planning.wait(10.0)
        if done == "set":
            attached.set(level=77)
        else:
            attached.close()
        is_set.set()

    before, drawing, started = count_objects(), threading.current_thread(), False
    attached = attach(told, level=9)
    thread = threading.Thread(target=other)
    thread.start()
    started = True
    attached.draw()
    assert engine.picture()[0, 0, 0] == 9
    thread.join()
    attached.draw()
    assert attached.error is None
    assert engine.picture()[0, 0, 0] == (77 if done == "set" else 9)
    attached.close()
    assert count_objects() == before


@pytest.mark.slow
@pytest.mark.parametrize("isolation", ["sibling", "guard"])
def test_attaching_and_closing_keeps_nothing(engine: Engine, isolation: str) -> None:
    def some(count: int) -> tuple[list[int], int, int]:
        for _ in range(count):
            with attach(inverse, isolation=isolation) as attached:
                attached.draw()
                assert attached.error is None
        gc.collect()
        return count_objects(), len(os.listdir("/proc/self/fd")), threading.active_count()

    before = some(2)
    assert some(20) == before


def test_an_effect_that_fails_in_a_later_frame_leaves_it_and_may_be_tried_again(engine: Engine) -> None:
    seen: list[pg.Camera] = []

    def camera() -> pg.Camera:
        seen.append(CAMERA)
        if len(seen) == 3:
            raise RuntimeError("the third")
        return CAMERA

    with attach(by_distance, camera=camera, reach=9.0) as attached:
        for changed in (True, True, False, False):
            engine.clear(0.0, depth=0.5)
            attached.draw()
            assert (engine.picture()[0, 0, 0] == 51) == changed
        assert str(attached.error) == "the third"
        attached.enabled = True
        attached.draw()
        assert attached.error is None and engine.picture()[0, 0, 0] == 51
