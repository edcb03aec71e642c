"""Probes of pictures and rasterization, which no shader computes: stored numbers, filters, blending, coverage."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.srgb import linear_to_srgb, srgb_to_linear
from passgraph.verify.probes.arithmetic import BEYOND, HALVES, half_bits, half_rounding
from passgraph.verify.probes.gl_bench import GLBench
from passgraph.verify.probes.probe import Bench, Language, Probe, Said, listed

_STORED, _DRAWN = "Pictures", "Triangles"
_DEVICES: tuple[Language, ...] = ("glsl", "wgsl", "opencl")
_DRAWING: tuple[Language, ...] = ("glsl", "wgsl")
_GL, _VULKAN, _CL = "OpenGL 4.6", "Vulkan 1.4", "OpenCL C 3.0"
#: Coordinates between two texels at which filters are sampled; steps of a pixel by which corners are moved.
_FINE, _STEPS = 4096, 1024


def _probe(
    name: str, part: str, asks: str, measure: Callable[[Any], str], languages: tuple[Language, ...],
    **said: tuple[Any, ...],
) -> Probe:  # fmt: skip
    return Probe(
        name,
        part,
        asks,
        dict.fromkeys(languages, measure),
        {key: Said(*text) for key, text in said.items()},  # type: ignore[misc]
    )


def _colors(numbers: Any) -> NDArray[np.float32]:
    return np.repeat(np.asarray(numbers, np.float32)[:, None], 4, 1)


def _rounding(format: str, steps: int) -> Callable[[Bench], str]:
    """Return the largest distance of stored numbers from the exact ones, in steps of a format."""

    def measured(bench: Bench) -> str:
        values = np.linspace(0.0, 1.0, 4093, dtype=np.float32)
        stored = bench.store(format, _colors(values))[:, 0].astype(np.float64)
        error = np.abs(stored - values.astype(np.float64) * steps).max()
        # the exact product is rounded to float32 before
        return "nearest" if error <= 0.5 + steps * 2.0**-23 else f"up to {error:.3f} steps off"

    return measured


def _bytes_of_specials(bench: Bench) -> str:
    return listed(bench.store("rgba8", _colors([np.nan, np.inf, -np.inf]))[:, 0].astype(np.int32))


def _halves(rows: Any, read: Callable[[Any], str]) -> Callable[[Bench], str]:
    def measured(bench: Bench) -> str:
        stored = bench.store("rgba16f", _colors([row[0] for row in rows]))[:, 0]
        return read(np.ascontiguousarray(stored).view(np.uint16).astype(np.uint32))

    return measured


def _half_denormal(bench: Bench) -> str:
    stored = bench.store("rgba16f", _colors([2.0**-24]))[0, 0]
    read = bench.load("rgba16f", np.full((1, 4), 2.0**-24, np.float16))[0, 0]
    return f"{'kept' if stored else 'flushed'}, {'kept' if read else 'flushed'}"


def _decoding(format: str, exact: Callable[[Any], Any], stored: Callable[[Any], Any]) -> Callable[[Bench], str]:
    """Return the largest error of the 256 values of bytes: in ULP, or in steps of a byte where that is more than 50."""

    def measured(bench: Bench) -> str:
        numbers = np.arange(256, dtype=np.uint8)
        read = bench.load(format, np.repeat(numbers[:, None], 4, 1))[:, 0].astype(np.float64)
        true = np.asarray(exact(np.arange(256) / 255.0))
        unit = np.spacing(np.maximum(true, 2.0**-16).astype(np.float32)).astype(np.float64)
        error = (np.abs(read - true) / unit).max()
        if error > 50:
            return f"up to {np.abs(np.asarray(stored(read)) * 255.0 - numbers).max():.2g} steps off"
        return "correctly rounded" if error <= 0.501 else f"up to {error:.2g} ULP off"

    return measured


def _encoding(bench: Bench) -> str:
    """Count numbers whose sRGB byte is not the nearest, and state the largest distance."""
    values = np.linspace(0.0, 1.0, 4093, dtype=np.float32)
    stored = bench.store("rgba8_srgb", _colors(values))[:, 0].astype(np.float64)
    error = np.abs(stored - np.asarray(linear_to_srgb(values.astype(np.float64))) * 255.0).max()
    return "nearest" if error <= 0.5 else f"up to {error:.3f} steps off"


def _weights(bench: Bench) -> str:
    """Return the number of bits of filter weights, from how many values there are between two texels."""
    texels = np.array([0, 255], np.uint8)
    at = (0.25 + np.arange(_FINE + 1) / _FINE / 2.0).astype(np.float32)
    distinct = len(np.unique(bench.sample(texels, at, True)))
    bits = np.log2(max(2, distinct) - 1)
    return f"{bits:.0f} bits" if bits < 11.5 else "float32"


def _nearest_tie(bench: Bench) -> str:
    """Return the texel that is read exactly between two, and the one just below."""
    below = np.nextafter(np.float32(0.5), np.float32(0))
    found = bench.sample(np.array([0, 255], np.uint8), np.array([0.5, below], np.float32), False)
    return ", ".join("right" if value > 0.5 else "left" for value in found)


def _faint(bench: Bench) -> str:
    """Add 0.4 of a byte's step a hundred times."""
    added = int(bench.store("rgba8", _colors([0.4 / 255.0]), 100)[0, 0])
    return {0: "stored each time: 0", 40: "not rounded: 40", 100: "source rounded up: 100"}.get(added, str(added))


def _scaled(bench: Bench) -> str:
    """Add half of 0.6 of a byte's step, which the source's alpha scales: a source that is rounded first gives 1."""
    added = int(bench.store("rgba8", np.array([[0.6 / 255.0] * 3 + [0.5]], np.float32), 1)[0, 0])
    return {0: "not rounded first", 1: "rounded first"}.get(added, str(added))


def _triangle_grid(bench: Bench) -> str:
    """Return the grid on which corners lie, from the place where a steep edge crosses a column of pixels."""
    count, height = 129, 2048
    corners = []
    for k in range(count):
        left = 4 * k + 1.0 + k / _STEPS  # the edge leans by one pixel over the height
        corners += [(left, 0.0), (left + 1.0, height), (4 * k + 3.0, 0.0)]
    drawn = bench.cover(np.array(corners, np.float32), (4 * count, height))
    rows = drawn[:, 1::4].sum(0)
    steps = len(np.unique(rows)) - 1
    return f"1/{_STEPS * steps // (count - 1)} pixel" + (" or finer" if steps == count - 1 else "")


def _rectangle(x0: float, y0: float, x1: float, y1: float) -> list[tuple[float, float]]:
    return [(x0, y0), (x1, y0), (x0, y1), (x1, y0), (x1, y1), (x0, y1)]


def _ties(bench: Bench) -> str:
    """Name the edges that own the pixels whose centers lie on them; y grows as coordinates of the framebuffer do."""
    drawn = bench.cover(np.array(_rectangle(1.5, 1.5, 4.5, 4.5), np.float32), (6, 6))
    columns, rows = drawn.max(0), drawn.max(1)
    edges = {"left": columns[1], "right": columns[4], "small y": rows[1], "large y": rows[4]}
    return ", ".join(name for name, owns in edges.items() if owns) or "none"


def _samples(bench: Bench) -> str:
    """Return the places of four samples in sixteenths of a pixel, along x and along y, from edges that cross them."""
    found = []
    for axis in (0, 1):
        corners: list[tuple[float, float]] = []
        for k in range(17):  # each pixel of a row is covered up to k sixteenths; a sample there is not
            box = (k, 0.0, k + k / 16.0, 1.0) if axis == 0 else (k, 0.0, k + 1.0, k / 16.0)
            corners += _rectangle(*box)
        covered = bench.cover(np.array(corners, np.float32), (17, 1), 4)[0]
        found.append(" ".join(str(int(np.searchsorted(covered, share - 0.01)) - 1) for share in (0.25, 0.5, 0.75, 1.0)))
    return f"x {found[0]}, y {found[1]}"


def _mips(bench: Bench) -> str:
    """Return the texels of the level below 0, 128, 255; and below 0, 0, 0, 0, 255."""
    levels = [bench.mipmap(np.array([row], np.uint8))[0].astype(np.int32) for row in ([0, 128, 255], [0, 0, 0, 0, 255])]
    return "; ".join(listed(level) for level in levels)


def _pasting(bench: GLBench) -> str:
    text = "#define JOINED(x, y) x##y\nout vec4 color; void main() { float ab = 1.0; color = vec4(JOINED(a, b)); }\n"
    return "joins tokens" if bench.compiles(text) else "does not compile"


_QUAD = """out vec4 color;
void main() {
    float x = gl_FragCoord.x * gl_FragCoord.x;
    color = vec4(-1.0);
    BRANCH color = vec4(dFdx(x));
}
"""


def _divergent(bench: GLBench) -> str:
    """Compare derivatives in a branch that one pixel of two takes with those outside of it."""
    size = (8, 2)
    everywhere = bench.draw(_QUAD.replace("BRANCH", ""), size)[..., 0]
    alone = bench.draw(_QUAD.replace("BRANCH", "if ((int(gl_FragCoord.x) & 1) == 1)"), size)[..., 0]
    taken = alone[:, 1::2]
    return "as outside" if np.array_equal(taken, everywhere[:, 1::2]) else f"others, such as {float(taken[0, 0]):g}"


def _differences(bench: GLBench) -> str:
    """Find whether both rows of a quad share a derivative that differs between them."""
    text = "out vec4 color; void main() { float f = gl_FragCoord.x * gl_FragCoord.y; color = vec4(dFdx(f)); }\n"
    drawn = bench.draw(text, (2, 2))[..., 0]
    return "one a quad" if drawn[0, 0] == drawn[1, 0] else "one a row"


_STORING = (
    _probe("bytes-stored", _STORED, "rounding into `rgba8`", _rounding("rgba8", 255), _DEVICES,
           glsl=("nearest preferred, either neighbor allowed", f"{_GL} 2.3.5.2"), wgsl=("either neighbor",
           f"{_VULKAN}, Fixed-Point Data Conversion"),
           opencl=("nearest preferred, up to 0.6 steps", f"{_CL} 8.3.1.3")),
    _probe("shorts-stored", _STORED, "rounding into `rgba16`", _rounding("rgba16", 65535), _DEVICES,
           glsl=("nearest preferred, either neighbor allowed", f"{_GL} 2.3.5.2"), wgsl=("either neighbor",
           f"{_VULKAN}, Fixed-Point Data Conversion"),
           opencl=("nearest preferred, up to 0.6 steps", f"{_CL} 8.3.1.3")),
    _probe("halves-stored", _STORED, "rounding into `rgba16f`", _halves(HALVES, half_rounding), _DEVICES,
           glsl=("either neighbor", f"{_GL} 2.3.4.2"), wgsl=("either neighbor",
           f"{_VULKAN}, 16-Bit Floating-Point Numbers"),
           opencl=("nearest, halves to even, or toward zero", f"{_CL} 8.3.2", ("nearest, halves to even",
           "toward zero"))),
    _probe("halves-beyond", _STORED, "65519, 65520 and 1e9 into `rgba16f`", _halves(BEYOND, half_bits), _DEVICES,
           glsl=("65504 or ∞", f"{_GL} 2.3.4.2"), wgsl=("65504 or ∞", f"{_VULKAN}, 16-Bit Floating-Point Numbers"),
           opencl=("65504 or ∞", f"{_CL} 8.3.2")),
    _probe("halves-special", _STORED, "NaN, ∞ and -∞ into `rgba16f`", _halves(((np.nan,), (np.inf,), (-np.inf,)),
           half_bits), _DEVICES,
           glsl=("NaN or a number, ∞, -∞", f"{_GL} 2.3.4.2"), wgsl=("any", "WGSL, Finite Math Assumption"),
           opencl=("NaN, ∞, -∞", f"{_CL} 8.3.2", ("NaN, ∞, -∞",))),
    _probe("half-denormals", _STORED, "half 2⁻²⁴ written, read", _half_denormal, _DEVICES,
           glsl=("may be flushed", f"{_GL} 2.3.4.2"), wgsl=("may be flushed",
           f"{_VULKAN}, 16-Bit Floating-Point Numbers"),
           opencl=("may be flushed, kept", f"{_CL} 8.3.2", ("kept, kept", "flushed, kept"))),
    _probe("bytes-special", _STORED, "NaN, ∞ and -∞ into `rgba8`", _bytes_of_specials, _DEVICES,
           glsl=("any, 255, 0", f"{_GL} 2.3.5.2"), wgsl=("any", "WGSL, Finite Math Assumption"), opencl=("any, 255, 0",
           f"{_CL} 8.3.1.3")),
    _probe("bytes-read", _STORED, "`rgba8` read: k / 255", _decoding("rgba8", lambda x: x, lambda x: x), _DEVICES,
           glsl=("k / 255", f"{_GL} 2.3.5.1"), wgsl=("k / 255", f"{_VULKAN}, Fixed-Point Data Conversion"),
           opencl=("up to 1.5 ULP", f"{_CL} 8.3.1.1")),
    _probe("srgb-read", _STORED, "`rgba8_srgb` read", _decoding("rgba8_srgb", srgb_to_linear, linear_to_srgb), _DEVICES,
           glsl=("as the formula", f"{_GL} 8.24"), wgsl=("as the formula", "Khronos Data Format 1.4, 13.3"),
           opencl=("within 0.5 ULP of the byte", f"{_CL} 8.3.5")),
    _probe("srgb-stored", _STORED, "rounding into `rgba8_srgb`", _encoding, _DEVICES,
           glsl=("as the formula", f"{_GL} 17.3.7"), wgsl=("as the formula", "Khronos Data Format 1.4, 13.3"),
           opencl=("up to 0.6 steps", f"{_CL} 8.3.5")),
    _probe("filter-bits", _STORED, "bits of the weights of linear filters", _weights, _DEVICES,
           glsl=("not said", f"{_GL} 8.14.2"), wgsl=("at least 4 bits", f"{_VULKAN}, subTexelPrecisionBits"),
           opencl=("not said", f"{_CL} 8.2")),
    _probe("nearest-tie", _STORED, "texel read between two, and just below", _nearest_tie, _DEVICES,
           glsl=("right, left", f"{_GL} 8.14.2"), wgsl=("right, left", f"{_VULKAN}, Texel Coordinate Systems"),
           opencl=("right, left", f"{_CL} 8.2")),
    _probe("mipmaps", _STORED, "next level of 0 128 255; of 0 0 0 0 255", _mips, ("glsl",),
           glsl=("no filter is required, a box is recommended", f"{_GL} 8.14.4")),
    _probe("blend-faint", _STORED, "0.4 steps added 100 times to `rgba8`", _faint, _DRAWING,
           glsl=("the source may be rounded first", f"{_GL} 17.3.6"), wgsl=("the source may be rounded first",
           f"{_VULKAN}, Blending")),
    _probe("blend-source", _STORED, "source of 0.6 steps, blended into `rgba8` by its alpha, 0.5", _scaled, _DRAWING,
           glsl=("the source may be rounded first", f"{_GL} 17.3.6"), wgsl=("the source may be rounded first",
           f"{_VULKAN}, Blending")),
)  # fmt: skip
_DRAWS = (
    _probe("corner-grid", _DRAWN, "grid of corners", _triangle_grid, _DRAWING,
           glsl=("1/16 pixel or finer", f"{_GL} table 23.54, SUBPIXEL_BITS"), wgsl=("1/16 pixel or finer",
           f"{_VULKAN}, subPixelPrecisionBits")),
    _probe("ties", _DRAWN, "edges that own the pixels on them", _ties, _DRAWING,
           glsl=("one of two that share an edge", f"{_GL} 14.6.1"), wgsl=("one of two that share an edge",
           f"{_VULKAN}, Basic Polygon Rasterization")),
    _probe("sample-places", _DRAWN, "places of 4 samples, sixteenths of a pixel", _samples, _DRAWING,
           glsl=("not said", f"{_GL} 14.3.1"),
           wgsl=("2 6 10 14 each", "WebGPU, Rasterization", ("x 2 6 10 14, y 2 6 10 14",))),
    _probe("derivative-parts", _DRAWN, "`dFdx` of a quad", _differences, ("glsl",), glsl=("either",
           "GLSL 4.60 8.14.1")),
    _probe("derivative-branch", _DRAWN, "`dFdx` in a branch that every second pixel takes", _divergent, ("glsl",),
           glsl=("undefined", "GLSL 4.60 8.14.1")),
    _probe("token-pasting", _DRAWN, "`##` in a macro", _pasting, ("glsl",), glsl=("joins tokens", "GLSL 4.60 3.3",
           ("joins tokens",))),
)  # fmt: skip

PICTURES = (*_STORING, *_DRAWS)
