"""How ``passgraph render`` smooths edges."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, Literal, TypeVar, get_args

import click

from passgraph.commands.sources import Job
from passgraph.errors import InputError
from passgraph.graph.targets import MAX_SIDE, Target

Decorated = TypeVar("Decorated", bound=Callable[..., Any])
Antialias = Literal["fxaa", "ssaa4", "none"]


def antialias_option(command: Decorated) -> Decorated:
    return click.option(
        "--antialias", type=click.Choice(get_args(Antialias)),
        help="How edges are smoothed: fxaa in the finished picture; ssaa4 by four samples a pixel, at four times the "
        "work; none.  [default: fxaa for pictures for display, none for HDR]",
    )(command)  # fmt: skip


def chosen(antialias: Antialias | None, display: bool) -> Antialias:
    """What is meant where nothing is said; FXAA of light beyond 1 is refused."""
    if antialias == "fxaa" and not display:
        raise InputError(
            "--antialias fxaa smooths pictures for display, and the result is HDR; use --antialias ssaa4, or --display"
        )
    return antialias or ("fxaa" if display else "none")


def sampled_size(antialias: Antialias, size: tuple[int, int]) -> tuple[int, int]:
    """The size at which a scene is drawn."""
    if antialias != "ssaa4":
        return size
    width, height = size[0] * 2, size[1] * 2
    if max(width, height) > MAX_SIDE:
        raise InputError(
            f"--antialias ssaa4 draws {size[0]}x{size[1]} at {width}x{height}, and a side has at most {MAX_SIDE} "
            "pixels; use --antialias fxaa, or a smaller --size"
        )
    return width, height


def smoothed(job: Job, antialias: Antialias, display: bool) -> Job:
    """The job with its outputs smoothed; those of ssaa4 are half as large as what is drawn."""
    if antialias == "none":
        return job
    return replace(job, outputs={name: _smooth(output, antialias, display) for name, output in job.outputs.items()})


def _smooth(output: Target, antialias: Antialias, display: bool) -> Target:
    if antialias == "ssaa4":
        from passgraph.effects.pictures.supersampled import supersampled

        return supersampled(output, display)
    from passgraph.effects.pictures.fxaa import fxaa

    return fxaa(output)
