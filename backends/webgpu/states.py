"""Fixed-function state of draws as WebGPU descriptors."""

from __future__ import annotations

from typing import Any

from passgraph.backends.webgpu.textures import Stored
from passgraph.formats import Format
from passgraph.graph.draw_state import Blend, DrawState

_FACTORS = {
    "source_color": "src", "one_minus_source_color": "one-minus-src",
    "source_alpha": "src-alpha", "one_minus_source_alpha": "one-minus-src-alpha",
    "destination_color": "dst", "one_minus_destination_color": "one-minus-dst",
    "destination_alpha": "dst-alpha", "one_minus_destination_alpha": "one-minus-dst-alpha",
}  # fmt: skip
#: Comparisons that hold for equal numbers.
_TRUE_OF_EQUALS = ("always", "equal", "less_equal", "greater_equal")
_STENCIL = {"increment": "increment-clamp", "decrement": "decrement-clamp"}
#: Triangles are clipped at up to 8 times the target's size, not at its edges: clipping rounds the end of an edge to a
#: subpixel, which changes the covered pixels.  Powers of two, because dividing by them is exact.
GUARD_BANDS = (8, 4, 2)


def guard_band(size: tuple[int, int], side: int) -> int:
    """Return how many times larger than the target the viewport of a draw can be: 8, 4, 2 or 1."""
    return next((times for times in GUARD_BANDS if max(size) * times <= side), 1)


def color_target(
    stored: Stored, format_: Format, blend: Blend | None, mask: tuple[bool, bool, bool, bool]
) -> dict[str, Any]:
    """Return a color target; alpha of a three-channel target stays 1, the value of a missing alpha on reads."""
    written = sum(1 << k for k in range(4) if mask[k] and not (k == 3 and format_.channels == 3))
    target: dict[str, Any] = {"format": stored.name, "write_mask": written}
    if blend is not None:
        color = _component(blend.source, blend.destination, blend.equation)
        target["blend"] = {"color": color, "alpha": _component(*blend.alpha_terms)}
    return target


def _component(source: str, destination: str, equation: str) -> dict[str, str]:
    if equation in ("min", "max"):  # WebGPU allows no factors with these, and OpenGL ignores them
        source = destination = "one"
    operation = equation.replace("_", "-")
    return {
        "src_factor": _FACTORS.get(source, source),
        "dst_factor": _FACTORS.get(destination, destination),
        "operation": operation,
    }


def primitive(state: DrawState) -> dict[str, Any]:
    return {"topology": "triangle-list", "front_face": "ccw", "cull_mode": state.cull}


def depth_stencil(state: DrawState, format_: Format, name: str) -> dict[str, Any]:
    factor, units = state.polygon_offset
    found: dict[str, Any] = {
        "format": name,
        "depth_write_enabled": state.depth_write,
        "depth_compare": state.depth_compare.replace("_", "-"),
        "depth_bias": int(units),
        "depth_bias_slope_scale": factor,
    }
    stencil = state.stencil
    if stencil is not None and format_.stencil:
        compare, read_mask = stencil.compare, stencil.read_mask
        if not read_mask and not stencil.write_mask:
            # wgpu omits a stencil test with two empty masks, which compares 0 with 0 whatever the stencil holds.
            compare, read_mask = "always" if compare in _TRUE_OF_EQUALS else "never", 0xFF
        face = {
            "compare": compare.replace("_", "-"),
            "fail_op": _operation(stencil.fail),
            "depth_fail_op": _operation(stencil.depth_fail),
            "pass_op": _operation(stencil.passed),
        }
        found |= {
            "stencil_front": face,
            "stencil_back": face,
            "stencil_read_mask": read_mask,
            "stencil_write_mask": stencil.write_mask,
        }
    return found


def _operation(name: str) -> str:
    return _STENCIL.get(name, name).replace("_", "-")
