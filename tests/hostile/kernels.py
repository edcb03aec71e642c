"""Kernel text from an attacker, by the thousand: whatever it says, native code stays in its memory and ends.

``python -m tests.hostile.kernels --cases N --seed S --backend B`` makes kernels by seed, compiles each and runs it on
several sizes and border rules: each run is a case.  On numpy the backend's arrays lie between pages that nobody may
touch (guard.py).  Cases run in child processes with a bound on time and memory; a child that dies or goes on too long
is a failure that names its seed, and the rest of its kernels go to the next child.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import resource
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
INT_MIN, INT_MAX = -(2**31), 2**31 - 1
BORDERS = ("clamp", "zero", "repeat", "mirror")
FORMATS = ("r32f", "rg32f", "rgba32f", "rgba16f", "rgba8", "r8", "rgba8_srgb", "rgba16")
#: Nothing but one pixel, one row, one column, primes, more than a vector, a round number.
SIZES = ((1, 1), (1, 13), (17, 1), (7, 5), (31, 3), (64, 4), (67, 11))
#: A child may compute this long for one kernel, every case of it: seconds of all its threads.
SECONDS = 240
#: And say nothing for so long, where it waits, or others have the machine.
SILENT_SECONDS = 1200
#: Kernels that one child runs.
KERNELS_A_CHILD = 25
#: Address space of a child on numpy; drivers need more than this for themselves.
BYTES = 6 * 2**30


class Text:
    """One kernel's text by a random generator."""

    def __init__(self, seed: int) -> None:
        self.random = random.Random(seed)
        self.lines: list[str] = []
        self.names = 0
        self.arrays: list[tuple[str, int]] = []

    def whole(self) -> int:
        r = self.random
        near = r.choice((0, 0, 1, -1, 2, 63, 64, 65, 255, 1024, 65_535, 2**30, INT_MAX, INT_MIN))
        return max(INT_MIN, min(INT_MAX, near + r.choice((0, 0, 0, 1, -1, 5, -7)) * r.choice((1, 1, 1000))))

    def offset(self) -> int:
        r = self.random
        return r.choice((r.randint(-3, 3), r.randint(-80, 80), r.randint(-5000, 5000), self.whole()))

    def number(self) -> str:
        return self.random.choice(
            ("0.0", "1.0", "-1.0", "0.5", "3.4e38", "-3.4e38", "1e-38", "2147483648.0", "-2147483904.0", "4294967296.0",
             "0.0 / 0.0", "1.0 / 0.0", "-1.0 / 0.0", "2097152.25", "-16777217.0", "1e20")
        )  # fmt: skip

    def index(self) -> str:
        """Any int that an index may be."""
        r = self.random
        return r.choice(
            (f"({self.whole()} + q)", f"int(v.x * {self.number()})", f"int(v.{r.choice('xyzw')} * {self.whole()}.0)",
             "pixel().x * 65537", f"pixel().y - {abs(self.whole()) % 2**31}", f"p.x + {r.randint(-9, 9)}",
             f"bits_from_float(v.x + {self.number()})")
        )  # fmt: skip

    def value(self, depth: int = 0) -> str:
        """A vec4."""
        r = self.random
        if depth > 3:
            return r.choice(("v", "t", "vec4(p.x)"))
        kinds: tuple[Callable[[], str], ...] = (
            lambda: f"c[{self.offset()}, {self.offset()}]",
            lambda: f"d[{self.offset()}, {self.offset()}]",
            lambda: f"c[{self.offset()} if v.x > 0.5 else {self.offset()}, {r.randint(-2, 2)}]",
            lambda: f"c.texel(ivec2({self.index()}, {self.index()}))",
            lambda: f"d.texel(pixel() + ivec2({self.index()}, {self.index()}))",
            lambda: f"d.sample(uv() * vec2({self.number()}, {self.number()}))",
            lambda: f"c.sample(vec2({self.number()}, v.y) + uv())",
            lambda: f"vec4(v[{self.index()} & 255 if v.x > 0.1 else 3])" if r.random() < 0.3 else "v",
            lambda: f"{self.value(depth + 1)} {r.choice('+-*/')} {self.value(depth + 1)}",
            lambda: f"vec4({self.table()}[{self.index()}])",
            lambda: f"vec4(w[{self.index()}])",
            lambda: self.element(depth),
            lambda: f"vec4(float({self.index()} {r.choice(('//', '%', '<<', '>>', '*', '+'))} ({self.index()})))",
            lambda: f"vec4(f(v.x, {self.index()}))",
        )
        return r.choice(kinds)()

    def table(self) -> str:
        return self.random.choice(("T", "U"))

    def element(self, depth: int) -> str:
        if not self.arrays:
            return self.value(depth + 1)
        name, _ = self.random.choice(self.arrays)
        return f"vec4({name}[{self.index()}])"

    def line(self, text: str, depth: int) -> None:
        self.lines.append("    " * (depth + 1) + text)

    def fresh(self, letter: str) -> str:
        self.names += 1
        return f"{letter}{self.names}"

    def bounds(self, most: int) -> tuple[int, int, int]:
        """A range of at most so many trips, often at the ends of an int."""
        r = self.random
        trips = r.choice((0, 1, 2, 3, r.randint(1, most), most))
        step = r.choice((1, 1, -1, 2, -3, 1000, r.randint(1, INT_MAX), -r.randint(1, INT_MAX), INT_MIN, INT_MAX))
        trips = min(trips, (2**32 - 1) // abs(step))
        low = INT_MIN if step > 0 else min(INT_MAX, INT_MIN - step * trips)
        start = r.choice((0, 5, INT_MIN, INT_MAX, r.randint(INT_MIN, INT_MAX), INT_MAX - trips * step, low))
        start = max(INT_MIN, min(INT_MAX, start))
        stop = max(INT_MIN, min(INT_MAX, start + trips * step + r.choice((0, 0, 1, -1))))
        if len(range(start, stop, step)) > most:
            stop = start + most * step
        return start, max(INT_MIN, min(INT_MAX, stop)), step

    def bounds_from_data(self, most: int) -> tuple[str, int]:
        """Bounds that differ between pixels, of at most so many trips, and how many those are."""
        r = self.random
        if r.random() < 0.2:
            near, trips = r.randint(-9, 9), min(most, r.choice((1, 3, 9)))
            return f"{r.choice(('p.x', 'q', 'pixel().y'))} + {near}, {r.choice(('p.x', 'q'))} + {near + trips}", trips
        step = r.choice((1, 1, 1, -1, 2, -3, 1000, 0))
        wide = min(most, r.choice((1, 4, 9, 70, most))) * max(1, abs(step))
        low = max(INT_MIN, min(INT_MAX - wide, self.offset()))
        ends = [f"clamp({self.index()}, {low}, {low + r.choice((0, wide // 2, wide))})" for _ in "ab"]
        by = f"clamp({self.index()}, -2, 2)" if step == 0 else str(step)
        return f"{ends[0]}, {ends[1]}, {by}", -(-wide // max(1, abs(step)))

    def statement(self, depth: int, most: int) -> None:
        r, kind = self.random, self.random.randrange(12)
        if kind < 4:
            self.line(f"t {r.choice(('', '+', '*'))}= {self.value()}", depth)
        elif kind == 4 and depth < 9:
            if r.random() < 0.4:
                written, trips = self.bounds_from_data(max(1, most))
            else:
                bounds = self.bounds(max(1, most))
                written, trips = ", ".join(map(str, bounds)), len(range(*bounds))
            name = self.fresh("i")
            self.line(f"for {name} in range({written}):", depth)
            self.line(f"q = {name}", depth + 1)
            if r.random() < 0.3:
                self.line(f"if v.{r.choice('xyz')} {r.choice('<>')} 0.5:", depth + 1)
                self.line(r.choice(("break", "continue")), depth + 2)
            if r.random() < 0.5:
                self.line(f"t += c[{name}, {r.choice(('0', name, f'{name} // 3'))}]", depth + 1)
            if self.arrays and r.random() < 0.6:
                self.line(f"{r.choice(self.arrays)[0]}[{name} + {self.index()}] = t.x", depth + 1)
            self.block(depth + 1, most // max(1, trips))
        elif kind == 5 and depth < 40:
            self.line(f"if v.{r.choice('xyzw')} {r.choice(('<', '>', '=='))} {self.number()}:", depth)
            self.block(depth + 1, most)
            if r.random() < 0.5:
                self.line("else:", depth)
                self.block(depth + 1, most)
        elif kind == 6 and depth == 0:
            name, count = self.fresh("a"), r.choice((1, 2, 3, 16, 65, 257, 1000, 1024))
            self.line(f"{name} = [{r.choice(('v.x', 't.y', '1.0'))}] * {count}", depth)
            self.arrays.append((name, count))
        elif kind in (7, 8) and self.arrays:
            name, _ = r.choice(self.arrays)
            self.line(f"{name}[{self.index()}] {r.choice(('', '+'))}= {r.choice(('v.y', 't.x', '2.0'))}", depth)
        elif kind == 9 and depth == 0 and r.random() < 0.3:
            self.chain(r.choice((10, 100, 600)))
        elif kind == 10 and r.random() < 0.2:
            self.line("return t" if r.random() < 0.5 else f"if v.x > {self.number()}: return v", depth)
            self.line("t = t * 0.5", depth)
        elif r.random() < 0.5:
            self.line(f"p = ivec2({self.index()}, {self.index()})", depth)
        else:
            self.line(f"t += {self.value()}", depth)

    def chain(self, length: int) -> None:
        """Statements that each need the one before, alike for all channels or not."""
        part = self.random.choice(("t = t * 0.5 + v", "t.x = t.x * 0.5 + v.y", "t = t.yzwx + v"))
        for _ in range(length):
            self.line(part, 0)

    def block(self, depth: int, most: int) -> None:
        for _ in range(self.random.choice((1, 1, 1, 2, 3))):
            self.statement(depth, most)

    def deep(self) -> None:
        """Branches in branches, or one after another."""
        depth, inside = self.random.choice((5, 30, 90, 150)), self.random.random() < 0.5
        for level in range(depth):
            self.line(f"if v.x > {level * 0.01:.2f}:", level if inside else 0)
            if not inside:
                self.line("t += v", 1)
        if inside:
            self.line(self.random.choice(("t += c[1, 2]", "return t")), depth)

    def __str__(self) -> str:
        r = self.random
        tables = [", ".join(f"{r.uniform(-9, 9):.3f}" for _ in range(r.choice((1, 2, 7, 300, 1024)))) for _ in "TU"]
        self.line("v = c[0, 0]", 0)
        self.line("t = d[0, 0]", 0)
        self.line("p = pixel()", 0)
        self.line("q = 0", 0)
        if r.random() < 0.15:
            self.deep()
        most = r.choice((1, 8, 70, 400))
        for _ in range(r.choice((1, 2, 4, 8, 16))):
            self.statement(0, most)
        self.line("return t + vec4(float(q & 7))", 0)
        called = "def f(x: float, i: int) -> float:\n    if i > 3: return x\n    a = [x, 1.0, 2.0]\n    return a[i]\n"
        head = "def k(c: Image, d: Image, w: Array[float, 5]) -> vec4:"
        return "\n".join((f"T = ({tables[0]},)", f"U = ({tables[1]},)", called, head, *self.lines, ""))


@dataclass
class Tally:
    """What came of the kernels of some seeds."""

    kernels: int = 0
    cases: int = 0
    refused: Counter[str] = field(default_factory=Counter)
    failures: list[str] = field(default_factory=list)

    def __str__(self) -> str:
        reasons = "".join(f"\n  refused {count}: {why}" for why, count in self.refused.most_common())
        failures = "".join(f"\n{failure}" for failure in self.failures)
        return f"{self.kernels} kernels, {self.cases} cases, {len(self.failures)} failures{reasons}{failures}"


def run_one(seed: int, backend: str, runs: int, sizes: int = 7) -> tuple[int, str]:
    """Make one kernel, compile it by ``runs`` choices of formats and borders, run each on ``sizes`` pictures.

    How many cases ran, and the reason of a refusal.
    """
    import passgraph as pg

    chosen = random.Random(seed + 1)
    try:
        kernel = pg.kernel(source=str(Text(seed)), name="k")
    except pg.KernelError as error:
        return 0, reason(error)
    cases = 0
    for run in range(runs):
        into = pg.target("out", chosen.choice(FORMATS[2:5]))
        inputs = [pg.Input(name, chosen.choice(FORMATS)) for name in "cd"]
        frames = [one.border(chosen.choice(BORDERS)) for one in inputs]
        made = kernel(*frames, w=(0.0, 1.0, float("inf"), -1.0, 3e38), into=into)
        try:
            with pg.compile(made, backend, non_finite="keep") as program:
                for width, height in chosen.sample(SIZES, sizes):
                    channels = [(one.name, one.spec.format.channels) for one in inputs]
                    given = {name: picture(count, (width, height), seed + run) for name, count in channels}
                    assert program(**given)["out"].shape[:2] == (height, width)
                    cases += 1
        except pg.KernelError as error:
            return cases, reason(error)
    return cases, ""


def picture(channels: int, size: tuple[int, int], seed: int) -> np.ndarray[tuple[int, ...], np.dtype[np.float32]]:
    """Numbers from 0 to 1, and some of every hostile kind."""
    numbers = np.random.default_rng(seed)
    made = numbers.random((size[1], size[0], channels), np.float32)
    kinds = np.float32([np.nan, np.inf, -np.inf, 3e38, -3e38, 1e-40, 0, -1, 2**31, -(2**31)])
    return np.where(numbers.random(made.shape) < 0.1, numbers.choice(kinds, made.shape), made)


def reason(error: Exception) -> str:
    """The first line of an error, numbers left out: what kind of refusal it is."""
    first = str(error).splitlines()[0].split(": ", 1)[-1]
    return "".join("#" if letter.isdigit() else letter for letter in first)[:70]


def compute_at_most(seconds: float) -> None:
    """End this process (SIGXCPU) once it has computed so much longer."""
    spent = resource.getrusage(resource.RUSAGE_SELF)
    limit = int(spent.ru_utime + spent.ru_stime + seconds) + 1
    resource.setrlimit(resource.RLIMIT_CPU, (limit, resource.RLIM_INFINITY))


def child(seeds: range, backend: str, runs: int) -> None:
    """Run kernels one by one and print a line of JSON before and after each."""
    from tests.hostile.guard import check_rooms, guarded

    if backend == "numpy":
        resource.setrlimit(resource.RLIMIT_AS, (BYTES, BYTES))
    with guarded() if backend == "numpy" else nullcontext():
        for seed in seeds:
            compute_at_most(SECONDS)
            print(json.dumps({"begin": seed}), flush=True)
            cases, why = run_one(seed, backend, runs)
            check_rooms()
            print(json.dumps({"end": seed, "cases": cases, "refused": why}), flush=True)


def run(
    seeds: range, backend: str, runs: int = 2, seconds: float = SILENT_SECONDS, wrapper: tuple[str, ...] = ()
) -> Tally:
    """Every kernel of these seeds, in children; ``wrapper`` is put before Python (oclgrind)."""
    tally, left = Tally(), list(seeds)
    while left:
        batch = range(left[0], min(left[-1] + 1, left[0] + KERNELS_A_CHILD))
        told, status, words = _child_told(batch, backend, runs, seconds, wrapper)
        ended = [line for line in told if "end" in line]
        for line in ended:
            tally.kernels += 1
            tally.cases += line["cases"]
            if line["refused"]:
                tally.refused[line["refused"]] += 1
        done = len(ended)
        if status:
            tally.failures.append(f"--seed {batch[min(done, len(batch) - 1)]} --backend {backend}: {status}\n{words}")
            print(tally.failures[-1], file=sys.stderr, flush=True)
            done += 1
        print(f"{tally.kernels} kernels, {tally.cases} cases", file=sys.stderr, flush=True)
        left = left[min(done, len(batch)) or 1 :]
    return tally


def _child_told(
    seeds: range, backend: str, runs: int, seconds: float, wrapper: tuple[str, ...]
) -> tuple[list[dict[str, object]], str, str]:
    """What a child said, how it failed (empty: it did not), and the end of its words about that."""
    arguments = [
        "--child",
        "--seed",
        str(seeds.start),
        "--cases",
        str(len(seeds)),
        "--backend",
        backend,
        "--runs",
        str(runs),
    ]
    command = [*wrapper, sys.executable, "-m", "tests.hostile.kernels", *arguments]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    process = subprocess.Popen(
        command, cwd=ROOT, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    told: list[dict[str, object]] = []
    try:
        for line in _lines(process, seconds):
            told.append(json.loads(line))
        status = process.wait(seconds)
    except TimeoutError:
        return told, f"still running after {seconds} s", ""
    finally:
        process.kill()
        _, words = process.communicate()
    words = words[-1500:]
    return told, f"exit status {status}" if status else "", words


def _lines(process: subprocess.Popen[str], seconds: float) -> Iterator[str]:
    """Lines of JSON as they come; TimeoutError where none comes in time."""
    import select

    assert process.stdout is not None
    while True:
        ready, _, _ = select.select([process.stdout], [], [], seconds)
        if not ready:
            raise TimeoutError
        line = process.stdout.readline()
        if not line:
            return
        if line.startswith("{"):
            yield line


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=100, help="kernels; each runs --runs times")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--backend", default="numpy")
    parser.add_argument("--runs", type=int, default=2)
    parser.add_argument("--show", action="store_true", help="print the text of --seed")
    parser.add_argument("--child", action="store_true", help=argparse.SUPPRESS)
    given = parser.parse_args()
    seeds = range(given.seed, given.seed + given.cases)
    if given.show:
        print(Text(given.seed))
        return 0
    if given.child:
        child(seeds, given.backend, given.runs)
        return 0
    tally = run(seeds, given.backend, given.runs)
    print(tally)
    return bool(tally.failures)


if __name__ == "__main__":
    sys.exit(main())
