"""``--depth`` and ``--depth-buffer``: the depth that goes with a picture."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from passgraph.errors import InputError
from passgraph.scene.hardware_depth import HardwareDepth


class DepthBuffer(click.ParamType):  # type: ignore[type-arg]  # generic in newer clicks only
    """NEAR:FAR, and ``,reversed`` or ``,orthographic`` behind it."""

    name = "depth buffer"
    words = ("reversed", "orthographic")

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> HardwareDepth:
        if isinstance(value, HardwareDepth):
            return value
        planes, *words = str(value).split(",")
        near, colon, far = planes.partition(":")
        try:
            if not colon or any(word not in self.words for word in words):
                raise ValueError
            return HardwareDepth(float(near), float(far), "reversed" in words, "orthographic" in words)
        except (ValueError, InputError) as error:
            why = f" ({error})" if isinstance(error, InputError) else ""
            self.fail(
                f"{value!r}: expected NEAR:FAR with 0 < NEAR < FAR, then ,reversed or ,orthographic where it is so, "
                f"such as 0.1:1000 or 0.1:inf,reversed{why}",
                param, ctx,
            )  # fmt: skip


def depth_buffer_option() -> click.Option:
    return click.Option(
        ["--depth-buffer"], type=DepthBuffer(), metavar="NEAR:FAR[,reversed][,orthographic]",
        help="The depth is an engine's buffer, from 0 to 1 (16-bit PNG too); FAR may be inf. Left out, a distance.",
    )  # fmt: skip


def depth_option(required: bool) -> click.Option:
    return click.Option(
        ["--depth"], required=required, type=click.Path(path_type=Path),
        help="Picture whose red is each pixel's linear depth (EXR or npy, scene units), or a sequence of them.",
    )  # fmt: skip
