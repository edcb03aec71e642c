"""What a device gets for a pixel pass, to repeat it without passgraph."""

from __future__ import annotations

from collections.abc import Container, Sequence

import numpy as np

from passgraph.backends.base import Block, SentPass
from passgraph.backends.webgpu.devices import FEATURES
from passgraph.backends.webgpu.programs import packed, packed_tables
from passgraph.backends.webgpu.textures import Texture
from passgraph.backends.webgpu.wgsl import FIRST_IMAGE, FULLSCREEN, LINEAR, NEAREST, PARAMETERS, WRAP_MODES
from passgraph.language.scalar import filtered_images
from passgraph.plan.data import PixelStep


def sent_pass(
    code: str,
    features: Container[str],
    step: PixelStep,
    outputs: Sequence[Texture],
    images: Sequence[Texture],
    block: Block,
) -> SentPass | None:
    """Return what a pass over these textures sends; None with depth, or images that the device filters."""
    textures = [*outputs, *images]
    if filtered_images(step.program) or any(texture.format.is_depth for texture in textures):
        return None
    sources = {"corners.wgsl": FULLSCREEN, "pass.wgsl": code}
    parameters = packed(step.program, step.size, 1, block, packed_tables(step.program))
    stored = [texture.stored for texture in textures]
    described = [(one.name, one.format.channels, str(np.dtype(one.format.number))) for one in stored]
    calls = {
        "outputs": described[: len(outputs)], "images": described[len(outputs) :], "parameters": PARAMETERS,
        "nearest": NEAREST, "linear": LINEAR, "modes": list(WRAP_MODES.values()), "first_image": FIRST_IMAGE,
        "features": [name for name in FEATURES if name in features],
    }  # fmt: skip
    types = tuple([type_ for _, _, type_ in described[len(outputs) :]])
    return SentPass("wgpu", sources, {"parameters.bin": parameters}, calls, types)
