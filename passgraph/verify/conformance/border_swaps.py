"""Diagnose a divergent pass that reads outside of a picture: find the border rule that explains it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from passgraph.backends.reference import ReferenceBackend
from passgraph.language.border_rules import BORDERS
from passgraph.plan.data import PixelStep
from passgraph.verify.conformance.causes import Found
from passgraph.verify.oracle.pass_bounds import Key, Passes, Picture

#: Tolerance of values under another rule, in widths of the bounds.
WIDTHS = 2.0


class _OtherBorder(ReferenceBackend):
    """The reference, with another border rule for one image of one pass."""

    def __init__(self, wanted: PixelStep, image: str, rule: str) -> None:
        super().__init__()
        self.wanted, self.image, self.rule = wanted, image, rule

    def pixel_pass(self, step: PixelStep) -> Any:
        if step.name == self.wanted.name:
            images = {**step.facts.images, self.image: replace(step.facts.images[self.image], border=self.rule)}
            step = replace(step, facts=replace(step.facts, images=images))
        return super().pixel_pass(step)


def border_swap(passes: Passes, key: Key, expected: dict[Key, Picture], found: Found) -> str:
    """Return a sentence that names the border rule of an image with which the reference computes what the backend did;
    empty if there is none."""
    step = passes.plan.steps[key[1]]
    if not isinstance(step, PixelStep) or step.fused:
        return ""
    room = WIDTHS * found.allowed.width + found.format.unit
    for name, _ in step.images:
        own = step.facts.images[name].border if name in step.facts.images else ""
        for rule in BORDERS if own else ():
            if rule == own:
                continue
            with np.errstate(all="ignore"):
                other = _picture(passes, key, expected, _OtherBorder(step, name, rule))
                near = (np.abs(found.got - other) <= room) | (np.isnan(found.got) & np.isnan(other))
                explained = (other != found.expected)[found.beyond]
            if near.all() and explained.all():
                return f"It is as if the border of {name} were {rule}, where {own} is asked for"
    return ""


def _picture(passes: Passes, key: Key, expected: dict[Key, Picture], backend: ReferenceBackend) -> Picture:
    with backend:
        written = next(one for frame, one in enumerate(passes.written(backend, expected)) if frame == key[0])
    return written[key]
