"""How the picture lies that a texture holds: rows from the top or from the bottom, the whole texture or a part of it.

Pictures of our own are plain: all of a texture, row 0 on top.  An engine's have their rows from the bottom up, and may
be a part of a larger texture.  Shaders are printed for how their pictures lie, so that they compute the same values
at the same pixels, and nothing is copied for its orientation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from passgraph.backends.gl.textures import Texture


@dataclass(frozen=True, slots=True)
class Placement:
    """What a shader has to know of it when it is printed; where a part begins and its size are uniforms."""

    bottom_up: bool = False
    is_part: bool = False


PLAIN = Placement()


@dataclass(frozen=True, slots=True)
class Placements:
    """Of a pass: of its images, in the program's order, and of its outputs, which agree."""

    images: tuple[Placement, ...] = ()
    output: Placement = PLAIN

    def of(self, image: int) -> Placement:
        return self.images[image] if self.images else PLAIN


ALL_PLAIN = Placements()


def placements_of(outputs: Sequence[Texture], images: Sequence[Texture]) -> Placements:
    """``ALL_PLAIN`` where every picture is plain."""
    for texture in (*outputs, *images):
        if texture.placement is not PLAIN:
            break
    else:
        return ALL_PLAIN
    return Placements(tuple([t.placement for t in images]), outputs[0].placement if outputs else PLAIN)
