"""Runs scalar programs over NumPy arrays in float32: one lane a pixel, jumps and branches as masks.

Written apart from the operations table, from what docs/kernels.md promises, so that the two check each other.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.language import scalar as s

Lanes = NDArray[Any]
Fetch = Callable[[str, Lanes, Lanes], Lanes]  # image, x, y → (lanes, channels)
DTYPES = {"float": np.float32, "int": np.int32, "bool": np.bool_, "index": np.int64, "long": np.int64}
DTYPES["coordinate"] = np.float32


def _whole_divide(a: Lanes, b: Lanes) -> Lanes:
    wide, by = a.astype(np.int64), b.astype(np.int64)
    return np.where(by == 0, 0, wide // np.where(by == 0, 1, by))


def _whole_mod(a: Lanes, b: Lanes) -> Lanes:
    wide, by = a.astype(np.int64), b.astype(np.int64)
    return np.where(by == 0, 0, wide % np.where(by == 0, 1, by))


def _whole(a: Lanes) -> Lanes:
    wide = np.nan_to_num(a.astype(np.float64), nan=0.0, posinf=2.0**40, neginf=-(2.0**40))
    return np.trunc(np.clip(wide, -(2.0**31), 2.0**31 - 1))


COMPUTE: dict[str, Callable[..., Lanes]] = {
    "add": lambda a, b: a + b, "sub": lambda a, b: a - b, "mul": lambda a, b: a * b,
    "div": lambda a, b: a / b, "neg": lambda a: -a, "floor_divide": _whole_divide, "int_mod": _whole_mod,
    "min": lambda a, b: np.where(b < a, b, a), "max": lambda a, b: np.where(a < b, b, a), "abs": np.abs,
    "floor": np.floor, "ceil": np.ceil, "trunc": np.trunc, "round": np.rint, "sqrt": np.sqrt,
    "less": np.less, "less_equal": np.less_equal, "greater": np.greater, "greater_equal": np.greater_equal,
    "equal": np.equal, "not_equal": np.not_equal,
    "logical_and": np.logical_and, "logical_or": np.logical_or, "logical_not": np.logical_not,
    "isnan": np.isnan, "isinf": np.isinf,
    "bit_and": np.bitwise_and, "bit_or": np.bitwise_or, "bit_xor": np.bitwise_xor, "bit_not": np.bitwise_not,
    "shift_left": lambda a, b: a << (b & 31), "shift_right": lambda a, b: a >> (b & 31),
    "bits_from_float": lambda a: a.view(np.int32), "float_from_bits": lambda a: a.view(np.float32),
    "to_float": lambda a: a, "to_int": lambda a: _whole(a) if a.dtype.kind == "f" else a,
    "to_long": lambda a: a, "to_index": lambda a: a, "to_coordinate": lambda a: a.astype(np.float32),
    "below": lambda a, b: (a >= 0) & (a < b), "clamp": lambda a, low, high: np.minimum(np.maximum(a, low), high),
    "nearer": lambda a, b: a - np.trunc(a.astype(np.float32) * (np.float32(1) / b.astype(np.float32))).astype(int) * b,
    "fract": lambda a: a - np.floor(a), "mix": lambda a, b, c: a * (1 - c) + b * c,
    "decode": lambda a: a.astype(np.uint16).view(np.float16), "encode": lambda a: a,
}  # fmt: skip


class Evaluator:
    """One run of a program over ``lanes`` pixels."""

    def __init__(self, program: s.ScalarProgram, lanes: int, fetch: Fetch | None = None, **blocks: Lanes) -> None:
        self.program, self.lanes, self.fetch, self.blocks = program, lanes, fetch, blocks
        self.values: dict[int, Lanes] = {}
        self.variables = {name: np.zeros(lanes, DTYPES[type_]) for name, type_ in program.variables}
        self.arrays = {name: np.zeros((n, lanes), DTYPES[type_]) for name, type_, n in program.arrays}
        self.tables = {n: np.array(v, DTYPES[t]) for n, t, v in program.tables}
        self.jumps: list[list[Lanes]] = []  # of each loop around: lanes that left it, lanes that left this trip
        with np.errstate(all="ignore"):
            self.block(program.body, np.ones(lanes, bool))

    def outputs(self) -> list[list[Lanes]]:
        return [[self.get(v) for v in output.values] for output in self.program.outputs]

    def get(self, operand: s.Operand) -> Lanes:
        if isinstance(operand, s.Lit):
            return np.full(self.lanes, operand.value, DTYPES[operand.type])
        return self.values[operand.id]

    def put(self, to: s.Val, value: Lanes) -> None:
        self.values[to.id] = np.ascontiguousarray(np.broadcast_to(value, self.lanes), DTYPES[to.type])

    def block(self, body: tuple[s.Instruction, ...], active: Lanes) -> None:
        for instruction in body:
            here = active
            for left in self.jumps[-1:]:
                here = active & ~left[0] & ~left[1]
            self.run(instruction, here)

    def run(self, i: s.Instruction, active: Lanes) -> None:
        if isinstance(i, s.Op):
            if i.on in ("index", "long"):
                given = [self.get(a).astype(np.int64) for a in i.arguments]
                result = COMPUTE[i.operation](*given)
                assert i.to.type != "index" or (np.abs(result + 0.5) < 2.0**31).all(), f"{i} overflows"
            else:
                result = COMPUTE[i.operation](*(self.get(a) for a in i.arguments))
            if i.to.type == "int" and result.dtype.kind in "if":
                result = ((result.astype(np.int64) + 2**31) & 0xFFFFFFFF) - 2**31
            self.put(i.to, result)
        elif isinstance(i, s.Choose):
            self.put(i.to, np.where(self.get(i.condition), self.get(i.then), self.get(i.orelse)))
        elif isinstance(i, s.LoadUniform):
            self.put(i.to, self.blocks[i.block][self.get(i.index)])
        elif isinstance(i, s.LoadTable):
            self.put(i.to, self.tables[i.table][self.get(i.index)])
        elif isinstance(i, s.LoadBuiltin):
            self.put(i.to, self.blocks[str(i.name)])
        elif isinstance(i, s.LoadTexel):
            assert self.fetch is not None
            texel = self.fetch(i.image, self.get(i.x), self.get(i.y))
            for channel, to in enumerate(i.to):
                if to is not None:
                    self.put(to, texel[:, channel])
        elif isinstance(i, s.Load):
            index, buffer = self.get(i.index), self.blocks[i.image]
            for to, place in zip(i.to, i.places, strict=True):
                if to is not None:
                    assert ((index + place >= 0) & (index + place < len(buffer))).all(), f"{i} leaves its buffer"
                    self.put(to, buffer[index + place])
        elif isinstance(i, s.Sample):
            texture, places = self.blocks[i.image], []
            for place, count in ((self.get(i.x), texture.shape[1]), (self.get(i.y), texture.shape[0])):
                whole = place if place.dtype.kind == "i" else np.floor(place * count).astype(np.int64)
                places.append(np.clip(whole, 0, count - 1))
            for channel, to in enumerate(i.to):
                if to is not None:
                    self.put(to, texture[places[1], places[0], channel])
        elif isinstance(i, s.Store):
            for value, place in zip(i.values, i.places, strict=True):
                self.blocks[f"out{i.output}"][self.get(i.index) + place] = self.get(value)
        elif isinstance(i, s.Read):
            self.put(i.to, self.variables[i.variable])
        elif isinstance(i, s.Write):
            old = self.variables[i.variable]
            self.variables[i.variable] = np.where(active, self.get(i.value), old)
        elif isinstance(i, s.ReadAt):
            self.put(i.to, self.arrays[i.array][self.get(i.index), np.arange(self.lanes)])
        elif isinstance(i, s.WriteAt):
            where = self.get(i.index)[active], np.flatnonzero(active)
            self.arrays[i.array][where] = self.get(i.value)[active]
        elif isinstance(i, s.If):
            condition = self.get(i.condition)
            self.block(i.then, active & condition)
            self.block(i.orelse, active & ~condition)
        elif isinstance(i, s.For):
            self.jumps.append([~active, np.zeros(self.lanes, bool)])
            for index in range(i.start, i.stop, i.step):
                self.put(i.index, np.array(index))
                self.jumps[-1][1] = np.zeros(self.lanes, bool)
                self.block(i.body, active)
            self.jumps.pop()
        else:
            self.jumps[-1][0 if isinstance(i, s.Break) else 1] |= active


def evaluate(program: s.ScalarProgram, inputs: Mapping[str, Lanes], lanes: int) -> list[list[Lanes]]:
    """The outputs of a program whose images are read at this pixel only and given as arrays of lanes."""

    def fetch(image: str, x: Lanes, y: Lanes) -> Lanes:
        assert not x.any()
        assert not y.any()
        return inputs[image]

    return Evaluator(program, lanes, fetch, **inputs).outputs()
