"""Chance over threads: programs compiled, called, changed, read, closed, dropped and forked in any order.

    python -m tests.hostile.threads numpy 3000 1        # backend, operations, seed

Every picture that comes back is held against what the call asked for; errors are only those that the rules allow
(docs/backends.md, "Threads, processes, contexts").  The numpy backend's arrays lie between guard pages.  A failing
run prints its seed; threads make it happen again often, not always.
"""

from __future__ import annotations

import os
import random
import sys
import threading
from collections import Counter
from contextlib import nullcontext, suppress
from typing import Any

import numpy as np

import passgraph as pg
from passgraph.backends.base import Backend
from passgraph.backends.registry import open_backend
from passgraph.errors import BackendError, GraphError
from tests.hostile.guard import guarded
from tests.test_threads import SURVIVING, at_once, expected, forked, picture, shared_graph

THREADS = 4
#: Programs that are there for every thread at any moment.
PROGRAMS = 6
#: How often each operation comes.
WEIGHTS = {
    "call": 60, "run": 8, "read": 8, "set": 6, "observe": 4, "abuse": 3, "close": 6, "drop": 6, "compile": 8,
    "collect": 2, "fork": 1,
}  # fmt: skip


class Chance:
    """One run: some programs that share a backend, and some with their own."""

    def __init__(self, name: str, operations: int, seed: int) -> None:
        self.name, self.operations, self.seed = name, operations, seed
        self.shared: Backend = open_backend(name)
        self.programs = [self.compiled(number % 2 == 0) for number in range(PROGRAMS)]
        self.done: Counter[str] = Counter()

    def compiled(self, shared: bool) -> pg.Program:
        return pg.compile(shared_graph(), backend=self.shared if shared else self.name)

    def work(self, thread: int) -> None:
        rng = random.Random(f"{self.seed} {thread}")
        names, weights = list(WEIGHTS), list(WEIGHTS.values())
        for _ in range(self.operations // THREADS):
            what = rng.choices(names, weights)[0]
            place = rng.randrange(PROGRAMS)
            with suppress(Closed):
                getattr(self, what)(self.programs[place], place, rng)
            self.done[what] += 1

    def call(self, program: pg.Program, _: int, rng: random.Random) -> None:
        frame, by = picture(rng.randrange(50)), float(rng.randrange(1, 50))
        np.testing.assert_array_equal(unless_closed(program, frame=frame, by=by)["out"], expected(frame, by))

    def run(self, program: pg.Program, _: int, rng: random.Random) -> None:
        unless_closed(program.run, frame=picture(rng.randrange(50)), by=float(rng.randrange(1, 50)))

    def read(self, program: pg.Program, *_: object) -> None:
        """The picture of some thread's last run: whole numbers, all of them."""
        try:
            got = unless_closed(program.read)["out"]
        except GraphError as error:
            told(error, "nothing has run yet")
            return
        np.testing.assert_array_equal(got, np.rint(got))

    def set(self, program: pg.Program, *_: object) -> None:
        try:
            unless_closed(program.set, "moved", "nothing", 1.0)
        except GraphError as error:
            told(error, "has no parameter 'nothing' to set")

    def observe(self, program: pg.Program, _: int, rng: random.Random) -> None:
        frame, by, seen = picture(rng.randrange(50)), float(rng.randrange(1, 50)), dict[str, Any]()
        unless_closed(program.run, lambda _, written: seen.update(written), frame=frame, by=by)
        np.testing.assert_array_equal(seen["out"], expected(frame, by))

    def abuse(self, program: pg.Program, _: int, rng: random.Random) -> None:
        """Closed from inside its own run, which is refused and ends that run."""
        try:
            unless_closed(program.run, lambda *_: program.close(), frame=picture(1), by=2.0)
        except GraphError as error:
            told(error, "cannot be closed from inside its own run")

    def close(self, program: pg.Program, place: int, rng: random.Random) -> None:
        program.close()
        self.programs[place] = self.compiled(rng.random() < 0.5)

    def drop(self, _: pg.Program, place: int, rng: random.Random) -> None:
        self.programs[place] = self.compiled(rng.random() < 0.5)

    def compile(self, _: pg.Program, place: int, rng: random.Random) -> None:
        with self.compiled(rng.random() < 0.5) as own:
            self.call(own, place, rng)

    def collect(self, *_: object) -> None:
        import gc

        gc.collect()

    def fork(self, program: pg.Program, *_: object) -> None:
        with forked() as inside:
            if inside:
                try:
                    np.testing.assert_array_equal(program(frame=picture(2), by=3.0)["out"], expected(picture(2), 3.0))
                    assert self.name in SURVIVING
                except BackendError as error:
                    told(error, "forked")
                except GraphError as error:
                    told(error, "this program is closed")
                program.close()


class Closed(Exception):
    """Another thread had closed the program, and it said so."""


def told(error: Exception, text: str) -> None:
    """The error is the one that the rules have here."""
    if text not in str(error):
        raise error


def unless_closed(do: Any, *given: Any, **named: Any) -> Any:
    try:
        return do(*given, **named)
    except GraphError as error:
        if "this program is closed" in str(error):
            raise Closed from None
        raise


def hostile_threads(name: str, operations: int, seed: int) -> None:
    """So many operations over some threads; raises, or ends the process, where one goes wrong."""
    with guarded() if name == "numpy" else nullcontext():
        chance = Chance(name, operations, seed)
        try:
            at_once(chance.work, THREADS)
        except BaseException:
            print(f"failed: {name}, {operations} operations, seed {seed}", file=sys.stderr)
            raise
        for program in chance.programs:
            program.close()
        chance.shared.close()
    left = [thread for thread in threading.enumerate() if thread.name.startswith("passgraph_")]
    assert len(left) <= THREADS * (os.cpu_count() or 1), f"{len(left)} threads are left"
    print(name, seed, dict(chance.done))


if __name__ == "__main__":
    hostile_threads(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))
