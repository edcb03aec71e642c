"""The latest results of the live view: their values, and the pictures that are sent of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import isfinite
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from passgraph.errors import InputError
from passgraph.pictures import scaled
from passgraph.run.result import Result
from passgraph.viewer.compiled import Difference, flip_map
from passgraph.viewer.display import encode, histogram_of, range_of
from passgraph.viewer.requests import Settings


@dataclass(frozen=True)
class Shown:
    """The results of a run.

    Attributes
    ----------
    results : by slot, "a" and "b"
    times : durations in milliseconds
    ran_at : when they were computed, in seconds of ``perf_counter``
    difference, flip : of both slots; None if they are not compared
    """

    results: Mapping[str, Result] = field(default_factory=dict)
    times: Mapping[str, float] = field(default_factory=dict)
    ran_at: float = 0.0
    difference: Difference | None = None
    flip: tuple[NDArray[np.uint8], float] | None = None

    @classmethod
    def of(cls, results: Mapping[str, Result], settings: Settings, times: Mapping[str, float], ran_at: float) -> Shown:
        """Return results with what the settings compare of them."""
        flip = flip_map(results) if settings.compare == "flip" and "b" in results else None
        return cls(results, times, ran_at, _difference(results), flip)

    def pictures(self, settings: Settings, exact: bool) -> dict[str, tuple[bytes, str]]:
        """Return the pictures that the page shows, by slot; with ``exact`` they are encoded without loss."""
        if settings.compare == "difference" and self.difference is not None:
            return {"difference": encode(self.difference.picture(settings.gain), exact)}
        if settings.compare == "flip" and self.flip is not None:
            return {"flip": encode(self.flip[0], exact)}
        slots = {"other": "b", "both": "ab"}.get(settings.compare, "a") if "b" in self.results else "a"
        return {slot: encode(self.results[slot]["shown"], exact) for slot in slots}

    def facts(self) -> dict[str, Any]:
        """Return what the page writes beside the pictures."""
        facts: dict[str, Any] = {}
        if self.results:
            height, width = self.results["a"]["shown"].shape[:2]
            facts["size"] = [width, height]
        if self.difference is not None:
            facts["differs"] = self.difference.facts()
        if self.flip is not None:
            facts["flip"] = self.flip[1]
        return facts

    def values_at(self, x: int, y: int) -> dict[str, list[float]]:
        """Return a texel of the shown target, on each backend."""
        texels: dict[str, list[float]] = {}
        for slot, result in self.results.items():
            picture = result["values"]
            if 0 <= y < picture.shape[0] and 0 <= x < picture.shape[1]:
                texels[slot] = [_json_number(number) for number in picture[y, x].tolist()]
        return texels

    def statistics(self) -> dict[str, Any]:
        """Return the range of the shown target, its counts of NaN and infinity, and a histogram."""
        if not self.results:
            return {}
        values = scaled(self.results["a"]["values"])
        low, high = range_of(values)
        return {
            "low": low,
            "high": high,
            "nan": int(np.isnan(values).any(axis=2).sum()),
            "infinite": int(np.isinf(values).any(axis=2).sum()),
            "histogram": histogram_of(values, low, high),
        }

    def picture(self, output: Literal["values", "shown"]) -> NDArray[Any]:
        """Return the values of the shown target, or the picture as shown, (height, width, channels)."""
        if not self.results:
            raise InputError("there is no picture yet")
        picture: NDArray[Any] = self.results["a"][output]
        return picture


def _difference(results: Mapping[str, Result]) -> Difference | None:
    if "b" not in results:
        return None
    a, b = (results[slot]["values"].shape[1::-1] for slot in "ab")
    if a != b:
        raise InputError(f"the picture to compare with: is {b[0]}x{b[1]}, and the target is {a[0]}x{a[1]}; resize it")
    return Difference.of(results["a"], results["b"])


def _json_number(number: float) -> Any:
    """Return a number for JSON; NaN and infinity become text."""
    return number if isinstance(number, int) or isfinite(number) else str(number)
