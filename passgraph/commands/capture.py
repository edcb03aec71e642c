"""Writes what passes wrote: pictures to look at, and the exact values."""

from __future__ import annotations

from pathlib import Path

import click
import numpy as np
from numpy.typing import NDArray

from passgraph.plan.data import Step

#: What NaN looks like: a colour that pictures rarely have.
NAN_COLOUR = (1.0, 0.0, 1.0)


class Capture:
    """An observer of a program's steps that writes each target into a folder."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.count = folder, 0
        self.lines: list[str] = []

    def __call__(self, step: Step, pictures: dict[str, NDArray[np.float32]]) -> None:
        from passgraph.pictures import save

        self.count += 1
        for target, picture in pictures.items():
            stem = f"{self.count:02}-{file_name(step.name)}-{file_name(target)}"
            view, shown = viewable(picture)
            save(self.folder / f"{stem}.png", view)
            save(self.folder / f"{stem}.npy", picture)
            self.lines.append(f"  {stem}.png  {picture.shape[1]}x{picture.shape[0]}, {shown}")

    def report(self) -> None:
        click.echo(f"{len(self.lines)} targets in {self.folder} (exact values in the npy files):")
        click.echo("\n".join(self.lines))


def file_name(name: str) -> str:
    """
    >>> file_name("shadow map/0")
    'shadow_map_0'
    """
    return "".join(c if c.isascii() and (c.isalnum() or c in "_.-") else "_" for c in name)


def viewable(picture: NDArray[np.float32]) -> tuple[NDArray[np.float32], str]:
    """Gray or RGB in [0, 1], and in words what is shown.

    Colours within [0, 1] are shown as they are; others, and single channels such as depth, from their
    smallest to their largest value.  Alpha is left
    out, since data in it would make the picture invisible; NaN is magenta.

    >>> viewable(np.array([[[2.0], [4.0]]], np.float32))[1]
    'black is 2, white is 4'
    """
    channels = picture.shape[2]
    colours = picture[:, :, : 1 if channels == 1 else 3]
    if channels == 2:
        colours = np.concatenate([colours, np.zeros_like(colours[:, :, :1])], axis=2)
    finite = colours[np.isfinite(colours)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
    shown = "as stored"
    if low < 0.0 or high > 1.0 or channels == 1:
        shown = f"black is {low:.6g}, white is {high:.6g}"
        colours = ((colours.astype(np.float64) - low) / max(high - low, 1e-30)).astype(np.float32)
    missing = np.isnan(colours).any(axis=2)
    view = np.clip(np.nan_to_num(colours, nan=0.0, posinf=1.0, neginf=0.0), 0.0, 1.0).astype(np.float32)
    if missing.any():
        view = np.broadcast_to(view, (*view.shape[:2], 3)).copy()
        view[missing] = NAN_COLOUR
        shown += f", {int(missing.sum())} pixels are NaN (magenta)"
    return view, shown
