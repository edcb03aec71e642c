"""Lowering: programs keep their rules, and find at computed addresses the texels that the border rules name."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from passgraph.formats import FORMATS
from passgraph.graph.calls import kernel
from passgraph.language import scalar as s
from passgraph.language.borders import BORDERS, border_place
from passgraph.language.builtin_name import WHOLE_PIXEL
from passgraph.language.facts import Facts, ImageFacts
from passgraph.language.lower import lower
from passgraph.language.lowering import lowered
from passgraph.language.lowering.buffers import Buffer, StoresInBuffers, TexelsInBuffers
from passgraph.language.lowering.check import Malformed, check
from passgraph.language.lowering.passes import CHECK_VARIABLE
from passgraph.language.lowering.textures import TexelsInTextures, Texture
from tests.language.evaluate import Evaluator

WIDTH, HEIGHT = 5, 4
BOUNDED = "clamp(n, -9, 9)", "clamp(m, -2147483647, 2147483647)"
FAR = "-2147483648", "2147483647"
#: How the texels of a picture with two channels lie: tight; bottom up with gaps, and channels in reverse.
TIGHT = Buffer((WIDTH, HEIGHT), 2 * WIDTH, 2, 0, (0, 1))
TURNED = Buffer((WIDTH, HEIGHT), -17, 3, 17 * (HEIGHT - 1) + 2, (2, 0))


def program(source: str, border: str = "clamp") -> s.ScalarProgram:
    return lower(kernel(source=source).program, Facts(images={"c": ImageFacts(2, border)}))


def laid_out(picture: Any, buffer: Buffer, count: int) -> Any:
    """Return a picture's numbers in a buffer, with NaN between them."""
    memory = np.full(count, np.nan, np.float32)
    for y, x, channel in np.ndindex(picture.shape):
        memory[buffer.first + y * buffer.row + x * buffer.pixel + buffer.places[channel]] = picture[y, x, channel]  # type: ignore[operator]
    return memory


def run(given: s.ScalarProgram, memory: Any, **blocks: Any) -> Any:
    y, x = np.divmod(np.arange(WIDTH * HEIGHT), WIDTH)
    sizes = {"size.c.0": np.array(WIDTH), "size.c.1": np.array(HEIGHT), "pitch.c": np.array(WIDTH)}
    pixels = {"pixel.0": x, "pixel.1": y}
    return Evaluator(given, WIDTH * HEIGHT, None, c=memory, **pixels, **sizes, **blocks)


PICTURE = np.random.default_rng(3).random((HEIGHT, WIDTH, 2)).astype(np.float32)


def expected(border: str, x: Any, y: Any) -> Any:
    texels = PICTURE[border_place(border, y, HEIGHT), border_place(border, x, WIDTH)]
    outside = (x < 0) | (x >= WIDTH) | (y < 0) | (y >= HEIGHT)
    return np.where((outside & BORDERS[border].blank)[:, None], np.float32(0), texels)


@pytest.mark.parametrize("border", BORDERS)
@pytest.mark.parametrize("buffer", [TIGHT, TURNED, replace(TURNED, wide=True), Buffer(places=(0, 1))])
@pytest.mark.parametrize(
    "offsets",
    [("0", "0"), ("-2", "0"), ("1", "-3"), BOUNDED, FAR, FAR[::-1]],
)
def test_a_read_beside_the_pixel_finds_the_texel_of_its_rule(
    border: str, buffer: Buffer, offsets: tuple[str, str]
) -> None:
    source = "def read(c: Image, n: int, m: int) -> vec2: return c[{}, {}].xy".format(*offsets)
    given = program(source, border)
    made = lowered(given, [TexelsInBuffers({"c": buffer})])
    assert not any(isinstance(i, s.LoadTexel) for i in s.walk(made.body))
    memory = laid_out(PICTURE, buffer if buffer.row else TIGHT, 200)
    if buffer.row is None:
        memory = memory[: 2 * WIDTH * HEIGHT + 2 : 2]  # whole texels, of which this is the first number
    for n, m in ((-1, 3), (-(2**31), 2**31 - 1), (7, -9)):
        found = run(made, memory, int=np.array([n, m], np.int32)).outputs()[0]
        x = np.int64(np.clip(n, -9, 9) if "n" in offsets[0] else offsets[0])
        y = np.int64(max(m, -(2**31) + 1) if "m" in offsets[1] else offsets[1])
        rows, columns = np.divmod(np.arange(WIDTH * HEIGHT), WIDTH)
        wanted = expected(border, columns + x, rows + y)
        channels = 2 if buffer.row else 1
        np.testing.assert_array_equal(np.transpose(found)[:, :channels], wanted[:, :channels])


@pytest.mark.parametrize("border", BORDERS)
@pytest.mark.parametrize("place", [-(2**31), -6, -1, 0, 3, 5, 2**31 - 1])
def test_a_read_anywhere_finds_the_texel_of_its_rule(border: str, place: int) -> None:
    given = program("def read(c: Image, n: int) -> vec2: return c.texel(ivec2(n, 2)).xy", border)
    made = lowered(given, [TexelsInBuffers({"c": TURNED})])
    found = run(made, laid_out(PICTURE, TURNED, 200), int=np.array([place], np.int32)).outputs()[0]
    wanted = expected(border, np.full(WIDTH * HEIGHT, place), np.full(WIDTH * HEIGHT, 2))
    np.testing.assert_array_equal(np.transpose(found), wanted)


def test_reads_known_to_be_inside_are_at_constant_distances() -> None:
    given = program("def read(c: Image) -> vec2: return c[0, 0].xy + c[-1, 1].yx + c[2, -1].xx", "mirror")
    made = lowered(given, [TexelsInBuffers({"c": TURNED}, inner=True)])
    loads = [i for i in made.body if isinstance(i, s.Load)]
    assert [load.places for load in loads] == [(2, 0), (-18, -20), (25,)]
    assert len({load.index for load in loads}) == 1


@pytest.mark.parametrize("name", ["r8", "rg8", "rg16", "rg16f", "rg32f"])
def test_stored_numbers_are_decoded_and_encoded(name: str) -> None:
    """Each number is read, and written as itself by a kernel that copies."""
    format_ = FORMATS[name]
    facts = Facts(images={"c": ImageFacts(format_.channels)}, stores=(format_.store,))
    kinds = {1: "float: return c[0, 0].x", 2: "vec2: return c[0, 0].xy"}
    given = lower(kernel(source=f"def copy(c: Image) -> {kinds[format_.channels]}").program, facts)
    buffer = replace(TIGHT, row=format_.channels * WIDTH, pixel=format_.channels, stored=format_)
    made = lowered(given, [TexelsInBuffers({"c": buffer}), StoresInBuffers([buffer])])
    assert not made.outputs
    kind = np.dtype(format_.number)
    memory = np.random.default_rng(1).integers(0, 1 << 7, WIDTH * HEIGHT * format_.channels).astype(kind)
    numbers = memory.view(np.uint16) if kind.kind == "f" and kind.itemsize == 2 else memory
    out = np.zeros(memory.size)
    run(made, numbers, out0=out)
    np.testing.assert_array_equal(out, memory)


@pytest.mark.parametrize("border", BORDERS)
@pytest.mark.parametrize("lies", [Texture(), Texture(turned=True), Texture(part=True), Texture(turned=True, part=True)])
@pytest.mark.parametrize("offsets", [("0", "0"), ("-2", "0"), ("1", "-3"), FAR, FAR[::-1]])
@pytest.mark.parametrize("read", ["c[{}, {}].xy", "c.texel(ivec2({}, {})).xy"])
def test_a_sample_finds_the_texel_of_its_rule(border: str, lies: Texture, offsets: tuple[str, str], read: str) -> None:
    given = program(f"def read(c: Image) -> vec2: return {read.format(*offsets)}", border)
    made = lowered(given, [TexelsInTextures({"c": lies})])
    rows, columns = np.divmod(np.arange(WIDTH * HEIGHT), WIDTH)
    found = sampled(made, lies, columns, rows).outputs()[0]
    x, y = (np.int64(offset) for offset in offsets)
    is_relative = "ivec2" not in read
    wanted = expected(border, columns * is_relative + x, rows * is_relative + y)
    np.testing.assert_array_equal(np.transpose(found), wanted)


def sampled(given: s.ScalarProgram, lies: Texture, columns: Any, rows: Any, **blocks: Any) -> Evaluator:
    """Run a program on :data:`PICTURE` in a texture, which has NaN around it if it is a part."""
    left, top, width, height = (3, 2, WIDTH + 4, HEIGHT + 5) if lies.part else (0, 0, WIDTH, HEIGHT)
    texture = np.full((height, width, 2), np.nan, np.float32)
    texture[top : top + HEIGHT, left : left + WIDTH] = PICTURE[::-1] if lies.turned else PICTURE
    centers = columns + left + 0.5, top + (HEIGHT - rows - 0.5 if lies.turned else rows + 0.5)
    values: dict[str, Any] = {"pixel.0": columns, "pixel.1": rows}
    for axis, (first, count, whole) in enumerate(((left, WIDTH, width), (top, HEIGHT, height))):
        values |= {f"size.c.{axis}": count, f"texel.c.{axis}": 1 / whole, f"here.c.{axis}": centers[axis] / whole}
        values |= {f"region.c.{axis}": first, f"low.c.{axis}": (first + 0.5) / whole}
        values |= {f"high.c.{axis}": (first + count - 0.5) / whole}
    arrays = {name: np.array(value) for name, value in values.items()}
    return Evaluator(given, columns.size, None, c=texture, **arrays, **blocks)


@pytest.mark.parametrize("border", [rule for rule in BORDERS if rule != "clamp"])
@pytest.mark.parametrize("turned", [False, True])
def test_four_texels_of_a_part_are_interpolated(border: str, turned: bool) -> None:
    """A position between texels is the mean that its distances weigh, each texel found by the rule."""
    x, y = s.Val("float", 1), s.Val("float", 2)
    load = s.LoadTexel((s.Val("float", 3), s.Val("float", 4)), "c", x, y, False, border, filtered=True)
    given = replace(
        program("def read(c: Image) -> vec2: return c[0, 0].xy"),
        body=(s.LoadUniform(x, "float", s.Lit("int", 0)), s.LoadUniform(y, "float", s.Lit("int", 1)), load),
        outputs=(s.Output("result", load.to, load.to),),  # type: ignore[arg-type]
    )
    lies = Texture(turned, part=True)
    made = lowered(given, [TexelsInTextures({"c": lies})])
    for position in ((0.5, 0.5), (0.07, 0.96), (-0.3, 0.4), (1.4, -0.6)):
        rows, columns = np.divmod(np.arange(WIDTH * HEIGHT), WIDTH)
        with_block = {"float": np.array(position, np.float32)}
        found = [value[0] for value in sampled(made, lies, columns, rows, **with_block).outputs()[0]]
        column, row = np.array(position) * (WIDTH, HEIGHT) - 0.5
        wanted = np.zeros(2)
        for right, down in ((0, 0), (1, 0), (0, 1), (1, 1)):
            at = np.array([np.floor(column) + right]), np.array([np.floor(row) + down])
            weight = (1 - abs(column - at[0])) * (1 - abs(row - at[1]))
            wanted += weight * expected(border, *(p.astype(np.int64) for p in at))[0]
        np.testing.assert_allclose(found, wanted, atol=1e-5)


TWO = """
def two(c: Image, n: int) -> vec2:
    total = c[0, 0].xy
    for i in range(4):
        if n < i:
            total += c[i, 0].yx * 0.5
            break
    return total
"""


def broken(change: Any) -> s.ScalarProgram:
    """Return a program in which ``change`` replaced an instruction."""
    given = program(TWO)
    body = s.rewritten(given.body, lambda i: change(i) or (i,))
    assert body != given.body
    return replace(given, body=body)


def _op(**fields: Any) -> Any:
    """Return a change of the multiplication."""
    return lambda i: isinstance(i, s.Op) and i.operation == "mul" and (replace(i, **fields),)


def _texel(change: Any) -> Any:
    """Return a change of the first read."""
    return lambda i: isinstance(i, s.LoadTexel) and isinstance(i.x, s.Lit) and change(i)


ONE = s.Lit("int", 1)


@pytest.mark.parametrize(
    ("message", "change"),
    [
        ("uses %9999: got no definition", _op(arguments=(s.Val("float", 9999),) * 2)),
        ("a value with a definition", _texel(lambda i: (i, i))),
        ("got int, expected float", _op(arguments=(ONE, ONE))),
        ("takes arguments: got 1, expected 2", _op(arguments=(ONE,))),
        ("gives: got int, expected float", _op(to=s.Val("int", 900))),
        ("got cross on float, expected a row", _op(operation="cross")),
        ("got mul on bool, expected", _op(on="bool")),
        ("reads an image: got d", _texel(lambda i: (replace(i, image="d"),))),
        ("reads channels: got 3, expected at most 2", _texel(lambda i: (replace(i, to=(*i.to, s.Val("float", 900))),))),
        (
            "reads a builtin: got pixel.7",
            _texel(lambda i: (s.LoadBuiltin(s.Val("int", 901), WHOLE_PIXEL.part(7)), i)),
        ),
        ("outside of every loop", _texel(lambda i: (i, s.Break()))),
        ("uses: got m99", lambda i: isinstance(i, s.Write) and (replace(i, variable="m99"),)),
    ],
)
def test_a_program_that_breaks_a_rule_is_found(message: str, change: Any) -> None:
    check(program(TWO), "before")
    with pytest.raises(Malformed, match=message) as error:
        check(broken(change), "after a pass")
    assert "two, after a pass: " in str(error.value)


def test_a_value_of_a_branch_is_unknown_behind_it() -> None:
    given = program(TWO)
    inner = [v for i in s.walk(given.body) if isinstance(i, s.If) for j in i.then for v in s.results_of(j)]
    output = replace(given.outputs[0], values=(inner[0], inner[0]))
    with pytest.raises(Malformed, match=f"output .* uses {inner[0]}: got no definition"):
        check(replace(given, outputs=(output,)), "after a pass")


def test_programs_are_checked_around_each_pass_if_wanted(monkeypatch: pytest.MonkeyPatch) -> None:
    def forgets(given: s.ScalarProgram) -> s.ScalarProgram:
        return replace(given, images=())

    with pytest.raises(Malformed, match=r"two, after forgets: .* reads an image"):
        lowered(program(TWO), [forgets])
    monkeypatch.delenv(CHECK_VARIABLE)
    assert lowered(program(TWO), [forgets]).images == ()
