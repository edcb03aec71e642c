"""The kernel language: the names that kernels use, and the way from text to scalar program.

``from passgraph.language import Image, vec4`` imports names for kernels.  The first use of one imports all modules
that define some.

>>> import passgraph as pg
>>> from passgraph.language import Image, vec4
>>> @pg.kernel
... def invert(color: Image) -> vec4:
...     return vec4(1.0 - color[0, 0].rgb, 1.0)

Read the modules in the order in which they process a kernel:
1. :mod:`.types`, :mod:`.symbols` (names for users), :mod:`.source`, :mod:`.scope` (names, and hints for names of other
   languages), :mod:`.kernel`.
2. :mod:`.signature` with :mod:`.parameter_limits` and :mod:`.long_arrays`; :mod:`.parse`, :mod:`.function_body`,
   :mod:`.statements`, :mod:`.assignments`, :mod:`.expressions`, :mod:`.image_reads`, :mod:`.values`,
   :mod:`.composites` and :mod:`.typing_rules` (to :mod:`.ir`); :mod:`.looping` for other front ends; behind them
   :mod:`.quad_derivatives`.
3. :mod:`.operations`, the table: a row is an :mod:`.operation`; rows are in :mod:`.primitives`, :mod:`.functions`,
   :mod:`.vectors` and :mod:`.whole_numbers`, with :mod:`.meanings`, :mod:`.prelude`, :mod:`.prelude_whole` and
   :mod:`.library` (:mod:`.stubs` writes the stubs of rows and the list of names below); border rules:
   :mod:`.border_rules`, :mod:`.borders`.
4. :mod:`.facts`, :mod:`.sized`, :mod:`.lower` with :mod:`.lower_loops`, :mod:`.lower_arrays` and :mod:`.value_ranges`,
   :mod:`.expand`, :mod:`.evaluate` and :mod:`.emitter` (to :mod:`.scalar`), :mod:`.lower_cache` (from disk),
   :mod:`.uniform_layout`.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from passgraph.forking import importing

if TYPE_CHECKING:
    from passgraph.language.functions import *  # noqa: F403 (every name of the kernel language)
    from passgraph.language.primitives import *  # noqa: F403
    from passgraph.language.symbols import *  # noqa: F403
    from passgraph.language.vectors import *  # noqa: F403
    from passgraph.language.whole_numbers import *  # noqa: F403

# Names of kernels, written by passgraph.language.stubs.
__all__ = [
    "Array", "Const", "Image", "Vertex", "acos", "acosh", "asin", "asinh", "atan", "atanh", "bit_count",
    "bitfield_extract", "bitfield_insert", "bitfield_reverse", "bits_from_float", "bvec2", "bvec3", "bvec4", "ceil",
    "clamp", "cos", "cosh", "cross", "dFdx", "dFdy", "degrees", "determinant", "dfdx", "dfdy", "discard", "distance",
    "dot", "equal", "exp", "exp2", "faceforward", "find_lsb", "find_msb", "float_from_bits", "float_of_half", "floor",
    "fma", "fract", "fragment_depth", "frexp", "front_facing", "fwidth", "greater", "greater_equal", "half_bits",
    "inverse", "inversesqrt", "isfinite", "isinf", "isnan", "ivec2", "ivec3", "ivec4", "ldexp", "length", "less",
    "less_equal", "log", "log10", "log2", "mat2", "mat2x3", "mat2x4", "mat3", "mat3x2", "mat3x4", "mat4", "mat4x2",
    "mat4x3", "mix", "mod", "modf", "normalize", "not_equal", "outer", "output_size", "pack_half2x16",
    "pack_snorm2x16", "pack_snorm4x8", "pack_unorm2x16", "pack_unorm4x8", "pixel", "quotient", "radians", "reflect",
    "refract", "remainder", "saturate", "select", "sign", "sin", "sinh", "smoothstep", "sqrt", "step", "tan", "tanh",
    "transpose", "trunc", "uint", "unpack_half2x16", "unpack_snorm2x16", "unpack_snorm4x8", "unpack_unorm2x16",
    "unpack_unorm4x8", "uv", "uvec2", "uvec3", "uvec4", "vec2", "vec3", "vec4",
]  # fmt: skip
# End of the names.


def __getattr__(name: str) -> Any:
    """Import the names of the language at the first use of one."""
    if name not in __all__:
        raise AttributeError(f"module 'passgraph.language' has no attribute {name!r}")
    with importing:
        for module in ("functions", "primitives", "symbols", "vectors", "whole_numbers"):
            rows = import_module(f"passgraph.language.{module}")
            globals().update({public: getattr(rows, public) for public in rows.__all__})
    return globals()[name]


def __dir__() -> list[str]:
    return sorted({*__all__, *(name for name in globals() if name.startswith("_"))})
