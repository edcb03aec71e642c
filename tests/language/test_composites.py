"""Arrays of structs, of arrays and of images, matrices that are not square: on the host, in graphs, out of range."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.errors import GraphError, InputError
from passgraph.language import ir
from passgraph.language.types import FLOAT, VEC2, VEC3, Array, Struct, flat_type, image_names, longest, plain_parts

LIGHTS = """
class Light:
    position: vec3
    weights: Array[float, 2]
"""


def pick(name: str, type_: str, read: str, before: str = "") -> Any:
    """A kernel of one parameter that gives what ``read`` reads of it."""
    text = f"{before}\ndef k(c: Image, {name}: {type_}, i: int = 0, j: int = 0) -> float: return {read}"
    return pg.kernel(source=text, name="k")


def ran(kernel: Any, *arguments: Any, **values: Any) -> float:
    made = pg.compile(kernel(pg.Input("c"), *arguments, into=pg.target("r", "r32f")), backend="reference")
    picture = made(c=np.zeros((1, 1, 4), np.float32), **values)["r"]
    return float(np.asarray(picture).ravel()[0])


def test_a_type_is_taken_apart_into_plain_arrays() -> None:
    light = Struct("Light", (("at", VEC3), ("taps", Array(Array(FLOAT, 2), 3))))
    found = [(name, str(part)) for name, part in plain_parts(Array(Array(light, 4), 5), "l")]
    assert found == [("l.at", "Array[vec3, 20]"), ("l.taps", "Array[float, 120]")]
    assert longest(Array(Array(light, 4), 5)) == 120
    assert flat_type(Array(Array(VEC2, 3), 2)) == Array(VEC2, 6)


def test_images_in_fields_and_entries_have_names() -> None:
    kernel = pg.kernel(
        source="class S:\n    a: Image\n    b: Array[Image, 2]\n\n"
        "def k(s: S, t: Array[S, 2], u: Image) -> vec4: return u[0, 0]"
    )
    names = ("s.a", "s.b.0", "s.b.1", "t.a.0", "t.a.1", "t.b.0", "t.b.1", "t.b.2", "t.b.3", "u")
    assert kernel.program.images == names
    assert image_names(VEC3, "v") == []


@pytest.mark.parametrize("index", [-(2**31), -1, 0, 1, 2, 3, 2**31 - 1])
@pytest.mark.parametrize("inner", [-(2**31), -1, 0, 1, 2, 2**31 - 1])
def test_each_index_is_brought_into_its_own_dimension(index: int, inner: int) -> None:
    """An index beyond a row reads the end of that row, never the next one."""
    grid = np.arange(6.0).reshape(3, 2)
    read = pick("g", "Array[Array[float, 2], 3]", "g[i][j]")
    expected = grid[np.clip(index, 0, 2), np.clip(inner, 0, 1)]
    assert ran(read, grid, index, inner) == expected
    write = pg.kernel(
        source="def k(c: Image, g: Array[Array[float, 2], 3], i: int, j: int) -> float:\n    g[i][j] = 100.0\n"
        "    t = 0.0\n    for a in range(3):\n        for b in range(2):\n            t += g[a][b]\n    return t"
    )
    inside = 0 <= index < 3 and 0 <= inner < 2
    assert ran(write, grid, index, inner) == (grid.sum() + 100.0 - grid[index, inner] if inside else grid.sum())


@pytest.mark.parametrize("index", [-(2**31), -1, 0, 2, 3, 2**30, 2**31 - 1])
def test_a_row_is_written_whole_or_not_at_all(index: int) -> None:
    grid = np.arange(6.0).reshape(3, 2)
    write = pg.kernel(
        source="def k(c: Image, g: Array[Array[float, 2], 3], i: int) -> float:\n    g[i] = [50.0, 7]\n"
        "    t = 0.0\n    for a in range(3):\n        t += g[a][0] * 100.0 + g[a][1]\n    return t"
    )
    if 0 <= index < 3:
        grid[index] = 50.0, 7.0
    assert ran(write, grid, index) == (grid @ [100.0, 1.0]).sum()


def test_a_list_of_structs_is_a_parameter_and_a_run_value() -> None:
    read = pick("l", "Array[Light, 2]", "l[i].position.y * 10.0 + l[i].weights[j]", LIGHTS)
    lights = [SimpleNamespace(position=(1, 2, 3), weights=[4, 5]), SimpleNamespace(position=(6, 7, 8), weights=(9, 10))]
    assert ran(read, lights, 1, 0) == 79.0
    assert ran(read, pg.Value("lights", list), 0, 1, lights=lights) == 25.0
    assert ran(read, pg.Value("lights", list).map(lambda given: given[::-1]), 0, 1, lights=lights) == 80.0


def test_values_that_do_not_fit_are_refused_by_name() -> None:
    kernel = pick("l", "Array[Light, 2]", "l[i].weights[j]", LIGHTS)
    good = SimpleNamespace(position=(1, 2, 3), weights=[4, 5])
    with pytest.raises(GraphError, match=r"'l' must be Array\[Light, 2\], a list of 2, got "):
        kernel(pg.Input("c"), [good])
    with pytest.raises(GraphError, match=r"l'\[1\] is Light and needs a field 'weights', which SimpleNamespace lacks"):
        kernel(pg.Input("c"), [good, SimpleNamespace(position=(1, 2, 3))])
    with pytest.raises(InputError, match=r"l'.weights must be Array\[float, 2\] \(2 numbers\), got "):
        kernel(pg.Input("c"), [good, SimpleNamespace(position=(1, 2, 3), weights=[1, 2, 3])])
    grid = pick("g", "Array[Array[float, 2], 3]", "g[i][j]")
    with pytest.raises(GraphError, match="a list of 3, got "):
        grid(pg.Input("c"), np.zeros((2, 3)))
    with pytest.raises(InputError, match=r"must be Array\[float, 6\] \(6 numbers\)"):
        ran(grid, pg.Value("g", list), g=[[1, 2], [3, 4]])


def test_images_of_a_struct_are_targets() -> None:
    kernel = pick("s", "S", "s.a[0, 0].x", "class S:\n    a: Image\n    n: float\n")
    with pytest.raises(GraphError, match=r"'s', s.a is an Image and takes a target or pg.Input\(...\), got float"):
        kernel(pg.Input("c"), SimpleNamespace(a=1.0, n=1.0))
    with pytest.raises(GraphError, match="'s' holds images, which are known when the graph is made"):
        kernel(pg.Input("c"), pg.Value("s", object))


def test_history_and_borders_belong_to_each_image() -> None:
    """The graph sees every image of an array as it sees parameters."""
    first, second = pg.Input("a").border("zero"), pg.Input("b").border("repeat")
    kernel = pg.kernel(
        source="def k(s: Array[Image, 2], i: int) -> vec4: return s[i].texel(pixel() - ivec2(1, 0)) + s[0][-1, 0]"
    )
    made = kernel([first, second], 1, into=pg.target("r", "rgba32f"))
    assert {target.name for target in pg.graph(made) if isinstance(target, pg.Target)} == {"a", "b", "r"}
    a, b = (np.arange(12, dtype=np.float32).reshape(1, 3, 4) * scale for scale in (1.0, 100.0))
    zeros = np.concatenate([np.zeros((1, 1, 4), np.float32), a[:, :2]], 1)
    found = pg.compile(made, backend="reference")(a=a, b=b)["r"]
    np.testing.assert_array_equal(found, np.roll(b, 1, axis=1) + zeros)


def test_a_producer_is_fused_where_an_array_reads_it() -> None:
    """At this pixel and under an index that loops know, a pass computes inside its reader, and gives the same."""
    half = pg.kernel(source="def half(c: Image) -> vec4: return c[0, 0] * 0.5")
    total = pg.kernel(
        source="def total(s: Array[Image, 3]) -> vec4:\n    t = vec4(0.0)\n    for i in range(3):\n"
        "        t += s[i][0, 0] * float(i + 1)\n    return t"
    )
    c = pg.Input("c")
    made = total([half(c, name="first"), c, half(c, name="last")], into=pg.target("r", "rgba32f"))
    picture = np.arange(24, dtype=np.float32).reshape(2, 3, 4)
    on, off = (pg.compile(made, backend="numpy", options=pg.Options(fuse=fuse)) for fuse in (True, False))
    np.testing.assert_array_equal(on(c=picture)["r"], picture * 4.0)
    np.testing.assert_array_equal(off(c=picture)["r"], picture * 4.0)
    assert len(on.plan.steps) < len(off.plan.steps)


def test_only_the_image_that_a_written_index_names_is_read() -> None:
    kernel = pg.kernel(source="def k(s: Array[Image, 4]) -> vec4: return s[2].sample(uv())")
    read = {part.image for part in _texels(kernel.program.body)}
    assert read == {"s.2"}


def _texels(body: tuple[Any, ...]) -> list[ir.Texel]:
    found: list[ir.Texel] = []
    pending: list[Any] = list(body)
    while pending:
        part = pending.pop()
        if isinstance(part, ir.Texel):
            found.append(part)
        if isinstance(part, tuple):
            pending += part
        elif hasattr(part, "__dataclass_fields__"):
            pending += [getattr(part, name) for name in part.__dataclass_fields__]
    return found


BONES = """
class Bone:
    placed: mat3x4
    shares: Array[float, 2]

class Drawn:
    position: vec4
    seen: vec3
"""


@pytest.mark.parametrize("backend", ["reference", "numpy"])
def test_both_kernels_of_a_draw_take_arrays(backend: str) -> None:
    vertex = pg.vertex(
        source=BONES
        + "def v(a: Vertex, bones: Array[Bone, 2], i: int) -> Drawn: return Drawn(vec4(a.position.xy, 0.0, 1.0), "
        "transpose(bones[i].placed) * vec4(bones[i].shares[0], bones[i].shares[1], 1.0, 2.0))"
    )
    fragment = pg.fragment(
        source=BONES + "def f(s: Drawn, images: Array[Image, 2], k: int) -> vec4: return vec4(s.seen, 1.0) "
        "+ images[k].texel(ivec2(pixel().x, 0)) + images[pixel().x - 1].texel(ivec2(0, 0))"
    )
    mesh = pg.Mesh.make([[-1, -1, 0], [3, -1, 0], [-1, 3, 0]], [[0, 1, 2]])
    placed, shares = np.arange(24.0).reshape(2, 4, 3), ((1, 2), (3, 4))
    bones = [SimpleNamespace(placed=placed[i], shares=shares[i]) for i in (0, 1)]
    made = pg.draw(
        mesh, vertex=vertex, fragment=fragment, into=pg.target("r", "rgba32f"), i=1, k=1,
        bones=pg.Value("bones", list), images=[pg.Input("a"), pg.Input("b")],
    )  # fmt: skip
    a, b = np.full((1, 2, 4), 100, np.float32), np.arange(8, dtype=np.float32).reshape(1, 2, 4)
    found = pg.compile(made, backend=backend, size=(3, 1))(a=a, b=b, bones=bones)["r"]
    seen = np.append(placed[1].T @ np.array([3.0, 4.0, 1.0, 2.0]), 1.0)
    expected = [seen + b[0, min(x, 1)] + (a, b)[min(max(x - 1, 0), 1)][0, 0] for x in range(3)]
    np.testing.assert_array_equal(found[0], expected)


#: Ways to read an image besides the plain ones, with the values that stand in ``a`` and ``p``.
READS = (
    "{}.sample(p)", "{}.sample(p, lod=1.5)", "{}.sample(lod=1.0, position=p)", "vec4({}.lod(p))", "{}.nearest(p)",
    "{}.gather(p, pixel().x % 4)", "{}.texel(pixel() * 2, 1)", "vec4(float({0}.levels), vec3(float({0}.slices)))",
    "vec4(vec2({}.size_of(pixel().y)), 0, 0)", "{}.texel(pixel() + 1)",
)  # fmt: skip


def test_a_field_named_like_the_picture_of_levels_is_an_image_as_any() -> None:
    """``pair.mips`` is a field, and the picture itself has levels."""
    text = "class Pair:\n    mips: Image\n\ndef same(pair: Pair) -> vec4:\n    return pair.mips[0, 0]"
    pair = SimpleNamespace(mips=pg.Input("f", "rgba32f", (4, 4)).mipmaps())
    picture = np.random.default_rng(1).random((4, 4, 4), np.float32)
    with pg.compile(pg.kernel(source=text, name="same")(pair), backend="reference") as program:
        assert np.array_equal(program(f=picture)["same"], picture)


@pytest.mark.parametrize("read", READS)
def test_a_chosen_image_is_read_in_every_way_as_one_by_name(read: str) -> None:
    before = "def k(s: Array[Image, 2], i: int) -> vec4:\n    p = (uv() - 0.25) * 1.5\n    return "
    random = np.random.default_rng(5)
    pictures = {name: random.random(size, np.float32) for name, size in (("a", (5, 7, 4)), ("b", (8, 3, 4)))}
    handles = [pg.Input("a").mipmaps().border("mirror"), pg.Input("b").filter("nearest").slices(2)]
    found = []
    for way in (f"{read.format('s[i]')}", f"{read.format('s[0]')} if i < 1 else {read.format('s[1]')}"):
        kernel = pg.kernel(source=before + way)
        for which in (0, 1):
            made = kernel(handles, which, into=pg.target("r", "rgba32f", like=handles[0]))
            with pg.compile(made) as program:
                found.append(program(**pictures)["r"])
    assert found[0].tobytes() == found[2].tobytes()
    assert found[1].tobytes() == found[3].tobytes()


def test_uints_in_structs_in_arrays_keep_their_bits() -> None:
    before = "class Seed:\n    state: uint\n    table: Array[Array[uint, 2], 2]\n"
    kernel = pg.kernel(
        source=before + "def k(c: Image, s: Array[Seed, 2], i: int, t: Array[uint, 2] = (0xFFFFFFFF, 7)) -> vec2:\n"
        "    kept = s\n    kept[1 - i].table[i][0] += t[0]\n    kept[1 - i].state ^= s[i].table[1][i]\n"
        "    u = kept[1 - i].state + kept[1 - i].table[i][0]\n    return vec2(float(u & 0xFFFF), float(u >> 16))"
    )
    seeds = [SimpleNamespace(state=2**32 - 1 - n, table=[[n, 2**31 + n], [3 * n, 2**32 - 5]]) for n in (0, 1)]
    for i in (0, 1):
        other = seeds[1 - i]
        expected = ((other.state ^ seeds[i].table[1][i]) + other.table[i][0] + 2**32 - 1) % 2**32
        made = kernel(pg.Input("c"), seeds, i, into=pg.target("r", "rg32f"))
        later = kernel(pg.Input("c"), pg.Value("seeds", list), i, into=pg.target("r", "rg32f"))
        for outputs, backend, more in (
            (made, "reference", {}), (made, "numpy", {}), (pg.from_data(pg.to_data(made)), "numpy", {}),
            (later, "numpy", {"seeds": seeds}),
        ):  # fmt: skip
            with pg.compile(outputs, backend) as program:
                low, high = program(c=np.zeros((1, 1, 4), np.float32), **more)["r"].ravel()
            assert int(low) + 65536 * int(high) == expected
