"""Convert alpha around an effect: apply effects on premultiplied color to pictures with straight alpha."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, get_args

import passgraph as pg
from passgraph.arguments import one_of
from passgraph.effects.checked import Alpha, Mark
from passgraph.formats import FORMATS
from passgraph.language import Image, vec3, vec4
from passgraph.signatures import signature


@pg.kernel
def premultiply(color: Image) -> vec4:
    """Multiply color by alpha; 0 where alpha is 0, even for infinite color."""
    c = color[0, 0]
    return vec4(c.rgb * c.a if c.a != 0.0 else vec3(0.0), c.a)


@pg.kernel
def premultiply_additive(color: Image) -> vec4:
    """Multiply color by alpha; where alpha is 0 color stays, as light that is added."""
    c = color[0, 0]
    return vec4(c.rgb * c.a if c.a != 0.0 else c.rgb, c.a)


@pg.kernel
def unpremultiply(color: Image) -> vec4:
    """Divide color by alpha; where alpha is 0 color stays."""
    c = color[0, 0]
    return vec4(c.rgb / c.a if c.a != 0.0 else c.rgb, c.a)


@pg.kernel
def opaque(color: Image) -> vec4:
    """Set alpha to 1."""
    return vec4(color[0, 0].rgb, 1.0)


@pg.kernel
def with_alpha(color: Image, original: Image) -> vec4:
    """Take alpha from another picture."""
    return vec4(color[0, 0].rgb, original[0, 0].a)


def on_straight_alpha(
    effect: Callable[..., pg.Target], alpha: Alpha | None = None, *, additive: bool = False
) -> Callable[..., pg.Target]:
    """Return ``effect`` for pictures with straight alpha, as `passgraph.load` and `passgraph.save` have them.

    Parameters
    ----------
    effect : a function from a target, and more, to a target
    alpha : alpha mode of the effect, see `passgraph.effects.checked.effect`; default: the one it declares.
        "premultiplied": color is multiplied by alpha before the effect and divided after it, in all its input pictures
        except depth. "straight": the effect itself. "ignored": the effect gets alpha 1, the result has the first
        picture's alpha
    additive : color of the first picture, where its alpha is 0, is light that is added (fire, glints), as in OpenEXR
        files; else it is invisible, and lost

    Returns
    -------
    A function with the arguments of ``effect``; ``into`` is the destination of the result. Results without alpha are
    not divided.

    Examples
    --------
    Opaque blue next to transparent red: invisible color does not affect the blur.

    >>> import numpy as np
    >>> from passgraph.effects import gaussian_blur
    >>> frame = np.repeat(np.float32([[[0, 0, 1, 1], [1, 0, 0, 0]]]), 4, axis=1)
    >>> soft = on_straight_alpha(gaussian_blur)(pg.Input("frame"), sigma_px=1.0)
    >>> with pg.compile(soft, backend="reference") as program:
    ...     shown = program(frame=frame)["gaussian_blur"]
    >>> float(shown[..., 0].max()), 0.0 < float(shown[0, 4, 3]) < 0.5
    (0.0, True)
    """
    mark = getattr(effect, "effect", None)
    mode = mark.alpha if alpha is None and isinstance(mark, Mark) else alpha or "straight"
    one_of(mode, "on_straight_alpha: alpha", get_args(Alpha))
    if mode == "straight":
        return effect
    before = premultiply if mode == "premultiplied" else opaque
    before_first = premultiply_additive if additive and mode == "premultiplied" else before
    takes_into = "into" in signature(effect).parameters

    def converted(picture: pg.Target, before: Any = before) -> pg.Target:
        into = pg.target(f"{picture.name}_{before.name}", "rgba32f", like=picture)
        return before(picture, into=into).border(picture.border_rule).filter(picture.filter_rule)

    def wrapper(color: pg.Target, *taken: Any, into: pg.TargetSpec | None = None, **given: Any) -> pg.Target:
        if not any(_may_be_transparent(one) for one in (color, *given.values())):
            return effect(color, *taken, **given) if into is None else effect(color, *taken, into=into, **given)
        inner = converted(color, before_first)
        given = {name: converted(one) if isinstance(one, pg.Target) else one for name, one in given.items()}
        result = effect(inner, *taken, **given)
        if result is inner:
            return color
        spec = result.spec
        if not isinstance(spec, pg.TargetSpec) or spec.format.channels != 4:
            return result
        name = f"{spec.name}_{mode}"
        if takes_into:
            # Dividing 8-bit values by a small alpha would show steps.
            format = spec.format if not spec.format.steps else FORMATS["rgba32f"]
            result = effect(inner, *taken, into=replace(spec, name=name, format=format), **given)
            into = into or spec
        into = into or pg.target(name, "rgba32f", like=result)
        return unpremultiply(result, into=into) if mode == "premultiplied" else with_alpha(result, color, into=into)

    return wrapper


def _may_be_transparent(picture: object) -> bool:
    """Return True for a picture with alpha, or whose channels are not declared."""
    if not isinstance(picture, pg.Target):
        return False
    declared = picture.spec.format
    return declared is None or declared.channels > 2
