"""What loading a picture holds: told from its header, bounded before it is asked for, little beside the result."""

from __future__ import annotations

import re
import struct
import subprocess
import sys
import zlib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import passgraph as pg

WIDTH, HEIGHT = 1600, 1000
RESULT = WIDTH * HEIGHT * 16
#: Of the loader's pieces, the decoders' own tables and the allocator.
SLACK = 6 << 20
#: The most of its memory that a process held, less what it held before, in bytes; and the shape of what it loaded.
CHILD = """
import resource, sys
import numpy as np
import passgraph as pg
from passgraph.pictures import load
for warm in sys.argv[2:]:
    load(warm)
def peak():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
before = peak()
made = load(sys.argv[1])
print(peak() - before, made.shape)
"""


def _save(path: Path, size: tuple[int, int]) -> None:
    """A picture of noise, which no encoder makes small, of the kind that the name says."""
    kind, suffix = path.stem.split("-")[0], path.suffix
    noise = np.random.default_rng(1).integers(0, 256, (size[1], size[0], 3), np.uint8)
    image = Image.fromarray(noise)
    if suffix in (".exr", ".npy"):
        pg.save(path, noise.astype(np.float32))
    elif suffix in (".jxl", ".dpx", ".hdr"):
        pg.save(path, noise)
    elif kind == "deep":
        rows = np.dstack([noise, noise]).reshape(size[1], -1)
        raw = b"".join(b"\0" + row.tobytes() for row in rows)
        head = struct.pack(">IIBBBBB", *size, 16, 2, 0, 0, 0)
        chunks = ((b"IHDR", head), (b"IDAT", zlib.compress(raw, 0)), (b"IEND", b""))
        parts = (struct.pack(">I", len(d)) + t + d + struct.pack(">I", zlib.crc32(t + d)) for t, d in chunks)
        path.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(parts))
    elif kind == "gray":
        image.convert("L").save(path)
    elif kind == "turned":
        exif = Image.Exif()
        exif[0x0112] = 6
        image.save(path, exif=exif)
    else:
        options: dict[str, Any] = {".jpg": {"progressive": True}, ".webp": {"lossless": True, "method": 0}}
        image.save(path, **options.get(suffix, {}))


@pytest.mark.sampled
@pytest.mark.parametrize(
    "name",
    ["gray.png", "rgb.png", "deep.png", "rgb.jpg", "turned.jpg", "rgb.webp", "rgb.tiff", "turned.tiff", "rgb.bmp",
     "rgb.gif", "rgb.tga", "rgb.npy", "rgb.exr", "rgb.jp2", "rgb.jxl", "rgb.ppm", "rgb.dpx", "rgb.hdr"],
)  # fmt: skip
def test_loading_holds_what_the_header_foretells(tmp_path: Path, name: str) -> None:
    file = tmp_path / name
    _save(file, (WIDTH, HEIGHT))
    # a first small picture loads the decoder's code
    _save(tmp_path / name.replace(".", "-small."), (8, 8))
    with pytest.raises(pg.InputError) as refused:
        pg.load(file, max_bytes=RESULT)
    found = re.search(r"which take (\d+) bytes of memory", str(refused.value))
    assert found is not None
    foretold = int(found[1])
    command = [sys.executable, "-c", CHILD, str(file), str(tmp_path / name.replace(".", "-small."))]
    held = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True).stdout
    assert int(held.split()[0]) <= foretold + SLACK
    # noise makes files of 3 bytes a pixel, 12 for floats
    assert foretold <= (4.5 if name in ("rgb.jp2", "rgb.jxl") else 3.1) * RESULT


@pytest.mark.parametrize(("width", "height", "colour"), [(16384, 16384, 0), (15000, 15000, 6)])
def test_a_small_file_of_a_huge_picture_is_refused_by_its_memory(
    tmp_path: Path, width: int, height: int, colour: int
) -> None:
    head = struct.pack(">IIBBBBB", width, height, 8, colour, 0, 0, 0)
    chunk = struct.pack(">I", 13) + b"IHDR" + head + struct.pack(">I", zlib.crc32(b"IHDR" + head))
    (tmp_path / "a.png").write_bytes(b"\x89PNG\r\n\x1a\n" + chunk + struct.pack(">I", 0) + b"IDAT" + bytes(4))
    expected = (
        rf"{width}×{height} = {width * height} pixels, which take \d+ bytes of memory to load; "
        r"expected at most 4294967296; make it smaller, or raise max_bytes if it is meant"
    )
    with pytest.raises(pg.InputError, match=expected):
        pg.load(tmp_path / "a.png")


#: The most of its memory that a process held, less what it held before, while it refused a picture.
REFUSED = """
import resource, sys
import OpenImageIO, passgraph as pg
def peak():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
before = peak()
try:
    pg.load(sys.argv[1], max_bytes=1 << 24)
except pg.InputError as error:
    print(peak() - before, error)
"""


@pytest.mark.sampled
@pytest.mark.parametrize("suffix", [".gif", ".jp2", ".jxl"])
def test_formats_that_are_decoded_when_opened_are_refused_before(tmp_path: Path, suffix: str) -> None:
    """A few bytes of one color, 27 MB of pixels."""
    import OpenImageIO as oiio

    file = tmp_path / f"a{suffix}"
    made = oiio.ImageOutput.create(str(file))
    made.open(str(file), oiio.ImageSpec(3000, 3000, 3, "uint8"))
    made.write_image(np.zeros((3000, 3000, 3), np.uint8))
    made.close()
    assert file.stat().st_size < 1 << 14
    command = [sys.executable, "-c", REFUSED, str(file)]
    peak, said = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True).stdout.split(" ", 1)
    assert re.search(r"3000x3000.* raise max_bytes if it is meant", said)
    assert int(peak) < SLACK
    assert pg.load(file).shape == (3000, 3000, 4)


def test_the_limit_of_a_size_is_for_one_file_and_shared_by_threads(tmp_path: Path) -> None:
    """Other users of OpenImageIO in the process keep their own limit."""
    import OpenImageIO as oiio

    Image.fromarray(np.zeros((16, 16, 3), np.uint8)).save(tmp_path / "a.gif")
    before = oiio.get_int_attribute("limits:imagesize_MB")
    with ThreadPoolExecutor(8) as pool:
        limits = [1 << 24, 1 << 26, 1 << 32] * 30
        shapes = {p.shape for p in pool.map(lambda limit: pg.load(tmp_path / "a.gif", max_bytes=limit), limits)}
    assert shapes == {(16, 16, 4)}
    assert oiio.get_int_attribute("limits:imagesize_MB") == before


def test_no_program_is_started_for_a_file(tmp_path: Path) -> None:
    """PostScript would need one, whatever the file's name."""
    (tmp_path / "a.png").write_bytes(b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 8 8\nshowpage\n")
    with pytest.raises(pg.InputError, match="not a picture that can be read, or corrupt"):
        pg.load(tmp_path / "a.png")
