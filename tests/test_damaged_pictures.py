"""Damaged picture files of every type that OpenImageIO writes: read, or refused with our own error, and never slowly.

Each type is read in a process of its own, so that a crash is a failure with the number of its damage.
"""

from __future__ import annotations

import random
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from passgraph.errors import PassgraphError
from passgraph.pictures import load

#: Suffix, channel type and channels.
TYPES = (
    "png uint8 4", "png uint16 3", "jpg uint8 3", "tif uint8 4", "tif float 3", "exr half 4", "exr float 1",
    "hdr float 3", "ppm uint8 3", "pgm uint8 1", "pfm float 3", "dpx uint16 3", "tga uint8 4", "bmp uint8 3",
    "webp uint8 4", "gif uint8 4", "jp2 uint8 3", "jxl uint8 3", "sgi uint8 3", "fits float 1", "ico uint8 4",
    "iff uint8 4", "rla uint8 3",
)  # fmt: skip
DAMAGES = 150
#: A file of 97x65 pixels is read in milliseconds.
LONGEST_S = 10.0


def damaged(data: bytes, number: int) -> bytes:
    """The data cut somewhere, or with some bytes changed, mostly in its header."""
    chance = random.Random(number)
    if chance.random() < 0.15:
        return data[: chance.randrange(len(data))]
    changed = bytearray(data)
    for _ in range(chance.choice([1, 1, 2, 4, 16])):
        place = chance.randrange(min(len(data), chance.choice([64, 256, len(data)])))
        changed[place] = chance.choice([0, 255, 127, 128, 1, chance.randrange(256)])
    return bytes(changed)


def read_all(file: Path) -> None:
    """Read every damage of a file; print the number of each before it, and stop at what is wrong."""
    data = file.read_bytes()
    for number in range(DAMAGES):
        print(number, flush=True)
        file.write_bytes(damaged(data, number))
        begin = time.monotonic()
        with suppress(PassgraphError):
            load(file)
        assert time.monotonic() - begin < LONGEST_S


@pytest.mark.slow
@pytest.mark.parametrize("kind", TYPES)
def test_damaged_files_are_read_or_refused(kind: str, tmp_path: Path) -> None:
    oiio = pytest.importorskip("OpenImageIO")
    suffix, number, channels = kind.split()
    file = tmp_path / f"a.{suffix}"
    output = oiio.ImageOutput.create(str(file))
    if output is None:
        pytest.skip(f"this OpenImageIO writes no {suffix}")
    assert output.open(str(file), oiio.ImageSpec(97, 65, int(channels), number))
    pixels = np.random.default_rng(0).random((65, 97, int(channels)), np.float32)
    assert output.write_image(pixels)
    output.close()
    load(file)
    program = (
        "import sys; from pathlib import Path; from tests.test_damaged_pictures import read_all; "
        "read_all(Path(sys.argv[1]))"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, str(file)],
        capture_output=True, text=True, errors="replace", timeout=300, cwd=Path(__file__).parents[1], check=False,
    )  # fmt: skip
    assert done.returncode == 0, f"damage {done.stdout.split()[-1:]}: {done.stderr[-800:]}"
