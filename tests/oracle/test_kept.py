"""Bounds that an earlier run left are those that would be found, and whatever decides bounds decides which are read."""

from __future__ import annotations

import io
import shutil
import sys
import zlib
from dataclasses import replace
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph import disk_cache
from passgraph.backends.base import SNAP_PX, Promises
from passgraph.backends.registry import open_backend
from passgraph.verify.compare import compare
from passgraph.verify.conformance import Case, cases
from passgraph.verify.conformance.judging import Judge
from passgraph.verify.oracle import kept
from passgraph.verify.oracle.backend import _DrawPass, _PixelPass
from passgraph.verify.oracle.kept import Kept
from passgraph.verify.oracle.pass_bounds import Passes
from passgraph.verify.oracle.time_limit import TimeLimit

SIZE = (5, 3)
GROUPS = ["operations", "language", "pictures", "draw states", "draws", "sequences", "plans"]
MESH = pg.Mesh.make([[-1, -1, 0], [1, -1, 0.5], [0, 1, 0]], [[0, 1, 2]])
STAGES = """
@struct
class Corner:
    position: vec4

def place(vertex: Vertex, by: float) -> Corner:
    return Corner(vec4(vertex.position * by, 1.0))

def paint(corner: Corner, red: float) -> vec4:
    return vec4(red, 0.5, 0.25, 1.0)
"""
DIM = "def dim(color: Image, by: float = 0.5) -> vec4: return color[1, 0] * by"
place, paint = pg.vertex(source=STAGES, name="place"), pg.fragment(source=STAGES, name="paint")
dim = pg.kernel(source=DIM)


@pytest.fixture(autouse=True)
def base(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A cache that nothing is in."""
    monkeypatch.setenv("PASSGRAPH_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture
def looked(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of the steps whose bounds are looked for."""
    found: list[str] = []
    for cls in (_PixelPass, _DrawPass):
        before = cls._find

        def find(self: Any, *given: Any, before: Any = before) -> Any:
            found.append(self.step.name)
            return before(self, *given)

        monkeypatch.setattr(cls, "_find", find)
    return found


def of_every_kind() -> list[Case]:
    """Some of each group; one with a stencil that adds up from draw to draw, two with several frames."""
    every = list(cases(GROUPS, quick=True))
    names = ("draw states/stencil less", "sequences/history read beside the pixel", "sequences/drawn over history")
    return [*every[::50], *(case for case in every if case.id in names)]


def bits(passes: Passes, corner_px: float) -> list[Any]:
    """All that was found, as bytes."""
    expected, allowed = passes.allowed(Promises(corner_px))
    told: list[Any] = []
    for key in expected:
        one = allowed[key]
        arrays = (expected[key], one.values.lo, one.values.hi, one.values.nan, one.ambiguous, one.unpromised)
        told += [(key, array.dtype.str, array.shape, array.tobytes()) for array in arrays]
        told.append((one.names, one.untried))
    return told


def test_a_second_run_looks_for_nothing_and_says_the_same(looked: list[str]) -> None:
    """Bounds, verdicts and figures, snapped and not, to the bit; against those found without keeping anything."""
    with open_backend("reference") as backend:
        for case in of_every_kind():
            afresh = [
                bits(Passes(dict(case.graph()), case.size, case.frames), corner_px) for corner_px in (0.0, SNAP_PX)
            ]
            first = Judge(case)
            verdict = first.verdict(backend)
            assert [bits(first.passes, corner_px) for corner_px in (0.0, SNAP_PX)] == afresh, case.id
            looked.clear()
            again = Judge(case)
            assert replace(again.verdict(backend), seconds=0.0) == replace(verdict, seconds=0.0)
            assert [bits(again.passes, corner_px) for corner_px in (0.0, SNAP_PX)] == afresh, case.id
            assert looked == [], case.id


def planned(held: Kept, frames: int = 1, **changes: Any) -> Passes:
    """A pass, a draw, and a draw over that one which changes the stencil that the first has left."""
    given = {"by": 0.5, "red": 0.25, "border": "clamp", "format": "rgba16f", "clear": (0, 0, 0, 0), "kernel": dim,
             "mesh": MESH, "compare": "less", "reference": 1, "frame": np.ones((3, 5, 4), np.float32),
             **changes}  # fmt: skip
    frame = pg.Input("frame", "rgba32f", SIZE, border=given["border"])
    dimmed = given["kernel"](frame, by=given["by"], into=pg.target("dimmed", format=given["format"]))
    stages = {"vertex": place, "fragment": paint}
    drawn = pg.draw(
        given["mesh"], by=1.0, red=0.75, **stages, depth_compare=given["compare"],
        into=pg.target("drawn", "rgba8", like=frame, clear=given["clear"]),
        depth=pg.target("depth", "depth32f_stencil8", like=frame),
        stencil=pg.Stencil(reference=given["reference"], passed="replace"),
    )  # fmt: skip
    over = pg.draw(
        MESH, by=0.5, red=given["red"], **stages, into=drawn, depth=drawn.depth, name="over", depth_compare="always",
        stencil=pg.Stencil("equal", reference=1, passed="increment"),
    )  # fmt: skip
    return Passes({"dimmed": dimmed, "drawn": over}, None, [{"frame": given["frame"]}] * frames, kept=held)


def named(corner_px: float = 0.0, **changes: Any) -> dict[str, str]:
    """Under which name the bounds of each step are kept."""
    passes = planned(Kept(), **changes)
    passes.allowed(Promises(corner_px))
    return dict(zip((step.name for step in passes.plan.steps), passes.kept._held, strict=True))


def test_runs_that_are_alike_are_looked_at_once(looked: list[str]) -> None:
    """Though the second draw goes on from what the first has left."""
    _, allowed = planned(Kept(), 2).allowed()
    assert looked == ["dimmed", "drawn", "over"]
    for (frame, step, resource), one in allowed.items():
        first = allowed[0, step, resource].values
        assert np.array_equal(one.values.lo, first.lo) and np.array_equal(one.values.hi, first.hi), (frame, step)


def one_bit_apart() -> np.ndarray[Any, Any]:
    frame = np.ones((3, 5, 4), np.float32)
    frame[2, 4, 3] = np.nextafter(np.float32(1), np.float32(2))
    return frame


@pytest.mark.parametrize(
    ("change", "apart"),
    [
        ({"by": 0.25}, {"dimmed"}),
        ({"border": "repeat"}, {"dimmed"}),
        ({"format": "rgba8"}, {"dimmed"}),
        ({"frame": one_bit_apart()}, {"dimmed"}),
        ({"kernel": pg.kernel(source=DIM.replace("1, 0", "0, 1"))}, {"dimmed"}),
        ({"red": 0.3}, {"over"}),
        # What a draw leaves is what the next one draws over.
        ({"clear": (0, 0, 0, 1)}, {"drawn", "over"}),
        ({"reference": 2}, {"drawn", "over"}),
        ({"compare": "greater"}, {"drawn", "over"}),
        ({"mesh": pg.Mesh.make([[-1, -1, 0], [1, -1, 0.5], [0, 0.5, 0]], [[0, 1, 2]])}, {"drawn", "over"}),
        # What is on the grid may be what is beside it: of these pictures the bounds say so.
        ({"corner_px": SNAP_PX}, {"drawn", "over"}),
        # Neither where a kernel stands nor a default that is not taken decides what it does.
        ({"kernel": pg.kernel(source="\n\n" + DIM.replace("0.5", "0.25"))}, set()),
    ],
)  # fmt: skip
def test_what_decides_bounds_decides_what_is_read(change: dict[str, Any], apart: set[str]) -> None:
    before, after = named(), named(**change)
    assert {name for name in before if before[name] != after[name]} == apart


def looked_for() -> None:
    Passes({"out": dim(pg.Input("frame"))}, None, [{"frame": one_bit_apart()}], kept=Kept(on_disk=True)).allowed()


def test_other_text_or_another_numpy_reads_nothing(
    base: Path, tmp_path: Path, looked: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of the oracle, of the reference and of the language: one letter of one file."""
    looked_for()
    looked_for()
    assert looked == ["dim"]
    for number, place_ in enumerate(kept.texts()):
        copy = tmp_path / str(number) / place_.name
        if place_.is_dir():
            shutil.copytree(place_, copy, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            copy.parent.mkdir()
            shutil.copy(place_, copy)
        file = copy if copy.is_file() else sorted(copy.rglob("*.py"))[-1]
        for changed in (False, True):
            if changed:
                file.write_text(file.read_text(encoding="utf-8") + "#", encoding="utf-8")
            texts = [copy if other == place_ else other for other in kept.texts()]
            disk_cache.text_digest.cache_clear()
            looked.clear()
            with monkeypatch.context() as patch:
                patch.setattr(kept, "texts", lambda texts=tuple(texts): texts)
                patch.setattr(kept, "texts_digest", kept.texts_digest.__wrapped__)
                looked_for()
            assert looked == (["dim"] if changed else []), place_
    looked.clear()
    monkeypatch.setattr(np, "__version__", "0")
    monkeypatch.setattr(kept, "texts_digest", kept.texts_digest.__wrapped__)
    looked_for()
    assert looked == ["dim"]


def test_all_code_that_finds_bounds_is_in_their_name() -> None:
    """What runs while bounds are looked for lies in the texts that the name hangs on."""
    ran: dict[str, str] = {}

    def note(frame: FrameType, event: str, _: object) -> None:
        if event == "call":
            ran.setdefault(frame.f_code.co_filename, frame.f_code.co_qualname)

    def watched(self: Any, *given: Any) -> Any:
        before = sys.getprofile()
        sys.setprofile(note)
        try:
            return finds[type(self)](self, *given)
        finally:
            sys.setprofile(before)

    finds = {cls: cls._find for cls in (_PixelPass, _DrawPass)}
    with pytest.MonkeyPatch.context() as patch:
        for cls in finds:
            patch.setattr(cls, "_find", watched)
        for case in of_every_kind():
            Passes(dict(case.graph()), case.size, case.frames).allowed(Promises(SNAP_PX))
    texts = [path.resolve() for path in kept.texts()]
    root = Path(disk_cache.__file__).parents[1].resolve()
    parts = [root / part for part in ("passgraph", "backends", "effects")]
    files = {Path(file).resolve(): name for file, name in ran.items()}
    ours = {file: name for file, name in files.items() if any(map(file.is_relative_to, parts)) and file.is_file()}
    assert len(ours) > 20
    texts.append(Path(__file__).resolve())
    assert {f: n for f, n in ours.items() if not any(f.is_relative_to(text) for text in texts)} == {}


def files(base: Path) -> list[Path]:
    return list((base / "bounds").iterdir())


@pytest.mark.parametrize("damage", ["cut", "flipped", "empty", "no array", "pickled"])
def test_a_damaged_file_is_as_if_missing(damage: str, base: Path, looked: list[str]) -> None:
    looked_for()
    (file,) = files(base)
    whole = file.read_bytes()
    packed = {"no array": b"junk", "pickled": pickled()}
    if damage in packed:
        disk_cache.remember("bounds", file.name, packed[damage])
    else:
        flipped = bytes([*whole[:99], whole[99] ^ 1, *whole[100:]])
        file.write_bytes({"cut": whole[:-1], "flipped": flipped, "empty": b""}[damage])
    looked_for()
    assert looked == ["dim", "dim"]
    assert file.read_bytes() == whole
    looked_for()
    assert looked == ["dim", "dim"]


class Runs:
    """Whoever unpickles it fails the test."""

    def __reduce__(self) -> tuple[Any, ...]:
        return pytest.fail, ("unpickled",)


def pickled() -> bytes:
    made = io.BytesIO()
    np.savez(made, **{"0 names": np.array([Runs()], object)})
    return zlib.compress(made.getvalue())


def test_bounds_of_which_time_left_nothing_are_not_kept(base: Path) -> None:
    outputs, frame = {"out": dim(pg.Input("frame"))}, {"frame": one_bit_apart()}
    run = Passes(outputs, None, [frame], TimeLimit(0.0), Kept(on_disk=True))
    assert next(iter(run.allowed()[1].values())).untried
    assert not (base / "bounds").exists()


def test_what_is_too_large_is_not_kept(base: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kept, "MOST_BYTES", 100)
    looked_for()
    assert not (base / "bounds").exists()


def test_a_comparison_leaves_nothing_on_disk(base: Path) -> None:
    """Of whoever changes a kernel again and again, and of kernels made up at random."""
    compare(dim(pg.Input("frame")), ["reference"], frame=one_bit_apart())
    assert not (base / "bounds").exists()


def test_a_tree_with_a_mistake_is_judged_by_bounds_of_another(looked: list[str]) -> None:
    """Bounds named after a case are read whatever the kernel has become."""
    right = Case("own", "one", lambda: {"out": dim(pg.Input("frame"))}, SIZE, ({"frame": one_bit_apart()},))
    brighter = pg.kernel(source=DIM.replace("by: float = 0.5", "by: float = 0.75"))
    wrong = replace(right, graph=lambda: {"out": brighter(pg.Input("frame"))})
    with open_backend("reference") as backend:
        outcomes = [
            Judge(case, Kept(on_disk=True, case=name)).verdict(backend).outcome
            for case, name in ((right, "own/one"), (wrong, "own/one"), (wrong, "own/two"))
        ]
    assert outcomes == ["passed", "diverged", "passed"]
    assert looked == ["dim", "dim"]
