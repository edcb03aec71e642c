"""What the rows of a stage (code.py) tell its body (body.py): the entries of a frame, 8 bytes each."""

from __future__ import annotations

from typing import TYPE_CHECKING

from passgraph.cached import cached_property

if TYPE_CHECKING:
    from passgraph.backends.numpy.pixels.layout import StageLayout

#: What a body knows of an image that it reads anywhere: where it begins, width, height, pixels from row to row.
IMAGE = ("", "_w", "_h", "_p")


class Frame:
    """Places of one stage's entries.

    Sizes of the target; addresses of uniforms; what is known of each image; for each view the
    addresses of its rows where column 0 would be; for each target those of the rows that are made at once, likewise.
    """

    def __init__(self, stage: StageLayout) -> None:
        self.stage = stage

    @cached_property
    def places(self) -> dict[str, int]:
        names = ["width", "height", "floats", "ints"]
        names += [f"im{image}{end}" for image in range(len(self.stage.program.images)) for end in IMAGE]
        return {name: place for place, name in enumerate(names)}

    @cached_property
    def _views(self) -> list[int]:
        """Where each view's rows begin, and where the targets' do."""
        places = [len(self.places)]
        for view in self.stage.views:
            places.append(places[-1] + view.rows)
        return places

    def view(self, number: int, row: int = 0) -> int:
        """Of a row of a view, the first of them as far up as is read."""
        return self._views[number] + row

    def target(self, slot: int, row: int = 0) -> int:
        return self._views[-1] + slot * self.stage.rows + row

    @property
    def count(self) -> int:
        return self.target(len(self.stage.channels))
