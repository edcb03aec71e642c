"""Errors that calls of Python meet: what provokes each, and what it says."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
from error_cases import STRUCT, VARYING

from passgraph.formats import Format, format_named
from passgraph.graph.calls import fragment, kernel, vertex
from passgraph.graph.draw_state import Blend, DrawState, Stencil
from passgraph.graph.drawing import draw
from passgraph.graph.run_values import Derived, Value
from passgraph.graph.targets import Input, Target, named_outputs, previous, target
from passgraph.language import symbols, vectors
from passgraph.language.kernel import function, struct
from passgraph.language.lower import Facts, lower
from passgraph.language.source import source_from_text


class Mesh:
    """A triangle."""

    def __init__(self, positions: Any = ((0, 0, 0), (1, 0, 0), (0, 1, 0)), triangles: Any = ((0, 1, 2),)) -> None:
        self.positions = np.array(positions, np.float32)
        self.triangles = np.array(triangles, np.int32)


INVERT = kernel(source="def invert(c: Image, gain: float = 1.0) -> vec4: return gain - c[0, 0]")
TWO = kernel(source="def two(c: Image) -> tuple[vec4, vec4]: return c[0, 0], c[0, 0]")
TAPS = kernel(source="def taps(c: Image, n: Const[int]) -> vec4: return c[0, 0] * float(n)")
LIGHT = kernel(source=STRUCT + "def light(c: Image, s: S) -> vec4: return c[0, 0] * s.a")
PLACE = vertex(source=VARYING + "def place(v: Vertex) -> P: return P(vec4(v.position, 1.0), v.normal)")
PAINT = fragment(source=VARYING + "def paint(p: P) -> vec4: return vec4(p.normal, 1.0)")
GLOW = fragment(source=VARYING + "def glow(p: P, gain: float, c: Image) -> vec4: return c.sample(vec2(gain))")
COPY = kernel(source="def copy(c: Image) -> vec4: return c[0, 0]")
COUNT = kernel(source="def count(c: Image, n: int) -> vec4: return c[0, 0] * float(n)")
GAIN = kernel(source="def amplified(c: Image, gain: float) -> vec4: return c[0, 0] * gain")
ON = kernel(source="def switched(c: Image, on: bool) -> vec4: return c[0, 0] if on else c[1, 0]")
OTHER = fragment(source="class Q:\n    glow: vec2\n\ndef other(q: Q) -> vec4: return q.glow.xyxy")
FRAME, COLOR, DEPTH = Input("frame"), target("color"), target("depth", "depth32f")


@function
def halved(a: float) -> float:
    return a / 2.0


def drawn(**changed: Any) -> Any:
    return draw(changed.pop("geometry", Mesh()), **{"vertex": PLACE, "fragment": PAINT, "into": COLOR, **changed})


#: Python that provokes an error, and words of it.
CALLS: list[tuple[Callable[[], Any], str]] = [
    (lambda: Format("r64f", 1, 64).store, "has no spelling for channel type 'f8', only 'f4', 'f2'"),
    (lambda: symbols.uint(-1), "a uint is a whole number from 0 to 4294967295, got -1"),
    (lambda: kernel(3), "a kernel is made from a function, got int"),  # type: ignore[call-overload]
    (lambda: kernel(source="a", glsl="b"), "from a function, from source=... or from glsl=..., one of the three"),
    (lambda: kernel(), "from a function or from source=..., one of the two"),  # type: ignore[call-overload]
    (lambda: kernel(lambda c: c), "a kernel is a def statement, not a lambda"),
    (lambda: halved(1.0), "halved() is a function of the kernel language; kernels call it, Python does not"),
    (lambda: struct(test_words), "@struct marks a class statement"),  # type: ignore[type-var]
    (lambda: struct(type("Made", (), {})), "the source of Made cannot be found"),
    (lambda: kernel(source="X = 1"), "no function is defined here; a kernel is written def name(...) -> vec4:"),
    (lambda: kernel(source="def f() -> float: return 1.0", name="g"), "no function 'g' is defined here; there are f"),
    (lambda: kernel(source=3), "kernel source must be str, got int"),  # type: ignore[call-overload]
    (
        lambda: kernel(source="def k(c: Array[Image, 2]) -> float: return 1.0")(Value("images", object)),
        "'c' holds images, which are known when the graph is made",
    ),
    (
        lambda: kernel(source="def k(c: Array[Image, 2]) -> float: return 1.0")(3.0),
        "c must be Array[Image, 2], a list of 2, got 3.0",
    ),
    (
        lambda: kernel(source="def k(n: Annotated[int, Range(1, 9, 'taps')]) -> float: return 1.0")(10),
        "parameter 'n' must be 1 to 9 taps, got 10",
    ),
    (lambda: source_from_text("#" * 300_000), "kernel text has 300000 characters; at most 200000"),
    (lambda: source_from_text("\n#" + "a" * 20_000), "<kernel text>:2: this line has 20001 characters; at most 10000"),
    (lambda: kernel(source="x = " + "-" * 9000 + "1"), "kernel text cannot be parsed"),
    (lambda: pickle.dumps(INVERT), "kernel invert was made from text, and pickle finds kernels by their names"),
    (lambda: pickle.dumps(FRAME), "handle of 'frame': graphs cannot be pickled; send plain data: pg.to_data(...)"),
    (lambda: vectors.dot(1, 2), "dot() exists inside kernels only; on the host use numpy"),
    (lambda: symbols.vec3(1, 2), "vec3 takes 3 numbers, got 2"),
    (lambda: symbols.vec3("abc"), "vec3 takes numbers, got 'abc'"),
    (lambda: INVERT(FRAME, "a"), "gain must be float|parameter 'gain' must be float (a number), got 'a'"),
    (lambda: INVERT(FRAME, (1, 2)), "parameter 'gain' must be float (a number), got (1, 2)"),
    (lambda: TAPS(FRAME, 1.5), "parameter 'n' must be int, got floats (1.5); convert them first"),
    (lambda: INVERT(FRAME, into=(COLOR, COLOR)), "returns 1 result(s), and pass 'color+color' has 2 target(s)"),
    (lambda: TWO(FRAME, into=(COLOR, COLOR)), "pass 'color+color' writes one target twice"),
    (lambda: INVERT(FRAME, into=DEPTH), "cannot write depth target 'depth'; depth is written by draws"),
    (lambda: INVERT(FRAME, into=target("t", "r8")), "kernel invert returns vec4, and target 't' has 1 channel(s) (r8)"),
    (lambda: INVERT(FRAME, 1, 2), "kernel invert takes 2 arguments (c, gain), got 3"),
    (lambda: INVERT(), "kernel invert needs c"),
    (lambda: INVERT(COLOR), "target 'color' is declared but not written; pass what its pass returned"),
    (lambda: INVERT(3), "'c' is an Image and takes a target or pg.Input(...), got int"),
    (lambda: INVERT(FRAME, FRAME), "'gain' is float, got the target 'frame'; declare the parameter as Image"),
    (lambda: INVERT(INVERT(FRAME, into=COLOR), into=COLOR), "pass 'color' reads and writes one target"),
    (
        lambda: INVERT(FRAME, into=INVERT(FRAME)),
        "writes every pixel of 'invert'; give a new pg.target(...), not a handle",
    ),
    (lambda: INVERT(FRAME, into=3), "pass 'invert' writes into pg.target(...), got int"),
    (lambda: INVERT(FRAME, gian=2), "kernel invert has no parameter 'gian'; it has c, gain"),
    (lambda: INVERT(FRAME, c=FRAME), "kernel invert gets 'c' twice"),
    (lambda: LIGHT(FRAME, 3), "is S and needs a field 'a', which int lacks"),
    (lambda: TAPS(FRAME, Value("n")), "is Const: it is baked when the graph is compiled and takes a number, got"),
    (lambda: drawn(into=3), "draw 'paint' draws into pg.target(...) or a handle, got int"),
    (lambda: drawn(geometry=Mesh(((0, 0),))), "positions must be (n, 3) and triangles (m, 3), got (1, 2) and (1, 3)"),
    (lambda: drawn(geometry=Mesh(triangles=np.zeros((0, 3)))), "the mesh is empty (3 vertices, 0 triangles)"),
    (
        lambda: drawn(geometry=Mesh(((0, 0, 0), (0, np.nan, 0), (1, 1, 1)))),
        "1 vertices are NaN or infinite, first vertex 1",
    ),
    (lambda: drawn(geometry=Mesh(triangles=((0, 1, 3),))), "a triangle names vertex 3; the mesh has 3"),
    (
        lambda: drawn(into=FRAME),
        "cannot draw into 'frame', an input or last frame's content; copy it with a kernel first",
    ),
    (lambda: drawn(fragment=None, into=None), "draw 'place' has no target; give into= or depth="),
    (lambda: drawn(depth=COLOR), "depth target 'color' is rgba16f; use depth32f or depth32f_stencil8"),
    (
        lambda: drawn(stencil=Stencil(), depth=DEPTH),
        "tests the stencil and needs depth=pg.target(..., format='depth32f_stencil8')",
    ),
    (lambda: drawn(into=(COLOR, target("b"))), "the fragment kernel returns 1 result(s), and there are 2 target(s)"),
    (
        lambda: drawn(
            fragment=fragment(source=VARYING + "def two(p: P) -> tuple[vec4, vec4]: return p.position, p.position"),
            into=(COLOR, COLOR),
        ),
        "draw 'color+color' writes one target twice",
    ),
    (lambda: drawn(blend=("add", "add")), "draw 'color' has 2 blends for 1 targets"),
    (lambda: drawn(color_mask=(True, False)), "color_mask is four bools (red, green, blue, alpha)"),
    (lambda: drawn(gain=1.0), "draw 'color' has no parameter 'gain'; its kernels have none"),
    (lambda: drawn(fragment=GLOW, gain=1.0), "fragment kernel glow needs c"),
    (lambda: drawn(fragment=GLOW, gain=1.0, c=drawn()), "draw 'color' reads and writes target 'color'"),
    (lambda: drawn(vertex=PAINT), "needs a vertex kernel made with @pg.vertex, got"),
    (lambda: drawn(fragment=OTHER), "takes glow: vec2, and vertex kernel place hands over nothing; use one struct"),
    (
        lambda: drawn(into=target("t", "rgba8_srgb"), blend="add"),
        "is rgba8_srgb, which cannot be blended; use a linear format",
    ),
    (lambda: drawn(blend="addd"), "there is no blend 'addd'; there are add, alpha"),
    (lambda: target(""), "the name of a target must be a name (a printable string, not empty), got ''"),
    (lambda: target("t", size=(4, 4), scale=0.5), "target 't' has both a size and a scale; give one"),
    (lambda: target("t", clear=(1.0, 2.0)), "target 't' (rgba16f) clears to 1 or 4 numbers, got 2"),
    (lambda: target("t", "r8", initial=np.full((2, 2), np.nan)), "target 't' starts from a picture that holds NaN"),
    (lambda: target("t", "r8", initial=np.zeros((2, 2, 3))), "starts from a picture (height, width, 1), got (2, 2, 3)"),
    (lambda: target("t", size=(4.5, 4)), "target 't' needs a size (width, height) in whole pixels"),  # type: ignore[arg-type]
    (lambda: Input("t", size=(0, 4)), "input 't' is 0x4 pixels; each side must be 1 to 32768"),
    (lambda: target("t", scale=0.0), "target 't': scale must be a number above 0 and at most 16, got 0.0"),
    (lambda: target("t", scale=(1.0, 0.5, 1.0)), "target 't': scale must be one number or two, got 3"),
    (lambda: FRAME.depth, "target 'frame' was not drawn with a depth target"),
    (lambda: FRAME.border("black"), "there is no border rule 'black'; the rules are clamp, zero, repeat, mirror"),
    (lambda: previous(FRAME), "input 'frame' has no history; keep a copy of it in a target"),
    (lambda: Blend("two"), "blend source factor cannot be 'two'; it is one of zero, one"),
    (lambda: DrawState(cull="both"), "cull cannot be 'both'; it is one of none, back, front"),
    (lambda: Stencil(reference=256), "stencil reference must be a whole number from 0 to 255, got 256"),
    (
        lambda: format_named("rgba8_srbg"),
        "there is no format 'rgba8_srbg' (did you mean 'rgba8_srgb'?); formats are",
    ),
    (lambda: format_named("x"), "there is no format 'x'; formats are r8"),
    # arguments of a kind that does not fit at all
    (lambda: Target(3), "a handle stands for pg.target(...) or pg.Input(...), got 3"),  # type: ignore[arg-type]
    (lambda: Target(target("t"), made_by=3), "a handle is made by a pass, got 3"),  # type: ignore[arg-type]
    (lambda: Value("v", 3), "value 'v': type must be a class, such as float or pg.vec3, got 3"),
    (lambda: Derived((), abs), "a value is computed from at least one pg.Value, got none"),
    (lambda: target("t", clear="red"), "target 't': clear must be a finite number within float32"),  # type: ignore[arg-type]
    (lambda: DrawState(polygon_offset=(1.0,)), "polygon_offset must be two numbers (factor, units)"),  # type: ignore[arg-type]
    (lambda: DrawState(color_mask=((True,),)), "color_mask has four bools (red, green, blue, alpha)"),  # type: ignore[arg-type]
    (lambda: drawn(clear_stencil=1000), "draw 'color': clear_stencil must be a whole number from 0 to 255, got 1000"),
    (lambda: drawn(geometry=3), "draw 'color' needs a mesh with positions and triangles, such as pg.Mesh.make(...)"),
    (
        lambda: drawn(geometry=SimpleNamespace(**{**vars(Mesh()), "triangles": np.eye(3)})),
        "triangles must be whole numbers, got float64",
    ),
    (
        lambda: drawn(geometry=SimpleNamespace(**{**vars(Mesh()), "normals": np.zeros((2, 3))})),
        "draw 'color': normals must be (3, 3), got (2, 3)",
    ),
    (lambda: COPY(FRAME, into=target("t"), name=3), "kernel copy: the pass's name must be a name"),
    # numbers beyond their range
    (
        lambda: COUNT(FRAME, 2**32),
        "parameter 'n' must be int, got 4294967296; ints reach from -2147483648 to 2147483647",
    ),
    (lambda: COUNT(FRAME, -(2**31) - 1), "parameter 'n' must be int, got -2147483649; ints reach"),
    (lambda: COUNT(FRAME, 10**400), "parameter 'n' must be int (a number), got a whole number of 1329 bits"),
    (lambda: GAIN(FRAME, 1e300), "parameter 'gain' must be float, got 1e+300; finite floats reach"),
    (lambda: ON(FRAME, 2), "parameter 'on' must be bool, got 2; a bool is True or False (1 or 0)"),
]


def test_words() -> None:
    """Stands in for something that is not a class."""


#: Texts too large for a table: grown by functions, loops and branches.
def grown(levels: int, first: str) -> str:
    lines = [f"def f0(x: float) -> float: return {first}"]
    lines += [f"def f{n + 1}(x: float) -> float: return f{n}(x) + f{n}(x + 1.0)" for n in range(levels)]
    return "\n".join([*lines, f"def k(c: Image) -> float: return f{levels}(c[0, 0].x)"])


def nested_derivatives(levels: int, lines: int) -> str:
    """Each is of the one inside of the branch before it, beside lines that feed none."""
    head = [f"{'    ' * (n + 1)}if v.x > {n}.0:" for n in range(levels)]
    inner = ["    " * (levels + 1) + "u += 1.0"] * lines
    tail = [f"{'    ' * (n + 1)}v += fwidth(v)" for n in range(levels, -1, -1)]
    return "\n".join(["def k(c: Image) -> vec4:", "    v, u = c[0, 0], 0.0", *head, *inner, *tail, "    return v + u"])


def compiled(text: str, **facts: Any) -> Any:
    return lower(kernel(source=text, name="k").program, Facts(**facts))


CALLS += [
    (lambda: Input("c").filter("cubic"), "there is no filter 'cubic'; the filters are linear, nearest"),
    (lambda: named_outputs(3), "compile takes targets that passes returned, got 3"),
    (lambda: named_outputs([3]), "compile takes targets that passes returned, got 3"),
    (
        lambda: named_outputs(target("made")),
        "compile takes targets that passes returned, got target 'made' is declared",
    ),
    (lambda: named_outputs([Input("c"), Input("c")]), "two outputs are called 'c'; give a mapping"),
    (lambda: Input("c").mipmaps().slices(3), "a volume has no smaller levels; leave out one of the two"),
    (lambda: compiled(grown(30, "x")), "the kernel grows past 20000 statements once its functions are inlined"),
    (lambda: compiled(nested_derivatives(12, 1)), "the kernel grows past 20000 statements"),
    (
        lambda: compiled(nested_derivatives(6, 2000)),
        "the kernel takes more than 1000000 steps to compute its derivatives",
    ),
    (lambda: compiled(grown(10, "*".join(["x"] * 150))), "the kernel grows past 60000 expressions"),
    (
        lambda: compiled(
            "def k(c: Image) -> float:\n    x = c[0, 0].x\n"
            + "".join("    " * (n + 1) + f"for i{n} in range(2):\n" for n in range(15))
            + "    " * 16
            + "x = x * x + x\n    return x"
        ),
        "the kernel takes more than 200000 steps to compile; make loops shorter",
    ),
    (
        lambda: compiled("def k(c: Image) -> vec4:\n    x = c[0, 0]\n" + "    x = x * x + x\n" * 2600 + "    return x"),
        "instructions, loops unrolled; at most 20000",
    ),
    (
        lambda: compiled(
            "".join(f"T{n} = (" + f"{n}.5, " * 1024 + ")\n" for n in range(17))
            + "def k(c: Image) -> float:\n    i = int(c[0, 0].x)\n    return "
            + " + ".join(f"T{n}[i]" for n in range(17))
        ),
        "the constant tables of k hold 17408 numbers; at most 16384",
    ),
    (
        lambda: compiled(
            "def k(c: Image) -> float:\n    x = c[0, 0].x\n    for i in range(65536):\n"
            + "        x = x * x + 1.0\n" * 200
            + "    return x"
        ),
        "instructions a pixel, loops run; at most 16777216",
    ),
    (
        lambda: compiled(
            "def k(c: Image) -> float:\n    i = int(c[0, 0].x)\n    a = [mat4(1)] * 1024\n    b = [1.0] * 65\n"
            "    a[i] = mat4(2)\n    b[i] = 2.0\n    return b[i + 1] + a[i][0].x"
        ),
        "read or written at computed indices hold 16449 numbers or more together; at most 16384 are allowed",
    ),
]
