"""The rasteriser's fixed functions as they are shipped: as new as what they are written in, for any machine, and the
same, bit for bit, as numba makes them here."""

from __future__ import annotations

import ast
import ctypes
import re
import subprocess
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
import numpy as np
import pytest
from numpy.typing import NDArray

import passgraph as pg
from passgraph.backends.numpy.machine.machine_code import Code, function_code
from passgraph.backends.numpy.machine.numba_text import llvm_text
from passgraph.backends.numpy.machine.shipped import Call, NumbaCode, Shipped, entry_text
from passgraph.backends.numpy.raster import entries, generate, layout
from passgraph.backends.numpy.raster.layout import PLANES, TILE, VARYINGS
from tests.corners import placed

NAMES = [code.name for code in entries.FIXED]


def code(name: str) -> NumbaCode:
    return next(code for code in entries.FIXED if code.name == name)


def shipped(name: str) -> str:
    return (entries.SHIPPED.folder / f"{name}.ll").read_text(encoding="utf-8")


# What is shipped


@pytest.mark.parametrize("name", NAMES)
def test_a_shipped_text_is_as_new_as_its_function(name: str) -> None:
    assert entries.SHIPPED.is_current(name), f"run {entries.SHIPPED.command} and commit what it writes"


def test_no_text_is_left_of_a_function_that_is_gone() -> None:
    assert {path.stem for path in entries.SHIPPED.folder.iterdir()} == set(NAMES)


def test_sources_are_all_that_the_functions_take_from_elsewhere() -> None:
    """Of the package; what they take of numpy is in numba."""
    known = {path.stem: path for path in entries.SOURCES}
    # Types of LLVM, and what holds the texts.
    told = {"operations", "numba_code", "shipped"}
    for path in entries.SOURCES:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("passgraph.backends"):
                assert (node.module or "").rpartition(".")[2] in {*known, *told}, f"{path.name}: {node.module}"


@pytest.mark.parametrize("name", NAMES)
def test_a_shipped_text_is_for_any_machine(name: str) -> None:
    """It names no system and no address, calls nothing but LLVM's own functions, and its vectors are made later."""
    text = shipped(name)
    assert not re.findall(r"^target .*|inttoptr \(i64 \d+|<\d+ x [if]\d+>|^attributes ", text, re.MULTILINE)
    assert not re.findall(r"^declare (?!.*@llvm\.).*", text, re.MULTILINE)
    called = set(re.findall(r"(?:call|invoke) [^@\n]*@([\w.]+)\(", text))
    assert all(function.startswith("llvm.") for function in called), called


@pytest.mark.parametrize(
    "triple", ["x86_64-unknown-linux-gnu", "x86_64-pc-windows-msvc", "aarch64-unknown-linux-gnu", "arm64-apple-darwin"]
)
def test_shipped_texts_become_machine_code_of_other_systems(triple: str) -> None:
    """Which calls C's own functions and no other."""
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    machine = llvm.Target.from_triple(triple).create_target_machine(cpu="", opt=1, reloc="pic", codemodel="default")
    called: set[str] = set()
    for name in NAMES:
        entry = code(name)
        text = shipped(name) + entry_text("entry", name, entry.pieces, entry.kinds)
        module = llvm.parse_assembly(text)
        module.triple = triple
        called |= set(
            re.findall(r"\t(?:callq|bl)\t_?([A-Za-z]\w*)(?:@PLT)?$", machine.emit_assembly(module), re.MULTILINE)
        )
    assert "log2" in called, "calls are found in this system's assembly"
    assert called <= {*NAMES, "log2", "exp2", "ceil", "floor", "rint", "memset", "memcpy"}


@pytest.mark.parametrize("name", NAMES)
def test_a_shipped_text_keeps_arrays_apart(name: str) -> None:
    """LLVM may not assume that a store into one changes another."""
    (head,) = re.findall(r"^define .*", shipped(name), re.MULTILINE)
    arrays = [kind for kind in code(name).kinds if "[" in kind]
    assert len(re.findall(r"ptr noalias %arg\.\w+\.4\b", head)) == len(arrays)


FIRST = """
import sys
sys.modules["numba"] = sys.modules["scipy"] = None  # as if they were not installed
import passgraph as pg
text = sys.argv[1]
mesh = pg.Mesh.make([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]])
stages = {"vertex": pg.vertex(source=text, name="place"), "fragment": pg.fragment(source=text, name="white")}
at_once = pg.draw(mesh, into=pg.target("at_once"), name="at_once", **stages)
in_order = pg.draw(mesh, into=pg.target("in_order"), name="in_order", blend="add", **stages)
with pg.compile([at_once, in_order], "numpy", size=(20, 10)) as program:
    found = program()
print(*(found[name].any() for name in found))
"""
KERNELS = placed("""
def white(corner: Corner) -> vec4:
    return vec4(1.0)
""")


def test_a_first_process_draws_without_numba(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PASSGRAPH_CACHE", str(tmp_path))
    made = subprocess.run(
        [sys.executable, "-c", FIRST, KERNELS], capture_output=True, text=True, check=False, timeout=300
    )
    assert (made.stdout, made.stderr) == ("True True\n", "")


# Texts that are older than their sources


@pytest.fixture
def kept(tmp_path: Path) -> Shipped:
    source = tmp_path / "written.py"
    source.write_text("one\n", encoding="utf-8")
    found = Shipped(tmp_path / "texts", (source,), "python -m maker")
    found.write("add", "the text")
    return found


def test_a_text_is_used_until_its_sources_change(kept: Shipped) -> None:
    def never() -> str:
        raise AssertionError("made anew")

    assert kept.text("add", never).endswith("the text")
    kept.sources[0].write_bytes(b"one\r\n")  # as some systems check it out
    assert kept.text("add", never).endswith("the text")
    kept.sources[0].write_text("two\n", encoding="utf-8")
    assert kept.text("add", lambda: "anew") == "anew"
    kept.write("add", "the next text")
    assert kept.text("add", never).endswith("the next text")


def test_an_old_text_without_numba_says_what_makes_it_anew(kept: Shipped, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("passgraph.backends.numpy.machine.shipped.find_spec", lambda name: None)
    kept.text("add", lambda: "anew")
    message = r"mul\.ll is missing or older than .*written\.py.*pip install 'passgraph\[dev\]', then python -m maker"
    with pytest.raises(pg.BackendError, match=message):
        kept.text("mul", lambda: "anew")
    kept.sources[0].write_text("two\n", encoding="utf-8")
    with pytest.raises(pg.BackendError, match=r"add\.ll is missing or older than"):
        kept.text("add", lambda: "anew")


def test_making_texts_without_numba_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(generate, "find_spec", lambda name: None)
    with pytest.raises(SystemExit, match=r"pip install 'passgraph\[dev\]'"):
        generate.main()


# The same bits as what numba makes here

Array = NDArray[Any]
#: Of what the functions work on below: vertices in one chunk of so many triangles, a picture of three by two tiles.
VERTICES, TRIANGLES, WIDTH, HEIGHT, COMPONENTS = 300, 500, 150, 100, 3
TILES_X, TILES = -(-WIDTH // TILE), -(-WIDTH // TILE) * -(-HEIGHT // TILE)
ROWS = VARYINGS + COMPONENTS
NUMBERS = PLANES + 3 * ROWS


@cache
def numba_code(name: str) -> Code:
    """Of a function that is compiled from what numba writes down, as it is."""
    entry = code(name)
    text, inner = llvm_text(entry.find(), entry.pieces, entry.kinds)
    return function_code(
        ("as numba writes it", name), lambda outer: text + entry_text(outer, inner, entry.pieces, entry.kinds)
    )


def anew(name: str) -> Call:
    entry = code(name)
    return Call(numba_code(name), entry.pieces, entry.kinds)


class Stages:
    """What one frame's arrays become, function by function; ``make`` gives the function of a name."""

    def __init__(self, make: Callable[[str], Call], seed: int) -> None:
        self.make = make
        random = np.random.default_rng(seed)
        # Slots behind for what clipping makes.
        room = VERTICES + layout.NEW_VERTICES * TRIANGLES
        self.clip = np.zeros((room, 4))
        self.clip[:VERTICES] = random.normal(size=(VERTICES, 4)) * [1.0, 1.0, 0.6, 0.5] + [0.0, 0.0, 0.0, 0.8]
        self.clip[5, 0], self.clip[6, 3], self.clip[7] = np.nan, 0.0, 1e30
        self.varyings = np.zeros((room, COMPONENTS), np.float32)
        self.varyings[:VERTICES] = random.random((VERTICES, COMPONENTS))
        self.x, self.y = np.zeros(room, np.int32), np.zeros(room, np.int32)
        self.z, self.w = np.zeros(room), np.zeros(room)
        self.codes, self.kinds = np.zeros(room, np.uint8), np.zeros(TRIANGLES, np.uint8)
        self.triangles = random.integers(0, VERTICES, (TRIANGLES, 3)).astype(np.int32)
        # Small ones too, whose pixels are tested one by one.
        small = self.triangles[::2]
        self.clip[small[:, 1]] = self.clip[small[:, 0]] + random.normal(size=(len(small), 4)) * 0.02
        self.sorts = np.zeros((1, 2), np.int64)
        self.made = np.zeros((TRIANGLES * (layout.MAX_CORNERS - 2), 8), np.int32)
        self.corners = np.zeros((layout.CORNER_LISTS, layout.CORNER_ROOM), np.int64)
        self.counts = np.zeros((1, TILES), np.int64)
        #: What the code of a draw is called with.
        self.told: list[bytes] = []

    def run(self) -> list[bytes]:
        """All that the stages write."""
        place = (self.clip, WIDTH, HEIGHT, self.x, self.y, self.z, self.w, self.codes)
        self.make("project").bound(*place)(0, VERTICES)
        self.make("classify").bound(self.triangles, self.codes, self.kinds, self.sorts)(0, TRIANGLES, 0)
        assemble = self.make("assemble").bound(
            self.triangles, self.kinds, self.codes, self.clip, self.varyings, WIDTH, HEIGHT, 0, self.x, self.y, self.z,
            self.w, self.made, self.corners,
        )  # fmt: skip
        end = assemble(0, TRIANGLES, 0, VERTICES, 0)
        self.make("count_tiles").bound(self.made, TILES_X, self.counts)(0, end, 0)
        offsets = np.concatenate([[0], np.cumsum(self.counts[0])])
        cursors, lists = offsets[None, :-1].copy(), np.zeros(offsets[-1], np.int32)
        self.make("fill_tiles").bound(self.made, TILES_X, cursors, lists)(0, end, 0)
        self.mesh = (self.made, self.x, self.y, self.z, self.w, self.varyings)
        arrays = [*self.mesh, self.clip, self.codes, self.kinds, self.sorts, self.corners, self.counts, cursors, lists]
        for test, clear, offset in ((layout.LESS, 1.0, 0.0), (layout.GREATER | layout.EQUAL, 0.2, 1.5)):
            arrays.append(self.tiles(offsets, lists, test, clear, offset))
        arrays.append(self.in_order(offsets, lists))
        return [array.tobytes() for array in arrays] + self.told

    def given(self, offsets: Array, lists: Array, offset: float) -> tuple[Any, ...]:
        """What both ways of painting begin with."""
        busy = np.arange(TILES, dtype=np.int64)
        return (
            np.zeros(1, np.int64), TILES, busy, TILES_X, offsets, lists, *self.mesh, offset, offset, WIDTH, HEIGHT
        )  # fmt: skip

    def tiles(self, offsets: Array, lists: Array, test: int, clear: float, offset: float) -> Array:
        depth, ids = np.zeros(WIDTH * HEIGHT, np.float32), np.zeros(TILE * TILE, np.int32)
        slots, table = np.zeros(len(lists), np.int32), np.zeros(TILE * TILE * NUMBERS)

        def shade(context: int, shown: int, planes: int, left: int, top: int, rows: int) -> None:
            self.told.append(
                repr((left, top, rows)).encode() + ids.tobytes() + table[: NUMBERS * (ids.max() + 1)].tobytes()
            )

        callback = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 3, *[ctypes.c_int64] * 3)(shade)
        pointer = ctypes.cast(callback, ctypes.c_void_p).value
        self.make("tiles").bound(
            *self.given(offsets, lists, offset), depth, 1, test, 1, clear, ids, slots, ROWS, table, pointer,
            np.zeros(1, np.int64),
        )()  # fmt: skip
        return depth

    def in_order(self, offsets: Array, lists: Array) -> Array:
        depth, spans, table = (
            np.zeros(WIDTH * HEIGHT, np.float32),
            np.zeros(2 * layout.SPAN_ROWS, np.int32),
            np.zeros(NUMBERS),
        )

        def merge(context: int, rows: int, triangle: int, left: int, top: int, bottom: int, clear: int) -> None:
            used = spans.reshape(2, -1)[:, : 0 if clear else bottom + 4 - top]
            self.told.append(repr((left, top, bottom, clear)).encode() + used.tobytes() + table.tobytes())

        callback = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 3, *[ctypes.c_int64] * 4)(merge)
        pointer = ctypes.cast(callback, ctypes.c_void_p).value
        self.make("in_order").bound(
            *self.given(offsets, lists, 0.5), depth, 0.75, 1, spans, ROWS, table, pointer, np.zeros(1, np.int64)
        )()
        return depth


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_shipped_functions_compute_what_numba_makes_of_them_here(seed: int) -> None:
    made, expected = (Stages(make, seed) for make in (lambda name: code(name).call(), anew))
    found = made.run()
    assert found == expected.run()
    assert made.sorts.min() > 20, "some triangles are whole, some cut"
    assert len(set(made.told)) > TRIANGLES / 4
