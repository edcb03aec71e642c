"""TIFF stacks: the planes of microscopes' files, by the names of their axes; metadata is kept."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import product
from math import prod
from pathlib import Path
from typing import Any

import numpy as np

from passgraph.arguments import shown
from passgraph.errors import InputError
from passgraph.tiles.grid import Numbers, checked_dtype, imported
from passgraph.writing import NewFile, unwritable

#: Axes of a plane: rows, columns, samples.
_PLANE = "YXS"
#: Attributes of OME's Pixels that are kept.
_OF_PIXELS = ("PhysicalSize", "TimeIncrement")


@dataclass(frozen=True, eq=False)
class Stack:
    """The first series of a TIFF file.

    Attributes
    ----------
    axes : names of the axes in the file's order, such as "TZCYX"
    shape : length of each axis
    channels : names of channels, as far as the file has them
    kept : metadata for the result, as tifffile takes it
    """

    path: Path
    file: Any
    series: Any
    axes: str
    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    channels: tuple[str, ...]
    kept: Mapping[str, Any]

    @property
    def leading(self) -> dict[str, int]:
        """Return the length of each axis besides those of a plane."""
        return {axis: length for axis, length in zip(self.axes, self.shape, strict=True) if axis not in _PLANE}

    @property
    def plane_shape(self) -> tuple[int, ...]:
        return self.shape[len(self.leading) :]

    def places(self, chosen: Mapping[str, str]) -> dict[str, list[int]]:
        """Return the places along each leading axis; ``chosen`` names one place, or a channel, by axis.

        Raises
        ------
        InputError
            For an axis or a place that the stack does not have.
        """
        found = {axis: list(range(length)) for axis, length in self.leading.items()}
        for axis, text in chosen.items():
            known = ", ".join(f"{name.lower()} ({length})" for name, length in self.leading.items()) or "none"
            if axis.upper() not in found:
                raise InputError(f"{self.path}: there is no axis {shown(axis)}; it has {known}")
            places = found[axis.upper()]
            if axis.upper() == "C" and text in self.channels:
                found["C"] = [self.channels.index(text)]
            elif text.isascii() and text.isdigit() and int(text[:9]) < len(places):
                found[axis.upper()] = [int(text)]
            else:
                names = f", or {', '.join(self.channels)}" if axis.upper() == "C" and self.channels else ""
                raise InputError(
                    f"{self.path}: axis {axis.lower()} has places 0 to {len(places) - 1}{names}; got {shown(text)}"
                )
        return found

    def planes(self, places: Mapping[str, list[int]]) -> Iterator[Numbers]:
        """Yield planes in the file's order."""
        lengths = [self.leading[axis] for axis in places]
        pages = self.series.pages
        per_page = prod(lengths) // len(pages) if len(pages) else 0
        for place in product(*places.values()):
            number = int(np.ravel_multi_index(place, lengths)) if lengths else 0
            try:
                # A page of ImageJ's large files, and of volumes, holds several planes.
                page = pages[number // per_page].asarray().reshape(-1, *self.plane_shape)
            except Exception as error:  # damaged files raise errors of any type
                raise InputError(f"{self.path}: plane {number} is damaged ({error}); make or copy it again") from error
            yield page[number % per_page]


@contextmanager
def opened_stack(path: Path) -> Iterator[Stack | None]:
    """Open a TIFF file with several planes; yield None for any other."""
    tifffile = imported("tifffile", str(path))
    try:
        file = tifffile.TiffFile(path)
    except Exception:  # no TIFF, or damaged: what reads pictures says so
        yield None
        return
    with file:
        series = file.series[0]
        axes, shape = str(series.axes), tuple(series.shape)
        tail = axes.lstrip("".join(set(axes) - set(_PLANE)))
        if tail not in ("YX", "YXS") or len(axes) == len(tail) or not len(series.pages):
            yield None
            return
        dtype = checked_dtype(series.dtype, str(path))
        channels, kept = _metadata(tifffile, file)
        yield Stack(path, file, series, axes, shape, dtype, channels, kept)


def _metadata(tifffile: Any, file: Any) -> tuple[tuple[str, ...], dict[str, Any]]:
    """Return the names of channels, and the metadata of OME or ImageJ that a result keeps."""
    if file.is_ome:
        try:
            image = tifffile.xml2dict(file.ome_metadata)["OME"]["Image"]
            pixels = (image[0] if isinstance(image, list) else image)["Pixels"]
        except (KeyError, TypeError, ValueError):
            return (), {}
        listed = pixels.get("Channel", [])
        listed = listed if isinstance(listed, list) else [listed]
        names = tuple(str(channel.get("Name", "")) for channel in listed)
        kept = {key: value for key, value in pixels.items() if key.startswith(_OF_PIXELS)}
        return names, kept
    kept = dict(file.imagej_metadata or {}) if file.is_imagej else {}
    unknown = ("ImageJ", "images", "channels", "slices", "frames", "hyperstack", "axes", "shape", "Labels")
    return (), {key: value for key, value in kept.items() if key not in unknown}


def write_stack(
    stack: Stack, places: Mapping[str, list[int]], output: Path, compute: Callable[[Numbers], Numbers]
) -> int:
    """Write a TIFF file of the same kind with a computed plane for each one; return their number.

    Axes with one chosen place are left out. The file appears when it is complete.
    """
    import tifffile

    first = compute(next(stack.planes(places)))
    axes = "".join(axis for axis, chosen in places.items() if len(chosen) == stack.leading[axis])
    shape = tuple(len(places[axis]) for axis in axes)
    # ImageJ has no colors of 16 bits or floats.
    is_color = first.ndim == 3
    kind = {"ome": True} if stack.file.is_ome else {"imagej": stack.file.is_imagej and not is_color}
    names = [stack.channels[number] for number in places.get("C", []) if number < len(stack.channels)]
    metadata = {"axes": axes + _PLANE[: first.ndim], **stack.kept}
    if stack.file.is_ome and len(names) == len(places.get("C", [])) and names:
        metadata["Channel"] = {"Name": names}
    page = stack.series.pages[0]
    with NewFile(output) as new_file:
        try:
            with tifffile.TiffWriter(new_file.temporary, bigtiff=bool(stack.file.is_bigtiff), **kind) as writer:
                writer.write(
                    (compute(plane) for plane in stack.planes(places)), shape=(*shape, *first.shape),
                    dtype=first.dtype, photometric="rgb" if is_color else "minisblack", metadata=metadata,
                    resolution=page.get_resolution(), resolutionunit=int(page.resolutionunit),
                    extrasamples=["unassalpha"] if is_color and first.shape[2] == 4 else None,
                )  # fmt: skip
            new_file.complete()
        except OSError as error:
            raise unwritable(output, error) from error
    return prod(shape)
