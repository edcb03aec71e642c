"""Uints, bits, packing and functions of several results, against Python's whole numbers, NumPy and GLSL itself."""

from __future__ import annotations

import math
import operator
import struct
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from running import Column, lowered, parsed, run, run_program

import passgraph as pg
from passgraph.errors import InputError, KernelError, PassgraphError
from passgraph.language import scalar as s
from tests.conftest import require

UINT = 2**32
ENDS = [0, 1, 2, 3, 5, 7, 31, 32, 33, 255, 65535, 65536, 2**31 - 1, 2**31, 2**31 + 1, 3 * 2**30, UINT - 2, UINT - 1]
RANDOM = np.random.default_rng(11)
NUMBERS = [*ENDS, *(int(RANDOM.integers(0, UINT)) >> int(RANDOM.integers(0, 32)) for _ in range(110))]
PAIRS = [(a, b) for a in NUMBERS for b in (*ENDS, *NUMBERS[-8:])]
READ = "u, v = (uint(x) << 16) | uint(y), (uint(z) << 16) | uint(w)\n"


def computed(expression: str, pairs: list[tuple[int, int]], before: str = "") -> list[int]:
    """A whole number made of the uints u and v, as the uint with its bits."""
    both = np.array(pairs, np.int64)
    columns = [(half & 0xFFFF).astype(np.float32) for one in both.T for half in (one >> 16, one)]
    body = f"{READ}{before}r = uint({expression})\nreturn vec2(float(r & 0xFFFF), float(r >> 16))"
    low, high = run_program(lowered(body, "vec2"), *columns)
    return [int(a) + 65536 * int(b) for a, b in zip(low, high, strict=True)]


def signed(a: int) -> int:
    return a - UINT if a >= UINT // 2 else a


@pytest.mark.parametrize(
    ("sign", "meaning"),
    [
        ("+", operator.add), ("-", operator.sub), ("*", operator.mul), ("&", operator.and_), ("|", operator.or_),
        ("^", operator.xor), ("//", lambda a, b: a // b if b else 0), ("%", lambda a, b: a % b if b else 0),
        ("<<", lambda a, b: a << (b & 31)), (">>", lambda a, b: a >> (b & 31)),
    ],
)  # fmt: skip
def test_operators_of_uints_are_those_of_whole_numbers(sign: str, meaning: Callable[[int, int], int]) -> None:
    assert computed(f"u {sign} v", PAIRS) == [meaning(a, b) % UINT for a, b in PAIRS]


@pytest.mark.parametrize("sign", ["<", "<=", ">", ">=", "==", "!="])
def test_comparisons_of_uints_have_no_sign(sign: str) -> None:
    meaning = {"<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge, "==": operator.eq,
               "!=": operator.ne}[sign]  # fmt: skip
    assert computed(f"u {sign} v", PAIRS) == [meaning(a, b) for a, b in PAIRS]


@pytest.mark.parametrize(
    ("expression", "meaning"),
    [
        ("min(u, v)", min),
        ("max(u, v)", max),
        ("clamp(u, 7, 0x80000005)", lambda a, b: min(max(a, 7), 0x80000005)),
        ("abs(u) + sign(v)", lambda a, b: a + (b > 0)),
        ("-u + ~v", lambda a, b: -a - b - 1),
        ("uint(int(u)) + uint(-1)", lambda a, b: a - 1),
        ("u**3", lambda a, b: a**3),
        ("u if u > v else 4", lambda a, b: a if a > b else 4),
        ("bit_count(u)", lambda a, b: bin(a).count("1")),
        ("find_lsb(int(u))", lambda a, b: (a & -a).bit_length() - 1),
        ("find_msb(u)", lambda a, b: a.bit_length() - 1),
        ("find_msb(int(u))", lambda a, b: (signed(a) if signed(a) >= 0 else ~signed(a)).bit_length() - 1),
        ("bitfield_reverse(u)", lambda a, b: int(f"{a:032b}"[::-1], 2)),
        ("quotient(int(u), int(v))", lambda a, b: int(math.copysign(abs(signed(a)) // abs(signed(b)),
                                                                    signed(a) * signed(b))) if b else 0),
        ("remainder(int(u), int(v))", lambda a, b: int(math.fmod(signed(a), signed(b))) if b else 0),
        ("quotient(u, v)", lambda a, b: a // b if b else 0),
        ("remainder(u, v)", lambda a, b: a % b if b else 0),
    ],
)  # fmt: skip
def test_functions_of_whole_numbers_are_exact(expression: str, meaning: Callable[[int, int], int]) -> None:
    assert computed(expression, PAIRS) == [meaning(a, b) % UINT for a, b in PAIRS]


PLACES = [(a, start, count) for a in NUMBERS[:30] for start in range(33) for count in (0, 1, 5, 16, 31, 32)]


def test_fields_of_bits_are_what_their_places_say() -> None:
    fitting = [(a, start, count) for a, start, count in PLACES if start + count <= 32]
    pairs = [(a, start + 64 * count) for a, start, count in fitting]
    before = "start, count = int(v) % 64, int(v) // 64\n"
    ones = [(1 << count) - 1 for _, _, count in fitting]
    taken = [(a >> start) & one for (a, start, _), one in zip(fitting, ones, strict=True)]
    assert computed("bitfield_extract(u, start, count)", pairs, before) == taken
    extended = [(t - (one + 1) if t > one >> 1 else t) % UINT for t, one in zip(taken, ones, strict=True)]
    assert computed("bitfield_extract(int(u), start, count)", pairs, before) == extended
    put = [(a & ~(one << start) | (0x9E3779B9 & one) << start) % UINT
           for (a, start, _), one in zip(fitting, ones, strict=True)]  # fmt: skip
    assert computed("bitfield_insert(u, 0x9E3779B9, start, count)", pairs, before) == put


def test_fields_beyond_the_bits_are_brought_inside() -> None:
    inside = computed("bitfield_extract(u, 28, 4)", PAIRS)
    assert computed("bitfield_extract(u, 28, 40)", PAIRS) == inside
    assert computed("bitfield_extract(u, 3, -1)", PAIRS) == [0] * len(PAIRS)
    assert computed("bitfield_extract(u, -9, 4)", PAIRS) == [a & 15 for a, _ in PAIRS]


def test_fields_of_data_go_into_constants_on_the_reference_too() -> None:
    """The reference holds a constant once for all pixels."""
    text = "def k(c: Image) -> float: return float(bitfield_insert(64, int(c[0, 0].r), 1, 3))"
    numbers = np.arange(12, dtype=np.float32).reshape(3, 4, 1)
    with pg.compile(pg.kernel(source=text)(pg.Input("c"), into=pg.target("made", "r32f")), "reference") as program:
        assert (program(c=numbers)["made"].ravel() == [64 + 2 * (n % 8) for n in range(12)]).all()


def test_uints_become_the_nearest_float() -> None:
    pairs = [(a + d, 0) for a in (2**24, 2**31, 2**32 - 1024, 5 * 2**28) for d in range(-600, 600) if a + d < UINT]
    both = np.array(pairs, np.uint32).T[0]
    got = run(f"float({READ.split('=')[1].split('), ')[0]}))", (both >> 16).astype(np.float32),
              (both & 0xFFFF).astype(np.float32))  # fmt: skip
    assert (got == both.astype(np.float32)).all()


def test_floats_become_uints_toward_zero_and_saturate() -> None:
    x = np.float32([0.9, -0.9, -5, 3e9, 2147483648, 2147483520, 4294967040, 4294967296, 1e20, np.inf, -np.inf, np.nan])
    low, high = run_program(lowered("r = uint(x)\nreturn vec2(float(r & 0xFFFF), float(r >> 16))", "vec2"), x)
    want = [0, 0, 0, 3000000000, 2**31, 2147483520, 4294967040, UINT - 1, UINT - 1, UINT - 1, 0, 0]
    assert (low.astype(np.int64) + 65536 * high.astype(np.int64)).tolist() == want


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ("return float(uint(1) + int(x))", "int and uint do not mix by themselves: write uint"),
        ("return float(uint(1) > -1)", r"from 0 to 4294967295, got -1; write uint\(-1\) for its bits"),
        ("u = uint(1)\nu = int(x)\nreturn x", "do not mix by themselves"),
        ("u = uint(1)\nu = x\nreturn x", r"narrowing is never silent: write uint\(...\)"),
        ("a = [1.0, 2.0]\nreturn a[uint(1)]", "an index must be int, got uint"),
        ("t = 0\nfor i in range(uint(3)): t += i\nreturn x", "must be int, got uint"),
        ("return float(uint(3000000000))", "as 0xb2d05e00"),
        ("return float(uvec2(1, 2, 3).x)", "uvec2.. takes 2 components, got 3"),
        ("return pack_half2x16(x)", r"pack_half2x16\(v\) must be vec2, got float"),
        ("a, b, c = modf(x)\nreturn a", "3"),
        ("return ldexp(x, x)", "narrowing is never silent"),
    ],
)
def test_what_does_not_fit_is_an_error_that_says_how_to_mend_it(lines: str, message: str) -> None:
    with pytest.raises(KernelError, match=message):
        parsed(lines)


def test_written_ints_are_uints_where_one_is_wanted() -> None:
    text = """
def half(a: uint) -> uint:
    return a >> 1

def k(c: Image) -> float:
    u = uint(7)
    u = u * 2 + (3 if c[0, 0].x > 0.0 else 4) if c[0, 0].y > 9.0 else u + 0xFFFFFFFF
    u += 1
    return float(half(0xFFFFFFFE)) + float(u) + float([1, u][1])
"""
    with pytest.raises(KernelError, match="do not mix"):  # a choice of two written ints is an int
        pg.kernel(source=text)
    made = pg.kernel(source=text.replace("u * 2 + (3 if c[0, 0].x > 0.0 else 4) if c[0, 0].y > 9.0 else ", ""))
    (literal,) = {i for output in made_program(made).outputs for i in output.values}
    assert isinstance(literal, s.Lit) and literal.value == float(np.float32(2147483647.0 + 14.0))


def made_program(kernel: Any) -> s.ScalarProgram:
    from passgraph.language.lower import Facts, lower

    return lower(kernel.program, Facts())


def test_programs_hold_uints_as_ints() -> None:
    program = lowered("u = uint(x) * 0x9E3779B9\nreturn float(u % 10 + max(u, 3) // 7)")
    kinds = {v.type for i in s.walk(program.body) for v in s.results_of(i)}
    assert kinds == {"float", "int", "bool"}


@pytest.mark.parametrize("value", [0, 4294967295, np.uint32(2**31), np.uint64(7), True, 2147483648])
def test_the_host_hands_in_uints(value: Any) -> None:
    text = "def k(c: Image, u: uint) -> vec4: return vec4(float(u & 0xFFFF), float(u >> 16), 0.0, 0.0)"
    made = pg.kernel(source=text)(pg.Input("c"), value, into=pg.target("o", "rgba32f"))
    with pg.compile(made, backend="reference") as program:
        got = program(c=np.zeros((1, 1, 4), np.float32))["o"][0, 0]
    assert got[0] + 65536 * got[1] == int(value)


@pytest.mark.parametrize("value", [-1, 4294967296, np.int64(-5), 1.5, (1, 2), np.float32(2)])
def test_what_is_no_uint_is_refused(value: Any) -> None:
    made = pg.kernel(source="def k(c: Image, u: uint) -> float: return float(u)")
    with pytest.raises((InputError, PassgraphError), match="uint"):
        made(pg.Input("c"), value, into=pg.target("o", "r32f"))


def test_uints_of_the_host_are_captured_as_uints() -> None:
    seed, pair = pg.uint(0xFFFFFFFF), pg.uvec2(0x80000000, 1)

    @pg.kernel
    def k(c: pg.Image, by: pg.uint = 0xFFFFFFFF) -> pg.vec4:  # type: ignore[assignment]
        return pg.vec4(float(seed >> 31), float(pair.x >> 31), float(by >> 31), c[0, 0].x)

    with pg.compile(k(pg.Input("c"), into=pg.target("o", "rgba32f")), backend="reference") as program:
        assert program(c=np.full((1, 1, 4), 5, np.float32))["o"][0, 0].tolist() == [1, 1, 1, 5]
    for wrong in (-1, UINT):
        with pytest.raises(PassgraphError, match="from 0 to 4294967295"):
            pg.uint(wrong)


def test_kernels_of_uints_travel() -> None:
    text = "def k(c: Image, u: uvec2, n: Const[uint] = 0xFFFFFFFF) -> float: return float((u.x ^ n) % 0xFFFFFFF0 > u.y)"
    made = pg.kernel(source=text)(pg.Input("c"), (3000000000, 7), into=pg.target("o", "r32f"))
    data = pg.to_data(made)
    again = pg.from_data(data)
    assert pg.to_data(again) == data
    frame = np.zeros((1, 1, 4), np.float32)
    results = []
    for outputs in (made, again):
        with pg.compile(outputs, backend="reference") as program:
            results.append(float(next(iter(program(c=frame).values()))[0, 0].item()))
    assert results[0] == results[1] == float(((3000000000 ^ 0xFFFFFFFF) % 0xFFFFFFF0) > 7)


def test_every_binary16_comes_back() -> None:
    every = np.arange(65536, dtype=np.int64)
    numbers = every.astype(np.uint16).view(np.float16).astype(np.float32)
    got = run("float_of_half(uint(x))", every.astype(np.float32))
    assert np.array_equal(got, numbers, equal_nan=True)
    back = run("float(half_bits(x))", numbers)
    assert (back == every)[~np.isnan(numbers)].all()
    assert np.isnan(run("float_of_half(half_bits(x))", numbers[np.isnan(numbers)])).all()


def test_halves_round_to_the_nearest_even() -> None:
    bits = RANDOM.integers(-(2**31), 2**31, 200_000).astype(np.int32).view(np.float32)
    near = RANDOM.normal(0, 1, 200_000).astype(np.float16).astype(np.float32)
    x = np.concatenate([bits[np.isfinite(bits)], near * np.float32(1 + 2.0**-11), RANDOM.uniform(-7e4, 7e4, 99999)])
    x = x.astype(np.float32)
    with np.errstate(over="ignore"):
        want = x.astype(np.float16).view(np.uint16)
    assert (run("float(half_bits(x))", x) == want).all()


def test_modf_and_frexp_are_those_of_the_host() -> None:
    x = np.concatenate([np.exp2(RANDOM.uniform(-125, 127, 5000)) * RANDOM.choice([-1, 1], 5000), [0.0, 1.0, -2.0, 0.5]])
    x = x.astype(np.float32)
    got = run("vec4(modf(x)[0], modf(x)[1], frexp(x)[0], float(frexp(x)[1]))", x, result="vec4")
    rest, whole = np.modf(x)
    mantissa, exponent = np.frexp(x)
    assert np.array_equal(got, np.stack([whole, rest, mantissa, exponent.astype(np.float32)], -1))
    tiny = np.concatenate([np.exp2(RANDOM.uniform(-149, -126, 2000)), [2.0**-149, -(2.0**-149), 2.0**-127, 2.0**-126]])
    tiny = tiny.astype(np.float32)
    got = run("vec2(frexp(x)[0], float(frexp(x)[1]))", tiny, result="vec2")
    assert np.array_equal(got, np.stack(np.frexp(tiny), -1).astype(np.float32))
    special = run("vec2(modf(x)[1], frexp(x)[0])", np.float32([np.inf, -np.inf, np.nan]), result="vec2")
    assert np.array_equal(special, [[0, np.inf], [0, -np.inf], [np.nan, np.nan]], equal_nan=True)


def test_ldexp_is_exact_up_to_the_ends_of_float32() -> None:
    x = RANDOM.normal(0, 1, 40_000).astype(np.float32) * np.exp2(RANDOM.integers(-120, 120, 40_000)).astype(np.float32)
    n = RANDOM.integers(-320, 320, 40_000).astype(np.float32)
    got = run("ldexp(x, int(y))", x, n)
    with np.errstate(over="ignore", under="ignore"):
        want = np.ldexp(x.astype(np.float64), n.astype(int)).astype(np.float32)
    normal = np.abs(want) >= 2.0**-126
    assert (got == want)[normal].all() and (np.abs(got[~normal]) <= 2.0**-126).all()


@pytest.mark.parametrize(
    ("one", "meaning"),
    [
        ("length(x)", lambda x, y, z: np.abs(x)),
        ("distance(x, y)", lambda x, y, z: np.abs(x - y)),
        ("dot(x, y)", lambda x, y, z: x * y),
        ("normalize(x)", lambda x, y, z: np.sign(x)),
        ("faceforward(x, y, z)", lambda x, y, z: np.where(z * y < 0, x, -x)),
        ("reflect(x, y)", lambda x, y, z: x - 2 * (y * x) * y),
        ("mix(x, y, z > 0.0)", lambda x, y, z: np.where(z > 0, y, x)),
        ("mix(vec2(x, y), vec2(y, z), less(vec2(x, z), vec2(0.0))).y", lambda x, y, z: np.where(z < 0, z, y)),
    ],
)
def test_single_floats_have_the_functions_of_vectors(one: str, meaning: Callable[..., Column]) -> None:
    columns = [(RANDOM.integers(-16, 17, 500) / 4).astype(np.float32) for _ in range(3)]
    assert (run(one, *columns) == meaning(*columns)).all()


# GLSL itself, on Mesa

GLSL_FORMS = {
    "u / v": "u // v",
    "u % v": "u % v",
    "u >> (v & 31u)": "u >> v",
    "uint(int(u) / int(v))": "quotient(int(u), int(v))",
    "uint(bitCount(u))": "bit_count(u)",
    "uint(findLSB(int(u)))": "find_lsb(int(u))",
    "uint(findMSB(u))": "find_msb(u)",
    "uint(findMSB(int(u)))": "find_msb(int(u))",
    "bitfieldReverse(u)": "bitfield_reverse(u)",
    "bitfieldExtract(u, int(v & 15u), int(v >> 4 & 15u))": "bitfield_extract(u, int(v & 15), int((v >> 4) & 15))",
    "uint(bitfieldExtract(int(u), int(v & 15u), int(v >> 4 & 15u)))":
        "bitfield_extract(int(u), int(v & 15), int((v >> 4) & 15))",
    "bitfieldInsert(u, v, int(v & 15u), 9)": "bitfield_insert(u, v, int(v & 15), 9)",
    "packUnorm4x8(unpackSnorm4x8(u))": "pack_unorm4x8(unpack_snorm4x8(u))",
    "packSnorm4x8(unpackUnorm4x8(u) - 0.25)": "pack_snorm4x8(unpack_unorm4x8(u) - 0.25)",
    "packUnorm2x16(unpackSnorm2x16(u))": "pack_unorm2x16(unpack_snorm2x16(u))",
    "packSnorm2x16(unpackUnorm2x16(u) - 0.25)": "pack_snorm2x16(unpack_unorm2x16(u) - 0.25)",
    "packHalf2x16(unpackSnorm4x8(u).xy * 70000.0)": "pack_half2x16(unpack_snorm4x8(u).xy * 70000.0)",
    "floatBitsToUint(unpackHalf2x16(u & 0x7BFF7BFFu).y)":
        "uint(bits_from_float(unpack_half2x16(u & 0x7BFF7BFF).y))",
}  # fmt: skip


COMPUTE = """#version 430
layout(local_size_x = 1) in;
layout(std430, binding = 0) buffer Given { uvec2 given[]; };
layout(std430, binding = 1) buffer Made { uint made[]; };
void main() {
    uint i = gl_GlobalInvocationID.x, u = given[i].x, v = given[i].y;
    made[i] = FORM;
}
"""


@pytest.fixture(scope="module")
def glsl() -> Iterator[Any]:
    require("gl")
    from tests.offscreen import offscreen

    with offscreen(430) as context:
        yield context


@pytest.mark.parametrize("form", GLSL_FORMS)
def test_glsl_means_the_same(glsl: Any, form: str) -> None:
    pairs = [(a, b) for a, b in PAIRS if b and (signed(a), signed(b)) != (-(2**31), -1)]
    program = glsl.compute_shader(COMPUTE.replace("FORM", form))
    given = glsl.buffer(struct.pack(f"<{2 * len(pairs)}I", *(n for pair in pairs for n in pair)))
    made = glsl.buffer(reserve=4 * len(pairs))
    given.bind_to_storage_buffer(0)
    made.bind_to_storage_buffer(1)
    program.run(len(pairs))
    glsl.finish()
    want: NDArray[np.uint32] = np.frombuffer(made.read(), "<u4")
    got = np.array(computed(GLSL_FORMS[form], pairs), np.int64)
    bad = np.flatnonzero(got != want)
    assert not len(bad), (pairs[bad[0]], hex(got[bad[0]]), hex(want[bad[0]]), len(bad))
