"""Pictures and framebuffers of a host, as programs take them: a surface, a part of it, and which row is the first."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

from passgraph.backends.base import DevicePicture
from passgraph.backends.gl.backend import GLBackend
from passgraph.backends.gl.textures import PLAIN, Placement, Texture, in_words
from passgraph.hosts.gl_pictures import Facts

Origin = Literal["bottom", "top"]
#: (x, y, width, height) in pixels; (x, y) is the bottom left pixel, as in OpenGL.
Region = tuple[int, int, int, int]


@dataclass(frozen=True, eq=False)
class HostPicture(DevicePicture):
    """A picture of the host, for an input or for ``into=``.

    Attributes
    ----------
    region : its (x, y, width, height) in the surface, from the bottom left pixel
    origin : "bottom" if its first row in memory is the bottom row, as in OpenGL; "top" if it is the top row
    facts : the properties of the surface
    sample_gamma : samples of a pixel are averaged as colors to this power, as the engine resolves them
    """

    region: Region
    origin: Origin
    facts: Facts
    host: GLBackend = field(repr=False)
    sample_gamma: float = 1.0

    @property
    def samples(self) -> int:
        """Samples a pixel; 0 without multisampling."""
        return self.facts.samples

    @property
    def is_part(self) -> bool:
        return self.region != (0, 0, *self.facts.size)

    @property
    def placement(self) -> Placement:
        place = Placement(self.origin == "bottom", self.is_part)
        return PLAIN if place == PLAIN else place

    def overlaps(self, other: DevicePicture) -> bool:
        if not isinstance(other, HostPicture):
            return False
        one, another = self.facts.surface, other.facts.surface
        if (one.kind, one.name, self.facts.is_depth) != (another.kind, another.name, other.facts.is_depth):
            return False
        (x, y, width, height), (u, v, across, up) = self.region, other.region
        return x < u + across and u < x + width and y < v + up and v < y + height

    def is_in(self, storage: Any) -> bool:
        surface = self.facts.surface
        return surface.kind == "texture" and isinstance(storage, Texture) and storage.name == surface.name

    def __str__(self) -> str:
        x, y, width, height = self.region
        part = f" from ({x}, {y})" if self.is_part else ""
        samples = f", {self.samples} samples a pixel" if self.samples else ""
        return f"{in_words(self.facts.surface)}: {width}x{height} pixels{part}, {self.facts.stored}{samples}"


@dataclass(frozen=True, eq=False)
class HostFramebuffer:
    """A framebuffer of the host.  For an input or ``into=`` it means its ``color``.

    Attributes
    ----------
    color : the attachment of its first draw buffer; None if it draws no color
    depth : its depth, from 0 to 1 as the engine stores it (`passgraph.HardwareDepth`), one channel; or None
    """

    color: HostPicture | None
    depth: HostPicture | None

    @property
    def size(self) -> tuple[int, int]:
        """(width, height), pixels."""
        return self._any().size

    @property
    def samples(self) -> int:
        return self._any().samples

    def _any(self) -> HostPicture:
        surface = self.color or self.depth
        assert surface is not None
        return surface
