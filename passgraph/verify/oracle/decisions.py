"""Uncertain decisions, explored both ways.

Where a comparison or a floor straddles, a conforming backend may go either way; each way is bounded separately.  So the
program runs once with the first choice everywhere, and again for each decision that a lane met, with that decision
flipped, as long as new decisions appear.  The bounds of a lane are the hull of its paths.  A continuous function with a
jump inside (bilinear filtering at a texel's center) keeps its tight bounds, which a hull at the jump would lose.

Lanes with more paths than :data:`MAX_PATHS` are bounded to first order: the first path, moved by the sum of what each
of its decisions can change, alone or with the next one (x and y of one texel).  That is valid for sums over decisions,
such as filters, but not for a search that keeps the best of many ties.  So the assumption is tested: many decisions are
flipped at once.  If the result moves by more than the sum of the moves of the flipped decisions, plus rounding, the
lane is unbounded.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from passgraph.verify.oracle.interval import Interval
from passgraph.verify.oracle.time_limit import BATCH, TimeLimit, batches

Ints = NDArray[np.int64]
Lanes = NDArray[np.bool_]
Choices = NDArray[np.int8]

#: Most paths of a lane; with more it is bounded to first order.
MAX_PATHS = 64
#: Most decisions of a path that are flipped one by one; a lane that meets more is unbounded.
MAX_DECISIONS = 256
#: Random sets of decisions flipped at once, to test lanes that are bounded to first order.
RANDOM_SETS = 8
#: Numbers of first and of last decisions that are flipped at once too: a search that keeps the best of many ties
#: changes only if all the last decisions change together.
ENDS = (3, 4, 5, 6, 7, 8, 10, 12, 14, 16, 20, 24, 32, 48, 64, 96, 128, 192)
#: Rounding to float32 may hide the effect of one flipped decision, but not of many: half a unit in the last place of
#: the result.
HIDDEN = 2.0**-24


@dataclass
class Track:
    """The choices of the lanes of one run: forced ones, then the first way wherever a decision straddles."""

    forced: Choices  # (lanes, depth): 0 the first way, 1 the other; -1 after the end
    lanes: Ints  # indices of the lanes in the stage; a lane may occur several times, on several paths
    active: Lanes = field(init=False)
    met: Ints = field(init=False)
    taken: list[tuple[Ints, Ints, Choices]] = field(default_factory=list)
    names: Counter[str] = field(default_factory=Counter)
    wide: Lanes = field(init=False)  # lanes that met a jump of a float with more than two ways
    vague: Lanes = field(init=False)  # lanes that met a jump of an int: any texel may be read
    lost: Lanes = field(init=False)  # lanes that are unbounded

    def __post_init__(self) -> None:
        count = len(self.forced)
        self.active = np.ones(count, np.bool_)
        self.met = np.zeros(count, np.int64)
        self.wide, self.vague, self.lost = (np.zeros(count, np.bool_) for _ in range(3))

    def mark(self, marks: Lanes, lanes: Lanes) -> Lanes:
        """Set ``marks`` where an active lane has any component in ``lanes``; return ``lanes``."""
        if lanes.any():
            marks |= lanes.reshape(len(lanes), -1).any(axis=1) & self.active
        return lanes

    def choose(self, straddles: Lanes, name: str) -> Lanes:
        """Return, for each lane that straddles, if it takes the other side; one decision a component.

        ``straddles`` is (lanes or 1, …components).
        """
        if not straddles.any():
            return np.zeros(straddles.shape, np.bool_)
        count, shape = len(self.forced), straddles.shape[1:]
        straddles = np.broadcast_to(straddles, (count, *shape)).reshape(count, -1)
        other = np.zeros(straddles.shape, np.bool_)
        for component in range(straddles.shape[1]):
            lanes = np.flatnonzero(straddles[:, component] & self.active)
            if len(lanes) == 0:
                continue
            self.names[name] += len(lanes)
            at = self.met[lanes]
            self.met[lanes] += 1
            choice = np.zeros(len(lanes), np.int8)
            known = at < self.forced.shape[1]
            choice[known] = np.maximum(self.forced[lanes[known], at[known]], 0)
            self.taken.append((lanes, at, choice))
            other[lanes, component] = choice == 1
        return other.reshape(count, *shape)

    def part(self, rows: Ints) -> Track:
        """Return some of the lanes, with the decisions they have met so far."""
        part = Track(self.forced[rows], self.lanes[rows], names=self.names)
        part.met = self.met[rows]
        part.wide, part.vague, part.lost = (marks[rows] for marks in (self.wide, self.vague, self.lost))
        return part

    def rejoin(self, part: Track, rows: Ints) -> None:
        """Merge the decisions that a part has met."""
        self.taken += [(rows[lanes], at, choice) for lanes, at, choice in part.taken]
        self.met[rows], self.wide[rows], self.vague[rows], self.lost[rows] = part.met, part.wide, part.vague, part.lost

    def path(self) -> Choices:
        """Return every choice that was made, (lanes, most decisions)."""
        choices = np.full((len(self.forced), int(self.met.max(initial=0))), -1, np.int8)
        for lanes, at, choice in self.taken:
            choices[lanes, at] = choice
        return choices


@dataclass
class Bounds:
    """Allowed results of lanes.

    Attributes
    ----------
    outputs : an interval (lanes, components) for each result
    surely, perhaps : lanes whose result is kept on every path, and on some path
    ambiguous : lanes whose paths lead to different results, and unbounded lanes
    unpromised : unbounded lanes without an uncertain decision: the arguments of an operation are outside its domain
    names : operations that straddled, with the number of lanes that met them
    """

    outputs: list[Interval]
    surely: Lanes
    perhaps: Lanes
    ambiguous: Lanes
    unpromised: Lanes
    names: Counter[str]


#: Runs lanes along forced choices; returns the results and the lanes that are kept (None: all).
Run = Callable[[Track], tuple[list[Interval], Lanes | None]]


@dataclass(frozen=True)
class Frontier:
    """Paths to explore: a lane, its forced choices, and the flipped decision of its first path (-1: none)."""

    lanes: Ints
    prefixes: Choices
    origins: Ints

    def __len__(self) -> int:
        return len(self.lanes)

    def parts(self) -> Iterator[Frontier]:
        """Yield batches; the paths of one lane stay together, so that its result does not depend on other lanes."""
        ends = np.append(np.flatnonzero(np.diff(self.lanes)) + 1, len(self))
        first = 0
        while first < len(self):
            # the last end within a batch, or the next one if a lane has more paths
            following, beyond = np.searchsorted(ends, [first, first + BATCH], side="right")
            last = int(ends[max(following, beyond - 1)])
            yield Frontier(self.lanes[first:last], self.prefixes[first:last], self.origins[first:last])
            first = last

    @classmethod
    def joined(cls, parts: list[Frontier]) -> Frontier:
        if not parts:
            return cls(np.zeros(0, np.int64), np.zeros((0, 0), np.int8), np.zeros(0, np.int64))
        depth = max(p.prefixes.shape[1] for p in parts)
        padded = [np.pad(p.prefixes, ((0, 0), (0, depth - p.prefixes.shape[1])), constant_values=-1) for p in parts]
        return cls(
            np.concatenate([p.lanes for p in parts]), np.concatenate(padded), np.concatenate([p.origins for p in parts])
        )


def explore(
    run: Run, count: int, components: list[int], limit: TimeLimit | None = None, first_only: bool = False
) -> Bounds:
    """Explore all paths of ``count`` lanes within the limits; with ``first_only`` just the first path of each."""
    limit = limit or TimeLimit()
    search, lanes_done = _Search(run, count, components, limit), 0
    for lanes in batches(count):
        limit.report(lanes_done, count)
        frontier = Frontier(lanes, np.zeros((len(lanes), 0), np.int8), np.full(len(lanes), -1))
        level = 0
        while len(frontier) and not limit.is_over:
            following = [search.step(part, level) for part in frontier.parts()]
            frontier = Frontier.joined([] if first_only else following)
            level += 1
        search.give_up(frontier.lanes)
        search.end_batch()
        doubtful = lanes[search.first_order[lanes] & ~search.lost[lanes]]
        for i in range(0, 0 if first_only else len(doubtful), BATCH):
            search.try_jointly(doubtful[i : i + BATCH])
        lanes_done += len(lanes)
    return search.result()


def _joint_sets(count: int) -> Iterator[Lanes]:
    """Yield sets of ``count`` decisions to flip at once: all, random ones, the first and the last of them."""
    yield np.ones(count, np.bool_)
    for seed in range(1, RANDOM_SETS):
        yield np.random.default_rng(seed).integers(0, 2, count) == 1
    for length in ENDS:
        if length < count:
            yield np.arange(count) < length
            yield np.arange(count) >= count - length


class _Search:
    """The state of the exploration in each lane."""

    def __init__(self, run: Run, count: int, components: list[int], limit: TimeLimit) -> None:
        self.run, self.limit = run, limit
        shapes = [(count, c) for c in components]
        self.lo, self.hi = ([np.full(s, np.nan) for s in shapes] for _ in range(2))
        self.nan = [np.zeros(s, np.bool_) for s in shapes]
        self.widths = [np.zeros(s) for s in shapes]
        #: The first path, and the sum of how far flipping each of its decisions moves either end.
        self.root_lo, self.root_hi = ([np.zeros(s) for s in shapes] for _ in range(2))
        self.total_down, self.total_up = ([np.zeros(s) for s in shapes] for _ in range(2))
        #: The decisions of the first paths of this batch: their lanes, and how far each moves the result.
        self.owners: Ints = np.zeros(0, np.int64)
        self.down: list[NDArray[np.float64]] = []
        self.up: list[NDArray[np.float64]] = []
        self.surely, self.perhaps = np.ones(count, np.bool_), np.zeros(count, np.bool_)
        self.paths = np.zeros(count, np.int64)
        self.first_order = np.zeros(count, np.bool_)
        self.vague, self.lost = np.zeros(count, np.bool_), np.zeros(count, np.bool_)
        #: Rounding error when many decisions are flipped at once.
        self.hidden = [np.zeros(s) for s in shapes]
        #: Results that are not sums over decisions.
        self.unbounded = [np.zeros(count, np.bool_) for _ in components]
        self.untried = np.zeros(count, np.bool_)
        self.discards = False
        self.names: Counter[str] = Counter()

    def give_up(self, lanes: Ints) -> None:
        """Leave lanes unbounded because the time limit is reached."""
        self.untried[lanes] = self.lost[lanes] = True
        self.surely[lanes] = False

    def step(self, frontier: Frontier, level: int) -> Frontier:
        """Run some paths, record their results, and return the paths that follow from them."""
        lanes, track = frontier.lanes, Track(frontier.prefixes, frontier.lanes)
        results, keep = self.run(track)
        if level == 0:
            self.names.update(track.names)
        np.logical_or.at(self.vague, lanes, track.vague | track.wide)
        np.logical_or.at(self.lost, lanes, track.lost)
        self.discards |= keep is not None
        keep_lanes = np.ones(len(lanes), np.bool_) if keep is None else np.broadcast_to(keep, (len(lanes),))
        np.logical_and.at(self.surely, lanes, keep_lanes)
        np.logical_or.at(self.perhaps, lanes, keep_lanes)
        np.add.at(self.paths, lanes, 1)
        for i, result in enumerate(results):
            np.fmin.at(self.lo[i], lanes, result.lo)
            np.fmax.at(self.hi[i], lanes, result.hi)
            np.logical_or.at(self.nan[i], lanes, result.nan)
            np.add.at(self.widths[i], lanes, result.width)
            self._note_move(i, frontier, result, level)
        return self._following(frontier, track, level)

    def _note_move(self, i: int, frontier: Frontier, result: Interval, level: int) -> None:
        lanes = frontier.lanes
        if level == 0:
            self.root_lo[i][lanes], self.root_hi[i][lanes] = result.lo, result.hi
        elif level <= 2:
            # One decision flipped, or one and the next (x and y of one texel).
            down = np.fmin(result.lo - self.root_lo[i][lanes], 0.0)
            up = np.fmax(result.hi - self.root_hi[i][lanes], 0.0)
            np.fmin.at(self.down[i], frontier.origins, down)
            np.fmax.at(self.up[i], frontier.origins, up)

    def _following(self, frontier: Frontier, track: Track, level: int) -> Frontier:
        """Return the paths with each decision after the forced ones flipped."""
        lanes, prefixes = frontier.lanes, frontier.prefixes
        decided = (prefixes >= 0).sum(axis=1)
        new = track.met - decided
        self.lost[lanes[track.met > MAX_DECISIONS]] = True
        new[self.lost[lanes]] = 0
        paths = self.paths.copy()
        np.add.at(paths, lanes, new)
        self.first_order[lanes[(paths[lanes] > MAX_PATHS) & (new > 0)]] = True
        if level > 0:
            new = np.where(self.first_order[lanes], np.minimum(new, 1 if level == 1 else 0), new)
        path = track.path()
        row = np.repeat(np.arange(len(lanes)), new)
        turned = decided[row] + np.arange(len(row)) - np.repeat(np.cumsum(new) - new, new)
        following = np.where(np.arange(path.shape[1]) < turned[:, None], path[row], -1).astype(np.int8)
        following[np.arange(len(row)), turned] = 1 - path[row, turned]
        if level > 0:
            return Frontier(lanes[row], following, frontier.origins[row])
        self.owners = lanes[row]
        self.down, self.up = ([np.zeros((len(row), lo.shape[1])) for lo in self.lo] for _ in range(2))
        return Frontier(self.owners, following, np.arange(len(row)))

    def end_batch(self) -> None:
        for total, moves in ((self.total_down, self.down), (self.total_up, self.up)):
            for i, moved in enumerate(moves):
                np.add.at(total[i], self.owners, moved)

    def first_order_bounds(self, i: int, lanes: Ints | slice) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        lo = np.fmin(self.lo[i][lanes], self.root_lo[i][lanes] + self.total_down[i][lanes])
        hi = np.fmax(self.hi[i][lanes], self.root_hi[i][lanes] + self.total_up[i][lanes])
        return lo - self.hidden[i][lanes], hi + self.hidden[i][lanes]

    def try_jointly(self, lanes: Ints) -> None:
        """Flip many decisions at once, and give up lanes whose results are not sums over them."""
        is_asked = np.zeros(len(self.paths), np.bool_)
        is_asked[lanes] = True
        rows = np.flatnonzero(is_asked[self.owners])
        # Decisions of a lane are adjacent and in order.
        firsts = np.searchsorted(self.owners[rows], self.owners[rows])
        numbers = np.arange(len(rows)) - firsts
        for turned in _joint_sets(int(numbers.max(initial=-1)) + 1):
            if self.limit.is_over:
                self.give_up(lanes)
                return
            self._turn_jointly(lanes, turned, rows[turned[numbers]])

    def _moved(self, i: int, lanes: Ints, rows: Ints) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the first path of lanes, moved by these decisions."""
        low, high = (np.zeros_like(ends[i]) for ends in (self.root_lo, self.root_hi))
        np.add.at(low, self.owners[rows], self.down[i][rows])
        np.add.at(high, self.owners[rows], self.up[i][rows])
        return self.root_lo[i][lanes] + low[lanes], self.root_hi[i][lanes] + high[lanes]

    def _turn_jointly(self, lanes: Ints, turned: Lanes, rows: Ints) -> None:
        """Flip some decisions of each lane; ``rows`` are these decisions."""
        track = Track(np.repeat(turned[None].astype(np.int8), len(lanes), axis=0), lanes)
        results, keep = self.run(track)
        if keep is not None:
            self.surely[lanes] &= keep
            self.perhaps[lanes] |= keep
        self.vague[lanes] |= track.vague | track.wide
        self.lost[lanes] |= track.lost
        for i, result in enumerate(results):
            lo, hi = self.first_order_bounds(i, lanes)
            rounding = HIDDEN * np.maximum(track.met, 1)[:, None] * np.fmax(abs(lo), abs(hi))
            outside = ((result.lo < lo) | (result.hi > hi)) & (rounding < np.inf)
            self.hidden[i][lanes] = np.where(outside, np.fmax(self.hidden[i][lanes], rounding), self.hidden[i][lanes])
            low, high = self._moved(i, lanes, rows)
            beyond = (result.lo < low - rounding) | (result.hi > high + rounding) | (result.nan & ~self.nan[i][lanes])
            self.unbounded[i][lanes] |= beyond.any(axis=1)
            self.lo[i][lanes] = np.fmin(self.lo[i][lanes], result.lo)
            self.hi[i][lanes] = np.fmax(self.hi[i][lanes], result.hi)

    def result(self) -> Bounds:
        outputs = []
        turned, unpromised = self.lost | self.vague, np.zeros(len(self.lost), np.bool_)
        first_order = self.first_order[:, None]
        for i in range(len(self.lo)):
            low, high = self.first_order_bounds(i, slice(None))
            lo, hi = np.where(first_order, low, self.lo[i]), np.where(first_order, high, self.hi[i])
            interval = Interval(lo, hi, self.nan[i])
            # Sums of widths are rounded in float64 too.
            apart = interval.width > self.widths[i] * (1 + 1e-12)
            turned |= (apart & (self.paths > 1)[:, None]).any(axis=1)
            lost = (self.lost | self.unbounded[i])[:, None]
            outputs.append(Interval(np.where(lost, -np.inf, lo), np.where(lost, np.inf, hi), self.nan[i] | lost))
            # Unbounded results were not tested.
            unpromised |= ((outputs[i].lo == -np.inf) & (outputs[i].hi == np.inf)).any(axis=1)
        self.limit.untried += int(self.untried.sum())
        surely = self.surely & ~(self.lost & self.discards)
        return Bounds(outputs, surely, self.perhaps | self.lost, turned | unpromised, unpromised & ~turned, self.names)
