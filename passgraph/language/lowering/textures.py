"""Texels of images in textures: samples at computed coordinates, with border rules that samplers lack as arithmetic.

Texels are sampled at their centers (exact in float32 for pictures up to 2²¹ texels a side): filters are nearest, and
textures clamp to their edge.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from passgraph.language import scalar as s
from passgraph.language.borders import BORDERS
from passgraph.language.builtin_name import PIXEL, BuiltinName, size_names
from passgraph.language.lowering.building import Builder, number
from passgraph.records import dataclass

#: Larger than every picture, and small enough that its float stays an int after multiplication and rounding.  Larger
#: offsets are reduced first: adding the pixel's position could overflow 32 bits.
FARTHEST_TEXEL = 1 << 30
#: Remainders are exact up to here: the float quotient is off by less than one.
NEAR = 1 << 20


@dataclass(frozen=True)
class Texture:
    """How an image lies in a texture.

    Attributes
    ----------
    turned : its rows are counted from the bottom
    part : it is the part of a texture from builtins ``region.NAME.0`` and ``.1`` on; the centers of its outermost
        texels are ``low.NAME.0`` … and ``high.NAME.0`` …
    """

    turned: bool = False
    part: bool = False


@dataclass(frozen=True)
class TexelsInTextures:
    """A pass: each texel read becomes a sample.

    Builtins are the width and height of a texel in texture coordinates (``texel.NAME.0`` …), and the center of this
    pixel, in images of the target's size (``here.NAME.0`` …).
    """

    textures: Mapping[str, Texture]

    def __call__(self, program: s.ScalarProgram) -> s.ScalarProgram:
        if not any(isinstance(i, s.LoadTexel) for i in s.walk(program.body)):
            return program
        texels = _Texels(program, self.textures)
        return texels.builder.finished(s.rewritten(program.body, texels.lowered))


class _Texels:
    def __init__(self, program: s.ScalarProgram, textures: Mapping[str, Texture]) -> None:
        self.program, self.textures, self.builder = program, textures, Builder(program)

    def lowered(self, i: s.Instruction) -> Iterable[s.Instruction]:
        if not isinstance(i, s.LoadTexel):
            return (i,)
        if not i.filtered:
            places, inside = zip(*(self._place(i, axis) for axis in (0, 1)), strict=True)
            self._sample(i, places, [condition for axis in inside for condition in axis])
        elif self.textures[i.image].part and i.border != "clamp":
            self._mixed(i)
        else:
            x, y = (self._position(i, axis) for axis in (0, 1))
            self.builder.add(s.Sample(i.to, i.image, x, y, i.border, i.span))
        return self.builder.taken()

    def _sample(self, load: s.LoadTexel, places: tuple[s.Operand, ...], inside: list[s.Operand]) -> None:
        """Sample a texel, and replace it by 0 where a condition is false."""
        b = self.builder
        shown = tuple(None if to is None else b.fresh("float") if inside else to for to in load.to)
        b.add(s.Sample(shown, load.image, places[0], places[1], "", load.span))
        if inside:
            condition = inside[0]
            for other in inside[1:]:
                condition = b.op("logical_and", "bool", condition, other)
            for to, value in zip(load.to, shown, strict=True):
                if to is not None and value is not None:
                    b.add(s.Choose(to, condition, value, s.Lit("float", 0.0)))

    def _size(self, image: str, axis: int) -> s.Operand:
        return self.builder.builtin(size_names(image)[axis])

    def _width(self, image: str, axis: int) -> s.Operand:
        return self._builtin("texel", image, axis)

    def _builtin(self, kind: str, image: str, axis: int) -> s.Val:
        return self.builder.builtin(BuiltinName(kind, image, axis), s.COORDINATE)

    def _coordinate(self, whole: s.Operand) -> s.Operand:
        if isinstance(whole, s.Lit):
            return s.Lit("float", float(whole.value))
        return self.builder.index("to_coordinate", whole)

    def _is_turned(self, image: str, axis: int) -> bool:
        return axis == 1 and self.textures[image].turned

    def _place(self, load: s.LoadTexel, axis: int) -> tuple[s.Operand, list[s.Operand]]:
        """Return a coordinate of a texel's center, and the conditions under which a zero border shows the texel."""
        b, image, rule, offset = self.builder, load.image, BORDERS[load.border], (load.x, load.y)[axis]
        if load.relative and isinstance(offset, s.Lit) and offset.value == 0:
            return self._builtin("here", image, axis), []  # the image is as large as the target
        size, use = self._size(image, axis), self.program.image(image)
        reach = max(map(abs, (use.x, use.y)[axis]))
        if rule.period and (not load.relative or reach > NEAR):
            offset = b.index("nearer", offset, b.period(load.border, size))
        elif load.relative and reach > FARTHEST_TEXEL:
            far = b.index("mul", size, number(2))
            offset = b.index("min", b.index("max", offset, b.index("neg", far)), far)
        if not rule.is_nearest:
            return self._center(image, axis, b.bordered(load.border, self._whole(load, axis, offset), size)), []
        turned = self._is_turned(image, axis)
        # Drivers convert the coordinate to int before they clamp it; too large a number wraps to the other edge.
        if isinstance(offset, s.Lit):
            nearer: s.Operand = number(min(max(int(offset.value), -FARTHEST_TEXEL), FARTHEST_TEXEL))
        elif turned:
            nearer = b.index("max", offset, number(-FARTHEST_TEXEL))
        else:
            nearer = b.index("min", offset, number(FARTHEST_TEXEL))
        if load.relative:
            moved = b.coordinate("mul", self._coordinate(nearer), self._width(image, axis))
            here = self._builtin("here", image, axis)
            place = b.coordinate("sub" if turned else "add", here, moved)
        else:
            place = self._center(image, axis, nearer)
        return self._within(image, axis, place), self._inside(load, axis, offset, size) if rule.blank else []

    def _whole(self, load: s.LoadTexel, axis: int, offset: s.Operand) -> s.Operand:
        """Return the column or row of a read."""
        b = self.builder
        return b.index("add", b.builtin(PIXEL[axis]), offset) if load.relative else offset

    def _inside(self, load: s.LoadTexel, axis: int, offset: s.Operand, size: s.Operand) -> list[s.Operand]:
        b, whole = self.builder, self._whole(load, axis, offset)
        if not isinstance(offset, s.Lit):
            return [b.index("below", whole, size)]
        low = offset.value < 0
        high = offset.value > 0 if load.relative else True
        return [
            *([b.index("greater_equal", whole, number(0))] if low else []),
            *([b.index("less", whole, size)] if high else []),
        ]

    def _center(self, image: str, axis: int, whole: s.Operand) -> s.Operand:
        """Return the center of a column or row in texture coordinates."""
        b = self.builder
        inside = b.coordinate("add", self._coordinate(whole), s.Lit("float", 0.5))
        if self._is_turned(image, axis):
            inside = b.coordinate("sub", self._coordinate(self._size(image, axis)), inside)
        if self.textures[image].part:
            inside = b.coordinate("add", inside, self._coordinate(b.builtin(BuiltinName("region", image, axis))))
        return b.coordinate("mul", inside, self._width(image, axis))

    def _within(self, image: str, axis: int, place: s.Operand) -> s.Operand:
        """Clamp a coordinate to the centers of the outermost texels of a part, as its sampler does not."""
        if not self.textures[image].part:
            return place
        low, high = (self._builtin(end, image, axis) for end in ("low", "high"))
        return self.builder.coordinate("clamp", place, low, high)

    def _position(self, load: s.LoadTexel, axis: int) -> s.Operand:
        """Convert a position in [0, 1] to texture coordinates."""
        b, image, place = self.builder, load.image, (load.x, load.y)[axis]
        if self._is_turned(image, axis):
            place = b.coordinate("sub", s.Lit("float", 1.0), place)
        if self.textures[image].part:
            moved = b.coordinate("mul", place, self._coordinate(self._size(image, axis)))
            moved = b.coordinate("add", moved, self._coordinate(b.builtin(BuiltinName("region", image, axis))))
            place = self._within(image, axis, b.coordinate("mul", moved, self._width(image, axis)))
        return place

    def _mixed(self, load: s.LoadTexel) -> None:
        """Interpolate four texels of a part: samplers wrap at the edges of textures."""
        b, corners, shares = self.builder, [], []
        far = s.Lit("float", float(FARTHEST_TEXEL))
        for axis in (0, 1):
            scaled = b.coordinate("mul", (load.x, load.y)[axis], self._coordinate(self._size(load.image, axis)))
            place = b.coordinate("sub", scaled, s.Lit("float", 0.5))
            place = b.coordinate("clamp", place, s.Lit("float", -float(FARTHEST_TEXEL)), far)
            corners.append(b.coordinate("to_index", b.coordinate("floor", place)))
            shares.append(b.coordinate("fract", place))
        texels = [[self._fetched(load, corners, (right, down)) for right in (0, 1)] for down in (0, 1)]
        for channel, to in enumerate(load.to):
            if to is not None:
                rows = [b.op("mix", "float", *(texel[channel] for texel in row), shares[0]) for row in texels]
                b.op("mix", "float", *rows, shares[1], to=to)

    def _fetched(self, load: s.LoadTexel, corners: list[s.Operand], steps: tuple[int, int]) -> list[s.Operand]:
        """Return the channels of a texel of a part, at a distance from a corner."""
        b, image, rule, places, inside = self.builder, load.image, BORDERS[load.border], [], []
        for axis in (0, 1):
            whole, size = b.index("add", corners[axis], number(steps[axis])), self._size(image, axis)
            inside.append(b.index("below", whole, size))
            if rule.period:
                whole = b.index("nearer", whole, b.period(load.border, size))
            place = b.bordered(load.border, whole, size)
            if self._is_turned(image, axis):
                place = b.index("sub", b.index("sub", size, number(1)), place)
            places.append(b.index("add", b.builtin(BuiltinName("region", image, axis)), place))
        texel = tuple(b.fresh("float") for _ in load.to)
        b.add(s.Sample(texel, image, places[0], places[1], "", load.span))
        if not rule.blank:
            return list(texel)
        shown = [b.fresh("float") for _ in texel]
        condition = b.op("logical_and", "bool", *inside)
        for to, value in zip(shown, texel, strict=True):
            b.add(s.Choose(to, condition, value, s.Lit("float", 0.0)))
        return list(shown)
