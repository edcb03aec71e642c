"""Full-screen passes: the kernel over every pixel, in batches."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from passgraph.backends.base import Block
from passgraph.backends.reference.stage import LANES, Stage, given
from passgraph.backends.reference.storage import Storage, stored
from passgraph.plan.data import PixelStep


class ReferencePixelPass:
    """A pixel pass, interpreted."""

    def __init__(self, step: PixelStep) -> None:
        self.step = step
        self.stage = Stage(step.source.kernel.program, step.program, step.facts)

    def __call__(self, outputs: Sequence[Storage], images: Sequence[Storage], block: Block) -> None:
        width, height = self.step.size
        bound = self.stage.bind(block, [name for name, _ in self.step.images], images)
        for first in range(0, width * height, LANES):
            lanes = np.arange(first, min(first + LANES, width * height))
            pixel = np.stack([lanes % width, lanes // width], axis=1)
            size = np.array([[width, height]], np.int64)
            results, _ = bound.run(len(lanes), {"pixel": given(pixel), "output_size": given(size)})
            for output, values in zip(outputs, results, strict=True):
                output.flat[lanes] = stored(output.format, values.reshape(len(lanes), -1))
