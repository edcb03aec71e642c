"""Results of runs: pictures by name."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from html import escape
from os import PathLike
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from passgraph import arguments
from passgraph.errors import InputError, UnknownNameError
from passgraph.plan.data import Step

Picture: TypeAlias = NDArray[np.float32]
#: Destination arrays by output name.
Into: TypeAlias = Mapping[str, Any]
Results: TypeAlias = Literal["float32", "stored"]
Observer: TypeAlias = Callable[[Step, dict[str, Picture]], None]


class Result(Mapping[str, Picture]):
    """Pictures by target name: (height, width, channels), row 0 on top; float32 unless compiled or called otherwise."""

    def __init__(self, pictures: dict[str, Any]) -> None:
        self._pictures = pictures

    def __getitem__(self, name: str) -> Picture:
        if not arguments.among(name, self._pictures):
            got = arguments.shown(name)
            raise UnknownNameError(f"there is no result {got}; there are {', '.join(self._pictures)}")
        picture: Picture = self._pictures[name]
        return picture

    def __iter__(self) -> Iterator[str]:
        return iter(self._pictures)

    def __len__(self) -> int:
        return len(self._pictures)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        """Return the picture of a result with one target, so that ``np.asarray(result)`` works."""
        if len(self) != 1:
            names = ", ".join(self)
            raise InputError(f"a result of {len(self)} targets is no array; name one of them: result[name] of {names}")
        (picture,) = self.values()
        array = np.asarray(picture, dtype)
        return array.copy() if copy and array is picture else array

    def save(self, path: str | PathLike[str], name: str | None = None) -> None:
        """Write a result (by default the first) as PNG, EXR …; the file is written atomically.

        Values above 1 are clipped in 8-bit formats; use a tone-mapping effect, or EXR.
        """
        from passgraph.pictures import save

        save(path, self[next(iter(self)) if name is None else name])

    def _repr_mimebundle_(self, **_: object) -> dict[str, str]:
        """Show each picture at its size in a notebook, with its mapping; alpha is left out, NaN is magenta."""
        from passgraph import notebook

        lines, figures = [], []
        for name, picture in self.items():
            array = np.asarray(picture)
            height, width, channels = array.shape
            about = f"{name}: {width}x{height}, {channels} channels, {array.dtype}"
            image, words = notebook.image(array)
            lines.append(about)
            figures.append(f"<figure>{image}<figcaption>{escape(f'{about}; {words}')}</figcaption></figure>")
        return notebook.bundle("\n".join(lines), "".join(figures))
