"""A sink that shows frames of a sequence side by side in one picture."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from passgraph.errors import InputError
from passgraph.files.frame import Frame, Sink, Source, Stored
from passgraph.files.stored import with_channels
from passgraph.image_formats import WRITABLE
from passgraph.pictures import check_holds_bits, save
from passgraph.proxies import reduced

#: Width of a sheet in pixels, at most; frames are reduced by whole numbers.
WIDTH = 1920
#: Gray between frames, and space around them, in pixels.
_GRAY, _GAP = 40, 4


class ToContactSheet(Sink):
    """A sink that writes one picture of all frames, row by row, each with its number.

    Parameters
    ----------
    path : a picture file of 8 bits
    columns : frames in a row
    """

    is_one_file = True

    def __init__(self, path: Path, columns: int) -> None:
        if "uint8" not in getattr(WRITABLE.get(path.suffix.lower()), "dtypes", ()):
            raise InputError(f"{path}: a contact sheet has 8 bits a channel; write a .png, .jpg, .tif or .webp")
        check_holds_bits(path, 8)
        self.path, self.columns = path, columns
        self._cells: list[Stored] = []

    @property
    def name(self) -> str:
        return str(self.path)

    def begin(self, source: Source) -> None:
        self._cells = []

    def in_bytes(self, source: Source) -> bool:
        return False

    def stores(self, frame: Frame, size: tuple[int, int]) -> np.dtype[Any]:
        return np.dtype(np.uint8)

    def prepare(self, frame: Frame, picture: Stored) -> Stored:
        """Reduce a frame, on black where it is transparent, and write its number into the corner."""
        factor = -(-picture.shape[1] * self.columns // WIDTH)
        cell = with_channels(reduced(picture, factor), 4)
        colors = np.rint(cell[..., :3].astype(np.float32) * (cell[..., 3:] / np.float32(255))).astype(np.uint8)
        from PIL import Image, ImageDraw  # here, since each apply imports this module

        shown = Image.fromarray(colors)
        draw, text = ImageDraw.Draw(shown), str(frame.number)
        draw.rectangle(draw.textbbox((4, 2), text), fill=(0, 0, 0))
        draw.text((4, 2), text, fill=(255, 255, 255))
        return np.asarray(shown)

    def take(self, frame: Frame, prepared: Any) -> None:
        self._cells.append(prepared)

    def finish(self) -> None:
        save(self.path, sheet_of(self._cells, self.columns))


def sheet_of(cells: Sequence[Stored], columns: int) -> Stored:
    """Return (height, width, 3) uint8 pictures side by side, in rows.

    >>> sheet_of([np.zeros((2, 3, 3), np.uint8)] * 3, 2).shape
    (16, 18, 3)
    """
    height, width = (max(cell.shape[axis] for cell in cells) for axis in (0, 1))
    rows, columns = -(-len(cells) // columns), min(columns, len(cells))
    sheet = np.full((rows * (height + _GAP) + _GAP, columns * (width + _GAP) + _GAP, 3), _GRAY, np.uint8)
    for place, cell in enumerate(cells):
        y, x = (_GAP + (place // columns) * (height + _GAP)), (_GAP + (place % columns) * (width + _GAP))
        sheet[y : y + cell.shape[0], x : x + cell.shape[1]] = cell
    return sheet
