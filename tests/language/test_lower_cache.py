"""Programs from disk: the same as lowered ones, and another one wherever a kernel means something else."""

from __future__ import annotations

import hashlib
import importlib.util
import pickle
import sys
from pathlib import Path

import pytest

import passgraph as pg
from passgraph.graph.calls import PixelKernel
from passgraph.language import lower_cache
from passgraph.language.lower import Facts, ImageFacts, lower
from passgraph.language.lower_cache import lower_once
from passgraph.language.scalar import ScalarProgram

TEXT = """
SCALES = (0.5, 0.25, 0.125, 2.0)

def weight(x: float) -> float:
    return exp(-x * x) + {more}

def soften(color: Image, reach: Const[int] = 40, shift: ivec2 = (0, 0), table: Array[float, 4] = (1, 2, 3, 4)) -> vec4:
    total = vec4(0.0)
    for i in range(reach):
        if total.x > 9.0:
            break
        total += color[i % 3, 0] * weight(float(i) * SCALES[i % 4]) + color.texel(shift) * table[i % 4]
    return total
"""


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("PASSGRAPH_CACHE", str(tmp_path))
    return tmp_path / "programs"


def soften(more: str = "0.0") -> PixelKernel:
    return pg.kernel(source=TEXT.format(more=more), name="soften")


def from_disk(kernel: PixelKernel, facts: Facts, monkeypatch: pytest.MonkeyPatch) -> ScalarProgram:
    """A program that may not be lowered again."""
    with monkeypatch.context() as patch:
        patch.setattr(lower_cache, "_lowered", None)
        return lower_once(kernel.program, facts)


@pytest.mark.parametrize(
    "facts",
    [
        Facts(),
        Facts({"reach": 3}, {"color": ImageFacts(3, "mirror", "decode_srgb")}),
        Facts(stores=(((("quantize", 255.0),), (("quantize_half",),)),), simplify=False),
    ],
    ids=["plain", "image", "stored"],
)
def test_a_program_from_disk_is_the_program(facts: Facts, monkeypatch: pytest.MonkeyPatch) -> None:
    plain = lower(soften().program, facts)
    lower_once(soften().program, facts)
    found = from_disk(soften(), facts, monkeypatch)
    # Not by ==: a NaN among the numbers is not equal to itself.
    assert (found.key, found.sources, repr(found)) == (plain.key, plain.sources, repr(plain))
    spans = [getattr(instruction, "span", None) for instruction in found.body]
    assert spans == [getattr(instruction, "span", None) for instruction in plain.body]


def test_what_a_kernel_or_its_graph_says_otherwise_is_another_program(folder: Path) -> None:
    made = [
        lower_once(soften(more).program, facts).key
        for more in ("0.0", "1.0")
        for facts in (
            Facts(), Facts({"reach": 5}), Facts(images={"color": ImageFacts(3)}), Facts(simplify=False),
            Facts(images={"color": ImageFacts(border="zero")}), Facts(stores=(((("quantize_half",),), ()),)),
        )
    ]  # fmt: skip
    assert len(set(made)) == len(made) == len(list(folder.iterdir()))


MODULE = """
import passgraph as pg
from passgraph import Image, {wave} as wave, vec4
LEVELS = {levels}

@pg.struct
class Light:
    power: {power}
    bias: float = 1.0

@pg.kernel
def waves(color: Image, light: Light) -> vec4:
    c = color[0, 0]
    for i in range(30):
        c = c + wave(c * light.power) * LEVELS[i % 3] + light.bias
    return c
"""


def test_one_text_whose_names_mean_something_else_is_another_program(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The kernel's own lines, its file and its place there are the same each time."""
    keys = []
    for wave, levels, power in [
        ("sin", "(1.0, 2.0, 3.0)", "float"), ("cos", "(1.0, 2.0, 3.0)", "float"),
        ("sin", "(1.0, 2.0, 3.5)", "float"), ("sin", "(1.0, 2.0, 3.0)", "vec4"),
    ]:  # fmt: skip
        path = tmp_path / "waves.py"
        path.write_text(MODULE.format(wave=wave, levels=levels, power=power))
        spec = importlib.util.spec_from_file_location("waves", path)
        assert spec is not None and spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        monkeypatch.setitem(sys.modules, "waves", module)
        exec(compile(path.read_text(), str(path), "exec"), vars(module))
        keys.append(lower_once(module.waves.program, Facts()).key)
        assert keys[-1] == lower(module.waves.program, Facts()).key
    assert len(set(keys)) == 4


def test_reading_makes_nothing_but_programs(folder: Path) -> None:
    """A file with a right checksum that asks for something else: as if it were not there."""
    before = lower_once(soften().program, Facts())
    (path,) = folder.iterdir()
    for evil in (pickle.dumps((print, "run")), pickle.dumps((before.key, 3)), b"no pickle"):
        path.write_bytes(hashlib.sha256(evil).digest() + evil)
        assert lower_once(soften().program, Facts()) == before
    with pytest.raises(pickle.UnpicklingError, match=r"builtins\.print does not belong into a program"):
        lower_cache._PICKLE.read(pickle.dumps(print))


def test_short_programs_are_not_kept(folder: Path) -> None:
    lower_once(pg.kernel(source="def same(color: Image) -> vec4: return color[0, 0]").program, Facts())
    assert not folder.exists() or not list(folder.iterdir())
