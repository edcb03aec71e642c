"""Pictures of shader formats: files, black for missing ones, persistent buffers, and small passes over them."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any
from weakref import WeakValueDictionary

import numpy as np
from numpy.typing import NDArray

from passgraph.errors import InputError
from passgraph.glsl import parse
from passgraph.graph.calls import PixelKernel
from passgraph.graph.targets import Input, InputSpec, Target, TargetSpec
from passgraph.language.kernel import kernel_from_text
from passgraph.plan.dependencies import inputs_of, passes_behind
from passgraph.reading import check_regular

#: Most bytes of a shader's picture file.
MAX_BYTES = 64 << 20


#: A kernel that does not read its second picture, but makes its pass a part of the graph.
_SHOWN = PixelKernel[Target](kernel_from_text("def shown(shown: Image, kept: Image) -> vec4: return shown[0, 0]"))


@cache
def small_kernel(name: str, text: str) -> PixelKernel[Target]:
    """Return a helper kernel of a format, in GLSL with rows from the top; parsed once."""
    return PixelKernel[Target].of_shader(parse(text, name=name, rows_up=False))


def shown_with_kept(draw: Callable[[TargetSpec], list[Target]], inner: str, into: TargetSpec) -> Target:
    """Return the last target, ``into``, in a graph that also draws the buffers whose earlier frames are read.

    ``draw`` draws all passes, the last into a given target: ``into``, or if further buffers must be drawn, a target of
    the name ``inner``, which a further pass copies to ``into``.
    """
    *drawn, shown = draw(into)
    if not _unread(shown, drawn):
        return shown
    *drawn, shown = draw(replace(into, name=inner))
    return shown_beside(shown, _unread(shown, drawn), into)


def _unread(shown: Target, drawn: Iterable[Target]) -> list[Target]:
    """Return the buffers that the shown target does not depend on, although it, or such a buffer, reads their earlier
    frames."""
    drawn, unread = list(drawn), list[Target]()
    while True:
        behind = passes_behind([shown, *unread])
        needed = {handle.spec for one in behind for handle in one.reads if handle.is_previous}
        needed -= {spec for one in behind for spec in one.writes}
        more = [one for one in drawn if one.spec in needed]
        if not more:
            return unread
        unread += more


def read_behind(shown: Target) -> set[object]:
    """Return everything that a target's passes read, or take their size from."""
    passes = passes_behind([shown])
    return {*inputs_of(passes).values(), *(handle.spec for one in passes for handle in one.reads)}


def shown_beside(shown: Target, side_targets: list[Target], into: TargetSpec) -> Target:
    """Return the shown target, in a graph that also draws some buffers or takes some pictures."""
    *before, last = side_targets
    for number, one in enumerate(before):
        shown = _SHOWN(shown=shown, kept=one, into=replace(into, name=f"{into.name}.with.{number}"))
    return _SHOWN(shown=shown, kept=last, into=into)


def handle_or_black(picture: Target | None) -> Target:
    """Return the picture, or one pixel of transparent black."""
    return picture if picture is not None else _BLACK


_BLACK = Input("no picture", "rgba8", (1, 1), static=True, default=np.zeros((1, 1, 4), np.float32))


def imported(name: str, path: object, folder: Path, where: str) -> Target:
    """Load a picture from the shader's own folder, as an input with a default.

    Raises
    ------
    InputError
        For a path outside of the folder, and for a file that is missing, too large or no picture.
    """
    if not isinstance(path, str) or not path:
        raise InputError(f"{where}: imported picture {name!r} has no PATH")
    root = folder.resolve()
    full = (root / path).resolve()
    if root not in full.parents:
        raise InputError(f"{where}: imported picture {name!r} lies outside of the shader's folder ({path!r})")
    if not full.exists():
        raise InputError(f"{where}: imported picture {name!r}: there is no {full}")
    return loaded(f"{where}:{name}", full, f"imported picture {name!r} of {where}")


def loaded(name: str, path: Path, what: str) -> Target:
    """Load a picture file as an input with a default."""
    from passgraph.pictures import load

    if check_regular(path, what) > MAX_BYTES:
        raise InputError(f"{what}: {path} is larger than {MAX_BYTES >> 20} MiB")
    return brought(name, "rgba32f", load(path))


#: Inputs of shaders' pictures by name, format and content, while they are referenced.
_BROUGHT: WeakValueDictionary[tuple[str, str, tuple[int, ...], bytes], InputSpec] = WeakValueDictionary()


def brought(name: str, format: str, picture: NDArray[Any]) -> Target:
    """Return an input with a picture as default.

    The same picture gives the same input, since a graph may contain a shader that was loaded twice, and an input's name
    must be unique.
    """
    size = picture.shape[1], picture.shape[0]
    spec = Input(name, format, size, static=True, default=picture).spec
    assert isinstance(spec, InputSpec)
    content = hashlib.sha256(picture.tobytes()).digest()
    return Target(_BROUGHT.setdefault((name, format, picture.shape, content), spec))
