"""Arrays of parameters beyond 1,024 entries: what runs bring, when they go to the device, and tiles; against NumPy."""

from __future__ import annotations

import re
import tracemalloc
from dataclasses import replace
from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.backends.base import Backend
from passgraph.backends.registry import open_backend
from passgraph.errors import BackendError, GraphError, InputError, KernelError
from passgraph.glsl.shader import parse
from passgraph.language.long_arrays import layout_of, numbers_in, picture_of
from passgraph.language.types import INT, NAMED, UINT, Array
from passgraph.scene import Mesh
from passgraph.verify.compare import compare

RNG = np.random.default_rng(5)
FRAME = RNG.random((13, 7, 4), np.float32)
CURVE = np.sort(RNG.random(4096, np.float32))
#: Every exponent and sign of a float, with quiet and signalling NaNs, and denormals; small and large whole numbers.
BITS = np.concatenate(
    [(np.arange(512, dtype=np.uint32) << 23)[:, None] | np.uint32([0, 1, 0x3FFFFF, 0x400000, 0x7FFFFF])]
).ravel()

tone = pg.kernel(
    source="""
def tone(color: Image, curve: Array[float, 4096]) -> vec4:
    c = color[0, 0]
    x = clamp(c.rgb, 0.0, 1.0) * 4095.0
    i = ivec3(x)
    low = vec3(curve[i.r], curve[i.g], curve[i.b])
    high = vec3(curve[i.r + 1], curve[i.g + 1], curve[i.b + 1])
    return vec4(mix(low, high, x - vec3(i)), c.a)
"""
)
entry = pg.kernel(source="def entry(at: int, table: Array[float, 2000]) -> float: return table[pixel().x + at]")
scaled = pg.kernel(source="def scaled(c: Image, by: Array[float, 2000]) -> vec4: return c[0, 0] * by[pixel().x]")


def interpolated(curve: Any) -> np.ndarray[Any, Any]:
    places = np.linspace(0.0, 1.0, len(curve))
    return np.concatenate([np.interp(FRAME[..., :3], places, curve), FRAME[..., 3:]], axis=-1)


class Counting:
    """A backend that counts what is uploaded."""

    def __init__(self, backend: Backend, monkeypatch: pytest.MonkeyPatch) -> None:
        self.uploads = 0
        upload = backend.upload

        def counted(storage: Any, picture: Any) -> None:
            self.uploads += 1
            upload(storage, picture)

        monkeypatch.setattr(backend, "upload", counted)


@pytest.mark.parametrize("name", ["reference", "numpy", "gl", "opencl", "webgpu"])
def test_a_tone_curve_of_4096_entries_is_interpolated_as_numpy_does(name: str) -> None:
    with pg.compile(tone(pg.Input("frame"), CURVE), backend=name) as program:
        assert np.abs(program(frame=FRAME)["tone"] - interpolated(CURVE)).max() < 4e-7


def test_the_oracle_bounds_it_on_every_backend() -> None:
    report = compare(tone(pg.Input("frame"), CURVE), ["numpy", "gl", "opencl", "webgpu"], frame=FRAME)
    assert report.passed, report.difference


@pytest.mark.parametrize("name", ["reference", "numpy", "gl", "opencl", "webgpu"])
@pytest.mark.parametrize("type_", ["int", "uint"])
def test_whole_numbers_are_exact_to_the_bit(name: str, type_: str) -> None:
    # as floats half of these bits are NaN or denormal
    read = pg.kernel(
        source=f"def read(table: Array[{type_}, {len(BITS)}]) -> vec2:\n    b = int(table[pixel().x])\n"
        "    return vec2(float(b & 0xFFFF), float((b >> 16) & 0xFFFF))"
    )
    given = BITS if type_ == "uint" else BITS.view(np.int32)
    with pg.compile(read(given), backend=name, size=(len(BITS), 1)) as program:
        halves = program()["read"][0].astype(np.uint32)
    assert np.array_equal(halves[:, 0] | halves[:, 1] << 16, BITS)


@pytest.mark.parametrize("type_", ["vec2", "vec3", "vec4", "ivec3", "uvec4", "bvec2", "mat2", "mat3x2", "mat4"])
def test_entries_of_every_type_are_where_they_were_put(type_: str) -> None:
    array = Array(NAMED[type_], 1500)  # type: ignore[arg-type]
    count = 1500 * {"mat2": 4, "mat3x2": 6, "mat4": 16}.get(type_, int(type_[-1]))
    numbers = RNG.integers(0, 2 if type_[0] == "b" else 1 << 31, count)
    held = numbers_in(picture_of(numbers if type_[0] in "iu" else numbers % 2, array, "a"), array)
    assert np.array_equal(held, numbers if type_[0] in "iu" else numbers % 2)
    last = {"mat2": "t[i][1].y", "mat3x2": "t[i][2].y", "mat4": "t[i][3].w"}.get(
        type_, f"t[i].{'xyzw'[int(type_[-1]) - 1]}"
    )
    shown = f"float({last} & 1)" if type_[0] == "i" else f"float(int({last} & 1))" if type_[0] == "u" else last
    shown = f"1.0 if {last} else 0.0" if type_[0] == "b" else shown
    read = pg.kernel(
        source=f"def read(t: Array[{type_}, 1500]) -> float:\n    i = 1499 - pixel().x\n    return {shown}", name="read"
    )
    flat = numbers.reshape(1500, -1)
    with pg.compile(read(flat if type_[0] in "iu" else flat % 2), backend="numpy", size=(1600, 1)) as program:
        found = program()["read"][0, :, 0]
    assert np.array_equal(found[:1500], flat[::-1, -1] % 2)
    assert np.all(found[1500:] == flat[0, -1] % 2)  # below 0 the first entry


def test_an_index_outside_reads_the_nearest_end() -> None:
    table = np.arange(2000, dtype=np.float32)
    with pg.compile(entry(pg.Value("at", int), table), size=(3, 1)) as program:
        for at in (-(2**31), -2, 1998, 2**31 - 3):
            expected = np.clip(np.arange(3) + at, 0, 1999)
            assert np.array_equal(program(at=at)["entry"][0, :, 0], expected)


def test_nan_and_infinity_are_values() -> None:
    table = np.full(2000, np.nan, np.float32)
    table[0], table[2] = np.inf, -np.inf
    with pg.compile(entry(0, table), size=(4, 1)) as program:
        assert np.array_equal(program()["entry"][0, :, 0], table[:4], equal_nan=True)


@pytest.mark.parametrize("name", ["numpy", "gl"])
def test_values_change_from_run_to_run_and_nothing_is_compiled_anew(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    with open_backend(name) as backend:
        seen = Counting(backend, monkeypatch)
        with pg.compile(entry(0, pg.Value("table", pg.Array)), backend=backend, size=(5, 1)) as program:
            plan = program.plan
            for _ in range(3):
                table = RNG.random(2000, np.float32)
                assert np.array_equal(program(table=table)["entry"][0, :, 0], table[:5])
            assert program.plan is plan
            assert seen.uploads == 3
            table[0] = 7.0  # the same array, written to
            assert program(table=table)["entry"][0, 0, 0] == 7.0
            table[0] = 8.0
            table.flags.writeable = False  # from here on it holds what it holds now
            seen.uploads = 0
            for _ in range(3):
                assert program(table=table)["entry"][0, 0, 0] == 8.0
            assert seen.uploads == 1


def test_an_array_given_to_the_kernel_goes_to_the_device_once(monkeypatch: pytest.MonkeyPatch) -> None:
    table = RNG.random(2000, np.float32)
    kept = table.copy()
    with open_backend("numpy") as backend:
        seen = Counting(backend, monkeypatch)
        with pg.compile(entry(0, table), backend=backend, size=(5, 1)) as program:
            table[:] = 0.0  # what it was when the graph was compiled counts, as of short arrays
            for _ in range(3):
                assert np.array_equal(program()["entry"][0, :, 0], kept[:5])
        assert seen.uploads == 1


def test_a_value_computed_on_the_host_is_one_too() -> None:
    stops = pg.Value("stops", float)
    table = stops.map(lambda s: np.arange(2000, dtype=np.float32) * 2.0**s)
    with pg.compile(entry(0, table), size=(5, 1)) as program:
        for s in (0.0, 3.0):
            assert np.array_equal(program(stops=s)["entry"][0, :, 0], np.arange(5) * 2.0**s)


def test_program_set_changes_an_array_and_refuses_one_that_is_shared() -> None:
    table = np.ones(2000, np.float32)
    with pg.compile(entry(0, table), size=(2, 1)) as program:
        program.set("entry", "table", table * 5.0)
        assert program()["entry"][0, 0, 0] == 5.0
        program.set("entry", "table", table[:7])
        with pytest.raises(InputError, match=r"table of entry must be Array\[float, 2000\].*\(7,\)"):
            program()
    frame = pg.Input("frame")
    both = scaled(scaled(frame, table, name="one"), table, name="two")
    with pg.compile(both, options=pg.Options(fuse=False)) as program:
        program(frame=FRAME)
        with pytest.raises(GraphError, match="'by' of pass 'one' is one array with what pass 'two' reads; give both"):
            program.set("one", "by", table * 2.0)


def test_passes_that_are_given_one_array_share_its_picture() -> None:
    table = np.ones(2000, np.float32)
    twice = scaled(scaled(pg.Input("frame", "rgba32f", (7, 13)), table, name="one"), table, name="two")
    with pg.compile(twice, options=pg.Options(fuse=False)) as program:
        assert list(program.plan.buffers) == [r.id for r in program.plan.resources if r.kind == "buffer"]
        assert len(program.plan.buffers) == 1


@pytest.mark.parametrize("name", ["numpy", "gl"])
def test_optimisations_change_no_bit(name: str) -> None:
    one, two = RNG.random((2, 2000), np.float32)
    made = scaled(scaled(pg.Input("frame"), one, name="one"), pg.Value("by", pg.Array), name="two")
    off = pg.Options(cull=False, fuse=False, order=False, alias=False, static=False, simplify=False)
    found = []
    for options in (pg.Options(), off):
        with pg.compile(made, backend=name, options=options) as program:
            found.append([program(frame=FRAME, by=by)["two"] for by in (two, two * 3.0)])
            assert program.plan.options.fuse == (len(program.plan.steps) == 1)
    assert np.array_equal(found[0], found[1])
    columns = (one * two)[:7]
    assert np.allclose(found[0][0], FRAME * columns[None, :, None], rtol=3e-7)


def test_a_static_array_makes_its_passes_run_again_when_it_is_new() -> None:
    still = pg.Input("still", static=True)
    made = scaled(still, pg.Value("by", pg.Array, static=True))
    by = np.ones(2000, np.float32)
    with pg.compile(made) as program:
        first = program(still=FRAME, by=by)["scaled"]
        assert "runs once" in program.explain()
        assert np.array_equal(program(still=FRAME, by=by * 2.0)["scaled"], first * 2.0)


def test_tiles_read_the_whole_array() -> None:
    picture = RNG.random((50, 90, 4), np.float32)
    by = RNG.random(2000, np.float32)
    made = scaled(pg.Input("frame"), pg.Value("by", pg.Array))
    with pg.compile(made) as program:
        whole = program(frame=picture, by=by)["scaled"]
    room = np.empty_like(whole)
    pg.tiled(made, picture, room, values={"by": by}, tile=(32, 16))
    assert np.array_equal(room, whole)


def test_a_result_is_written_into_the_callers_array() -> None:
    room = np.empty((1, 5, 1), np.float32)
    with pg.compile(entry(3, np.arange(2000.0)), size=(5, 1)) as program:
        assert program(into={"entry": room})["entry"] is room
    assert room.ravel().tolist() == [3.0, 4.0, 5.0, 6.0, 7.0]


@pytest.mark.parametrize("name", ["reference", "numpy", "gl"])
def test_vertices_and_fragments_read_arrays(name: str) -> None:
    text = """
class Corner:
    position: vec4

def place(vertex: Vertex, at: Array[vec2, 1500]) -> Corner:
    return Corner(vec4(vertex.position.xy + at[1499], 0.5, 1.0))

def paint(corner: Corner, colors: Array[vec4, 1100]) -> vec4:
    return colors[1000 + int(corner.position.x)]
"""
    place, paint = pg.vertex(source=text, name="place"), pg.fragment(source=text, name="paint")
    mesh = Mesh.make(positions=[[-2, -2, 0], [2, -2, 0], [-2, 2, 0]], triangles=[[0, 1, 2]])
    at, colors = np.zeros((1500, 2), np.float32), RNG.random((1100, 4), np.float32)
    at[1499] = 1.0  # brings the triangle over the whole target
    drawn = pg.draw(mesh, vertex=place, fragment=paint, into=pg.target("out", "rgba32f"), at=at, colors=colors)
    with pg.compile(drawn, backend=name, size=(4, 3)) as program:
        assert np.array_equal(program()["out"], np.broadcast_to(colors[1000], (3, 4, 4)))


def test_arrays_of_structs_and_arrays_in_arrays_are_long_too() -> None:
    text = """
class Lamp:
    place: vec3
    count: int

class Scene:
    lamps: Array[Lamp, 1500]
    rows: Array[Array[float, 64], 64]

def show(scene: Scene, at: int) -> vec4:
    lamp = scene.lamps[at]
    return vec4(lamp.place.xy, float(lamp.count), scene.rows[at % 64][at])
"""
    rows = RNG.random((64, 64), np.float32)
    lamps = [SimpleNamespace(place=(i, 2 * i, 0), count=-i) for i in range(1500)]
    show = pg.kernel(source=text, name="show")
    with pg.compile(show(SimpleNamespace(lamps=lamps, rows=rows), pg.Value("at", int)), size=(1, 1)) as program:
        for at in (0, 70, 1499):
            assert program(at=at)["show"].ravel().tolist() == [at, 2 * at, -at, rows[at % 64, min(at, 63)]]


def test_a_graph_with_arrays_travels() -> None:
    mats = RNG.random((1100, 2, 2))
    read = pg.kernel(
        source="""
def read(m: Array[mat2, 1100], w: Array[uint, 1200], f: Array[bool, 1300], by: Array[float, 2000]) -> vec4:
    i = pixel().x
    return vec4(m[i] * vec2(1.0, 2.0), float(w[i] >> 8), by[i] if f[i] else -1.0)
"""
    )
    words, flags = RNG.integers(0, 1 << 32, 1200, np.uint32), RNG.random(1300) > 0.5
    made = read(mats, words, flags, pg.Value("by", pg.Array))
    data = pg.to_data(made)
    again = pg.from_data(data)
    assert pg.to_data(again) == data
    by = RNG.random(2000, np.float32)
    found = []
    for graph in (made, again):
        with pg.compile(graph, size=(9, 1)) as program:
            found.append(program(by=by)["read"])
    assert np.array_equal(found[0], found[1])
    assert np.array_equal(found[0][0, :, 2], (words[:9] >> 8).astype(np.float32))


def test_data_of_strangers_keep_to_what_the_parser_refuses() -> None:
    data = pg.to_data(entry(0, np.zeros(2000)))
    (made,) = data["passes"]
    made["values"]["table"]["shape"] = [1999]
    with pytest.raises(InputError, match="table"):
        pg.from_data(data)
    data = pg.to_data(entry(0, np.zeros(2000)))
    (definition,) = data["definitions"]
    definition["text"] = definition["text"].replace("return table[", "whole = table; return table[")
    with pytest.raises(InputError, match="table has 2000 entries, which are read by index"):
        pg.from_data(data)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (np.zeros(1999, np.float32), r"\(2000 numbers\), got an array of shape \(1999,\)"),
        (np.zeros((2000, 2)), r"\(2000 numbers\), got an array of shape \(2000, 2\)"),
        (np.full(2000, 1e300), r"got 1e\+300; finite floats reach"),
        (["a"] * 2000, "got a list of 2000"),
        (None, "got None"),
    ],
)
def test_values_are_checked_when_they_are_given(given: object, message: str) -> None:
    with pytest.raises(InputError, match=r"kernel entry, parameter 'table' must be Array\[float, 2000\].*" + message):
        entry(0, given)


def test_an_int_array_takes_no_floats() -> None:
    read = pg.kernel(source="def read(t: Array[int, 2000]) -> float: return float(t[pixel().x])")
    with pytest.raises(InputError, match="got floats"):
        read(np.zeros(2000, np.float32))


HUGE = "Array[float, 16777216]"
ROWS = "Array[Array[float, 4096], 4096]"


@pytest.mark.parametrize(
    ("text", "refused"),
    [
        (f"def k(t: {HUGE}) -> float: return t[pixel().x] + float(len(t))", ""),
        (f"def k(t: {HUGE}) -> float:\n    for i in range(len(t)):\n        return t[i]\n    return 0.0", ""),
        (f"def f(r: Array[float, 4096]) -> float: return r[3]\ndef k(t: {ROWS}) -> float: return f(t[pixel().x])", ""),
        (f"def k(t: {ROWS}) -> float:\n    row = t[pixel().x]\n    return row[0]", "a variable would hold"),
        (f"def k(t: {HUGE}) -> float: return 1.0 if t == t else 0.0", "== does not take"),
        (f"def k(t: {HUGE}, u: {HUGE}) -> float: return (t if u[1] > 0.0 else u)[0]", "use if statements"),
        (f"def k(t: {HUGE}) -> float:\n    a, b = t, t\n    return a[0]", "are read by index"),
        (f"def k(t: {HUGE}) -> float: return [t, t][0][1]", "an array has at most 1024 elements"),
        (f"def k(t: {HUGE}) -> float: return (t + t)[0]", "does not take"),
        (f"def k(n: int) -> tuple[{HUGE}, float]: return n, 1.0", "would hold"),
        ("def k(n: Array[Image, 16777216]) -> float: return 1.0", "at most 1024"),
        ("uniform float t[16777216]; void main() { gl_FragColor = vec4(t[int(gl_FragCoord.x)]); }", ""),
        ("struct S { float t[16777216]; }; uniform S a, b; void main() { gl_FragColor = vec4(a == b); }", "would hold"),
        ("uniform float t[16777216], u[16777216]; uniform bool b; void main() { gl_FragColor = vec4((b ? t : u)[1]); }",
         "by index"),
        ("void main() { float t[16777216] = float[](1.0); gl_FragColor = vec4(t[1]); }", "would hold"),
    ],
)  # fmt: skip
def test_texts_about_the_longest_arrays_take_little_memory(text: str, refused: str) -> None:
    made: Any = parse if "void" in text else partial(pg.kernel, name="k")
    tracemalloc.start()
    try:
        if refused:
            with pytest.raises(KernelError, match=re.escape(refused)):
                made(text) if made is parse else made(source=text)
        else:
            assert made(text) if made is parse else made(source=text)
        assert tracemalloc.get_traced_memory()[1] < 16 << 20
    finally:
        tracemalloc.stop()


def test_a_device_with_small_pictures_refuses_before_anything_is_made(monkeypatch: pytest.MonkeyPatch) -> None:
    with open_backend("numpy") as backend:
        monkeypatch.setattr(backend, "limits", replace(backend.limits, side=64), raising=False)
        with pytest.raises(BackendError, match="table of entry"):
            pg.compile(entry(0, np.zeros(2000)), backend=backend, size=(1, 1))


def test_rows_are_as_wide_as_every_device_takes() -> None:
    for type_, length in ((INT, 1 << 24), (UINT, 5000), (NAMED["mat4"], 1 << 22), (NAMED["mat4x2"], 1 << 23)):
        width, height = layout_of(Array(type_, length)).size  # type: ignore[arg-type]
        assert width == 2048
        assert height <= 1 << 14
