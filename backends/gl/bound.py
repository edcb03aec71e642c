"""What the passes of one run have bound and set, so that what holds already is not asked for again."""

from __future__ import annotations


class Bound:
    """Names of bound objects and the state in force; None where it is not known.

    It is true only while nobody else uses the context: :class:`passgraph.backends.gl.context.Context` forgets it
    whenever it is entered, and a run enters it once.
    """

    __slots__ = (
        "framebuffer", "samplers", "state", "switched_off", "textures", "unit", "used", "vertex_array", "viewport",
    )  # fmt: skip

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        #: Whether everything that no pass switches on is off.
        self.switched_off = False
        #: What the tests, blending and masks are set for: see :mod:`passgraph.backends.gl.state`.
        self.state: object = None
        self.framebuffer: int | None = None
        self.viewport: tuple[int, ...] | None = None
        self.used: int | None = None
        self.vertex_array: int | None = None
        #: By unit; units from its length on may have a sampler object of somebody else.
        self.textures: list[int | None] = []
        self.samplers: list[int | None] = []
        self.unit: int | None = None
