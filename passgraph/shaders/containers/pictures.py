"""Pictures that a container names, and what stands in where there is none."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from passgraph.errors import InputError
from passgraph.graph.targets import Input, Target
from passgraph.reading import check_regular

#: Most bytes of a picture that a shader brings.
MAX_BYTES = 64 << 20


def handle_or_black(picture: Target | None) -> Target:
    """What is given, or one pixel of transparent black."""
    return picture if picture is not None else _BLACK


_BLACK = Input("no picture", "rgba8", (1, 1), static=True, default=np.zeros((1, 1, 4), np.float32))


def imported(name: str, path: object, folder: Path, where: str) -> Target:
    """A picture from the shader's own folder, as an input that is there already.

    Raises
    ------
    InputError
        For a path that leads out of the folder, and a file that is missing, too large or no picture.
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
    """A picture file as an input that is there already."""
    from passgraph.pictures import load

    if check_regular(path, what) > MAX_BYTES:
        raise InputError(f"{what}: {path} is larger than {MAX_BYTES >> 20} MiB")
    picture: Any = load(path)
    return Input(name, None, (picture.shape[1], picture.shape[0]), static=True, default=picture)
