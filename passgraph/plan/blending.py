"""Blending as a kernel, which combines the source color and the destination pixel.

A blend into a format is one kernel text, from ``source`` (the fragment's result) and ``destination`` (the stored value)
to the new value.  The reference and the oracle interpret its typed representation and quantize the result as for any
kernel.  Other backends print or run the scalar program, which includes quantization.
"""

from __future__ import annotations

from functools import cache

from passgraph.formats import Format
from passgraph.graph.draw_state import Blend
from passgraph.language import ir
from passgraph.language.facts import Facts
from passgraph.language.library import functions_of
from passgraph.language.lower import lower
from passgraph.language.parse import parse_kernel
from passgraph.language.scalar import ScalarProgram
from passgraph.language.source import Source

#: Factor → ``{x}`` times it; ``s``, ``d``, ``sa`` and ``da`` are source, destination and their alphas.  Factor zero
#: gives 0 even for infinities.
_TERMS = {
    "zero": "{zero}",
    "one": "{x}",
    "source_color": "{x} * {s}",
    "one_minus_source_color": "{x} * (1.0 - {s})",
    "destination_color": "{x} * {d}",
    "one_minus_destination_color": "{x} * (1.0 - {d})",
    "source_alpha": "{x} * {sa}",
    "one_minus_source_alpha": "{x} * (1.0 - {sa})",
    "destination_alpha": "{x} * {da}",
    "one_minus_destination_alpha": "{x} * (1.0 - {da})",
}
#: Equation → combination of both terms; min and max ignore the factors, as in OpenGL.
_EQUATIONS = {
    "add": "{source} + {destination}",
    "subtract": "{source} - {destination}",
    "reverse_subtract": "{destination} - {source}",
    "min": "min({s}, {d})",
    "max": "max({s}, {d})",
}


def blend_text(blend: Blend, format_: Format) -> str:
    """Return the kernel text of a blend; a target without alpha counts as opaque.

    >>> from passgraph.formats import FORMATS
    >>> print(blend_text(Blend("source_alpha", "one_minus_source_alpha", source_alpha="one"), FORMATS["rgba8"]))
    def blended(source: vec4, destination: vec4) -> vec4:
        s = min(max(0.0, source), 1.0)
        d = destination
        color = s.rgb * s.a + d.rgb * (1.0 - s.a)
        alpha = s.a + d.a * (1.0 - s.a)
        return vec4(color, alpha)
    """
    letters = "rgb"[: format_.channels]
    opaque = format_.channels < 4
    alphas = {"sa": "1.0" if opaque else "s.a", "da": "1.0" if opaque else "d.a"}
    kind, result_type = (f"vec{n}" if n > 1 else "float" for n in (len(letters), format_.channels))
    color = _combined((blend.source, blend.destination, blend.equation), letters, f"{kind}(0.0)", alphas)
    alpha = _combined(blend.alpha_terms, "a", "0.0", alphas)
    return "\n".join(
        [
            f"def blended(source: vec4, destination: vec4) -> {result_type}:",
            # This order turns NaN into 0, as storing does.
            f"    s = {'min(max(0.0, source), 1.0)' if format_.steps else 'source'}",
            "    d = destination",
            f"    color = {color}",
            *([] if opaque else [f"    alpha = {alpha}"]),
            f"    return {'color' if opaque else 'vec4(color, alpha)'}",
        ]
    )


def _combined(terms: tuple[str, str, str], letters: str, zero: str, alphas: dict[str, str]) -> str:
    names = {"s": f"s.{letters}", "d": f"d.{letters}", "zero": zero, **alphas}
    source, destination = (
        _TERMS[factor].format(x=names[which], **names) for factor, which in zip(terms, "sd", strict=False)
    )
    return _EQUATIONS[terms[2]].format(source=source, destination=destination, **names)


@cache
def blend_kernel(blend: Blend, format_: Format) -> ir.TypedKernel:
    """Return the kernel of a blend before quantization: builtins ``source`` and ``destination`` (vec4), one result.

    Builtin values in channels that the format lacks have no effect.
    """
    text = Source("<passgraph blending>", blend_text(blend, format_))
    return parse_kernel(functions_of(text)["blended"], "blend")


@cache
def blend_program(blend: Blend, format_: Format) -> ScalarProgram:
    """Return the lowered program of a blend: one output with the format's channels, quantized.

    It reads the builtins ``source.0`` to ``source.3`` (the fragment program's result, not clamped) and
    ``destination.0`` to ``destination.3`` (the target's value as read) for the channels in the format.  It has no
    uniforms, tables, images or branches.

    >>> from passgraph.formats import FORMATS
    >>> program = blend_program(Blend("one", "source_color"), FORMATS["rg32f"])
    >>> for instruction in program.body:
    ...     print(instruction)
    LoadBuiltin(to=%1, name='source.0')
    LoadBuiltin(to=%2, name='source.1')
    LoadBuiltin(to=%5, name='destination.0')
    LoadBuiltin(to=%6, name='destination.1')
    Op(to=%9, operation='mul', on='float', arguments=(%1, %5))
    Op(to=%10, operation='mul', on='float', arguments=(%2, %6))
    Op(to=%11, operation='add', on='float', arguments=(%1, %9))
    Op(to=%12, operation='add', on='float', arguments=(%10, %2))
    """
    return lower(blend_kernel(blend, format_), Facts(stores=(format_.store,)))
