"""Probes of arithmetic: a few rows of arguments, an expression in each language, and its results."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from passgraph.verify.probes.probe import (
    DTYPES,
    Bench,
    Expression,
    Language,
    Probe,
    Program,
    Said,
    Stage,
    Type,
    listed,
    rows_of,
)

NAN, INF, TINY, LEAST_INT = float("nan"), float("inf"), 2.0**-126, -(2**31)
SHADERS: tuple[Language, ...] = ("glsl", "wgsl")
_GLSL, _WGSL, _CL = "GLSL 4.60", "WGSL", "OpenCL C 3.0"
_FLOATS = f"{_GLSL} 4.7.1"
_ANY = "any result"
#: Facts of a product that is added: two roundings, or one.
TWICE, ONCE = "two roundings", "one rounding"
_FUSED = (1.0 + 2.0**-12, 1.0 + 2.0**-12, -(1.0 + 2.0**-11))
_NEVER: Mapping[Language, Said] = {"wgsl": Said("either", f"{_WGSL}, Reassociation and Fusion", (TWICE, ONCE))}
Read = Callable[[NDArray[Any]], str]


def expression(
    name: str,
    part: str,
    asks: str,
    code: str | Mapping[Language, str],
    rows: Sequence[Sequence[float | int]],
    result: Type = "float",
    said: Mapping[Language, Said] | None = None,
    numpy: Callable[..., Any] | None = None,
    read: Read = listed,
    stage: Stage = "fragment",
    **details: Any,
) -> Probe:
    """Return the probe of an expression; a text for all languages sets ``r``, and ``numpy`` takes the columns.

    OpenCL has but one stage, so it takes part unless the stage is "vertex".
    """
    words = rows_of(*rows)
    texts = dict.fromkeys((*SHADERS, "opencl"), code) if isinstance(code, str) else dict(code)
    if stage == "vertex":
        texts.pop("opencl", None)

    programs = {
        language: Program(text, result, "compute" if language == "opencl" else stage, **details)
        for language, text in texts.items()
    }

    def measuring(program: Program) -> Callable[[Bench], str]:
        return lambda bench: read(bench.compute(program, words).view(DTYPES[result]))

    measure: dict[Language, Callable[[Any], str]] = {
        language: measuring(program) for language, program in programs.items()
    }
    if numpy is not None:
        measure["numpy"] = lambda bench: read(np.asarray(bench.evaluate(numpy, rows), DTYPES[result]))
    listing = {language: Expression(program, words) for language, program in programs.items() if read is listed}
    return Probe(name, part, asks, measure, said or {}, listing if stage == "fragment" else {})


def named(facts: Mapping[str, str]) -> Read:
    """Return a reader that gives results a name; those without one are listed."""
    return lambda numbers: facts.get(listed(numbers), listed(numbers))


def _sum_of_product(numbers: NDArray[Any]) -> str:
    return {0.0: TWICE, 2.0**-24: ONCE}.get(float(numbers[0]), listed(numbers))


def _denormals(numbers: NDArray[Any]) -> str:
    """Read a product that is denormal, and one of a denormal."""
    result, argument = ("flushed" if number == 0 else "kept" for number in numbers)
    return f"{result}, {argument}"


def _fused(name: str, asks: str, **details: Any) -> Probe:
    return expression(name, "Sums and products", asks, rows=[_FUSED], read=_sum_of_product, **details)


def _in_stage(stage: Stage) -> tuple[Probe, Probe]:
    said: Mapping[Language, Said] = {
        "glsl": Said("either", _FLOATS, (TWICE, ONCE)), "opencl": Said("either", f"{_CL} 6.15.2.1", (TWICE, ONCE)),
        **_NEVER,
    }  # fmt: skip
    flushes: Mapping[Language, Said] = {
        "glsl": Said("may be flushed", _FLOATS), "wgsl": Said("may be flushed", f"{_WGSL}, Differences from IEEE-754"),
        "opencl": Said("may be flushed without CL_FP_DENORM", f"{_CL} 7.2"),
    }  # fmt: skip
    is_last = stage == "compute"
    texts: dict[Language, str] = dict.fromkeys((*SHADERS, *(("opencl",) if is_last else ())), "r = a * b + c;")
    products: dict[Language, str] = dict.fromkeys(texts, "r = a * b;")
    return (
        _fused(f"fused-{stage}", f"`a * b + c`, {stage} stage", code=texts, said=said, stage=stage,
               numpy=(lambda a, b, c: a * b + c) if is_last else None),
        expression(f"denormals-{stage}", "Denormals, zeros and infinities",
                   f"product that is denormal, product of a denormal; {stage} stage", products,
                   [(TINY, 0.5), (TINY / 4.0, 2.0**24)], said=flushes, stage=stage, read=_denormals,
                   numpy=(lambda a, b: a * b) if is_last else None),
    )  # fmt: skip


_STAGES = tuple(probe for stage in get_args(Stage) for probe in _in_stage(stage))
_SUMS = (
    *(probe for probe in _STAGES if probe.name.startswith("fused")),
    _fused(
        "fused-forbidden", "`a * b + c` that must round twice (`precise`, `FP_CONTRACT OFF`)",
        code={"glsl": "r = a * b + c;", "opencl": "r = a * b + c;"}, qualifier="precise", version=400,
        before="#ifdef __OPENCL_VERSION__\n#pragma OPENCL FP_CONTRACT OFF\n#endif\n",
        said={"glsl": Said("two", f"{_GLSL} 8.3, fma", (TWICE,)), "opencl": Said("two", f"{_CL} 6.15.2.1", (TWICE,))},
    ),
    _fused(
        "fused-unoptimized", "`a * b + c`, `-cl-opt-disable`", code={"opencl": "r = a * b + c;"},
        options=("-cl-opt-disable",), said={"opencl": Said("either", f"{_CL} 6.15.2.1", (TWICE, ONCE))},
    ),
    _fused(
        "fma", "`fma(a, b, c)`", code={"glsl": "r = fma(a, b, c);", "wgsl": "r = fma(a, b, c);",
        "opencl": "r = fma(a, b, c);"},
        version=400, said={"glsl": Said("either", _FLOATS, (TWICE, ONCE)), "opencl": Said("one", f"{_CL} 6.15.2",
        (ONCE,)),
        **_NEVER},
    ),
    expression(
        "reordered", "Sums and products", "`(a + b) - b` for 1, 1e8", "r = (a + b) - b;", [(1.0, 1e8)],
        numpy=lambda a, b: (a + b) - b,
        said={"glsl": Said("0 or 1", f"{_GLSL} 4.7.1, the `precise` qualifier"), "opencl": Said("0", f"{_CL} 7.4",
        ("0",)),
              "wgsl": Said("0 or 1", f"{_WGSL}, Reassociation and Fusion", ("0", "1"))},
    ),
    expression(
        "mix-at-one", "Sums and products", "`mix(a, b, 1)` for 1e8, 1", "r = mix(a, b, c);", [(1e8, 1.0, 1.0)],
        numpy=lambda a, b, c: a * (np.float32(1) - c) + b * c,
        said={"glsl": Said("as a(1 - c) + bc: 1", f"{_GLSL} 8.3", ("1",)), "opencl": Said("as a + (b - a)c: 0",
        f"{_CL} 6.15.4"),
              "wgsl": Said("as a(1 - c) + bc: 1, or as a + (b - a)c: 0", f"{_WGSL}, mix", ("0", "1"))},
    ),
)  # fmt: skip


_UNDEFINED: Mapping[Language, Said] = {"glsl": Said("either operand", f"{_GLSL} 8.3", ("1, 1", "1, NaN", "NaN, 1",
"NaN, NaN")),
              "wgsl": Said(_ANY, f"{_WGSL}, Finite Math Assumption"),
              "opencl": Said("undefined", f"{_CL} 6.15.4")}  # fmt: skip
_NANS = (
    expression("min-nan", "NaN", "`min(NaN, 1)`, `min(1, NaN)`", "r = min(a, b);", [(NAN, 1.0), (1.0, NAN)],
               said=_UNDEFINED, numpy=np.minimum),
    expression("max-nan", "NaN", "`max(NaN, 1)`, `max(1, NaN)`", "r = max(a, b);", [(NAN, 1.0), (1.0, NAN)],
               said=_UNDEFINED, numpy=np.maximum),
    expression("fmin-nan", "NaN", "`fmin(NaN, 1)`, `fmax(1, NaN)`",
               {"opencl": "r = i == 0x3f800000 ? fmax(a, b) : fmin(a, b);"},
               [(NAN, 1.0), (1.0, NAN)], said={"opencl": Said("the number", f"{_CL} 6.15.2", ("1, 1",))},
               numpy=np.fmin),
    expression("clamp-nan", "NaN", "`clamp(NaN, 0, 1)`", "r = clamp(a, b, c);", [(NAN, 0.0, 1.0)],
               said={"glsl": Said(_ANY, f"{_GLSL} 8.3"), "wgsl": Said(_ANY, f"{_WGSL}, Finite Math Assumption"),
                     "opencl": Said("undefined", f"{_CL} 6.15.4")}, numpy=np.clip),
    expression("nan-compared", "NaN", "NaN `==`, `!=`, `<` itself (as bits 1, 2, 4)",
               {"glsl": "r = (a == a ? 1 : 0) + (a != a ? 2 : 0) + (a < a ? 4 : 0);",
                "opencl": "r = (a == a ? 1 : 0) + (a != a ? 2 : 0) + (a < a ? 4 : 0);",
                "wgsl": "r = select(0, 1, a == a) + select(0, 2, a != a) + select(0, 4, a < a);"},
               [(NAN,)], "int", read=named({"2": "only !="}),
               said={"opencl": Said("only !=", f"{_CL} 6.5.4", ("only !=",)), "glsl": Said("correct result", _FLOATS,
               ("only !=",)),
                     "wgsl": Said(_ANY, f"{_WGSL}, Finite Math Assumption")},
               numpy=lambda a: (a == a) * 1 + (a != a) * 2 + (a < a) * 4),
    expression("isnan", "NaN", "`isnan(NaN)`, `isnan(0 / 0)`, `isinf(1 / 0)`",
               {"glsl": "r = (c == 2.0 ? isinf(a / b) : isnan(c == 1.0 ? a / b : a)) ? 1 : 0;",
                "opencl": "r = (c == 2.0f ? isinf(a / b) : isnan(c == 1.0f ? a / b : a)) ? 1 : 0;"},
               [(NAN, 0.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 2.0)], "int",
               said={"glsl": Said("1 of a NaN that is there", f"{_GLSL} 8.3"), "opencl": Said("1, 1, 1",
               f"{_CL} 6.15.6", ("1, 1, 1",))}),
    expression("infinity-less-itself", "NaN", "`a - a` for ∞, `a * 0` for NaN", "r = a * b - (a * b) * c;",
               [(INF, 1.0, 1.0), (NAN, 0.0, 0.0)], numpy=lambda a, b, c: a * b - (a * b) * c,
               said={"opencl": Said("NaN, NaN", f"{_CL} 7.2", ("NaN, NaN",)), "glsl": Said(_ANY, _FLOATS),
                     "wgsl": Said(_ANY, f"{_WGSL}, Finite Math Assumption")}),
    expression("sign-nan", "NaN", "`sign(NaN)`", "r = sign(a);", [(NAN,)], numpy=np.sign,
               said={"glsl": Said(_ANY, _FLOATS), "wgsl": Said(_ANY, f"{_WGSL}, Finite Math Assumption"),
                     "opencl": Said("0", f"{_CL} 6.15.4", ("0",))}),
)  # fmt: skip


_IEEE = "∞, -∞, NaN"
_ZEROS = (
    *(probe for probe in _STAGES if probe.name.startswith("denormals")),
    expression("divided-by-zero", "Denormals, zeros and infinities", "`a / b` for 1 / 0, -1 / 0, 0 / 0", "r = a / b;",
               [(1.0, 0.0), (-1.0, 0.0), (0.0, 0.0)], numpy=lambda a, b: a / b,
               said={"glsl": Said("∞, -∞, NaN or another", _FLOATS), "wgsl": Said(_ANY,
               f"{_WGSL}, Finite Math Assumption"),
                     "opencl": Said(_IEEE, f"{_CL} 6.5.1", (_IEEE,))}),
    expression("minus-zero", "Denormals, zeros and infinities", "`-0 + 0`, `0 * -1`", "r = a * b + c;",
               [(-0.0, 1.0, 0.0), (0.0, -1.0, -0.0)], numpy=lambda a, b, c: a * b + c,
               said={"opencl": Said("0, -0", f"{_CL} 7.4", ("0, -0",)), "glsl": Said("0, -0", _FLOATS, ("0, -0",)),
                     "wgsl": Said("any sign", f"{_WGSL}, Differences from IEEE-754", ("0, -0", "0, 0", "-0, -0",
                     "-0, 0"))}),
    expression("length-beyond", "Denormals, zeros and infinities", "`length(vec2(1e20, 0))`",
               {"glsl": "r = length(vec2(a, b));", "wgsl": "r = length(vec2<f32>(a, b));",
               "opencl": "r = length((float2)(a, b));"},
               [(1e20, 0.0)], numpy=lambda a, b: np.hypot(a, b),
               said={"glsl": Said("as sqrt(x² + y²): ∞ or 1e20", f"{_GLSL} 8.5"), "wgsl": Said("as sqrt(dot(e, e))",
               f"{_WGSL}, length"),
                     "opencl": Said("1e+20", f"{_CL} 6.15.5", ("1e+20",))}),
    expression("normalize-small", "Denormals, zeros and infinities", "`normalize(vec2(1e-30, 0)).x`, of zero",
               {"glsl": "r = normalize(vec2(a, b)).x;", "wgsl": "r = normalize(vec2<f32>(a, b)).x;",
                "opencl": "r = normalize((float2)(a, b)).x;"}, [(1e-30, 0.0), (0.0, 0.0)],
               said={"glsl": Said(_ANY, f"{_GLSL} 8.5"), "wgsl": Said(_ANY, f"{_WGSL}, normalize"),
                     "opencl": Said("1, any", f"{_CL} 6.15.5")}),
)  # fmt: skip


_INTEGERS = (
    expression("int-divided-by-zero", "Integers", "`i / 0` for 7, -7", "r = i / j;", [(7, 0), (-7, 0)], "int",
               said={"glsl": Said("undefined", f"{_GLSL} 4.1.3"), "wgsl": Said("i: 7, -7",
               f"{_WGSL}, Arithmetic Expressions", ("7, -7",)),
                     "opencl": Said("unspecified, no exception", f"{_CL} 6.5.1")}, numpy=lambda i,
                     j: np.int32(i) // np.int32(j)),
    expression("int-remainder-of-zero", "Integers", "`i % 0` for 7, -7", "r = i % j;", [(7, 0), (-7, 0)], "int",
               said={"glsl": Said("undefined", f"{_GLSL} 5.9"), "wgsl": Said("0, 0",
               f"{_WGSL}, Arithmetic Expressions", ("0, 0",)),
                     "opencl": Said("unspecified, no exception", f"{_CL} 6.5.1")}, numpy=lambda i,
                     j: np.int32(i) % np.int32(j)),
    expression("uint-divided-by-zero", "Integers", "`u / 0` for 7", "r = u / v;", [(7, 0)], "uint",
               said={"glsl": Said("undefined", f"{_GLSL} 4.1.3"), "wgsl": Said("u: 7",
               f"{_WGSL}, Arithmetic Expressions", ("7",)),
                     "opencl": Said("unspecified, no exception", f"{_CL} 6.5.1")}, numpy=lambda i,
                     j: np.uint32(i) // np.uint32(j)),
    expression("least-int-divided", "Integers", "`-2³¹ / -1`", "r = i / j;", [(LEAST_INT, -1)], "int",
               said={"glsl": Said("undefined", f"{_GLSL} 4.1.3"), "wgsl": Said("-2³¹",
               f"{_WGSL}, Arithmetic Expressions", ("-2³¹",)),
                     "opencl": Said("unspecified, no exception", f"{_CL} 6.5.1")}, numpy=lambda i,
                     j: np.int32(i) // np.int32(j)),
    expression("least-int-remainder", "Integers", "`-2³¹ % -1`", "r = i % j;", [(LEAST_INT, -1)], "int",
               said={"glsl": Said("undefined", f"{_GLSL} 5.9"), "wgsl": Said("0", f"{_WGSL}, Arithmetic Expressions",
               ("0",)),
                     "opencl": Said("unspecified, no exception", f"{_CL} 6.5.1")}, numpy=lambda i,
                     j: np.int32(i) % np.int32(j)),
    expression("negative-remainder", "Integers", "`-7 % 3`, `7 % -3`", "r = i % j;", [(-7, 3), (7, -3)], "int",
               said={"glsl": Said("undefined", f"{_GLSL} 5.9"), "wgsl": Said("-1, 1",
               f"{_WGSL}, Arithmetic Expressions", ("-1, 1",)),
                     "opencl": Said("-1, 1", f"{_CL} 6.5.1", ("-1, 1",))}, numpy=lambda i,
                     j: np.int32(i) % np.int32(j)),
    expression("shift-too-far", "Integers", "`1 << 32`, `1 << 33`, `-8 >> 33`",
               {"glsl": "r = i < 0 ? i >> v : i << v;", "opencl": "r = i < 0 ? i >> v : i << v;",
               "wgsl": "r = select(i << v, i >> v, i < 0);"},
               [(1, 32), (1, 33), (-8, 33)], "int",
               said={"glsl": Said("undefined", f"{_GLSL} 5.9"), "wgsl": Said("modulo 32: 1, 2, -4",
               f"{_WGSL}, Bit Expressions", ("1, 2, -4",)),
                     "opencl": Said("modulo 32: 1, 2, -4", f"{_CL} 6.5.10", ("1, 2, -4",))},
               numpy=lambda i, j: np.where(np.int32(i) < 0, np.int32(i) >> np.int32(j), np.int32(i) << np.int32(j))),
    expression("high-words", "Integers", "`umulExtended` of 2³²-1 and itself, high word: of variables, of constants",
               {"glsl": "uint x, y; if (i == -1) umulExtended(u, v, x, y); "
                        "else umulExtended(4294967295u, 4294967295u, x, y); r = x;"},
               [(-1, -1), (0, 0)], "uint", version=400, said={"glsl": Said("2³²-2, twice", f"{_GLSL} 8.8",
               ("4294967294, 4294967294",))}),
    expression("no-bit", "Integers", "position of the highest bit of 0; of -1",
               {"glsl": "r = findMSB(i);", "wgsl": "r = firstLeadingBit(i);",
               "opencl": "r = 31 - (int)clz(i < 0 ? ~i : i);"},
               [(0,), (-1,)], "int", version=400,
               said={"glsl": Said("-1, -1", f"{_GLSL} 8.8", ("-1, -1",)),
                     "wgsl": Said("-1, -1", f"{_WGSL}, firstLeadingBit", ("-1, -1",)),
                     "opencl": Said("-1, -1", f"{_CL} 6.15.3", ("-1, -1",))}),
)  # fmt: skip


def half_rounding(numbers: NDArray[Any]) -> str:
    """Read 1 + 2⁻¹¹, 1 + 3·2⁻¹¹, and a number just above the first, as halves."""
    known = {
        (0x3C00, 0x3C02, 0x3C01): "nearest, halves to even", (0x3C00, 0x3C01, 0x3C00): "toward zero",
        (0x3C01, 0x3C02, 0x3C01): "nearest, halves up",
    }  # fmt: skip
    one, two, three = (int(number) & 0xFFFF for number in numbers)
    return known.get((one, two, three), f"0x{one:04x}, 0x{two:04x}, 0x{three:04x}")


def half_bits(numbers: NDArray[Any]) -> str:
    """Read halves as numbers."""
    return listed((numbers & 0xFFFF).astype(np.uint16).view(np.float16).astype(np.float32))


HALVES = ((1.0 + 2.0**-11,), (1.0 + 3.0 * 2.0**-11,), (1.0 + 2.0**-11 + 2.0**-20,))
BEYOND = ((65519.0,), (65520.0,), (1e9,))
_PACK: Mapping[Language, str] = {
    "glsl": "r = packHalf2x16(vec2(a, 0.0));", "wgsl": "r = pack2x16float(vec2<f32>(a, 0.0));",
    "opencl": "ushort h; vstore_half(a, 0, (half *)&h); r = h;",
}  # fmt: skip
_ROUNDINGS = ("nearest, halves to even", "toward zero")
_CONVERSIONS = (
    expression("float-to-int", "Conversions", "`int(a)` for 3e9, -3e9, ∞, NaN",
               {"glsl": "r = int(a);", "wgsl": "r = i32(a);", "opencl": "r = (int)a;"},
               [(3e9,), (-3e9,), (INF,), (NAN,)], "int", numpy=lambda a: a.astype(np.int32),
               said={"glsl": Said("undefined", f"{_GLSL} 5.4.1"), "opencl": Said("implementation-defined",
               f"{_CL} 6.4.3.3"),
                     "wgsl": Said("2³¹-128, -2³¹, 2³¹-128, any", f"{_WGSL}, Floating Point Conversion",
                     begins="2³¹-128, -2³¹, ")}),
    expression("float-to-int-saturated", "Conversions", "`convert_int_sat(a)` for 3e9, -3e9, ∞, NaN",
               {"opencl": "r = convert_int_sat(a);"},
               [(3e9,), (-3e9,), (INF,), (NAN,)], "int",
               said={"opencl": Said("2³¹-1, -2³¹, 2³¹-1, 0", f"{_CL} 6.4.3.3", ("2³¹-1, -2³¹, 2³¹-1, 0",))}),
    expression("float-to-uint", "Conversions", "`uint(a)` for -1.5, 5e9, NaN",
               {"glsl": "r = uint(a);", "wgsl": "r = u32(a);", "opencl": "r = (uint)a;"},
               [(-1.5,), (5e9,), (NAN,)], "uint", numpy=lambda a: a.astype(np.uint32),
               said={"glsl": Said("undefined", f"{_GLSL} 5.4.1"), "opencl": Said("implementation-defined",
               f"{_CL} 6.4.3.3"),
                     "wgsl": Said("0, 2³²-256, any", f"{_WGSL}, Floating Point Conversion", begins="0, 2³²-256, ")}),
    expression("int-to-float", "Conversions", "`float(i)` for 2²⁴+1, 2²⁴+3, as 2²⁴ + …",
               {"glsl": "r = float(i) - 16777216.0;", "wgsl": "r = f32(i) - 16777216.0;",
               "opencl": "r = (float)i - 16777216.0f;"},
               [(16777217,), (16777219,)], read=named({"0, 4": "nearest, halves to even", "0, 2": "toward zero"}),
               numpy=lambda i: np.int32(i).astype(np.float32) - np.float32(16777216),
               said={"glsl": Said("within 1 ULP", _FLOATS, ("nearest, halves to even", "toward zero", "2, 4")),
                     "opencl": Said("nearest, halves to even", f"{_CL} 6.4.3.2", ("nearest, halves to even",)),
                     "wgsl": Said("up or down", f"{_WGSL}, Floating Point Conversion")}),
    expression("half-rounding", "Conversions", "rounding of float to half (`packHalf2x16`, `vstore_half`)", _PACK,
               HALVES, "uint",
               read=half_rounding, numpy=lambda a: a.astype(np.float16).view(np.uint16),
               version=420, said={"glsl": Said("either neighbor", "OpenGL 4.6 2.3.4.2"), "wgsl": Said("either neighbor",
               f"{_WGSL}, Floating Point Conversion"),
                     "opencl": Said("nearest, halves to even", f"{_CL} 6.15.7", ("nearest, halves to even",))}),
    expression("half-beyond", "Conversions", "float to half of 65519, 65520, 1e9", _PACK, BEYOND, "uint",
               read=half_bits, numpy=lambda a: a.astype(np.float16).view(np.uint16),
               version=420, said={"glsl": Said("65504 or ∞", "OpenGL 4.6 2.3.4.2"), "wgsl": Said(_ANY,
               f"{_WGSL}, pack2x16float"),
                     "opencl": Said("65504, ∞, ∞", f"{_CL} 6.15.7", ("65504, ∞, ∞",))}),
    expression("half-denormal", "Conversions", "half 2⁻²⁴ read, and 2⁻²⁴ made a half",
               {"glsl": "r = i == 1 ? unpackHalf2x16(u).x * 16777216.0 : float(packHalf2x16(vec2(a, 0.0)));",
                "wgsl": "r = select(f32(pack2x16float(vec2<f32>(a, 0.0))), unpack2x16float(u).x * 16777216.0, i == 1);",
                "opencl": "ushort h = (ushort)u; if (i == 1) r = vload_half(0, (half *)&h) * 16777216.0f; else "
                          "{ vstore_half(a, 0, (half *)&h); r = (float)h; }"},
               [(1,), (2.0**-24,)], read=named({"1, 1": "kept, kept", "0, 0": "flushed, flushed",
               "1, 0": "kept, flushed",
                                                "0, 1": "flushed, kept"}),
               version=420, said={"glsl": Said("may be flushed", _FLOATS), "wgsl": Said("may be flushed",
               f"{_WGSL}, Differences from IEEE-754"),
                     "opencl": Said("kept, kept", f"{_CL} 6.3.1.2", ("kept, kept",))}),
    expression("round-halves", "Conversions", "`round(a)` for 0.5, 1.5, 2.5", "r = round(a);", [(0.5,), (1.5,), (2.5,)],
               read=named({"0, 2, 2": "to even", "1, 2, 3": "away from zero"}), numpy=np.round,
               said={"glsl": Said("either", f"{_GLSL} 8.3", ("to even", "away from zero", "0, 1, 2")),
                     "wgsl": Said("to even", f"{_WGSL}, round", ("to even",)), "opencl": Said("away from zero",
                     f"{_CL} 6.15.2", ("away from zero",))}),
    expression("bytes-packed", "Conversions", "`packUnorm4x8` of 0.5 (127.5 steps), of NaN",
               {"glsl": "r = packUnorm4x8(vec4(a, 0.0, 0.0, 0.0));",
               "wgsl": "r = pack4x8unorm(vec4<f32>(a, 0.0, 0.0, 0.0));"},
               [(0.5,), (NAN,)], "uint",
               version=400, said={"glsl": Said("as round: 127 or 128, any", f"{_GLSL} 8.4"), "wgsl": Said("128, any",
               f"{_WGSL}, pack4x8unorm")}),
    expression("fract-below-zero", "Conversions", "`fract(-2⁻³⁰)`",
               {"glsl": "r = fract(a);", "wgsl": "r = fract(a);", "opencl": "float whole; r = fract(a, &whole);"},
               [(-(2.0**-30),)],
               read=lambda numbers: "1" if numbers[0] == 1 else "below 1" if numbers[0] > 0.9 else listed(numbers),
               numpy=lambda a: a - np.floor(a),
               said={"glsl": Said("as x - floor(x): 1", f"{_GLSL} 8.3"), "wgsl": Said("1 or below", f"{_WGSL}, fract"),
                     "opencl": Said("below 1", f"{_CL} 6.15.2", ("below 1",))}),
)  # fmt: skip


_DOMAINS = (
    expression("pow-negative", "Functions outside of their domain", "`pow(-2, 2)`, `pow(0, 0)`", "r = pow(a, b);",
               [(-2.0, 2.0), (0.0, 0.0)], numpy=np.power,
               said={"glsl": Said("undefined", f"{_GLSL} 8.2"), "wgsl": Said(_ANY, f"{_WGSL}, pow"),
               "opencl": Said("4, 1", f"{_CL} 7.5", ("4, 1",))}),
    expression("sqrt-negative", "Functions outside of their domain", "`sqrt(-1)`, `sqrt(-0)`", "r = sqrt(a);", [(-1.0,
               ), (-0.0,)], numpy=np.sqrt,
               said={"glsl": Said("undefined, -0", f"{_GLSL} 8.2"), "wgsl": Said("any, 0 or -0", f"{_WGSL}, sqrt"),
                     "opencl": Said("NaN, -0", f"{_CL} 7.5", ("NaN, -0",))}),
    expression("log-zero", "Functions outside of their domain", "`log2(0)`, `log2(-1)`, `log2` of a denormal",
               "r = log2(a);",
               [(0.0,), (-1.0,), (2.0**-140,)], numpy=np.log2,
               said={"glsl": Said("undefined, undefined, -140 or as of 0", f"{_GLSL} 8.2"), "wgsl": Said(_ANY,
               f"{_WGSL}, log2"),
                     "opencl": Said("-∞, NaN, -140 or -∞", f"{_CL} 7.5", ("-∞, NaN, -140", "-∞, NaN, -∞"))}),
    expression("exp-beyond", "Functions outside of their domain", "`exp2(128)`, `exp2(-126.5)`, `exp2(-149)`",
               "r = exp2(a);",
               [(128.0,), (-126.5,), (-149.0,)], numpy=np.exp2,
               read=lambda found: listed(found[:1]) + "".join(", flushed" if n == 0 else ", kept" for n in found[1:]),
               said={"glsl": Said("∞, denormals may be flushed", _FLOATS),
               "wgsl": Said("any, denormals may be flushed", f"{_WGSL}, exp2"),
                     "opencl": Said("∞, denormals may be flushed", f"{_CL} 7.2", ("∞, kept, kept",
                     "∞, flushed, flushed", "∞, kept, flushed"))}),
    expression("atan-zero", "Functions outside of their domain", "`atan(0, 0)`, `atan(-0, -1)`",
               {"glsl": "r = atan(a, b);", "wgsl": "r = atan2(a, b);", "opencl": "r = atan2(a, b);"}, [(0.0, 0.0),
               (-0.0, -1.0)], numpy=np.arctan2,
               said={"glsl": Said("undefined, -π or π", f"{_GLSL} 8.1"), "wgsl": Said("any, -π or π",
               f"{_WGSL}, atan2"),
                     "opencl": Said("0, -π", f"{_CL} 7.5", ("0, -3.14159",))}),
    expression("sin-far", "Functions outside of their domain", "`sin(a)` for 1e5, 1e8", "r = sin(a);", [(1e5,), (1e8,
               )], numpy=np.sin,
               read=lambda numbers: listed(np.round(numbers, 3)),
               said={"glsl": Said("undefined precision; exact 0.036, 0.932", _FLOATS),
               "wgsl": Said("any beyond [-π, π]", f"{_WGSL}, Floating Point Accuracy"),
                     "opencl": Said("0.036, 0.932", f"{_CL} 7.4", ("0.036, 0.932",))}),
    expression("sinpi-whole", "Functions outside of their domain", "`sinpi(1)`, `sinpi(-1)`, `cospi(0.5)`",
               {"opencl": "r = b == 0.0f ? sinpi(a) : cospi(a);"}, [(1.0, 0.0), (-1.0, 0.0), (0.5, 1.0)],
               said={"opencl": Said("0, -0, 0", f"{_CL} 7.5.1", ("0, -0, 0",))}),
    expression("smoothstep-equal", "Functions outside of their domain", "`smoothstep(1, 1, a)` for 0, 1, 2",
               "r = smoothstep(b, c, a);",
               [(0.0, 1.0, 1.0), (1.0, 1.0, 1.0), (2.0, 1.0, 1.0)],
               said={"glsl": Said("undefined", f"{_GLSL} 8.3"), "wgsl": Said(_ANY, f"{_WGSL}, smoothstep"),
               "opencl": Said("undefined", f"{_CL} 6.15.4")}),
    expression("mod-zero", "Functions outside of their domain", "`mod(a, b)` for 5.5, 0; -1, ∞",
               {"glsl": "r = mod(a, b);", "wgsl": "r = a % b;", "opencl": "r = fmod(a, b);"},
               [(5.5, 0.0), (-1.0, INF)], numpy=np.fmod,
               said={"glsl": Said("as x - y floor(x/y): NaN, NaN", f"{_GLSL} 8.3"), "wgsl": Said(_ANY,
               f"{_WGSL}, Arithmetic Expressions"),
                     "opencl": Said("NaN, -1", f"{_CL} 7.5", ("NaN, -1",))}),
    expression("ldexp-below", "Functions outside of their domain", "`ldexp(1, -130)`, `ldexp(1, 128)`",
               "r = ldexp(a, j);", [(1.0, -130), (1.0, 128)],
               read=lambda numbers: ("flushed" if numbers[0] == 0 else "kept") + ", " + listed(numbers[1:]),
               version=400, said={"glsl": Said("may be flushed, undefined", f"{_GLSL} 8.3"),
               "wgsl": Said("may be flushed, any",
               f"{_WGSL}, ldexp"),
                     "opencl": Said("kept or flushed, ∞", f"{_CL} 7.4", ("kept, ∞", "flushed, ∞"))}),
)  # fmt: skip

ARITHMETIC = (*_SUMS, *_NANS, *_ZEROS, *_INTEGERS, *_CONVERSIONS, *_DOMAINS)
