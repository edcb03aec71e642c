"""Wrong uses made up by rule: every public call, each argument in turn replaced by every value that does not fit.

A call that succeeds is fine here (some values fit some arguments); what must not come out is an error that is not
ours.  `wrong_uses.py` holds those that must be refused, with their texts.
"""

from __future__ import annotations

import inspect
import wave
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, fields
from functools import cache, partial
from importlib import import_module
from tempfile import NamedTemporaryFile
from typing import Any

import numpy as np

import passgraph as pg
from passgraph.effects.checked import Choice
from passgraph.effects.effect_table import EFFECTS
from passgraph.files import Arrays, Audio, ToArrays
from passgraph.formats import FORMATS, format_named
from passgraph.graph.draw_state import DrawState
from passgraph.scene import Camera, Light, Material, Mesh, Node, Scene, Texture
from passgraph.verify.compare import compare
from passgraph.verify.conformance import cases, run
from passgraph.web import Orbit
from tests.wrong_values import FRAME, KERNELS, frame, kernel, small_scene, stage, triangle


@dataclass(frozen=True)
class Call:
    """A call that is right, of which one argument at a time is made wrong.

    ``positional`` arguments stand under their numbers' names in ``good``, before the named ones.
    """

    name: str
    function: Callable[..., Any]
    good: Mapping[str, Any] = field(default_factory=dict)
    positional: int = 0

    def __call__(self, changed: str | None = None, value: Any = None) -> Any:
        given = dict(self.good)
        if changed is not None:
            given[changed] = value
        names = list(self.good)
        first = [given.pop(name) for name in names[: self.positional]]
        return self.function(*first, **given)


def call(name: str, function: Callable[..., Any], /, positional: int = 0, **good: Any) -> Call:
    return Call(name, function, good, positional)


def _compiled(**given: Any) -> None:
    given = {"outputs": kernel("copy")(frame()), "backend": "null", **given}
    made = pg.compile(given.pop("outputs"), **given)
    made.close()


def _mixed(**given: Any) -> Any:
    return kernel("mixed")(**given)


_MIXED = {
    "gain": 1.0, "count": 2, "on": True, "tint": (1, 1, 1), "m": np.eye(3), "a": [1, 2, 3], "cells": [[1, 2], [3, 4]],
}  # fmt: skip


def _run(**given: Any) -> None:
    """Every parameter as a value of the run."""
    types = {"gain": float, "count": int, "on": bool, "tint": pg.vec3, "m": pg.mat3, "a": object, "cells": object}
    handles = {name: pg.Value(name, type_) for name, type_ in types.items()}
    with pg.compile(kernel("mixed")(frame(), **handles), "null") as program:
        program(frame=FRAME, **given)


def _set(**given: Any) -> None:
    with pg.compile(kernel("mixed")(frame(), **_MIXED), "null") as program:
        program.set(given.pop("step"), given.pop("name"), given.pop("value"))
        program(frame=FRAME)


def _override(name: str) -> Callable[..., None]:
    return lambda value: _set(step="mixed", name=name, value=value)


def _program(use: Callable[[Any], Any]) -> None:
    with pg.compile(kernel("copy")(frame()), "null") as program:
        program(frame=FRAME)
        use(program)


def _observed(observe: Any) -> None:
    _program(lambda program: program.run(observe, frame=FRAME))


def _ran(frame: Any) -> None:
    with pg.compile(kernel("copy")(pg.Input("frame")), "null") as program:
        program(frame=frame)


def _static(frame: Any) -> None:
    with pg.compile(kernel("copy")(pg.Input("frame", static=True)), "null") as program:
        program(frame=frame)


def _result(name: Any) -> None:
    _program(lambda program: program.read()[name])


def _saved(**given: Any) -> None:
    _program(lambda program: program.read().save(**given))


def _border(rule: Any) -> Any:
    return frame().border(rule)


def _values_run(**given: Any) -> None:
    lamp = pg.Value("lamp", given.pop("type"), **given)
    with pg.compile(kernel("copy")(frame()), "null") as program:
        program(frame=FRAME)
    pg.compile(kernel("lamplit")(frame(), lamp), "null").close()


def _drawn(**given: Any) -> None:
    defaults = {
        "vertex": stage("place"), "fragment": stage("paint"), "into": pg.target("color", "rgba8"),
        "depth": pg.target("depth", "depth32f_stencil8"),
    }  # fmt: skip
    geometry = given.pop("geometry")
    made = pg.draw(geometry, **{**defaults, **given})
    pg.compile(made, "null", (4, 4)).close()


class Plain:
    """A mesh of someone else: plain arrays."""

    def __init__(self, **arrays: Any) -> None:
        self.positions, self.triangles = triangle().positions, triangle().triangles
        vars(self).update(arrays)


def _array(name: str) -> Callable[..., None]:
    return lambda value: _drawn(geometry=Plain(**{name: value}))


def _tiled(**given: Any) -> None:
    sink = given.pop("sink")
    pg.tiled(sink=np.zeros_like(FRAME) if sink is FRAME else sink, progress=False, **given)


def _lazily_tiled(**given: Any) -> None:
    with pg.lazily_tiled(**given) as picture:
        picture[1:3, 2]


def _map_blocks(array: Any, by: Any) -> None:
    scaled = pg.kernel(source="def scaled(c: Image, by: float) -> vec4: return c[0, 0] * by")
    with pg.compile(scaled(pg.Input("frame"), pg.Value("by", float))) as program:
        pg.map_blocks(program, array, by=by)


@cache
def _queue() -> Any:
    import pyopencl

    return pyopencl.CommandQueue(pyopencl.create_some_context(interactive=False))


def _host(queue: Any) -> None:
    pg.opencl.Host(_queue() if queue is None else queue).close()


def _of_host(method: str, **given: Any) -> None:
    """A method of a host; memory that is None is some of the right kind."""
    import pyopencl.array

    with pg.opencl.Host(_queue()) as host:
        if method == "buffer" and given["buffer"] is None:
            given["buffer"] = pyopencl.Buffer(host.context, pyopencl.mem_flags.READ_WRITE, 8 * 4 * 4)
        if method == "picture" and given["source"] is None:
            given["source"] = pyopencl.array.zeros(host.queue, (4, 8, 4), np.uint8)
        getattr(host, method)(**given)


@cache
def _application() -> Any:
    from tests.host.application import Application

    return Application()


def _of_gl_host(method: str, **given: Any) -> None:
    """A method of a host in an engine's context, which is current for as long; a name that is None is a texture's or a
    framebuffer's."""
    from passgraph.backends.gl.context import Current
    from tests.host.application import BYTES, RGBA

    app, current = _application(), Current()
    app.enter()
    try:
        if method == "current":
            pg.gl.Host.current(**given).close()
            return
        texture = app.texture(0x8058, RGBA, BYTES, None)
        with pg.gl.Host.current() as host:
            if given["name"] is None:
                given["name"] = texture if method == "texture" else app.of_texture(texture)
            getattr(host, method)(**given)
    finally:
        current.change(current.state(), None)


@cache
def _wgpu_device() -> Any:
    from passgraph.backends.webgpu import devices

    return devices.choose(None).request_device_sync()


def _webgpu_host(device: Any) -> None:
    pg.webgpu.Host(_wgpu_device() if device is None else device).close()


def _of_webgpu_host(texture: Any, srgb: Any) -> None:
    """Describe a texture to a host; None is a texture of its device."""
    with pg.webgpu.Host(_wgpu_device()) as host:
        if texture is None:
            texture = _wgpu_device().create_texture(size=(8, 4, 1), format="rgba8unorm-srgb", usage="TEXTURE_BINDING")
        host.texture(texture, srgb=srgb)


@cache
def _audio() -> Audio:
    """A tenth of a second of silence."""
    with NamedTemporaryFile(suffix=".wav") as named, wave.open(named.name, "wb") as file:
        file.setparams((1, 2, 44100, 0, "NONE", ""))
        file.writeframes(bytes(8820))
        file.close()
        return Audio(named.name)


_FOLDER = "/nowhere"


def _load(**given: Any) -> Any:
    return pg.load(**given)


def _framed(**given: Any) -> None:
    with pg.compile(kernel("copy")(pg.Input("frame")), "null") as program:
        pg.frames(program if (one := given.pop("program")) is None else one, **given)


CALLS: list[Call] = [
    call("target", pg.target, name="t", format="rgba8", size=None, scale=None, like=None, clear=None, notes=()),
    call("Input", pg.Input, name="t", format=None, size=None, static=False, border="clamp", default=None),
    call("Target.border", _border, rule="zero"),
    call("Target.filter", frame().filter, rule="nearest", hardware=True),
    call("Target.slices", frame().slices, count=2),
    call("stacked", pg.stacked, volume=np.zeros((2, 2, 2), np.float32)),
    call("HardwareDepth", pg.HardwareDepth, near=0.1, far=100.0, reversed_z=True, orthographic=False),
    call("gl.Host.current", lambda isolation: _of_gl_host("current", isolation=isolation), isolation="guard"),
    call("gl.Host.texture", partial(_of_gl_host, "texture"), name=None, size=(23, 17), region=(1, 2, 3, 4),
         origin="top", srgb=True),
    call("gl.Host.framebuffer", partial(_of_gl_host, "framebuffer"), name=None, size=(23, 17),
         region=(1, 2, 3, 4), origin="top", srgb=True),
    call("TargetSpec", pg.TargetSpec, name="t", format=FORMATS["rgba8"], size=None, clear=None, notes=(),
         initial=(0.0,)),
    call("Target", pg.Target, spec=pg.target("t"), made_by=None, slot=0, frames_ago=1, border_rule="clamp",
         filter_rule="linear", has_levels=True, slice_count=1, hardware=True),
    call("previous", pg.previous, spec=pg.target("t"), frames_ago=2),
    call("Value", pg.Value, name="v", type=float, static=False, default=None),
    call("Value of a run", _values_run, type=object, static=False, default=None),
    call("Value.map", pg.Value("v").map, function=abs),
    call("Derived", pg.Derived, sources=(pg.Value("v"),), function=abs),
    call("Derived.map", pg.Value("v").map(abs).map, function=abs),
    call("combine", pg.combine, function=abs, first=pg.Value("v"), positional=2),
    call("format_named", format_named, name="rgba8"),
    call("kernel", pg.kernel, definition=None, source=KERNELS, name="copy"),
    call("vertex", pg.vertex, definition=None, source=KERNELS, name="place"),
    call("fragment", pg.fragment, definition=None, source=KERNELS, name="paint"),
    call("function", pg.function, definition=len, positional=1),
    call("struct", pg.struct, cls=int, positional=1),
    call("a pixel kernel", _mixed, color=frame(), **_MIXED, reach=2, base=(0, 0), into=None, name=None),
    call("a struct parameter", kernel("lamplit"), color=frame(), lamp=pg.Value("lamp", object)),
    call("graph", pg.graph, outputs=kernel("copy")(frame()), positional=1),
    call("compile", _compiled, outputs=kernel("copy")(frame()), backend="null", size=None, options=None,
                                    non_finite="error", check_finite=False),
    call("compile, several", lambda one, two: _compiled(outputs=[one, two]),
         one=kernel("copy")(frame()), two=kernel("copy")(frame("two"), name="two")),
    call("compile, by name", lambda one: _compiled(outputs={"one": one}), one=kernel("copy")(frame())),
    call("Options", pg.Options, cull=True, fuse=True, order=True, alias=True, static=True, simplify=True, math="exact"),
    call("a value of a run", _run, **_MIXED),
    call("a picture of a run", _ran, frame=FRAME),
    call("a static picture", _static, frame=FRAME),
    call("Program.set", _set, step="mixed", name="gain", value=1.0),
    *(call(f"Program.set {name}", _override(name), value=value) for name, value in _MIXED.items()),
    call("Program.read", lambda name: _program(lambda program: program.read(name)), name="copy"),
    call("Program.run", _observed, observe=None),
    call("Result", _result, name="copy"),
    call("Result.save", _saved, path=f"{_FOLDER}/x.npy", name="copy"),
    call("Blend", pg.Blend, source="one", destination="one", equation="add", source_alpha=None,
                                 destination_alpha=None, equation_alpha=None),
    call("Stencil", pg.Stencil, compare="always", reference=0, read_mask=255, write_mask=255, fail="keep",
                                     depth_fail="keep", passed="keep"),
    call("DrawState", DrawState, cull="none", depth_compare="less", depth_write=True, stencil=None, blend=(),
                                      color_mask=(), polygon_offset=(0.0, 0.0), clear_stencil=0),
    call("reduce", pg.reduce, image=frame(), how="arg_max", axis="x", channel=0, into=None, name=None),
    call("percentile", pg.percentile, image=frame(), percent=50.0, channel="luma", name=None),
    call("histogram", pg.histogram, image=frame(), bins=8, channel=0, low=0.0, high=1.0, into=None, name=None),
    call("draw", _drawn, geometry=triangle(), vertex=stage("place"), fragment=stage("paint"),
                              into=pg.target("color", "rgba8"), depth=None, stencil=None, blend=None, cull="none",
                              depth_compare="less", depth_write=True, color_mask=None, polygon_offset=(0.0, 0.0),
                              clear_stencil=0, name=None, values=None, shift=(0, 0, 0)),
    *(call(f"a mesh's {name}", _array(name), value=getattr(triangle(), name))
      for name in ("positions", "triangles", "normals", "uvs", "colors", "tangents")),
    call("load_shader", pg.load_shader, path=f"{_FOLDER}/x.glsl"),
    call("load_program", pg.load_program, folder=_FOLDER, backend="numpy", size=(4, 4), non_finite="error",
                                          check_finite=False, results="float32", memory=None),
    call("load", _load, path=f"{_FOLDER}/x.png", max_bytes=1 << 20, linear=False),
    call("files.Audio", Audio, path=f"{_FOLDER}/x.wav"),
    call("files.Audio.picture", lambda **given: _audio().picture(**given), frame=3, step=0.04, start=0.0),
    call("files.Audio.frame_count", lambda **given: _audio().frame_count(**given), rate=25),
    call("save", pg.save, path=f"{_FOLDER}/x.npy", picture=FRAME, linear=False),
    call("frames", _framed, program=None, source=Arrays([FRAME]), sink=ToArrays(), values=None, output="copy", jobs=1,
                            linear=False, resume=False, same_size=False, watch=None, client=None),
    call("to_data", pg.to_data, outputs=kernel("copy")(frame())),
    call("from_data", pg.from_data, data=pg.to_data(kernel("copy")(frame()))),
    call("frames by name", lambda one: _framed(program=None, source={"frame": one}, sink=ToArrays()),
         one=Arrays([FRAME])),
    call("tiled", _tiled, graph=kernel("copy")(pg.Input("frame")), source=FRAME, sink=FRAME, memory="1 GB", values=None,
                  dtype=None, tile=(4, 4), size=None, backend="numpy", options=None, non_finite="error", client=None),
    call("map_blocks", _map_blocks, array=FRAME, by=1.0),
    call("opencl.Host", _host, queue=None),
    call("opencl.Host.buffer", lambda **given: _of_host("buffer", **given), buffer=None, size=(8, 4), format="rgba8",
         offset=0, row_pitch=None, pixel_pitch=None, order=None, origin="top"),
    call("opencl.Host.picture", lambda **given: _of_host("picture", **given), source=None, format=None),
    call("opencl.Host.wait_for", lambda **given: _of_host("wait_for", **given), events=()),
    call("webgpu.Host", _webgpu_host, device=None),
    call("webgpu.Host.texture", _of_webgpu_host, texture=None, srgb=None),
    call("lazily_tiled", _lazily_tiled, graph=kernel("copy")(pg.Input("frame")), source=FRAME, memory="1 GB",
                                        values=None, tile=(4, 4), size=None, backend="numpy", options=None,
                                        non_finite="error"),
    call("compare", lambda **given: compare(kernel("copy")(frame()), **given),
         backends=(), size=None, progress=lambda _: None, frame=FRAME),
    call("compare, outputs", lambda outputs: compare(outputs, (), frame=FRAME), outputs=kernel("copy")(frame())),
    call("Mesh.make", Mesh.make, positions=triangle().positions, triangles=[[0, 1, 2]], normals=None, uvs=None,
                                      colors=None, name="mesh"),
    call("Mesh", Mesh, positions=triangle().positions, triangles=triangle().triangles,
                            normals=triangle().normals, uvs=triangle().uvs, colors=triangle().colors,
                            tangents=triangle().tangents, name="mesh"),
    call("Texture.make", Texture.make, pixels=np.zeros((2, 2, 4), np.uint8), color_space="srgb", name="t"),
    call("Texture", Texture, pixels=np.zeros((2, 2, 4), np.uint8), color_space="srgb", name="t"),
    call("Material", Material, name="m", base_color=(1, 1, 1, 1), base_color_texture=None, normal_texture=None,
                                    height_texture=None, height_scale=0.05, alpha_mode="opaque", alpha_cutoff=0.5,
                                    double_sided=False),
    call("Node", Node, mesh=triangle(), material=Material(), transform=np.eye(4), name="n", casts=True,
                            receives=True),
    call("Scene", Scene, nodes=(Node(triangle()),), camera=small_scene().camera, lights=(), name="s",
                              warnings=()),
    call("Scene.with_", small_scene().with_, nodes=None, camera=None, lights=None),
    call("Scene.load", Scene.load, path=f"{_FOLDER}/x.glb", ground=None, up="y"),
    call("Camera", Camera, eye=(0, 0, 5), target=(0, 0, 0), up=(0, 1, 0), vertical_fov_rad=1.0, near=0.1,
                                far=100.0),
    call("Camera.projection_matrix", small_scene().camera.projection_matrix, aspect=1.5),
    call("Camera.relative", small_scene().camera.relative, transform=np.eye(4)),
    call("Camera.framing", Camera.framing, bounds=[[-1, -1, -1], [1, 1, 1]], direction=None, aspect=1.5,
                                                vertical_fov_rad=0.7, depth_bounds=None),
    call("Camera.orbit", Camera.orbit, points=[[-1, -1, -1], [1, 1, 1]], azimuth_rad=0.1, elevation_rad=0.2,
                                       distance=None, aspect=1.5, vertical_fov_rad=0.7, depth_bounds=None),
    call("Camera.turned", small_scene().camera.turned, centre=(0, 0, 0), angle_rad=0.1),
    call("Camera.orbited", small_scene().camera.orbited, azimuth_rad=0.1, elevation_rad=0.2, distance=2.0),
    call("web.Orbit", Orbit, azimuths=8, elevations=3, distances=1),
    call("Camera.zoomed", small_scene().camera.zoomed, factor=2.0),
    call("Scene.seen_from", small_scene().seen_from, azimuth_rad=0.1, elevation_rad=0.2, distance=None, aspect=1.5,
                                                      vertical_fov_rad=0.7),
    call("Scene.turntable", small_scene().turntable, count=2, azimuth_rad=0.1, elevation_rad=0.2, distance=None,
                                                      aspect=1.5, vertical_fov_rad=0.7),
    call("Light.around", Light.directional((0, -1, 0)).around, centre=(0, 0, 0), azimuth_rad=0.1, elevation_rad=0.2),
    call("Light.reaching", Light.point((0, 2, 0)).reaching, place=(0, 0, 0)),
    call("Light", Light, kind="spot", position=(0, 0, 0), direction=(0, -1, 0), color=(1, 1, 1), intensity=1.0,
                              radius=0.0, cone_inner_rad=0.0, cone_outer_rad=0.7, name="l"),
    call("Light.directional", Light.directional, direction=(0, -1, 0), color=(1, 1, 1), intensity=1.0,
                                                      radius=0.0, name="l"),
    call("Light.point", Light.point, position=(0, 0, 0), color=(1, 1, 1), intensity=1.0, radius=0.0, name="l"),
    call("Light.spot", Light.spot, position=(0, 0, 0), direction=(0, -1, 0), color=(1, 1, 1), intensity=1.0,
                                        radius=0.0, cone_inner_rad=None, cone_outer_rad=0.7, name="l"),
    call("Light.frustum", Light.directional((0, -1, 0)).frustum, bounds=[[-1, -1, -1], [1, 1, 1]]),
    call("conformance.cases", lambda **given: list(cases(**given)), groups=["sequences"], quick=True),
    call("conformance.run", lambda **given: run(cases=[], **given), backend="null", progress=lambda *_: None),
    call("conformance.run, case", lambda case: run("null", [case]), case=next(cases(["sequences"]))),
    call("Range", pg.Range, low=0.0, high=1.0, unit="px", above=False, odd=False),
    call("Effect.parameter", EFFECTS["bloom"].parameter, name="levels"),
]  # fmt: skip


_GOOD_FLAT: dict[str, dict[str, Any]] = {
    "Window": {"left": 0, "bottom": 0, "right": 8, "top": 4},
    "Light2D": {"position": (1, 1), "color": (1, 1, 1), "radius": 2.0, "size": 0.1},
    "Wall": {"points": ((0, 0), (1, 1)), "closed": True},
    "Mover": {"position": (1, 1), "half": (1, 1), "angle_rad": 0.0},
    "World2D": {"window": None, "walls": (), "lights": (), "movers": (), "ambient": (0, 0, 0), "floor": (0, 0, 0)},
}


def _effects() -> Iterator[Call]:
    """Every function of an effect; each argument in turn, by the effect's own signature."""
    from passgraph import effects

    light2d: Any = import_module("passgraph.effects.light2d")  # by this name the effects have a function too

    first = {
        "scene": small_scene(), "frame": frame(), "color": frame(), "mask": frame(), "light": frame("light"),
        "depth": pg.Input("depth", "r32f", (8, 4)), "normals": frame("normals"), "camera": pg.Value("camera", Camera),
        "radius": 0.5, "world": light2d.World2D.shipped(), "window": light2d.Window(0, 0, 10, 10), "walls": (),
        "lights": (light2d.Light2D((1, 1)),), "size": (8, 4), "grid": np.zeros((4, 8), np.float32), "threshold": 0.5,
        "previous_camera": pg.Value("previous_camera", Camera), "number": 3,
        "ranks": (frame("objects"),), "numbers": [1.0],
        "movers": pg.Value("movers", object), "count": 2, "name": "dimmed", "casters": small_scene(),
    }  # fmt: skip
    for package in (effects, light2d):
        for name in package.__all__:
            function = getattr(package, name)
            if inspect.isclass(function) and name in ("Light2D", "Mover", "Wall", "Window", "World2D"):
                yield Call(
                    name,
                    function,
                    {**_GOOD_FLAT[name], **({"window": light2d.Window(0, 0, 8, 4)} if name == "World2D" else {})},
                )
            if inspect.isclass(function) and issubclass(function, Choice) and fields(function):
                yield Call(name, function, {field.name: getattr(function(), field.name) for field in fields(function)})
            if inspect.isfunction(function):
                parameters = inspect.signature(function).parameters.values()
                good = {
                    p.name: first.get(p.name, p.default) if p.default is inspect.Parameter.empty else p.default
                    for p in parameters
                }
                if name in ("lit", "occlusion", "moving_shadows") and package is light2d:
                    good["scene"] = frame()
                if name == "motion_blur":
                    good |= {key: first[key] for key in ("depth", "camera", "previous_camera")}
                if name == "jittered":
                    good["camera"] = small_scene().camera
                yield Call(name, function, good)


@cache
def calls() -> list[Call]:
    """Every call of the sweep."""
    return [*CALLS, *_effects()]
