"""Parameters of a user's kernels and effects that have the name of an option of the command, and generators."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import passgraph as pg
from passgraph.commands.entry import run

NAMES = (
    "rate",
    "bits",
    "jobs",
    "frames",
    "profile",
    "linear",
    "resume",
    "raw",
    "sound",
    "capture",
    "backend",
    "size",
    "alpha",
)
HEAD = "import passgraph as pg\nfrom passgraph import Image, vec4\n\n"


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    pg.save("in.npy", np.full((2, 3, 4), 0.25, np.float32))


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("kind", ["kernel", "effect"])
def test_a_parameter_named_as_an_option_has_one_of_its_own(name: str, kind: str) -> None:
    text = f"@pg.kernel\ndef scaled(color: Image, {name}: float = 1.0) -> vec4: return color[0, 0] * {name}\n"
    if kind == "effect":
        text += (
            "\nfrom passgraph.effects import effect\n\n@effect('own')\n"
            f"def own(color: pg.Target, {name}: float = 1.0) -> pg.Target:\n"
            f'    """Own.\n\n    Parameters\n    ----------\n    {name} : a factor\n    """\n'
            f"    return scaled(color, {name}={name})\n"
        )
    Path("own.py").write_text(HEAD + text)
    which = "own.py:own" if kind == "effect" else "own.py:scaled"
    prefix = "" if name in ("size",) else "kernel-"
    assert run(["apply", which, "in.npy", "-o", "out.npy", f"--{prefix}{name}", "3"]) == 0
    assert np.all(np.load("out.npy") == 0.75)
    assert run(["apply", which, "in.npy", "-o", "out.npy"]) == 0
    assert np.all(np.load("out.npy") == 0.25)


def test_it_may_be_needed(capsys: pytest.CaptureFixture[str]) -> None:
    Path("own.py").write_text(
        HEAD + "@pg.kernel\ndef k(color: Image, bits: float) -> vec4: return color[0, 0] * bits\n"
    )
    assert run(["apply", "own.py", "in.npy", "-o", "out.npy"]) == 2
    assert "--kernel-bits" in capsys.readouterr().err
    assert run(["apply", "own.py", "in.npy", "-o", "out.npy", "--kernel-bits", "2"]) == 0
    assert np.all(np.load("out.npy") == 0.5)


@pytest.mark.parametrize("kind", ["module", "text", "effect"])
def test_a_kernel_that_reads_no_picture_makes_one(kind: str) -> None:
    kernel = "def stripes(level: float = 0.5) -> vec4: return vec4(level, uv().x, 0.0, 1.0)\n"
    if kind == "text":
        Path("own.txt").write_text(kernel)
    else:
        text = "from passgraph import uv\n\n@pg.kernel\n" + kernel
        if kind == "effect":
            text += (
                "\nfrom passgraph.effects import effect\n\n@effect('made', 'nothing')\n"
                "def made(level: float = 0.5) -> pg.Target:\n"
                '    """Made.\n\n    Parameters\n    ----------\n    level : of red\n    """\n'
                "    return stripes(level=level)\n"
            )
        Path("own.py").write_text(HEAD + text)
    name = {"module": "own.py:stripes", "text": "own.txt", "effect": "own.py:made"}[kind]
    assert run(["apply", name, "-o", "out.npy", "--size", "4x3", "--level", "0.75"]) == 0
    made = np.load("out.npy")
    assert made.shape == (3, 4, 4)
    assert made[0, :, 0].tolist() == [0.75] * 4
    assert made[0, :, 1].tolist() == [0.125, 0.375, 0.625, 0.875]
    assert run(["apply", name, "in.npy", "-o", "out.npy"]) == 2, "it reads no picture"
