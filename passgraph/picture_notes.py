"""What a picture file says beside its pixels: its colour profile, its resolution, and what the camera noted (EXIF).

Numbers are given to programs as they are stored, so that a result means the colours that its source meant, by the same
profile.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from passgraph.picture_decoders import opened, stored_as

if TYPE_CHECKING:
    from PIL.ImageFile import ImageFile

#: Those that have notes which others can hold.
_FORMATS = ("PNG", "JPEG", "TIFF", "WEBP")
#: Which notes a format is given through Pillow.
_HELD = {
    "PNG": ("icc_profile", "exif", "dpi"),
    "JPEG": ("icc_profile", "exif", "dpi"),
    "TIFF": ("icc_profile", "dpi"),
    "WEBP": ("icc_profile", "exif"),
}
#: Bytes of EXIF that a JPEG's segment holds (a length of 16 bits, with itself and its six letters).
_MOST_EXIF = 65535 - 2 - 6
#: What is not true of another picture (EXIF 2.32): its size, and how it is to be turned, which is done in reading.
_SIZE_AND_TURN = (0x0100, 0x0101, 0x0112)
#: The directory of a camera's notes, and the size that stands there too.
_CAMERA, _CAMERA_SIZE = 0x8769, (0xA002, 0xA003)


@dataclass(frozen=True)
class Notes:
    """What goes from a picture to the one that is made of it.

    Attributes
    ----------
    profile : ICC profile of RGB colours; empty where the file has none
    exif : without the picture's size and turn, and without its small copy
    resolution : dots an inch, across and down
    opaque : whether it has no transparency
    deep : whether it has 16 bits a channel
    """

    profile: bytes = b""
    exif: bytes = b""
    resolution: tuple[float, float] | None = None
    opaque: bool = False
    deep: bool = False

    def channels(self, pixels: NDArray[Any]) -> NDArray[Any]:
        """What is stored of (h, w, 4) uint8 or uint16: no alpha where neither this picture nor its source uses one.

        >>> Notes(opaque=True).channels(np.full((2, 3, 4), 255, np.uint8)).shape
        (2, 3, 3)
        """
        unused = self.opaque and pixels.shape[2] == 4 and pixels[..., 3].min() == np.iinfo(pixels.dtype).max
        return np.ascontiguousarray(pixels[..., :3]) if unused else pixels

    def options(self, kind: str) -> dict[str, Any]:
        """What Pillow is told to write into a file of a kind, such as "PNG".

        >>> Notes(resolution=(300.0, 300.0)).options("JPEG")
        {'dpi': (300.0, 300.0)}
        """
        exif = self.exif if len(self.exif) <= _MOST_EXIF else b""
        said = {"icc_profile": self.profile, "exif": exif, "dpi": self.resolution}
        return {name: said[name] for name in _HELD.get(kind, ()) if said[name]}


def notes_of(file: Path) -> Notes:
    """The notes of a picture file; none of what has none, or cannot be read."""
    try:
        with file.open("rb") as stream, opened(stream, _FORMATS) as image:
            opaque = not image.has_transparency_data
            return Notes(_profile(image), _exif(image), _resolution(image), opaque, _is_deep(image))
    except Exception:  # notes are broken in every way, and a picture is as good without
        return Notes()


def is_deep(file: Path) -> bool:
    """Whether a picture file has whole numbers of 16 bits; told from its header, False of what cannot be read."""
    try:
        with file.open("rb") as stream, opened(stream, ("PNG", "TIFF")) as image:
            return _is_deep(image)
    except Exception:  # headers are broken in every way; what is wrong is told when the picture is read
        return False


def _is_deep(image: ImageFile) -> bool:
    tags = getattr(image, "tag_v2", None)
    if tags is not None:  # bits of each channel, and what they are (3: floats)
        return bool(max(tags.get(258, (1,))) == 16 and 3 not in tags.get(339, (1,)))
    return image.mode.startswith("I;16") or ";16" in stored_as(image)


def _profile(image: ImageFile) -> bytes:
    """Of RGB alone, since that is what is written (ICC.1:2022, section 7.2.6: the data colour space)."""
    profile = image.info.get("icc_profile") or b""
    return profile if profile[16:20] == b"RGB " else b""


def _exif(image: ImageFile) -> bytes:
    from PIL import Image as pillow

    if "exif" not in image.info:
        return b""
    exif = pillow.Exif()
    exif.load(image.info["exif"])
    for tag in _SIZE_AND_TURN:
        exif.pop(tag, None)
    camera = exif.get_ifd(_CAMERA)
    for tag in _CAMERA_SIZE:
        camera.pop(tag, None)
    return exif.tobytes() if exif else b""


def _resolution(image: ImageFile) -> tuple[float, float] | None:
    across, down = image.info.get("dpi", (0, 0))
    return (float(across), float(down)) if across > 1 and down > 1 else None
