"""What the numpy backend has LLVM compile: how much, and in a shape that LLVM is quick with."""

from __future__ import annotations

import gc
import resource
import sys
from collections.abc import Callable
from pathlib import Path
from weakref import WeakValueDictionary

import numpy as np
import pytest

import passgraph as pg
from passgraph.backends.numpy.machine import compiler, llvm, machine_code
from passgraph.backends.numpy.pixels.body import body_text
from passgraph.backends.numpy.pixels.buffer_layout import Layout
from passgraph.backends.numpy.pixels.chains import single_stage
from passgraph.backends.numpy.vector import lane_body
from passgraph.backends.numpy.vector.texels import MAX_INLINED
from passgraph.language import scalar as s
from passgraph.plan.data import PixelStep

SIZE = (40, 30)


def step_of(program: pg.Program) -> PixelStep:
    step = program.plan.steps[0]
    assert isinstance(step, PixelStep)
    return step


def taps(count: int) -> pg.Program:
    """As many reads at places that differ from pixel to pixel."""
    kernel = pg.kernel(
        source=f"""
        def taps(map: Image, by: float = 1.5) -> float:
            lit = 0.0
            for i in range({count}):
                lit += map.texel(ivec2(map[0, 0].x * by * float(i))).x
            return lit
        """
    )
    return pg.compile(kernel(pg.Input("map", "r32f", SIZE), into=pg.target("lit", "r32f")))


def text_of(program: pg.Program) -> str:
    return body_text(Layout.for_chain(single_stage(step_of(program)), 16).stages[0], "body")


BRANCHED = "for i in range(40):\n        if t > c[0, 0].x:\n            break\n        t *= 2.0\n   "
LONG = " ".join(f"t = abs(t * 1.{k}1 - 0.{k}3) + sqrt(t + 0.{k}7) * c[0, 0].x\n   " for k in range(1, 9))


@pytest.mark.parametrize(
    ("body", "points"),
    [
        (f"t = c[0, 0]\n    {LONG} return t", True),
        ("return vec4(0.3)", True),
        ("return c[0, 0] + c[1, 0]", False),
        ("return c.texel(ivec2(c[0, 0].xy))", False),
        (f"t = 0.5\n    {BRANCHED} return vec4(t)", False),
    ],
    ids=["long", "no picture", "window", "anywhere", "branches"],
)
def test_what_computes_points_alone_is_simplified_once_over(body: str, points: bool) -> None:
    """LLVM finds little more in it at its own level: what becomes of it is as long."""
    kernel = pg.kernel(source=f"def k(c: Image) -> vec4:\n    {body}")
    with pg.compile(kernel(pg.Input("c", "rgba16f", SIZE), into=pg.target("o", "rgba16f"))) as program:
        text = text_of(program)
    assert (llvm.POINTS in text) == points
    lengths = [len(compiler.compiled(each, 0)) for each in (text, text.replace(llvm.POINTS, ""))]
    assert lengths[0] <= 1.02 * lengths[1]


def test_reads_beyond_so_many_are_calls() -> None:
    few, many = text_of(taps(MAX_INLINED)), text_of(taps(MAX_INLINED + 12))
    assert few.count(" noinline") == 0
    assert many.count(" noinline") == 12
    lines = [str(compiler.optimised(text)).count("\n") for text in (text_of(taps(12)), few, many)]
    inlined, called = (lines[1] - lines[0]) / (MAX_INLINED - 12), (lines[2] - lines[1]) / 12
    assert called < 0.6 * inlined  # lines of LLVM's text a read; the function itself is among them


@pytest.mark.parametrize(
    "loop", [(0, 24, 1), (0, 32, 2), (-3, 5, 1), (8, 0, -1), (0, 1, 1), (2**31 - 9, 2**31 - 1, 2)], ids=str
)
def test_no_loop_counts_from_nothing(loop: tuple[int, int, int]) -> None:
    """LLVM looks at loops that count 0, 1, 2 … for a checksum, and takes twice as long for each minimum in a row."""
    made = s.For(s.Val("int", 1), *loop, ())
    start, stop, step = lane_body._counter(made)
    assert (start, step) != (0, 1)
    assert len(range(start, stop, step)) == made.trips


def test_long_rows_of_minima_in_a_loop_compile() -> None:
    """Inner loops of 32 are unrolled, outer ones make 32 trips: LLVM would be looking for a checksum still."""
    kernel = pg.kernel(
        source="""
        def least(map: Image) -> float:
            best = 1000.0
            for j in range(32):
                for i in range(32):
                    best = min(best, map.texel(pixel() + ivec2(i, j)).x)
            return best
        """
    )
    program = pg.compile(kernel(pg.Input("map", "r32f", SIZE), into=pg.target("least", "r32f")))
    assert [i.trips for i in step_of(program).program.body if isinstance(i, s.For)] == [32]
    values = np.random.default_rng(0).random((SIZE[1], SIZE[0], 1), np.float32)
    found = program(map=values)["least"]
    rows, columns = np.arange(SIZE[1]), np.arange(SIZE[0])
    want = [[values[y : y + 32, x : x + 32].min() for x in columns] for y in rows]
    np.testing.assert_array_equal(found[..., 0], np.float32(want))


def curves(count: int) -> pg.Program:
    kernel = pg.kernel(
        source="""
        def curve(color: Image) -> vec4:
            c = color[0, 0]
            return vec4(sqrt(abs(c.rgb)) * 0.8125 + dot(c.rgb, vec3(0.0625)), c.a)
        """
    )
    last = pg.Input("frame", "rgba32f", SIZE)
    for number in range(count):
        last = kernel(last, into=pg.target(f"t{number}", "rgba32f"), name=f"pass {number}")
    return pg.compile({"last": last})


def test_code_does_not_know_the_names_of_images(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PASSGRAPH_CACHE", str(tmp_path))
    monkeypatch.setattr(machine_code, "_codes", {})
    for name in ("color", "picture"):
        text = f"def twice({name}: Image) -> vec4: return {name}[0, 0] * 2.0 + float({name}.size.x)"
        frame = pg.Input("frame", "rgba32f", SIZE)
        pg.compile(pg.kernel(source=text)(frame, into=pg.target("out", "rgba32f"))).close()
    assert len(list((tmp_path / "code").glob("*.o"))) == 2  # the body, and what is around


def test_passes_of_one_shape_share_what_is_around_their_bodies(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Whatever they compute, however many parameters they have."""
    monkeypatch.setenv("PASSGRAPH_CACHE", str(tmp_path))
    monkeypatch.setattr(machine_code, "_codes", {})
    texts = ("c[0, 0] * 2.0", "sqrt(abs(c[0, 0]))", "vec4(1.0) if c[0, 0].x > 0.5 else c[0, 0]", "vec4(c[0, 0].x * by)")
    frame = pg.Input("frame", "rgba32f", SIZE)
    for text in texts:
        kernel = pg.kernel(source=f"def k(c: Image, by: float = 2.0) -> vec4: return {text}")
        pg.compile(kernel(frame, into=pg.target("out", "rgba32f"))).close()
    # Where channels are alike, rows are of numbers, not of pixels.
    assert len(list((tmp_path / "code").glob("*.o"))) == len(texts) + 2


def test_passes_alike_are_compiled_once(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Long ones stand alone, and their layout is found once too."""
    picture = np.random.default_rng(0).random((SIZE[1], SIZE[0], 4), np.float32)
    with curves(60) as program:
        want = program(frame=picture)["last"]
    monkeypatch.setenv("PASSGRAPH_CACHE", str(tmp_path))
    monkeypatch.setattr(machine_code, "_codes", {})
    monkeypatch.setattr("passgraph.plan.fuse.MAX_FUSED_INSTRUCTIONS", 120)
    monkeypatch.setattr("passgraph.plan.chains.MAX_INSTRUCTIONS", 120)
    with curves(60) as program:
        steps = program.plan.steps
        assert len(steps) > 8
        layouts = {id(Layout.for_chain(single_stage(step), 16)) for step in steps if isinstance(step, PixelStep)}
        assert len(layouts) <= 3
        np.testing.assert_array_equal(program(frame=picture)["last"], want)
    assert len(list((tmp_path / "code").glob("*.o"))) <= 4


def compiled_row(count: int, text: Callable[[int], str], cache: Path) -> int:
    """How many codes a row of so many passes takes that knows none."""
    last = pg.Input("frame", "rgba16f", SIZE)
    for number in range(count):
        last = pg.kernel(source=text(number))(last, into=pg.target(f"t{number}", "rgba16f"), name=f"pass {number}")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PASSGRAPH_CACHE", str(cache))
        patch.setattr(machine_code, "_codes", {})
        pg.compile({"last": last}, options=pg.Options(fuse=False)).close()
    return len(list((cache / "code").glob("*.o")))


def other_operations(number: int) -> str:
    """Passes of which none computes what another does."""
    steps = " ".join(f"c = {'abs' if number >> bit & 1 else 'sqrt'}(c + 0.5)\n   " for bit in range(6))
    return f"def k(image: Image) -> vec4:\n    c = image[-1, 0] + image[1, 0]\n    {steps} return c * 0.5"


def test_what_is_compiled_grows_with_the_passes_that_differ(tmp_path: Path) -> None:
    """One body for each pass; what is around them, and moves pictures, once."""
    counts = [compiled_row(count, other_operations, tmp_path / f"{count}") for count in (6, 12, 18)]
    assert np.diff(counts).tolist() == [6, 6]
    assert counts[0] <= 6 + 4


@pytest.mark.parametrize("format_", ["rgba16f", "rgba8", "rgba16"])
def test_what_the_language_says_of_rounding_is_not_compiled(format_: str) -> None:
    """Of halves it is longer than most kernels; stores round by themselves, and nothing of it would be used."""
    kernel = pg.kernel(source="def k(c: Image) -> vec4: return c[0, 0] * 0.3 + c[1, 1].yxwz")
    lengths = []
    for stored in ("rgba32f", format_):
        with pg.compile(kernel(pg.Input("frame", "rgba32f", SIZE), into=pg.target("out", stored))) as program:
            step = step_of(program)
        lengths.append(
            (s.count(Layout.for_chain(single_stage(step), 16).stages[0].program.body), s.count(step.program.body))
        )
    (exact, said_exact), (made, said) = lengths
    assert made == exact == said_exact < said


def test_constant_vectors_are_short_and_results_are_woven_once() -> None:
    """Nothing is stored in part: the last turn of a row ends where the row does."""
    text = text_of(curves(1))
    assert "undef" not in text
    assert text.count("<64 x i32> <i32 0, i32 16, i32 32, i32 48,") == 1  # channels side by side
    assert "llvm.masked.store" not in text
    assert len(text) < 15_000


def test_text_that_llvm_refuses_is_an_error_and_ends_before_its_context(monkeypatch: pytest.MonkeyPatch) -> None:
    """A module that outlives its context ends the process when it is freed."""
    text = "define void @f(i32 %x) {\n br label %b\nb:\n %y = phi i32 [ %x, %c ]\n ret void\nc:\n br label %b\n}\n"
    parse, made = compiler.llvm.parse_assembly, []

    def noted(*arguments: object) -> object:
        made.append(parse(*arguments))
        return made[-1]

    monkeypatch.setattr(compiler.llvm, "parse_assembly", noted)
    with pytest.raises(RuntimeError, match="PHINode should have one entry for each predecessor"):
        compiler.compiled(text, 0)
    left = [module.detach() for module in made if not module.closed]  # so that the test ends, where it fails
    assert len(made) == 1
    assert not left


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_compiling_gives_back_its_memory(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A service that compiles kernels all day does not grow: 100 compilations take less than 1 MB."""
    monkeypatch.setenv("PASSGRAPH_CACHE", str(tmp_path))
    monkeypatch.setattr(machine_code, "_codes", WeakValueDictionary())
    texts: list[tuple[str, int]] = []
    compiled = compiler.compiled

    def noted(text: str, loops: int) -> bytes:
        texts.append((text, loops))
        return compiled(text, loops)

    monkeypatch.setattr(compiler, "compiled", noted)
    kernel = pg.kernel(source="def k(p: Image) -> vec4: return sqrt(p[0, 0]) * 77.125 + sin(p[1, 0])")
    pg.compile(kernel(pg.Input("frame", "rgba32f", SIZE)), "numpy").close()
    assert len(texts) == 2  # the body, and what is around

    def resident() -> int:
        gc.collect()
        return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize()

    def rounds(count: int) -> None:
        for _ in range(count):
            for text, loops in texts:
                compiled(text, loops)

    rounds(10)
    before = resident()
    rounds(100)
    assert resident() - before < 1 << 20
