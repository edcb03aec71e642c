"""Brightness and contrast: scale colors, then their distance from middle gray."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

import passgraph as pg
from passgraph.effects.channels import result_like
from passgraph.effects.checked import effect
from passgraph.effects.quantities import NotNegative
from passgraph.language import Image, vec4


@pg.kernel(alike=True)
def scaled(color: Image, brightness: float, contrast: float) -> vec4:
    """Scale the color, then its distance from 0.5."""
    c = color[0, 0].rgb * brightness
    return vec4((c - 0.5) * contrast + 0.5, color[0, 0].a)


@effect("brightness-contrast", alike=True)
def brightness_contrast(
    color: pg.Target,
    brightness: NotNegative | pg.Value | pg.Derived = 1.0,
    contrast: NotNegative | pg.Value | pg.Derived = 1.0,
    into: pg.TargetSpec | None = None,
    name: str = "brightness_contrast",
) -> pg.Target:
    """Change the brightness of a picture, then its contrast.

    Parameters
    ----------
    color : encoded for display, any range; results are not clamped, and alpha stays
    brightness : factor of each channel; 1 leaves it unchanged, and 0 is black
    contrast : factor of the distance from 0.5; 1 leaves it unchanged, and 0 is gray
    into : destination target; default: float32 named ``name``
    name : name of the pass

    Source: W3C, "Filter Effects Module Level 1", 2018: ``brightness()``, then ``contrast()``.

    Examples
    --------
    >>> import numpy as np
    >>> frame = np.array([[[0.25, 0.5, 0.75, 1]]], np.float32)
    >>> with pg.compile(brightness_contrast(pg.Input("frame"), 1.0, 2.0), backend="reference") as program:
    ...     program(frame=frame)["brightness_contrast"][0, 0].tolist()
    [0.0, 0.5, 1.0, 1.0]
    """
    return scaled(color, brightness, contrast, into=result_like(color, into, name), name=name)
