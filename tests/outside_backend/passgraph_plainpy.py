"""A passgraph backend in one file of plain NumPy, written from docs/backends.md and docs/rasterization.md alone.

It interprets the scalar programs of a plan over many lanes (pixels, vertices, fragments) at once, in float32.
It is slow and meant to be read: what it imports is what a backend may rely on.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.backends import base
from passgraph.formats import Format
from passgraph.graph.draw_state import DrawState, Geometry
from passgraph.language import scalar as s
from passgraph.language.borders import border_place
from passgraph.plan.data import DrawStep, PixelStep

Lanes = NDArray[Any]  # one value a lane, or one for all: (n,) or (1,)
#: Lanes computed at once: every value of a program is kept, so that memory is this times its length.
BATCH = 1 << 14
TYPES: dict[str, Any] = {"float": np.float32, "int": np.int32, "bool": np.bool_}


@dataclass(eq=False)
class Picture:
    """A storage: (height, width, channels) float32 with row 0 on top, and bytes of stencil where the format has it."""

    format: Format
    pixels: NDArray[np.float32]
    stencil: NDArray[np.uint8]


class PlainBackend(base.Backend):
    """NumPy, float32, one thread."""

    name = "plainpy"

    @classmethod
    def devices(cls) -> list[base.DeviceInfo]:
        return [base.DeviceInfo("CPU, plain NumPy", "numpy", np.__version__)]

    def make(self, format: Format, size: tuple[int, int]) -> Picture:
        pixels = np.zeros((size[1], size[0], format.channels), np.float32)
        return Picture(format, pixels, np.zeros(size[0] * size[1] if format.stencil else 0, np.uint8))

    def upload(self, storage: Picture, picture: NDArray[np.float32]) -> None:
        storage.pixels[...] = base.quantised(picture.reshape(storage.pixels.shape), storage.format)

    def download(self, storage: Picture) -> NDArray[np.float32]:
        return storage.pixels.copy()

    def copy(self, source: Picture, destination: Picture) -> None:
        destination.pixels[...] = source.pixels
        destination.stencil[...] = source.stencil

    def geometry(self, mesh: Geometry) -> Geometry:
        return mesh

    def pixel_pass(self, step: PixelStep) -> base.PixelRunner:
        width, height = step.size

        def run(outputs: Sequence[Picture], images: Sequence[Picture], block: base.Block) -> None:
            named = dict(zip((name for name, _ in step.images), images, strict=True))
            for rows in np.array_split(np.arange(height), 1 + width * height // BATCH):
                y, x = np.repeat(rows, width), np.tile(np.arange(width), len(rows))
                builtins = stage_values(step.size, named) | {"pixel.0": x, "pixel.1": y}
                results = Run(step.program, len(x), block, builtins, named).outputs
                for output, values in zip(outputs, results, strict=True):
                    output.pixels[y, x] = values  # quantised by the program

        return run

    def draw_pass(self, step: DrawStep) -> base.DrawRunner:
        return partial(draw, step)

    def release(self, storage: Picture) -> None: ...

    def close(self) -> None: ...


#: Primitive rows of the operations table on floats, ints and bools; NumPy's int32 wraps and floors as the table asks.
OPERATIONS: dict[str, Callable[..., Any]] = {
    "add": np.add, "sub": np.subtract, "mul": np.multiply, "div": np.divide, "neg": np.negative, "abs": np.abs,
    "floor_divide": np.floor_divide, "int_mod": np.remainder,
    "min": lambda a, b: np.where(b < a, b, a), "max": lambda a, b: np.where(a < b, b, a),
    "floor": np.floor, "ceil": np.ceil, "trunc": np.trunc, "round": np.rint, "sqrt": np.sqrt,
    "less": np.less, "less_equal": np.less_equal, "greater": np.greater, "greater_equal": np.greater_equal,
    "equal": np.equal, "not_equal": np.not_equal, "isnan": np.isnan, "isinf": np.isinf,
    "logical_and": np.logical_and, "logical_or": np.logical_or, "logical_not": np.logical_not,
    "bit_and": np.bitwise_and, "bit_or": np.bitwise_or, "bit_xor": np.bitwise_xor, "bit_not": np.invert,
    "shift_left": lambda a, b: np.left_shift(a, b & 31), "shift_right": lambda a, b: np.right_shift(a, b & 31),
    "bits_from_float": lambda a: a.view(np.int32), "float_from_bits": lambda a: a.view(np.float32),
    "to_float": lambda a: a.astype(np.float32),
    # Toward zero; saturates, NaN gives 0.
    "to_int": lambda a: np.clip(np.nan_to_num(a.astype(np.float64)), -(2.0**31), 2.0**31 - 1).astype(np.int32),
}  # fmt: skip


class Run:
    """One program over ``count`` lanes.  Lanes that a branch leaves out are computed too, but write no variable."""

    def __init__(
        self, program: s.ScalarProgram, count: int, block: base.Block, builtins: Mapping[str, Any],
        images: Mapping[str, Picture],
    ) -> None:  # fmt: skip
        self.blocks, self.builtins, self.images = {"float": block.floats, "int": block.ints}, builtins, images
        self.tables = {name: np.array(values, TYPES[kind]) for name, kind, values in program.tables}
        self.variables = {name: np.zeros(count, TYPES[kind]) for name, kind in program.variables}
        self.arrays = {name: np.zeros((length, count), TYPES[kind]) for name, kind, length in program.arrays}
        self.values: dict[int, Lanes] = {}
        self.active = np.ones(count, np.bool_)
        self.continued: list[NDArray[np.bool_]] = []  # of each loop around: lanes that wait for its next trip
        with np.errstate(all="ignore"):
            self.all(program.body)
        self.outputs = [self.columns(output.values, count) for output in program.outputs]
        self.keep = self.active if program.keep is None else np.broadcast_to(self.get(program.keep), count)

    def get(self, operand: s.Operand) -> Lanes:
        return np.array([operand.value], TYPES[operand.type]) if isinstance(operand, s.Lit) else self.values[operand.id]

    def columns(self, values: tuple[s.Operand, ...], count: int) -> Lanes:
        """Results side by side, (count, values); a draw without varyings has an output of none."""
        return np.array([np.broadcast_to(self.get(v), count) for v in values]).reshape(len(values), count).T

    def all(self, body: tuple[s.Instruction, ...]) -> None:
        for i in body:
            match i:
                case s.Op():
                    self.values[i.to.id] = OPERATIONS[i.operation](*(self.get(a) for a in i.arguments))
                case s.Choose():
                    self.values[i.to.id] = np.where(self.get(i.condition), self.get(i.then), self.get(i.orelse))
                case s.LoadUniform():
                    self.values[i.to.id] = self.blocks[i.block][self.get(i.index)]
                case s.LoadTable():
                    self.values[i.to.id] = self.tables[i.table][self.get(i.index)]
                case s.LoadBuiltin():
                    self.values[i.to.id] = np.atleast_1d(self.builtins[str(i.name)]).astype(TYPES[i.to.type])
                case s.LoadTexel():
                    self.texel(i)
                case s.Read():
                    self.values[i.to.id] = self.variables[i.variable]
                case s.Write():
                    self.variables[i.variable] = np.where(self.active, self.get(i.value), self.variables[i.variable])
                case s.ReadAt():
                    array = self.arrays[i.array]
                    self.values[i.to.id] = array[self.get(i.index), np.arange(array.shape[1])]
                case s.WriteAt():
                    at = np.flatnonzero(self.active)
                    index, value = (np.broadcast_to(self.get(x), self.active.shape)[at] for x in (i.index, i.value))
                    self.arrays[i.array][index, at] = value
                case s.If():
                    self.branch(i)
                case s.For():
                    self.loop(i)
                case s.Continue():
                    self.continued[-1] |= self.active
                    self.active = np.zeros_like(self.active)
                case s.Break():
                    self.active = np.zeros_like(self.active)

    def texel(self, i: s.LoadTexel) -> None:
        pixels = self.images[i.image].pixels
        height, width = pixels.shape[:2]
        x, y = self.get(i.x).astype(np.int64), self.get(i.y).astype(np.int64)
        if i.relative:
            x, y = x + self.builtins["pixel.0"], y + self.builtins["pixel.1"]
        texels = pixels[border_place(i.border, y, height), border_place(i.border, x, width)]
        if i.border == "zero":
            texels = np.where(((x >= 0) & (x < width) & (y >= 0) & (y < height))[:, None], texels, np.float32(0))
        for channel, value in enumerate(i.to):
            if value is not None:
                self.values[value.id] = texels[:, channel].copy()

    def branch(self, i: s.If) -> None:
        before, condition, after = self.active, self.get(i.condition), []
        for chosen, body in ((before & condition, i.then), (before & ~condition, i.orelse)):
            self.active = chosen
            if chosen.any():
                self.all(body)
            after.append(self.active)
        self.active = after[0] | after[1]

    def loop(self, i: s.For) -> None:
        before = self.active
        for index in range(i.start, i.stop, i.step):
            if not self.active.any():
                break
            self.values[i.index.id] = np.array([index], np.int32)
            self.continued.append(np.zeros_like(before))
            self.all(i.body)
            self.active = self.active | self.continued.pop()
        self.active = before


def stage_values(size: tuple[int, int], images: Mapping[str, Picture]) -> dict[str, Any]:
    """What every stage knows; ``builtins`` of a program names them."""
    sizes = {f"size.{name}.{k}": image.pixels.shape[1 - k] for name, image in images.items() for k in (0, 1)}
    return {"output_size.0": size[0], "output_size.1": size[1], **sizes}


# Draws: numbers are the rules of docs/rasterization.md


def draw(
    step: DrawStep, outputs: Sequence[Picture], depth: Picture | None, images: Sequence[Picture], geometry: Geometry,
    vertex: base.Block, fragment: base.Block,
) -> None:  # fmt: skip
    """Vertex program, triangles one by one, fragment program, tests, output."""
    for output, clear in zip(outputs, step.clears, strict=True):
        if clear is not None:
            colour = base.clear_colour(clear, output.format.channels, output.format.srgb)
            output.pixels[...] = base.quantised(np.array(colour), output.format)
    if depth is not None and step.depth_clear is not None:
        depth.pixels[...] = step.depth_clear
        depth.stencil[...] = step.state.clear_stencil
    given = [(name, base.vertex_attribute(geometry, name).T) for name in base.ATTRIBUTES]
    builtins = {f"vertex.{name}.{k}": column for name, columns in given for k, column in enumerate(columns)}
    builtins["vertex.instance"] = builtins["vertex.instance.0"]  # one number, which has no component
    named = dict(zip((name for name, _ in step.images), images, strict=True))  # one name, one picture, in both programs
    stage = stage_values(step.size, named)
    sent = Run(step.vertex, len(geometry.positions), vertex, builtins | stage, named).outputs
    corners = np.concatenate(sent, axis=1)[np.asarray(geometry.triangles)].astype(np.float64)
    with np.errstate(all="ignore"):
        parts = [part for three in corners for part in covered(three, step)]
        if parts:
            x, y, front, quads = (np.concatenate(column) for column in zip(*parts, strict=True))
            z = quads[:, 0, 0]
            builtins = stage | {"pixel.0": x, "pixel.1": y, "front_facing": front}
            for k, axes in enumerate(QUAD):
                builtins[f"fragment_depth@{axes}" if axes else "fragment_depth"] = quads[:, k, 0]
                varyings = zip(step.varyings, quads[:, k, 1:].T, strict=True)
                builtins |= {str(name.at(axes)): column for name, column in varyings}
            made = step.fragment and Run(step.fragment, len(x), fragment, builtins, named)
            keep, colours = (made.keep, made.outputs) if made else (np.ones(len(x), np.bool_), [])
            merge(step, keep, y * step.size[0] + x, z, colours, outputs, depth)


EMPTY = base.Block(np.zeros(0, np.float32), np.zeros(0, np.int32))
#: What the names of values have at the pixels of a quad, from a fragment's own.
QUAD = ("", "x", "y", "xy")


def merge(
    step: DrawStep, keep: Lanes, pixel: Lanes, z: Lanes, colours: list[Lanes], outputs: Sequence[Picture],
    depth: Picture | None,
) -> None:  # fmt: skip
    """6 and 7: in layers, so that no pixel occurs twice: first fragments, then second ones, and so on."""
    state, left = step.state, np.flatnonzero(keep)
    while len(left):
        first = np.unique(pixel[left], return_index=True)[1]
        layer, left = left[first], np.delete(left, first)
        if depth is not None:
            layer = layer[tested(state, depth, pixel[layer], z[layer])]
        for k, (output, colour) in enumerate(zip(outputs, colours, strict=True)):
            stored, at = output.pixels.reshape(-1, output.format.channels), pixel[layer]
            new, blend = colour[layer], step.blending[k]
            if blend is not None:  # a program too, which quantises
                parts = {"source": new, "destination": stored[at]}
                builtins = {f"{name}.{c}": column for name, part in parts.items() for c, column in enumerate(part.T)}
                new = Run(blend, len(layer), EMPTY, builtins, {}).outputs[0]
            mask = state.color_mask[k] if state.color_mask else (True,) * 4
            stored[at] = np.where(mask[: output.format.channels], new, stored[at])


def clipped(polygon: Lanes) -> Lanes:
    """1: near and far plane, then the guard band; corners are rows of clip position and varyings."""
    for axis, sign, times in ((2, 1, 1), (2, -1, 1), (0, 1, 8), (0, -1, 8), (1, 1, 8), (1, -1, 8)):
        distance = times * polygon[:, 3] + sign * polygon[:, axis]
        made = []
        for i in range(len(polygon)):
            j = (i + 1) % len(polygon)
            if distance[i] >= 0:
                made.append(polygon[i])
            if (distance[i] >= 0) != (distance[j] >= 0):
                a, b = (i, j) if distance[i] >= 0 else (j, i)
                made.append(polygon[a] + (polygon[b] - polygon[a]) * (distance[a] / (distance[a] - distance[b])))
        polygon = np.array(made).reshape(-1, polygon.shape[1])
    return polygon


def covered(polygon: Lanes, step: DrawStep) -> Iterator[tuple[Lanes, ...]]:
    """1 to 3: what clipping leaves of one triangle, as triangles of positive area."""
    corners = clipped(polygon) if np.isfinite(polygon[:, :4]).all() else polygon[:0]
    x, y, _, w = corners[:, :4].T
    window = np.stack([(x / w * 0.5 + 0.5) * step.size[0], (0.5 - y / w * 0.5) * step.size[1]], axis=1)
    if not np.isfinite(window).all():  # w = 0 passes both planes where z = 0 too
        return
    snapped = np.rint(window * 256).astype(np.int64)
    for k in range(1, len(corners) - 1):
        chosen = np.array([0, k, k + 1])
        (x0, y0), (x1, y1), (x2, y2) = snapped[chosen]
        area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
        front = area < 0  # counter-clockwise with y up
        if area and step.state.cull != ("front" if front else "back"):
            chosen = chosen[::-1] if front else chosen
            yield triangle(snapped[chosen], corners[chosen], abs(area), front, step)


def triangle(at: Lanes, corners: Lanes, area: int, front: bool, step: DrawStep) -> tuple[Lanes, ...]:
    """4, 5 and 8: x, y, whether it is a front, and depth and varyings, of the covered centres' quads each."""
    low = np.maximum((at.min(axis=0) + 127) // 256, 0)
    high = np.maximum(np.minimum((at.max(axis=0) - 128) // 256 + 1, step.size), low)
    y, x = (axis.ravel() for axis in np.mgrid[low[1] : high[1], low[0] : high[0]])
    start, along = np.roll(at, -1, axis=0), np.roll(at, -2, axis=0) - np.roll(at, -1, axis=0)  # opposite each corner
    dx, dy = along.T

    def edges(x: Lanes, y: Lanes) -> Lanes:
        values: Lanes = dx * (256 * y[:, None] + 128 - start[:, 1]) - dy * (256 * x[:, None] + 128 - start[:, 0])
        return values

    hit = (edges(x, y) >= np.where((dy < 0) | ((dy == 0) & (dx > 0)), 0, 1)).all(axis=1)
    x, y, w = x[hit], y[hit], corners[:, 3]
    depths = corners[:, 2] / w * 0.5 + 0.5
    slope = max(abs((depths * dy).sum()), abs((depths * dx).sum())) * 256 / area
    exponent = np.frexp(max(abs(depths).max(), 2.0**-126))[1] - 1
    factor, units = step.state.polygon_offset
    offset, quad = factor * slope + units * 2.0 ** (exponent - 23.0), []
    for beside in QUAD:
        weights = edges(x ^ ("x" in beside), y ^ ("y" in beside)) / area
        depth = np.clip((weights * depths).sum(axis=1) + offset, 0, 1)
        varyings = (weights / w) @ corners[:, 4:] / (weights / w).sum(axis=1, keepdims=True)
        quad.append(np.column_stack([depth, varyings]).astype(np.float32))
    return x, y, np.full(len(x), front), np.stack(quad, axis=1)


COMPARE: dict[str, Callable[[Any, Any], Lanes]] = {
    "never": lambda a, b: np.zeros(b.shape, np.bool_), "always": lambda a, b: np.ones(b.shape, np.bool_),
    "less": np.less, "equal": np.equal, "less_equal": np.less_equal, "greater": np.greater,
    "not_equal": np.not_equal, "greater_equal": np.greater_equal,
}  # fmt: skip


def tested(state: DrawState, picture: Picture, at: Lanes, depth: Lanes) -> Lanes:
    """6: which of some fragments in different pixels pass; depth and stencil follow."""
    depths, stencil = picture.pixels.reshape(-1), state.stencil
    passed = COMPARE[state.depth_compare](depth, depths[at])
    if stencil is not None and len(picture.stencil):
        old = picture.stencil[at].astype(np.int64)
        results = {
            "keep": old, "zero": 0 * old, "replace": 0 * old + stencil.reference, "invert": old ^ 255,
            "increment": np.minimum(old + 1, 255), "increment_wrap": (old + 1) & 255,
            "decrement": np.maximum(old - 1, 0), "decrement_wrap": (old - 1) & 255,
        }  # fmt: skip
        allowed = COMPARE[stencil.compare](stencil.reference & stencil.read_mask, old & stencil.read_mask)
        new = np.where(passed, results[stencil.passed], results[stencil.depth_fail])
        new = np.where(allowed, new, results[stencil.fail])
        picture.stencil[at] = (old & ~stencil.write_mask) | (new & stencil.write_mask)
        passed = passed & allowed
    if state.depth_write:
        depths[at[passed]] = depth[passed]
    return passed
