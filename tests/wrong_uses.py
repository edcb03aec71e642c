"""Wrong uses and what they are told: one table.  `wrong_sweep.py` makes up thousands more by rule."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np

import passgraph as pg
from passgraph import effects
from passgraph.effects.effect_table import EFFECTS
from passgraph.scene import Camera, Light, Material, Mesh, Node, Scene, Texture
from passgraph.verify.compare import compare
from tests.wrong_sweep import CALLS
from tests.wrong_values import FRAME, frame, kernel, small_scene, triangle

#: The package; `passgraph.effects` has an effect of this name too.
light2d = import_module("passgraph.effects.light2d")


@dataclass(frozen=True)
class Wrong:
    """A use, the class of its error, and words of its text (a regular expression)."""

    use: Callable[[], Any]
    error: type[Exception]
    words: str


def good(name: str, /, **changed: Any) -> Callable[[], Any]:
    """A call of the sweep, with something changed."""
    found = next(call for call in CALLS if call.name == name)
    ((argument, value),) = changed.items()
    return lambda: found(argument, value)


def ran(picture: Any, **declared: Any) -> Callable[[], Any]:
    """A picture given to a program."""

    def use() -> None:
        with pg.compile(kernel("copy")(pg.Input("frame", **declared)), "null") as program:
            program(frame=picture)

    return use


def closed(use: Callable[[pg.Program], Any]) -> Callable[[], Any]:
    """A program that was run and closed."""

    def made() -> None:
        program = pg.compile(kernel("copy")(frame()), "null")
        program(frame=FRAME)
        program.close()
        use(program)

    return made


def within(use: Callable[[pg.Program], Any]) -> Callable[[], Any]:
    """What the observer of a run does."""

    def made() -> None:
        with pg.compile(kernel("copy")(frame()), "null") as program:
            program.run(lambda *_: use(program), frame=FRAME)

    return made


def drawn(**changed: Any) -> Callable[[], Any]:
    return good("draw", **changed)


def masked() -> Any:
    return np.ma.masked_array(FRAME, mask=np.arange(FRAME.size).reshape(FRAME.shape) == 5)


GRAPH, INPUT, BACKEND = pg.GraphError, pg.InputError, pg.BackendError
NAME = r"must be a name \(a printable string, not empty\), got"
COPY = kernel("copy")

USES: dict[str, Wrong] = {
    # compile
    "compile 3": Wrong(lambda: pg.compile(3), GRAPH, "compile takes targets that passes returned, got 3"),
    "compile text": Wrong(lambda: pg.compile("x"), GRAPH, "compile takes targets that passes returned, got 'x'"),
    "compile an array": Wrong(lambda: pg.compile(FRAME), GRAPH, "got an array of shape"),
    "compile a number by name": Wrong(lambda: pg.compile({"a": 3}), GRAPH, "targets that passes returned, got 3"),
    "compile under no name": Wrong(lambda: pg.compile({"": COPY(frame())}), GRAPH, f"name of an output {NAME} ''"),
    "a backend by number": Wrong(good("compile", backend=3), BACKEND, "backend must be a name such as 'gl' or an open"),
    "a backend without a name": Wrong(good("compile", backend=""), BACKEND, "there is no backend ''"),
    "threads in other digits": Wrong(good("compile", backend="numpy:²"), BACKEND, "number of threads .*, got '²'"),
    "options that are a mapping": Wrong(
        good("compile", options={}), GRAPH, r"options must be pg.Options\(...\), got {}"
    ),
    "an option that is no bool": Wrong(lambda: pg.Options(fuse=1), GRAPH, "options: fuse must be True or False, got 1"),
    "a check that is no bool": Wrong(
        good("compile", check_finite=1), GRAPH, "check_finite must be True or False, got 1"
    ),
    "non_finite as an array": Wrong(good("compile", non_finite=FRAME), GRAPH, "non_finite cannot be an array of shape"),
    "a size as text": Wrong(good("compile", size="8x4"), GRAPH, "the output needs a size .* got '8x4'"),
    # targets, inputs, values
    "a scale as text": Wrong(
        good("target", scale="1"), GRAPH, "target 't': scale must be a number above 0 and at most 16"
    ),
    "a scale that is NaN": Wrong(good("target", scale=float("nan")), GRAPH, "above 0 and at most 16, got nan"),
    "like text": Wrong(good("target", like="x"), GRAPH, "target 't': like must be a target that a pass returned"),
    "like a declaration": Wrong(
        good("target", like=pg.target("a")), GRAPH, "like must be a target that a pass returned"
    ),
    "a name of a number": Wrong(good("target", name=3), GRAPH, f"the name of a target {NAME} 3"),
    "a name that cannot be written": Wrong(good("target", name="\udcff"), GRAPH, f"the name of a target {NAME}"),
    "a name of two lines": Wrong(good("Input", name="a\nb"), GRAPH, f"the name of an input {NAME}"),
    "an input's name in a list": Wrong(good("Input", name=[1]), GRAPH, rf"the name of an input {NAME} \[1\]"),
    "clear to infinity": Wrong(
        good("target", clear=float("inf")), GRAPH, "clear must be a finite number within float32"
    ),
    "clear to text": Wrong(good("target", clear="red"), GRAPH, "clear must be a finite number within float32"),
    "notes as text": Wrong(
        good("target", notes="x"), GRAPH, "target 't': notes must be a list or tuple of text, got 'x'"
    ),
    "a format as a list": Wrong(good("target", format=[]), GRAPH, r"there is no format \[\]"),
    "static by number": Wrong(good("Input", static=1), GRAPH, "input 't': static must be True or False, got 1"),
    "a border as a list": Wrong(good("Input", border=[]), GRAPH, r"there is no border rule \[\]; the rules are clamp"),
    "a filter by number": Wrong(lambda: pg.Input("t").filter(1), GRAPH, "there is no filter 1; the filters are linear"),
    "half a slice": Wrong(
        lambda: pg.Input("t").slices(2.5), GRAPH, "handle of 't': slices must be a whole number from 1 to 32768"
    ),
    "a volume of one row": Wrong(
        lambda: pg.stacked([1.0]), INPUT, r"a volume must be an array \(depth, height, width\).*of shape \(1,\)"
    ),
    "history of a number": Wrong(lambda: pg.previous(3), GRAPH, "what pg.previous takes must be a target"),
    "a value's type as a number": Wrong(good("Value", type=3), GRAPH, "value 'v': type must be a class, such as float"),
    "a value mapped by a number": Wrong(lambda: pg.Value("v").map(3), GRAPH, "must be a function, got 3"),
    "a combination of numbers": Wrong(lambda: pg.combine(max, 3), GRAPH, "number 0 is 3"),
    "a graph of a number": Wrong(lambda: pg.graph(3), GRAPH, "what pg.graph takes must be a target"),
    # kernels and their arguments
    "a kernel's name as a list": Wrong(good("kernel", name=[]), GRAPH, rf"the name of a function {NAME} \[\]"),
    "a struct of a number": Wrong(lambda: pg.struct(3), pg.KernelError, "@struct marks a class statement, got 3"),
    "ragged numbers": Wrong(
        good("a pixel kernel", a=[[1], [1, 2]]), INPUT, r"'a' must be Array\[float, 3\] \(3 numbers\)"
    ),
    "what is no array": Wrong(
        good("a pixel kernel", m=object()), INPUT, r"'m' must be mat3 \(9 numbers\), got <object"
    ),
    "masked numbers": Wrong(
        good("a pixel kernel", a=np.ma.masked_array([1.0, 2, 3], [0, 1, 0])), INPUT, "fill them first"
    ),
    "complex numbers": Wrong(good("a pixel kernel", gain=1j), INPUT, r"'gain' must be float \(a number\), got 1j"),
    "too large an int": Wrong(
        good("a pixel kernel", count=2**32), INPUT, "must be int, got 4294967296; ints reach from -21"
    ),
    "too small an int": Wrong(
        good("a pixel kernel", count=-(2**31) - 1), INPUT, "must be int, got -2147483649; ints reach"
    ),
    "an int without end": Wrong(
        good("a pixel kernel", count=2**70), INPUT, "ints reach from -2147483648 to 2147483647"
    ),
    "too large a float": Wrong(
        good("a pixel kernel", gain=1e300), INPUT, r"must be float, got 1e\+300; finite floats reach"
    ),
    "too large a component": Wrong(
        good("a pixel kernel", tint=(0, -1e39, 0)), INPUT, r"must be vec3, got -1e\+39; finite"
    ),
    "a bool of 2": Wrong(good("a pixel kernel", on=2), INPUT, "must be bool, got 2; a bool is True or False"),
    "too large a constant": Wrong(
        good("a pixel kernel", reach=2**32), INPUT, "must be int, got 4294967296; ints reach"
    ),
    "too large a base": Wrong(
        good("a pixel kernel", base=(0, 1e300)), INPUT, r"must be vec2, got 1e\+300; finite floats"
    ),
    "a run's int": Wrong(
        good("a value of a run", count=2**32), INPUT, "count of pass 'mixed' must be int, got 4294967296"
    ),
    "a run's float": Wrong(
        good("a value of a run", gain=1e300), INPUT, r"gain of pass 'mixed' must be float, got 1e\+300"
    ),
    "a run's bool": Wrong(good("a value of a run", on=-1), INPUT, "on of pass 'mixed' must be bool, got -1"),
    "an int that is set": Wrong(
        good("Program.set count", value=-(2**32)), INPUT, "must be int, got -4294967296; ints reach"
    ),
    "a float that is set": Wrong(
        good("Program.set gain", value=1e300), INPUT, r"must be float, got 1e\+300; finite floats"
    ),
    "set of a number": Wrong(good("Program.set", step=3), GRAPH, f"the name of a pass {NAME} 3"),
    "set under a list": Wrong(good("Program.set", name=[]), GRAPH, rf"the name of a parameter {NAME} \[\]"),
    # pictures of a run
    "ragged rows": Wrong(ran([[1, 2], [3]]), INPUT, "input 'frame' must be an array .* of numbers, got"),
    "no array": Wrong(ran(object()), INPUT, "input 'frame' must be an array"),
    "objects": Wrong(ran(np.full((2, 2), None)), INPUT, "must be an array .* got an array of shape \\(2, 2\\), object"),
    "complex pixels": Wrong(ran(np.zeros((2, 2), complex)), INPUT, "got an array of shape \\(2, 2\\), complex128"),
    "records": Wrong(ran(np.zeros((2, 2), [("r", "f4")])), INPUT, "input 'frame' must be an array"),
    "masked pixels": Wrong(ran(masked()), INPUT, "with masked values; fill them first: .filled"),
    "a number": Wrong(ran(np.float32(1)), INPUT, "input 'frame' must be an array .* got 1.0"),
    "whole numbers of 64 bits": Wrong(ran(np.zeros((2, 2), np.int64)), INPUT, "has dtype int64; give float32"),
    "big-endian whole numbers": Wrong(ran(np.zeros((2, 2), ">u4")), INPUT, "has dtype >u4; give float32"),
    "infinite as float32": Wrong(ran(np.full((2, 2), 1e300)), INPUT, "12 of 12 values are not finite"),
    "an input that is missing": Wrong(ran(None), INPUT, "input 'frame' is missing"),
    # programs
    "read what is not there": Wrong(good("Program.read", name=[]), GRAPH, r"there is no output \[\]; there are copy"),
    "a result under a list": Wrong(good("Result", name=[]), pg.GraphError, r"there is no result \[\]; there are copy"),
    "a result that is not there": Wrong(good("Result", name="x"), KeyError, "^there is no result 'x'; there are copy$"),
    "an observer of 3": Wrong(good("Program.run", observe=3), GRAPH, "the observer of a run must be a function, got 3"),
    "read after close": Wrong(closed(lambda p: p.read()), GRAPH, "this program is closed; compile the graph again"),
    "run after close": Wrong(closed(lambda p: p.run(frame=FRAME)), GRAPH, "this program is closed; compile the graph"),
    "call after close": Wrong(closed(lambda p: p(frame=FRAME)), GRAPH, "this program is closed; compile the graph"),
    "set after close": Wrong(
        closed(lambda p: p.set("copy", "x", 1)), GRAPH, "this program is closed; compile the graph"
    ),
    "explain after close": Wrong(closed(lambda p: p.explain()), GRAPH, "this program is closed; compile the graph"),
    "plan after close": Wrong(closed(lambda p: p.plan), GRAPH, "this program is closed; compile the graph"),
    "finish after close": Wrong(closed(lambda p: p.finish()), GRAPH, "this program is closed; compile the graph"),
    "close in an observer": Wrong(
        within(lambda p: p.close()), GRAPH, "a program cannot be closed from inside its own run"
    ),
    "run in an observer": Wrong(
        within(lambda p: p.run(frame=FRAME)), GRAPH, "a program cannot be run from inside its own run"
    ),
    # draws
    "draw None": Wrong(drawn(geometry=None), GRAPH, "draw 'color' needs a mesh with positions and triangles"),
    "draw with a pixel kernel": Wrong(
        drawn(vertex=COPY), GRAPH, "needs a vertex kernel made with @pg.vertex, got <passg"
    ),
    "draw without a kernel": Wrong(lambda: pg.draw(triangle(), vertex=None), GRAPH, "needs a vertex kernel made with"),
    "a blend of 4": Wrong(drawn(blend=4), GRAPH, r"draw 'color': blend must be one of add, .*pg.Blend\(...\), got 4"),
    "a stencil of 3": Wrong(
        drawn(stencil=3), GRAPH, r"draw 'color': stencil must be pg.Stencil\(...\), got 3|stencil8"
    ),
    "clear_stencil of 1000": Wrong(drawn(clear_stencil=1000), GRAPH, "'color': clear_stencil must be .* from 0 to 255"),
    "a reference as text": Wrong(
        lambda: pg.Stencil(reference="1"), GRAPH, "stencil reference must be a whole number from"
    ),
    "a factor as a list": Wrong(lambda: pg.Blend([]), GRAPH, r"blend source factor cannot be \[\]; it is one of zero"),
    "an empty alpha equation": Wrong(lambda: pg.Blend(equation_alpha=""), GRAPH, "blend alpha equation cannot be ''"),
    "cull by a list": Wrong(
        drawn(cull=[]), GRAPH, r"draw 'color': cull cannot be \[\]; it is one of none, back, front"
    ),
    "depth_write by number": Wrong(drawn(depth_write=1), GRAPH, "depth_write must be True or False, got 1"),
    "a mask of numbers": Wrong(
        drawn(color_mask=(1, 1, 1, 0)), GRAPH, "color_mask is four bools .* got \\(1, 1, 1, 0\\)"
    ),
    "a mask of 3": Wrong(drawn(color_mask=3), GRAPH, "color_mask is four bools .* got 3"),
    "an offset of one number": Wrong(drawn(polygon_offset=(1,)), GRAPH, r"polygon_offset must be two numbers \(factor"),
    "an offset of text": Wrong(
        drawn(polygon_offset="ab"), GRAPH, "polygon_offset must be a list or tuple of two numbers"
    ),
    "values that are a list": Wrong(drawn(values=[1]), GRAPH, "draw 'color': values must be a mapping of parameters"),
    "a draw's name of 3": Wrong(drawn(name=3), GRAPH, f"the name of a draw {NAME} 3"),
    "ragged corners": Wrong(
        good("a mesh's positions", value=[[1], [1, 2]]), GRAPH, "draw 'color': positions must be an array"
    ),
    "triangles of floats": Wrong(
        good("a mesh's triangles", value=[[0.0, 1, 2]]), GRAPH, "triangles must be whole numbers"
    ),
    "normals of another length": Wrong(
        good("a mesh's normals", value=np.zeros((2, 3))), GRAPH, r"normals must be \(3, 3\), got \(2, 3\)"
    ),
    "normals that are NaN": Wrong(
        good("a mesh's normals", value=np.full((3, 3), np.nan)), GRAPH, "normals of 3 vertices are"
    ),
    "corners beyond float32": Wrong(
        good("a mesh's positions", value=np.full((3, 3), 1e39)), GRAPH, "3 vertices are NaN or"
    ),
    # scenes
    "a ragged mesh": Wrong(
        lambda: Mesh.make([[0, 0], [1]], [[0, 1, 2]]), INPUT, "positions: expected an array of shape"
    ),
    "ragged normals": Wrong(good("Mesh.make", normals=[[0, 0], [1]]), INPUT, "mesh 'mesh': normals: expected an array"),
    "normals of another mesh": Wrong(
        good("Mesh.make", normals=np.ones((2, 3))), INPUT, r"one row per vertex \(3\), got 2"
    ),
    "ragged triangles": Wrong(
        good("Mesh.make", triangles=[[0], [1, 2]]), INPUT, "triangles: expected an array of shape"
    ),
    "a mesh not checked": Wrong(
        good("Mesh", normals=None), INPUT, "mesh 'mesh': normals: expected an array .*Mesh.make"
    ),
    "a texture not checked": Wrong(
        lambda: Texture(3), INPUT, r"expected \(h, w, 4\) uint8 pixels \(pg.Texture.make checks"
    ),
    "a texture of text": Wrong(lambda: Texture.make("x"), INPUT, "texture 'texture' must be uint8 pixels"),
    "a colour of text": Wrong(
        lambda: Material(base_color="red"), INPUT, "base_color: expected four numbers in \\[0, 1\\]"
    ),
    "a texture by path": Wrong(lambda: Material(normal_texture="a.png"), INPUT, "normal_texture must be a pg.Texture"),
    "a node of None": Wrong(lambda: Node(None), INPUT, "node 'node': mesh must be a pg.Mesh, made by pg.Mesh.make"),
    "a node's material": Wrong(lambda: Node(triangle(), "red"), INPUT, "node 'node': material must be a pg.Material"),
    "a scene of meshes": Wrong(
        good("Scene", nodes=[triangle()]), INPUT, "nodes must be .* of pg.Node; number 0 is a Mesh"
    ),
    "a scene without a view": Wrong(
        good("Scene", camera=None), INPUT, "scene 's': camera must be a pg.Camera, got None"
    ),
    "lights of another kind": Wrong(
        good("Scene.with_", lights=[3]), INPUT, "lights must be .* of pg.Light; number 0 is 3"
    ),
    "an eye of text": Wrong(lambda: Camera("here", (0, 0, 0)), INPUT, "camera: eye: expected three finite numbers"),
    "near as text": Wrong(good("Camera", near="1"), INPUT, "camera: near: expected a finite number in .*, got '1'"),
    "a radius without end": Wrong(good("Light.point", radius=10**400), INPUT, "radius: expected a finite number"),
    "a cone of None": Wrong(good("Light.spot", cone_outer_rad=None), INPUT, "cone_outer_rad: expected a finite number"),
    "a scene's path": Wrong(lambda: Scene.load(3), INPUT, "must be a path \\(str or pathlib.Path\\), got 3"),
    "up of a list": Wrong(good("Scene.load", up=[]), INPUT, r"up: expected 'y' or 'z', got \[\]"),
    "a kind of a list": Wrong(lambda: Light([]), INPUT, r"kind: expected 'directional', 'point' or 'spot', got \[\]"),
    # pictures
    "load None": Wrong(lambda: pg.load(None), INPUT, "the picture to load must be a path .* got None"),
    "load 3": Wrong(lambda: pg.load(3), INPUT, "the picture to load must be a path .* got 3"),
    "load at most None": Wrong(good("load", max_bytes=None), INPUT, "max_bytes must be a whole number from 1 to"),
    "save to 3": Wrong(lambda: pg.save(3, FRAME), INPUT, "where a picture is saved must be a path .* got 3"),
    "save what is ragged": Wrong(lambda: pg.save("a.npy", [[1], [1, 2]]), INPUT, "a.npy: a picture must be an array"),
    "save what is masked": Wrong(lambda: pg.save("a.npy", masked()), INPUT, "with masked values; fill them first"),
    # comparing
    "compare on 3": Wrong(
        lambda: compare(COPY(frame()), 3), INPUT, "backends of compare must be a list or tuple of names"
    ),
    "compare on one name": Wrong(
        lambda: compare(COPY(frame()), "gl"), INPUT, "must be a list or tuple of names of backends"
    ),
    "compare telling 3": Wrong(
        lambda: compare(COPY(frame()), [], progress=3), GRAPH, "progress of compare must be a function"
    ),
    # effects
    "bloom of 3": Wrong(lambda: effects.bloom(3), GRAPH, r"bloom: color must be a target or pg.Input\(...\), got 3"),
    "bloom into a name": Wrong(
        lambda: effects.bloom(frame(), into="x"), GRAPH, r"into must be a pg.target\(...\) or None"
    ),
    "levels as text": Wrong(
        lambda: effects.bloom(frame(), levels="4"), GRAPH, "bloom: levels must be a whole number, got '4'"
    ),
    "levels of 2.5": Wrong(lambda: effects.bloom(frame(), levels=2.5), GRAPH, "levels must be a whole number, got 2.5"),
    "levels of 9": Wrong(lambda: effects.bloom(frame(), levels=9), GRAPH, "bloom: levels must be 1 to 8, got 9"),
    "a threshold of NaN": Wrong(
        lambda: effects.bloom(frame(), threshold=float("nan")), GRAPH, "threshold must be a finite number"
    ),
    "a threshold of 1e300": Wrong(
        lambda: effects.bloom(frame(), threshold=1e300), GRAPH, "a finite number or .* got 1e"
    ),
    "a curve of a list": Wrong(
        lambda: effects.tone_map(frame(), curve=[]), GRAPH, r"curve must be one of linear, .* got \[\]"
    ),
    "a curve that is not there": Wrong(
        lambda: effects.tone_map(frame(), curve="x"),
        GRAPH,
        "tone_map: curve cannot be 'x'; it is one of linear, reinhard",
    ),
    "17 stops": Wrong(
        lambda: effects.tone_map(frame(), 17.0), GRAPH, "tone_map: exposure_stops must be -16 to 16, got 17.0"
    ),
    "two weights": Wrong(
        lambda: effects.black_and_white(frame(), (1, 2)), GRAPH, r"weights must be 3 finite numbers, got \(1, 2\)"
    ),
    "shadows of a mesh": Wrong(
        lambda: effects.soft_shadow(triangle()), GRAPH, "soft_shadow: scene must be a pg.Scene, got"
    ),
    "a map as text": Wrong(
        lambda: effects.soft_shadow(small_scene(), map_size="64"), GRAPH, "map_size must be a whole number"
    ),
    "display by number": Wrong(
        lambda: effects.soft_shadow(small_scene(), display=1), GRAPH, "display must be True or False"
    ),
    "a negative background": Wrong(
        lambda: effects.soft_shadow(small_scene(), background=(-1, 0, 0)),
        GRAPH,
        r"background must be 0 or more, got \(-1, 0",
    ),
    "darkness by a list": Wrong(
        lambda: effects.contact(small_scene(), darkness=[1]), GRAPH, "darkness must be a finite number or"
    ),
    "a lamp of text": Wrong(
        lambda: light2d.Light2D("here"), GRAPH, "Light2D: position must be 2 finite numbers, got 'here'"
    ),
    "a wall of numbers": Wrong(lambda: light2d.Wall((1, 2)), GRAPH, "Wall: points must be a list of 2 finite numbers"),
    "a world of None": Wrong(lambda: light2d.World2D(None), GRAPH, "World2D: window must be a Window, got None"),
    "a grid of 3": Wrong(lambda: light2d.occlusion(frame(), 3, 1.0), GRAPH, "grid must be an array"),
    "tiles of 0": Wrong(
        lambda: light2d.live_light_map(light2d.Window(0, 0, 8, 4), (8, 4), tile_px=0),
        GRAPH,
        "tile_px must be 1 to 1024, got 0",
    ),
    "a parameter by list": Wrong(
        lambda: EFFECTS["bloom"].parameter([]), GRAPH, r"effect 'bloom' has no parameter \[\]"
    ),
}
