"""Generated code behind the fragment kernel: stencil, depth, blending, masks."""

from __future__ import annotations

from passgraph.backends.numpy.jit import indented
from passgraph.draw_state import Blend, Stencil
from passgraph.formats import Format
from passgraph.plan.data import DrawStep

#: A comparison of the new value with the held one.
COMPARE = {
    "never": "False", "less": "{0} < {1}", "equal": "{0} == {1}", "less_equal": "{0} <= {1}", "greater": "{0} > {1}",
    "not_equal": "{0} != {1}", "greater_equal": "{0} >= {1}", "always": "True",
}  # fmt: skip
_STENCIL = {
    "keep": "held", "zero": "0", "replace": "{reference}", "increment": "min(held + 1, 255)",
    "increment_wrap": "(held + 1) & 255", "decrement": "max(held - 1, 0)", "decrement_wrap": "(held - 1) & 255",
    "invert": "held ^ 255",
}  # fmt: skip


def stencil_compare(stencil: Stencil) -> list[str]:
    test = COMPARE[stencil.compare].format(stencil.reference & stencil.read_mask, f"(held & {stencil.read_mask})")
    return ["held = int64(stencil[uint64(i)])", f"stencil_passes = {test}"]


def merge_lines(step: DrawStep, tests: list[str], write_depth: list[str], kernel: list[str]) -> list[str]:
    """Tests, updates, and colour where both tests pass; ``kernel`` runs only there unless it ran before."""
    stencil = step.state.stencil
    colour = [*write_depth, *kernel, *_colour(step)]
    lines = list(tests)
    if stencil is not None:
        lines += _stencil_update(stencil)
    return [*lines, "if stencil_passes and depth_passes:", *indented(colour or ["pass"])]


def _stencil_update(stencil: Stencil) -> list[str]:
    texts = {name: _STENCIL[op].format(reference=stencil.reference) for name, op in (
        ("passed", stencil.passed), ("depth_fail", stencil.depth_fail), ("fail", stencil.fail))}  # fmt: skip
    if stencil.write_mask == 0 or set(texts.values()) == {"held"}:
        return []
    keep, change = 255 & ~stencil.write_mask, stencil.write_mask
    choice = f"({texts['passed']} if depth_passes else {texts['depth_fail']}) if stencil_passes else {texts['fail']}"
    return [f"changed = {choice}", f"stencil[uint64(i)] = uint8((held & {keep}) | (changed & {change}))"]


def _colour(step: DrawStep) -> list[str]:
    lines: list[str] = []
    place = 0
    outputs = step.fragment.outputs if step.fragment is not None else ()
    blends = step.state.blend or (None,) * len(step.outputs)
    masks = step.state.color_mask or ((True,) * 4,) * len(step.outputs)
    specs = step.source.into
    for number, (output, blend, mask, spec) in enumerate(zip(outputs, blends, masks, specs, strict=True)):
        count = len(output.values)
        values = [f"r[{place + channel}]" for channel in range(count)]
        place += count
        if blend is not None:
            more, values = _blend(blend, values, number, spec.format)
            lines += more
        for channel, value in enumerate(values):
            if mask[channel]:
                lines.append(f"out{number}[uint64(i * {count} + {channel})] = {value}")
    return lines


def _blend(blend: Blend, values: list[str], number: int, format_: Format) -> tuple[list[str], list[str]]:
    """Source and destination, each times its factor, combined, then quantised to the target's format."""
    count = len(values)
    clamped = bool(format_.steps)
    quantize = f"pg_quantize({{0}}, float32({format_.low}), float32({format_.steps}.0))" if clamped else (
        "pg_quantize_half({0})" if format_.unit else "{0}"
    )  # fmt: skip
    lines = []
    for channel, value in enumerate(values):
        # Written so that NaN becomes the least number.
        low = f"float32({format_.low})"
        source = f"min({value} if {value} > {low} else {low}, float32(1.0))" if clamped else value
        lines.append(f"b{number}_s{channel} = {source}")
        lines.append(f"b{number}_d{channel} = out{number}[uint64(i * {count} + {channel})]")
    results = []
    for channel in range(count):
        alpha = channel == 3
        source_factor, destination_factor, equation = (
            blend.alpha_terms if alpha else (blend.source, blend.destination, blend.equation)
        )
        s, d = f"b{number}_s{channel}", f"b{number}_d{channel}"
        scaled_s = _times(s, source_factor, number, channel, count)
        scaled_d = _times(d, destination_factor, number, channel, count)
        text = {
            "add": f"{scaled_s} + {scaled_d}", "subtract": f"{scaled_s} - {scaled_d}",
            "reverse_subtract": f"{scaled_d} - {scaled_s}", "min": f"min({s}, {d})", "max": f"max({s}, {d})",
        }[equation]  # fmt: skip
        results.append(quantize.format(text))
    lines += [f"b{number}_r{channel} = {text}" for channel, text in enumerate(results)]
    return lines, [f"b{number}_r{channel}" for channel in range(count)]


def _times(value: str, factor: str, number: int, channel: int, count: int) -> str:
    """``value * factor``; a target without alpha has destination alpha 1, a result without alpha likewise."""
    source_alpha = f"b{number}_s3" if count == 4 else "float32(1.0)"
    destination_alpha = f"b{number}_d3" if count == 4 else "float32(1.0)"
    names = {
        "source_color": f"b{number}_s{channel}", "destination_color": f"b{number}_d{channel}",
        "source_alpha": source_alpha, "destination_alpha": destination_alpha,
    }  # fmt: skip
    if factor == "zero":
        return "float32(0.0)"
    if factor == "one":
        return value
    if factor.startswith("one_minus_"):
        return f"{value} * (float32(1.0) - {names[factor.removeprefix('one_minus_')]})"
    return f"{value} * {names[factor]}"
