"""Random declarations of GLSL: blocks, structs, arrays and names that several of them have.

``python -m tests.hostile.declarations --count N --seed S [--backend B --run-every K]`` compiles N shaders, and runs
each K-th. Each uniform is filled with numbers that no other has, so that a value tells which uniform it was read from.
"""

from __future__ import annotations

import argparse
import random
from collections import Counter
from collections.abc import Iterator
from contextlib import nullcontext
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np

import passgraph as pg
from passgraph.errors import PassgraphError
from passgraph.glsl import parse
from passgraph.graph.calls import PixelKernel
from passgraph.language.lower import lower
from passgraph.language.types import (
    Array,
    Matrix,
    Scalar,
    Struct,
    Type,
    Vector,
    component_count,
    innermost,
    plain_parts,
    shape_of,
)
from tests.hostile.guard import guarded

NAMES = "abcde"
TYPES = ("float", "int", "uint", "vec2", "vec3", "vec4", "ivec3", "mat2", "mat3")
LENGTHS = (1, 2, 3, 5, 64, 1024, 1500)
#: Numbers of one uniform: its values are from its own times this on.
OWN = 4096
WIDTH = 5


@dataclass(frozen=True)
class Read:
    """A value that the shader outputs, as GLSL, and the number of the uniform that it is read from."""

    text: str
    uniform: int


class Declarations:
    """The text of one shader by its seed."""

    def __init__(self, seed: int) -> None:
        self.random = random.Random(seed)
        self.structs: dict[str, list[tuple[str, str, tuple[int, ...]]]] = {}
        self.lines: list[str] = []
        self.reads: list[Read] = []
        self.uniforms = 0
        #: Names that are free outside of blocks; some are as parameters of members are called.
        self._outer = [*NAMES, *(f"{instance}_{member}" for instance in NAMES for member in NAMES)]
        self.random.shuffle(self._outer)

    def text(self) -> str:
        r = self.random
        for _ in range(r.randrange(3)):
            name, fields = self._outer.pop(), self._fields()
            self.lines.append(f"struct {name} {{ {self._declared(fields)} }};")
            self.structs[name] = fields
        for _ in range(r.randint(1, 4)):
            r.choice((self._plain, self._block, self._block, self._named_block))()
        self.outputs = [r.choice(self.reads) for _ in range(4)]
        body = "\n".join(f"  o[{i}] = {read.text};" for i, read in enumerate(self.outputs))
        return "#version 430\n{}\nout vec4 o;\nvoid main() {{\n  int i = int(gl_FragCoord.x);\n{}\n}}".format(
            "\n".join(self.lines), body
        )

    def _type(self) -> tuple[str, tuple[int, ...]]:
        r = self.random
        lengths = tuple(r.choice(LENGTHS[:4]) for _ in range(r.choice((0, 0, 1, 1, 2))))
        if r.random() < 0.1:
            lengths = (r.choice(LENGTHS),)
        return r.choice((*TYPES, *self.structs)), lengths

    def _fields(self) -> list[tuple[str, str, tuple[int, ...]]]:
        names = self.random.sample(NAMES, self.random.randint(1, 4))
        return [(name, *self._type()) for name in names]

    @staticmethod
    def _declared(fields: list[tuple[str, str, tuple[int, ...]]]) -> str:
        return " ".join(f"{type_} {name}{''.join(f'[{n}]' for n in lengths)};" for name, type_, lengths in fields)

    def _plain(self) -> None:
        (field,) = [(self._outer.pop(), *self._type())]
        self.lines.append(f"uniform {self._declared([field])}")
        self._read(field[0], *field[1:], self._next())

    def _named_block(self) -> None:
        """A block without an instance, whose members are names of the shader."""
        fields = [(self._outer.pop(), *self._type()) for _ in range(self.random.randint(1, 2))]
        self.lines.append(f"uniform {self._outer.pop()}_ {{ {self._declared(fields)} }};")
        for name, type_, lengths in fields:
            self._read(name, type_, lengths, self._next())

    def _block(self) -> None:
        fields, instance = self._fields(), self._outer.pop()
        count = self.random.choice((0, 0, 1, 3))
        kind = self.random.choice(("", "layout(std140) ", "layout(shared, row_major) "))
        array = f"[{count}]" if count else ""
        self.lines.append(f"{kind}uniform {self._outer.pop()}_ {{ {self._declared(fields)} }} {instance}{array};")
        for name, type_, lengths in fields:
            number = self._next()
            base = f"{instance}{f'[{self._index(count)}]' if count else ''}.{name}"
            self._read(base, type_, lengths, number)

    def _next(self) -> int:
        self.uniforms += 1
        return self.uniforms - 1

    def _index(self, length: int) -> str:
        r = self.random
        return r.choice((str(r.randrange(length)), "i", "i - 2", f"{length} - i", "i * 1073741823", "i + 100000"))

    def _read(self, path: str, type_: str, lengths: tuple[int, ...], number: int) -> None:
        path += "".join(f"[{self._index(n)}]" for n in lengths)
        if type_ in self.structs:
            for name, inner, inner_lengths in self.structs[type_]:
                self._read(f"{path}.{name}", inner, inner_lengths, number)
            return
        if type_.startswith("mat"):
            path += f"[{self._index(int(type_[3]))}]"
        if "vec" in type_ or "mat" in type_:
            path += f"[{self._index(int(type_[-1]))}]" if self.random.random() < 0.5 else ".y"
        self.reads.append(Read(f"float({path})", number))


def value_of(type_: Type, number: int) -> Any:
    """Return a host value whose numbers no other uniform has."""
    if isinstance(type_, Struct):
        return SimpleNamespace(**{name: value_of(inner, number) for name, inner in type_.fields})
    if isinstance(type_, Array) and isinstance(innermost(type_), Struct):
        return [value_of(type_.element, number) for _ in range(type_.length)]
    assert isinstance(type_, (Scalar, Vector, Matrix, Array))
    flat = number * OWN + np.arange(component_count(type_)) % OWN
    return flat.reshape(shape_of(type_)).astype(np.float32 if "int" not in str(plain_parts(type_)) else np.int64)


def failures(seeds: Iterator[int], backend: str, run_every: int, tally: Counter[str]) -> Iterator[str]:
    """Compile the shaders of some seeds, run each ``run_every``-th (0: none), and yield what is wrong with them."""
    for count, seed in enumerate(seeds):
        declared = Declarations(seed)
        text = declared.text()
        try:
            shader = parse(text)
            lower(shader.program)
            if len(shader.uniforms) != declared.uniforms:
                yield f"{seed}: {len(shader.uniforms)} parameters for {declared.uniforms} uniforms\n{text}"
                continue
            tally["compiled"] += 1
            if not run_every or count % run_every:
                continue
            values = {one.name: value_of(one.type, n) for n, one in enumerate(shader.uniforms)}
            kernel = PixelKernel[Any].of_shader(shader)
            with guarded() if backend == "numpy" else nullcontext():
                target = kernel(into=pg.target("o", "rgba32f", size=(WIDTH, 1)), **values)
                with pg.compile(target, backend=backend) as program:
                    result = program()["o"][0]
            tally["run"] += 1
            expected = [read.uniform for read in declared.outputs]
            if (result // OWN != expected).any():
                yield f"{seed}: reads {result.tolist()}, expected numbers of {expected}\n{text}"
        except PassgraphError as error:
            tally["refused"] += 1
            message = str(error).split("\n")[0]
            tally[message.split(": ", 1)[-1][:60]] += 1
            if "fault of passgraph" in message or tally["refused"] * 5 > tally["compiled"] + 100:
                yield f"{seed}: {message}\n{text}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=20_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--backend", default="numpy")
    parser.add_argument("--run-every", type=int, default=100)
    given = parser.parse_args()
    tally: Counter[str] = Counter()
    wrong = 0
    for failure in failures(iter(range(given.seed, given.seed + given.count)), given.backend, given.run_every, tally):
        wrong += 1
        print(failure, flush=True)
    print(dict(tally), f"{wrong} wrong")
    raise SystemExit(bool(wrong))


if __name__ == "__main__":
    main()
