"""Data of one pass whose result is not allowed, and the verdict on a result. Needs numpy."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).parent
#: Size (width, height) of the target, what the calls of the library take, and the worst value.
CASE: dict[str, Any] = json.loads((HERE / "case.json").read_text(encoding="utf-8"))
SIZE: tuple[int, int] = tuple(CASE["size"])


def source(name: str) -> str:
    """Return the text of a shader or kernel, as it was compiled."""
    return (HERE / name).read_text(encoding="utf-8")


def parameters(name: str) -> bytes:
    return (HERE / name).read_bytes()


def image(number: int, channels: int = 0) -> Any:
    """Return the stored numbers of an image that the pass reads, (rows, columns, channels), row 0 on top.

    ``channels`` : of its texture; those that the image lacks are 0
    """
    numbers = np.load(HERE / f"image{number}.npy", allow_pickle=False)
    more = max(0, channels - numbers.shape[2])
    return np.ascontiguousarray(np.pad(numbers, ((0, 0), (0, 0), (0, more))))


def verdict(device: str, results: list[Any]) -> int:
    """Print what a device computed beside what is allowed, and return 1 if a value is outside.

    ``results`` : stored numbers of each target, (rows, columns, at least the target's channels), row 0 on top
    """
    with np.load(HERE / "allowed.npz", allow_pickle=False) as allowed:
        low, high, may_be_nan = allowed["low"], allowed["high"], allowed["may_be_nan"]
    result = results[CASE["target"]][..., : low.shape[2]]
    steps = CASE["steps"] if result.dtype.kind == "u" else 1
    got = result.astype(np.float32) / np.float32(steps)
    outside = ~((got >= low) & (got <= high)) & ~(np.isnan(got) & may_be_nan)
    (column, row), channel = CASE["pixel"], CASE["channel"]
    at = row, column, channel
    print(f"device: {device}")
    print(f"column {column}, row {row}, channel {channel}: got {got[at]:.9g}, "
          f"allowed {low[at]:.9g} to {high[at]:.9g}{' or NaN' if may_be_nan[at] else ''}")  # fmt: skip
    print(f"{outside.sum()} of {outside.size} values are outside of what is allowed")
    return int(outside.any())
